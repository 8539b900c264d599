//! Why there is no workspace to speak of.

use std::fmt;

/// Why there is no workspace to speak of.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum WorkspaceError {
    /// No pose of the forward sweep is reachable.
    Empty {
        /// How many were tried.
        poses: u32,
        /// How many of them only the ball joints forbid.
        forearms_forbid: u32,
    },
    /// The workspace is so thin that no node of the grid is in it.
    Thin {
        /// The grid's spacing, mm.
        spacing: f64,
    },
    /// The grid would have too many nodes.
    TooFine {
        /// The spacing asked for, mm.
        spacing: f64,
        /// The smallest possible, mm.
        least: f64,
    },
}

impl fmt::Display for WorkspaceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty {
                poses,
                forearms_forbid: 0,
            } => write!(
                formatter,
                "the workspace is empty: the forearms meet at none of {poses} combinations of joint \
                 angles within the limits"
            ),
            Self::Empty {
                poses,
                forearms_forbid,
            } => write!(
                formatter,
                "the workspace is empty: of {poses} combinations of joint angles within the limits \
                 the forearms meet at {forearms_forbid}, and there forearm_max_deg forbids every one"
            ),
            Self::Thin { spacing } => write!(
                formatter,
                "the workspace is thinner than the distance between the lines, {spacing:.3} mm: no \
                 line meets it"
            ),
            Self::TooFine { spacing, least } => write!(
                formatter,
                "--spacing {spacing} is too small: lines {spacing} mm apart would be too many for this \
                 workspace; the smallest value for it is {:.2} mm",
                // Rounded up, so that it works.
                (least * 100.0).ceil() / 100.0
            ),
        }
    }
}

impl std::error::Error for WorkspaceError {}

impl WorkspaceError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Empty {
                forearms_forbid: 0, ..
            } => "check the lengths (in mm), the arms' azimuths and min_deg, max_deg in [joints]",
            Self::Empty { .. } => "enlarge forearm_max_deg in [joints], or delete the line",
            Self::Thin { .. } => "give a smaller --spacing, or wider limits in [joints]",
            Self::TooFine { .. } => "give a larger --spacing, or leave it out",
        }
    }
}
