//! The calibrators from complete positions: samples, solves, snapshots and the stack.

use crate::report::{Counts, Report, measured, stated};
use core::fmt;
use core::hint::black_box;
use core::mem::MaybeUninit;
use delta_cal::calibration::{Calibrator, Estimator};
use delta_cal::stream::Forgetting;
use delta_cal::{Progress, Sample, Settings};
use delta_cal_target_tests::cases::Case;
use delta_cal_target_tests::{nominal, stack_of, tolerance};

/// Over so many robots of [`measured`] and so many random cases.
pub(crate) fn measure<E: Estimator>(
    report: &mut Report<'_>,
    name: &str,
    robots: u64,
    cases: u64,
) -> fmt::Result {
    report.figure(
        format_args!("{name}calibrator"),
        size_of::<Calibrator<f32, E>>(),
    )?;
    samples::<E>(report, name)?;
    snapshots::<E>(report, name)?;
    solves::<E>(report, name, robots, cases)
}

/// One sample taken in: plainly, with forgetting.
#[inline(never)]
fn samples<E: Estimator>(report: &mut Report<'_>, name: &str) -> fmt::Result {
    let [mut add, mut forgetting] = [(); 2].map(|()| Counts::default());
    let memory = Forgetting::new(50.0).map_err(|_| fmt::Error)?;
    for (seed, settings) in (0..).zip(stated()) {
        let [mut plain, mut fading] =
            [(); 2].map(|()| Calibrator::<_, E>::new(&nominal(), &settings));
        for sample in &measured::<200>(seed) {
            add.note(report.count(|| {
                let _ = black_box(plain.add(black_box(sample)));
            })?);
            forgetting.note(report.count(|| {
                let _ = black_box(fading.add_forgetting(black_box(sample), &memory));
            })?);
        }
    }
    report.instructions(format_args!("{name}add-mean"), add.mean())?;
    report.instructions(format_args!("{name}add-longest"), add.worst)?;
    report.instructions(format_args!("{name}add-forgetting"), forgetting.worst)
}

/// Saved, restored and merged, however many samples wait.
#[inline(never)]
fn snapshots<E: Estimator>(report: &mut Report<'_>, name: &str) -> fmt::Result {
    let (samples, settings) = (measured::<40>(1), Settings::default());
    let mut bytes = [0; 8192];
    let [mut save, mut restore, mut merge] = [(); 3].map(|()| (Counts::default(), 0));
    for count in 20..40 {
        let [mut one, mut other] = [(); 2].map(|()| Calibrator::<_, E>::new(&nominal(), &settings));
        for (index, sample) in samples.iter().enumerate() {
            let to = if index < count { &mut one } else { &mut other };
            to.add(sample).map_err(|_| fmt::Error)?;
        }
        let mut measure = |of: &mut (Counts, usize), work: &mut dyn FnMut() -> bool| {
            let mut done = false;
            of.0.note(report.count(|| done = work())?);
            of.1 = of.1.max(stack_of(&mut || done &= work()));
            done.then_some(()).ok_or(fmt::Error)
        };
        measure(&mut save, &mut || {
            black_box(&one).snapshot(black_box(&mut bytes)).is_ok()
        })?;
        measure(&mut restore, &mut || {
            black_box(&mut one).restore(black_box(&bytes)).is_ok()
        })?;
        measure(&mut merge, &mut || {
            black_box(&mut one).merge(black_box(&other)).is_ok()
        })?;
    }
    for ((counts, stack), work) in [(save, "snapshot"), (restore, "restore"), (merge, "merge")] {
        report.instructions(format_args!("{name}{work}"), counts.worst)?;
        report.figure(format_args!("{name}{work}-stack"), stack)?;
    }
    Ok(())
}

/// Numbers of samples with a figure of their own.
const NUMBERS: [u64; 4] = [4, 8, 20, 1000];
/// Other numbers of samples.
const OTHERS: [u64; 5] = [3, 5, 6, 11, 12];

/// The longest calls of all solves, and the longest solves.
#[derive(Default)]
struct Solves {
    /// After [`NUMBERS`] of samples; with a tolerance but no noise, which is then estimated as well, round by round.
    totals: [[Counts; 2]; NUMBERS.len()],
    flush: Counts,
    step: Counts,
}

impl Solves {
    fn one<E: Estimator>(
        &mut self,
        report: &mut Report<'_>,
        calibrator: &mut Calibrator<f32, E>,
    ) -> fmt::Result {
        let solve = report.solve(calibrator)?;
        self.flush.note(solve.flush);
        self.step.note(solve.longest);
        let settings = calibrator.settings();
        let alone = settings.tolerance.is_some() && settings.noise.is_none();
        for (totals, number) in self.totals.iter_mut().zip(NUMBERS) {
            if calibrator.samples() == number {
                totals[usize::from(alone)].note(solve.total);
            }
        }
        Ok(())
    }

    /// With few and with many samples.
    fn all<E: Estimator>(
        &mut self,
        report: &mut Report<'_>,
        settings: &Settings<f32>,
        samples: &[Sample<f32>],
    ) -> fmt::Result {
        let mut calibrator = Calibrator::<_, E>::new(&nominal(), settings);
        for sample in samples.iter().take(20) {
            calibrator.add(sample).map_err(|_| fmt::Error)?;
            let number = calibrator.samples();
            if NUMBERS.contains(&number) || OTHERS.contains(&number) {
                self.one(report, &mut calibrator.clone())?;
            }
        }
        calibrator.reset();
        for _ in 0..5 {
            calibrator.add_many(samples).map_err(|_| fmt::Error)?;
        }
        self.one(report, &mut calibrator)
    }
}

#[inline(never)]
fn solves<E: Estimator>(
    report: &mut Report<'_>,
    name: &str,
    robots: u64,
    cases: u64,
) -> fmt::Result {
    let mut solves = Solves::default();
    let [nothing, noise, both] = stated();
    for seed in 0..robots {
        let samples = measured::<200>(seed);
        for settings in [nothing, noise, both, nothing.with_tolerance(tolerance())] {
            solves.all::<E>(report, &settings, &samples)?;
            solves.all::<E>(report, &settings.with_free_start(true), &samples)?;
        }
    }
    let (mut place, mut stack) = (MaybeUninit::uninit(), 0);
    for seed in 0..cases {
        let case = Case::draw(seed);
        stack = stack.max(stack_of_case::<E>(&mut place, &case));
        let calibrator = place.write(Calibrator::new(&case.nominal, &case.settings));
        for sample in &case.samples {
            let _ = calibrator.add(sample);
        }
        solves.one(report, calibrator)?;
    }
    for ([total, balanced], number) in solves.totals.iter().zip(NUMBERS) {
        report.instructions(format_args!("{name}solve-{number}"), total.worst)?;
        report.instructions(
            format_args!("{name}solve-{number}-tolerance-alone"),
            balanced.worst,
        )?;
    }
    report.instructions(format_args!("{name}flush"), solves.flush.worst)?;
    report.instructions(format_args!("{name}step"), solves.step.worst)?;
    report.figure(format_args!("{name}stack"), stack)
}

/// The deepest stack of a calibrator's calls: made, filled, solved.
#[inline(never)]
fn stack_of_case<E: Estimator>(
    place: &mut MaybeUninit<Calibrator<f32, E>>,
    case: &Case<f32>,
) -> usize {
    let (nominal, settings) = (black_box(&case.nominal), black_box(&case.settings));
    let create = stack_of(&mut || {
        black_box(place.write(Calibrator::new(nominal, settings)));
    });
    // Exists already; the same again, for a reference.
    let calibrator = place.write(Calibrator::new(nominal, settings));
    let solve = stack_of(&mut || {
        for sample in &case.samples {
            let _ = black_box(calibrator.add(black_box(sample)));
        }
        let _ = black_box(calibrator.solve());
        while calibrator.step() == Progress::Working {}
        let _ = black_box(calibrator.outcome());
    });
    create.max(solve)
}
