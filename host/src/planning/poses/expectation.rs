//! What to expect of a calibration from given poses: the Cramér–Rao bound and what follows.

use super::candidates::Selection;
use super::{Assumptions, PlanError, PlanRequest};
use crate::accuracy::evaluation::CramerRaoBound;
use crate::accuracy::position_uncertainty::{PositionSigma, PositionUncertainty};
use crate::accuracy::workspace_poses::WorkspacePoses;
use crate::files::robot_file::RobotFile;
use crate::fit::options::CalibrationMethod;
use delta_cal::calibration::limits::LARGEST_SIGMA;
use delta_cal::robot::ParameterKind;
use delta_cal::simulate::made_robot;
use delta_cal::{ArmIndex, Parameter, Real, Robot, Sample};
use nalgebra::{SMatrix, Vector3};
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

/// Sets of random poses that a plan is compared with.
pub const RANDOM_SETS: usize = 21;
/// Poses that a region is judged over.
const REGION_POSES: usize = 300;
/// Robots that the position is judged on. Where edges are steep the mean square differs by some 40 % between
/// robots: the rms over 64 is known to 3 %.
const MADE: usize = 64;

/// What to expect: standard deviations of the parameters and of the platform's position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// √tr of the Cramér–Rao bound, mm, angles times the upper arm's length.
    pub bound: f64,
    /// Arm by arm, each parameter at its place: mm, radians or no unit.
    pub parameters: [[f64; 8]; 3],
    /// Of the position over the workspace, mm. With a tolerance the root of the mean square over robots
    /// made to it, each over its own workspace; the place and the number of poses are the nominal robot's.
    pub workspace: PositionSigma,
    /// Of the position over the region, if there is one.
    pub region: Option<PositionSigma>,
}

/// Of σ of all parameters, arm by arm in mm or radians, the one for which a calibration would be refused.
pub(in crate::planning) fn unknown_parameter(
    robot: &Robot<f64>,
    parameters: &[[f64; 8]; 3],
) -> Option<(ArmIndex, Parameter, f64)> {
    let mut worst: Option<(f64, (ArmIndex, Parameter, f64))> = None;
    for (arm, sigmas) in ArmIndex::ALL.into_iter().zip(parameters) {
        for parameter in robot.drive().parameters() {
            let sigma = &sigmas[parameter.index()];
            let limit = LARGEST_SIGMA
                * match parameter.kind() {
                    ParameterKind::Length => robot.arm(arm).upper_arm_length(),
                    ParameterKind::Angle | ParameterKind::Ratio => 1.0,
                };
            let part = sigma / limit;
            if !(part <= 1.0) && worst.is_none_or(|(largest, _)| part > largest) {
                worst = Some((part, (arm, *parameter, *sigma)));
            }
        }
    }
    worst.map(|(_, found)| found)
}

/// # Errors
/// [`PlanError::NotDetermined`] with that parameter.
pub(in crate::planning) fn determined(
    robot: &Robot<f64>,
    parameters: &[[f64; 8]; 3],
) -> Result<(), PlanError> {
    match unknown_parameter(robot, parameters) {
        None => Ok(()),
        Some((arm, parameter, sigma)) => Err(PlanError::NotDetermined {
            arm,
            parameter,
            sigma,
        }),
    }
}

/// How well measurements determine a robot's parameters.
pub(super) struct Known {
    /// √tr of the Cramér–Rao bound, mm.
    bound: f64,
    /// Per mm and radian.
    covariance: SMatrix<f64, 24, 24>,
}

impl Known {
    /// `None` if they do not determine it, or it does not reach one of the joint angles.
    pub(super) fn after(
        method: CalibrationMethod,
        robot: &Robot<f64>,
        joints: &[[f64; 3]],
        assumptions: &Assumptions,
    ) -> Option<Self> {
        let (noise, tolerance) = (&assumptions.noise, assumptions.tolerance.as_ref());
        let bound = CramerRaoBound::new(method, robot, joints, noise, tolerance)?;
        let covariance = match method {
            CalibrationMethod::Ikm => bound.with_shared_noise(robot, joints, noise)?,
            CalibrationMethod::Joint | CalibrationMethod::Fkm => bound.clone(),
        }
        .of_parameters(robot);
        Some(Self {
            bound: bound.error(),
            covariance,
        })
    }

    /// Of each parameter, arm by arm, mm or radians.
    pub(super) fn sigmas(&self) -> [[f64; 8]; 3] {
        let sigma = |index: usize| self.covariance[(index, index)].sqrt();
        [0, 1, 2].map(|arm| std::array::from_fn(|own| sigma(8 * arm + own)))
    }
}

/// Where the position's uncertainty is judged: over the nominal robot's workspace, and over those of
/// robots as they may have been made.
#[derive(Debug, Clone)]
pub(super) struct Yardstick<'a> {
    request: &'a PlanRequest<'a>,
    nominal: Place,
    /// Robots made to the tolerance; none without one.
    made: Vec<Place>,
}

/// A robot, and the poses that its uncertainty is judged over.
#[derive(Debug, Clone)]
struct Place {
    robot: Robot<f64>,
    workspace: WorkspacePoses,
    region: Vec<Sample<f64>>,
}

impl Place {
    /// `region`: poses of the nominal robot, whose joint angles this one takes as well.
    fn of(file: &RobotFile, region: &[Sample<f64>]) -> Self {
        let reach = file.reach();
        let there = |pose: &Sample<f64>| {
            let joints = pose.joints;
            let position = reach.clear_position(&file.robot, &joints).ok()?;
            Some(Sample { joints, position })
        };
        Self {
            robot: file.robot,
            workspace: WorkspacePoses::of(file),
            region: region.iter().filter_map(there).collect(),
        }
    }

    /// Of measurements at these joint angles. `None` if they do not determine this robot, or it does not
    /// reach one of them.
    fn expectation(
        &self,
        method: CalibrationMethod,
        joints: &[[f64; 3]],
        assumptions: &Assumptions,
    ) -> Option<Expectation> {
        let robot = &self.robot;
        let known = Known::after(method, robot, joints, assumptions)?;
        let uncertainty = PositionUncertainty {
            robot,
            covariance: &known.covariance,
        };
        Some(Expectation {
            bound: known.bound,
            parameters: known.sigmas(),
            workspace: uncertainty.over_workspace(&self.workspace)?,
            region: uncertainty.over(&self.region),
        })
    }
}

impl<'a> Yardstick<'a> {
    pub(super) fn new(
        request: &'a PlanRequest<'a>,
        selection: &Selection<'_>,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let region = match request.region {
            Some(_) => selection.draw_many(REGION_POSES, rng)?,
            None => Vec::new(),
        };
        let nominal = Place::of(request.robot, &region);
        if nominal.workspace.inside.is_empty() {
            return Err(PlanError::NoPose);
        }
        let made = made_to_tolerance(request.robot, rng);
        Ok(Self {
            request,
            nominal,
            made: made
                .par_iter()
                .map(|file| Place::of(file, &region))
                .collect(),
        })
    }

    /// Of measurements at these poses: the parameters' of the nominal robot, the position's as the root of
    /// the mean square over the robots that may have been made. `None` if they do not determine the nominal
    /// robot.
    pub(super) fn expectation(
        &self,
        poses: &[Sample<f64>],
        assumptions: &Assumptions,
    ) -> Option<Expectation> {
        self.over(&self.made, poses, assumptions)
    }

    /// The same of the nominal robot alone.
    pub(super) fn of_nominal(
        &self,
        poses: &[Sample<f64>],
        assumptions: &Assumptions,
    ) -> Option<Expectation> {
        self.over(&[], poses, assumptions)
    }

    fn over(
        &self,
        made: &[Place],
        poses: &[Sample<f64>],
        assumptions: &Assumptions,
    ) -> Option<Expectation> {
        let joints: Vec<_> = poses.iter().map(|pose| pose.joints).collect();
        let of = |place: &Place| place.expectation(self.request.method, &joints, assumptions);
        let nominal = of(&self.nominal)?;
        let made: Vec<_> = made.par_iter().filter_map(of).collect();
        let workspaces = made.iter().map(|made| made.workspace);
        let regions = made.iter().filter_map(|made| made.region);
        Some(Expectation {
            workspace: together(nominal.workspace, workspaces),
            region: nominal.region.map(|region| together(region, regions)),
            ..nominal
        })
    }

    /// The median of every figure over sets of random poses, drawn as the candidates are.
    pub(super) fn random_median(
        &self,
        selection: &Selection<'_>,
        assumptions: &Assumptions,
        rng: &mut Pcg32,
    ) -> Result<Expectation, PlanError> {
        let mut sets = Vec::with_capacity(RANDOM_SETS);
        for set in 0..RANDOM_SETS {
            let poses = selection.draw_many(self.request.count, rng)?;
            // The median of many sets needs no mean over the robots of each.
            let one = set % self.made.len().max(1);
            let one = self.made.get(one..=one).unwrap_or_default();
            sets.push(self.over(one, &poses, assumptions));
        }
        let median = |of: &dyn Fn(&Expectation) -> f64| {
            let figures = sets
                .iter()
                .map(|set| set.as_ref().map_or(f64::INFINITY, of));
            let mut figures: Vec<_> = figures.collect();
            figures.sort_by(f64::total_cmp);
            figures.get(RANDOM_SETS / 2).copied().unwrap_or(f64::NAN)
        };
        let nowhere = Vector3::repeat(f64::NAN);
        let position = |of: &dyn Fn(&Expectation) -> Option<PositionSigma>| PositionSigma {
            rms: median(&|set| of(set).map_or(f64::NAN, |sigma| sigma.rms)),
            max: median(&|set| of(set).map_or(f64::NAN, |sigma| sigma.max)),
            max_at: nowhere,
            poses: 0,
        };
        Ok(Expectation {
            bound: median(&|set| set.bound),
            parameters: std::array::from_fn(|arm| {
                std::array::from_fn(|own| median(&|set| set.parameters[arm][own]))
            }),
            workspace: position(&|set| Some(set.workspace)),
            region: self.request.region.map(|_| position(&|set| set.region)),
        })
    }
}

/// The root of the mean square of both figures; the nominal robot's where there are no others.
fn together(nominal: PositionSigma, made: impl Iterator<Item = PositionSigma>) -> PositionSigma {
    let (mut rms, mut max, mut count) = (0.0, 0.0, 0.0);
    for sigma in made {
        rms += sigma.rms.squared();
        max += sigma.max.squared();
        count += 1.0;
    }
    if count > 0.0 {
        PositionSigma {
            rms: (rms / count).square_root(),
            max: (max / count).square_root(),
            ..nominal
        }
    } else {
        nominal
    }
}

/// Files of robots as they may have been made.
pub(in crate::planning) fn made_to_tolerance(file: &RobotFile, rng: &mut Pcg32) -> Vec<RobotFile> {
    let Some(tolerance) = &file.tolerance else {
        return Vec::new();
    };
    let mut one = || {
        let robot = made_robot(&file.robot, tolerance, rng).ok()?;
        Some(RobotFile {
            robot,
            ..file.clone()
        })
    };
    (0..MADE).filter_map(|_| one()).collect()
}
