use delta_cal_protocol::{Counters, FrameError, UNKNOWN_SEQUENCE};

/// A larger gap in sequence numbers means another driver, not a loss.
const LONGEST_GAP: u16 = 256;

/// Counts frames and faults on the link.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Reception {
    counters: Counters,
    last: Option<u16>,
}

impl Reception {
    pub(crate) fn counters(&self, overrun: u32) -> Counters {
        Counters {
            overrun,
            ..self.counters
        }
    }

    /// Counts a valid frame of this protocol version.
    pub(crate) fn whole(&mut self, sequence: u16) {
        self.counters.received = self.counters.received.wrapping_add(1);
        if sequence == UNKNOWN_SEQUENCE {
            return;
        }
        if let Some(last) = self.last {
            match steps(last, sequence) {
                0 => self.counters.repeated = self.counters.repeated.wrapping_add(1),
                step if step <= LONGEST_GAP => {
                    self.counters.lost = self.counters.lost.wrapping_add(u32::from(step) - 1);
                }
                _ => {}
            }
        }
        self.last = Some(sequence);
    }

    /// Counts bytes that are not a frame of this protocol version.
    pub(crate) fn faulty(&mut self, error: FrameError) {
        let counter = match error {
            FrameError::UnknownVersion { .. } => {
                self.counters.received = self.counters.received.wrapping_add(1);
                &mut self.counters.unknown_version
            }
            FrameError::Damaged | FrameError::TooLong | FrameError::WrongDirection => {
                &mut self.counters.damaged
            }
        };
        *counter = counter.wrapping_add(1);
    }

    /// Counts a valid frame without a valid request.
    pub(crate) fn unknown_request(&mut self) {
        self.counters.unknown_request = self.counters.unknown_request.wrapping_add(1);
    }

    /// Counts a request answered with a fault.
    pub(crate) fn refused(&mut self) {
        self.counters.refused = self.counters.refused.wrapping_add(1);
    }
}

/// The distance from `from` to `to` on the circle 1, 2, … 65535, 1.
fn steps(from: u16, to: u16) -> u16 {
    if to >= from {
        to - from
    } else {
        u16::MAX - (from - to)
    }
}
