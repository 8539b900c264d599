//! The poses that may be chosen: within the limits with a margin, clear of singularities, and in the
//! region that was asked for.

use super::clearance::{Clearance, narrowed};
use super::error::PlanError;
use super::region::{Region, uniform};
use crate::files::robot_file::RobotFile;
use crate::geometry::reach::Reach;
use delta_cal::robot::Drive;
use delta_cal::simulate::standard_normal;
use delta_cal::{ArmIndex, Robot, Sample};
use nalgebra::Vector3;
use rand_core::Rng;

/// Draws without a usable pose before there is said to be none.
const HOPELESS: usize = 20_000;
/// Draws a candidate at most, on average.
const DRAWS: usize = 200;
/// Poses by which it is told where the robot gets.
const ANYWHERE: usize = 5000;
/// Joint angles are planned in steps of this, degrees: what a person types and a drive holds.
const STEP: f64 = 1e-3;
/// Positions are stated in steps of this, mm.
const STEP_MM: f64 = 1e-6;

/// Which poses may be chosen.
#[derive(Debug, Clone)]
pub(super) struct Selection<'a> {
    robot: &'a Robot<f64>,
    reach: Reach,
    clearance: Clearance,
    region: Option<&'a Region>,
    /// As much of the region as lies where the arms end: nothing if it is out of their reach.
    drawn: Option<Region>,
}

impl<'a> Selection<'a> {
    pub(super) fn new(file: &'a RobotFile, region: Option<&'a Region>) -> Self {
        Self {
            robot: &file.robot,
            reach: Reach {
                limits: narrowed(&file.limits),
                forearm_limit: file.forearm_limit,
            },
            clearance: Clearance::new(file),
            region,
            drawn: region.and_then(|region| region.clipped(&box_of_the_arms(&file.robot))),
        }
    }

    /// The same anywhere the robot gets.
    fn anywhere(&self) -> Self {
        Self {
            region: None,
            ..self.clone()
        }
    }

    /// The pose at these joint angles (radians), rounded to what is written, if it may be chosen.
    pub(super) fn pose(&self, joints: [f64; 3]) -> Option<Sample<f64>> {
        let joints = joints.map(|q| {
            // Divided, so that the number is the nearest to its three decimals.
            let rounded = |q: f64| (q / STEP).round() / STEP.recip().round() + 0.0;
            match self.robot.drive() {
                Drive::Rotary => rounded(q.to_degrees()).to_radians(),
                Drive::Linear => rounded(q),
            }
        });
        let position = self.reach.position(self.robot, &joints).ok()?;
        let inside = self.region.is_none_or(|region| region.contains(&position));
        (inside && self.clearance.allows(self.robot, &position, &joints)).then(|| Sample {
            joints,
            position: position.map(|c| (c / STEP_MM).round() / STEP_MM.recip().round() + 0.0),
        })
    }

    /// The pose at a position, as near as what is written allows.
    pub(super) fn at(&self, position: &Vector3<f64>) -> Option<Sample<f64>> {
        self.pose(self.reach.joints(self.robot, position).ok()?)
    }

    /// Any pose: evenly in the region, or else evenly in joint space.
    pub(super) fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Option<Sample<f64>> {
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
        // A travel of a forearm's length moves the platform as far as a turn by 1 rad.
        let spread = match self.robot.drive() {
            Drive::Rotary => spread,
            Drive::Linear => spread * self.robot.arm(ArmIndex::First).lb(),
        };
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
