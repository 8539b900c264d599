//! Why there is no plan.

use super::{LEAST_POSES, MOST_POSES, Region};
use crate::text::words::in_file_units;
use delta_cal::samples::NoiseError;
use delta_cal::{ArmIndex, Parameter};
use std::error::Error;
use std::fmt;

/// Why there is no plan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum PlanError {
    /// So few poses determine no robot.
    TooFew(usize),
    /// So few measurements are not worth a plan.
    TooFewMeasurements(usize),
    /// More than anybody measures.
    TooMany(usize),
    /// The kinds that are wanted may be measured only so often.
    TooFewOfAKind(usize),
    /// Such measurements cannot be taken anywhere.
    NoMeasurement(&'static str),
    /// More unknowns of instruments than a plan has room for.
    TooManyInstruments,
    /// The noise is none.
    Noise(NoiseError),
    /// The limits leave no pose that is clear of singularities.
    NoPose,
    /// The region holds no pose that the robot can take, or next to none.
    OutsideWorkspace {
        /// The region.
        region: Region,
        /// Smallest and largest x, y and z that random poses without it reach, mm.
        reached: [(f64, f64); 3],
    },
    /// The candidates hold no information of some combination of parameters.
    Singular,
    /// The best poses still leave a parameter unknown: a calibration from them would be refused.
    NotDetermined {
        /// Its arm.
        arm: ArmIndex,
        /// The one known worst.
        parameter: Parameter,
        /// One σ of it, mm or radians.
        sigma: f64,
    },
}

impl PlanError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::TooFew(_) => {
                "plan 8 or more, better 12: fewer can be calibrated only with a [tolerance], which \
                 then decides more than they do"
            }
            Self::TooFewMeasurements(_) => "plan 12 or more: fewer bring little",
            Self::TooFewOfAKind(_) => {
                "give a smaller --count, or allow more of a kind: --measure plane,distance=12 allows 12 \
                 distances at most"
            }
            Self::NoMeasurement(_) => {
                "check where the plane is, the gauge blocks and the lengths that can be measured (--plane, --blocks \
                 and --length of delta-cal plan): the robot must get there within its limits and clear of \
                 singularities"
            }
            Self::TooManyInstruments => "plan with fewer points",
            Self::TooMany(_) => {
                "plan fewer; beyond a hundred poses each further one adds hardly \
                                 anything"
            }
            Self::Noise(_) => "state the [noise] in the robot file",
            Self::NoPose => {
                "check [joints] in the robot file: min_deg, max_deg, forearm_max_deg; a positive \
                 angle swings the arm towards the platform"
            }
            Self::OutsideWorkspace { .. } => {
                "move the region into the workspace; its z is negative below the base"
            }
            Self::Singular | Self::NotDetermined { .. } => {
                "allow a larger region or more poses, state the [noise] in the robot file, or a \
                 [tolerance]"
            }
        }
    }
}

impl fmt::Display for PlanError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew(count) => write!(
                formatter,
                "{count} poses cannot determine a robot: each arm has {LEAST_POSES} parameters, \
                 and a pose gives one equation for each arm"
            ),
            Self::TooFewMeasurements(count) => {
                write!(formatter, "{count} measurements are fewer than 4")
            }
            Self::TooFewOfAKind(count) => write!(
                formatter,
                "the kinds that were asked for allow only {count} measurements in all"
            ),
            Self::NoMeasurement(kind) => {
                write!(
                    formatter,
                    "the robot cannot be measured so anywhere: {kind}"
                )
            }
            Self::TooManyInstruments => {
                formatter.write_str("frame, planes and points have more than 24 unknowns together")
            }
            Self::TooMany(count) => {
                write!(formatter, "{count} are more than {MOST_POSES}")
            }
            Self::Noise(error) => error.fmt(formatter),
            Self::NoPose => formatter.write_str(
                "no usable pose: within the limits no pose is reachable and clear of singularities",
            ),
            Self::OutsideWorkspace { region, reached } => {
                let [x, y, z] = reached;
                write!(
                    formatter,
                    "no usable pose within {region}, or next to none: the robot reaches x {:.0} to \
                     {:.0}, y {:.0} to {:.0}, z {:.0} to {:.0} mm, and not all of that",
                    x.0, x.1, y.0, y.1, z.0, z.1
                )
            }
            Self::Singular => {
                formatter.write_str("the poses that are allowed do not determine the parameters")
            }
            Self::NotDetermined {
                arm,
                parameter,
                sigma,
            } => write!(
                formatter,
                "the poses that are allowed do not determine the parameters: {parameter} of {arm} \
                 would be known only to {} (one sigma)",
                in_file_units(*parameter, *sigma)
            ),
        }
    }
}

impl Error for PlanError {}

impl From<NoiseError> for PlanError {
    fn from(error: NoiseError) -> Self {
        Self::Noise(error)
    }
}
