//! Timing of the control loop's turns: start and duration.

use crate::TURNS_A_SECOND;

/// A free-running timer of the board.
///
/// It only measures; a different clock may start the turns, and the two may differ by 200 ppm.
///
/// ```compile_fail,E0080
/// use delta_cal_firmware_example::{Foreground, Timer};
/// struct TooCoarse;
/// impl Timer for TooCoarse {
///     const TICKS_A_SECOND: u32 = 100;
///     const MASK: u32 = u32::MAX;
///     fn now(&self) -> u32 {
///         0
///     }
/// }
/// fn turn(control_loop: &mut Foreground<'_, f32>) {
///     control_loop.turn(&TooCoarse, |_| ());
/// }
/// # core::hint::black_box(turn as fn(&mut Foreground<'_, f32>));
/// ```
pub trait Timer {
    /// Ticks per second: at least ten per turn, to resolve a tenth of a turn.
    const TICKS_A_SECOND: u32;
    /// Mask of the bits that count; the others read 0. It must not wrap within two turns.
    const MASK: u32;

    /// Ticks so far, counting upwards.
    fn now(&self) -> u32;
}

/// After this many turns, their due time is adjusted to the most punctual one.
const TURNS_TOGETHER: u32 = 64;

/// Measures the turns of the control loop against a [`Timer`].
///
/// Times are in fractions of a tick, of which a turn takes [`Timer::TICKS_A_SECOND`], so that its length is exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Pace {
    /// Start of the last turn, in ticks; `None` before the first.
    began: Option<u32>,
    /// How late it started.
    late_by: i64,
    /// The smallest lateness, and the number of turns, since the due time was last adjusted.
    least: i64,
    seen: u32,
    /// Duration of the longest turn, ticks.
    pub(crate) longest: u32,
    /// Duration of the longest turn during a calibration, ticks.
    pub(crate) longest_calibrating: u32,
    /// Turns that started late by more than a tenth of their period, or not at all.
    pub(crate) late: u32,
}

impl Pace {
    /// Records the start of a turn.
    pub(crate) fn begin<C: Timer>(&mut self, timer: &C) {
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
        if let Some(began) = self.began {
            let ticks = now.wrapping_sub(began) & C::MASK;
            self.passed(
                i64::from(ticks) * i64::from(TURNS_A_SECOND) + self.late_by,
                C::TICKS_A_SECOND.into(),
            );
        }
        self.began = Some(now);
    }

    /// Records that the last turn was due `time` ago; a turn takes `period`.
    fn passed(&mut self, time: i64, period: i64) {
        let tenth = period / 10;
        if time < period - tenth {
            // Turns are never early: the previous ones must have been due earlier.
            (self.late_by, self.least, self.seen) = (0, 0, 0);
            return;
        }
        // Division is slow and usually unnecessary.
        let turns = if time + tenth < 2 * period {
            1
        } else {
            (time + tenth) / period
        };
        self.late_by = time - turns * period;
        let late = turns - 1 + i64::from(self.late_by > tenth);
        self.late = self
            .late
            .wrapping_add(u32::try_from(late).unwrap_or(u32::MAX));
        self.follow();
    }

    /// Adjusts the due time to the most punctual of several turns, so that the clock difference does not add up.
    fn follow(&mut self) {
        self.least = match self.seen {
            0 => self.late_by,
            _ => self.least.min(self.late_by),
        };
        self.seen += 1;
        if self.seen == TURNS_TOGETHER {
            self.late_by -= self.least;
            self.seen = 0;
        }
    }

    /// Records the end of a turn.
    pub(crate) fn end<C: Timer>(&mut self, timer: &C, calibrating: bool) {
        let began = self.began.unwrap_or_default();
        let took = timer.now().wrapping_sub(began) & C::MASK;
        self.longest = self.longest.max(took);
        if calibrating {
            self.longest_calibrating = self.longest_calibrating.max(took);
        }
    }
}
