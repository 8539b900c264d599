//! Functions common to all calibrators, compiled for each: `ikm`, `joint`, `gate` and `fkm`.
#![allow(unsafe_code)] // naming symbols

use super::{Outcome, Own, found};
use crate::error::{Error, report, status_of};
use crate::memory::{Held, HeldMut, New, Out};
use crate::status::{self, Status};
use core::borrow::Borrow;
use delta_cal::Progress;

/// Writes the number of samples.
#[unsafe(export_name = family!("samples"))]
pub extern "C" fn samples(calibrator: Held<Own>, mut samples: Out<u64>) -> Status {
    status_of(|| {
        let count = calibrator.get()?.samples();
        samples.put(count)?;
        Ok(status::OK)
    })
}

/// Begins to solve. Until the last `step`, or `stop`, every call that would change the samples returns `DCAL_BUSY`.
///
/// Errors: those of `finish` that are known already, as `DCAL_TOO_FEW_SAMPLES`, with the arm, how many there are and how
/// many are needed.
#[unsafe(export_name = family!("solve"))]
pub extern "C" fn solve(mut calibrator: HeldMut<Own>, error: Out<Error>) -> Status {
    report(error, || {
        calibrator.get()?.solve()?;
        Ok(status::OK)
    })
}

/// One short step, to be called between the turns of a control loop. Returns `DCAL_WORKING` as long as there is more to
/// do, and then `DCAL_OK`: `finish` has the outcome, or why there is none.
#[unsafe(export_name = family!("step"))]
pub extern "C" fn step(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        Ok(match calibrator.get()?.step() {
            Progress::Working => status::WORKING,
            Progress::Finished => status::OK,
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

/// Drops all samples and what was solved from them: as after `init`.
#[unsafe(export_name = family!("reset"))]
pub extern "C" fn reset(mut calibrator: HeldMut<Own>) -> Status {
    status_of(|| {
        calibrator.get()?.reset();
        Ok(status::OK)
    })
}

/// In its place, and not inlined: its temporaries would share the stack with those of the caller.
#[inline(never)]
fn put(own: &Own, outcome: &mut New<Outcome>, size: usize) -> Result<(), Error> {
    match &found(own) {
        Ok(found) => Ok(outcome.put(size, Borrow::<Outcome>::borrow(found))?),
        Err(error) => Err(*error),
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
