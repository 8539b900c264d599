use super::parameter::{Drive, DriveOf, GeometryError, Parameter};
use super::transmission::Transmission;
use crate::Real;
use nalgebra::Vector3;

/// The parameters of one arm, valid by construction: eight for a rotary drive (Model 24, paper equation (3.6)), seven
/// for a carriage on a tower.
///
/// ```text
/// ex = ( cos θ, sin θ, 0 )                         radial
/// ez = ( sin θ sin α, −cos θ sin α, cos α )        up, in the arm plane
/// ey = ez × ex                                     motor axis
/// u  = La_x ex + La_y ez,   v = La_y ex − La_x ez
/// B(q) = D + u cos q + v sin q                     elbow
/// ```
///
/// α is interpreted as the tilt of the motor axis. As an encoder offset it would duplicate (`La_x`, `La_y`), and the
/// eight parameters would have rank 7.
///
/// With a linear drive the elbow is a carriage, and the joint value is its travel s:
///
/// ```text
/// n    = ( sin lean_x, sin lean_y, √(1 − sin² lean_x − sin² lean_y) )      direction of the tower
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

/// The vectors determined by an arm's angles, computed once at construction. For a linear drive, `ez` is the tower's
/// direction, `ex` and `ey` are its derivatives with respect to the two leans, `u` is 0 and `v` is the elbow's
/// displacement per unit of travel.
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

/// An arm at a joint angle.
pub(crate) struct ArmAt<T: Real> {
    /// B(q).
    pub(crate) elbow: Vector3<T>,
    /// B′(q).
    pub(crate) derivative: Vector3<T>,
    /// (sin, cos) of the arm's angle; of a linear drive the travel and 0.
    pub(crate) turn: (T, T),
}

impl<T: Real> Arm<T> {
    /// An arm from its parameters in the order of [`Parameter::ROTARY`]: `Dx, Dy, Dz` (length), `θ, α` (radians),
    /// `La_x, La_y, Lb` (length).
    ///
    /// # Errors
    /// A non-finite number, `Lb ≤ 0`, `La_x = La_y = 0`, `|α| ≥ 90°`, `|θ| > 360°`.
    pub fn new(parameters: [T; 8]) -> Result<Self, GeometryError> {
        for (parameter, value) in Parameter::ROTARY.iter().zip(&parameters) {
            if !value.finite() {
                return Err(GeometryError::NonFinite(*parameter));
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
        // Every formula uses squared lengths, so these must be finite too.
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
                u: combined(&ex, la_x, &ez, la_y),
                v: combined(&ex, la_y, &ez, -la_x),
            },
            drive: DriveOf::ROTARY,
            transmission: None,
        })
    }

    /// A placeholder, which is no arm.
    #[inline(always)]
    pub(crate) const fn vacant() -> Self {
        let zero = Vector3::new(T::ZERO, T::ZERO, T::ZERO);
        Self {
            parameters: [T::ZERO; 8],
            basis: ArmBasis {
                ex: zero,
                ey: zero,
                ez: zero,
                u: zero,
                v: zero,
            },
            drive: DriveOf::ROTARY,
            transmission: None,
        }
    }

    /// An arm with a linear drive, from its parameters in the order of [`Parameter::LINEAR`]: `Dx, Dy, Dz` (length),
    /// `lean_x, lean_y` (radians), `scale`, `Lb` (length).
    ///
    /// # Errors
    /// A non-finite number, `Lb ≤ 0`, `scale ≤ 0`, a tower leaning by 90° or more.
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

    /// An arm with the same drive and transmission but other parameters, each at its [place](Drive::places).
    ///
    /// # Errors
    /// Same as [`new`](Self::new) or [`linear`](Self::linear).
    pub fn with_parameters(&self, parameters: [T; 8]) -> Result<Self, GeometryError> {
        Ok(Self {
            transmission: self.transmission,
            ..Self::of_drive(self.drive(), parameters)?
        })
    }

    fn of_drive(drive: Drive, parameters: [T; 8]) -> Result<Self, GeometryError> {
        match drive {
            #[cfg(feature = "linear")]
            Drive::Linear => {
                let [dx, dy, dz, lean_x, lean_y, scale, _, lb] = parameters;
                Self::linear([dx, dy, dz, lean_x, lean_y, scale, lb])
            }
            _ => Self::new(parameters),
        }
    }

    /// The same arm with a different transmission.
    ///
    /// # Errors
    /// [`GeometryError::TransmissionTooLarge`] if the arm has a linear drive.
    pub fn with_transmission(self, transmission: Transmission<T>) -> Result<Self, GeometryError> {
        if self.drive() == Drive::Linear {
            return Err(GeometryError::TransmissionTooLarge);
        }
        Ok(self.driven_by(transmission))
    }

    /// The same, for an arm with a rotary drive. An exact transmission is stored as `None` and costs nothing.
    pub(crate) fn driven_by(self, transmission: Transmission<T>) -> Self {
        let exact = transmission.numbers() == [T::ZERO; 5];
        Self {
            transmission: (!exact).then_some(transmission),
            ..self
        }
    }

    /// The error model of its gear and encoder; `None` if the arm angle equals the joint angle.
    pub const fn transmission(&self) -> Option<&Transmission<T>> {
        self.transmission.as_ref()
    }

    /// The arm angle for a joint angle. Radians.
    #[inline]
    pub(crate) fn arm_angle(&self, q: T) -> T {
        match &self.transmission {
            None => q,
            Some(transmission) => transmission.arm_angle(q).0,
        }
    }

    /// The joint angle for an arm angle. Radians.
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

    /// All parameters, each at its [place](Drive::places); 0 at an empty place.
    pub const fn parameters(&self) -> [T; 8] {
        self.parameters
    }

    /// One parameter.
    pub fn get(&self, parameter: Parameter) -> T {
        self.parameters[parameter.index()]
    }

    /// The arm's direction vectors.
    pub const fn basis(&self) -> &ArmBasis<T> {
        &self.basis
    }

    /// The horizontal unit vector from the base centre to D; zeros if D is above the centre.
    pub(crate) fn outwards(&self) -> [T; 2] {
        let [x, y, ..] = self.parameters;
        let distance = (x.squared() + y.squared()).square_root();
        if distance > T::ZERO {
            [x / distance, y / distance]
        } else {
            [T::ZERO; 2]
        }
    }

    /// D: the point on the motor axis, with the platform offset subtracted. Length.
    pub fn d(&self) -> Vector3<T> {
        let [x, y, z, ..] = self.parameters;
        Vector3::new(x, y, z)
    }

    /// (`La_x`, `La_y`): the upper arm at joint angle 0, or (`scale`, 0) for a linear drive. Length, or no unit.
    pub fn la(&self) -> (T, T) {
        let [.., la_x, la_y, _] = self.parameters;
        (la_x, la_y)
    }

    /// Lb: the forearm length. Length.
    pub fn lb(&self) -> T {
        let [.., lb] = self.parameters;
        lb
    }

    /// La = √(`La_x`² + `La_y`²): the upper arm length. For a linear drive, which has no upper arm, the forearm length
    /// is used instead.
    pub fn upper_arm_length(&self) -> T {
        match self.drive() {
            Drive::Rotary => self.elbow_speed(),
            Drive::Linear => self.lb(),
        }
    }

    /// |B′(q)|, which is constant: the upper arm length, or the scale of a linear drive. Length per radian, or no unit.
    pub(crate) fn elbow_speed(&self) -> T {
        let (la_x, la_y) = self.la();
        (la_x * la_x + la_y * la_y).square_root()
    }

    /// B(q) = D + u cos q + v sin q, or D + s v with a linear drive: the elbow, shifted by the platform offset as D is.
    /// Length. With a [transmission](Self::transmission), q is the joint angle, and the equation uses the arm angle.
    // In firmware three copies would cost more flash than the calls take time.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    pub fn elbow(&self, q: T) -> Vector3<T> {
        match self.drive() {
            Drive::Rotary => self.turned(self.arm_angle(q).sine_cosine()),
            Drive::Linear => self.d() + self.basis.v * q,
        }
    }

    fn turned(&self, (sine, cosine): (T, T)) -> Vector3<T> {
        self.d() + self.basis.u * cosine + self.basis.v * sine
    }

    /// B′(q) = −u sin q + v cos q, or v with a linear drive. Length per radian, or no unit.
    pub fn elbow_derivative(&self, q: T) -> Vector3<T> {
        self.at(q).derivative
    }

    /// All that its constraint needs at a joint angle, with one sine and cosine.
    #[inline]
    pub(crate) fn at(&self, q: T) -> ArmAt<T> {
        if self.drive() == Drive::Linear {
            return ArmAt {
                elbow: self.d() + self.basis.v * q,
                derivative: self.basis.v,
                turn: (q, T::ZERO),
            };
        }
        let (angle, slope) = match &self.transmission {
            None => (q, None),
            Some(transmission) => {
                let (angle, slope) = transmission.arm_angle(q);
                (angle, Some(slope))
            }
        };
        let turn = angle.sine_cosine();
        let (sine, cosine) = turn;
        let derivative = self.basis.v * cosine - self.basis.u * sine;
        ArmAt {
            elbow: self.turned(turn),
            derivative: slope.map_or(derivative, |slope| derivative * slope),
            turn,
        }
    }

    /// Converts the arm to another scalar type.
    ///
    /// # Errors
    /// A [`GeometryError`] if a parameter overflows or vanishes in the narrower type.
    pub fn cast<U: Real>(&self) -> Result<Arm<U>, GeometryError> {
        let parameters = self.parameters.map(|value| U::from_f64(value.to_f64()));
        let arm = Arm::of_drive(self.drive(), parameters)?;
        let Some(transmission) = &self.transmission else {
            return Ok(arm);
        };
        let numbers = transmission.numbers();
        let numbers = numbers.map(|value| U::from_f64(value.to_f64()));
        Ok(arm.driven_by(Transmission::new(numbers)?))
    }
}

/// a x + b y. Built for size, each operation on vectors is a loop; this is not.
#[inline]
pub(crate) fn combined<T: Real>(a: &Vector3<T>, x: T, b: &Vector3<T>, y: T) -> Vector3<T> {
    Vector3::new(a.x * x + b.x * y, a.y * x + b.y * y, a.z * x + b.z * y)
}
