//! Why a robot cannot be exported.

use crate::text::words::list;
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use std::error::Error;
use std::fmt;

/// Why a target cannot hold a robot.
#[derive(Debug, Clone, PartialEq)]
pub enum ExportError {
    /// A parameter of an arm is further off than the target can make up for.
    CannotHold {
        /// The arm.
        arm: ArmIndex,
        /// The key in the robot file.
        key: &'static str,
        /// What is wrong with it.
        cause: String,
    },
    /// The robot reaches too few positions.
    TooFewPositions {
        /// How many.
        found: usize,
    },
    /// The kinematics of the target does not reach a position.
    Unreached,
    /// A correction table would be too large.
    TooManyNodes,
    /// No correction table that is small enough keeps to the limit.
    LimitNotMet {
        /// The limit, mm.
        limit: f64,
        /// The narrowest spacing that was tried, mm.
        spacing: f64,
        /// What interpolation leaves then, mm.
        worst: f64,
        /// Where, mm.
        at: Vector3<f64>,
        /// Wanted positions in cells without corrections.
        left_out: usize,
    },
    /// The target takes no robots with these drives.
    OtherDrive {
        /// Those of the robot.
        drive: Drive,
        /// The targets that do.
        others: Vec<String>,
    },
    /// The end stop of an arm stands where the target cannot state it.
    Home {
        /// The arm.
        arm: ArmIndex,
        /// What is wrong.
        cause: String,
    },
}

impl ExportError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::CannotHold { .. } => {
                "check the robot file; --for linuxcnc-component, --for sdf and --for correction-table hold such a robot"
            }
            Self::TooFewPositions { .. } => {
                "check [joints] in the robot file, or the positions and their frame"
            }
            Self::Unreached => {
                "check the positions and their frame; the robot must reach all of them"
            }
            Self::TooManyNodes => "give a larger --spacing",
            Self::LimitNotMet { .. } => {
                "name with --positions where your robot works, for the corrections change most at the edge of the \
                 workspace; or give a larger --limit"
            }
            Self::OtherDrive { .. } => "choose one of these with --for",
            Self::Home { .. } => "give the joint angles at the end stops with --home-deg",
        }
    }
}

impl fmt::Display for ExportError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewPositions { found } => write!(
                formatter,
                "the robot reaches {found} of the positions, and a fit needs at least 20"
            ),
            Self::Unreached => formatter.write_str(
                "the target's kinematics does not reach the positions that the robot reaches",
            ),
            Self::TooManyNodes => {
                formatter.write_str("the correction table would have more than two million nodes")
            }
            Self::LimitNotMet {
                limit,
                spacing,
                worst,
                at,
                left_out,
            } => {
                write!(
                    formatter,
                    "no correction table of up to two million nodes keeps the error of interpolation below {limit} mm: \
                     with nodes {spacing} mm apart it is {worst:.4} mm at x = {:.1}, y = {:.1}, z = {:.1} mm",
                    at.x, at.y, at.z
                )?;
                if *left_out > 0 {
                    write!(formatter, ", and {left_out} positions have no corrections")?;
                }
                Ok(())
            }
            Self::OtherDrive { drive, others } => {
                let (own, other) = match drive {
                    Drive::Linear => ("carriages on towers drive", "motors that turn their arms"),
                    Drive::Rotary => ("motors that turn its arms drive", "carriages on towers"),
                };
                let others = list(others);
                write!(
                    formatter,
                    "{own} this robot, and the target takes only robots with {other}; this robot can be exported \
                     for {others}"
                )
            }
            Self::CannotHold { arm, cause, .. } | Self::Home { arm, cause } => {
                write!(formatter, "{arm}: {cause}")
            }
        }
    }
}

impl Error for ExportError {}
