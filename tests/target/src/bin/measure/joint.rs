//! The calibration of all 24 parameters together.

use crate::report::{Counts, Report, deepest, measured, stated};
use core::fmt;
use core::hint::black_box;
use delta_cal::calibration::{Joint, JointCalibrator, Start};
use delta_cal::{Progress, Refusal};
use delta_cal_target_tests::nominal;

const ROBOTS: u64 = 4;
/// Cases over which the stack is measured.
const CASES: u64 = 60;

#[derive(Default)]
struct Solves {
    total: Counts,
    flush: Counts,
    begin: Counts,
    step: Counts,
}

impl Solves {
    /// From the last sample to parameters and covariance.
    fn one(
        &mut self,
        report: &mut Report<'_>,
        calibrator: &mut JointCalibrator<f32>,
    ) -> fmt::Result {
        let flush = report.count(|| black_box(&mut *calibrator).flush())?;
        let mut begun = Err(Refusal::Unfinished);
        let begin = report.count(|| begun = black_box(&mut *calibrator).solve())?;
        begun.map_err(|_| fmt::Error)?;
        let (mut total, mut longest) = (flush + begin, 0);
        loop {
            let mut progress = Progress::Working;
            let step = report.count(|| progress = black_box(&mut *calibrator).step())?;
            total += step;
            longest = longest.max(step);
            if progress == Progress::Finished {
                break;
            }
        }
        if calibrator.outcome().is_ok() {
            self.total.note(total);
            self.flush.note(flush);
            self.begin.note(begin);
            self.step.note(longest);
        }
        Ok(())
    }
}

pub(crate) fn measure(report: &mut Report<'_>) -> fmt::Result {
    solves(report)?;
    report.figure(
        format_args!("joint-calibrator"),
        size_of::<JointCalibrator<f32>>(),
    )?;
    stack(report)
}

#[inline(never)]
fn solves(report: &mut Report<'_>) -> fmt::Result {
    let [mut at_20, mut free] = [(); 2].map(|()| Solves::default());
    let mut add = Counts::default();
    for seed in 0..ROBOTS {
        let samples = measured::<60>(seed);
        for settings in stated() {
            let mut calibrator = JointCalibrator::new(&nominal(), &settings);
            for (index, sample) in samples.iter().enumerate() {
                add.note(report.count(|| {
                    let _ = black_box(calibrator.add(black_box(sample)));
                })?);
                if (20..=22).contains(&(index + 1)) {
                    let mut now = calibrator.clone();
                    at_20.one(report, &mut now)?;
                }
            }
            let without = settings.with_start(Start::Free);
            let mut calibrator = JointCalibrator::new(&nominal(), &without);
            calibrator
                .add_many(&samples[..20])
                .map_err(|_| fmt::Error)?;
            free.one(report, &mut calibrator)?;
        }
    }
    report.instructions(format_args!("joint-add-mean"), add.mean())?;
    report.instructions(format_args!("joint-add-longest"), add.worst)?;
    for (solves, name) in [(at_20, "20"), (free, "20-no-guess")] {
        let item = format_args!("joint-outcome-{name}");
        report.instructions(format_args!("{item}"), solves.total.worst)?;
        report.instructions(format_args!("{item}-mean"), solves.total.mean())?;
        report.instructions(format_args!("{item}-flush"), solves.flush.worst)?;
        report.instructions(format_args!("{item}-begin"), solves.begin.worst)?;
        report.instructions(format_args!("{item}-step"), solves.step.worst)?;
    }
    Ok(())
}

#[inline(never)]
fn stack(report: &mut Report<'_>) -> fmt::Result {
    let deepest = deepest::<Joint>(CASES);
    report.figure(format_args!("joint-stack"), deepest)
}
