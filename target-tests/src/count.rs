//! Counting instructions with the SysTick timer of an emulated board.

use core::fmt::{self, Write};
use core::hint::black_box;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use delta_cal::{Calibrator, Settings};
use delta_cal_target_tests::{SAMPLES, Scalar, noise, nominal, samples};

/// One tick of 25 MHz in nanoseconds, at one instruction a nanosecond (`-icount shift=0`).
const INSTRUCTIONS_PER_TICK: u32 = 40;
const RELOAD: u32 = 0x00ff_ffff;
/// A calibrator takes samples in by so many.
const BLOCK: usize = 4;

/// A running instruction counter.
pub(crate) struct Counter(());

impl Counter {
    /// Starts the timer. `None` if it does not count instructions: a delay loop of two
    /// a turn shows that.
    pub(crate) fn start(mut timer: SYST) -> Option<Self> {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let counter = Self(());
        let turns = 200_000_u32;
        let expected = 2 * turns;
        let counted = counter.count(|| cortex_m::asm::delay(turns));
        (counted.abs_diff(expected) < expected / 100).then_some(counter)
    }

    /// Instructions of one call, to within 40. At most 671 million.
    #[allow(clippy::unused_self)] // proof that the timer runs
    pub(crate) fn count(&self, work: impl FnOnce()) -> u32 {
        let start = SYST::get_current();
        work();
        let end = SYST::get_current();
        (start.wrapping_sub(end) & RELOAD) * INSTRUCTIONS_PER_TICK
    }

    /// Instructions of one of many calls.
    fn each<I>(&self, inputs: &[I], mut work: impl FnMut(&I)) -> u32 {
        let overhead = self.count(|| {
            for input in inputs {
                black_box(input);
            }
        });
        let total = self.count(|| {
            for input in inputs {
                work(black_box(input));
            }
        });
        total.saturating_sub(overhead) / u32::try_from(inputs.len()).unwrap_or(u32::MAX)
    }
}

/// Writes one line an operation: `INSTRUCTIONS <scalar> <count> <operation>`.
#[inline(never)]
pub(crate) fn report<T: Scalar>(out: &mut dyn Write, counter: &Counter) -> fmt::Result {
    let robot = nominal::<T>();
    let samples = samples::<T>();
    let settings = Settings {
        noise: Some(noise()),
        ..Settings::default()
    };
    let mut calibrator = Calibrator::new(&robot, &settings);
    let mut line = |instructions: u32, operation: &str| {
        writeln!(
            out,
            "INSTRUCTIONS {} {instructions:>8} {operation}",
            T::NAME
        )
    };

    // Two whole blocks for the mean; what the fixture has more of waits for the solve.
    let (whole, rest) = samples.split_at(2 * BLOCK);
    let one_by_one = counter.each(whole, |sample| {
        let _ = black_box(calibrator.add(sample));
    });
    line(one_by_one, "one sample added, three arms, mean")?;
    let mut longest = 0;
    let mut again = Calibrator::new(&robot, &settings);
    for sample in whole {
        longest = longest.max(counter.count(|| {
            let _ = black_box(again.add(sample));
        }));
    }
    line(longest, "one sample added, three arms, the longest")?;
    for sample in rest {
        let _ = calibrator.add(sample);
    }

    let mut at_once = Calibrator::new(&robot, &settings);
    let block = counter.count(|| {
        let _ = black_box(at_once.add_many(black_box(&samples)));
    });
    line(
        block / u32::try_from(SAMPLES).unwrap_or(u32::MAX),
        "one sample of many added at once, three arms",
    )?;

    let solve = counter.count(|| {
        let _ = black_box(black_box(&mut calibrator).solve());
    });
    line(
        solve,
        "last sample to outcome, three arms, eight samples waiting",
    )?;

    let forward = counter.each(&samples, |sample| {
        let _ = black_box(robot.forward(&sample.joints));
    });
    line(forward, "forward")?;
    let inverse = counter.each(&samples, |sample| {
        let _ = black_box(robot.inverse(&sample.position));
    });
    line(inverse, "inverse")?;
    let sine_cosine = counter.each(&samples, |sample| {
        let [q, ..] = sample.joints;
        black_box(q.sine_cosine());
    });
    line(sine_cosine, "sine and cosine")
}
