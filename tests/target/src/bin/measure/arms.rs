//! Kinematics, the calibration of each arm, forgetting.

use crate::report::{Counts, Report, deepest, measured, stated};
use core::fmt;
use core::hint::black_box;
use delta_cal::calibration::{Ikm, Start};
use delta_cal::stream::Forgetting;
use delta_cal::{IkmCalibrator, Progress, Refusal, Sample, Settings};
use delta_cal_target_tests::{noise, nominal, tolerance};

/// Robots whose solves are counted, and those whose samples are.
const ROBOTS: (u64, u64) = (40, 5);
/// One solve after another number of samples, up to this many more: however many a calibrator keeps back to take them
/// in together, every number of them is met.
const MORE: usize = 16;
/// Cases over which the stack is measured.
const CASES: u64 = 300;

pub(crate) fn measure(report: &mut Report<'_>) -> fmt::Result {
    kinematics(report)?;
    samples(report)?;
    solves(report)?;
    report.figure(format_args!("calibrator"), size_of::<IkmCalibrator<f32>>())?;
    stack(report)
}

#[inline(never)]
fn kinematics(report: &mut Report<'_>) -> fmt::Result {
    let (mut forward, mut inverse) = (Counts::default(), Counts::default());
    let robot = nominal::<f32>();
    for seed in 0..ROBOTS.1 {
        for sample in measured::<400>(seed) {
            forward.note(report.count(|| {
                let _ = black_box(robot.forward(black_box(&sample.joints)));
            })?);
            inverse.note(report.count(|| {
                let _ = black_box(robot.inverse(black_box(&sample.position)));
            })?);
        }
    }
    report.instructions(format_args!("forward"), forward.worst)?;
    report.instructions(format_args!("inverse"), inverse.worst)
}

/// One sample taken in: plainly, with forgetting.
#[inline(never)]
fn samples(report: &mut Report<'_>) -> fmt::Result {
    let [mut add, mut forgetting] = [(); 2].map(|()| Counts::default());
    let settings = Settings::default()
        .with_noise(noise())
        .with_tolerance(tolerance());
    let memory = Forgetting::new(50.0).map_err(|_| fmt::Error)?;
    for seed in 0..ROBOTS.1 {
        let samples = measured::<400>(seed);
        let [mut plain, mut fading] = [(); 2].map(|()| IkmCalibrator::new(&nominal(), &settings));
        for sample in &samples {
            add.note(report.count(|| {
                let _ = black_box(plain.add(black_box(sample)));
            })?);
            forgetting.note(report.count(|| {
                let _ = black_box(fading.add_forgetting(black_box(sample), &memory));
            })?);
        }
    }
    report.instructions(format_args!("add-mean"), add.mean())?;
    report.instructions(format_args!("add-longest"), add.worst)?;
    report.instructions(format_args!("add-forgetting"), forgetting.worst)
}

/// From the last sample to parameters and covariance, three arms.
#[derive(Default)]
struct Solves {
    total: Counts,
    step: Counts,
}

impl Solves {
    fn one(&mut self, report: &mut Report<'_>, calibrator: &mut IkmCalibrator<f32>) -> fmt::Result {
        let mut begun = Err(Refusal::Unfinished);
        let mut total = report.count(|| begun = black_box(&mut *calibrator).solve())?;
        begun.map_err(|_| fmt::Error)?;
        let mut longest = total;
        let mut progress = Progress::Working;
        while progress == Progress::Working {
            let step = report.count(|| progress = black_box(&mut *calibrator).step())?;
            total += step;
            longest = longest.max(step);
        }
        if calibrator.outcome().is_err() {
            // A refusal would say nothing of an outcome.
            return Ok(());
        }
        self.total.note(total);
        self.step.note(longest);
        Ok(())
    }

    /// After these samples, and after each of up to [`MORE`] further ones.
    fn after(
        &mut self,
        report: &mut Report<'_>,
        settings: &Settings<f32>,
        samples: &[Sample<f32>],
        further: &[Sample<f32>],
    ) -> fmt::Result {
        let mut calibrator = IkmCalibrator::new(&nominal(), settings);
        for sample in samples {
            calibrator.add(sample).map_err(|_| fmt::Error)?;
        }
        for sample in further.iter().take(MORE) {
            let mut now = calibrator.clone();
            self.one(report, &mut now)?;
            calibrator.add(sample).map_err(|_| fmt::Error)?;
        }
        Ok(())
    }
}

#[inline(never)]
fn solves(report: &mut Report<'_>) -> fmt::Result {
    let [mut at_20, mut at_60, mut free, mut tolerance_alone, mut few] =
        [(); 5].map(|()| Solves::default());
    for seed in 0..ROBOTS.0 {
        let samples = measured::<60>(seed);
        for settings in stated() {
            at_20.after(report, &settings, &samples[..20], &samples)?;
            few.after(report, &settings, &samples[..8], &samples[8..11])?;
            at_60.after(report, &settings, &samples, &samples)?;
        }
        let settings = Settings::default().with_start(Start::Free);
        free.after(report, &settings, &samples[..20], &samples)?;
        let settings = Settings::default().with_tolerance(tolerance());
        tolerance_alone.after(report, &settings, &samples[..20], &samples)?;
    }
    for (solves, name) in [
        (at_20, "20"),
        (at_60, "60"),
        (free, "20-no-guess"),
        (tolerance_alone, "20-tolerance-alone"),
        (few, "8"),
    ] {
        report.instructions(format_args!("outcome-{name}"), solves.total.worst)?;
        report.instructions(format_args!("outcome-{name}-mean"), solves.total.mean())?;
        report.instructions(format_args!("outcome-{name}-step"), solves.step.worst)?;
    }
    Ok(())
}

#[inline(never)]
fn stack(report: &mut Report<'_>) -> fmt::Result {
    let deepest = deepest::<Ikm>(CASES);
    report.figure(format_args!("stack"), deepest)
}
