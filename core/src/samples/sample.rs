use crate::robot::{ArmIndex, Drive};
use crate::state::state;
use crate::{Busy, Real, SettingError};
use nalgebra::Vector3;

/// Joint angles beyond ±4π are refused: no joint of a Delta makes two turns, and an angle in degrees mistaken for
/// radians is caught here.
const LARGEST_JOINT_ANGLE_TURNS: f64 = 2.0;

/// One measurement: the platform's position at known joint angles. By default all zeros, to initialise a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample<T: Real> {
    /// q₁, q₂, q₃ in radians, or the travels of a linear drive in the robot's unit of length.
    pub joints: [T; 3],
    /// X, in the robot's unit of length and frame.
    pub position: Vector3<T>,
}

state!(Sample<T>: joints: [T; 3], position: Vector3<T>);

/// Why a sample is refused. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SampleError {
    /// A coordinate is NaN, infinite, or too large to be squared.
    #[error("the position is not a finite point")]
    PositionNonFinite,
    /// The position is more than about 10,000 forearm lengths of this arm from the robot.
    #[error("the position is thousands of forearms of {0} away from the robot")]
    PositionTooFar(ArmIndex),
    /// This arm's joint angle or travel is NaN, infinite, or too large to be squared.
    #[error("the joint angle of {0} is not a finite number")]
    JointNonFinite(ArmIndex),
    /// This arm's joint angle is beyond ±4π rad, or its travel beyond about 10,000 forearm lengths.
    #[error(
        "the joint angle of {0} is beyond two turns (joint angles are in radians), or its travel thousands of forearms"
    )]
    JointTooLarge(ArmIndex),
    /// A solve is in progress.
    #[error(transparent)]
    Busy(#[from] Busy),
}

impl<T: Real> Sample<T> {
    /// Checks that every number is usable for a robot with this drive.
    ///
    /// # Errors
    /// The first fault found, joint angles first.
    pub fn check(&self, drive: Drive) -> Result<(), SampleError> {
        for (q, arm) in self.joints.iter().zip(&ArmIndex::ALL) {
            check_joint(*q, *arm, drive)?;
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
    let linear = drive == Drive::Linear;
    if !q.finite() || (linear && !q.squared().finite()) {
        return Err(SampleError::JointNonFinite(arm));
    }
    if !linear && !(q.magnitude() <= T::from_f64(LARGEST_JOINT_ANGLE_TURNS * 2.0) * T::PI) {
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

impl<T: Real> Noise<T> {
    /// σx of each coordinate of the position (length), and σq of each joint angle (radians).
    ///
    /// # Errors
    /// σx not positive, σq negative, or either too large to be squared.
    ///
    /// ```
    /// use delta_cal::Noise;
    /// assert!(Noise::new(0.001, 0.0).is_ok());
    /// assert!(Noise::new(0.0, 1e-4).is_err());
    /// ```
    pub fn new(position: T, joint: T) -> Result<Self, SettingError> {
        Self::by_axis([position, position, position], joint)
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
    /// # Ok::<(), delta_cal::SettingError>(())
    /// ```
    pub fn by_axis(position: [T; 3], joint: T) -> Result<Self, SettingError> {
        // No noise is too small: rounding is added to it.
        let [_, most] = T::SIGMAS;
        let positive = |sigma: T| sigma > T::ZERO && sigma <= most;
        let [x, y, z] = position;
        if !(positive(x) && positive(y) && positive(z)) {
            return Err(SettingError::PositionNoise);
        }
        if !(joint >= T::ZERO && joint <= most) {
            return Err(SettingError::JointNoise);
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
