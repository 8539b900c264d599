//! Forward and inverse kinematics.

use crate::report::{Counts, Report, measured};
use core::fmt;
use core::hint::black_box;
use delta_cal_target_tests::nominal;

const ROBOTS: u64 = 5;

#[inline(never)]
pub(crate) fn measure(report: &mut Report<'_>) -> fmt::Result {
    let (mut forward, mut inverse) = (Counts::default(), Counts::default());
    let robot = nominal::<f32>();
    for seed in 0..ROBOTS {
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
