//! When turns begin and how long they take.

use crate::TURNS_A_SECOND;

/// A free-running timer of the board.
///
/// It measures, and another clock may start the turns: the two may differ by 200 millionths.
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
    /// Its ticks in a second: ten or more for each turn, so that it tells a tenth of one.
    const TICKS_A_SECOND: u32;
    /// The bits that it counts; the others read 0. It must not come around within two turns.
    const MASK: u32;

    /// Ticks so far, upwards.
    fn now(&self) -> u32;
}

/// After so many turns their due time follows the most punctual of them.
const TURNS_TOGETHER: u32 = 64;

/// Measures the turns of the control loop against a [`Timer`].
///
/// Times are in parts of a tick of which a turn takes [`Timer::TICKS_A_SECOND`], so that its length is
/// exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Pace {
    /// When the last turn began, in ticks; `None` before the first.
    began: Option<u32>,
    /// How much later than due that was.
    late_by: i64,
    /// The least of it, and of how many turns, since the due time was last moved.
    least: i64,
    seen: u32,
    /// Ticks of the longest turn.
    pub(crate) longest: u32,
    /// Ticks of the longest turn while a calibration was at work.
    pub(crate) longest_calibrating: u32,
    /// Turns that began more than a tenth of their time late, or not at all.
    pub(crate) late: u32,
}

impl Pace {
    /// A turn begins.
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

    /// So long ago was the last turn due; one takes `period`.
    fn passed(&mut self, time: i64, period: i64) {
        let tenth = period / 10;
        if time < period - tenth {
            // No turn comes that early: the ones before were due earlier.
            (self.late_by, self.least, self.seen) = (0, 0, 0);
            return;
        }
        // Division is slow, and there is mostly none to do.
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

    /// Moves the due time to the most punctual of some turns: the clocks' difference does not add up.
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

    /// The turn has ended.
    pub(crate) fn end<C: Timer>(&mut self, timer: &C, calibrating: bool) {
        let began = self.began.unwrap_or_default();
        let took = timer.now().wrapping_sub(began) & C::MASK;
        self.longest = self.longest.max(took);
        if calibrating {
            self.longest_calibrating = self.longest_calibrating.max(took);
        }
    }
}
