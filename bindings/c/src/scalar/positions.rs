//! Input of complete positions, compiled for each calibrator that takes them: `ikm` and `joint`.
#![allow(unsafe_code)] // naming symbols

use super::super::Real;
use super::super::sample::{Sample, Settings};
use super::Own;
use crate::error::{Error, report, status_of};
use crate::memory::{Held, HeldMut, In, New, Out};
use crate::status::{self, Status};
use delta_cal::Robot;

/// Makes a calibrator without samples, in `size` bytes of memory: write `sizeof *calibrator`. `robot` is the robot
/// before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
///
/// Errors: `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`.
#[unsafe(export_name = family!("init"))]
pub extern "C" fn init(
    mut calibrator: New<Own>,
    size: usize,
    robot: Held<Robot<Real>>,
    settings: In<Settings>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        calibrator.usable(size)?;
        let (robot, settings) = (*robot.get()?, settings.get()?.checked()?);
        calibrator.make(size, |place| {
            Ok::<_, Error>(place.write(Own::new(&robot, &settings)))
        })?;
        Ok(status::OK)
    })
}

/// Adds one sample; memory and time are the same for any number of samples. The result of the last `solve` is dropped.
///
/// Errors: `DCAL_BUSY`, and `DCAL_SAMPLE_...` with the arm; nothing is added.
#[unsafe(export_name = family!("add"))]
pub extern "C" fn add(
    mut calibrator: HeldMut<Own>,
    sample: In<Sample>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let sample = sample.get()?;
        calibrator.get()?.add(&sample.into())?;
        Ok(status::OK)
    })
}

/// Works in the samples that still wait: the calibrator works in several at once. `solve` does it as well; call this one
/// turn of the control loop earlier if that call takes too long. The result has the same bits.
#[unsafe(export_name = family!("flush"))]
pub extern "C" fn flush(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        calibrator.get()?.flush();
        Ok(status::OK)
    })
}

/// Adds all samples of another calibrator of the same robot and noise.
///
/// Errors: `DCAL_BUSY`, `DCAL_DIFFERENT_NOMINAL`; nothing is added.
#[unsafe(export_name = family!("merge"))]
pub extern "C" fn merge(mut calibrator: HeldMut<Own>, other: Held<Own>) -> Status {
    status_of(|| {
        let (calibrator, other) = calibrator.beside(&other)?;
        calibrator.merge(other)?;
        Ok(status::OK)
    })
}

/// Multiplies the weight of all samples so far by `lambda`, 0 to 1.
///
/// Errors: `DCAL_BUSY`, `DCAL_FORGETTING`.
#[unsafe(export_name = family!("forget"))]
pub extern "C" fn forget(mut calibrator: HeldMut<Own>, lambda: Real) -> Status {
    status_of(|| {
        if !(0.0..=1.0).contains(&lambda) {
            return Err(status::FORGETTING.into());
        }
        calibrator.get()?.forget(lambda)?;
        Ok(status::OK)
    })
}
