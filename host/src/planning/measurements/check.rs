//! What measurements determine, taken already or not, and which to take in addition.

use super::additions::additions;
use super::places::Places;
use super::planned::Planned;
use super::precision::{Posterior, of_robot, posterior};
use super::request::CheckRequest;
use super::setup::{Setup, with_noise};
use crate::accuracy::expected_error::ExpectedError;
use crate::calibration::error::CalibrateError;
use crate::calibration::observations::{
    Known, check_frame, check_names, expected, explained, prior,
};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, ObservationsToCheck, ReadingFrom};
use crate::fit::observations::{Linearized, linearized};
use crate::fit::options::Options;
use crate::fit::outcome::{RobotCovariance, of_parameters};
use crate::planning::observability::Leverage;
use crate::planning::poses::{PlanError, unknown_parameter};
use delta_cal::{ArmIndex, Parameter};

/// A calibration is worthwhile that leaves no more than this part of the error.
const WORTHWHILE: f64 = 0.5;

/// What measurements determine.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasurementCheck {
    /// The robot, with the noise that it was checked for.
    pub robot: RobotFile,
    /// Whether the robot file states the noise of all that is measured.
    pub noise_stated: bool,
    /// Every row, with what the robot as drawn would read.
    pub file: ObservationsFile,
    /// The lines that do not count, since the robot as drawn does not reach their joint angles.
    pub not_reached: Vec<u64>,
    /// The position error that the tolerance allows; `None` without one.
    pub before: Option<ExpectedError>,
    /// What these measurements leave of it.
    pub now: Option<ExpectedError>,
    /// What they leave with the additional ones.
    pub with_next: Option<ExpectedError>,
    /// What is known better than the tolerance says.
    pub known: Known,
    /// A parameter for whose σ (mm or radians) a calibration would be refused.
    pub unknown: Option<(ArmIndex, Parameter, f64)>,
    /// Each row's. The totals sum up to the parameters, those of the instruments too, that the measurements and
    /// not the tolerance determine.
    pub leverages: Vec<Leverage>,
    /// What is best measured in addition, the best first.
    pub next: Vec<Planned>,
    /// Where the instruments of the additional measurements are.
    pub setup: Option<Setup>,
    /// Why nothing is proposed.
    pub no_next: Option<PlanError>,
}

impl MeasurementCheck {
    /// Of the measurements of a robot.
    ///
    /// # Errors
    /// A row that is not usable, names that no row uses, an instrument with fewer readings than unknowns.
    pub fn new(
        robot: &RobotFile,
        samples: &ObservationsToCheck,
        request: CheckRequest,
    ) -> Result<Self, CalibrateError> {
        let file = &samples.file;
        check_frame(robot, file, request.frame)?;
        check_names(robot, file)?;
        let rows = || file.rows.iter().map(|row| &row.value);
        let measured = [
            file.coordinates(),
            rows().any(|row| row.height.is_some()),
            rows().any(|row| row.distance.is_some()),
        ];
        let (robot, noise_stated) = with_noise(robot, None, measured);
        let places = Places::of(&robot, samples, request.frame);
        let nominal = places.nominal(&robot.robot, file);
        let options = Options {
            frame: request.frame,
            ..Options::default()
        };
        let found = linearized(&robot, &nominal, request.frame)
            .map_err(|error| explained(&robot, &nominal, options, error))?;
        let posterior = posterior(&found, &robot.robot);
        let covariance = posterior.as_ref().map(|own| of_robot(own, &found));
        let covariance =
            covariance.unwrap_or_else(|| RobotCovariance::from_diagonal_element(f64::INFINITY));
        let before = prior(&robot).and_then(|covariance| expected(&robot, &covariance));
        let now = expected(&robot, &covariance);
        let sigma = |arm: usize, own: usize| covariance[(8 * arm + own, 8 * arm + own)].sqrt();
        let sigmas = [0, 1, 2].map(|arm| std::array::from_fn(|own| sigma(arm, own)));
        let mut check = Self {
            known: Known::of(
                &robot,
                Some(&of_parameters(&covariance)),
                before.as_ref(),
                now.as_ref(),
            ),
            unknown: unknown_parameter(&robot.robot, &sigmas),
            leverages: leverages(&nominal, &found, posterior.as_ref()),
            not_reached: not_reached(&robot, &nominal),
            noise_stated,
            before,
            now,
            with_next: None,
            next: Vec::new(),
            setup: None,
            no_next: None,
            file: nominal,
            robot,
        };
        if request.add > 0 {
            check.propose(samples, &places, request);
        }
        Ok(check)
    }

    fn propose(&mut self, samples: &ObservationsToCheck, places: &Places, request: CheckRequest) {
        let read = if samples.unmeasured.is_empty() {
            &samples.file
        } else {
            &self.file
        };
        match additions(&self.robot, &self.file, read, places, request) {
            Err(error) => self.no_next = Some(error),
            Ok(None) => {}
            Ok(Some((setup, next, all))) => {
                let found = linearized(&self.robot, &all, request.frame).ok();
                let covariance = found.and_then(|found| {
                    Some(of_robot(&posterior(&found, &self.robot.robot)?, &found))
                });
                self.with_next = covariance.and_then(|own| expected(&self.robot, &own));
                self.next = next;
                self.setup = Some(setup);
            }
        }
    }

    /// Whether nothing that relative positions depend on is left to the tolerance.
    pub fn determined(&self) -> bool {
        self.unknown.is_none() && self.known.relative_positions()
    }

    /// Whether a calibration is expected to halve the error of relative positions, or, without a tolerance, to
    /// be accepted.
    pub fn worthwhile(&self) -> bool {
        let rms = |own: &Option<ExpectedError>| own.as_ref().map(|own| own.intrinsic.rms);
        self.unknown.is_none()
            && match (rms(&self.before), rms(&self.now)) {
                (Some(before), Some(now)) => now <= WORTHWHILE * before,
                (None, Some(_)) => true,
                (_, None) => false,
            }
    }
}

fn not_reached(robot: &RobotFile, file: &ObservationsFile) -> Vec<u64> {
    let reached = |joints: &[f64; 3]| robot.robot.forward(joints).is_ok();
    let rows = file.rows.iter().filter(|row| {
        let other = match &row.value.distance {
            Some((ReadingFrom::Pose(joints), _)) => Some(joints),
            _ => None,
        };
        !reached(&row.value.joints) || !other.is_none_or(reached)
    });
    rows.map(|row| row.line).collect()
}

/// V C Vᵀ of each row V.
fn leverages(
    file: &ObservationsFile,
    found: &Linearized,
    posterior: Option<&Posterior>,
) -> Vec<Leverage> {
    let Some(posterior) = posterior else {
        return Vec::new();
    };
    let both = file.rows.iter().zip(&found.rows);
    both.map(|(row, rows)| {
        let own = (rows.transpose() * posterior * rows).diagonal();
        Leverage {
            line: row.line,
            joints: row.value.joints,
            total: own.sum(),
            largest: own.max(),
        }
    })
    .collect()
}
