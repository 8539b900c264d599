//! Communication between the control loop's interrupt and the background.

use crate::ControlLoop;
use crate::pace::{Pace, Timer};
use crate::path::{Circle, Path};
use core::sync::atomic::{AtomicBool, Ordering};
use delta_cal::{Real, Robot};
use delta_cal_protocol as protocol;
use heapless::spsc::{Consumer, Producer, Queue};

/// A complete set of parameters for the control loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewParameters<T: Real> {
    /// The robot.
    pub robot: Robot<T>,
    /// The [`fingerprint`](delta_cal_protocol::Geometry::fingerprint) of its parameters.
    pub fingerprint: u32,
}

/// Memory shared by the control loop and the background: parameters in, loop state out, each through a lock-free queue
/// of whole values. Neither side ever waits for the other.
#[derive(Debug)]
pub struct Handover<T: Real> {
    parameters: Queue<NewParameters<T>, 2>,
    state: Queue<protocol::ControlLoop<T>, 2>,
    calibrating: AtomicBool,
}

impl<T: Real> Default for Handover<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Handover<T> {
    /// An empty handover.
    pub const fn new() -> Self {
        Self {
            parameters: Queue::new(),
            state: Queue::new(),
            calibrating: AtomicBool::new(false),
        }
    }

    /// Splits it into its two sides; the control loop starts with `parameters` and moves on a circle.
    pub fn split(
        &mut self,
        parameters: &NewParameters<T>,
    ) -> (Background<'_, T>, Foreground<'_, T>) {
        self.split_with(parameters, Circle::default())
    }

    /// Splits it into its two sides; the control loop starts with `parameters` and follows a path.
    pub fn split_with<P: Path<T>>(
        &mut self,
        parameters: &NewParameters<T>,
        path: P,
    ) -> (Background<'_, T>, Foreground<'_, T, P>) {
        let (parameters_in, parameters_out) = self.parameters.split();
        let (state_in, state_out) = self.state.split();
        (
            Background {
                parameters: parameters_in,
                state: state_out,
                calibrating: &self.calibrating,
            },
            Foreground {
                control_loop: ControlLoop::with_path(&parameters.robot, path),
                fingerprint: parameters.fingerprint,
                next_fingerprint: parameters.fingerprint,
                pace: Pace::default(),
                parameters: parameters_out,
                state: state_in,
                calibrating: &self.calibrating,
            },
        )
    }
}

/// The background's side.
#[allow(missing_debug_implementations)] // the ends of a queue implement no `Debug`
pub struct Background<'a, T: Real> {
    parameters: Producer<'a, NewParameters<T>>,
    state: Consumer<'a, protocol::ControlLoop<T>>,
    calibrating: &'a AtomicBool,
}

impl<T: Real> Background<'_, T> {
    /// Whether there is room for new parameters.
    pub fn ready(&self) -> bool {
        self.parameters.ready()
    }

    /// Hands new parameters to the control loop.
    ///
    /// # Errors
    /// The parameters, if the control loop has not yet taken the previous ones.
    pub fn hand_over(&mut self, parameters: NewParameters<T>) -> Result<(), NewParameters<T>> {
        self.parameters.enqueue(parameters)
    }

    /// The last state of the control loop, if it is new.
    pub fn state(&mut self) -> Option<protocol::ControlLoop<T>> {
        let mut last = None;
        while let Some(state) = self.state.dequeue() {
            last = Some(state);
        }
        last
    }

    /// Sets whether a calibration is active, so that the loop can count its turns separately.
    pub fn set_calibrating(&self, calibrating: bool) {
        self.calibrating.store(calibrating, Ordering::Relaxed);
    }
}

/// The side of the control loop's interrupt, including the loop.
#[allow(missing_debug_implementations)] // the ends of a queue implement no `Debug`
pub struct Foreground<'a, T: Real, P = Circle<T>> {
    control_loop: ControlLoop<T, P>,
    fingerprint: u32,
    next_fingerprint: u32,
    pace: Pace,
    parameters: Consumer<'a, NewParameters<T>>,
    state: Producer<'a, protocol::ControlLoop<T>>,
    calibrating: &'a AtomicBool,
}

impl<T: Real, P: Path<T>> Foreground<'_, T, P> {
    /// One turn, timed with `timer`; passes the joint targets to `drive`.
    pub fn turn<C: Timer>(&mut self, timer: &C, drive: impl FnOnce(&[T; 3])) {
        self.pace.begin(timer);
        if !self.control_loop.switching() {
            self.fingerprint = self.next_fingerprint;
            if let Some(new) = self.parameters.dequeue() {
                self.control_loop.switch_to(&new.robot);
                self.next_fingerprint = new.fingerprint;
            }
        }
        drive(self.control_loop.turn());
        // A full queue holds a state not yet read; the next turn's will do.
        if self.state.ready() {
            let state = self.said::<C>();
            let _ = self.state.enqueue(state);
        }
        self.pace
            .end(timer, self.calibrating.load(Ordering::Relaxed));
    }

    /// The control loop.
    pub const fn control_loop(&self) -> &ControlLoop<T, P> {
        &self.control_loop
    }

    fn said<C: Timer>(&self) -> protocol::ControlLoop<T> {
        let control = &self.control_loop;
        let [[x, y, z]] = control.point().data.0;
        protocol::ControlLoop {
            turns: control.turns(),
            longest_ticks: self.pace.longest,
            longest_ticks_calibrating: self.pace.longest_calibrating,
            ticks_a_second: C::TICKS_A_SECOND,
            late: self.pace.late,
            unreachable: control.unreachable(),
            switches: control.switches(),
            fingerprint: if control.switching() {
                self.fingerprint
            } else {
                self.next_fingerprint
            },
            point: [x, y, z],
            joints: *control.joints(),
        }
    }
}
