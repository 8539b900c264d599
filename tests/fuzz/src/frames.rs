//! Frames whose content can be anything.

use crate::numbers::{Bits, Source};
use delta_cal::ArmIndex;
use delta_cal::stream::Estimator;
use delta_cal_protocol::{
    Begin, Direction, LARGEST_FRAME, ParameterSet, Reader as From, Receiver, Request, RevertTo,
    SampleMessage, Wire, Writer as To, encode,
};

/// Bytes that are the content of a message as they are.
pub(crate) struct Raw<'a>(pub(crate) &'a [u8]);

impl Wire for Raw<'_> {
    fn put(&self, to: &mut To<'_>) {
        to.bytes(self.0);
    }
    fn get(_: &mut From<'_>) -> Option<Self> {
        None
    }
}

/// A whole frame with this content.
pub(crate) fn frame(direction: Direction, sequence: u16, message: &impl Wire) -> Vec<u8> {
    encode(direction, sequence, message).map_or_else(|_| Vec::new(), |frame| frame.to_vec())
}

/// The sequence numbers and messages of whole frames; everything must be one.
pub(crate) fn messages<M: Wire>(direction: Direction, bytes: &[u8]) -> Vec<(u16, M)> {
    let mut receiver = Receiver::<LARGEST_FRAME>::new(direction);
    let mut messages = Vec::new();
    for byte in bytes {
        if let Some(received) = receiver.push(*byte) {
            let frame = received.expect("what was sent is a frame");
            let message = frame.message().expect("what was sent is a message");
            messages.push((frame.sequence, message));
        }
    }
    messages
}

/// A request such as a driver sends, with any numbers.
pub(crate) fn request<T: Bits>(source: &mut Source<'_>, next: u32) -> Request<T> {
    let session = u32::from(source.byte() & 1) + 1;
    match source.byte() % 12 {
        0 => Request::Identify,
        1 => Request::Parameters(ParameterSet::Current),
        2 => Request::Parameters(ParameterSet::Nominal),
        3 => {
            let kind = source.byte();
            let mut pair = |bit: u8, usual: f64, small: f64| {
                (kind & bit != 0)
                    .then(|| (source.number(usual, usual), source.number(small, small)))
            };
            Request::Begin(Begin {
                session,
                tolerance: pair(1, 0.5, 3e-3),
                noise: pair(2, 0.02, 3e-5).map(|(position, joint)| ([position; 3], joint)),
                estimator: if kind & 0b1_0000 == 0 {
                    Estimator::Arms
                } else {
                    Estimator::Joint
                },
                gate: kind & 0b10_0000 != 0,
                forgetting: (kind & 0b1100_0000 == 0b0100_0000).then(|| source.number(20.0, 20.0)),
            })
        }
        4 => Request::Sample(SampleMessage {
            session,
            index: next.wrapping_add(u32::from(source.byte() / 0xf0)),
            joints: [(); 3].map(|()| source.number(0.3, 1.0)),
            position: [0.0, 0.0, -450.0].map(|x| source.number(x, 200.0)),
        }),
        5 => Request::Solve {
            session,
            samples: next,
        },
        6 => Request::Status,
        7 => Request::Outcome {
            session,
            arm: ArmIndex::ALL[source.below(3)],
        },
        8 => Request::Apply {
            session,
            fingerprint: source.wide(),
            from: u32::from(source.byte() & 3),
        },
        9 => Request::Revert {
            from: u32::from(source.byte() & 3),
            to: RevertTo::Previous,
        },
        10 => Request::Revert {
            from: u32::from(source.byte() & 3),
            to: RevertTo::Nominal,
        },
        _ => Request::Counters,
    }
}
