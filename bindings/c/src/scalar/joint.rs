//! The joint calibrator and its solver.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use super::sample::{Sample, Settings};
use crate::error::{Error, report, status_of};
use crate::memory::{Held, HeldMut, In, New, Out};
use crate::status::{self, Status};
use delta_cal::calibration::{JointCalibrator, JointOutcome, JointSolver};
use delta_cal::{Progress, Refusal, Robot};

/// Makes a joint calibrator without samples, in `size` bytes of memory: write `sizeof *calibrator`. `robot` is the
/// robot before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
///
/// Errors: `DELTA_CAL_NOISE_...`, `DELTA_CAL_TOLERANCE_...`, `DELTA_CAL_NO_SUCH_CHOICE`.
#[unsafe(export_name = name!("joint_calibrator_init"))]
pub extern "C" fn joint_calibrator_init(
    mut calibrator: New<JointCalibrator<Real>>,
    size: usize,
    robot: Held<Robot<Real>>,
    settings: In<Settings>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        calibrator.usable(size)?;
        let made = JointCalibrator::new(robot.get()?, &settings.get()?.checked()?);
        calibrator.put(size, &made)?;
        Ok(status::OK)
    })
}

/// Takes in one sample; memory and time are the same for any number of samples.
///
/// Errors: `DELTA_CAL_SAMPLE_...`, with the arm; nothing is taken in.
#[unsafe(export_name = name!("joint_calibrator_add"))]
pub extern "C" fn joint_calibrator_add(
    mut calibrator: HeldMut<JointCalibrator<Real>>,
    sample: In<Sample>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let sample = sample.get()?;
        calibrator.get()?.add(&sample.into())?;
        Ok(status::OK)
    })
}

/// Works the samples in that still wait: the calibrator works several in at once. `joint_solver_init` does it as well; do
/// it a turn earlier where that call would take too long. The result has the same bits.
#[unsafe(export_name = name!("joint_calibrator_flush"))]
pub extern "C" fn joint_calibrator_flush(mut calibrator: HeldMut<JointCalibrator<Real>>) -> Status {
    status_of(|| {
        calibrator.get()?.flush();
        Ok(status::OK)
    })
}

/// Writes how many samples were taken in.
#[unsafe(export_name = name!("joint_calibrator_samples"))]
pub extern "C" fn joint_calibrator_samples(
    calibrator: Held<JointCalibrator<Real>>,
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
#[unsafe(export_name = name!("joint_calibrator_merge"))]
pub extern "C" fn joint_calibrator_merge(
    mut calibrator: HeldMut<JointCalibrator<Real>>,
    other: Held<JointCalibrator<Real>>,
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
#[unsafe(export_name = name!("joint_calibrator_forget"))]
pub extern "C" fn joint_calibrator_forget(
    mut calibrator: HeldMut<JointCalibrator<Real>>,
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

/// Not inlined: its temporaries would share the stack with those of the caller.
#[inline(never)]
fn begun(calibrator: &mut JointCalibrator<Real>) -> Result<JointSolver<Real>, Refusal> {
    JointSolver::new(calibrator)
}

/// Begins a calibration, in `size` bytes of memory: write `sizeof *solver`. Takes the samples in that wait.
///
/// Errors: `DELTA_CAL_TOO_FEW_SAMPLES`, with the arm, how many there are and how many are needed.
#[unsafe(export_name = name!("joint_solver_init"))]
pub extern "C" fn joint_solver_init(
    mut solver: New<JointSolver<Real>>,
    size: usize,
    mut calibrator: HeldMut<JointCalibrator<Real>>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        solver.usable(size)?;
        let begun = begun(calibrator.get()?);
        solver.put(
            size,
            begun.as_ref().map_err(|refusal| Error::from(*refusal))?,
        )?;
        Ok(status::OK)
    })
}

/// One short step, to be called between the turns of a control loop. Returns `DELTA_CAL_WORKING` as long as there is
/// more to do, and `DELTA_CAL_OK` when the outcome is ready. `calibrator` is the one of `joint_solver_init`.
///
/// A refusal shows when the outcome is asked for.
#[unsafe(export_name = name!("joint_solver_step"))]
pub extern "C" fn joint_solver_step(
    mut solver: HeldMut<JointSolver<Real>>,
    calibrator: Held<JointCalibrator<Real>>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let (solver, calibrator) = solver.beside(&calibrator)?;
        Ok(match solver.step(calibrator) {
            Progress::Working => status::WORKING,
            Progress::Finished => status::OK,
        })
    })
}

/// Not inlined, as `begun`.
#[inline(never)]
fn found(
    solver: &JointSolver<Real>,
    calibrator: &JointCalibrator<Real>,
) -> Result<JointOutcome<Real>, Refusal> {
    solver.outcome(calibrator)
}

/// The calibrated robot, in `size` bytes of memory: write `sizeof *outcome`.
///
/// `calibrator` is the one of `joint_solver_init`.
///
/// Errors: `DELTA_CAL_UNFINISHED` before the last step, and every refusal (`DELTA_CAL_TOO_FEW_SAMPLES` to
/// `DELTA_CAL_OVERFLOW`), with arm and cause; the robot keeps its parameters.
#[unsafe(export_name = name!("joint_solver_outcome"))]
pub extern "C" fn joint_solver_outcome(
    solver: Held<JointSolver<Real>>,
    calibrator: Held<JointCalibrator<Real>>,
    mut outcome: New<JointOutcome<Real>>,
    size: usize,
    error: Out<Error>,
) -> Status {
    report(error, || {
        outcome.usable(size)?;
        let found = found(solver.get()?, calibrator.get()?);
        outcome.put(
            size,
            found.as_ref().map_err(|refusal| Error::from(*refusal))?,
        )?;
        Ok(status::OK)
    })
}
