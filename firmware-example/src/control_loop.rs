use crate::path::{Circle, Path};
use delta_cal::{Real, Robot};
use nalgebra::Vector3;

/// Turns over which the joint targets blend from old to new parameters.
pub const BLEND_TURNS: u32 = 500;

/// New parameters being blended in.
#[derive(Debug, Clone, Copy)]
struct Blend<T: Real> {
    robot: Robot<T>,
    /// An integer.
    turn: T,
}

/// The control loop: each turn computes the next point of the path and its joint angles.
///
/// It owns its parameters. New ones arrive as a whole, and the joint targets blend over smoothly.
#[derive(Debug, Clone, Copy)]
pub struct ControlLoop<T: Real, P = Circle<T>> {
    path: P,
    robot: Robot<T>,
    blend: Option<Blend<T>>,
    point: Vector3<T>,
    joints: [T; 3],
    turns: u32,
    unreachable: u32,
    switches: u32,
}

impl<T: Real> ControlLoop<T> {
    /// At rest, with these parameters, on a circular path.
    pub fn new(robot: &Robot<T>) -> Self {
        Self::with_path(robot, Circle::default())
    }
}

impl<T: Real, P: Path<T>> ControlLoop<T, P> {
    /// At rest, with these parameters, on a given path.
    pub fn with_path(robot: &Robot<T>, path: P) -> Self {
        Self {
            path,
            robot: *robot,
            blend: None,
            point: Vector3::zeros(),
            joints: [T::ZERO; 3],
            turns: 0,
            unreachable: 0,
            switches: 0,
        }
    }

    /// Blends over to other parameters within the next [`BLEND_TURNS`] turns; returns `false` without effect while a
    /// previous change is in progress.
    pub fn switch_to(&mut self, robot: &Robot<T>) -> bool {
        if self.switching() {
            return false;
        }
        self.blend = Some(Blend {
            robot: *robot,
            turn: T::ZERO,
        });
        true
    }

    /// Whether it is blending over to other parameters.
    pub const fn switching(&self) -> bool {
        self.blend.is_some()
    }

    /// One turn. If a point is unreachable, the joints stay where they are.
    pub fn turn(&mut self) -> &[T; 3] {
        self.turns = self.turns.wrapping_add(1);
        if let Some(blend) = &mut self.blend {
            blend.turn += T::ONE;
        }
        self.point = self.path.next_point();
        match self.targets() {
            Some(joints) => self.joints = joints,
            None => self.unreachable = self.unreachable.wrapping_add(1),
        }
        if let Some(blend) = &self.blend
            && blend.turn >= blend_turns()
        {
            self.robot = blend.robot;
            self.blend = None;
            self.switches = self.switches.wrapping_add(1);
        }
        &self.joints
    }

    fn targets(&self) -> Option<[T; 3]> {
        let mut joints = self.robot.inverse(&self.point).ok()?;
        if let Some(blend) = &self.blend {
            let other = blend.robot.inverse(&self.point).ok()?;
            // s²(3 − 2s): neither the targets nor their speed jumps.
            let s = blend.turn / blend_turns();
            let share = s * s * (T::from_f64(3.0) - T::TWO * s);
            for (joint, other) in joints.iter_mut().zip(other) {
                *joint += (other - *joint) * share;
            }
        }
        Some(joints)
    }

    /// The parameters in use; while [`switching`](Self::switching), the previous ones.
    pub const fn robot(&self) -> &Robot<T> {
        &self.robot
    }

    /// The path, to give it another target.
    pub const fn path_mut(&mut self) -> &mut P {
        &mut self.path
    }

    /// The last point of the path, mm.
    pub const fn point(&self) -> &Vector3<T> {
        &self.point
    }

    /// The joint targets, radians.
    pub const fn joints(&self) -> &[T; 3] {
        &self.joints
    }

    /// Turns so far.
    pub const fn turns(&self) -> u32 {
        self.turns
    }

    /// Turns whose point was unreachable.
    pub const fn unreachable(&self) -> u32 {
        self.unreachable
    }

    /// Number of parameter changes.
    pub const fn switches(&self) -> u32 {
        self.switches
    }
}

fn blend_turns<T: Real>() -> T {
    T::from_f64(f64::from(BLEND_TURNS))
}
