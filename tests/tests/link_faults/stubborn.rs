//! Ports and controllers that keep a client busy: every request and every session comes to its end.

use crate::controller::driver::begin;
use delta_cal::{Refusal, Sample};
use delta_cal_host::device::{Client, DeviceError, Patience, Transport, calibrate, in_use};
use delta_cal_protocol::{
    Begin, ControlLoop, Direction, Fault, Geometry, LARGEST_FRAME, Origin, Parameters, Phase,
    Receiver, Request, Response, Status, encode,
};
use delta_cal_tests::paper_robot;
use nalgebra::Vector3;
use std::cell::Cell;
use std::collections::VecDeque;
use std::io::{self, Read};
use std::time::{Duration, Instant};

/// More than any session here may take.
const MOST: usize = 1_000_000;

/// A port that says something else again and again, and has its own time.
struct Chatter {
    says: Vec<u8>,
    waits: Duration,
    start: Instant,
    elapsed: Duration,
    reads: usize,
}

impl Chatter {
    fn new(says: &[u8]) -> Self {
        Self {
            says: says.to_vec(),
            waits: Duration::from_micros(500),
            start: Instant::now(),
            elapsed: Duration::ZERO,
            reads: 0,
        }
    }
}

impl Transport for Chatter {
    fn write(&mut self, _bytes: &[u8]) -> io::Result<()> {
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.reads += 1;
        assert!(self.reads < MOST, "it reads for ever");
        self.elapsed += self.waits.min(timeout);
        self.says.as_slice().read(buffer)
    }

    fn now(&self) -> Instant {
        self.start + self.elapsed
    }
}

#[test]
fn a_port_that_chatters_is_no_controller() {
    let patience = Patience::default();
    let stale = encode(Direction::Response, 1, &Response::<f32>::Fault(Fault::Busy)).unwrap();
    let echo = encode(Direction::Request, 1, &Request::<f32>::Status).unwrap();
    for (says, silent) in [
        (&b"temperature 21.5\r\n"[..], true),
        (b".", true),
        (&stale, true),
        (&echo, true),
        (b"\0\0text\0", false),
        (b"\x05damaged\0", false),
    ] {
        let mut client = Client::new(Chatter::new(says), patience, 1);
        let error = client.status::<f32>().unwrap_err();
        match error {
            DeviceError::NoAnswer(attempts) if silent => {
                assert_eq!(attempts, patience.silent_attempts);
            }
            DeviceError::Unusable(_) if !silent => {}
            error => panic!("{error:?}"),
        }
        let took = client.transport_mut().elapsed;
        assert!(took <= patience.deadline, "{took:?}");
        assert!(!silent || took >= patience.timeout, "{took:?}");
    }
}

/// Damaged frames just before each attempt is over: too few of them to give up before the deadline.
#[test]
fn a_request_has_a_deadline() {
    let patience = Patience {
        attempts: u32::MAX,
        ..Patience::default()
    };
    let mut slow = Chatter::new(b"\x05damaged\0");
    slow.waits = patience.timeout * 9 / 10;
    let mut client = Client::new(slow, patience, 1);
    let error = client.status::<f32>().unwrap_err();
    assert!(matches!(error, DeviceError::Unusable(_)), "{error:?}");
    let took = client.transport_mut().elapsed;
    let late = patience.deadline + Duration::from_millis(1);
    assert!((patience.deadline..late).contains(&took), "{took:?}");
}

/// A controller that is asked and answers as it likes.
struct Scripted<F> {
    answer: F,
    receiver: Receiver<LARGEST_FRAME>,
    on_the_way: VecDeque<u8>,
    requests: usize,
}

impl<F: FnMut(&Request<f32>) -> Response<f32>> Scripted<F> {
    fn client(answer: F) -> Client<Self> {
        let scripted = Self {
            answer,
            receiver: Receiver::new(Direction::Request),
            on_the_way: VecDeque::new(),
            requests: 0,
        };
        let patience = Patience {
            pause: Duration::ZERO,
            ..Patience::default()
        };
        Client::new(scripted, patience, 1)
    }
}

impl<F: FnMut(&Request<f32>) -> Response<f32>> Transport for Scripted<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            if let Some(Ok(frame)) = self.receiver.push(*byte) {
                self.requests += 1;
                assert!(self.requests < MOST, "it asks for ever");
                let request = frame.message().expect("a request");
                let response = (self.answer)(&request);
                let answer = encode(Direction::Response, frame.sequence, &response).unwrap();
                self.on_the_way.extend(answer);
            }
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], _timeout: Duration) -> io::Result<usize> {
        self.on_the_way.read(buffer)
    }
}

fn samples() -> Vec<Sample<f32>> {
    let sample = Sample {
        joints: [0.1; 3],
        position: Vector3::new(0.0, 0.0, -450.0),
    };
    vec![sample; 20]
}

fn status(session: u32, phase: Phase, turns: u32) -> Response<f32> {
    Response::Status(Status {
        session,
        phase,
        gate: None,
        control: ControlLoop {
            turns,
            ..ControlLoop::new(0)
        },
    })
}

/// The answer of a controller that does as it should, up to the samples.
fn honest(request: &Request<f32>, open: &Cell<u32>) -> Response<f32> {
    match request {
        Request::Begin(Begin { session, .. }) => {
            open.set(*session);
            Response::Taken {
                session: *session,
                next: 0,
            }
        }
        Request::Parameters(_) => Response::Parameters(Parameters {
            origin: Origin::Nominal,
            generation: 0,
            geometry: Geometry::of(&paper_robot()),
        }),
        Request::Sample(sample) => Response::Taken {
            session: sample.session,
            next: sample.index + 1,
        },
        _ => status(open.get(), Phase::Collecting { samples: 0 }, 0),
    }
}

/// Sends 20 measurements; how many requests that took.
fn gives_up(answer: impl FnMut(&Request<f32>) -> Response<f32>) -> usize {
    let mut client = Scripted::client(answer);
    let error = calibrate(&mut client, &begin(0), &samples(), &mut |_| {}).unwrap_err();
    assert!(matches!(error, DeviceError::SessionsLost(_)), "{error:?}");
    client.transport_mut().requests
}

#[test]
fn a_controller_that_takes_no_sample_in_is_given_up() {
    let open = Cell::new(0);
    let stuck = |next: u32| {
        let open = &open;
        move |request: &Request<f32>| match request {
            Request::Sample(sample) => Response::Taken {
                session: sample.session,
                next,
            },
            request => honest(request, open),
        }
    };
    let out_of_order = |request: &Request<f32>| match request {
        Request::Sample(_) => Response::Fault(Fault::OutOfOrder { next: 0 }),
        request => honest(request, &open),
    };
    for requests in [
        gives_up(stuck(0)),
        gives_up(stuck(7)),
        gives_up(stuck(u32::MAX)),
        gives_up(out_of_order),
    ] {
        assert!(requests <= 5 * 30, "{requests} requests");
    }
}

/// Two clients drew the same number: the second must not go on with the samples of the first.
#[test]
fn a_session_that_has_samples_already_is_another_clients() {
    let open = Cell::new(0);
    let collides = Cell::new(true);
    let mut numbers = Vec::new();
    let mut client = Scripted::client(|request: &Request<f32>| match request {
        Request::Begin(Begin { session, .. }) => {
            numbers.push(*session);
            match honest(request, &open) {
                Response::Taken { session, .. } if collides.replace(false) => {
                    Response::Taken { session, next: 3 }
                }
                response => response,
            }
        }
        Request::Sample(sample) => {
            assert_eq!(numbers.last(), Some(&sample.session));
            honest(request, &open)
        }
        Request::Solve { .. } => Response::Fault(Fault::Busy),
        request => honest(request, &open),
    });
    let ended = calibrate(&mut client, &begin(0), &samples(), &mut |_| {});
    // It came as far as the solve, with all samples of its own.
    assert!(
        matches!(ended, Err(DeviceError::Fault(Fault::Busy))),
        "{ended:?}"
    );
    drop(client);
    assert_eq!(numbers.len(), 2);
    assert_ne!(numbers[0], numbers[1]);
}

/// The loop counts its turns from zero again: the turns before the restart belong to no calibration.
#[test]
fn a_restart_before_the_session_is_no_part_of_it() {
    let open = Cell::new(0);
    let mut turns = 1_000_000;
    let refusal = Refusal::WrongSide;
    let mut client = Scripted::client(|request: &Request<f32>| {
        turns += 1;
        match request {
            Request::Begin(_) => {
                turns = 0;
                honest(request, &open)
            }
            Request::Status => status(open.get(), Phase::Collecting { samples: 0 }, turns),
            Request::Solve { samples, .. } => {
                let samples = *samples;
                let phase = Phase::CalibrationRefused { samples, refusal };
                status(open.get(), phase, turns)
            }
            request => honest(request, &open),
        }
    });
    let finished = calibrate(&mut client, &begin(0), &samples(), &mut |_| {}).unwrap();
    assert_eq!(finished.result, Err(refusal));
    let [before, after] = [finished.status_before, finished.status_after].map(|s| s.control.turns);
    assert!(before < after && after <= 25, "{before}, {after}");
}

/// A loop of 50 Hz and one of 20 kHz take as many turns as their boards say; one that does not turn is not waited for.
#[test]
fn a_switch_is_waited_for_while_the_loop_turns() {
    for (step, switches, used) in [
        (1, 2000, true),
        (400, 2000, true),
        (0, 2000, false),
        (9, 9000, false),
    ] {
        let mut turns = 0;
        let mut client = Scripted::client(|request: &Request<f32>| {
            let fingerprint = Geometry::of(&paper_robot::<f32>()).fingerprint();
            turns += step;
            let mut answer = match request {
                Request::Status => status(0, Phase::Idle, turns),
                request => honest(request, &Cell::new(0)),
            };
            if let Response::Status(status) = &mut answer {
                status.control.turns_a_second = 50 * step;
                status.control.fingerprint =
                    fingerprint * u32::from(step > 0 && turns >= switches * step);
            }
            answer
        });
        let fingerprint = Geometry::of(&paper_robot::<f32>()).fingerprint();
        let found = in_use::<f32, _>(&mut client, fingerprint);
        assert_eq!(found.is_ok(), used, "{step}");
    }
}
