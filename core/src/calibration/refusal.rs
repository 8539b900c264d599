use crate::robot::{ArmIndex, GeometryError, Parameter};
use core::fmt;

/// Why a calibration is refused. The robot keeps its parameters.
///
/// The figures are for messages and are single precision for any scalar type.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// Fewer samples than unknowns.
    #[error("{arm} has {samples} samples and needs {needed}")]
    TooFewSamples {
        /// The arm.
        arm: ArmIndex,
        /// Number of samples.
        samples: u64,
        /// Number needed: 8, 12 with a free start, 1 with a tolerance.
        needed: u64,
    },
    /// The poses leave a combination of parameters (nearly) undetermined.
    #[error(
        "the poses do not determine {arm}, least of all {parameter} (condition {condition:.1e})"
    )]
    Undetermined {
        /// The arm.
        arm: ArmIndex,
        /// The parameter with the largest share in that combination.
        parameter: Parameter,
        /// Condition number of the problem; infinite, or limited only by rounding, if a combination is entirely
        /// undetermined.
        condition: f32,
    },
    /// The poses determine the parameters, but the noise leaves one too uncertain: its σ exceeds a tenth of the upper
    /// arm, or of a radian.
    #[error("the noise leaves {parameter} of {arm} unknown (sigma {sigma:.3e})")]
    Uncertain {
        /// The arm.
        arm: ArmIndex,
        /// The parameter.
        parameter: Parameter,
        /// Its σ, length or radians.
        sigma: f32,
    },
    /// The iteration did not converge within its limits.
    #[error("the fit of {arm} did not converge in {iterations} iterations")]
    NotConverged {
        /// The arm.
        arm: ArmIndex,
        /// Linearisations used.
        iterations: u16,
    },
    /// The residuals are too large for the stated noise; without a stated noise, for the tolerance: they would be noise
    /// larger than any error of the robot.
    #[error(fmt = contradiction)]
    ResidualContradictsNoise {
        /// The arm; `None` if the residuals of all arms are tested together.
        arm: Option<ArmIndex>,
        /// rms residual divided by that of the stated noise, or by that of a robot made to the tolerance.
        ratio: f32,
    },
    /// A parameter is further from nominal than the stated tolerance makes credible.
    #[error("{parameter} of {arm} came out {tolerances:.1} tolerances from nominal")]
    FarFromNominal {
        /// The arm.
        arm: ArmIndex,
        /// The parameter.
        parameter: Parameter,
        /// Its distance from nominal, in tolerances.
        tolerances: f32,
    },
    /// The solution is not the geometry of an arm.
    #[error("the solution for {arm} is impossible: {error}")]
    ImpossibleGeometry {
        /// The arm.
        arm: ArmIndex,
        /// The fault in the geometry.
        error: GeometryError,
    },
    /// The three arms are valid but do not form a robot.
    #[error("the solution is not a robot: {0}")]
    ImpossibleRobot(GeometryError),
    /// The calibrated arms fit the samples, but the platform was measured above the plane of the elbows, where
    /// [`Robot::forward`](crate::Robot::forward) never puts it: relative to the robot's frame, the measuring frame is
    /// upside down or left-handed.
    #[error("the platform was measured above its elbows: the frame is upside down or left-handed")]
    WrongSide,
    /// An instrument has fewer readings than unknowns.
    #[error("{instrument} has {observations} readings and needs {needed}")]
    TooFewObservations {
        /// The instrument.
        instrument: Instrument,
        /// Number of readings.
        observations: u64,
        /// Number needed.
        needed: u64,
    },
    /// The stated placement of an instrument is invalid: its numbers must be finite, and every σ greater than 0.
    #[error("what is stated of {0} is not finite, or its sigma is not greater than 0")]
    UnusableInstrument(Instrument),
    /// The poses leave the placement of an instrument (nearly) undetermined.
    #[error("the poses do not determine where {0} is")]
    UndeterminedInstrument(Instrument),
    /// The arithmetic overflowed.
    #[error("the samples or the tolerance of {arm} overflow the arithmetic")]
    NonFinite {
        /// The arm.
        arm: ArmIndex,
    },
    /// The instruments have more unknowns than the solver has room for, or there are more than four planes or points.
    #[error("there is no room for {parameters} parameters, or for more than 4 planes or points")]
    TooManyUnknowns {
        /// Number of unknowns, including the robot's parameters.
        parameters: u64,
    },
    /// The result was requested before the solver finished.
    #[error("the solver has not finished")]
    Unfinished,
    /// The gate's alarm, eight consecutive rejections: the robot or its measuring frame has changed. Enough consistent samples came before the run to determine an arm and
    /// to outnumber the run.
    #[error("the robot, or its measuring frame, has changed before sample {first}")]
    RobotChanged {
        /// Index of the run's first sample, from 0, counting all samples received.
        first: u64,
    },
    /// The same alarm, where too few samples came before the run to decide which are wrong: those samples, together with
    /// the stated robot and tolerance, or the samples of the run.
    #[error(
        "the samples before sample {first}, or the stated robot and tolerance, are wrong, or the robot has changed since"
    )]
    EarlySamplesWrong {
        /// Index of the run's first sample, from 0, counting all samples received.
        first: u64,
    },
    /// The gate rejected so many samples that it is unclear which are wrong.
    #[error(
        "the gate rejected {rejected} of {samples} samples: it is not known which of them are wrong"
    )]
    TooManyRejected {
        /// Number rejected.
        rejected: u64,
        /// Number received.
        samples: u64,
    },
}

impl Refusal {
    /// A number that never changes, for a display or log; the same as the status code in C.
    pub const fn code(&self) -> u8 {
        match self {
            Self::UnusableInstrument(_) => 28,
            Self::TooManyUnknowns { .. } => 66,
            Self::TooFewSamples { .. } => 70,
            Self::Undetermined { .. } => 71,
            Self::Uncertain { .. } => 72,
            Self::NotConverged { .. } => 73,
            Self::ResidualContradictsNoise { .. } => 74,
            Self::FarFromNominal { .. } => 75,
            Self::ImpossibleGeometry { .. } => 76,
            Self::ImpossibleRobot(_) => 77,
            Self::WrongSide => 78,
            Self::TooFewObservations { .. } => 79,
            Self::UndeterminedInstrument(_) => 80,
            Self::NonFinite { .. } => 81,
            Self::Unfinished => 82,
            Self::RobotChanged { .. } => 92,
            Self::EarlySamplesWrong { .. } => 93,
            Self::TooManyRejected { .. } => 94,
        }
    }

    /// The arm at fault, if there is one.
    pub const fn arm(&self) -> Option<ArmIndex> {
        match self {
            Self::TooFewSamples { arm, .. }
            | Self::Undetermined { arm, .. }
            | Self::Uncertain { arm, .. }
            | Self::NotConverged { arm, .. }
            | Self::FarFromNominal { arm, .. }
            | Self::ImpossibleGeometry { arm, .. }
            | Self::NonFinite { arm } => Some(*arm),
            Self::ResidualContradictsNoise { arm, .. } => *arm,
            _ => None,
        }
    }
}

#[allow(clippy::ref_option, clippy::trivially_copy_pass_by_ref)] // as thiserror calls it
fn contradiction(
    arm: &Option<ArmIndex>,
    ratio: &f32,
    formatter: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    formatter.write_str("the residuals")?;
    if let Some(arm) = arm {
        write!(formatter, " of {arm}")?;
    }
    write!(
        formatter,
        " are {ratio:.1} times what the stated noise or tolerance allows"
    )
}

/// An instrument whose unknowns are estimated along with the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Instrument {
    /// The frame in which coordinates were measured.
    Frame,
    /// A plane that heights were measured above, by its index.
    Plane(u8),
    /// A point that distances were measured from, by its index.
    Point(u8),
    /// The gear and encoder of a joint.
    Transmission(ArmIndex),
}

impl fmt::Display for Instrument {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame => formatter.write_str("the frame of the coordinates"),
            Self::Plane(index) => write!(formatter, "plane {index}"),
            Self::Point(index) => write!(formatter, "point {index}"),
            Self::Transmission(arm) => write!(formatter, "the transmission of {arm}"),
        }
    }
}
