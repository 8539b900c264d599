//! Values that options choose from.

use clap::ValueEnum;
use delta_cal::calibration::Solver;
use delta_cal::robust::Loss;
use delta_cal_host::{CalibrationMethod, Frame};

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodArgument {
    /// Each arm by itself, from the closure of its kinematic chain
    Ikm,
    /// All 24 parameters at once, from the distances between measured and computed positions
    Fkm,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum SolverArgument {
    /// Levenberg–Marquardt: damped, converges
    Lm,
    /// Gauss–Newton: full steps, can diverge and then says so
    Gn,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum LossArgument {
    /// As all others: least squares, spoilt by a single wrong row
    Squared,
    /// Less, the more it disagrees, and not at all if it is wrong; wrong rows are named
    Huber,
    /// As huber, falling off smoothly
    Tukey,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum FrameArgument {
    /// The robot's own
    Base,
    /// The sensor's, wherever it stands; the frame is found and reported
    Sensor,
}

impl MethodArgument {
    pub(crate) const fn method(self) -> CalibrationMethod {
        match self {
            Self::Ikm => CalibrationMethod::Ikm,
            Self::Fkm => CalibrationMethod::Fkm,
        }
    }
}

impl SolverArgument {
    pub(crate) const fn solver(self) -> Solver {
        match self {
            Self::Lm => Solver::LevenbergMarquardt,
            Self::Gn => Solver::GaussNewton,
        }
    }
}

impl LossArgument {
    pub(crate) const fn loss(self) -> Option<Loss> {
        match self {
            Self::Squared => None,
            Self::Huber => Some(Loss::Huber),
            Self::Tukey => Some(Loss::Tukey),
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
