//! What to measure: the set of measurements that minimises the expected position error, for any mixture of heights,
//! distances and coordinates; and what the rows of a file determine.
//!
//! ```text
//! PlanRequest ─→ Setup ─→ candidates ─→ Information of each (the core's) ─→ exchange ─→ Plan
//!                                                                             └→ Judge: expected error
//! ```
//!
//! There is one criterion: the variance of the platform's position over the workspace, after the best rigid motion
//! or absolute.

mod exchange;
mod judge;
mod plan;
mod request;
mod samples;
mod search;
mod selection;
mod setup;

pub use crate::geometry::Region;
use crate::text::{in_file_units, small};
use delta_cal::{ArmIndex, Parameter};
pub use judge::Precision;
pub use plan::{Plan, labelled, others, plan};
pub use request::{Kind, LEAST, MOST, Order, PlanRequest, Wish, Wishes};
pub use samples::Determined;
pub(crate) use samples::covariance_after;
pub use setup::{PLANE, PlaneAt, Planned, PointAt, Setup};

/// Why there is no plan.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Fewer than [`LEAST`] or more than [`MOST`].
    #[error("--count must be {LEAST} to {MOST}")]
    Count(usize),
    /// The request's limits per kind allow too few measurements.
    #[error("--measure allows only {0} measurements in all")]
    TooFewOfAKind(usize),
    /// No reachable pose allows this kind of measurement.
    #[error("no reachable pose allows this measurement: {}", .0.title())]
    NoMeasurement(Kind),
    /// The instruments have more unknowns than a calibration has room for.
    #[error("frame, planes and points have too many unknowns together")]
    TooManyInstruments,
    /// The sensor's frame, and no coordinates in it.
    #[error("the sensor's frame is for coordinates, and none are measured")]
    NoCoordinates,
    /// The absolute error from coordinates in the sensor's frame, and nothing with a known place.
    #[error(
        "the absolute error depends on where the robot stands, which the sensor's frame does not show"
    )]
    NoPlace,
    /// No pose within the limits is clear of singularities.
    #[error("no usable pose: no pose within the limits is reachable and clear of singularities")]
    NoPose,
    /// The robot reaches (almost) no pose in the region.
    #[error(
        "too few usable poses within {region}: the robot reaches at most x {:.0} to {:.0}, y {:.0} to {:.0}, z {:.0} to \
         {:.0} mm",
        reached[0].0, reached[0].1, reached[1].0, reached[1].1, reached[2].0, reached[2].1
    )]
    OutsideWorkspace {
        /// The region.
        region: Region,
        /// Smallest and largest x, y and z that the robot reaches, mm.
        reached: [(f64, f64); 3],
    },
    /// The allowed measurements do not determine the robot.
    #[error("the allowed poses do not determine the parameters")]
    Singular,
    /// Even the best measurements leave a parameter so uncertain that a calibration would refuse.
    #[error(
        "the allowed poses do not determine the robot: {parameter} of {arm} would be known only to {} (σ)",
        in_file_units(*parameter, *sigma)
    )]
    NotDetermined {
        /// Its arm.
        arm: ArmIndex,
        /// The least known parameter.
        parameter: Parameter,
        /// One σ of it, mm or radians.
        sigma: f64,
    },
    /// No number of measurements up to [`MOST`] is expected to reach the required accuracy.
    #[error(
        "{} mm is out of reach: even {MOST} measurements leave {} mm or more",
        small(*wanted),
        small(*reached)
    )]
    TooAccurate {
        /// The required accuracy, mm.
        wanted: f64,
        /// The accuracy expected of [`MOST`] measurements, mm.
        reached: f64,
    },
}

impl PlanError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Count(count) if *count > MOST => {
                "plan fewer: beyond a hundred, further measurements add little"
            }
            Self::Count(_) => "plan 12 or more",
            Self::TooFewOfAKind(_) => {
                "give a smaller --count, or allow more measurements of a kind"
            }
            Self::NoMeasurement(_) => {
                "check the planes, points and lengths in the robot file: the robot must get there within its limits \
                 and clear of singularities"
            }
            Self::TooManyInstruments => "plan with fewer points",
            Self::NoCoordinates => "plan in the robot's frame, or measure coordinates too",
            Self::NoPlace => {
                "state [datum.NAME] points in the robot file, or plan for the relative error"
            }
            Self::NoPose => {
                "check [joints] in the robot file: min_deg, max_deg, forearm_max_deg; a positive \
                 angle swings the arm towards the platform"
            }
            Self::OutsideWorkspace { .. } => "move the region into the workspace",
            Self::Singular | Self::NotDetermined { .. } => {
                "allow a larger region or more poses, or state [noise] and [tolerance] in the robot file"
            }
            Self::TooAccurate { .. } => {
                "ask for less accuracy, or measure with less noise and state it in [noise]"
            }
        }
    }
}
