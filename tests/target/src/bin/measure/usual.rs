//! Solves after twenty samples of a robot as it is built.

use crate::report::{Counts, Report, measured, stated};
use core::fmt;
use delta_cal::calibration::{Calibrator, Estimator};
use delta_cal_target_tests::nominal;

/// However many samples a calibrator keeps back to take them in together, every number of them is met after 20.
const MORE: usize = 16;

#[inline(never)]
pub(crate) fn measure<E: Estimator>(
    report: &mut Report<'_>,
    name: &str,
    robots: u64,
) -> fmt::Result {
    let mut total = Counts::default();
    for seed in 0..robots {
        let samples = measured::<{ 20 + MORE }>(seed);
        for settings in stated() {
            let mut calibrator = Calibrator::<_, E>::new(&nominal(), &settings);
            calibrator
                .add_many(&samples[..20])
                .map_err(|_| fmt::Error)?;
            for sample in &samples[20..] {
                let mut now = calibrator.clone();
                total.note(report.solve(&mut now)?.total);
                now.outcome().map_err(|_| fmt::Error)?;
                calibrator.add(sample).map_err(|_| fmt::Error)?;
            }
        }
    }
    report.instructions(format_args!("{name}solve-20-mean"), total.mean())
}
