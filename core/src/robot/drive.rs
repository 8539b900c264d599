use super::parameter::Parameter;

/// How a joint moves its arm's elbow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Drive {
    /// A motor turns the upper arm: the elbow runs on a circle, and a joint's unit is the radian.
    #[default]
    Rotary,
    /// A carriage runs along a tower: the elbow runs on a line, and a joint's unit is that of lengths.
    Linear,
}

impl Drive {
    /// The parameters of such an arm, in order.
    pub const fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::Rotary => &Parameter::ROTARY,
            Self::Linear => &Parameter::LINEAR,
        }
    }

    /// What stands at each place of an arm's vector of eight parameters: a linear drive leaves the place before
    /// the last empty.
    pub const fn places(self) -> [Option<Parameter>; 8] {
        match self {
            Self::Rotary => [
                Some(Parameter::Dx),
                Some(Parameter::Dy),
                Some(Parameter::Dz),
                Some(Parameter::Theta),
                Some(Parameter::Alpha),
                Some(Parameter::LaX),
                Some(Parameter::LaY),
                Some(Parameter::Lb),
            ],
            Self::Linear => [
                Some(Parameter::Dx),
                Some(Parameter::Dy),
                Some(Parameter::Zero),
                Some(Parameter::LeanX),
                Some(Parameter::LeanY),
                Some(Parameter::Scale),
                None,
                Some(Parameter::Lb),
            ],
        }
    }
}

/// The drive of an arm. Without the feature `linear` it takes no memory, and what is computed for linear
/// drives is not compiled.
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
