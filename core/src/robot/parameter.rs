use core::fmt;

/// Parameters of an arm, and of a robot, whose parameters precede all other unknowns.
pub(crate) const OF_ARM: usize = Parameter::ROTARY.len();
pub(crate) const OF_ROBOT: usize = 3 * OF_ARM;

/// A geometric parameter of an arm: eight for a rotary drive (paper, equation (3.6)), seven for a carriage on a tower.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Parameter {
    /// x of the point on the motor axis, with the platform offset subtracted. Length.
    Dx,
    /// y of that point. Length.
    Dy,
    /// z of that point. Length.
    Dz,
    /// Azimuth of the arm plane about base z. Radians.
    Theta,
    /// Tilt of the motor axis out of the base plane. Radians.
    Alpha,
    /// Upper arm at joint angle 0, radial component. Length.
    LaX,
    /// Upper arm at joint angle 0, component along the arm plane's up direction. Length.
    LaY,
    /// Forearm. Length.
    Lb,
    /// Linear drive: z of the elbow at travel 0, as set by the carriage's end stop. Length.
    Zero,
    /// Linear drive: lean of the tower towards +x. Radians.
    LeanX,
    /// Linear drive: lean of the tower towards +y. Radians.
    LeanY,
    /// Linear drive: actual travel along the tower divided by the reported travel. No unit.
    Scale,
}

/// Whether a parameter is a length, an angle or neither.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterKind {
    /// In the robot's unit of length.
    Length,
    /// In radians.
    Angle,
    /// Without a unit.
    Ratio,
}

impl Parameter {
    /// The eight parameters of a rotary drive, in the order used in vectors and matrices.
    pub const ROTARY: [Self; 8] = [
        Self::Dx,
        Self::Dy,
        Self::Dz,
        Self::Theta,
        Self::Alpha,
        Self::LaX,
        Self::LaY,
        Self::Lb,
    ];

    /// The seven parameters of a linear drive. In vectors of eight, the second-last place stays empty.
    pub const LINEAR: [Self; 7] = [
        Self::Dx,
        Self::Dy,
        Self::Zero,
        Self::LeanX,
        Self::LeanY,
        Self::Scale,
        Self::Lb,
    ];

    /// Position in an arm's vector of parameters, 0 to 7.
    pub const fn index(self) -> usize {
        match self {
            Self::Dx => 0,
            Self::Dy => 1,
            Self::Dz | Self::Zero => 2,
            Self::Theta | Self::LeanX => 3,
            Self::Alpha | Self::LeanY => 4,
            Self::LaX | Self::Scale => 5,
            Self::LaY => 6,
            Self::Lb => 7,
        }
    }

    /// Length, angle or ratio.
    pub const fn kind(self) -> ParameterKind {
        match self {
            Self::Theta | Self::Alpha | Self::LeanX | Self::LeanY => ParameterKind::Angle,
            Self::Scale => ParameterKind::Ratio,
            _ => ParameterKind::Length,
        }
    }

    /// The paper's symbol: `Dx`, `Dy`, `Dz`, `theta`, `alpha`, `La_x`, `La_y`, `Lb`; for a linear drive `Dx`, `Dy`,
    /// `Dz`, `lean_x`, `lean_y`, `scale`, `Lb`.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Dx => "Dx",
            Self::Dy => "Dy",
            Self::Dz | Self::Zero => "Dz",
            Self::Theta => "theta",
            Self::Alpha => "alpha",
            Self::LaX => "La_x",
            Self::LaY => "La_y",
            Self::Lb => "Lb",
            Self::LeanX => "lean_x",
            Self::LeanY => "lean_y",
            Self::Scale => "scale",
        }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.symbol())
    }
}

/// One of the robot's three arms, numbered from 1 like the joints `q1`, `q2`, `q3`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ArmIndex {
    /// Arm 1, driven by `q1`.
    First,
    /// Arm 2, driven by `q2`.
    Second,
    /// Arm 3, driven by `q3`.
    Third,
}

impl ArmIndex {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Third];

    /// Index into an array of three: 0, 1 or 2.
    pub const fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
            Self::Third => 2,
        }
    }
}

impl fmt::Display for ArmIndex {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "arm {}", self.index() + 1)
    }
}

/// How a joint drives the elbow of its arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Drive {
    /// A motor turns the upper arm: the elbow moves on a circle, and the joint value is in radians.
    #[default]
    Rotary,
    /// A carriage runs along a tower: the elbow moves on a line, and the joint value is in the unit of length.
    Linear,
}

impl Drive {
    /// The parameters of an arm with this drive, in order.
    pub const fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::Rotary => &Parameter::ROTARY,
            Self::Linear => &Parameter::LINEAR,
        }
    }

    /// The parameter at each place of an arm's vector of eight; a linear drive leaves the second-last place empty.
    pub const fn places(self) -> [Option<Parameter>; 8] {
        match self {
            Self::Rotary => {
                let [a, b, c, d, e, f, g, h] = Parameter::ROTARY;
                [
                    Some(a),
                    Some(b),
                    Some(c),
                    Some(d),
                    Some(e),
                    Some(f),
                    Some(g),
                    Some(h),
                ]
            }
            Self::Linear => {
                let [a, b, c, d, e, f, lb] = Parameter::LINEAR;
                [
                    Some(a),
                    Some(b),
                    Some(c),
                    Some(d),
                    Some(e),
                    Some(f),
                    None,
                    Some(lb),
                ]
            }
        }
    }
}

/// The drive of an arm. Without the feature `linear` it takes no memory, and code for linear drives is not compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct DriveOf {
    #[cfg(feature = "linear")]
    drive: Drive,
}

impl DriveOf {
    pub(crate) const ROTARY: Self = Self {
        #[cfg(feature = "linear")]
        drive: Drive::Rotary,
    };
    #[cfg(feature = "linear")]
    pub(crate) const LINEAR: Self = Self {
        drive: Drive::Linear,
    };

    #[inline]
    #[cfg_attr(not(feature = "linear"), allow(clippy::unused_self))]
    pub(crate) const fn get(self) -> Drive {
        #[cfg(feature = "linear")]
        return self.drive;
        #[cfg(not(feature = "linear"))]
        return Drive::Rotary;
    }
}

/// Why parameters are not a valid arm, or three arms not a valid robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GeometryError {
    /// A parameter is NaN or infinite.
    #[error("{0} is not a finite number")]
    NonFinite(Parameter),
    /// The length of the upper arm (La_x, La_y) or of the forearm Lb is not positive.
    #[error("the length {0} must be greater than 0")]
    NotPositive(Parameter),
    /// |α| ≥ 90°: the arm plane's "up" would point down, or be undefined.
    #[error("the tilt alpha must lie within ±90°")]
    TiltTooLarge,
    /// |θ| > 360°.
    #[error("the azimuth theta must lie within ±360°")]
    AzimuthTooLarge,
    /// The base or the platform radius is negative or NaN.
    #[error("the base and platform radii must not be negative")]
    RadiusInvalid,
    /// The arms' "up" directions cancel, so that "below the base" has no meaning.
    #[error("the arms' up directions cancel: the robot has no below")]
    NoCommonUp,
    /// A tower must lean by less than 90°.
    #[error("a tower must lean by less than 90°")]
    LeanTooLarge,
    /// Not all three arms have the same drive.
    #[error("all three arms must be rotary, or all three linear")]
    MixedDrives,
    /// The transmission differs so much from an exact one that the joint angle may not be unique, or the arm's drive is
    /// linear.
    #[error(
        "the transmission of a rotary drive must be exact but for a tenth of a radian in a radian"
    )]
    TransmissionTooLarge,
}
