use core::fmt;

/// One of the geometric parameters of an arm: the eight of an arm that a motor turns (paper, equation
/// (3.6)), and the seven of an arm whose elbow is a carriage on a tower.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Parameter {
    /// x of the point on the motor axis, platform offset subtracted. Length.
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
    /// Linear drive: z of the elbow at travel 0, which is where the carriage's end stop puts it. Length.
    Zero,
    /// Linear drive: the tower leans so far towards +x. Radians.
    LeanX,
    /// Linear drive: the tower leans so far towards +y. Radians.
    LeanY,
    /// Linear drive: travel along the tower over the travel that the joint reports. No unit.
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
    /// The eight of an arm that a motor turns, in the order in which vectors and matrices hold them.
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

    /// The seven of an arm with a linear drive. In vectors of eight they leave the place before the last
    /// empty.
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

    /// The paper's symbol: `Dx`, `Dy`, `Dz`, `theta`, `alpha`, `La_x`, `La_y`, `Lb`; of a linear drive `Dx`,
    /// `Dy`, `Dz`, `lean_x`, `lean_y`, `scale`, `Lb`.
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
