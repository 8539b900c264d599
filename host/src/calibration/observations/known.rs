//! What measurements determine and what they leave to the tolerance.

use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::information::parameter_at;
use crate::accuracy::information::rows_of_prior;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::ObservationsFile;
use delta_cal::Parameter;
use delta_cal::calibration::TolerancePrior;
use delta_cal::robot::ParameterKind;
use nalgebra::{SMatrix, SVector};

type Matrix24 = SMatrix<f64, 24, 24>;

/// Numbers of a robot's place in space.
const PLACE_IN_SPACE: usize = 6;

/// What the measurements determine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// How many combinations of the parameters the measurements determine better than the tolerance
    /// does. Without a tolerance all, since a calibration is refused otherwise.
    pub combinations: usize,
    /// How many combinations there are that relative positions depend on.
    pub of: usize,
    /// Whether the measurements say where the robot stands in the frame of its parameters.
    pub place: bool,
    /// Whether they say how large it is.
    pub scale: bool,
}

/// The place in space is known if the part of the position error that is a rigid motion falls below this part
/// of what the tolerance allows.
const PLACE_KNOWN: f64 = 0.5;

/// Of the squared position error the part that is a rigid motion, and its root: mm.
fn place(expected: &ExpectedError) -> f64 {
    let (absolute, intrinsic) = (expected.absolute.rms, expected.intrinsic.rms);
    (absolute * absolute - intrinsic * intrinsic)
        .max(0.0)
        .sqrt()
}

impl Known {
    /// `covariance`: of the robot's parameters after the measurements, mm and radians, with the tolerance.
    /// `before` and `after`: the position errors that the robot is expected to have.
    pub(crate) fn of(
        robot: &RobotFile,
        covariance: Option<&Matrix24>,
        before: Option<&ExpectedError>,
        after: Option<&ExpectedError>,
    ) -> Self {
        let parameters = 3 * robot.robot.drive().parameters().len();
        let of = parameters - PLACE_IN_SPACE;
        let everything = Self {
            of,
            combinations: parameters,
            place: true,
            scale: true,
        };
        let (Some(tolerance), Some(covariance)) = (&robot.tolerance, covariance) else {
            return everything;
        };
        let rows = rows_of_prior(&TolerancePrior::new(
            &robot.robot,
            &[1.0; 24],
            Some(tolerance),
        ));
        let mut scaled = rows * covariance * rows.transpose();
        for index in (0..24).filter(|index| parameter_at(&robot.robot, *index).is_none()) {
            // Of an empty place as little is known as beforehand.
            scaled[(index, index)] = 1.0;
        }
        let Some(inverse) = scaled.try_inverse() else {
            return everything;
        };
        // In tolerances: what the measurements alone say, beside 1 of the tolerance.
        let measured = inverse - Matrix24::identity();
        let eigenvalues = measured.symmetric_eigenvalues();
        let larger = SVector::<f64, 24>::from_fn(|index, _| {
            match parameter_at(&robot.robot, index) {
                // The travel grows with everything else if its scale does.
                Some((_, Parameter::Scale)) => 1.0,
                Some((arm, parameter)) if parameter.kind() == ParameterKind::Length => {
                    robot.robot.arm(arm).get(parameter)
                }
                _ => 0.0,
            }
        });
        let larger = rows * larger;
        let size = larger.norm_squared();
        Self {
            of,
            combinations: eigenvalues.iter().filter(|value| **value > 1.0).count(),
            place: before
                .zip(after)
                .is_none_or(|(before, after)| place(after) < PLACE_KNOWN * place(before)),
            scale: larger.dot(&(measured * larger)) > size,
        }
    }

    /// Whether all that relative positions depend on is known better than the tolerance says.
    pub(crate) const fn relative_positions(&self) -> bool {
        self.scale && self.combinations >= self.of
    }

    /// What remains unknown of the measurements of a file, in sentences, each with the remedy that costs least.
    pub fn gaps(&self, samples: &ObservationsFile) -> Vec<String> {
        let mut gaps = Vec::new();
        if !self.place {
            gaps.push(
                "The place of the robot in space (six numbers) comes from the tolerance alone, since no \
                 measurement refers to the robot's frame. It does not matter where positions are taught; \
                 otherwise measure x, y and z of three poses or more."
                    .to_owned(),
            );
        }
        if !self.scale {
            let distances = samples.rows.iter().any(|row| row.value.distance.is_some());
            gaps.push(if distances {
                "The scale of the robot comes from the tolerance: the distances are too few or too inexact to show it \
                 better. Measure more of them, longer ones, or more exactly."
                    .to_owned()
            } else {
                "The scale of the robot comes from the tolerance alone: an enlarged robot touches the same \
                 planes. One known length restores it: touch the top of a gauge block (height_mm = its \
                 height), or measure one distance between two poses with a calliper."
                    .to_owned()
            });
        }
        if self.combinations < self.of {
            gaps.push(format!(
                "The measurements determine {} of the {} combinations of parameters that relative \
                 positions depend on better than the tolerance does.",
                self.combinations, self.of
            ));
        }
        gaps
    }
}
