//! Samples and settings.

use super::Real;
use crate::error::Error;
use crate::memory::plain;
use crate::plain::{GAUSS_NEWTON, LEVENBERG_MARQUARDT, START_FREE, START_NOMINAL};
use crate::status;
use delta_cal::nalgebra::Vector3;
use delta_cal::{Noise, Tolerance};

plain! {
    /// One measurement: where the platform was at known joint angles.
    pub struct Sample {
        /// q1, q2, q3. Radians.
        pub joints: [Real; 3],
        /// x, y, z. Length.
        pub position: [Real; 3],
    }
}

impl From<Sample> for delta_cal::Sample<Real> {
    fn from(sample: Sample) -> Self {
        Self {
            joints: sample.joints,
            position: Vector3::from(sample.position),
        }
    }
}

plain! {
    /// What a calibration assumes and how it is solved. All zeros are the defaults: noise and tolerance not stated,
    /// Levenberg-Marquardt from the nominal robot.
    pub struct Settings {
        /// One sigma of the measured x, y and z; all four noises 0: not stated. Length.
        pub position_noise: [Real; 3],
        /// One sigma of a joint angle. Radians.
        pub joint_noise: Real,
        /// Manufacturing tolerance, one sigma of every length; both tolerances 0: not stated. Length.
        pub length_tolerance: Real,
        /// Manufacturing tolerance, one sigma of theta and alpha. Radians.
        pub angle_tolerance: Real,
        /// One sigma of each rotary joint's zero, where it is uncertain by more than the tolerance of lengths says; 0: not
        /// stated. Radians.
        pub joint_zero_tolerance: Real,
        /// `DCAL_LEVENBERG_MARQUARDT` or `DCAL_GAUSS_NEWTON`.
        pub solver: i32,
        /// `DCAL_START_NOMINAL` or `DCAL_START_FREE`.
        pub start: i32,
        /// Linearisations allowed for each start; 0: 50.
        pub iteration_limit: u32,
        /// 0.
        pub reserved: u32,
    }
}

/// Nothing for exactly 0, which stands for a number that is not stated.
#[allow(clippy::float_cmp)]
pub(crate) fn stated(number: Real) -> Option<Real> {
    (number != 0.0).then_some(number)
}

impl Settings {
    /// As the core states them.
    ///
    /// # Errors
    /// A noise or tolerance that is not one, a number that chooses nothing.
    pub(crate) fn checked(&self) -> Result<delta_cal::Settings<Real>, Error> {
        if self.reserved != 0 {
            return Err(status::NO_SUCH_CHOICE.into());
        }
        let [x, y, z] = self.position_noise;
        let any = |numbers: &[Real]| numbers.iter().any(|number| stated(*number).is_some());
        let mut settings = delta_cal::Settings::new();
        if any(&[x, y, z, self.joint_noise]) {
            settings = settings.with_noise(Noise::by_axis([x, y, z], self.joint_noise)?);
        }
        let zero = self.joint_zero_tolerance;
        if any(&[self.length_tolerance, self.angle_tolerance, zero]) {
            let mut tolerance = Tolerance::new(self.length_tolerance, self.angle_tolerance)?;
            if let Some(zero) = stated(zero) {
                tolerance = tolerance.with_joint_zero(zero)?;
            }
            settings = settings.with_tolerance(tolerance);
        }
        settings = settings.with_damping(match self.solver {
            LEVENBERG_MARQUARDT => true,
            GAUSS_NEWTON => false,
            _ => return Err(status::NO_SUCH_CHOICE.into()),
        });
        settings = settings.with_free_start(match self.start {
            START_NOMINAL => false,
            START_FREE => true,
            _ => return Err(status::NO_SUCH_CHOICE.into()),
        });
        let limit = u16::try_from(self.iteration_limit);
        let limit = limit.map_err(|_| Error::from(status::NO_SUCH_CHOICE))?;
        Ok(settings.with_iteration_limit(limit))
    }
}
