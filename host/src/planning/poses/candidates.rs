//! The poses that may be chosen: within the limits with a margin, clear of singularities, and in the
//! region that was asked for.

use super::random::uniform;
use super::{PlanError, Region};
use crate::files::robot_file::RobotFile;
use crate::geometry::reach::Reach;
use delta_cal::kinematics::{JointLimits, SingularityDistance};
use delta_cal::simulate::standard_normal;
use delta_cal::{Parameter, Real, Robot, Sample};
use nalgebra::Vector3;
use rand_core::Rng;

/// Draws without a usable pose before there is said to be none.
const HOPELESS: usize = 20_000;
/// Draws a candidate at most, on average.
const DRAWS: usize = 200;
/// Poses by which it is told where the robot gets.
const ANYWHERE: usize = 5000;
/// A pose is at least so far inside every limit, degrees.
const LEAST_DEGREES: f64 = 1.0;
/// Three tolerances count up to this, degrees.
const LARGEST_DEGREES: f64 = 10.0;
/// Joint angles are planned in steps of this, degrees: what a person types and a drive holds.
const STEP_DEGREES: f64 = 1e-3;
/// Positions are stated in steps of this, mm.
const STEP_MM: f64 = 1e-6;

/// By how much a planned pose is inside the limits of the nominal robot, so that the real robot gets
/// there as well. All in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// From the joints' limits: 1°, a tenth of their range at most. They hold for the angles that
    /// are commanded, whatever the geometry.
    pub joints: f64,
    /// From the forearms' limit: 1°, or three tolerances if that is more, of an angle and, at the
    /// end of the upper arm, of a length.
    pub forearms: f64,
    /// Of a forearm from its upper arm's line: 1° more than a clear pose has
    /// ([`SingularityDistance::is_clear`]), or three tolerances if that is more.
    pub serial: f64,
    /// Of a forearm from the plane of the other two: the same, for the volume of the forearms' unit
    /// vectors changes by less than the angle by which one of them turns.
    pub parallel: f64,
}

impl Margin {
    /// For what the robot file states.
    pub fn of(robot: &RobotFile) -> Self {
        let [arm, ..] = robot.robot.arms();
        let tolerances = robot.tolerance.as_ref().map_or(0.0, |tolerance| {
            let length = tolerance.of(Parameter::Lb) / arm.upper_arm_length();
            // Beyond that a tolerance says nothing of where the robot gets.
            (3.0 * (tolerance.of(Parameter::Theta) + length)).min(LARGEST_DEGREES.to_radians())
        });
        let least = LEAST_DEGREES.to_radians();
        let range = robot.limits.maximum() - robot.limits.minimum();
        Self {
            joints: least.min(0.1 * range),
            forearms: least.max(tolerances),
            serial: (arcsine(SingularityDistance::<f64>::LEAST_SERIAL) + least).max(tolerances),
            parallel: (SingularityDistance::<f64>::LEAST_PARALLEL + least).max(tolerances),
        }
    }
}

/// Which poses may be chosen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Selection<'a> {
    robot: &'a Robot<f64>,
    reach: Reach,
    least_serial: f64,
    least_parallel: f64,
    region: Option<&'a Region>,
    /// As much of the region as lies where the arms end: nothing if it is out of their reach.
    drawn: Option<Region>,
}

impl<'a> Selection<'a> {
    pub(super) fn new(file: &'a RobotFile, margin: Margin, region: Option<&'a Region>) -> Self {
        let limits = &file.limits;
        let narrowed = JointLimits::new(
            limits.minimum() + margin.joints,
            limits.maximum() - margin.joints,
        );
        Self {
            robot: &file.robot,
            reach: Reach {
                limits: narrowed.unwrap_or(*limits),
                forearm_limit: file
                    .forearm_limit
                    .map(|limit| (limit - margin.forearms).max(0.5 * limit)),
            },
            least_serial: margin.serial.sine_cosine().0,
            least_parallel: margin.parallel,
            region,
            drawn: region.and_then(|region| region.clipped(&box_of_the_arms(&file.robot))),
        }
    }

    /// The same anywhere the robot gets.
    const fn anywhere(&self) -> Self {
        Self {
            region: None,
            ..*self
        }
    }

    /// The pose at these joint angles (radians), rounded to what is written, if it may be chosen.
    pub(super) fn pose(&self, joints: [f64; 3]) -> Option<Sample<f64>> {
        let joints = joints.map(|q| {
            let steps = (q.to_degrees() / STEP_DEGREES).round();
            // Divided, so that the number is the nearest to its three decimals.
            (steps / STEP_DEGREES.recip().round() + 0.0).to_radians()
        });
        let position = self.reach.position(self.robot, &joints).ok()?;
        let conditioning = self.robot.singularity_distance(&position, &joints);
        let clear = conditioning.parallel > self.least_parallel
            && conditioning
                .serial
                .iter()
                .all(|serial| *serial > self.least_serial);
        let inside = self.region.is_none_or(|region| region.contains(&position));
        (clear && inside).then(|| Sample {
            joints,
            position: position.map(|c| (c / STEP_MM).round() / STEP_MM.recip().round() + 0.0),
        })
    }

    /// Any pose: evenly in the region, or else evenly in joint space.
    fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Option<Sample<f64>> {
        let joints = match self.region {
            Some(_) => {
                let x: Vector3<f64> = self.drawn?.random(rng);
                self.reach.joints(self.robot, &x).ok()?
            }
            None => [(); 3].map(|()| self.reach.limits.at(uniform(rng))),
        };
        self.pose(joints)
    }

    /// As many as asked for.
    pub(super) fn draw_many<R: Rng + ?Sized>(
        &self,
        count: usize,
        rng: &mut R,
    ) -> Result<Vec<Sample<f64>>, PlanError> {
        let mut found = Vec::with_capacity(count);
        let mut draws = 0;
        while found.len() < count {
            found.extend(self.draw(rng));
            draws += 1;
            if draws >= HOPELESS + DRAWS * found.len() {
                return Err(match self.region {
                    Some(region) => self.outside(region, rng),
                    None => PlanError::NoPose,
                });
            }
        }
        Ok(found)
    }

    /// A region without poses, or a robot without any.
    fn outside<R: Rng + ?Sized>(&self, region: &Region, rng: &mut R) -> PlanError {
        let anywhere = match self.anywhere().draw_many(ANYWHERE, rng) {
            Ok(poses) => poses,
            Err(error) => return error,
        };
        let range = |of: &dyn Fn(&Vector3<f64>) -> f64| {
            let values = anywhere.iter().map(|pose| of(&pose.position));
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
        };
        PlanError::OutsideWorkspace {
            region: *region,
            reached: [range(&|x| x.x), range(&|x| x.y), range(&|x| x.z)],
        }
    }

    /// A pose near another, at most on the limits.
    pub(super) fn near<R: Rng + ?Sized>(
        &self,
        pose: &Sample<f64>,
        spread: f64,
        rng: &mut R,
    ) -> Option<Sample<f64>> {
        let limits = &self.reach.limits;
        self.pose(pose.joints.map(|q| {
            (q + spread * standard_normal::<f64, R>(rng)).clamp(limits.minimum(), limits.maximum())
        }))
    }
}

/// Where all arms reach: each ends within an upper arm and a forearm of its motor axis. Smallest and
/// largest x, y and z, mm.
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

/// With the core's arctangent: the platform's arcsine has other bits on another system.
fn arcsine(sine: f64) -> f64 {
    sine.angle_over((1.0 - sine.squared()).square_root())
}
