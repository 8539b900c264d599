use crate::Real;
use crate::robot::{ArmIndex, Drive};
use crate::state::state;
use core::fmt;
use nalgebra::Vector3;

/// Joint angles beyond ±4π are refused: no joint of a Delta makes two turns, and an angle in degrees mistaken for
/// radians is caught here.
const LARGEST_JOINT_ANGLE_TURNS: f64 = 2.0;

/// One measurement: the platform's position at known joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<T: Real> {
    /// q₁, q₂, q₃ in radians, or the travels of a linear drive in the robot's unit of length.
    pub joints: [T; 3],
    /// X, in the robot's unit of length and frame.
    pub position: Vector3<T>,
}

state!(Sample<T>: joints: [T; 3], position: Vector3<T>);

/// Why a sample is refused. The factor or store that refused it is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SampleError {
    /// A coordinate is NaN, infinite, or too large to be squared.
    PositionNonFinite,
    /// The position is more than about 10,000 forearm lengths of this arm from the robot.
    PositionTooFar(ArmIndex),
    /// This arm's joint angle or travel is NaN, infinite, or too large to be squared.
    JointNonFinite(ArmIndex),
    /// This arm's joint angle is beyond ±4π rad, or its travel beyond about 10,000 forearm lengths.
    JointTooLarge(ArmIndex),
}

impl fmt::Display for SampleError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PositionNonFinite => formatter.write_str("the position is not a finite point"),
            Self::PositionTooFar(arm) => write!(
                formatter,
                "the position is thousands of forearms of {arm} away from the robot"
            ),
            Self::JointNonFinite(arm) => {
                write!(formatter, "the joint angle of {arm} is not a finite number")
            }
            Self::JointTooLarge(arm) => write!(
                formatter,
                "the joint angle of {arm} is beyond two turns (joint angles are in radians), or its travel thousands of forearms"
            ),
        }
    }
}

impl core::error::Error for SampleError {}

/// Why a calibrator refuses a sample. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AddError {
    /// The sample is invalid.
    Sample(SampleError),
    /// A solve is in progress: first call `step` until it has finished.
    Busy,
}

impl fmt::Display for AddError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sample(error) => error.fmt(formatter),
            Self::Busy => {
                formatter.write_str("the calibrator is solving: samples wait until it has finished")
            }
        }
    }
}

impl core::error::Error for AddError {}

impl From<SampleError> for AddError {
    fn from(error: SampleError) -> Self {
        Self::Sample(error)
    }
}

/// All zeros, to initialise a buffer.
impl<T: Real> Default for Sample<T> {
    fn default() -> Self {
        Self {
            joints: [T::ZERO; 3],
            position: Vector3::zeros(),
        }
    }
}

impl<T: Real> Sample<T> {
    /// Checks that every number is usable for a robot with this drive.
    ///
    /// # Errors
    /// The first fault found, joint angles first.
    pub fn check(&self, drive: Drive) -> Result<(), SampleError> {
        for (q, arm) in self.joints.into_iter().zip(ArmIndex::ALL) {
            check_joint(q, arm, drive)?;
        }
        check_position(&self.position)
    }
}

pub(super) fn check_position<T: Real>(x: &Vector3<T>) -> Result<(), SampleError> {
    if x.dot(x).finite() {
        Ok(())
    } else {
        Err(SampleError::PositionNonFinite)
    }
}

pub(crate) fn check_joint<T: Real>(q: T, arm: ArmIndex, drive: Drive) -> Result<(), SampleError> {
    if !q.finite() {
        return Err(SampleError::JointNonFinite(arm));
    }
    if drive == Drive::Linear {
        return if q.squared().finite() {
            Ok(())
        } else {
            Err(SampleError::JointNonFinite(arm))
        };
    }
    if !(q.magnitude() <= T::from_f64(LARGEST_JOINT_ANGLE_TURNS * 2.0) * T::PI) {
        return Err(SampleError::JointTooLarge(arm));
    }
    Ok(())
}

/// Measurement noise: σ, the same for every sample. The position noise may differ by axis, as for a tracker that
/// measures distances better than angles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise<T> {
    position: [T; 3],
    joint: T,
}

/// Why numbers are not a valid noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NoiseError {
    /// The position noise must be a finite number greater than 0.
    Position,
    /// The joint noise must be a finite number, 0 or greater.
    Joint,
    /// The noise of a height must be a finite number greater than 0.
    Height,
    /// The noise of a distance must be a finite number greater than 0.
    Distance,
}

impl fmt::Display for NoiseError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Position => "the position noise must be a finite number greater than 0",
            Self::Joint => "the joint noise must be a finite number, 0 or greater",
            Self::Height => "the noise of a height must be a finite number greater than 0",
            Self::Distance => "the noise of a distance must be a finite number greater than 0",
        })
    }
}

impl core::error::Error for NoiseError {}

impl<T: Real> Noise<T> {
    /// σx of each coordinate of the position (length), and σq of each joint angle (radians).
    ///
    /// # Errors
    /// σx not positive, σq negative, or either not finite.
    ///
    /// ```
    /// use delta_cal::Noise;
    /// assert!(Noise::new(0.001, 0.0).is_ok());
    /// assert!(Noise::new(0.0, 1e-4).is_err());
    /// ```
    pub fn new(position: T, joint: T) -> Result<Self, NoiseError> {
        Self::by_axis([position; 3], joint)
    }

    /// σx, σy, σz of the position (length), and σq of each joint angle (radians).
    ///
    /// # Errors
    /// Same as [`new`](Self::new).
    ///
    /// ```
    /// use delta_cal::Noise;
    /// let noise = Noise::by_axis([0.02, 0.02, 0.1], 0.0)?;
    /// assert!(noise.isotropic().is_none() && noise.position() > 0.06);
    /// # Ok::<(), delta_cal::samples::NoiseError>(())
    /// ```
    pub fn by_axis(position: [T; 3], joint: T) -> Result<Self, NoiseError> {
        if !position
            .iter()
            .all(|sigma| *sigma > T::ZERO && sigma.finite())
        {
            return Err(NoiseError::Position);
        }
        if !(joint >= T::ZERO && joint.finite()) {
            return Err(NoiseError::Joint);
        }
        Ok(Self { position, joint })
    }

    /// σx of each coordinate, or the root mean square if it differs by axis. Length.
    pub fn position(&self) -> T {
        self.isotropic().unwrap_or_else(|| {
            let [x, y, z] = self.position.map(T::squared);
            ((x + y + z) / T::from_f64(3.0)).square_root()
        })
    }

    /// σx, σy, σz. Length.
    pub const fn position_by_axis(&self) -> [T; 3] {
        self.position
    }

    /// σ of the position if it is the same in all directions. Length.
    pub fn isotropic(&self) -> Option<T> {
        let [x, y, z] = self.position;
        (x == y && y == z).then_some(x)
    }

    /// σq of each joint angle. Radians.
    pub fn joint(&self) -> T {
        self.joint
    }
}
