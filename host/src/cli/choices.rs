//! Values that options choose from.

use crate::{Frame, Method};
use clap::ValueEnum;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodArgument {
    /// All parameters at once from the closures of the arms; complete positions in the robot's frame
    Joint,
    /// Each arm by itself from the closure of its kinematic chain; the same
    Ikm,
    /// All parameters and the instruments' unknowns at once from any readings
    Fkm,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum FrameArgument {
    /// The robot's own
    Base,
    /// The sensor's, which stands anywhere; its place is found with the parameters
    Sensor,
}

impl MethodArgument {
    pub(crate) const fn method(self) -> Method {
        match self {
            Self::Joint => Method::Joint,
            Self::Ikm => Method::Ikm,
            Self::Fkm => Method::Fkm,
        }
    }
}

impl FrameArgument {
    pub(crate) const fn frame(self) -> Frame {
        match self {
            Self::Base => Frame::Base,
            Self::Sensor => Frame::Sensor,
        }
    }
}
