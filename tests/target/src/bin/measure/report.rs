//! Counting, and the lines that are written.

use core::fmt::{self, Arguments, Write};
use core::hint::black_box;
use delta_cal::calibration::{Calibrator, Estimator};
use delta_cal::{Progress, Sample, Settings};
use delta_cal_target_tests::{
    Counter, measurements_of, noise, nominal, robot_near, stack_of, tolerance,
};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// Inlined, its array would be in the frame of the caller.
#[inline(never)]
fn takes_two_kilobytes() {
    let mut known = [0_u32; 512];
    known.fill(black_box(1));
    black_box(&mut known);
}

pub(crate) struct Report<'a> {
    console: &'a mut dyn Write,
    counter: Counter,
}

impl<'a> Report<'a> {
    pub(crate) fn new(console: &'a mut dyn Write) -> Result<Self, fmt::Error> {
        let Some(counter) = Counter::start() else {
            writeln!(
                console,
                "No instruction counts: they need -icount shift=6,sleep=off."
            )?;
            return Err(fmt::Error);
        };
        // What is known to take 2 KiB and little more must be seen to.
        let known = stack_of(&mut || takes_two_kilobytes());
        if !(2048..2300).contains(&known) {
            writeln!(console, "The stack is not measured right.")?;
            return Err(fmt::Error);
        }
        Ok(Self { console, counter })
    }

    /// Instructions of one call.
    pub(crate) fn count(&mut self, work: impl FnOnce()) -> Result<u32, fmt::Error> {
        self.counter.count(work).map_err(|_| fmt::Error)
    }

    /// From the last sample to parameters and covariance, or to a refusal.
    pub(crate) fn solve<E: Estimator>(
        &mut self,
        calibrator: &mut Calibrator<f32, E>,
    ) -> Result<Solve, fmt::Error> {
        let flush = self.count(|| black_box(&mut *calibrator).flush())?;
        let mut longest = self.count(|| {
            let _ = black_box(black_box(&mut *calibrator).solve());
        })?;
        let mut total = flush + longest;
        let mut progress = Progress::Working;
        while progress == Progress::Working {
            let step = self.count(|| progress = black_box(&mut *calibrator).step())?;
            total += step;
            longest = longest.max(step);
        }
        Ok(Solve {
            flush,
            longest,
            total,
        })
    }

    pub(crate) fn figure(&mut self, item: Arguments<'_>, value: usize) -> fmt::Result {
        writeln!(self.console, "MEASURED f32/{item} {value}")
    }

    pub(crate) fn instructions(&mut self, item: Arguments<'_>, value: u32) -> fmt::Result {
        self.figure(item, value as usize)
    }
}

/// Instructions of a solve: of its flush, of the longest of the other calls, of all.
pub(crate) struct Solve {
    pub(crate) flush: u32,
    pub(crate) longest: u32,
    pub(crate) total: u32,
}

/// Mean and worst of many counts.
#[derive(Default)]
pub(crate) struct Counts {
    sum: u64,
    number: u32,
    pub(crate) worst: u32,
}

impl Counts {
    pub(crate) fn note(&mut self, count: u32) {
        self.sum += u64::from(count);
        self.number += 1;
        self.worst = self.worst.max(count);
    }

    pub(crate) fn mean(&self) -> u32 {
        let mean = self.sum / u64::from(self.number.max(1));
        u32::try_from(mean).unwrap_or(u32::MAX)
    }
}

/// What firmware states: nothing, the noise, both.
pub(crate) fn stated() -> [Settings<f32>; 3] {
    let defaults = Settings::default();
    let noise = Some(noise());
    [
        defaults,
        defaults.with_noise(noise),
        defaults.with_noise(noise).with_tolerance(tolerance()),
    ]
}

/// Measurements of the robot of this number.
pub(crate) fn measured<const N: usize>(seed: u64) -> [Sample<f32>; N] {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = robot_near(&nominal::<f32>(), 1.0, &mut rng);
    measurements_of(&truth, Some(&noise()), &mut rng)
}
