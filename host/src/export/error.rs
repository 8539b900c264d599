//! Errors of an export.

use crate::text::list;
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;

/// The reason why a robot cannot be exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// A parameter of an arm has an error for which the target cannot compensate.
    #[error("{arm}: {cause}")]
    CannotHold {
        /// The arm.
        arm: ArmIndex,
        /// The key in the robot file.
        key: &'static str,
        /// The cause.
        cause: String,
    },
    /// The robot reaches too few positions.
    #[error("the robot reaches only {0} of the positions; a fit needs at least 20")]
    TooFewPositions(usize),
    /// The kinematics of the target does not reach a position.
    #[error("the controller's kinematics does not reach the robot's positions")]
    Unreached,
    /// No correction table of acceptable size meets the limit.
    #[error(
        "no correction table of up to 200,000 nodes keeps the error below {limit} mm; the finest has {worst:.4} mm"
    )]
    LimitNotMet {
        /// The limit, mm.
        limit: f64,
        /// The error of the finest table, mm.
        worst: f64,
    },
    /// The target does not support these drives.
    #[error("this robot has {}: it can be exported for {}", drives(*drive), list(others))]
    OtherDrive {
        /// The robot's drives.
        drive: Drive,
        /// The targets that support them.
        others: Vec<String>,
    },
    /// The target cannot state the position of an arm's end stop.
    #[error(
        "{arm}: no position_endstop describes an end stop at {degrees:.3}°, where the elbow is not outwards"
    )]
    Home {
        /// The arm.
        arm: ArmIndex,
        /// The joint angle, degrees.
        degrees: f64,
    },
    /// An end stop is stated far outside the joint limits.
    #[error("{arm}: the end stop at {at} is outside [joints], {limits}")]
    HomeOutside {
        /// The arm.
        arm: ArmIndex,
        /// As stated, with its unit.
        at: String,
        /// The limits.
        limits: String,
    },
}

impl ExportError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::CannotHold { .. } => {
                "check the robot file, or export for linuxcnc-component or correction-table"
            }
            Self::TooFewPositions(_) => {
                "check [joints] in the robot file, or the positions and their frame"
            }
            Self::Unreached => {
                "check the positions and their frame; the robot must reach all of them"
            }
            Self::LimitNotMet { .. } => {
                "give the positions where your robot works with --positions, or a larger --limit"
            }
            Self::OtherDrive { .. } => "choose one of these with --for",
            Self::Home { .. } => "state the joint angles at the end stops with --home",
            Self::HomeOutside { .. } => {
                "state the joints at the end stops with --home, as the robot file counts them"
            }
        }
    }
}

const fn drives(drive: Drive) -> &'static str {
    match drive {
        Drive::Linear => "towers",
        Drive::Rotary => "rotary arms",
    }
}
