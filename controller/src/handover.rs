//! The control loop's interrupt, its timing, and its communication with the background.

use crate::{ControlLoop, Controller, Limits, NewParameters, Number, Path};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
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
    words: Words,
}

#[derive(Debug, Default)]
struct Words {
    calibrating: AtomicBool,
    /// The stop after which the joints may move again.
    resume: AtomicU32,
}

impl<T: Real> Handover<T> {
    /// Splits it into its two sides; the control loop starts with `parameters`, and with the joints at rest at these
    /// angles, rad.
    pub fn split<P: Path<T>>(
        &mut self,
        parameters: &NewParameters<T>,
        path: P,
        limits: &Limits<T>,
        joints: [T; 3],
    ) -> (Background<'_, T>, Foreground<'_, T, P>) {
        let (parameters_in, parameters_out) = self.parameters.split();
        let (state_in, state_out) = self.state.split();
        (
            Background {
                parameters: parameters_in,
                state: state_out,
                words: &self.words,
            },
            Foreground {
                control_loop: ControlLoop::new(parameters, path, limits, joints),
                began: None,
                late_by: 0,
                parameters: parameters_out,
                state: state_in,
                words: &self.words,
            },
        )
    }
}

/// The background's side.
#[allow(missing_debug_implementations)] // the ends of a queue implement no `Debug`
pub struct Background<'a, T: Real> {
    parameters: Producer<'a, NewParameters<T>>,
    state: Consumer<'a, State<T>>,
    words: &'a Words,
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
        self.let_resume(controller.resume);
        let calibrating = controller.session.calibrating();
        self.words.calibrating.store(calibrating, Ordering::Relaxed);
    }

    /// Hands new parameters to the control loop.
    ///
    /// # Errors
    /// The parameters, if the control loop has not yet taken the previous ones.
    pub fn hand_over(&mut self, parameters: NewParameters<T>) -> Result<(), NewParameters<T>> {
        self.parameters.enqueue(parameters)
    }

    /// Lets the joints approach the path again after the [stop](State::stopped) at this turn.
    pub fn let_resume(&self, stopped: u32) {
        self.words.resume.store(stopped, Ordering::Relaxed);
    }

    /// The last state of the control loop, if it is new: the queue holds one.
    pub fn state(&mut self) -> Option<State<T>> {
        self.state.dequeue()
    }
}

/// The side of the control loop's interrupt, including the loop. It measures the turns against a [`Timer`].
#[allow(missing_debug_implementations)] // the ends of a queue implement no `Debug`
pub struct Foreground<'a, T: Real, P> {
    /// The control loop.
    pub control_loop: ControlLoop<T, P>,
    /// Start of the last turn, in ticks; `None` before the first.
    began: Option<u32>,
    /// How late it started, in fractions of a tick, of which a turn takes [`Timer::TICKS_A_SECOND`], so that its length
    /// is exact.
    late_by: i64,
    parameters: Consumer<'a, NewParameters<T>>,
    state: Producer<'a, State<T>>,
    words: &'a Words,
}

impl<T: Real, P: Path<T>> Foreground<'_, T, P> {
    /// One turn, timed with `timer`; passes the joint targets to `drive`.
    ///
    /// A call within half a turn after the last one is left out: turns missed in a stall are not made up for in a burst.
    pub fn turn<C: Timer>(&mut self, timer: &C, drive: impl FnOnce(&[T; 3])) {
        let (now, period) = (timer.now(), i64::from(C::TICKS_A_SECOND));
        let turns = i64::from(self.control_loop.state.turns_a_second);
        debug_assert!(
            turns > 0 && period / 10 >= turns && i64::from(C::MASK / 2) >= period / turns
        );
        if let Some(began) = self.began {
            let ticks = now.wrapping_sub(began) & C::MASK;
            let time = i64::from(ticks) * turns;
            if 2 * time < period {
                return;
            }
            self.due(time + self.late_by, period);
        }
        self.began = Some(now);
        let resume = self.words.resume.load(Ordering::Relaxed);
        self.control_loop.resume(resume);
        if let Some(new) = self.parameters.peek()
            && self.control_loop.switch_to(new)
        {
            self.parameters.dequeue();
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
        if self.words.calibrating.load(Ordering::Relaxed) {
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
/// It must run; a different clock may start the turns, and the two may differ by 200 ppm.
pub trait Timer {
    /// Ticks per second: at least ten per turn, to resolve a tenth of a turn.
    const TICKS_A_SECOND: u32;
    /// Mask of the bits that count; the others read 0. It must not wrap within two turns.
    const MASK: u32;

    /// Ticks so far, counting upwards.
    fn now(&self) -> u32;
}
