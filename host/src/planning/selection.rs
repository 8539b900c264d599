//! The allowed poses: within the limits with a margin, clear of singularities, and in the requested region.

use super::PlanError;
use crate::files::RobotFile;
use crate::geometry::{Reach, forearm_angle, range};
use crate::geometry::{Region, uniform};
use delta_cal::kinematics::{JointLimits, SingularityDistance};
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::simulate::standard_normal;
use delta_cal::{ArmIndex, Parameter, Real, Robot, Sample};
use nalgebra::{SVector, Vector3};
use rand_pcg::Pcg32;

/// After this many draws without any success, a search gives up.
const HOPELESS: usize = 20_000;
/// Draws allowed per candidate, on average.
const DRAWS: usize = 200;
/// Poses drawn to report where the robot can reach.
const ANYWHERE: usize = 5000;
/// Joint angles are planned in these steps, degrees: convenient to type, and within a drive's resolution.
const STEP: f64 = 1e-3;
/// Positions are stated in these steps, mm.
const STEP_MM: f64 = 1e-6;

/// Least distance of a pose from every limit, degrees.
const LEAST_DEGREES: f64 = 1.0;
/// The same for a travel, mm.
const LEAST_TRAVEL: f64 = 1.0;
/// And at least this many σ of the change that the tolerance makes to that distance: exceeded by one robot in three
/// million.
const SIGMAS: f64 = 5.0;
/// The tolerances of an angle and of a length at the end of the upper arm count up to this, degrees. A larger tolerance
/// says nothing about where the robot can reach.
const LARGEST_DEGREES: f64 = 10.0;

/// Measures that must stay above a bound: the squared volume of the forearms' unit vectors; for each forearm the sine of
/// its angle to the upper arm, and the negative of its angle out of the arm's plane.
///
/// The square of the volume changes smoothly with the parameters up to the singularity and beyond.
type Distances = SVector<f64, 7>;

/// Decides which poses are allowed: those that any robot within the tolerance reaches, clear of singularities.
#[derive(Debug, Clone)]
pub(super) struct Selection<'a> {
    file: &'a RobotFile,
    reach: Reach,
    region: Option<Region>,
    /// The part of the region within the arms' reach, if any.
    drawn: Option<Region>,
    /// Bounds for every robot within the tolerance.
    least: Distances,
    /// Bounds for the nominal robot.
    least_nominal: Distances,
    /// The nominal robot with each of the 24 parameters in turn larger by its tolerance; empty without a tolerance.
    others: Vec<Robot<f64>>,
}

impl<'a> Selection<'a> {
    /// The region is in the axes of the robot file.
    pub(super) fn new(file: &'a RobotFile, region: Option<Region>) -> Self {
        let region = region.map(|own| own.turned(&file.convention));
        let margin = LEAST_DEGREES.to_radians();
        let bounds = |parallel: f64, serial: f64, forearm: f64| {
            let mut bounds = Distances::repeat(serial);
            bounds[0] = parallel.squared();
            bounds.fixed_rows_mut::<3>(4).fill(-forearm);
            bounds
        };
        let (parallel, serial) = (
            SingularityDistance::<f64>::LEAST_PARALLEL,
            SingularityDistance::<f64>::LEAST_SERIAL,
        );
        let forearm = file.forearm_limit.unwrap_or(f64::INFINITY);
        let serial_with_margin = (arcsine(serial) + margin).sine_cosine().0;
        let forearm_with_margin = (forearm - margin).max(0.5 * forearm);
        Self {
            file,
            reach: Reach {
                limits: narrowed(&file.limits),
                forearm_limit: file.forearm_limit,
                within: None,
            },
            region,
            drawn: region.and_then(|region| region.clipped(&box_of_the_arms(&file.robot))),
            least: bounds(parallel, serial, forearm),
            least_nominal: bounds(parallel + margin, serial_with_margin, forearm_with_margin),
            others: one_tolerance_off(file),
        }
    }

    /// Whether a pose of the nominal robot that satisfies the constraints is far enough inside.
    fn clears(&self, x: &Vector3<f64>, q: &[f64; 3]) -> bool {
        let limited = self.file.forearm_limit.is_some();
        let here = distances(&self.file.robot, x, q, limited);
        let above = |bounds: &Distances, spread: f64, variances: &Distances| {
            let mut parts = here.iter().zip(variances).zip(bounds);
            parts.all(|((distance, variance), bound)| {
                distance - spread * variance.square_root() > *bound
            })
        };
        if !above(&self.least_nominal, 0.0, &Distances::zeros()) {
            return false;
        }
        let mut variances = Distances::zeros();
        for other in &self.others {
            let Ok(x) = other.forward(q) else {
                return false;
            };
            let change = distances(other, &x, q, limited) - here;
            variances += change.component_mul(&change);
        }
        above(&self.least, SIGMAS, &variances)
    }

    /// The pose at these joint angles (radians), rounded as it is written, if it is allowed.
    pub(super) fn pose(&self, joints: [f64; 3]) -> Option<Sample<f64>> {
        let joints = joints.map(|q| {
            // Dividing yields the double nearest to three decimals.
            let rounded = |q: f64| (q / STEP).round() / STEP.recip().round() + 0.0;
            match self.file.robot.drive() {
                Drive::Rotary => rounded(q.to_degrees()).to_radians(),
                Drive::Linear => rounded(q),
            }
        });
        let position = self.reach.position(&self.file.robot, &joints).ok()?;
        let inside = self.region.is_none_or(|region| region.contains(&position));
        (inside && self.clears(&position, &joints)).then(|| Sample {
            joints,
            position: position.map(|c| (c / STEP_MM).round() / STEP_MM.recip().round() + 0.0),
        })
    }

    /// The pose at a position, as near as rounding allows.
    pub(super) fn at(&self, position: &Vector3<f64>) -> Option<Sample<f64>> {
        self.pose(self.reach.joints(&self.file.robot, position).ok()?)
    }

    /// A random pose: uniform in the region or, without one, in joint space.
    pub(super) fn draw(&self, rng: &mut Pcg32) -> Option<Sample<f64>> {
        let joints = match self.region {
            Some(_) => {
                let x: Vector3<f64> = self.drawn?.random(rng);
                self.reach.joints(&self.file.robot, &x).ok()?
            }
            None => [(); 3].map(|()| self.reach.limits.at(uniform(rng))),
        };
        self.pose(joints)
    }

    /// `count` random poses.
    pub(super) fn draw_many(
        &self,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Sample<f64>>, PlanError> {
        let found = drawn(count, DRAWS, || self.draw(rng));
        if let (None, Some(region)) = (&found, self.region) {
            let anywhere = Self {
                region: None,
                ..self.clone()
            };
            let anywhere = anywhere.draw_many(ANYWHERE, rng)?;
            let along = |axis: usize| range(anywhere.iter().map(|pose| pose.position[axis]));
            return Err(PlanError::OutsideWorkspace {
                region: region.turned(&self.file.convention),
                reached: self.file.convention.ranges([0, 1, 2].map(along)),
            });
        }
        found.ok_or(PlanError::NoPose)
    }

    /// A pose near joint angles, clamped to the limits.
    pub(super) fn near(
        &self,
        joints: &[f64; 3],
        spread: f64,
        rng: &mut Pcg32,
    ) -> Option<Sample<f64>> {
        let limits = &self.reach.limits;
        // A travel of one forearm moves the platform about as far as a turn of 1 rad.
        let spread = match self.file.robot.drive() {
            Drive::Rotary => spread,
            Drive::Linear => spread * self.file.robot.arm(ArmIndex::First).lb(),
        };
        self.pose(joints.map(|q| {
            (q + spread * standard_normal::<f64, _>(rng)).clamp(limits.minimum(), limits.maximum())
        }))
    }
}

/// `count` successful draws; `None` if they take more than `each` draws on average.
pub(super) fn drawn<T>(
    count: usize,
    each: usize,
    mut draw: impl FnMut() -> Option<T>,
) -> Option<Vec<T>> {
    let mut found = Vec::with_capacity(count);
    let mut draws = 0;
    while found.len() < count {
        found.extend(draw());
        draws += 1;
        if draws >= HOPELESS + each * found.len() {
            return None;
        }
    }
    Some(found)
}

/// The box within reach of all arms: each ends within an upper arm and a forearm of its motor axis. Smallest and largest
/// x, y and z, mm.
fn box_of_the_arms(robot: &Robot<f64>) -> [(f64, f64); 3] {
    [0, 1, 2].map(|axis| {
        let whole = (f64::NEG_INFINITY, f64::INFINITY);
        robot.arms().iter().fold(whole, |(low, high), arm| {
            let length = arm.upper_arm_length() + arm.lb();
            let centre = arm.d()[axis];
            (low.max(centre - length), high.min(centre + length))
        })
    })
}

/// The joint limits less their margin.
fn narrowed(limits: &JointLimits<f64>) -> JointLimits<f64> {
    let range = limits.maximum() - limits.minimum();
    let (least, new): (_, fn(f64, f64) -> _) = match limits.drive() {
        Drive::Rotary => (LEAST_DEGREES.to_radians(), JointLimits::new),
        Drive::Linear => (LEAST_TRAVEL, JointLimits::travel),
    };
    let margin = least.min(0.1 * range);
    new(limits.minimum() + margin, limits.maximum() - margin).unwrap_or(*limits)
}

/// `limited`: whether the forearms have a limit; otherwise their angles count as 0.
fn distances(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3], limited: bool) -> Distances {
    let singularities = robot.singularity_distance(x, q);
    let [first, second, third] = singularities.serial;
    let [a, b, c] = ArmIndex::ALL.map(|arm| {
        if limited {
            -forearm_angle(robot, arm, x, q[arm.index()])
        } else {
            0.0
        }
    });
    let parallel = singularities.parallel.squared();
    Distances::from([parallel, first, second, third, a, b, c])
}

fn one_tolerance_off(file: &RobotFile) -> Vec<Robot<f64>> {
    let Some(tolerance) = &file.tolerance else {
        return Vec::new();
    };
    let [first, ..] = file.robot.arms();
    let largest = |kind| {
        let all = file.robot.drive().parameters().iter().copied();
        let all = all.filter(|own| own.kind() == kind && *own != Parameter::Zero);
        all.map(|own| tolerance.of(own)).fold(0.0, f64::max)
    };
    let length = largest(ParameterKind::Length) / first.upper_arm_length();
    let angle = SIGMAS * (largest(ParameterKind::Angle) + length);
    let part = (LARGEST_DEGREES.to_radians() / angle).min(1.0);
    let larger = |index: usize| {
        let (arm, own) = (index / 8, index % 8);
        let sigmas = tolerance.of_places(&file.robot.arms()[arm]);
        let mut parameters = file.robot.parameters();
        parameters[arm][own] += part * sigmas[own];
        file.robot.with_parameters(parameters).ok()
    };
    (0..24).filter_map(larger).collect()
}

/// By the core's arctangent, which gives the same bits on every system.
fn arcsine(sine: f64) -> f64 {
    sine.angle_over((1.0 - sine.squared()).square_root())
}
