//! When turns begin and how long they take.

use crate::TURNS_A_SECOND;

/// A free-running timer of the board.
pub trait Timer {
    /// Its ticks in a second.
    const TICKS_A_SECOND: u32;
    /// The bits that it counts; the others read 0. It must not come around within two turns.
    const MASK: u32;

    /// Ticks so far, upwards.
    fn now(&self) -> u32;
}

/// Measures the turns of the control loop against a [`Timer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Pace {
    /// When the current turn should have begun; `None` before the first.
    due: Option<u32>,
    began: u32,
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
        let period = C::TICKS_A_SECOND / TURNS_A_SECOND;
        self.began = timer.now();
        let late_by = match self.due {
            None => 0,
            Some(due) => self.began.wrapping_sub(due) & C::MASK,
        };
        // The timers may drift by a few ticks: too early is not late by a whole turn of the timer. All
        // but the last eighth of that turn is for stops, as of a processor whose flash is erased.
        let late_by = if late_by > C::MASK - C::MASK / 8 {
            0
        } else {
            late_by
        };
        let left_out = late_by / period;
        let late = left_out + u32::from(late_by % period > period / 10);
        self.late = self.late.wrapping_add(late);
        self.due = Some(match self.due {
            None => self.began.wrapping_add(period) & C::MASK,
            Some(due) => due.wrapping_add((left_out + 1) * period) & C::MASK,
        });
    }

    /// The turn has ended.
    pub(crate) fn end<C: Timer>(&mut self, timer: &C, calibrating: bool) {
        let took = timer.now().wrapping_sub(self.began) & C::MASK;
        self.longest = self.longest.max(took);
        if calibrating {
            self.longest_calibrating = self.longest_calibrating.max(took);
        }
    }
}
