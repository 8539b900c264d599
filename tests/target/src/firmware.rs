//! The whole of the programs whose size is measured, in single precision: what is linked is what a calibration needs.

use core::hint::black_box;
use core::panic::PanicInfo;
use delta_cal::calibration::{Calibrator, Estimator};
use delta_cal::{Progress, Refusal, Robot, Sample, Settings};

#[cortex_m_rt::entry]
fn main() -> ! {
    // As if all of it came from elsewhere.
    loop {
        if let Some(known) = black_box(None) {
            let _ = black_box(calibrate(known));
        }
    }
}

type Known<'a> = (&'a Robot<f32>, &'a Settings<f32>, &'a [Sample<f32>]);

/// Everything that a controller has to call.
fn calibrate((robot, settings, samples): Known<'_>) -> Result<Robot<f32>, Refusal> {
    let mut calibrator = Calibrator::<_, crate::Chosen>::new(robot, settings);
    for sample in samples {
        let _ = black_box(calibrator.add(sample));
    }
    calibrator.solve()?;
    while calibrator.step() == Progress::Working {}
    Ok(crate::Chosen::robot(calibrator.outcome()?).clone())
}

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    loop {}
}
