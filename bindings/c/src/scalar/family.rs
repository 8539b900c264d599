//! A calibrator with its solver and its outcome, compiled for each family: `arms` and `joint`.
#![allow(unsafe_code)] // naming symbols

use super::super::Real;
use super::super::outcome::{ArmSummary, by_rows, index_of};
use super::super::sample::{Sample, Settings};
use super::{Outcome, Own, arm_of};
use crate::error::{Error, report, status_of};
use crate::memory::{Held, HeldMut, In, Many, New, Out};
use crate::status::{self, Status};
use delta_cal::{ArmIndex, Parameter, Progress, Robot};

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
        let made = Own::new(robot.get()?, &settings.get()?.checked()?);
        calibrator.put(size, &made)?;
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
///
/// Errors: `DCAL_BUSY`.
#[unsafe(export_name = family!("flush"))]
pub extern "C" fn flush(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        let calibrator = calibrator.get()?;
        if calibrator.solving() {
            return Err(status::BUSY.into());
        }
        calibrator.flush();
        Ok(status::OK)
    })
}

/// Writes the number of samples.
#[unsafe(export_name = family!("samples"))]
pub extern "C" fn samples(calibrator: Held<Own>, mut samples: Out<u64>) -> Status {
    status_of(|| {
        let count = calibrator.get()?.samples();
        samples.put(count)?;
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
        let calibrator = calibrator.get()?;
        if !(0.0..=1.0).contains(&lambda) {
            return Err(status::FORGETTING.into());
        }
        calibrator.forget(lambda)?;
        Ok(status::OK)
    })
}

/// Begins to solve. Until the last `step`, or `stop`, every call that would change the samples returns `DCAL_BUSY`.
///
/// Errors: `DCAL_BUSY`; `DCAL_TOO_FEW_SAMPLES`, with the arm, how many there are and how many are needed.
#[unsafe(export_name = family!("solve"))]
pub extern "C" fn solve(mut calibrator: HeldMut<Own>, error: Out<Error>) -> Status {
    report(error, || {
        let calibrator = calibrator.get()?;
        if calibrator.solving() {
            return Err(status::BUSY.into());
        }
        calibrator.solve()?;
        Ok(status::OK)
    })
}

/// One short step, to be called between the turns of a control loop. Returns `DCAL_WORKING` as long as there is more to
/// do, and `DCAL_OK` when the outcome is ready.
///
/// Errors: `DCAL_UNFINISHED` before `solve`.
#[unsafe(export_name = family!("step"))]
pub extern "C" fn step(mut calibrator: HeldMut<Own>, error: Out<Error>) -> Status {
    report(error, || {
        let own = calibrator.get()?;
        Ok(match own.step() {
            Progress::Working => status::WORKING,
            Progress::Finished if own.finished() => status::OK,
            Progress::Finished => return Err(status::UNFINISHED.into()),
        })
    })
}

/// Gives up what `solve` has begun. The samples stay.
#[unsafe(export_name = family!("stop"))]
pub extern "C" fn stop(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        calibrator.get()?.stop();
        Ok(status::OK)
    })
}

/// In its place, and not inlined: its temporaries would share the stack with those of the caller.
#[inline(never)]
fn put(own: &Own, outcome: &mut New<Outcome>, size: usize) -> Result<(), Error> {
    match &own.outcome() {
        Ok(found) => Ok(outcome.put(size, found)?),
        Err(refusal) => Err((*refusal).into()),
    }
}

/// The calibrated robot, in `size` bytes of memory: write `sizeof *outcome`.
///
/// Errors: `DCAL_UNFINISHED` before the last step, and every refusal (`DCAL_TOO_FEW_SAMPLES` to `DCAL_OVERFLOW`), with
/// arm and cause; the robot keeps its parameters.
#[unsafe(export_name = family!("finish"))]
pub extern "C" fn finish(
    calibrator: Held<Own>,
    mut outcome: New<Outcome>,
    size: usize,
    error: Out<Error>,
) -> Status {
    report(error, || {
        outcome.usable(size)?;
        put(calibrator.get()?, &mut outcome, size)?;
        Ok(status::OK)
    })
}

/// Writes the samples into `bytes`, of which there are `capacity`: write the constant `DCAL_..._SNAPSHOT_..._SIZE`.
/// `length` is how many were written. They are the same on every target. Store them where they outlast a power cut, and
/// give them to `restore`.
///
/// Errors: `DCAL_SNAPSHOT_BUFFER`; nothing is written.
#[unsafe(export_name = family!("snapshot"))]
pub extern "C" fn snapshot(
    calibrator: Held<Own>,
    mut bytes: Out<u8>,
    capacity: usize,
    mut length: Out<usize>,
) -> Status {
    status_of(|| {
        length.usable()?;
        let needed = Own::SNAPSHOT_BYTES;
        let (own, bytes) = calibrator.beside_bytes(&mut bytes, capacity, needed)?;
        let written = own.snapshot(bytes)?.len();
        length.put(written)?;
        Ok(status::OK)
    })
}

/// Replaces the samples by those of a snapshot. The calibrator must be of the same robot and settings. It goes on to the
/// same bits as the one that the snapshot is of.
///
/// Errors: `DCAL_BUSY`, `DCAL_SNAPSHOT_...`; the calibrator is unchanged.
#[unsafe(export_name = family!("restore"))]
pub extern "C" fn restore(mut calibrator: HeldMut<Own>, bytes: Many<u8>, length: usize) -> Status {
    status_of(|| {
        let (calibrator, bytes) = calibrator.beside_bytes(&bytes, length)?;
        calibrator.restore(bytes)?;
        Ok(status::OK)
    })
}

/// Makes the calibrated robot, in `size` bytes of memory: write `sizeof *robot`. `robot` may be the robot in use, which
/// is then replaced.
#[unsafe(export_name = family!("outcome_robot"))]
pub extern "C" fn outcome_robot(
    outcome: Held<Outcome>,
    mut robot: New<Robot<Real>>,
    size: usize,
) -> Status {
    status_of(|| {
        let found = outcome.get()?.robot;
        robot.put(size, &found)?;
        Ok(status::OK)
    })
}

/// Writes how well an arm is known; `arm` is 0, 1 or 2. With `dcal_joint_...` residual and noise are the whole robot's.
///
/// Errors: `DCAL_NO_SUCH_ARM`.
#[unsafe(export_name = family!("outcome_arm"))]
pub extern "C" fn outcome_arm(
    outcome: Held<Outcome>,
    arm: i32,
    mut summary: Out<ArmSummary>,
) -> Status {
    status_of(|| {
        let found = ArmSummary::from(&arm_of(outcome.get()?, index_of(arm)?));
        summary.put(found)?;
        Ok(status::OK)
    })
}

/// Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
///
/// Errors: `DCAL_NO_COVARIANCE`.
#[unsafe(export_name = family!("outcome_deviations"))]
pub extern "C" fn outcome_deviations(
    outcome: Held<Outcome>,
    mut sigma: Out<[[Real; 8]; 3]>,
) -> Status {
    status_of(|| {
        let outcome = outcome.get()?;
        let mut found = [[0.0; 8]; 3];
        for (row, arm) in found.iter_mut().zip(ArmIndex::ALL) {
            let arm = arm_of(outcome, arm);
            for (sigma, parameter) in row.iter_mut().zip(Parameter::ROTARY) {
                *sigma = arm
                    .standard_deviation(parameter)
                    .ok_or(status::NO_COVARIANCE)?;
            }
        }
        sigma.put(found)?;
        Ok(status::OK)
    })
}

/// Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. `arm` is 0, 1 or 2.
///
/// Errors: `DCAL_NO_SUCH_ARM`, `DCAL_NO_COVARIANCE`.
#[unsafe(export_name = family!("outcome_arm_covariance"))]
pub extern "C" fn outcome_arm_covariance(
    outcome: Held<Outcome>,
    arm: i32,
    mut covariance: Out<[[Real; 8]; 8]>,
) -> Status {
    status_of(|| {
        let arm = arm_of(outcome.get()?, index_of(arm)?);
        let found = by_rows(&arm.covariance.ok_or(status::NO_COVARIANCE)?);
        covariance.put(found)?;
        Ok(status::OK)
    })
}
