use crate::robot::{ArmIndex, GeometryError, Parameter};
use core::fmt;

/// Why a calibration is refused. The robot keeps its parameters.
///
/// The figures are for messages and are held in single precision whatever the scalar type.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Refusal {
    /// Fewer samples than unknowns.
    TooFewSamples {
        /// Which arm.
        arm: ArmIndex,
        /// How many there are.
        samples: u64,
        /// How many are needed: 8, 12 without a guess, 1 with a tolerance.
        needed: u64,
    },
    /// The poses leave a combination of parameters free, or nearly so.
    Undetermined {
        /// Which arm.
        arm: ArmIndex,
        /// The parameter with the largest part in that combination.
        parameter: Parameter,
        /// Condition number of the problem; infinite, or only limited by rounding, if a combination
        /// is entirely free.
        condition: f32,
    },
    /// The samples determine the parameters in principle, and their noise leaves one unknown: its σ
    /// is more than a tenth of the upper arm, or of a radian.
    Uncertain {
        /// Which arm.
        arm: ArmIndex,
        /// Which parameter.
        parameter: Parameter,
        /// Its σ, length or radians.
        sigma: f32,
    },
    /// The iteration did not settle within its limits.
    NotConverged {
        /// Which arm.
        arm: ArmIndex,
        /// Linearisations spent.
        iterations: u16,
    },
    /// The fit leaves residuals that the stated noise cannot produce.
    ResidualContradictsNoise {
        /// Which arm; `None` where the residuals of all arms are judged together.
        arm: Option<ArmIndex>,
        /// rms of the residuals over what the noise allows.
        ratio: f32,
    },
    /// A parameter is further from nominal than the stated tolerance makes credible.
    FarFromNominal {
        /// Which arm.
        arm: ArmIndex,
        /// Which parameter.
        parameter: Parameter,
        /// Its distance from nominal, in tolerances.
        tolerances: f32,
    },
    /// The solution is not the geometry of an arm.
    ImpossibleGeometry {
        /// Which arm.
        arm: ArmIndex,
        /// What is impossible about it.
        error: GeometryError,
    },
    /// The three arms are valid and do not make a robot.
    ImpossibleRobot(GeometryError),
    /// The calibrated arms fit the samples, and the platform was measured above the plane of their
    /// elbows, where [`Robot::forward`](crate::Robot::forward) never puts it: the measuring frame is
    /// upside down or left-handed against the robot's.
    WrongSide,
    /// An instrument has fewer readings than its place has unknowns.
    TooFewObservations {
        /// Whose place is unknown.
        instrument: Instrument,
        /// How many readings there are.
        observations: u64,
        /// How many are needed.
        needed: u64,
    },
    /// What is stated of an instrument's place is not usable: its numbers must be finite, and every σ greater than 0.
    UnusableInstrument(Instrument),
    /// The poses leave the place of an instrument free, or nearly so.
    UndeterminedInstrument(Instrument),
    /// The arithmetic overflowed.
    NonFinite {
        /// Which arm.
        arm: ArmIndex,
    },
    /// The solver has fewer places than there are unknowns of these instruments.
    TooManyUnknowns {
        /// How many there are, the robot's parameters included.
        parameters: u64,
    },
    /// The solver was asked for its result before it had finished.
    Unfinished,
}

impl Refusal {
    /// A number that never changes, for a display or a log; the same as the status that C gets.
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
        }
    }

    /// The arm at fault, if it is one.
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
            Self::ImpossibleRobot(_)
            | Self::WrongSide
            | Self::TooFewObservations { .. }
            | Self::UnusableInstrument(_)
            | Self::UndeterminedInstrument(_)
            | Self::TooManyUnknowns { .. }
            | Self::Unfinished => None,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewSamples {
                arm,
                samples,
                needed,
            } => {
                write!(formatter, "{arm} has {samples} samples and needs {needed}")
            }
            Self::Undetermined {
                arm,
                parameter,
                condition,
            } => write!(
                formatter,
                "the poses do not determine {arm}, least of all {parameter} (condition {condition:.1e})"
            ),
            Self::Uncertain {
                arm,
                parameter,
                sigma,
            } => write!(
                formatter,
                "the noise leaves {parameter} of {arm} unknown (sigma {sigma:.3e})"
            ),
            Self::NotConverged { arm, iterations } => write!(
                formatter,
                "the fit of {arm} did not converge in {iterations} iterations"
            ),
            Self::ResidualContradictsNoise {
                arm: Some(arm),
                ratio,
            } => write!(
                formatter,
                "the residuals of {arm} are {ratio:.1} times what the stated noise allows"
            ),
            Self::ResidualContradictsNoise { arm: None, ratio } => write!(
                formatter,
                "the residuals are {ratio:.1} times what the stated noise allows"
            ),
            Self::FarFromNominal {
                arm,
                parameter,
                tolerances,
            } => write!(
                formatter,
                "{parameter} of {arm} came out {tolerances:.1} tolerances from nominal"
            ),
            Self::ImpossibleGeometry { arm, error } => {
                write!(formatter, "the solution for {arm} is impossible: {error}")
            }
            Self::ImpossibleRobot(error) => {
                write!(formatter, "the solution is not a robot: {error}")
            }
            Self::WrongSide => formatter.write_str(
                "the platform was measured above its elbows: the frame is upside down or left-handed",
            ),
            Self::TooFewObservations {
                instrument,
                observations,
                needed,
            } => write!(
                formatter,
                "{instrument} has {observations} readings and needs {needed}"
            ),
            Self::UnusableInstrument(instrument) => write!(
                formatter,
                "what is stated of {instrument} is not finite, or its sigma is not greater than 0"
            ),
            Self::UndeterminedInstrument(instrument) => {
                write!(formatter, "the poses do not determine where {instrument} is")
            }
            Self::NonFinite { arm } => {
                write!(formatter, "the samples of {arm} overflow the arithmetic")
            }
            Self::TooManyUnknowns { parameters } => {
                write!(formatter, "there is no room for {parameters} parameters")
            }
            Self::Unfinished => formatter.write_str("the solver has not finished"),
        }
    }
}

impl core::error::Error for Refusal {}

/// Something beside the robot whose place is estimated with the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
