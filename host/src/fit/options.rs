//! How to calibrate.

use delta_cal::calibration::{Solver, Start};
use delta_cal::robust::Loss;
use std::error::Error;
use std::fmt;
use std::num::NonZeroU32;

/// How the parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CalibrationMethod {
    /// All 24 parameters at once from the closures of all three arms, which share the noise of the
    /// position: the least error that the measurements allow.
    #[default]
    Joint,
    /// Each arm's eight parameters from the closure of its own kinematic chain, as if the arms' errors
    /// were independent.
    Ikm,
    /// All 24 parameters at once from the distances between measured and computed positions.
    Fkm,
}

impl CalibrationMethod {
    /// In a sentence: "{} method".
    pub const fn title(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Ikm => "IKM",
            Self::Fkm => "FKM",
        }
    }

    /// Whether every arm is estimated by itself.
    pub const fn separates_arms(self) -> bool {
        matches!(self, Self::Ikm)
    }

    /// As it is written: `joint`, `ikm` or `fkm`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Ikm => "ikm",
            Self::Fkm => "fkm",
        }
    }
}

/// Which frame the positions are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Frame {
    /// The robot's own.
    #[default]
    Base,
    /// The sensor's, which stands anywhere; its place is found as well.
    Sensor,
}

impl Frame {
    /// What of the positions counts, after "the positions".
    pub(crate) const fn relative(self) -> &'static str {
        match self {
            Self::Base => "",
            Self::Sensor => ", relative to each other,",
        }
    }
}

/// How to calibrate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// How the parameters are estimated.
    pub method: CalibrationMethod,
    /// Levenberg–Marquardt or Gauss–Newton.
    pub solver: Solver,
    /// How residuals count; `None` is the squared loss, the plain least squares.
    pub loss: Option<Loss>,
    /// What is done because the samples came one after the other.
    pub streaming: Streaming,
    /// The frame of the measured positions.
    pub frame: Frame,
    /// Do not use the robot file as a start value: the fit starts without one, and any geometry is
    /// accepted.
    /// Needs 12 samples.
    pub no_guess: bool,
}

/// What is done with samples because they come one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Streaming {
    /// Each sample is tested before it is taken in.
    pub gate: bool,
    /// With `Some(k)` every k-th sample is held out of the fit, and the fit must agree with these
    /// samples. Not together with `gate` or `forget`.
    pub held_out: Option<NonZeroU32>,
    /// Samples fade, with a memory of so many.
    pub forget: Option<NonZeroU32>,
}

impl Streaming {
    /// Whether anything is.
    pub fn asked(self) -> bool {
        self != Self::default()
    }
}

/// Options that exclude each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OptionsError {
    /// Held-out samples together with a gate or with forgetting.
    HeldOutNeedsAllSamples,
}

impl fmt::Display for OptionsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::HeldOutNeedsAllSamples => {
                "--held-out judges the fit to all other samples, so it cannot be used with --gate \
                 or --forget"
            }
        })
    }
}

impl Error for OptionsError {}

impl OptionsError {
    /// What to do next.
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::HeldOutNeedsAllSamples => "leave out --held-out, or --gate and --forget",
        }
    }
}

impl Options {
    /// Whether a calibration can be done in this way.
    ///
    /// # Errors
    /// Options that exclude each other.
    pub fn check(&self) -> Result<(), OptionsError> {
        let Streaming {
            gate,
            held_out,
            forget,
        } = self.streaming;
        if held_out.is_some() && (gate || forget.is_some()) {
            return Err(OptionsError::HeldOutNeedsAllSamples);
        }
        Ok(())
    }

    pub(crate) fn start(self) -> Start {
        if self.no_guess {
            Start::Free
        } else {
            Start::Nominal
        }
    }
}
