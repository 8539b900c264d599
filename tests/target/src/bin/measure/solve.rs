//! Instructions from the last sample to parameters and covariance.

use crate::instructions::Counts;
use crate::report::Report;
use core::fmt;
use core::hint::black_box;
use delta_cal::calibration::Start;
use delta_cal::simulate::simulate_sample;
use delta_cal::{Calibrator, Progress, Refusal, RobotOutcome, RobotSolver, Sample, Settings};
use delta_cal_target_tests::{Counter, Overflow};
use delta_cal_target_tests::{Scalar, measurements_of, noise, nominal, robot_near, tolerance};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// One solve after another number of samples, up to this many more: however many a calibrator
/// keeps back to take them in together, every number of them is met.
const MORE: usize = 16;
const MOST: usize = 1000;
const MANY: usize = 100_000;
const ROBOTS: u64 = 40;

/// What a solve cost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cost {
    /// From the last sample to parameters and covariance.
    pub(crate) total: u32,
    /// Its longest step, during which a control loop's idle time belongs to the solver.
    longest_step: u32,
}

/// Three arms, from the last sample to parameters and covariance.
pub(crate) fn solve<T: Scalar>(
    counter: &mut Counter,
    calibrator: &mut Calibrator<T>,
) -> Result<(Cost, Result<RobotOutcome<T>, Refusal>), Overflow> {
    let mut solver = Err(Refusal::Unfinished);
    let mut total =
        counter.count(|| solver = black_box(RobotSolver::new(black_box(calibrator))))?;
    let mut longest_step = total;
    let mut solver = match solver {
        Ok(solver) => solver,
        Err(refusal) => {
            return Ok((
                Cost {
                    total,
                    longest_step,
                },
                Err(refusal),
            ));
        }
    };
    let refused = loop {
        let mut progress = Ok(Progress::Working);
        let step = counter.count(|| progress = solver.step(black_box(calibrator)))?;
        total += step;
        longest_step = longest_step.max(step);
        match progress {
            Ok(Progress::Working) => {}
            Ok(Progress::Finished) => break None,
            Err(refusal) => break Some(refusal),
        }
    };
    let mut outcome = Err(Refusal::Unfinished);
    if let Some(refusal) = refused {
        outcome = Err(refusal);
    } else {
        total += counter.count(|| outcome = black_box(solver.outcome()))?;
    }
    Ok((
        Cost {
            total,
            longest_step,
        },
        outcome,
    ))
}

fn overflow(_: Overflow) -> fmt::Error {
    fmt::Error
}

#[derive(Default)]
struct Figures {
    total: Counts,
    step: Counts,
    refused: u32,
}

impl Figures {
    fn note<T: Scalar>(&mut self, cost: Cost, outcome: &Result<RobotOutcome<T>, Refusal>) {
        if outcome.is_ok() {
            self.total.note(cost.total);
            self.step.note(cost.longest_step);
        } else {
            self.refused += 1;
        }
    }

    fn write(&self, out: &mut Report<'_>, item: fmt::Arguments<'_>, words: &str) -> fmt::Result {
        // A figure of refusals alone would say nothing.
        if self.total.worst() == 0 || self.refused > 0 {
            writeln!(out.console, "{item}: {} refused", self.refused)?;
        }
        out.instructions(format_args!("{item}"), self.total.worst(), words)?;
        out.instructions(
            format_args!("{item}-mean"),
            self.total.mean(),
            "the same, mean",
        )?;
        out.instructions(
            format_args!("{item}-step"),
            self.step.worst(),
            "the longest of its steps",
        )
    }

    /// Solves after `samples`, and after each of up to [`MORE`] further ones.
    fn after<T: Scalar>(
        &mut self,
        counter: &mut Counter,
        calibrator: &Calibrator<T>,
        further: &[Sample<T>],
    ) -> fmt::Result {
        let mut calibrator = *calibrator;
        for sample in further.iter().take(MORE) {
            let mut now = calibrator;
            let (cost, outcome) = solve(counter, &mut now).map_err(overflow)?;
            self.note(cost, &outcome);
            calibrator.add(sample).map_err(|_| fmt::Error)?;
        }
        Ok(())
    }
}

/// What firmware states: nothing, the noise, both.
fn stated<T: Scalar>() -> [Settings<T>; 3] {
    let defaults = Settings::default();
    let noise = Some(noise());
    [
        defaults,
        defaults.with_noise(noise),
        defaults.with_noise(noise).with_tolerance(tolerance()),
    ]
}

fn filled<T: Scalar>(
    settings: &Settings<T>,
    samples: &[Sample<T>],
) -> Result<Calibrator<T>, fmt::Error> {
    let mut calibrator = Calibrator::new(&nominal(), settings);
    for sample in samples {
        calibrator.add(sample).map_err(|_| fmt::Error)?;
    }
    Ok(calibrator)
}

/// Several robots, every assumption, every number of samples.
#[inline(never)]
pub(crate) fn report_single(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let mut figures = [(); 4].map(|()| Figures::default());
    let [at_20, at_60, at_1000, at_many] = &mut figures;
    let (mut free, mut tolerance_alone, mut few) =
        (Figures::default(), Figures::default(), Figures::default());
    for seed in 0..ROBOTS {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near(&nominal::<f32>(), 1.0, &mut rng);
        let samples: [_; MOST] = measurements_of(&truth, Some(&noise()), &mut rng);
        let (further, _) = samples.split_at(MORE);
        for settings in stated() {
            for (figures, count) in [(&mut *at_20, 20), (&mut *at_60, 60), (&mut *at_1000, MOST)] {
                let calibrator = filled(&settings, &samples[..count])?;
                figures.after(counter, &calibrator, further)?;
            }
            let calibrator = filled(&settings, &samples[..8])?;
            few.after(counter, &calibrator, &samples[8..11])?;
        }
        if seed == 0 {
            // A thousand poses, each measured a hundred times.
            let mut calibrators = stated().map(|settings| Calibrator::new(&nominal(), &settings));
            for sample in samples.iter().cycle().take(MANY) {
                let again = simulate_sample(&truth, &sample.joints, Some(&noise()), &mut rng)
                    .map_err(|_| fmt::Error)?;
                for calibrator in &mut calibrators {
                    calibrator.add(&again).map_err(|_| fmt::Error)?;
                }
            }
            for calibrator in &calibrators {
                at_many.after(counter, calibrator, further)?;
            }
        }
        let mut settings = Settings::default().with_start(Start::Free);
        free.after(counter, &filled(&settings, &samples[..20])?, further)?;
        settings = Settings::default().with_tolerance(tolerance());
        tolerance_alone.after(counter, &filled(&settings, &samples[..20])?, further)?;
    }
    let words = "last sample to parameters and covariance, three arms, worst";
    for (figures, count) in figures.iter().zip([20, 60, MOST, MANY]) {
        figures.write(out, format_args!("f32/outcome-{count}"), words)?;
    }
    free.write(
        out,
        format_args!("f32/outcome-20-no-guess"),
        "the same without a guess",
    )?;
    tolerance_alone.write(
        out,
        format_args!("f32/outcome-20-tolerance-alone"),
        "the same with a tolerance and no noise stated",
    )?;
    few.write(
        out,
        format_args!("f32/outcome-8"),
        "the same with 8 to 10 samples, several solutions sought",
    )
}

/// The same robots and assumptions, each once: in software a solve takes forty times as long.
#[inline(never)]
pub(crate) fn report_double(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let mut figures = Figures::default();
    for seed in 0..ROBOTS {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near(&nominal::<f64>(), 1.0, &mut rng);
        let samples: [_; 20] = measurements_of(&truth, Some(&noise()), &mut rng);
        for settings in stated() {
            let mut calibrator = filled(&settings, &samples)?;
            let (cost, outcome) = solve(counter, &mut calibrator).map_err(overflow)?;
            figures.note(cost, &outcome);
        }
    }
    figures.write(
        out,
        format_args!("f64/outcome-20"),
        "last sample to parameters and covariance, three arms, worst",
    )
}
