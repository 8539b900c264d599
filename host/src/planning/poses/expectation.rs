//! What to expect of a calibration from given poses: the Cramér–Rao bound and what follows.

use super::candidates::Selection;
use super::{Assumptions, PlanError, PlanRequest};
use crate::accuracy::evaluation::CramerRaoBound;
use crate::accuracy::position_uncertainty::{PositionSigma, PositionUncertainty, WorkspacePoses};
use delta_cal::calibration::limits::LARGEST_SIGMA;
use delta_cal::robot::ParameterKind;
use delta_cal::{ArmIndex, Parameter, Robot, Sample};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

/// Sets of random poses that a plan is compared with.
pub const RANDOM_SETS: usize = 21;
/// Poses that a region is judged over.
const REGION_POSES: usize = 300;

/// What to expect: standard deviations of the parameters and of the platform's position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// √tr of the Cramér–Rao bound, mm, angles times the upper arm's length.
    pub bound: f64,
    /// Arm by arm in the order of [`Parameter::ALL`]: mm or radians.
    pub parameters: [[f64; 8]; 3],
    /// Of the position over the workspace, mm.
    pub workspace: PositionSigma,
    /// Of the position over the region, if there is one.
    pub region: Option<PositionSigma>,
}

impl Expectation {
    /// The parameter that is known worst, if a calibration would be refused for it.
    pub(super) fn unknown(&self, robot: &Robot<f64>) -> Option<(ArmIndex, Parameter, f64)> {
        let mut worst: Option<(f64, (ArmIndex, Parameter, f64))> = None;
        for (arm, sigmas) in ArmIndex::ALL.into_iter().zip(&self.parameters) {
            for (parameter, sigma) in Parameter::ALL.into_iter().zip(sigmas) {
                let limit = LARGEST_SIGMA
                    * match parameter.kind() {
                        ParameterKind::Length => robot.arm(arm).upper_arm_length(),
                        ParameterKind::Angle => 1.0,
                    };
                let part = sigma / limit;
                if !(part <= 1.0) && worst.is_none_or(|(largest, _)| part > largest) {
                    worst = Some((part, (arm, parameter, *sigma)));
                }
            }
        }
        worst.map(|(_, found)| found)
    }
}

/// Where the position's uncertainty is judged.
#[derive(Debug, Clone)]
pub(super) struct Yardstick<'a> {
    request: &'a PlanRequest<'a>,
    workspace: WorkspacePoses,
    region: Vec<Sample<f64>>,
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
        let workspace = WorkspacePoses::of(request.robot);
        if workspace.inside.is_empty() {
            return Err(PlanError::NoPose);
        }
        Ok(Self {
            request,
            workspace,
            region,
        })
    }

    /// Of measurements at these poses. `None` if they do not determine the robot.
    pub(super) fn expectation(
        &self,
        poses: &[Sample<f64>],
        assumptions: &Assumptions,
    ) -> Option<Expectation> {
        let robot = &self.request.robot.robot;
        let joints: Vec<_> = poses.iter().map(|pose| pose.joints).collect();
        let bound = CramerRaoBound::new(
            self.request.method,
            robot,
            &joints,
            &assumptions.noise,
            assumptions.tolerance.as_ref(),
        )?;
        let covariance = &bound.of_parameters(robot);
        let uncertainty = PositionUncertainty { robot, covariance };
        let sigma = |index: usize| covariance[(index, index)].sqrt();
        Some(Expectation {
            bound: bound.error(),
            parameters: [0, 1, 2].map(|arm| std::array::from_fn(|own| sigma(8 * arm + own))),
            workspace: uncertainty.over_workspace(&self.workspace)?,
            region: uncertainty.over(&self.region),
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
        for _ in 0..RANDOM_SETS {
            let poses = selection.draw_many(self.request.count, rng)?;
            sets.push(self.expectation(&poses, assumptions));
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
