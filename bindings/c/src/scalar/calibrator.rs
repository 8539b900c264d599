//! The per-arm calibrator and its solver.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use super::sample::{Sample, Settings};
use crate::error::{Error, report, status_of};
use crate::memory::{Held, HeldMut, In, New, Out};
use crate::status::{self, Status};
use delta_cal::{Calibrator, Progress, Robot, RobotOutcome, RobotSolver};

/// Makes a per-arm calibrator without samples, in `size` bytes of memory: write `sizeof *calibrator`. `robot` is the
/// robot before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
///
/// Errors: `DELTA_CAL_NOISE_...`, `DELTA_CAL_TOLERANCE_...`, `DELTA_CAL_NO_SUCH_CHOICE`.
#[unsafe(export_name = name!("calibrator_init"))]
pub extern "C" fn calibrator_init(
    mut calibrator: New<Calibrator<Real>>,
    size: usize,
    robot: Held<Robot<Real>>,
    settings: In<Settings>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        calibrator.usable(size)?;
        let made = Calibrator::new(robot.get()?, &settings.get()?.checked()?);
        calibrator.put(size, &made)?;
        Ok(status::OK)
    })
}

/// Takes in one sample; memory and time are the same for any number of samples.
///
/// Errors: `DELTA_CAL_SAMPLE_...`, with the arm; nothing is taken in.
#[unsafe(export_name = name!("calibrator_add"))]
pub extern "C" fn calibrator_add(
    mut calibrator: HeldMut<Calibrator<Real>>,
    sample: In<Sample>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let sample = sample.get()?;
        calibrator.get()?.add(&sample.into())?;
        Ok(status::OK)
    })
}

/// Writes how many samples were taken in.
#[unsafe(export_name = name!("calibrator_samples"))]
pub extern "C" fn calibrator_samples(
    calibrator: Held<Calibrator<Real>>,
    mut samples: Out<u64>,
) -> Status {
    status_of(|| {
        let count = calibrator.get()?.samples();
        samples.put(count)?;
        Ok(status::OK)
    })
}

/// Adds everything that another calibrator of the same robot and noise has seen.
///
/// Errors: `DELTA_CAL_DIFFERENT_NOMINAL`; nothing is added.
#[unsafe(export_name = name!("calibrator_merge"))]
pub extern "C" fn calibrator_merge(
    mut calibrator: HeldMut<Calibrator<Real>>,
    other: Held<Calibrator<Real>>,
) -> Status {
    status_of(|| {
        let (calibrator, other) = calibrator.beside(&other)?;
        calibrator.merge(other)?;
        Ok(status::OK)
    })
}

/// Lets everything seen so far count `lambda` times as much, 0 to 1.
///
/// Errors: `DELTA_CAL_FORGETTING`.
#[unsafe(export_name = name!("calibrator_forget"))]
pub extern "C" fn calibrator_forget(
    mut calibrator: HeldMut<Calibrator<Real>>,
    lambda: Real,
) -> Status {
    status_of(|| {
        let calibrator = calibrator.get()?;
        if !(0.0..=1.0).contains(&lambda) {
            return Err(status::FORGETTING.into());
        }
        calibrator.forget(lambda);
        Ok(status::OK)
    })
}

/// Begins a calibration, in `size` bytes of memory: write `sizeof *solver`. Takes the samples in that wait.
///
/// Errors: `DELTA_CAL_TOO_FEW_SAMPLES`, with the arm, how many there are and how many are needed.
#[unsafe(export_name = name!("solver_init"))]
pub extern "C" fn solver_init(
    mut solver: New<RobotSolver<Real>>,
    size: usize,
    mut calibrator: HeldMut<Calibrator<Real>>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        solver.usable(size)?;
        let begun = RobotSolver::new(calibrator.get()?)?;
        solver.put(size, &begun)?;
        Ok(status::OK)
    })
}

/// One short step, to be called between the turns of a control loop. Returns `DELTA_CAL_WORKING` as long as there is
/// more to do, and `DELTA_CAL_OK` when the outcome is ready. `calibrator` is the one of `solver_init`.
///
/// Errors: every refusal (`DELTA_CAL_TOO_FEW_SAMPLES` to `DELTA_CAL_OVERFLOW`), with arm and cause; the robot keeps its
/// parameters.
#[unsafe(export_name = name!("solver_step"))]
pub extern "C" fn solver_step(
    mut solver: HeldMut<RobotSolver<Real>>,
    calibrator: Held<Calibrator<Real>>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let (solver, calibrator) = solver.beside(&calibrator)?;
        Ok(match solver.step(calibrator)? {
            Progress::Working => status::WORKING,
            Progress::Finished => status::OK,
        })
    })
}

/// The calibrated robot, in `size` bytes of memory: write `sizeof *outcome`.
///
/// Errors: `DELTA_CAL_UNFINISHED` before the last step, `DELTA_CAL_IMPOSSIBLE_ROBOT`.
#[unsafe(export_name = name!("solver_outcome"))]
pub extern "C" fn solver_outcome(
    solver: Held<RobotSolver<Real>>,
    mut outcome: New<RobotOutcome<Real>>,
    size: usize,
    error: Out<Error>,
) -> Status {
    report(error, || {
        outcome.usable(size)?;
        let found = solver.get()?.outcome()?;
        outcome.put(size, &found)?;
        Ok(status::OK)
    })
}
