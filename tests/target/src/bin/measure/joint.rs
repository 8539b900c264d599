//! The calibration of all 24 parameters together, in single precision: instructions of a sample, of a solve
//! and of each of its steps, and bytes.

use crate::instructions::Counts;
use crate::report::Report;
use core::fmt;
use core::hint::black_box;
use core::mem::MaybeUninit;
use delta_cal::calibration::{JointCalibrator, JointOutcome, JointSolver, Start};
use delta_cal::{Progress, Refusal, Sample, Settings};
use delta_cal_target_tests::cases::Case;
use delta_cal_target_tests::{Counter, Overflow, measurements_of, noise, nominal, robot_near};
use delta_cal_target_tests::{Scalar, stack_of, tolerance};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

const ROBOTS: u64 = 4;
const MOST: usize = 1000;
const CASES: u64 = 60;

/// What a solve cost, and which of its steps was the longest.
#[derive(Clone, Copy, Default)]
struct Cost {
    total: u32,
    steps: u32,
    longest: u32,
    longest_is: u32,
    outcome: u32,
    flush: u32,
    begin: u32,
}

fn overflow(_: Overflow) -> fmt::Error {
    fmt::Error
}

type Solved<T> = Result<JointOutcome<T>, Refusal>;

/// From the last sample to parameters and covariance.
fn solve<T: Scalar>(
    counter: &mut Counter,
    calibrator: &mut JointCalibrator<T>,
) -> Result<(Cost, Solved<T>), Overflow> {
    let mut solver = Err(Refusal::Unfinished);
    let mut cost = Cost {
        flush: counter.count(|| black_box(&mut *calibrator).flush())?,
        begin: counter.count(|| solver = JointSolver::new(black_box(calibrator)))?,
        ..Cost::default()
    };
    cost.total = cost.flush + cost.begin;
    black_box(&mut solver);
    let mut solver = match solver {
        Ok(solver) => solver,
        Err(refusal) => return Ok((cost, Err(refusal))),
    };
    loop {
        let mut progress = Progress::Working;
        let step = counter.count(|| progress = solver.step(black_box(calibrator)))?;
        cost.steps += 1;
        cost.total += step;
        if step > cost.longest {
            cost.longest = step;
            cost.longest_is = cost.steps;
        }
        if progress == Progress::Finished {
            break;
        }
    }
    // Not stored within the count: whether that copies the outcome once more, the compiler decides anew each time.
    cost.outcome = counter.count(|| {
        black_box(&solver.outcome(black_box(calibrator)));
    })?;
    cost.total += cost.outcome;
    Ok((cost, solver.outcome(calibrator)))
}

#[derive(Default)]
struct Figures {
    total: Counts,
    step: Counts,
    outcome: Counts,
    flush: Counts,
    begin: Counts,
    worst: Cost,
    refused: u32,
}

impl Figures {
    fn note<T: Scalar>(&mut self, (cost, outcome): (Cost, Solved<T>)) {
        if outcome.is_err() {
            self.refused += 1;
            return;
        }
        self.total.note(cost.total);
        self.step.note(cost.longest);
        self.outcome.note(cost.outcome);
        self.flush.note(cost.flush);
        self.begin.note(cost.begin);
        if cost.longest > self.worst.longest {
            self.worst = cost;
        }
    }

    fn write(&self, out: &mut Report<'_>, item: fmt::Arguments<'_>, words: &str) -> fmt::Result {
        if self.total.worst() == 0 || self.refused > 0 {
            writeln!(out.console, "{item}: {} refused", self.refused)?;
        }
        writeln!(
            out.console,
            "{item}: the longest step is number {} of {}",
            self.worst.longest_is, self.worst.steps
        )?;
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
        )?;
        out.instructions(
            format_args!("{item}-flush"),
            self.flush.worst(),
            "the samples that wait, before it begins",
        )?;
        out.instructions(
            format_args!("{item}-begin"),
            self.begin.worst(),
            "its begin after that",
        )?;
        out.instructions(
            format_args!("{item}-end"),
            self.outcome.worst(),
            "its outcome after the last step",
        )
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

/// One after the other: each needs much of the stack.
pub(crate) fn report(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    single(out, counter)?;
    double(out, counter)?;
    bytes(out)
}

#[inline(never)]
fn single(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let mut figures = [(); 4].map(|()| Figures::default());
    let (mut add, mut at_once) = (Counts::default(), Counts::default());
    let mut worst_mean = 0;
    for seed in 0..ROBOTS {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near(&nominal::<f32>(), 1.0, &mut rng);
        let samples: [Sample<f32>; MOST] = measurements_of(&truth, Some(&noise()), &mut rng);
        for settings in stated() {
            let [at_20, at_60, at_1000, free] = &mut figures;
            let mut calibrator = JointCalibrator::new(&nominal::<f32>(), &settings);
            let mut adds = Counts::default();
            for (index, sample) in samples.iter().enumerate() {
                let count = counter
                    .count(|| {
                        let _ = black_box(calibrator.add(black_box(sample)));
                    })
                    .map_err(overflow)?;
                adds.note(count);
                add.note(count);
                let figures = match index + 1 {
                    20..=22 => &mut *at_20,
                    60 | 61 => &mut *at_60,
                    MOST => &mut *at_1000,
                    _ => continue,
                };
                let mut now = calibrator;
                figures.note(solve(counter, &mut now).map_err(overflow)?);
            }
            worst_mean = worst_mean.max(adds.mean());
            let mut many = JointCalibrator::new(&nominal::<f32>(), &settings);
            let count = counter
                .count(|| {
                    let _ = black_box(many.add_many(black_box(&samples[..40])));
                })
                .map_err(overflow)?;
            at_once.note(count / 40);
            let without = settings.with_start(Start::Free);
            let mut calibrator = JointCalibrator::new(&nominal::<f32>(), &without);
            calibrator
                .add_many(&samples[..20])
                .map_err(|_| fmt::Error)?;
            free.note(solve(counter, &mut calibrator).map_err(overflow)?);
        }
    }
    let mut line = |item: &str, count: u32, words: &str| {
        out.instructions(format_args!("f32/joint-{item}"), count, words)
    };
    line(
        "add-mean",
        worst_mean,
        "one sample into the joint calibrator, mean",
    )?;
    line(
        "add-longest",
        add.worst(),
        "one sample into the joint calibrator, longest",
    )?;
    line(
        "add-many",
        at_once.worst(),
        "one of many at once into the joint calibrator",
    )?;
    let words = "last sample to 24 parameters and covariance, worst";
    let names = ["20", "60", "1000", "20-no-guess"];
    for (figures, name) in figures.iter().zip(names) {
        figures.write(out, format_args!("f32/joint-outcome-{name}"), words)?;
    }
    Ok(())
}

/// One robot with its noise stated.
#[inline(never)]
fn double(out: &mut Report<'_>, counter: &mut Counter) -> fmt::Result {
    let (mut figures, mut add) = (Figures::default(), Counts::default());
    let mut rng = Pcg32::seed_from_u64(0);
    let truth = robot_near(&nominal::<f64>(), 1.0, &mut rng);
    let samples: [_; 40] = measurements_of(&truth, Some(&noise()), &mut rng);
    let settings = Settings::default().with_noise(noise());
    let mut calibrator = JointCalibrator::new(&nominal::<f64>(), &settings);
    for sample in &samples {
        let count = counter.count(|| {
            let _ = black_box(calibrator.add(black_box(sample)));
        });
        add.note(count.map_err(overflow)?);
    }
    let mut many = JointCalibrator::new(&nominal::<f64>(), &settings);
    let at_once = counter.count(|| {
        let _ = black_box(many.add_many(black_box(&samples[..8])));
    });
    let at_once = at_once.map_err(overflow)? / 8;
    figures.note(solve(counter, &mut calibrator).map_err(overflow)?);
    let mut line = |item: &str, count: u32, words: &str| {
        out.instructions(format_args!("f64/joint-{item}"), count, words)
    };
    line(
        "add-mean",
        add.mean(),
        "one sample into the joint calibrator, mean",
    )?;
    line(
        "add-longest",
        add.worst(),
        "one sample into the joint calibrator, longest",
    )?;
    line(
        "add-many",
        at_once,
        "one of many at once into the joint calibrator",
    )?;
    figures.write(
        out,
        format_args!("f64/joint-outcome-40"),
        "last sample to 24 parameters and covariance",
    )
}

/// State, and stack with the state in statics.
#[inline(never)]
fn bytes(out: &mut Report<'_>) -> fmt::Result {
    let mut size = |item: &str, bytes: usize, words: &str| {
        out.line(format_args!("f32/joint-{item}"), bytes, "bytes", words)
    };
    size(
        "calibrator",
        size_of::<JointCalibrator<f32>>(),
        "state of a joint calibrator",
    )?;
    size(
        "solver",
        size_of::<JointSolver<f32>>(),
        "state of a joint solver",
    )?;
    size("outcome", size_of::<JointOutcome<f32>>(), "a joint outcome")?;

    let mut statics = Statics {
        calibrator: MaybeUninit::uninit(),
        solver: MaybeUninit::uninit(),
        outcome: MaybeUninit::uninit(),
    };
    let mut worst = [0; 5];
    for seed in 0..CASES {
        let case = Case::<f32>::draw(seed);
        for (worst, bytes) in worst.iter_mut().zip(parts(&mut statics, &case)) {
            *worst = bytes.max(*worst);
        }
    }
    let items = ["new", "add", "start", "step", "end"];
    let mut deepest = 0;
    for (item, bytes) in items.iter().zip(worst) {
        deepest = deepest.max(bytes);
        out.line(
            format_args!("f32/joint-stack-{item}"),
            bytes,
            "bytes",
            "of a joint calibration",
        )?;
    }
    out.line(
        format_args!("f32/joint-stack"),
        deepest,
        "bytes",
        "stack of a joint calibration, calibrator, solver and outcome in statics",
    )
}

/// Where firmware keeps its calibration: not on the stack of whoever calls.
struct Statics {
    calibrator: MaybeUninit<JointCalibrator<f32>>,
    solver: MaybeUninit<Result<JointSolver<f32>, Refusal>>,
    outcome: MaybeUninit<Solved<f32>>,
}

fn parts(statics: &mut Statics, case: &Case<f32>) -> [usize; 5] {
    let Statics {
        calibrator,
        solver,
        outcome,
    } = statics;
    let new = stack_of(&mut || create(calibrator, case));
    let calibrator = calibrator.write(JointCalibrator::new(&case.nominal, &case.settings));
    let add = stack_of(&mut || add_all(calibrator, case));
    let start = stack_of(&mut || begin(solver, calibrator));
    let solver = solver.write(JointSolver::new(calibrator));
    let Ok(solver) = solver else {
        return [new, add, start, 0, 0];
    };
    let step = stack_of(&mut || work(solver, calibrator));
    let end = stack_of(&mut || finish(outcome, solver, calibrator));
    [new, add, start, step, end]
}

#[inline(never)]
fn create(place: &mut MaybeUninit<JointCalibrator<f32>>, case: &Case<f32>) {
    black_box(place.write(JointCalibrator::new(
        black_box(&case.nominal),
        black_box(&case.settings),
    )));
}

#[inline(never)]
fn add_all(calibrator: &mut JointCalibrator<f32>, case: &Case<f32>) {
    for sample in &case.samples {
        let _ = black_box(calibrator.add(black_box(sample)));
    }
}

#[inline(never)]
fn begin(
    place: &mut MaybeUninit<Result<JointSolver<f32>, Refusal>>,
    calibrator: &mut JointCalibrator<f32>,
) {
    let _ = black_box(place.write(JointSolver::new(black_box(calibrator))));
}

#[inline(never)]
fn work(solver: &mut JointSolver<f32>, calibrator: &JointCalibrator<f32>) {
    while black_box(solver.step(black_box(calibrator))) == Progress::Working {}
}

#[inline(never)]
fn finish(
    place: &mut MaybeUninit<Solved<f32>>,
    solver: &JointSolver<f32>,
    calibrator: &JointCalibrator<f32>,
) {
    let _ = black_box(place.write(black_box(solver).outcome(black_box(calibrator))));
}
