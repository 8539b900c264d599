//! The calibration from heights, distances and single coordinates: from two files to a report, or to the
//! reason why there is none.

mod check;
mod known;
mod refusal;
mod report;
mod transmissions;
mod warnings;

pub use check::check;
pub use known::Known;
pub use report::ObservationsReport;
pub use transmissions::TransmissionFound;

use super::error::CalibrateError;
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::information::prior_with_transmissions;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::workspace_comparison::{Calibrated, WorkspaceComparison};
use crate::accuracy::workspace_poses::WorkspacePoses;
use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::ObservationsFile;
use crate::fit::observations::{ObservedError, ObservedFit, calibrate, calibrate_robust};
use crate::fit::options::Options;
use crate::fit::outcome::{RobotCovariance, of_parameters};
use delta_cal::Robot;
use delta_cal::calibration::{Prior, TolerancePrior};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A χ² of the residuals that is as improbably large as this widens every σ; one as improbably small is doubtful.
const IMPROBABLE: f64 = 0.001;

/// Calibrates a robot from observations.
///
/// # Errors
/// Options that make no sense here, an input that cannot be used, or a refusal.
pub fn calibrate_observations(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
) -> Result<ObservationsReport, CalibrateError> {
    check(robot, samples, options)?;
    let (frame, solver) = (options.frame, options.solver);
    let fit = match options.loss {
        None => calibrate(robot, samples, frame, solver),
        Some(loss) => calibrate_robust(robot, samples, frame, solver, loss),
    };
    let fit = fit.map_err(|error| explained(robot, samples, options, error))?;
    report(robot, samples, options, fit)
}

/// The reason in words.
pub fn explained(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
    error: ObservedError,
) -> CalibrateError {
    match error {
        ObservedError::Row(index, error) => samples
            .fault(index, error.to_string())
            .with_remedy("check the row and the units in the header (_mm or _m, _deg or _rad)")
            .into(),
        ObservedError::TooManyInstruments => {
            let cause = "the rows name more planes and points than one calibration can hold";
            InputError::new(&samples.name, cause)
                .with_remedy(if robot.transmission.is_some() {
                    "use at most 9 points, or 11 planes, or do not find the transmissions"
                } else {
                    "use at most 14 points, or 16 planes"
                })
                .into()
        }
        ObservedError::Refused(refusal) => {
            refusal::refused(robot, samples, options, refusal).into()
        }
        ObservedError::Robust(refusal) => refusal::robust(samples, &refusal).into(),
    }
}

/// What there is to know of a fit.
///
/// # Errors
/// Nothing says that the fit improves the robot.
pub fn report(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
    mut fit: ObservedFit,
) -> Result<ObservationsReport, CalibrateError> {
    let squares: f64 = fit
        .residuals
        .iter()
        .zip(&fit.weights)
        .map(|(row, weight)| weight * row.iter().map(|own| own * own).sum::<f64>())
        .sum();
    let cost = squares + tolerance_cost(robot, &fit);
    let freedom = freedom(robot, samples, &fit);
    let lack_of_fit = if freedom > 0.0 {
        (cost / freedom).sqrt()
    } else {
        1.0
    };
    // The residuals by themselves as well: the tolerance's share, which a wrong noise does not change, would hide it.
    let of_residuals = freedom - determined(robot, &fit);
    let widening = [(cost, freedom), (squares, of_residuals)]
        .into_iter()
        .filter(|(sum, freedom)| {
            ChiSquared::new(*freedom).is_ok_and(|expected| expected.sf(*sum) < IMPROBABLE)
        })
        .map(|(sum, freedom)| (sum / freedom).sqrt())
        .fold(1.0, f64::max);
    fit.outcome = fit.outcome.widened(widening);
    fit.covariance = fit.covariance.map(|own| own * widening.powi(2));
    let mut after = RobotFile {
        robot: fit.outcome.fit.robot,
        record: robot.record.of_the_robot(),
        ..robot.clone()
    };
    if let Some(frame) = fit.frame {
        after.sensor_frame = Some(frame);
    }
    let expected_after = fit
        .covariance
        .as_ref()
        .and_then(|covariance| expected(&after, covariance));
    let expected_before = prior(robot).and_then(|covariance| expected(robot, &covariance));
    let workspace = fit.covariance.as_ref().and_then(|covariance| {
        let calibrated = Calibrated {
            before: &robot.robot,
            after: &after.robot,
            covariance: &of_parameters(covariance),
            tolerance: robot.tolerance.as_ref(),
            degrees_of_freedom: None,
            relative: true,
        };
        WorkspaceComparison::of(&calibrated, &robot.reach())
    });
    let known = Known::of(
        robot,
        fit.outcome.covariance.as_ref(),
        expected_before.as_ref(),
        expected_after.as_ref(),
    );
    let transmissions = robot
        .transmission
        .map(|_| TransmissionFound::of(&after.robot, fit.covariance.as_ref()));
    let mut report = ObservationsReport {
        before: robot.clone(),
        after,
        samples: samples.clone(),
        frame: options.frame,
        fit,
        lack_of_fit,
        widening,
        expected_before,
        expected_after,
        workspace,
        degrees_of_freedom: freedom,
        known,
        transmissions,
        warnings: Vec::new(),
    };
    report.warnings = warnings::of(
        &report,
        ChiSquared::new(freedom).is_ok_and(|own| own.cdf(cost) < IMPROBABLE),
    );
    match refusal::objection(&report) {
        Some(refused) => Err(refused.into()),
        None => Ok(report),
    }
}

/// How far from nominal the robot is, in tolerances: Σ ((p − nominal)/tolerance)², if each is by itself.
fn tolerance_cost(robot: &RobotFile, fit: &ObservedFit) -> f64 {
    let (before, after) = (&robot.robot, &fit.outcome.fit.robot);
    let [nominal, calibrated] = [before, after].map(Robot::parameters);
    let off = std::array::from_fn(|index| {
        calibrated[index / 8][index % 8] - nominal[index / 8][index % 8]
    });
    let prior = TolerancePrior::new(before, &[1.0; 24], robot.tolerance.as_ref());
    Prior::<f64, 24, 25, 325>::cost(&prior, &off) + transmission_cost(robot, fit)
}

/// The same of the transmissions' numbers, if they were to be found.
fn transmission_cost(robot: &RobotFile, fit: &ObservedFit) -> f64 {
    let Some(tolerance) = &robot.transmission else {
        return 0.0;
    };
    let numbers = |robot: &Robot<f64>| robot.transmissions().map(|own| own.numbers());
    let (after, before) = (numbers(&fit.outcome.fit.robot), numbers(&robot.robot));
    let differences = after.iter().flatten().zip(before.iter().flatten());
    let squares = differences.map(|(after, before)| ((after - before) / tolerance.sigma()).powi(2));
    squares.sum()
}

/// Readings less parameters that nothing holds beforehand.
fn freedom(robot: &RobotFile, samples: &ObservationsFile, fit: &ObservedFit) -> f64 {
    let count = |number: usize| -> f64 {
        #[allow(clippy::cast_precision_loss)] // rows of a file
        let number = number as f64;
        number
    };
    let rows = samples.rows.iter().zip(&fit.weights);
    let weighed = rows.map(|(row, weight)| weight * count(row.value.readings()));
    let weights: f64 = fit.weights.iter().sum();
    let readings = weighed.sum::<f64>() * fit.effective_rows / weights.max(f64::MIN_POSITIVE);
    let free = match robot.tolerance {
        Some(_) => 0,
        None => 3 * robot.robot.drive().parameters().len(),
    };
    let facts = &robot.instruments;
    let level = facts.planes.iter().filter(|plane| plane.tilt.is_some());
    let known = robot.transmission.map_or(0, |_| 15)
        + facts.planes.len()
        + 2 * level.count()
        + 3 * facts
            .points
            .iter()
            .filter(|point| point.place.is_some())
            .count();
    readings + count(known) - count(free + fit.unknowns)
}

/// How many of the parameters that a tolerance holds the readings determine: the parts that it does not.
fn determined(robot: &RobotFile, fit: &ObservedFit) -> f64 {
    if robot.tolerance.is_none() {
        return 0.0;
    }
    let places = robot.robot.drive().places();
    let arms = fit.outcome.fit.arms.iter();
    let parts = arms.flat_map(|arm| arm.prior_share.iter().zip(&places));
    let own = parts.filter(|(_, place)| place.is_some());
    own.map(|(share, _)| 1.0 - share).sum()
}

/// The covariance of the parameters before any measurement.
pub(crate) fn prior(robot: &RobotFile) -> Option<RobotCovariance> {
    let tolerance = robot.tolerance.as_ref()?;
    let transmission = robot.transmission.as_ref();
    Some(prior_with_transmissions(
        &robot.robot,
        tolerance,
        transmission,
    ))
}

/// The position error that a robot with this covariance of its parameters is expected to have.
pub(crate) fn expected(file: &RobotFile, covariance: &RobotCovariance) -> Option<ExpectedError> {
    let uncertainty = PositionUncertainty {
        robot: &file.robot,
        covariance,
    };
    ExpectedError::of(&uncertainty, &file.reach(), &WorkspacePoses::of(file))
}
