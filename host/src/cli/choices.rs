//! Values that options choose from.

use crate::{CalibrationMethod, Frame};
use clap::ValueEnum;
use delta_cal::calibration::Solver;
use delta_cal::robust::Loss;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodArgument {
    /// Fit all 24 parameters at once, from the closures of all arms and their common noise
    Joint,
    /// Fit each arm by itself, from the closure of its kinematic chain
    Ikm,
    /// Fit all 24 parameters at once, to the distances between measured and computed positions
    Fkm,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum SolverArgument {
    /// Levenberg–Marquardt: damps steps that would not improve the fit, and converges
    Lm,
    /// Gauss–Newton: takes full steps only; if it diverges, the calibration is refused
    Gn,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum LossArgument {
    /// As much as all others (least squares); a single wrong row spoils the result
    Squared,
    /// Less, the more it disagrees, and nothing beyond 4.7 scales; the report names such rows
    Huber,
    /// Like huber, but the weight falls smoothly to zero
    Tukey,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum FrameArgument {
    /// The robot's own frame
    Base,
    /// The sensor's frame, wherever the sensor stands; the program finds and reports it
    Sensor,
}

impl MethodArgument {
    pub(crate) const fn method(self) -> CalibrationMethod {
        match self {
            Self::Joint => CalibrationMethod::Joint,
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
