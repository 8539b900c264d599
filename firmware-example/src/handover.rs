//! The control loop's interrupt, its timing, and its communication with the background.

use crate::{Circle, ControlLoop, Controller, NewParameters, Number, Path, TURNS_A_SECOND};
use core::sync::atomic::{AtomicBool, Ordering};
use delta_cal::Real;
use delta_cal_protocol::ControlLoop as State;
use embedded_storage::nor_flash::NorFlash;
use heapless::spsc::{Consumer, Producer, Queue};

/// Memory shared by the control loop and the background: parameters in, loop state out, each through a lock-free queue
/// of whole values. Neither side ever waits for the other.
#[derive(Debug, Default)]
pub struct Handover<T: Real> {
    parameters: Queue<NewParameters<T>, 2>,
    state: Queue<State<T>, 2>,
    calibrating: AtomicBool,
}

impl<T: Real> Handover<T> {
    /// Splits it into its two sides; the control loop starts with `parameters` and follows a path.
    pub fn split<P: Path<T>>(
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
                control_loop: ControlLoop::new(parameters, path),
                began: None,
                late_by: 0,
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
    state: Consumer<'a, State<T>>,
    calibrating: &'a AtomicBool,
}

impl<T: Number> Background<'_, T> {
    /// Gives the controller the loop's state, and the loop the controller's new parameters. Call it after each byte and
    /// step of the controller.
    pub fn exchange<F: NorFlash, S: NorFlash>(&mut self, controller: &mut Controller<T, F, S>) {
        if let Some(state) = self.state() {
            controller.set_control(state);
        }
        if self.parameters.ready()
            && let Some(parameters) = controller.take_switch()
        {
            // There is room: nothing else fills the queue.
            let _ = self.hand_over(parameters);
        }
        self.calibrating
            .store(controller.session.calibrating(), Ordering::Relaxed);
    }

    /// Hands new parameters to the control loop.
    ///
    /// # Errors
    /// The parameters, if the control loop has not yet taken the previous ones.
    pub fn hand_over(&mut self, parameters: NewParameters<T>) -> Result<(), NewParameters<T>> {
        self.parameters.enqueue(parameters)
    }

    /// The last state of the control loop, if it is new: the queue holds one.
    pub fn state(&mut self) -> Option<State<T>> {
        self.state.dequeue()
    }
}

/// The side of the control loop's interrupt, including the loop. It measures the turns against a [`Timer`].
#[allow(missing_debug_implementations)] // the ends of a queue implement no `Debug`
pub struct Foreground<'a, T: Real, P = Circle<T>> {
    /// The control loop.
    pub control_loop: ControlLoop<T, P>,
    /// Start of the last turn, in ticks; `None` before the first.
    began: Option<u32>,
    /// How late it started, in fractions of a tick, of which a turn takes [`Timer::TICKS_A_SECOND`], so that its length
    /// is exact.
    late_by: i64,
    parameters: Consumer<'a, NewParameters<T>>,
    state: Producer<'a, State<T>>,
    calibrating: &'a AtomicBool,
}

impl<T: Real, P: Path<T>> Foreground<'_, T, P> {
    /// One turn, timed with `timer`; passes the joint targets to `drive`.
    pub fn turn<C: Timer>(&mut self, timer: &C, drive: impl FnOnce(&[T; 3])) {
        const {
            assert!(
                C::TICKS_A_SECOND / 10 >= TURNS_A_SECOND,
                "a timer needs ten ticks for each turn of the control loop"
            );
            assert!(
                C::MASK / 2 >= C::TICKS_A_SECOND / TURNS_A_SECOND,
                "the timer comes around within two turns of the control loop"
            );
        }
        let now = timer.now();
        if let Some(began) = self.began.replace(now) {
            let ticks = now.wrapping_sub(began) & C::MASK;
            self.due(
                i64::from(ticks) * i64::from(TURNS_A_SECOND) + self.late_by,
                C::TICKS_A_SECOND.into(),
            );
        }
        if !self.control_loop.switching()
            && let Some(new) = self.parameters.dequeue()
        {
            self.control_loop.switch_to(&new);
        }
        drive(self.control_loop.turn());
        let state = &mut self.control_loop.state;
        state.ticks_a_second = C::TICKS_A_SECOND;
        // A full queue holds a state not yet read; the next turn's will do.
        if self.state.ready() {
            let _ = self.state.enqueue(*state);
        }
        let took = timer.now().wrapping_sub(now) & C::MASK;
        state.longest_ticks = state.longest_ticks.max(took);
        if self.calibrating.load(Ordering::Relaxed) {
            state.longest_ticks_calibrating = state.longest_ticks_calibrating.max(took);
        }
    }

    /// Counts the turns that start late by more than a tenth of their period, or not at all. The last one was due `time`
    /// ago; a turn takes `period`.
    fn due(&mut self, time: i64, period: i64) {
        let tenth = period / 10;
        // Division is slow and usually unnecessary.
        let turns = if time + tenth < 2 * period {
            1
        } else {
            (time + tenth) / period
        };
        let late_by = time - turns * period;
        let late = turns - 1 + i64::from(late_by > tenth);
        let all = &mut self.control_loop.state.late;
        *all = all.wrapping_add(u32::try_from(late).unwrap_or(u32::MAX));
        // A thousandth is forgiven, so that the difference between the two clocks does not add up.
        self.late_by = (late_by - period / 1000).max(0);
    }
}

/// A free-running timer of the board.
///
/// It only measures; a different clock may start the turns, and the two may differ by 200 ppm.
pub trait Timer {
    /// Ticks per second: at least ten per turn, to resolve a tenth of a turn.
    const TICKS_A_SECOND: u32;
    /// Mask of the bits that count; the others read 0. It must not wrap within two turns.
    const MASK: u32;

    /// Ticks so far, counting upwards.
    fn now(&self) -> u32;
}
