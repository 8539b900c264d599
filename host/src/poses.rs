//! Which poses to measure: those that leave the parameters least uncertain for a stated noise and
//! tolerance.
//!
//! ```text
//! RobotFile ─→ candidates ─→ rows of each ─→ exchange ─→ travel ─→ PosePlan
//!                                                  └→ expectation, beside random poses
//! ```

mod accuracy;
mod candidates;
mod error;
mod exchange;
mod expectation;
mod next;
mod random;
mod region;
mod rows;
mod search;
mod travel;

pub use accuracy::{MANY, PosesNeeded, poses_needed};
pub use candidates::Margin;
pub use error::PlanError;
use expectation::Yardstick;
pub use expectation::{Expectation, RANDOM_SETS};
pub use next::{NextPoses, next_poses};
pub use region::{Region, RegionError};
pub use travel::{distance, length, ordered};

use crate::{CalibrationMethod, RobotFile};
use candidates::Selection;
use delta_cal::samples::NoiseError;
use delta_cal::{Noise, Sample, Tolerance};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use search::Search;

/// Fewer poses determine no arm: it has eight parameters, and a pose is one equation of each.
pub const LEAST_POSES: usize = 8;
/// As many as a plan may have.
pub const MOST_POSES: usize = 500;

/// What a set of poses is judged by; C is the covariance of the parameters, the prior included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// tr C, angles times the upper arm's length: the mean square of the parameter error.
    #[default]
    A,
    /// det C: the volume of the parameters' confidence region, whatever their units.
    D,
}

impl Criterion {
    /// As it is written: `a` or `d`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::D => "d",
        }
    }
}

/// What is known of the measurements, or assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumptions {
    /// One σ of a measurement.
    pub noise: Noise<f64>,
    /// Whether the robot file states it; otherwise it is [`Assumptions::POSITION`] and
    /// [`Assumptions::JOINT_DEGREES`].
    pub noise_stated: bool,
    /// The prior; `None` if the robot file states none.
    pub tolerance: Option<Tolerance<f64>>,
}

impl Assumptions {
    /// What a laser tracker does in a robot's workspace, mm.
    pub const POSITION: f64 = 0.02;
    /// What an encoder on a geared joint does, degrees.
    pub const JOINT_DEGREES: f64 = 0.002;

    /// What the file states, and the rest by default.
    ///
    /// # Errors
    /// None is known: the defaults are a noise.
    pub fn of(file: &RobotFile) -> Result<Self, NoiseError> {
        let noise = match file.noise {
            Some(stated) => stated,
            None => Noise::new(Self::POSITION, Self::JOINT_DEGREES.to_radians())?,
        };
        Ok(Self {
            noise,
            noise_stated: file.noise.is_some(),
            tolerance: file.tolerance,
        })
    }
}

/// Which poses are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanRequest<'a> {
    /// The robot as it is known, its limits, and what is stated of noise and tolerance.
    pub robot: &'a RobotFile,
    /// How many poses.
    pub count: usize,
    /// How the robot will be calibrated.
    pub method: CalibrationMethod,
    /// What the poses are judged by.
    pub criterion: Criterion,
    /// Where the platform may be; anywhere if `None`.
    pub region: Option<Region>,
    /// The same seed gives the same poses.
    pub seed: u64,
}

/// Poses to measure, and what to expect of a calibration from them.
#[derive(Debug, Clone, PartialEq)]
pub struct PosePlan {
    /// In the order of a short travel: joint angles in whole thousandths of a degree, and the
    /// nominal robot's positions there to the nanometre.
    pub poses: Vec<Sample<f64>>,
    /// The noise and the tolerance that were planned for.
    pub assumptions: Assumptions,
    /// By how much the poses are inside the limits.
    pub margin: Margin,
    /// What to expect.
    pub planned: Expectation,
    /// Whether a calibration from these poses would find every parameter without the tolerance, too.
    pub determined_alone: bool,
    /// The median of what [`RANDOM_SETS`] sets of as many random poses would give: `None` if most of
    /// them would not determine the robot.
    pub random: Expectation,
    /// Travel in the order of the poses, radians ([`length`]).
    pub travel: f64,
    /// Travel in the order in which they were found.
    pub travel_unordered: f64,
}

/// Plans poses.
///
/// # Errors
/// Fewer than 8 poses or more than 500, limits or a region that exclude everything, or poses that
/// cannot determine the parameters with this noise.
///
/// ```
/// use delta_cal_host::poses::{PlanRequest, plan};
/// use delta_cal_host::example;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (robot, _) = example::load()?;
/// let request = PlanRequest { count: 12, ..PlanRequest::new(&robot) };
/// let plan = plan(&request)?;
/// assert!(plan.planned.workspace.rms < plan.random.workspace.rms);
/// # Ok(())
/// # }
/// ```
pub fn plan(request: &PlanRequest<'_>) -> Result<PosePlan, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let margin = Margin::of(request.robot);
    let selection = Selection::new(request.robot, margin, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let (found, planned, yardstick) = chosen(request, &assumptions, &selection, &mut rng)?;
    let random = yardstick.random_median(&selection, &assumptions, &mut rng)?;
    let alone = Assumptions {
        tolerance: None,
        ..assumptions
    };
    let by_themselves = yardstick.expectation(&found, &alone);
    let robot = &request.robot.robot;
    let poses = ordered(&found);
    Ok(PosePlan {
        travel: length(&poses),
        travel_unordered: length(&found),
        poses,
        assumptions,
        margin,
        planned,
        determined_alone: by_themselves.is_some_and(|alone| alone.unknown(robot).is_none()),
        random,
    })
}

/// What to expect of the poses that [`plan`] plans.
///
/// # Errors
/// As [`plan`].
pub fn expected(request: &PlanRequest<'_>) -> Result<Expectation, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let margin = Margin::of(request.robot);
    let selection = Selection::new(request.robot, margin, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    chosen(request, &assumptions, &selection, &mut rng).map(|(_, planned, _)| planned)
}

/// The best poses, as they were found, what to expect of them, and by what that is judged.
fn chosen<'a>(
    request: &'a PlanRequest<'_>,
    assumptions: &Assumptions,
    selection: &Selection<'_>,
    rng: &mut Pcg32,
) -> Result<(Vec<Sample<f64>>, Expectation, Yardstick<'a>), PlanError> {
    if request.count < LEAST_POSES {
        return Err(PlanError::TooFew(request.count));
    }
    if request.count > MOST_POSES {
        return Err(PlanError::TooMany(request.count));
    }
    let search = Search {
        request,
        assumptions,
        selection,
    };
    let found = search.run(rng)?;
    let yardstick = Yardstick::new(request, selection, rng)?;
    let planned = yardstick
        .expectation(&found, assumptions)
        .ok_or(PlanError::Singular)?;
    match planned.unknown(&request.robot.robot) {
        None => Ok((found, planned, yardstick)),
        Some((arm, parameter, sigma)) => Err(PlanError::NotDetermined {
            arm,
            parameter,
            sigma,
        }),
    }
}

impl<'a> PlanRequest<'a> {
    /// Twenty poses anywhere, for the IKM method.
    pub fn new(robot: &'a RobotFile) -> Self {
        Self {
            robot,
            count: 20,
            method: CalibrationMethod::default(),
            criterion: Criterion::default(),
            region: None,
            seed: 1,
        }
    }
}
