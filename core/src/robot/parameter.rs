use core::fmt;

/// One of the eight geometric parameters of an arm (paper, equation (3.6)), in the order in which
/// every vector and matrix of parameters of this crate holds them.
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
}

/// Whether a parameter is a length or an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterKind {
    /// In the robot's unit of length.
    Length,
    /// In radians.
    Angle,
}

impl Parameter {
    /// All eight, in order.
    pub const ALL: [Self; 8] = [
        Self::Dx,
        Self::Dy,
        Self::Dz,
        Self::Theta,
        Self::Alpha,
        Self::LaX,
        Self::LaY,
        Self::Lb,
    ];

    /// Position in a vector of parameters, 0 to 7.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Length or angle.
    pub const fn kind(self) -> ParameterKind {
        match self {
            Self::Theta | Self::Alpha => ParameterKind::Angle,
            _ => ParameterKind::Length,
        }
    }

    /// The paper's symbol: `Dx`, `Dy`, `Dz`, `theta`, `alpha`, `La_x`, `La_y`, `Lb`.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Dx => "Dx",
            Self::Dy => "Dy",
            Self::Dz => "Dz",
            Self::Theta => "theta",
            Self::Alpha => "alpha",
            Self::LaX => "La_x",
            Self::LaY => "La_y",
            Self::Lb => "Lb",
        }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.symbol())
    }
}
