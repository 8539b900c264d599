//! The gated calibrators: their longest calls, whatever is stated, and the stack of their making.

use crate::report::{Counts, Report, measured, stated};
use core::fmt;
use core::hint::black_box;
use core::mem::MaybeUninit;
use delta_cal::calibration::{Estimator, Ikm, Joint};
use delta_cal::stream::{Forgetting, Selection, StreamCalibrator};
use delta_cal::{Progress, Settings};
use delta_cal_target_tests::{nominal, stack_of};

pub(crate) fn measure(report: &mut Report<'_>) -> fmt::Result {
    of::<Ikm>(report, "gated")?;
    of::<Joint>(report, "gated-joint")
}

#[inline(never)]
fn of<E: Estimator>(report: &mut Report<'_>, name: &str) -> fmt::Result {
    let [mut add, mut step] = [(); 2].map(|()| Counts::default());
    let (robot, mut place) = (nominal::<f32>(), MaybeUninit::uninit());
    let memory = Forgetting::new(20.0).map_err(|_| fmt::Error)?;
    for forgetting in [None, Some(memory)] {
        let gated = Selection {
            gated: true,
            forgetting,
        };
        for (settings, seed) in stated().into_iter().flat_map(|it| [(it, 1), (it, 2)]) {
            let stream = StreamCalibrator::<_, E>::new_in(&mut place, &robot, &settings, &gated);
            for sample in &measured::<200>(seed) {
                add.note(report.count(|| {
                    let _ = black_box(black_box(&mut *stream).add(black_box(sample)));
                })?);
                let mut progress = Progress::Working;
                while progress == Progress::Working {
                    step.note(report.count(|| progress = black_box(&mut *stream).step())?);
                }
            }
        }
    }
    report.instructions(format_args!("{name}-add-mean"), add.mean())?;
    report.instructions(format_args!("{name}-add"), add.worst)?;
    report.instructions(format_args!("{name}-step"), step.worst)?;
    let (settings, gated) = (
        Settings::default(),
        Selection {
            gated: true,
            forgetting: None,
        },
    );
    let new = stack_of(&mut || {
        black_box(place.write(StreamCalibrator::new(black_box(&robot), &settings, &gated)));
    });
    report.figure(format_args!("{name}-new-stack"), new)?;
    let size = size_of::<StreamCalibrator<f32, E>>();
    report.figure(format_args!("{name}"), size)
}
