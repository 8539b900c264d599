//! What an estimator found.

use super::{Frame, Method};
use crate::files::samples_file::{Kind, READINGS, Reading, ReadingFrom};
use delta_cal::calibration::StartUsed;
use delta_cal::frame::RigidTransform;
use delta_cal::{Noise, Robot};
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

/// σ of each kind of reading as the fit weighs it: mm, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Of a coordinate, and of the joints.
    pub position: Noise<f64>,
    /// Of a height.
    pub height: f64,
    /// Of a distance.
    pub distance: f64,
}

impl Levels {
    /// One σ of a kind of reading, mm; of coordinates the rms over the axes.
    pub fn of(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Position => self.position.position(),
            Kind::Height => self.height,
            Kind::Distance => self.distance,
        }
    }
}

/// What the residuals say of one kind of reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindNoise {
    /// Which.
    pub kind: Kind,
    /// Whether the robot file states it; otherwise it is estimated.
    pub stated: bool,
    /// The σ that the readings were weighted with, mm.
    pub sigma: f64,
    /// How many readings count.
    pub readings: f64,
    /// ν: readings less what the parameters take up of them, n − tr(J C Jᵀ).
    pub freedom: f64,
    /// Σ of the squared residuals in σ.
    pub squares: f64,
    /// ν with that of the prior of an estimated σ.
    pub known: f64,
}

impl KindNoise {
    /// How many times σ the residuals are: 1 is expected. NaN without a degree of freedom.
    pub fn ratio(&self) -> f64 {
        (self.squares / self.freedom).sqrt()
    }
}

/// Where a plane is: a height above it is `normal · X − offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneFound {
    /// Upward, of length 1.
    pub normal: Vector3<f64>,
    /// mm.
    pub offset: f64,
}

/// Where a point is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointFound {
    /// mm.
    pub place: Vector3<f64>,
    /// What its sensor reads too much, mm.
    pub offset: f64,
}

/// Where the instruments are.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// From the robot's frame to that of the coordinates; `None` if they are the same.
    pub frame: Option<RigidTransform<f64>>,
    /// The planes in the order of the file.
    pub planes: Vec<PlaneFound>,
    /// The points in the order of the file.
    pub points: Vec<PointFound>,
}

impl Places {
    /// What the readings of a row should be at a robot: x, y, z, height, distance; `None` where nothing was read or the
    /// robot cannot be there.
    pub fn expected(&self, robot: &Robot<f64>, reading: &Reading) -> [Option<f64>; READINGS] {
        let Ok(position) = robot.forward(&reading.joints) else {
            return [None; READINGS];
        };
        let seen = self.frame.map_or(position, |frame| frame.apply(&position));
        let height = reading.height.and_then(|(plane, _)| {
            let plane = self.planes.get(plane)?;
            Some(plane.normal.dot(&position) - plane.offset)
        });
        let distance = reading.distance.and_then(|(from, _)| match from {
            ReadingFrom::Point(point) => {
                let point = self.points.get(point)?;
                Some((position - point.place).norm() + point.offset)
            }
            ReadingFrom::Pose(joints) => Some((position - robot.forward(&joints).ok()?).norm()),
        });
        let [x, y, z] = [0, 1, 2].map(|axis| reading.position[axis].map(|_| seen[axis]));
        [x, y, z, height, distance]
    }
}

/// What the fit made of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowFit {
    /// Residuals in σ, whitened within the row: 0 where nothing was read.
    pub whitened: [f64; READINGS],
    /// The part of each that the parameters take up, 0 to 1: the diagonal of J C Jᵀ.
    pub leverage: [f64; READINGS],
    /// By what its squared residuals are multiplied: 1 in least squares.
    pub weight: f64,
    /// Whether a robust fit leaves it out.
    pub suspected: bool,
    /// Whether it does not count because the robot of the file does not reach its joint angles.
    pub left_out: bool,
}

/// How the readings of a row change, in σ.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sensitivity {
    /// The place of the row among all.
    pub(crate) row: usize,
    /// ∂h/∂u of all unknowns u, in mm, radians or no unit.
    pub(crate) by_unknowns: SMatrix<f64, READINGS, MOST>,
    /// ∂h/∂X where the platform is, and where a distance between two poses begins.
    pub(crate) by_positions: [[Vector3<f64>; READINGS]; 2],
}

/// Parameters and instruments' unknowns with their covariance, and what is left of each row.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// By which estimator.
    pub method: Method,
    /// The frame of the coordinates.
    pub frame: Frame,
    /// The robot.
    pub robot: Robot<f64>,
    /// Where the instruments were found.
    pub places: Places,
    /// Where they are if the robot of the file is right.
    pub places_before: Places,
    /// Covariance of all unknowns: 24 parameters, 15 numbers of the transmissions if they are unknown, then the
    /// frame, planes and points; mm, radians and their products. What is estimated with an unknown noise has the
    /// variance of Student's distribution.
    pub covariance: DMatrix<f64>,
    /// The rows U of what was known beforehand of all unknowns, |U u|², about the robot of the file.
    pub(crate) prior: DMatrix<f64>,
    /// How far the unknowns are from the centre of the prior.
    pub(crate) moved: DVector<f64>,
    /// The part of each of the 24 parameters that the tolerance decided, 0 to 1.
    pub prior_share: [f64; PARAMETERS],
    /// Whether transmissions are among the unknowns.
    pub transmissions: bool,
    /// Every row.
    pub rows: Vec<RowFit>,
    /// Of all rows, or of many some.
    pub(crate) sensitivities: Vec<Sensitivity>,
    /// σ of each kind of reading that was used.
    pub levels: Levels,
    /// What the residuals say of each kind of reading that the file holds.
    pub noise: Vec<KindNoise>,
    /// Σ log |L| of the rows' covariances.
    pub(crate) log_spread: f64,
    /// Where the joints' part of the noise was estimated too.
    pub joint_noise_estimated: bool,
    /// Condition of each arm's parameters, 1 at best.
    pub conditions: [f64; 3],
    /// Where it had started.
    pub start: StartUsed,
}

impl Solution {
    /// Covariance of the robot's parameters and the numbers of its transmissions.
    pub fn of_robot(&self) -> RobotCovariance {
        let own = if self.transmissions {
            WITH_TRANSMISSIONS
        } else {
            PARAMETERS
        };
        RobotCovariance::from_fn(|row, column| {
            if row < own && column < own {
                self.covariance[(row, column)]
            } else {
                0.0
            }
        })
    }

    /// Covariance of the 24 parameters alone.
    pub fn of_parameters(&self) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
        SMatrix::from_fn(|row, column| self.covariance[(row, column)])
    }

    /// Degrees of freedom by which the σ of an estimated noise is known, the fewest of all kinds; `None` if all are
    /// stated.
    pub fn estimated_freedom(&self) -> Option<f64> {
        let estimated = self.noise.iter().filter(|own| !own.stated);
        estimated.map(|own| own.known).reduce(f64::min)
    }

    /// Σ of the squared residuals, in σ.
    pub(crate) fn squares(&self) -> f64 {
        self.noise.iter().map(|own| own.squares).sum()
    }

    /// The same with |U u|² of what was known beforehand.
    pub(crate) fn cost(&self) -> f64 {
        self.squares() + (&self.prior * &self.moved).norm_squared()
    }

    /// Degrees of freedom of all readings together.
    pub fn degrees_of_freedom(&self) -> f64 {
        self.noise.iter().map(|own| own.freedom).sum()
    }

    /// Whether coordinates fix the place of the robot's base: its absolute accuracy is measured.
    pub fn is_absolute(&self) -> bool {
        self.frame == Frame::Base && self.noise.iter().any(|own| own.kind == Kind::Position)
    }

    /// With every σ multiplied by a factor.
    #[must_use]
    pub(crate) fn widened(mut self, factor: f64) -> Self {
        self.covariance *= factor * factor;
        self
    }
}

/// Number of parameters of Model 24.
pub(crate) const PARAMETERS: usize = 24;
/// With the numbers of the transmissions.
pub(crate) const WITH_TRANSMISSIONS: usize = PARAMETERS + 15;
/// The robot's parameters and the unknowns of as many instruments as a file may have: a frame and 14
/// points, for example.
pub(crate) const MOST: usize = 72;
pub(crate) const COLUMNS: usize = MOST + 1;
pub(crate) const ENTRIES: usize = COLUMNS * (COLUMNS + 1) / 2;

/// Covariance of the parameters, arm by arm, and of the numbers of the transmissions: mm, radians and their
/// products. That of what is known is 0.
pub type RobotCovariance = SMatrix<f64, WITH_TRANSMISSIONS, WITH_TRANSMISSIONS>;

/// The part of the parameters alone.
pub(crate) fn of_parameters(covariance: &RobotCovariance) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    covariance
        .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
        .into_owned()
}
