//! One request at a time, repeated until it is answered.

use super::Number;
use super::link::{DeviceError, Transport};
use delta_cal_protocol::{
    Counters, Direction, Fault, FrameError, Identity, LARGEST_FRAME, ParameterSet, Parameters,
    Receiver, Request, Response, RevertTo, Status, UNKNOWN_SEQUENCE, encode,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Timeouts and numbers of attempts.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// Time to wait for the answer to one transmission, whatever else arrives.
    pub timeout: Duration,
    /// Time limit for one request, including repetitions.
    pub deadline: Duration,
    /// Consecutive requests without an answer after which the controller counts as absent.
    pub silent_attempts: u32,
    /// Attempts at one request before the link counts as unusable.
    pub attempts: u32,
    /// Time between polls of a running solve.
    pub pause: Duration,
    /// Polls of a solve before it counts as hanging.
    pub looks: u32,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            timeout: Duration::from_millis(500),
            deadline: Duration::from_secs(10),
            silent_attempts: 8,
            attempts: 50,
            pause: Duration::from_millis(20),
            looks: 3000,
        }
    }
}

/// Sends requests to a controller, one at a time.
///
/// An unanswered request is sent again with the same sequence number; answers with another number are stale and
/// ignored. Every request may safely be repeated.
#[derive(Debug)]
pub struct Client<L> {
    transport: L,
    receiver: Receiver<LARGEST_FRAME>,
    /// Bytes received after the last frame processed.
    pending: VecDeque<u8>,
    patience: Patience,
    random: Pcg32,
    sequence: u16,
    repetitions: u32,
}

enum Received<T> {
    Answer(Response<T>),
    /// A frame was damaged, in either direction.
    Damaged,
    Nothing,
}

impl<L: Transport> Client<L> {
    /// A client whose sequence and session numbers come from `seed`; use different seeds so that clients are not
    /// confused with one another.
    pub fn new(transport: L, patience: Patience, seed: u64) -> Self {
        let mut random = Pcg32::seed_from_u64(seed);
        let [_, _, low, high] = random.next_u32().to_le_bytes();
        Self {
            transport,
            receiver: Receiver::new(Direction::Response),
            pending: VecDeque::new(),
            patience,
            random,
            sequence: u16::from_le_bytes([low, high]),
            repetitions: 0,
        }
    }

    /// The link.
    pub const fn transport_mut(&mut self) -> &mut L {
        &mut self.transport
    }

    /// Its timeouts and numbers of attempts.
    pub const fn patience(&self) -> &Patience {
        &self.patience
    }

    /// Number of repeated requests.
    pub const fn repetitions(&self) -> u32 {
        self.repetitions
    }

    /// A number for a new session.
    pub fn new_session(&mut self) -> u32 {
        self.random.next_u32().max(1)
    }

    /// Sends a request and repeats it until it is answered.
    ///
    /// # Errors
    /// The link is gone or lets nothing through, or the controller speaks another protocol version. [`Response::Fault`]
    /// is an answer, not an error.
    pub fn ask<T: Number>(&mut self, request: &Request<T>) -> Result<Response<T>, DeviceError> {
        self.sequence = match self.sequence.wrapping_add(1) {
            UNKNOWN_SEQUENCE => UNKNOWN_SEQUENCE.wrapping_add(1),
            next => next,
        };
        let frame = encode(Direction::Request, self.sequence, request)
            .map_err(|_| DeviceError::Unexpected)?;
        let (mut attempts, mut silent) = (0, 0);
        let start = self.transport.now();
        while attempts < self.patience.attempts {
            let left = self.patience.deadline.saturating_sub(self.elapsed(start));
            if left.is_zero() {
                break;
            }
            if attempts > 0 {
                self.repetitions = self.repetitions.saturating_add(1);
            }
            attempts += 1;
            self.transport.write(&frame)?;
            match self.receive(left.min(self.patience.timeout))? {
                Received::Answer(Response::Fault(Fault::UnknownVersion { spoken })) => {
                    return Err(DeviceError::OtherVersion(spoken));
                }
                Received::Answer(answer) => return Ok(answer),
                Received::Damaged => silent = 0,
                Received::Nothing => silent += 1,
            }
            if silent >= self.patience.silent_attempts {
                return Err(DeviceError::NoAnswer(silent));
            }
        }
        Err(DeviceError::Unusable(attempts))
    }

    fn elapsed(&self, since: Instant) -> Duration {
        self.transport.now().saturating_duration_since(since)
    }

    fn receive<T: Number>(&mut self, timeout: Duration) -> Result<Received<T>, DeviceError> {
        let start = self.transport.now();
        let mut buffer = [0; 256];
        loop {
            while let Some(byte) = self.pending.pop_front() {
                let frame = match self.receiver.push(byte) {
                    Some(Ok(frame)) => frame,
                    // An echo, or the rest of a frame for another client.
                    None | Some(Err(FrameError::WrongDirection)) => continue,
                    Some(Err(FrameError::Damaged | FrameError::TooLong)) => {
                        return Ok(Received::Damaged);
                    }
                    Some(Err(FrameError::UnknownVersion { version, .. })) => {
                        return Err(DeviceError::OtherVersion(version));
                    }
                };
                let (sequence, answer) = (frame.sequence, frame.message::<Response<T>>());
                match answer {
                    Some(Response::Fault(Fault::Damaged)) if sequence == UNKNOWN_SEQUENCE => {
                        return Ok(Received::Damaged);
                    }
                    _ if sequence != self.sequence => {}
                    Some(answer) => return Ok(Received::Answer(answer)),
                    None => return Err(DeviceError::Unexpected),
                }
            }
            let left = timeout.saturating_sub(self.elapsed(start));
            if left.is_zero() {
                return Ok(Received::Nothing);
            }
            let count = self.transport.read(&mut buffer, left)?;
            if count == 0 {
                return Ok(Received::Nothing);
            }
            self.pending.extend(buffer.iter().take(count));
        }
    }

    pub(super) fn change<T: Number>(
        &mut self,
        request: &Request<T>,
    ) -> Result<Response<T>, DeviceError> {
        self.ask(request).map_err(DeviceError::unconfirmed)
    }

    /// The controller's identity.
    ///
    /// # Errors
    /// Same as [`ask`](Self::ask).
    pub fn identity(&mut self) -> Result<Identity, DeviceError> {
        // The answer contains no number, so any type will do.
        match self.ask(&Request::<f32>::Identify)? {
            Response::Identity(identity) => Ok(identity),
            other => Err(unexpected(&other)),
        }
    }

    /// One of the controller's geometries.
    ///
    /// # Errors
    /// Same as [`ask`](Self::ask).
    pub fn parameters<T: Number>(
        &mut self,
        set: ParameterSet,
    ) -> Result<Parameters<T>, DeviceError> {
        match self.ask(&Request::Parameters(set))? {
            Response::Parameters(parameters) => Ok(parameters),
            other => Err(unexpected(&other)),
        }
    }

    /// The controller's status.
    ///
    /// # Errors
    /// Same as [`ask`](Self::ask).
    pub fn status<T: Number>(&mut self) -> Result<Status<T>, DeviceError> {
        match self.ask(&Request::Status)? {
            Response::Status(status) => Ok(status),
            other => Err(unexpected(&other)),
        }
    }

    /// Counters of what the controller has received since it started.
    ///
    /// # Errors
    /// Same as [`ask`](Self::ask).
    pub fn counters<T: Number>(&mut self) -> Result<Counters, DeviceError> {
        match self.ask(&Request::<T>::Counters)? {
            Response::Counters(counters) => Ok(counters),
            other => Err(unexpected(&other)),
        }
    }

    /// Reverts from the parameters of generation `from`.
    ///
    /// # Errors
    /// Same as [`ask`](Self::ask); also a controller that cannot store the parameters, and
    /// [`DeviceError::Unconfirmed`].
    pub fn revert<T: Number>(
        &mut self,
        from: u32,
        to: RevertTo,
    ) -> Result<Parameters<T>, DeviceError> {
        match self.change(&Request::Revert { from, to })? {
            Response::Parameters(parameters) => Ok(parameters),
            other => Err(unexpected(&other)),
        }
    }
}

/// The error for an answer that does not match the request.
pub(super) fn unexpected<T>(answer: &Response<T>) -> DeviceError {
    match answer {
        Response::Fault(fault) => DeviceError::Fault(*fault),
        _ => DeviceError::Unexpected,
    }
}
