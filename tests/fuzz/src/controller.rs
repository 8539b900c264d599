//! The controller: whatever it receives, it answers with intact frames and keeps a valid robot.

use crate::numbers::{Bits, Source, finite_robot};
use crate::solver::{JOINT_PIECES, steps};
use delta_cal::{ArmIndex, Settings};
use delta_cal_controller::{Controller, ParameterFlash, StreamFlash, StreamPace};
use delta_cal_firmware_example::machine;
use delta_cal_protocol::Estimator;
use delta_cal_protocol::{
    Begin, ControlLoop, Direction, LARGEST_FRAME, Origin, ParameterSet, Phase, Reader as From,
    Receiver, Request, Response, RevertTo, SampleMessage, Wire, Writer as To, encode,
};

in_either_precision!(controller, session);

/// A controller and its driver's state.
pub(crate) struct Bench<T: Bits> {
    pub(crate) controller: Controller<T, ParameterFlash, StreamFlash>,
    sequence: u16,
    /// The session's next sample.
    next: u32,
    solved: Option<u32>,
}

impl<T: Bits> Bench<T> {
    pub(crate) fn start(flash: ParameterFlash) -> Self {
        Self::start_with((flash, StreamFlash::new()))
    }

    /// Starts a controller that stores every sample.
    pub(crate) fn start_with((flash, stream_flash): (ParameterFlash, StreamFlash)) -> Self {
        let machine = machine(0).expect("the robot as drawn is a robot");
        let mut controller = Controller::new(machine, flash, stream_flash);
        controller.set_stream_pace(StreamPace {
            seconds: 0,
            part: u32::MAX,
        });
        controller.resume();
        Self {
            controller,
            sequence: 0,
            next: 0,
            solved: None,
        }
    }

    /// Sends bytes; the answers must be intact and their parameters finite.
    fn send(&mut self, bytes: &[u8]) -> Vec<Response<T>> {
        let mut answers = Vec::new();
        for byte in bytes {
            let Some(answer) = self.controller.receive(*byte) else {
                continue;
            };
            for (_, response) in messages::<Response<T>>(Direction::Response, &answer) {
                self.look(&response);
                answers.push(response);
            }
        }
        answers
    }

    fn look(&mut self, response: &Response<T>) {
        match response {
            Response::Parameters(parameters) => {
                assert!(
                    parameters
                        .geometry
                        .arms
                        .as_flattened()
                        .iter()
                        .all(|value| value.finite())
                );
            }
            Response::Taken { next, .. } => self.next = *next,
            Response::Status(status) => {
                if let Phase::Solved { fingerprint, .. } = status.phase {
                    self.solved = Some(fingerprint);
                }
            }
            Response::Outcome(report) => {
                let figures = [
                    report.residual_rms,
                    report.condition,
                    report.degrees_of_freedom,
                ];
                let all = figures
                    .iter()
                    .chain(&report.parameters)
                    .chain(&report.prior_share);
                assert!(
                    all.chain(&report.estimated_noise)
                        .all(|value| value.finite())
                );
                if let Some(sigma) = &report.sigma {
                    assert!(sigma.iter().all(|value| value.finite()));
                }
            }
            _ => {}
        }
    }

    /// Sends a request, after a delimiter that ends any partial frame, and expects one answer.
    pub(crate) fn ask(&mut self, request: &Request<T>) -> Response<T> {
        self.send(&[0]);
        self.sequence = self.sequence.wrapping_add(1).max(1);
        let answers = self.send(&frame(Direction::Request, self.sequence, request));
        let [answer] = answers.as_slice() else {
            panic!("{} answers to {request:?}", answers.len())
        };
        *answer
    }

    /// The generation of the parameters in use.
    pub(crate) fn generation(&mut self) -> u32 {
        match self.ask(&Request::Parameters(ParameterSet::Current)) {
            Response::Parameters(parameters) => parameters.generation,
            answer => panic!("{answer:?}"),
        }
    }

    /// Runs background work to its end.
    fn rest(&mut self) {
        let mut left = JOINT_PIECES * steps(&Settings::<T>::new());
        while self.controller.idle() {
            left -= 1;
            assert!(left > 0, "no end");
        }
    }

    /// Calibrates and applies; returns whether a result was applied and stored.
    pub(crate) fn calibrated(&mut self, samples: &[SampleMessage<T>]) -> bool {
        let session = 9;
        let begin = delta_cal_protocol::Begin {
            session,
            tolerance: Some((T::from_f64(0.5), T::from_f64(3e-3))),
            joint_zero: None,
            noise: None,
            estimator: Estimator::Arms,
            gate: false,
            forgetting: None,
        };
        self.ask(&Request::Begin(begin));
        for (index, sample) in (0..).zip(samples) {
            self.ask(&Request::Sample(SampleMessage {
                session,
                index,
                ..*sample
            }));
        }
        let count = u32::try_from(samples.len()).unwrap_or_default();
        self.ask(&Request::Solve {
            session,
            samples: count,
        });
        self.rest();
        self.solved = None;
        self.ask(&Request::Status);
        let Some(fingerprint) = self.solved else {
            return false;
        };
        let from = self.generation();
        let answer = self.ask(&Request::Apply {
            session,
            fingerprint,
            from,
        });
        matches!(answer, Response::Parameters(parameters) if parameters.origin == Origin::Calibration)
    }

    /// Updates the control loop's report after a switch of parameters.
    pub(crate) fn switch(&mut self, control: &mut ControlLoop<T>) {
        if let Some(parameters) = self.controller.take_switch() {
            control.fingerprint = parameters.fingerprint;
            control.switches = control.switches.wrapping_add(1);
            self.controller.set_control(*control);
        }
    }
}

fn session<T: Bits>(source: &mut Source<'_>) {
    let mut bench = Bench::<T>::start(ParameterFlash::new());
    while !source.is_empty() {
        match source.byte() % 16 {
            0 => {
                // Arbitrary bytes: noise, part of a frame, two frames.
                bench.send(source.bytes());
            }
            1 => {
                let sequence = source.word();
                let content = source.bytes();
                bench.send(&frame(Direction::Request, sequence, &Raw(content)));
            }
            2 => {
                let mut damaged = frame(
                    Direction::Request,
                    source.word(),
                    &request::<T>(source, bench.next),
                );
                let place = source.below(damaged.len());
                if let Some(byte) = damaged.get_mut(place) {
                    *byte ^= source.byte();
                }
                bench.send(&damaged);
                // However that was interpreted, the next frame is received.
                bench.send(&[0]);
            }
            3 => bench.rest(),
            4 => {
                for _ in 0..source.byte() {
                    bench.controller.idle();
                }
            }
            5 => {
                let before = bench.controller.current();
                let mut flash = bench.controller.into_flash();
                if source.byte() & 1 == 0 {
                    let place = source.below(flash.1.bytes.len());
                    flash.1.bytes[place] ^= source.byte();
                }
                bench = Bench::start_with(flash);
                // The status counts the stored samples.
                bench.ask(&Request::Status);
                assert_eq!(
                    bench.controller.current(),
                    before,
                    "another robot after a restart"
                );
            }
            6 => {
                let from = bench.generation();
                let to = [RevertTo::Previous, RevertTo::Nominal][source.below(2)];
                bench.send(&frame(
                    Direction::Request,
                    77,
                    &Request::<T>::Revert { from, to },
                ));
            }
            7 => {
                if let Some(fingerprint) = bench.solved {
                    let session = u32::from(source.byte() & 1) + 1;
                    let from = bench.generation();
                    bench.send(&frame(
                        Direction::Request,
                        78,
                        &Request::<T>::Apply {
                            session,
                            fingerprint,
                            from,
                        },
                    ));
                }
            }
            8 => {
                let session = u32::from(source.byte() & 1) + 1;
                for sample in source.samples::<T>(20) {
                    bench.sequence = bench.sequence.wrapping_add(1).max(1);
                    let message = SampleMessage {
                        session,
                        index: bench.next,
                        joints: sample.joints,
                        position: sample.position.into(),
                    };
                    bench.send(&frame(
                        Direction::Request,
                        bench.sequence,
                        &Request::Sample(message),
                    ));
                }
            }
            _ => {
                let next = bench.next;
                let request = request(source, next);
                bench.ask(&request);
            }
        }
        finite_robot(&bench.controller.current().robot);
    }
}

/// Raw bytes as the content of a message.
pub(crate) struct Raw<'a>(pub(crate) &'a [u8]);

impl Wire for Raw<'_> {
    fn put(&self, to: &mut To<'_>) {
        to.bytes(self.0);
    }
    fn get(_: &mut From<'_>) -> Option<Self> {
        None
    }
}

/// An intact frame with this content.
pub(crate) fn frame(direction: Direction, sequence: u16, message: &impl Wire) -> Vec<u8> {
    encode(direction, sequence, message).map_or_else(|_| Vec::new(), |frame| frame.to_vec())
}

/// Sequence numbers and messages of a byte stream that must consist of intact frames.
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

/// A request as a driver would send it, with arbitrary numbers.
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
                joint_zero: None,
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
