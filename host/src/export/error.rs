//! Why a robot cannot be exported.

use crate::text::list;
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;

/// Why a target cannot hold a robot.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// A parameter of an arm is further off than the target can make up for.
    #[error("{arm}: {cause}")]
    CannotHold {
        /// The arm.
        arm: ArmIndex,
        /// The key in the robot file.
        key: &'static str,
        /// What is wrong with it.
        cause: String,
    },
    /// The robot reaches too few positions.
    #[error("the robot reaches {0} of the positions; a fit needs at least 20")]
    TooFewPositions(usize),
    /// The kinematics of the target does not reach a position.
    #[error("the target's kinematics does not reach the positions that the robot reaches")]
    Unreached,
    /// No correction table that is small enough keeps to the limit.
    #[error(
        "no correction table of up to 200 000 nodes keeps the error below {limit} mm; the finest leaves {worst:.4} mm"
    )]
    LimitNotMet {
        /// The limit, mm.
        limit: f64,
        /// What the finest table leaves, mm.
        worst: f64,
    },
    /// The target takes no robots with these drives.
    #[error("{}: it can be exported for {}", moved_by(*drive), list(others))]
    OtherDrive {
        /// Those of the robot.
        drive: Drive,
        /// The targets that do.
        others: Vec<String>,
    },
    /// The end stop of an arm stands where the target cannot state it.
    #[error(
        "{arm}: position_endstop has no value for an end stop at {degrees:.3}°, where the elbow is not outwards"
    )]
    Home {
        /// The arm.
        arm: ArmIndex,
        /// The joint angle, degrees.
        degrees: f64,
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
                "name the positions where your robot works with --positions, or give a larger --limit"
            }
            Self::OtherDrive { .. } => "choose one of these with --for",
            Self::Home { .. } => "state the joint angles at the end stops with --home",
        }
    }
}

const fn moved_by(drive: Drive) -> &'static str {
    match drive {
        Drive::Linear => "carriages on towers drive this robot",
        Drive::Rotary => "motors turn the arms of this robot",
    }
}
