//! A firmware that does nothing but calibrate, in single precision: what is linked is what a
//! calibration needs. Built only to be looked at.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("Only its size counts: build it with --target thumbv7em-none-eabihf.");
}

#[cfg(target_os = "none")]
mod firmware {
    use core::hint::black_box;
    use core::panic::PanicInfo;
    use delta_cal::{IkmCalibrator, Progress, Refusal, Robot, Sample, Settings};

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
        let mut calibrator = IkmCalibrator::new(robot, settings);
        for sample in samples {
            let _ = black_box(calibrator.add(sample));
        }
        calibrator.solve()?;
        while calibrator.step() == Progress::Working {}
        Ok(calibrator.outcome()?.robot.clone())
    }

    #[panic_handler]
    fn panicked(_: &PanicInfo<'_>) -> ! {
        loop {}
    }
}
