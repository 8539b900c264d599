//! A session's samples in flash, so that it can resume after a power cut.

use crate::halves::{Halves, StoreError, mark};
use crate::session::Session;
use core::fmt::Debug;
use delta_cal::calibration::Joint;
use delta_cal::stream::StreamCalibrator;
use delta_cal::{Real, Robot};
use delta_cal_protocol::{Begin, ControlLoop, Reader, Scalar, Wire, Writer};
use embedded_storage::nor_flash::NorFlash;

/// The firmware's scalar type: `f32` or `f64`.
pub trait Number: Real + Wire {
    /// Its name on the wire.
    const SCALAR: Scalar;
    /// Buffer for a session's samples while they are read from or written to flash.
    type StreamBytes: AsRef<[u8]> + AsMut<[u8]> + Debug;
    /// All zeros.
    const NO_STREAM_BYTES: Self::StreamBytes;
}

/// Record content that fits into 8 KiB and 16 KiB of flash with header and checksum, bytes.
const SINGLE: usize = 8_128;
const DOUBLE: usize = 16_320;

/// Maximum size of the request that precedes the snapshot, bytes.
const BEGIN: usize = 100;
const _: () = assert!(StreamCalibrator::<f32, Joint>::SNAPSHOT_BYTES + BEGIN <= SINGLE);
const _: () = assert!(StreamCalibrator::<f64, Joint>::SNAPSHOT_BYTES + BEGIN <= DOUBLE);

impl Number for f32 {
    const SCALAR: Scalar = Scalar::Single;
    type StreamBytes = [u8; SINGLE];
    const NO_STREAM_BYTES: Self::StreamBytes = [0; SINGLE];
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::Double;
    type StreamBytes = [u8; DOUBLE];
    const NO_STREAM_BYTES: Self::StreamBytes = [0; DOUBLE];
}

/// Version of the stored record.
const VERSION: u8 = 0x83;

/// How often a session is stored.
///
/// Each record replaces the previous one, and each half of the flash is erased for every other record. With the default
/// and flash rated for 10,000 erasures, samples may arrive without pause for 13 days before the flash is worn out: one
/// record per minute. A calibration without forgetting stays far below that, because the next record waits for a
/// sixteenth more samples: a million samples take about 200 records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamPace {
    /// Minimum time between two records, s; `u32::MAX`: never stores.
    pub seconds: u32,
    /// A record waits until the number of new samples is the number of stored ones divided by this; with forgetting, of
    /// their mean age if that is smaller.
    pub part: u32,
}

impl Default for StreamPace {
    fn default() -> Self {
        Self {
            seconds: 60,
            part: 16,
        }
    }
}

/// The store of one session.
#[derive(Debug)]
pub(crate) struct StreamStore<T: Number, F> {
    pub(crate) halves: Halves<F>,
    /// Buffer for the record being read or written.
    bytes: T::StreamBytes,
    pub(crate) pace: StreamPace,
    /// The stored session and its number of samples.
    stored: Option<(Begin<T>, u32)>,
    /// The control-loop turn of the last record.
    turn: u32,
}

impl<T: Number, F: NorFlash> StreamStore<T, F> {
    pub(crate) fn new(flash: F, nominal: u32) -> Self {
        let bytes = T::NO_STREAM_BYTES;
        let largest = bytes.as_ref().len();
        Self {
            halves: Halves::new(flash, mark::<T>(VERSION, nominal), largest),
            bytes,
            pace: StreamPace::default(),
            stored: None,
            turn: 0,
        }
    }

    /// Resumes the stored session, if there is one and this robot can use it.
    pub(crate) fn resume(&mut self, nominal: &Robot<T>, session: &mut Session<T>) {
        let content = match self.halves.load(self.bytes.as_mut()) {
            Ok(Some(content)) => content,
            Ok(None) => return,
            Err(error) => {
                log!(warn, "stored samples are damaged: {}", error);
                return;
            }
        };
        let mut reader = Reader::new(content);
        // Of a session that was forgotten there is only a zero.
        let Some(begin) = Begin::get(&mut reader) else {
            return;
        };
        if let Err(error) = session.resume(nominal, &begin, reader.rest()) {
            log!(warn, "stored samples are no use: {}", error);
            return;
        }
        self.stored = Some((begin, session.samples()));
        log!(
            info,
            "session {=u32:08x} goes on after {} samples",
            begin.session,
            session.samples()
        );
    }

    /// Stores the session when that is due at this turn of the control loop.
    pub(crate) fn store(&mut self, session: &Session<T>, control: &ControlLoop<T>) {
        if let Some(begin) = session.storable()
            && self.due(begin, session.samples(), control)
        {
            // Also before a failure, so that failing flash is not retried at every turn.
            self.turn = control.turns;
            match self.save(begin, session) {
                Ok(()) => log!(info, "session {=u32:08x} stored", begin.session),
                Err(error) => log!(warn, "session not stored: {}", error),
            }
        }
    }

    fn due(&self, begin: &Begin<T>, samples: u32, control: &ControlLoop<T>) -> bool {
        let stored = match &self.stored {
            Some((session, stored)) if session == begin => *stored,
            _ => 0,
        };
        let new = samples.saturating_sub(stored);
        let remembered = begin
            .forgetting
            .map_or(f64::INFINITY, Real::to_f64)
            .min(f64::from(stored));
        let enough = f64::from(new) * f64::from(self.pace.part) >= remembered;
        let never = self.pace.seconds == u32::MAX;
        let turns = self
            .pace
            .seconds
            .saturating_mul(control.turns_a_second.max(1));
        !never && new > 0 && enough && control.turns.wrapping_sub(self.turn) >= turns
    }

    /// Keeps the stored session from being resumed: its result is in use.
    pub(crate) fn forget(&mut self) {
        if self.stored.is_some() {
            match self.halves.save(&[0]) {
                Ok(()) => self.stored = None,
                Err(error) => log!(warn, "stored samples not deleted: {}", error),
            }
        }
    }

    fn save(&mut self, begin: &Begin<T>, session: &Session<T>) -> Result<(), StoreError> {
        let bytes = self.bytes.as_mut();
        let mut writer = Writer::new(bytes);
        begin.put(&mut writer);
        let used = writer.finish().ok_or(StoreError::Record)?;
        let rest = bytes.get_mut(used..).ok_or(StoreError::Record)?;
        let length = session.snapshot(rest).ok_or(StoreError::Record)?;
        let content = bytes.get(..used + length).ok_or(StoreError::Record)?;
        self.halves.save(content)?;
        self.stored = Some((*begin, session.samples()));
        Ok(())
    }
}
