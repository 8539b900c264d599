use crate::Real;
use crate::robot::{ArmIndex, Drive};
use crate::snapshot::state;
use core::fmt;
use nalgebra::Vector3;

/// Joint angles beyond ±4π are refused: no joint of a Delta turns twice, and an angle in degrees
/// that was taken for radians shows itself here.
const LARGEST_JOINT_ANGLE_TURNS: f64 = 2.0;

/// One measurement: where the platform was at known joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sample<T: Real> {
    /// q₁, q₂, q₃ in radians, or the travels of linear drives in the robot's unit of length.
    pub joints: [T; 3],
    /// X, in the robot's unit of length and frame.
    pub position: Vector3<T>,
}

state!(Sample<T>: joints: [T; 3], position: Vector3<T>);

/// Why a sample is not taken in. The factor or store that refused it is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SampleError {
    /// A coordinate is NaN, infinite, or too large to be squared.
    PositionNonFinite,
    /// The position is more than some 10,000 of this arm's forearms away from the robot.
    PositionTooFar(ArmIndex),
    /// This arm's joint angle or travel is NaN, infinite, or too large to be squared.
    JointNonFinite(ArmIndex),
    /// This arm's joint angle is beyond ±4π rad.
    JointTooLarge(ArmIndex),
    /// The weight is NaN or infinite.
    WeightNonFinite,
}

impl fmt::Display for SampleError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PositionNonFinite => formatter.write_str("the position is not a finite point"),
            Self::PositionTooFar(arm) => write!(
                formatter,
                "the position is thousands of forearms of {arm} away from the robot"
            ),
            Self::WeightNonFinite => formatter.write_str("the weight is not a finite number"),
            Self::JointNonFinite(arm) => {
                write!(formatter, "the joint angle of {arm} is not a finite number")
            }
            Self::JointTooLarge(arm) => write!(
                formatter,
                "the joint angle of {arm} is beyond two turns; joint angles are in radians"
            ),
        }
    }
}

impl core::error::Error for SampleError {}

/// All zeros, to fill a buffer with.
impl<T: Real> Default for Sample<T> {
    fn default() -> Self {
        Self {
            joints: [T::ZERO; 3],
            position: Vector3::zeros(),
        }
    }
}

impl<T: Real> Sample<T> {
    /// Whether every number is usable, for a robot with such drives.
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

pub(crate) fn check_weight<T: Real>(weight: T) -> Result<(), SampleError> {
    if weight.finite() {
        Ok(())
    } else {
        Err(SampleError::WeightNonFinite)
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
