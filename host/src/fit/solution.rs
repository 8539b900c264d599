//! The result of an estimator, or why there is none.

use super::{Frame, Method};
use crate::effects::{EffectKind, Estimated, OrientationNoise, Places};
use crate::files::{Kind, READINGS, Readings};
use crate::geometry::NUMBERS;
use delta_cal::calibration::Start;
use delta_cal::observations::{ObservationError, PrepareError};
use delta_cal::{Noise, Refusal, Robot};
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

/// Why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unsolved {
    /// A row is unusable.
    Row(usize, ObservationError),
    /// The file has more planes and points than there is room for.
    TooManyInstruments,
    /// The readings do not determine this robot.
    Refused(Refusal),
    /// Too few rows for a robust fit, half of which must determine the robot: their number, and the number needed.
    TooFewForRobust(usize, usize),
    /// So many rows disagree with the others that a robust fit cannot tell which are right: their number, and that of all
    /// rows.
    TooManySuspected(usize, usize),
    /// A kind of reading has no redundancy, so its noise cannot be estimated.
    NoRedundancy,
}

impl From<Refusal> for Unsolved {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::TooManyUnknowns { .. } => Self::TooManyInstruments,
            refusal => Self::Refused(refusal),
        }
    }
}

impl From<PrepareError> for Unsolved {
    fn from(error: PrepareError) -> Self {
        match error {
            PrepareError::Row { index, error } => Self::Row(index, error),
            PrepareError::Refused(refusal) => refusal.into(),
            _ => Self::TooManyInstruments,
        }
    }
}

/// σ of each kind of reading, as used for its weight: mm, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Of a coordinate and of the joints.
    pub position: Noise<f64>,
    /// Of a height.
    pub height: f64,
    /// Of a distance.
    pub distance: f64,
}

impl Levels {
    /// σ of a kind of reading, mm; for coordinates the rms over the axes.
    pub fn of(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Position => self.position.position(),
            Kind::Height => self.height,
            Kind::Distance => self.distance,
        }
    }
}

/// Noise statistics of one kind of reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindNoise {
    /// The kind.
    pub kind: Kind,
    /// Whether the robot file states σ; otherwise it is estimated.
    pub stated: bool,
    /// The σ used to weight the readings, mm.
    pub sigma: f64,
    /// Effective number of readings.
    pub readings: f64,
    /// ν: readings less those that the parameters take up, n − tr(J C Jᵀ).
    pub freedom: f64,
    /// Sum of the squared residuals, in σ.
    pub squares: f64,
    /// ν including the prior degrees of freedom of an estimated σ.
    pub known: f64,
}

impl KindNoise {
    /// Residuals in units of σ: 1 is expected. NaN without degrees of freedom.
    pub fn ratio(&self) -> f64 {
        (self.squares / self.freedom).sqrt()
    }
}

/// The result of the fit for a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowFit {
    /// Residuals in σ, whitened within the row; 0 where nothing was read.
    pub whitened: [f64; READINGS],
    /// Share of each reading that the parameters take up, 0 to 1: the diagonal of J C Jᵀ.
    pub leverage: [f64; READINGS],
    /// Factor of its squared residuals: 1 in least squares.
    pub weight: f64,
    /// Whether the robust fit rejects it.
    pub suspected: bool,
    /// Whether it is left out because the robot of the file does not reach its joint angles.
    pub left_out: bool,
}

/// Derivatives of a row's readings, in σ.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sensitivity {
    pub(crate) row: usize,
    /// ∂h/∂u for all unknowns u, per mm, radian or unit: a row a reading.
    pub(crate) by_unknowns: DMatrix<f64>,
    /// ∂h/∂X at the platform's position and, for a distance between two poses, at its start.
    pub(crate) by_positions: [[Vector3<f64>; READINGS]; 2],
}

/// Parameters and instruments' unknowns with their covariance, and the residuals of each row.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The estimator.
    pub method: Method,
    /// The frame of the coordinates.
    pub frame: Frame,
    /// The robot.
    pub robot: Robot<f64>,
    /// The places of the instruments found.
    pub places: Places,
    /// The places of the instruments if the robot of the file is right.
    pub places_before: Places,
    /// Covariance of all unknowns: 24 parameters, 15 numbers of the transmissions if they are unknown, then the frame,
    /// planes, points, the distances' scale and the effects; mm, radians and their products. With an
    /// estimated noise it is that of Student's distribution.
    pub covariance: DMatrix<f64>,
    /// The effects estimated together with the robot.
    pub(crate) effects: Vec<Estimated>,
    /// The readings of the platform point, without these effects, in the frame of `places`.
    pub readings: Readings,
    /// The part of it that the readings' noise makes; the tolerance makes the rest.
    pub(crate) of_readings: DMatrix<f64>,
    /// The factor by which the readings' noise was widened after the fit.
    pub(crate) widening: f64,
    /// The part that causes outside the model make of the robot's place.
    pub(crate) of_causes: Option<DMatrix<f64>>,
    /// The fraction of that by which Student's variance, E[σ²], exceeds that of the expected noise, E[σ]².
    pub(crate) beyond_expected: f64,
    /// Rows U of the prior of all unknowns, |U u|², about the robot of the file.
    pub(crate) prior: DMatrix<f64>,
    /// Displacement of the unknowns from the centre of the prior.
    pub(crate) moved: DVector<f64>,
    /// Share of each of the 24 parameters that comes from the tolerance, 0 to 1.
    pub prior_share: [f64; PARAMETERS],
    /// Whether transmissions are among the unknowns.
    pub transmissions: bool,
    /// Every row.
    pub rows: Vec<RowFit>,
    /// Of all rows, or of an even selection if there are many.
    pub(crate) sensitivities: Vec<Sensitivity>,
    /// σ of each kind of reading that was used.
    pub levels: Levels,
    /// Noise statistics of each kind of reading in the file.
    pub noise: Vec<KindNoise>,
    /// The same of rotations, where they are read and the rods known.
    pub orientation: Option<OrientationNoise>,
    /// Σ log |L| of the rows' covariances.
    pub(crate) log_spread: f64,
    /// Whether the joints' part of the noise was estimated too.
    pub joint_noise_estimated: bool,
    /// Condition number of each arm's parameters, 1 at best.
    pub conditions: [f64; 3],
    /// The start used.
    pub start: Start,
}

impl Solution {
    /// Covariance of the robot's parameters, and of the transmissions' and the rods' numbers.
    pub fn of_robot(&self) -> RobotCovariance {
        self.robots(&self.covariance)
    }

    /// The same with the expected σ of an estimated noise in place of its expected σ²: what an rms error is expected to be,
    /// which is linear in σ.
    pub fn expected_of_robot(&self) -> RobotCovariance {
        self.robots(&(&self.covariance - self.beyond_expected * &self.of_readings))
    }

    /// Whether nothing of the robot but its 24 parameters is estimated.
    pub(crate) fn is_of_parameters(&self) -> bool {
        self.robot_places()[PARAMETERS..]
            .iter()
            .all(Option::is_none)
    }

    /// Number of unknowns that belong to the robot.
    pub(crate) const fn robot_unknowns(&self) -> usize {
        if self.transmissions {
            WITH_TRANSMISSIONS
        } else {
            PARAMETERS
        }
    }

    /// The robot's part of a matrix of all unknowns.
    pub(crate) fn robots(&self, all: &DMatrix<f64>) -> RobotCovariance {
        let places = self.robot_places();
        RobotCovariance::from_fn(|row, column| match (places[row], places[column]) {
            (Some(row), Some(column)) => all[(row, column)],
            _ => 0.0,
        })
    }

    /// The unknown that each of the robot's numbers is; `None` if it is known.
    pub(crate) fn robot_places(&self) -> [Option<usize>; OF_ROBOT] {
        let tilt = self.tilt().map(|own| own.first);
        std::array::from_fn(|own| match own {
            WITH_TRANSMISSIONS.. => tilt.map(|first| first + own - WITH_TRANSMISSIONS),
            own => (own < self.robot_unknowns()).then_some(own),
        })
    }

    /// The first effect of a kind, if one is estimated.
    pub(crate) fn effect(&self, kind: EffectKind) -> Option<&Estimated> {
        let mut effects = self.effects.iter();
        effects.find(|own| own.effect.kind == kind)
    }

    /// The tilt of the platform, if it is estimated.
    pub(crate) fn tilt(&self) -> Option<&Estimated> {
        self.effect(EffectKind::Tilt)
    }

    /// Covariance of the 24 parameters alone.
    pub fn of_parameters(&self) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
        SMatrix::from_fn(|row, column| self.covariance[(row, column)])
    }

    /// Degrees of freedom of an estimated noise, the fewest of all kinds; `None` if every noise is stated. That of heights
    /// counts as known where maps say what beds and touches usually are.
    pub fn estimated_freedom(&self) -> Option<f64> {
        let bed = self.effect(EffectKind::Bed).is_some();
        let known = |own: &&KindNoise| own.stated || (bed && own.kind == Kind::Height);
        let estimated = self.noise.iter().filter(|own| !known(own));
        estimated.map(|own| own.known).reduce(f64::min)
    }

    /// Sum of the squared residuals, in σ.
    pub(crate) fn squares(&self) -> f64 {
        self.noise.iter().map(|own| own.squares).sum()
    }

    /// [`squares`](Self::squares) plus |U u|² of the prior.
    pub(crate) fn cost(&self) -> f64 {
        self.squares() + (&self.prior * &self.moved).norm_squared()
    }

    /// Degrees of freedom of all readings together.
    pub fn degrees_of_freedom(&self) -> f64 {
        self.noise.iter().map(|own| own.freedom).sum()
    }

    /// Whether coordinates fix the robot's base, so that its absolute accuracy is measured.
    pub fn is_absolute(&self) -> bool {
        self.frame == Frame::Base && self.noise.iter().any(|own| own.kind == Kind::Position)
    }

    /// Multiplies the readings' noise by a factor; what the tolerance decides stays as uncertain as it is.
    #[must_use]
    pub(crate) fn widened(mut self, factor: f64) -> Self {
        let squared = factor * factor;
        self.covariance += (squared - 1.0) * &self.of_readings;
        self.of_readings *= squared;
        self.widening *= factor;
        self
    }

    /// The covariance with the noise as it was in the fit.
    pub(crate) fn covariance_of_fit(&self) -> DMatrix<f64> {
        let widened = (1.0 - 1.0 / (self.widening * self.widening)) * &self.of_readings;
        let own = &self.covariance - widened;
        match &self.of_causes {
            Some(of_causes) => own - of_causes,
            None => own,
        }
    }
}

/// Number of parameters of Model 24.
pub(crate) const PARAMETERS: usize = 24;
/// Noise below this fraction of the forearm is rounding of the digits.
pub(crate) const COMPUTED: f64 = 2e-6;
/// With the numbers of the transmissions.
pub(crate) const WITH_TRANSMISSIONS: usize = PARAMETERS + 15;
/// The robot's parameters and the unknowns of as many instruments as a file may have, such as a frame and 14 points.
pub(crate) const MOST: usize = 72;

/// The same with the numbers of the arms' rods.
pub(crate) const OF_ROBOT: usize = WITH_TRANSMISSIONS + NUMBERS;

/// Covariance of the parameters, arm by arm, and of the transmissions' and the rods' numbers: mm, radians and their
/// products; 0 for known numbers.
pub type RobotCovariance = SMatrix<f64, OF_ROBOT, OF_ROBOT>;

pub(crate) fn of_parameters(covariance: &RobotCovariance) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    covariance
        .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
        .into_owned()
}
