use super::parameter::GeometryError;
use super::parameter::Parameter;
use super::parameter::{Drive, DriveOf};
use super::transmission::Transmission;
use crate::Real;
use nalgebra::Vector3;

/// The parameters of one arm, valid by construction: eight where a motor turns it (Model 24, paper
/// equation (3.6)), seven where a carriage on a tower drives it.
///
/// ```text
/// ex = ( cos θ, sin θ, 0 )                         radial
/// ez = ( sin θ sin α, −cos θ sin α, cos α )        up, in the arm plane
/// ey = ez × ex                                     motor axis
/// u  = La_x ex + La_y ez,   v = La_y ex − La_x ez
/// B(q) = D + u cos q + v sin q                     elbow
/// ```
///
/// α is read as the tilt of the motor axis. As an encoder offset it would repeat what
/// (`La_x`, `La_y`) already hold, and the eight parameters would have rank 7.
///
/// With a linear drive the elbow is a carriage, and the joint its travel s:
///
/// ```text
/// n    = ( sin lean_x, sin lean_y, √(1 − sin² lean_x − sin² lean_y) )      the tower's direction
/// B(s) = D + s · scale · n
/// ```
///
/// ```
/// use delta_cal::Parameter;
/// use delta_cal::robot::Arm;
/// # fn main() -> Result<(), delta_cal::robot::GeometryError> {
/// let arm = Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0])?;
/// assert_eq!(arm.get(Parameter::Lb), 480.0);
/// // A positive joint angle swings the elbow down, towards the platform.
/// assert!(arm.elbow(0.5).z < 0.0);
/// assert!(Arm::new([164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, -480.0]).is_err());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arm<T: Real> {
    parameters: [T; 8],
    basis: ArmBasis<T>,
    drive: DriveOf,
    transmission: Option<Transmission<T>>,
}

/// The vectors that an arm's angles determine, computed once when the arm is made. Of a linear drive: `ez` is the
/// tower's direction, `ex` and `ey` are its derivatives by the two leans, `u` is 0 and `v` the elbow's way for a
/// travel of 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmBasis<T: Real> {
    /// Radial direction, unit length.
    pub ex: Vector3<T>,
    /// Motor axis, unit length.
    pub ey: Vector3<T>,
    /// Up, in the arm plane, unit length.
    pub ez: Vector3<T>,
    /// Elbow relative to the motor axis at q = 0. Length.
    pub u: Vector3<T>,
    /// Elbow relative to the motor axis at q = 90°. Length.
    pub v: Vector3<T>,
}

impl<T: Real> Arm<T> {
    /// The arm of these parameters, in the order of [`Parameter::ROTARY`]: `Dx, Dy, Dz` (length),
    /// `θ, α` (radians), `La_x, La_y, Lb` (length).
    ///
    /// # Errors
    /// Any number that is not finite, `Lb ≤ 0`, `La_x = La_y = 0`, `|α| ≥ 90°`, `|θ| > 360°`.
    pub fn new(parameters: [T; 8]) -> Result<Self, GeometryError> {
        for (parameter, value) in Parameter::ROTARY.into_iter().zip(parameters) {
            if !value.finite() {
                return Err(GeometryError::NonFinite(parameter));
            }
        }
        let [dx, dy, dz, theta, alpha, la_x, la_y, lb] = parameters;
        if !(lb > T::ZERO) {
            return Err(GeometryError::NotPositive(Parameter::Lb));
        }
        let upper_arm_squared = la_x * la_x + la_y * la_y;
        if !(upper_arm_squared > T::ZERO) {
            return Err(GeometryError::NotPositive(Parameter::LaX));
        }
        // Squares of the lengths enter every formula; they must be finite too.
        if !(lb * lb).finite() {
            return Err(GeometryError::NonFinite(Parameter::Lb));
        }
        if !upper_arm_squared.finite() {
            return Err(GeometryError::NonFinite(Parameter::LaX));
        }
        if !(dx * dx + dy * dy + dz * dz).finite() {
            return Err(GeometryError::NonFinite(Parameter::Dx));
        }
        if !(alpha.magnitude() < T::PI * T::HALF) {
            return Err(GeometryError::TiltTooLarge);
        }
        if !(theta.magnitude() <= T::TWO * T::PI * (T::ONE + T::TWO * T::EPSILON)) {
            return Err(GeometryError::AzimuthTooLarge);
        }
        let (sin_theta, cos_theta) = theta.sine_cosine();
        let (sin_alpha, cos_alpha) = alpha.sine_cosine();
        let ex = Vector3::new(cos_theta, sin_theta, T::ZERO);
        let ez = Vector3::new(sin_theta * sin_alpha, -cos_theta * sin_alpha, cos_alpha);
        let ey = Vector3::new(-sin_theta * cos_alpha, cos_theta * cos_alpha, sin_alpha);
        Ok(Self {
            parameters,
            basis: ArmBasis {
                ex,
                ey,
                ez,
                u: ex * la_x + ez * la_y,
                v: ex * la_y - ez * la_x,
            },
            drive: DriveOf::ROTARY,
            transmission: None,
        })
    }

    /// The arm with a linear drive of these parameters, in the order of [`Parameter::LINEAR`]: `Dx, Dy, Dz`
    /// (length), `lean_x, lean_y` (radians), `scale`, `Lb` (length).
    ///
    /// # Errors
    /// Any number that is not finite, `Lb ≤ 0`, `scale ≤ 0`, a tower that leans by 90° or more.
    #[cfg(feature = "linear")]
    pub fn linear(parameters: [T; 7]) -> Result<Self, GeometryError> {
        for (parameter, value) in Parameter::LINEAR.into_iter().zip(parameters) {
            if !value.finite() {
                return Err(GeometryError::NonFinite(parameter));
            }
        }
        let [dx, dy, dz, lean_x, lean_y, scale, lb] = parameters;
        for (parameter, value) in [(Parameter::Lb, lb), (Parameter::Scale, scale)] {
            if !(value > T::ZERO) {
                return Err(GeometryError::NotPositive(parameter));
            }
            if !(value * value).finite() {
                return Err(GeometryError::NonFinite(parameter));
            }
        }
        if !(dx * dx + dy * dy + dz * dz).finite() {
            return Err(GeometryError::NonFinite(Parameter::Dx));
        }
        if !(lean_x.magnitude() < T::PI * T::HALF && lean_y.magnitude() < T::PI * T::HALF) {
            return Err(GeometryError::LeanTooLarge);
        }
        let (x, cos_x) = lean_x.sine_cosine();
        let (y, cos_y) = lean_y.sine_cosine();
        let z_squared = T::ONE - x * x - y * y;
        if !(z_squared > T::EPSILON) {
            return Err(GeometryError::LeanTooLarge);
        }
        let z = z_squared.square_root();
        let direction = Vector3::new(x, y, z);
        Ok(Self {
            parameters: [dx, dy, dz, lean_x, lean_y, scale, T::ZERO, lb],
            basis: ArmBasis {
                ex: Vector3::new(cos_x, T::ZERO, -(x * cos_x / z)),
                ey: Vector3::new(T::ZERO, cos_y, -(y * cos_y / z)),
                ez: direction,
                u: Vector3::zeros(),
                v: direction * scale,
            },
            drive: DriveOf::LINEAR,
            transmission: None,
        })
    }

    /// An arm with the same drive and transmission and other parameters, at their [places](Drive::places).
    ///
    /// # Errors
    /// As [`new`](Self::new), or as for an arm with a linear drive.
    pub fn with_parameters(&self, parameters: [T; 8]) -> Result<Self, GeometryError> {
        match self.drive() {
            #[cfg(feature = "linear")]
            Drive::Linear => {
                let [dx, dy, dz, lean_x, lean_y, scale, _, lb] = parameters;
                Self::linear([dx, dy, dz, lean_x, lean_y, scale, lb])
            }
            _ => Ok(Self {
                transmission: self.transmission,
                ..Self::new(parameters)?
            }),
        }
    }

    /// The same arm with another transmission.
    ///
    /// # Errors
    /// [`GeometryError::TransmissionTooLarge`] of an arm with a linear drive.
    pub fn with_transmission(self, transmission: Transmission<T>) -> Result<Self, GeometryError> {
        if self.drive() == Drive::Linear {
            return Err(GeometryError::TransmissionTooLarge);
        }
        Ok(self.driven_by(transmission))
    }

    /// The same of an arm with a rotary drive. An exact transmission is none, and costs nothing.
    pub(crate) fn driven_by(self, transmission: Transmission<T>) -> Self {
        let exact = transmission.numbers() == [T::ZERO; 5];
        Self {
            transmission: (!exact).then_some(transmission),
            ..self
        }
    }

    /// What its gear and encoder do; `None` if the arm's angle is the joint's.
    pub const fn transmission(&self) -> Option<&Transmission<T>> {
        self.transmission.as_ref()
    }

    /// The angle of the arm at a joint angle. Radians.
    #[inline]
    pub(crate) fn arm_angle(&self, q: T) -> T {
        match &self.transmission {
            None => q,
            Some(transmission) => transmission.arm_angle(q).0,
        }
    }

    /// The joint angle at an angle of the arm. Radians.
    #[inline]
    pub(crate) fn joint_angle(&self, arm_angle: T) -> T {
        match &self.transmission {
            None => arm_angle,
            Some(transmission) => transmission.joint_angle(arm_angle),
        }
    }

    /// How the joint moves the elbow.
    #[inline]
    pub const fn drive(&self) -> Drive {
        self.drive.get()
    }

    /// All parameters at their [places](Drive::places); 0 at an empty one.
    pub const fn parameters(&self) -> [T; 8] {
        self.parameters
    }

    /// One parameter.
    pub fn get(&self, parameter: Parameter) -> T {
        self.parameters[parameter.index()]
    }

    /// The arm's directions.
    pub const fn basis(&self) -> &ArmBasis<T> {
        &self.basis
    }

    /// The horizontal direction from the base's centre to D, of length 1; zeros where D is above the centre.
    #[cfg(feature = "linear")]
    pub(crate) fn outwards(&self) -> [T; 2] {
        let [x, y, ..] = self.parameters;
        let distance = (x.squared() + y.squared()).square_root();
        if distance > T::ZERO {
            [x / distance, y / distance]
        } else {
            [T::ZERO; 2]
        }
    }

    /// D: the point on the motor axis, platform offset subtracted. Length.
    pub fn d(&self) -> Vector3<T> {
        let [x, y, z, ..] = self.parameters;
        Vector3::new(x, y, z)
    }

    /// (`La_x`, `La_y`): the upper arm at joint angle 0, of a linear drive (`scale`, 0). Length, or no unit.
    pub fn la(&self) -> (T, T) {
        let [.., la_x, la_y, _] = self.parameters;
        (la_x, la_y)
    }

    /// Lb: the forearm's length.
    pub fn lb(&self) -> T {
        let [.., lb] = self.parameters;
        lb
    }

    /// La = √(`La_x`² + `La_y`²): the upper arm's length. An arm with a linear drive has none, and its
    /// forearm's length stands for it.
    pub fn upper_arm_length(&self) -> T {
        match self.drive() {
            Drive::Rotary => self.elbow_speed(),
            Drive::Linear => self.lb(),
        }
    }

    /// |B′(q)|, the same everywhere: the upper arm's length, or the scale of a linear drive. Length per radian,
    /// or no unit.
    pub fn elbow_speed(&self) -> T {
        let (la_x, la_y) = self.la();
        (la_x * la_x + la_y * la_y).square_root()
    }

    /// B(q) = D + u cos q + v sin q, or D + s v with a linear drive: the elbow, moved by the platform offset as
    /// D is. Length. With a [transmission](Self::transmission), q is the joint angle, and the arm's angle stands in
    /// the equation.
    pub fn elbow(&self, q: T) -> Vector3<T> {
        match self.drive() {
            Drive::Rotary => {
                let (sin_q, cos_q) = self.arm_angle(q).sine_cosine();
                self.d() + self.basis.u * cos_q + self.basis.v * sin_q
            }
            Drive::Linear => self.d() + self.basis.v * q,
        }
    }

    /// B′(q) = −u sin q + v cos q, or v with a linear drive. Length per radian, or no unit.
    pub fn elbow_derivative(&self, q: T) -> Vector3<T> {
        match self.drive() {
            Drive::Rotary => {
                let of_arm = |angle: T| {
                    let (sine, cosine) = angle.sine_cosine();
                    self.basis.v * cosine - self.basis.u * sine
                };
                match &self.transmission {
                    None => of_arm(q),
                    Some(transmission) => {
                        let (angle, slope) = transmission.arm_angle(q);
                        of_arm(angle) * slope
                    }
                }
            }
            Drive::Linear => self.basis.v,
        }
    }

    /// The same arm in another scalar type.
    ///
    /// # Errors
    /// A [`GeometryError`] if a parameter overflows or vanishes in the narrower type.
    pub fn cast<U: Real>(&self) -> Result<Arm<U>, GeometryError> {
        let parameters = self.parameters.map(|value| U::from_f64(value.to_f64()));
        match self.drive() {
            #[cfg(feature = "linear")]
            Drive::Linear => {
                let [dx, dy, dz, lean_x, lean_y, scale, _, lb] = parameters;
                Arm::linear([dx, dy, dz, lean_x, lean_y, scale, lb])
            }
            _ => {
                let arm = Arm::new(parameters)?;
                let Some(transmission) = &self.transmission else {
                    return Ok(arm);
                };
                let numbers = transmission.numbers();
                let numbers = numbers.map(|value| U::from_f64(value.to_f64()));
                Ok(arm.driven_by(Transmission::new(numbers)?))
            }
        }
    }
}
