//! How far a pose is inside the limits, and how far it must be, so that a robot made to the stated
//! tolerance gets there as well.

use crate::files::robot_file::RobotFile;
use crate::geometry::reach::forearm_angle;
use delta_cal::kinematics::{JointLimits, SingularityDistance};
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Parameter, Real, Robot};
use nalgebra::{SVector, Vector3};

/// A pose is at least so far inside every limit, degrees.
const LEAST_DEGREES: f64 = 1.0;
/// The same of a travel, mm.
const LEAST_TRAVEL: f64 = 1.0;
/// And by so many σ of what the tolerance does to its distance from the limit: of three million robots one is
/// further off.
const SIGMAS: f64 = 5.0;
/// So many tolerances, of an angle and of a length at the end of the upper arm, count up to this,
/// degrees. Beyond that a tolerance says nothing of where the robot gets.
const LARGEST_DEGREES: f64 = 10.0;

/// The joints' limits less their margin.
pub(super) fn narrowed(limits: &JointLimits<f64>) -> JointLimits<f64> {
    let range = limits.maximum() - limits.minimum();
    let (least, new): (_, fn(f64, f64) -> _) = match limits.drive() {
        Drive::Rotary => (LEAST_DEGREES.to_radians(), JointLimits::new),
        Drive::Linear => (LEAST_TRAVEL, JointLimits::travel),
    };
    let margin = least.min(0.1 * range);
    new(limits.minimum() + margin, limits.maximum() - margin).unwrap_or(*limits)
}

/// What must not be below a bound: the volume of the forearms' unit vectors squared, of each forearm the
/// sine of its angle from the upper arm's line, and less its angle out of its arm's plane.
///
/// The volume is squared because its square changes evenly with the parameters up to the singularity and
/// beyond, where it would be negative.
type Distances = SVector<f64, 7>;

/// Which poses a robot made to the tolerance reaches, clear of singularities.
#[derive(Debug, Clone)]
pub(super) struct Clearance {
    /// That a pose of any robot has.
    least: Distances,
    /// That a pose of the nominal robot has.
    least_nominal: Distances,
    /// The nominal robot with one parameter larger by its tolerance, each of the 24 in turn; none
    /// without a tolerance.
    others: Vec<Robot<f64>>,
}

impl Clearance {
    pub(super) fn new(file: &RobotFile) -> Self {
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
            least: bounds(parallel, serial, forearm),
            least_nominal: bounds(parallel + margin, serial_with_margin, forearm_with_margin),
            others: one_tolerance_off(file),
        }
    }

    /// Whether a pose of the nominal robot, which satisfies the constraints, is far enough inside.
    pub(super) fn allows(&self, robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> bool {
        let limited = self.least[4].is_finite();
        let here = distances(robot, x, q, limited);
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
}

/// `limited`: whether there is a limit of the forearms; otherwise their angles count as 0.
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
    let length = tolerance.of(Parameter::Lb) / first.upper_arm_length();
    let of_angles = match file.robot.drive() {
        Drive::Rotary => Parameter::Theta,
        Drive::Linear => Parameter::LeanX,
    };
    let angle = SIGMAS * (tolerance.of(of_angles) + length);
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

/// With the core's arctangent: the platform's arcsine has other bits on another system.
fn arcsine(sine: f64) -> f64 {
    sine.angle_over((1.0 - sine.squared()).square_root())
}
