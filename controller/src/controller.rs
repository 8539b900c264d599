//! Handles the bytes received by the controller.

use crate::geometry::{Geometries, Machine};
use crate::session::Session;
use crate::stream_store::{StreamPace, StreamStore};
use crate::{NewParameters, Number};
use delta_cal_protocol::{
    ControlLoop, Counters, Direction, Fault, FrameError, Geometry, Identity, LARGEST_FRAME,
    ParameterSet, Receiver, Request, Response, Status, UNKNOWN_SEQUENCE, VERSION, encode,
};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;

/// A larger gap in sequence numbers means another driver, not a loss.
const LONGEST_GAP: u16 = 256;
/// Size of the largest request, with margin: a geometry with transmissions in `f64` takes 330 bytes.
const LARGEST_REQUEST: usize = 384;

/// Everything except the control loop: answers requests, adds samples, solves in bounded steps, stores and hands over.
///
/// `F` is NOR flash for the parameters alone: two halves of whole pages, at least 704 bytes each. `S` is NOR flash for
/// the samples of a session: two halves of whole pages, at least 8 KiB each, 16 KiB in `f64`.
///
/// ```
/// use delta_cal::SymmetricRobot;
/// use delta_cal_controller::{Controller, Machine, ParameterFlash, StreamFlash};
/// use delta_cal_protocol::{Direction, Request, encode};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0_f32, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let machine = Machine { nominal: nominal.robot()?, work: &[[0.0, 0.0, -450.0]], processor: 0 };
/// let mut controller = Controller::new(machine, ParameterFlash::new(), StreamFlash::new());
/// assert_eq!(controller.check(), Ok(()));
/// let request = encode(Direction::Request, 1, &Request::<f32>::Identify)?;
/// let answer = request.iter().find_map(|byte| controller.receive(*byte));
/// assert!(answer.is_some());
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Controller<T: Number, F, S> {
    processor: u32,
    receiver: Receiver<LARGEST_REQUEST>,
    /// Statistics of the link. Whoever moves the bytes sets `overrun`, the number lost before they arrived here.
    pub counters: Counters,
    /// Sequence number of the last request.
    last: Option<u16>,
    pub(crate) session: Session<T>,
    geometries: Geometries<T, F>,
    streams: StreamStore<T, S>,
    /// Parameters not yet handed to the control loop.
    switch: Option<NewParameters<T>>,
    /// The stop after which the joints may move again.
    pub(crate) resume: u32,
    /// What the board states and cannot be.
    wrong: Option<Fault>,
    control: ControlLoop<T>,
}

impl<T: Number, F: NorFlash, S: NorFlash> Controller<T, F, S> {
    /// Reads the parameters from `flash`; [`resume`](Self::resume) reads `stream_flash`. Whether the regions and the
    /// machine are possible says [`check`](Self::check).
    pub fn new(machine: Machine<T>, flash: F, stream_flash: S) -> Self {
        let processor = machine.processor;
        log!(
            info,
            "start: firmware {}, {} bytes a number, processor {=u32:08x}",
            FIRMWARE,
            size_of::<T>(),
            processor
        );
        let geometries = Geometries::load(machine, flash);
        let fingerprint = geometries.current.fingerprint;
        let streams = StreamStore::new(stream_flash, geometries.nominal.fingerprint);
        let regions = [geometries.store.range(0), streams.halves.range(0)];
        let wrong = if regions.iter().any(Result::is_err) {
            Some(Fault::Region)
        } else {
            (!geometries.near(&geometries.nominal.robot)).then_some(Fault::OtherRobot)
        };
        Self {
            streams,
            resume: 0,
            wrong,
            processor,
            receiver: Receiver::new(Direction::Request),
            counters: Counters::default(),
            last: None,
            session: Session::none(),
            geometries,
            switch: None,
            control: ControlLoop::new(fingerprint),
        }
    }

    /// Whether the board's regions and machine are possible. If not, the controller answers, and refuses with the same
    /// fault whatever changes its state.
    ///
    /// # Errors
    /// [`Fault::Region`]; [`Fault::OtherRobot`] if the nominal robot does not reach a work point.
    pub fn check(&self) -> Result<(), Fault> {
        self.wrong.map_or(Ok(()), Err)
    }

    /// Resumes a session interrupted by a restart, if its samples are stored. Call it once, before the first byte. It
    /// is separate from [`new`](Self::new) so that the controller can be constructed in static memory.
    pub fn resume(&mut self) {
        let nominal = &self.geometries.nominal.robot;
        self.streams.resume(nominal, &mut self.session);
    }

    /// Sets how often the samples of a session are stored.
    pub const fn set_stream_pace(&mut self, pace: StreamPace) {
        self.streams.pace = pace;
    }

    /// Processes a byte from the link. If it completes a request, returns the answer, a complete frame.
    pub fn receive(&mut self, byte: u8) -> Option<Vec<u8, LARGEST_FRAME>> {
        let (sequence, response) = self.respond(byte)?;
        encode(Direction::Response, sequence, &response).ok()
    }

    fn respond(&mut self, byte: u8) -> Option<(u16, Response<T>)> {
        Some(match self.receiver.push(byte)? {
            Ok(frame) => {
                let sequence = frame.sequence;
                let request = frame.message::<Request<T>>();
                self.count(sequence);
                (sequence, self.answer(request))
            }
            Err(error) => {
                let counters = &mut self.counters;
                if let FrameError::UnknownVersion { sequence, .. } = error {
                    increment(&mut counters.received);
                    increment(&mut counters.unknown_version);
                    let fault = Fault::UnknownVersion { spoken: VERSION };
                    return Some((sequence, Response::Fault(fault)));
                }
                increment(&mut counters.damaged);
                // Answering an echo would loop forever.
                if error == FrameError::WrongDirection {
                    return None;
                }
                (UNKNOWN_SEQUENCE, Response::Fault(Fault::Damaged))
            }
        })
    }

    /// One bounded step of background work; `true` while there is more.
    pub fn idle(&mut self) -> bool {
        if self.session.step() {
            return true;
        }
        self.streams.store(&self.session, &self.control);
        false
    }

    /// Counts a valid frame of this protocol version.
    fn count(&mut self, sequence: u16) {
        let counters = &mut self.counters;
        increment(&mut counters.received);
        if sequence == UNKNOWN_SEQUENCE {
            return;
        }
        match self.last.map(|last| steps(last, sequence)) {
            Some(0) => increment(&mut counters.repeated),
            Some(step) if step <= LONGEST_GAP => {
                counters.lost = counters.lost.wrapping_add(u32::from(step) - 1);
            }
            _ => {}
        }
        self.last = Some(sequence);
    }

    /// The parameters in use.
    pub fn current(&self) -> NewParameters<T> {
        self.geometries.current.clone()
    }

    /// New parameters for the control loop, returned once; call it when the loop can accept them.
    pub fn take_switch(&mut self) -> Option<NewParameters<T>> {
        self.switch.take()
    }

    /// Sets the control loop's last state, for [`Request::Status`].
    pub fn set_control(&mut self, control: ControlLoop<T>) {
        if control.switches != self.control.switches {
            log!(
                info,
                "control loop switched to {=u32:08x} at turn {}",
                control.fingerprint,
                control.turns
            );
        }
        self.geometries.note(&control);
        self.control = control;
    }

    /// Returns both flashes, to simulate switching the controller off.
    pub fn into_flash(self) -> (F, S) {
        (self.geometries.store.flash, self.streams.halves.flash)
    }

    fn answer(&mut self, request: Option<Request<T>>) -> Response<T> {
        let Some(request) = request else {
            increment(&mut self.counters.unknown_request);
            return Response::Fault(Fault::UnknownRequest);
        };
        self.handle(&request).unwrap_or_else(|fault| {
            increment(&mut self.counters.refused);
            Response::Fault(fault)
        })
    }

    fn handle(&mut self, request: &Request<T>) -> Result<Response<T>, Fault> {
        use Request::{Counters, Identify, Parameters, Status};
        if !matches!(request, Identify | Parameters(_) | Status | Counters) {
            self.check()?;
        }
        Ok(match request {
            Request::Identify => Response::Identity(Identity {
                firmware: FIRMWARE,
                scalar: T::SCALAR,
                processor: self.processor,
                nominal: self.geometries.nominal.fingerprint,
            }),
            Request::Parameters(set) => Response::Parameters(self.geometries.message(*set)),
            Request::Status => self.status(),
            Request::Counters => Response::Counters(self.counters),
            Request::Resume { stopped } => {
                self.resume = *stopped;
                self.status()
            }
            Request::Begin(begin) => {
                let nominal = &self.geometries.nominal.robot;
                self.session.begin(nominal, begin)?;
                self.taken()
            }
            Request::Sample(sample) => {
                self.session.sample(sample)?;
                self.taken()
            }
            Request::Solve { session, samples } => {
                self.session.solve(*session, *samples)?;
                self.status()
            }
            Request::Outcome { session, arm } => {
                Response::Outcome(self.session.report(*session, *arm)?)
            }
            Request::Apply {
                session,
                fingerprint,
                from,
            } => {
                let robot = self.session.outcome(*session)?;
                let there = Geometry::of(&robot).fingerprint();
                if there != *fingerprint {
                    return Err(Fault::OtherParameters { there });
                }
                let switched = self.geometries.apply(*from, &robot)?;
                self.streams.forget();
                self.switched(switched)
            }
            Request::Revert { from, to } => {
                let switched = self.geometries.revert(*from, *to)?;
                self.switched(switched)
            }
            Request::Adopt { from, geometry } => {
                let robot = geometry.robot().map_err(Fault::Geometry)?;
                let switched = self.geometries.apply(*from, &robot)?;
                self.switched(switched)
            }
            _ => return Err(Fault::UnknownRequest),
        })
    }

    fn taken(&self) -> Response<T> {
        Response::Taken {
            session: self.session.number(),
            next: self.session.samples(),
        }
    }

    fn status(&self) -> Response<T> {
        Response::Status(Status {
            session: self.session.number(),
            phase: self.session.phase(),
            gate: self.session.gate(),
            control: self.control,
        })
    }

    /// The answer to a request that changes parameters; the control loop receives them if they are new.
    fn switched(&mut self, new: bool) -> Response<T> {
        if new {
            self.switch = Some(self.geometries.current.clone());
        }
        Response::Parameters(self.geometries.message(ParameterSet::Current))
    }
}

fn increment(counter: &mut u32) {
    *counter = counter.wrapping_add(1);
}

/// The distance from `from` to `to` on the circle 1, 2, … 65535, 1.
const fn steps(from: u16, to: u16) -> u16 {
    if to >= from {
        to - from
    } else {
        u16::MAX - (from - to)
    }
}

const FIRMWARE: [u16; 3] = [
    decimal(env!("CARGO_PKG_VERSION_MAJOR")),
    decimal(env!("CARGO_PKG_VERSION_MINOR")),
    decimal(env!("CARGO_PKG_VERSION_PATCH")),
];

const fn decimal(text: &str) -> u16 {
    match u16::from_str_radix(text, 10) {
        Ok(value) => value,
        Err(_) => u16::MAX,
    }
}
