//! What readings determine and what they leave to the tolerance.

use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::information::{is_empty, parameter_at, prior_covariance};
use crate::fit::covariance::PARAMETERS;
use delta_cal::robot::{Parameter, ParameterKind};
use delta_cal::{Robot, Tolerance};
use nalgebra::{DMatrix, DVector, SMatrix};
use serde::Serialize;

/// Numbers of a robot's place in space.
const PLACE_IN_SPACE: usize = 6;
/// The place in space is known if the part of the position error that is a rigid motion falls below this part
/// of what the tolerance allows.
const PLACE_KNOWN: f64 = 0.5;

/// What the readings determine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Known {
    /// How many combinations of the parameters the readings determine better than the tolerance
    /// does. Without a tolerance all, since a calibration is refused otherwise.
    pub combinations: usize,
    /// How many combinations there are that relative positions depend on.
    pub of: usize,
    /// Whether the readings say where the robot stands in the frame of its parameters.
    pub place: bool,
    /// Whether they say how large it is.
    pub scale: bool,
}

/// Of the squared position error the part that is a rigid motion, and its root: mm.
fn place(expected: &ExpectedError) -> f64 {
    let (absolute, relative) = (expected.absolute.rms, expected.intrinsic.rms);
    (absolute * absolute - relative * relative).max(0.0).sqrt()
}

impl Known {
    /// Whether all that relative positions depend on is known better than the tolerance says.
    pub const fn relative_positions(&self) -> bool {
        self.scale && self.combinations >= self.of
    }

    /// `covariance`: of the robot's parameters after the readings, mm and radians, with the tolerance.
    /// `before` and `after`: the position errors that the robot is expected to have.
    pub fn of(
        robot: &Robot<f64>,
        tolerance: Option<&Tolerance<f64>>,
        covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
        before: Option<&ExpectedError>,
        after: Option<&ExpectedError>,
    ) -> Self {
        let used: Vec<usize> = (0..PARAMETERS)
            .filter(|place| !is_empty(robot, *place))
            .collect();
        let of = used.len() - PLACE_IN_SPACE;
        let everything = Self {
            of,
            combinations: used.len(),
            place: true,
            scale: true,
        };
        let Some(tolerance) = tolerance else {
            return everything;
        };
        let pick = |matrix: &SMatrix<f64, PARAMETERS, PARAMETERS>| {
            DMatrix::from_fn(used.len(), used.len(), |row, column| {
                matrix[(used[row], used[column])]
            })
        };
        let inverses = || {
            let root = pick(&prior_covariance(robot, tolerance)).cholesky()?.l();
            let inverse = root.try_inverse()?;
            let scaled = &inverse * pick(covariance) * inverse.transpose();
            Some((inverse, scaled.try_inverse()?))
        };
        let Some((rows, information)) = inverses() else {
            return everything;
        };
        // In tolerances: what the readings alone say, beside 1 of the tolerance.
        let measured = information - DMatrix::identity(used.len(), used.len());
        let larger = DVector::from_fn(used.len(), |index, _| {
            match parameter_at(robot, used[index]) {
                // The travel grows with everything else if its scale does.
                Some((_, Parameter::Scale)) => 1.0,
                Some((arm, parameter)) if parameter.kind() == ParameterKind::Length => {
                    robot.arm(arm).get(parameter)
                }
                _ => 0.0,
            }
        });
        let larger = rows * larger;
        let size = larger.norm_squared();
        let eigenvalues = measured.clone().symmetric_eigenvalues();
        Self {
            of,
            combinations: eigenvalues.iter().filter(|value| **value > 1.0).count(),
            place: before
                .zip(after)
                .is_none_or(|(before, after)| place(after) < PLACE_KNOWN * place(before)),
            scale: larger.dot(&(measured * &larger)) > size,
        }
    }
}
