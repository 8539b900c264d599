//! How well the robot would be known after measurements.

use super::planned::{Planned, measurements_file};
use super::setup::Setup;
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::rigid_motion::RigidMotions;
use crate::accuracy::workspace_poses::WorkspacePoses;
use crate::calibration::observations::prior;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::ObservationsFile;
use crate::fit::observations::{self, Linearized, linearized};
use crate::fit::options::Frame;
use crate::fit::outcome::{RobotCovariance, WITH_TRANSMISSIONS};
use crate::planning::poses::{PlanError, made_to_tolerance};
use delta_cal::{Robot, Sample};
use nalgebra::{SMatrix, SVector};
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};

/// The robot's parameters and the unknowns of the instruments that a plan may have: a frame, a plane and four
/// points, for example.
pub(super) const PARAMETERS: usize = 48;
/// The robot's own, with the numbers of its transmissions.
const OF_ROBOT: usize = WITH_TRANSMISSIONS;
/// Poses of each robot made to the tolerance that it is judged over.
const EACH: usize = 400;

/// Of all parameters of the core's problem.
pub(super) type Posterior =
    SMatrix<f64, { observations::PARAMETERS }, { observations::PARAMETERS }>;

/// The expected position error, one σ, mm: root of the mean square over the workspace and over robots made to
/// the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Precision {
    /// In the robot's own frame: the best rigid motion removed.
    pub intrinsic: f64,
    /// In the frame of its parameters.
    pub absolute: f64,
}

/// What a robot is judged by.
#[derive(Debug, Clone)]
struct Robots {
    file: RobotFile,
    /// Of the parameters' covariance C: tr(W C) is the mean square of the position error, in the robot's own
    /// frame and absolute.
    intrinsic: RobotCovariance,
    absolute: RobotCovariance,
}

/// What measurements are judged by: over the nominal robot's workspace, and over those of robots as they may
/// have been made.
#[derive(Debug, Clone)]
pub(super) struct Judge {
    nominal: Robots,
    /// Robots made to the tolerance; none without one.
    made: Vec<Robots>,
    /// W of the nominal robot's relative positions, in the problem's units.
    weights: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

impl Judge {
    /// `poses`: of the nominal robot; the positions that count.
    pub(super) fn new(
        file: &RobotFile,
        poses: &[Sample<f64>],
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let nominal = Robots::new(file.clone(), poses).ok_or(PlanError::NoPose)?;
        let stride = poses.len().div_ceil(EACH).max(1);
        let few: Vec<_> = poses.iter().step_by(stride).copied().collect();
        let made = made_to_tolerance(file, rng).into_par_iter();
        let made = made.filter_map(|file| Robots::new(file, &few)).collect();
        let units = units(file);
        let weights = SMatrix::from_fn(|row, column| {
            if row.max(column) < OF_ROBOT {
                nominal.intrinsic[(row, column)] * units[row] * units[column]
            } else {
                0.0
            }
        });
        Ok(Self {
            nominal,
            made,
            weights,
        })
    }

    /// W of tr W C, the mean square of the nominal robot's relative position error, C in the problem's units.
    pub(super) const fn weights(&self) -> &SMatrix<f64, PARAMETERS, PARAMETERS> {
        &self.weights
    }

    /// Before any measurement; `None` without a tolerance.
    pub(super) fn before(&self, setup: &Setup) -> Option<Precision> {
        setup.robot.tolerance.as_ref()?;
        self.over(|robot| prior(&robot.file))
    }

    /// After these measurements. `None` if they cannot be taken, or leave something unknown.
    pub(super) fn after(&self, setup: &Setup, planned: &[Planned]) -> Option<Precision> {
        self.over(|robot| covariance(&robot.file, setup, planned))
    }

    /// The same of one robot made to the tolerance, of the nominal one without.
    pub(super) fn after_of_one(
        &self,
        setup: &Setup,
        planned: &[Planned],
        which: usize,
    ) -> Option<Precision> {
        let made = self.made.get(which % self.made.len().max(1));
        let robot = made.unwrap_or(&self.nominal);
        robot.precision(&covariance(&robot.file, setup, planned)?)
    }

    /// The covariance of the nominal robot's parameters, and the expected error over its whole workspace with
    /// the worst places.
    pub(super) fn nominal(
        &self,
        setup: &Setup,
        planned: &[Planned],
    ) -> Option<(RobotCovariance, ExpectedError)> {
        let file = &self.nominal.file;
        let covariance = covariance(file, setup, planned)?;
        let uncertainty = PositionUncertainty {
            robot: &file.robot,
            covariance: &covariance,
        };
        let poses = WorkspacePoses::of(file);
        let expected = ExpectedError::of(&uncertainty, &file.reach(), &poses)?;
        Some((covariance, expected))
    }

    fn over(&self, of: impl Fn(&Robots) -> Option<RobotCovariance> + Sync) -> Option<Precision> {
        let nominal = self.nominal.precision(&of(&self.nominal)?)?;
        let made: Vec<_> = self
            .made
            .par_iter()
            .filter_map(|robot| robot.precision(&of(robot)?))
            .collect();
        if made.is_empty() {
            return Some(nominal);
        }
        #[allow(clippy::cast_precision_loss)] // 64
        let count = made.len() as f64;
        let mean = |of: &dyn Fn(&Precision) -> f64| {
            (made.iter().map(|own| of(own).powi(2)).sum::<f64>() / count).sqrt()
        };
        Some(Precision {
            intrinsic: mean(&|own| own.intrinsic),
            absolute: mean(&|own| own.absolute),
        })
    }
}

impl Robots {
    fn new(file: RobotFile, poses: &[Sample<f64>]) -> Option<Self> {
        let reach = file.reach();
        let there: Vec<_> = poses
            .iter()
            .filter_map(|pose| {
                let position = reach.clear_position(&file.robot, &pose.joints).ok()?;
                let uncertainty = PositionUncertainty {
                    robot: &file.robot,
                    covariance: &RobotCovariance::zeros(),
                };
                let jacobian = uncertainty.jacobian(&position, &pose.joints)?;
                Some((position, jacobian))
            })
            .collect();
        let motions = RigidMotions::of(there.iter().map(|(position, _)| *position))?;
        let explained = motions.explaining(there.iter().copied());
        let (mut intrinsic, mut absolute) = (RobotCovariance::zeros(), RobotCovariance::zeros());
        for (position, jacobian) in &there {
            absolute += jacobian.transpose() * jacobian;
            let left = jacobian - motions.at(position) * explained;
            intrinsic += left.transpose() * left;
        }
        #[allow(clippy::cast_precision_loss)] // 2000
        let count = there.len() as f64;
        Some(Self {
            file,
            intrinsic: intrinsic / count,
            absolute: absolute / count,
        })
    }

    fn precision(&self, covariance: &RobotCovariance) -> Option<Precision> {
        let rms = |weights: &RobotCovariance| {
            let variance = weights.dot(covariance);
            (variance >= 0.0).then(|| variance.sqrt())
        };
        Some(Precision {
            intrinsic: rms(&self.intrinsic)?,
            absolute: rms(&self.absolute)?,
        })
    }
}

/// Of the robot's parameters (mm, radians) after measurements of a robot.
fn covariance(file: &RobotFile, setup: &Setup, planned: &[Planned]) -> Option<RobotCovariance> {
    let file = RobotFile {
        noise: setup.robot.noise,
        instruments: setup.robot.instruments.clone(),
        ..file.clone()
    };
    let measured = measurements_file(planned, &file.robot, setup)?;
    let found = linearized(&file, &measured, setup.frame).ok()?;
    covariance_of(&found, &file.robot)
}

/// Of the robot's parameters (mm, radians) after measurements.
fn covariance_of(found: &Linearized, robot: &Robot<f64>) -> Option<RobotCovariance> {
    Some(of_robot(&posterior(found, robot)?, found))
}

/// Of a robot's parameters (mm, radians) after measurements of it. `None` if they cannot be taken.
pub(crate) fn covariance_after(
    robot: &RobotFile,
    file: &ObservationsFile,
    frame: Frame,
) -> Option<RobotCovariance> {
    covariance_of(&linearized(robot, file, frame).ok()?, &robot.robot)
}

/// Of all parameters in the core's units.
pub(super) fn posterior(found: &Linearized, robot: &Robot<f64>) -> Option<Posterior> {
    let mut information: Posterior = information_of_prior(found, robot);
    for rows in &found.rows {
        information += rows * rows.transpose();
    }
    Some(information.cholesky()?.inverse())
}

/// The part of the robot's own parameters, in mm and radians.
pub(super) fn of_robot(posterior: &Posterior, found: &Linearized) -> RobotCovariance {
    RobotCovariance::from_fn(|row, column| {
        if row.max(column) < found.of_robot {
            posterior[(row, column)] * found.units[row] * found.units[column]
        } else {
            0.0
        }
    })
}

/// Information before any measurement: what is known, and that no parameter is off by more than a forearm, so
/// that there always is some.
pub(super) fn information_of_prior<const D: usize>(
    found: &Linearized,
    robot: &Robot<f64>,
) -> SMatrix<f64, D, D> {
    let [arm, ..] = robot.arms();
    let least = (arm.upper_arm_length() / arm.lb()).powi(2);
    SMatrix::from_fn(|row, column| {
        let least = if row == column { least } else { 0.0 };
        found.prior.information(row, column) + least
    })
}

/// What a correction of 1 is in the core's problem: mm or radians; 0 of transmissions that are known.
fn units(file: &RobotFile) -> SVector<f64, OF_ROBOT> {
    let uniform = crate::accuracy::information::units(&file.robot);
    let of_transmission = if file.transmission.is_some() {
        1.0
    } else {
        0.0
    };
    SVector::from_fn(|index, _| match file.robot.arms().get(index / 8) {
        Some(arm) => arm.upper_arm_length() / uniform[index],
        None => of_transmission,
    })
}
