use crate::robot::{Arm, Drive, Parameter, ParameterKind};
use crate::{Real, SettingError};

/// Manufacturing tolerance: σ of each parameter about its nominal value. As a prior it adds the eight rows (p −
/// `p_nominal`)/tolerance to an arm's least-squares problem.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance<T> {
    length: T,
    angle: T,
    joint_zero: Option<T>,
    /// σ of single parameters by place, as all are of one drive; 0: that of its kind. Then those of common radius and
    /// forearm.
    own: [T; OWN],
}

/// A board without linear drives has no σ but those of kinds.
const OWN: usize = if cfg!(feature = "linear") { 10 } else { 0 };
const RADIUS: usize = 8;
const FOREARM: usize = 9;

/// Checks that a σ is greater than 0 and within its range.
pub(crate) fn positive<T: Real, E>(sigma: T, error: E) -> Result<(), E> {
    let [least, most] = T::SIGMAS;
    let is_within = (least..=most).contains(&sigma);
    is_within.then_some(()).ok_or(error)
}

impl<T: Real> Tolerance<T> {
    /// σ of `Dx, Dy, Dz, La_x, La_y, Lb` (length) and of θ, α (radians). For linear drives, the first applies to `Dx,
    /// Dy, Dz, Lb` and the second to the leans and the scale.
    ///
    /// # Errors
    /// A number that is not positive, or too small or large to be squared.
    pub fn new(length: T, angle: T) -> Result<Self, SettingError> {
        positive(length, SettingError::LengthTolerance)?;
        positive(angle, SettingError::AngleTolerance)?;
        Ok(Self {
            length,
            angle,
            joint_zero: None,
            own: [T::ZERO; OWN],
        })
    }

    /// Adds σ of each rotary joint zero (radians): the upper arm's direction at joint reading 0. The upper arm length
    /// √(`La_x`² + `La_y`²) then has the σ of lengths. Without it, `La_x` and `La_y` each have the σ of lengths, which
    /// amounts to a joint zero with that σ divided by the upper arm length.
    ///
    /// Ignored by linear drives.
    ///
    /// # Errors
    /// A number that is not positive, or too small or large to be squared.
    pub fn with_joint_zero(mut self, sigma: T) -> Result<Self, SettingError> {
        positive(sigma, SettingError::JointZeroTolerance)?;
        self.joint_zero = Some(sigma);
        Ok(self)
    }

    /// σ of each rotary joint zero, if stated. Radians.
    pub const fn joint_zero(&self) -> Option<T> {
        self.joint_zero
    }

    /// Sets σ of one parameter of every arm, in place of that of its kind. Length, radians or no unit. With a [joint
    /// zero](Self::with_joint_zero), that of `La_x` is σ of the upper arm's length, and that of `La_y` is not used.
    /// State those of one drive only: others have the same [places](Parameter::index).
    ///
    /// # Errors
    /// A number that is not positive, or too small or large to be squared.
    #[cfg(feature = "linear")]
    pub fn with(mut self, parameter: Parameter, sigma: T) -> Result<Self, SettingError> {
        let error = match (parameter, parameter.kind()) {
            (Parameter::Zero, _) => SettingError::CarriageZeroTolerance,
            (_, ParameterKind::Length) => SettingError::LengthTolerance,
            (_, ParameterKind::Angle) => SettingError::AngleTolerance,
            (_, ParameterKind::Ratio) => SettingError::ScaleTolerance,
        };
        positive(sigma, error)?;
        self.own[parameter.index()] = sigma;
        Ok(self)
    }

    /// The σ of a parameter that is not that of its kind, if one is stated.
    pub fn single(&self, parameter: Parameter) -> Option<T> {
        Some(self.at(parameter.index())).filter(|own| *own > T::ZERO)
    }

    fn at(&self, place: usize) -> T {
        self.own.get(place).copied().unwrap_or(T::ZERO)
    }

    /// σ of lengths that have none of their own.
    pub const fn length(&self) -> T {
        self.length
    }

    /// σ of angles that have none of their own. Radians.
    pub const fn angle(&self) -> T {
        self.angle
    }

    /// Adds σ of the radius common to all towers (length), on top of each tower's own; 0 for none. An arm calibrated
    /// separately cannot tell the two apart: its tower position has the combined σ.
    ///
    /// # Errors
    /// A number that is not finite or is negative.
    #[cfg(feature = "linear")]
    pub fn with_radius(mut self, radius: T) -> Result<Self, SettingError> {
        if !(radius >= T::ZERO && radius.finite()) {
            return Err(SettingError::RadiusTolerance);
        }
        self.own[RADIUS] = radius;
        Ok(self)
    }

    /// σ of the radius common to all towers. Length.
    pub fn radius(&self) -> T {
        self.at(RADIUS)
    }

    /// Adds σ of the length common to all forearms, on top of each forearm's own; 0 for none. As with the radius, an
    /// arm calibrated separately has the combined σ.
    ///
    /// # Errors
    /// A number that is not finite or is negative.
    #[cfg(feature = "linear")]
    pub fn with_forearm(mut self, forearm: T) -> Result<Self, SettingError> {
        if !(forearm >= T::ZERO && forearm.finite()) {
            return Err(SettingError::ForearmTolerance);
        }
        self.own[FOREARM] = forearm;
        Ok(self)
    }

    /// σ of the length common to all forearms of linear drives. Length.
    pub fn forearm(&self) -> T {
        self.at(FOREARM)
    }

    /// Displacement of a tower's D along x and y for one σ of the common radius. Length.
    pub fn outwards(&self, arm: &Arm<T>) -> [T; 2] {
        match arm.drive() {
            Drive::Linear => arm.outwards().map(|part| self.radius() * part),
            Drive::Rotary => [T::ZERO; 2],
        }
    }

    /// Variance of the distance between elbow and platform, less the forearm, over robots made to the tolerance, in
    /// units of a length similar to the forearm's, which is also the lever of the angles.
    pub(crate) fn of_closure(&self, drive: Drive, unit: T) -> T {
        // A rotary arm has six lengths and two angles, a tower four, and two angles and a scale.
        let [of_lengths, of_angles] = match drive {
            Drive::Rotary => [6.0, 2.0],
            Drive::Linear => [4.0, 3.0],
        };
        let mut lengths = self.length.squared() * T::from_f64(of_lengths);
        let mut angles = self.angle.squared() * T::from_f64(of_angles);
        angles += self.joint_zero.map_or(T::ZERO, T::squared);
        for parameter in drive.parameters() {
            if let Some(own) = self.single(*parameter) {
                let (sum, usual) = match parameter.kind() {
                    ParameterKind::Length => (&mut lengths, self.length),
                    ParameterKind::Angle | ParameterKind::Ratio => (&mut angles, self.angle),
                };
                *sum += own.squared() - usual.squared();
            }
        }
        if drive == Drive::Linear {
            lengths += self.radius().squared() + self.forearm().squared();
        }
        lengths / unit.squared() + angles
    }

    /// σ of a parameter, without the common radius and forearm length. Length, radians or no unit.
    pub fn of(&self, parameter: Parameter) -> T {
        self.single(parameter).unwrap_or(match parameter.kind() {
            ParameterKind::Length => self.length,
            ParameterKind::Angle | ParameterKind::Ratio => self.angle,
        })
    }

    /// σ at each [place](Drive::places) of an arm's parameters, common radius and forearm length included; 0 at an
    /// empty place.
    pub fn of_places(&self, arm: &Arm<T>) -> [T; 8] {
        let places = arm.drive().places();
        places.map(|parameter| parameter.map_or(T::ZERO, |parameter| self.of_arm(arm, parameter)))
    }

    /// σ of a parameter of this arm, common radius and forearm length included. With a [joint zero](Self::joint_zero),
    /// σ of `La_x` and `La_y` is a first-order value at this arm.
    pub fn of_arm(&self, arm: &Arm<T>, parameter: Parameter) -> T {
        let own = self.of(parameter);
        if arm.drive() == Drive::Linear {
            let [x, y] = self.outwards(arm);
            let common = match parameter {
                Parameter::Dx => x,
                Parameter::Dy => y,
                Parameter::Lb => self.forearm(),
                _ => T::ZERO,
            };
            return (own.squared() + common.squared()).square_root();
        }
        let Some(zero) = self.joint_zero else {
            return own;
        };
        let (x, y) = arm.la();
        let (along, across) = match parameter {
            Parameter::LaX => (x, y),
            Parameter::LaY => (y, x),
            _ => return own,
        };
        let along = along / arm.upper_arm_length() * self.of(Parameter::LaX);
        (along.squared() + (across * zero).squared()).square_root()
    }
}
