//! What happens a thousand times a second: the next point of a path, and its joint angles.

use delta_cal::{Real, Robot};
use delta_cal_protocol::ControlLoop as State;
use nalgebra::Vector3;

/// Turns per revolution.
const TURNS: f64 = 4000.0;
const RADIUS: f64 = 100.0;
const HEIGHT: f64 = -450.0;
const RISE: f64 = 40.0;

/// The platform's path: stands for your controller's motion planner.
pub trait Path<T: Real> {
    /// The point for the next turn, mm.
    fn next_point(&mut self) -> Vector3<T>;
}

/// A circle with a radius of 100 mm, in four seconds; the height oscillates twice per revolution by 40 mm about its
/// mean. Stands for the motion planner of a real controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle<T> {
    /// An integer.
    turn: T,
}

impl<T: Real> Default for Circle<T> {
    fn default() -> Self {
        Self { turn: T::ZERO }
    }
}

impl<T: Real> Path<T> for Circle<T> {
    fn next_point(&mut self) -> Vector3<T> {
        let turns = T::from_f64(TURNS);
        let (sine, cosine) = (T::TWO * T::PI * self.turn / turns).sine_cosine();
        self.turn += T::ONE;
        if self.turn >= turns {
            self.turn = T::ZERO;
        }
        Vector3::new(
            T::from_f64(RADIUS) * cosine,
            T::from_f64(RADIUS) * sine,
            T::from_f64(HEIGHT) + T::from_f64(2.0 * RISE) * sine * cosine,
        )
    }
}

/// Turns over which the joint targets blend from old to new parameters.
pub const BLEND_TURNS: u32 = 500;

/// A complete set of parameters for the control loop.
#[derive(Debug, Clone, PartialEq)]
pub struct NewParameters<T: Real> {
    /// The robot.
    pub robot: Robot<T>,
    /// The [`fingerprint`](delta_cal_protocol::Geometry::fingerprint) of its parameters.
    pub fingerprint: u32,
}

/// The control loop: each turn computes the next point of the path and its joint angles.
///
/// It owns its parameters. New ones arrive as a whole, and the joint targets blend over smoothly.
#[derive(Debug, Clone)]
pub struct ControlLoop<T: Real, P = Circle<T>> {
    /// The path, to give it another target.
    pub path: P,
    /// The parameters in use; while [`switching`](Self::switching), the previous ones.
    pub robot: Robot<T>,
    /// New parameters being blended in, and the turn of that, an integer.
    blend: Option<(NewParameters<T>, T)>,
    /// The last point and its joint targets, and counters.
    pub state: State<T>,
}

impl<T: Real, P: Path<T>> ControlLoop<T, P> {
    /// At rest, with these parameters.
    pub fn new(parameters: &NewParameters<T>, path: P) -> Self {
        Self {
            path,
            robot: parameters.robot.clone(),
            blend: None,
            state: State::new(parameters.fingerprint),
        }
    }

    /// Blends over to other parameters within the next [`BLEND_TURNS`] turns; returns `false` without effect while a
    /// previous change is in progress.
    pub fn switch_to(&mut self, parameters: &NewParameters<T>) -> bool {
        if self.switching() {
            return false;
        }
        self.blend = Some((parameters.clone(), T::ZERO));
        true
    }

    /// Whether it is blending over to other parameters.
    pub const fn switching(&self) -> bool {
        self.blend.is_some()
    }

    /// One turn. If a point is unreachable, the joints stay where they are.
    pub fn turn(&mut self) -> &[T; 3] {
        self.state.turns = self.state.turns.wrapping_add(1);
        if let Some((_, turn)) = &mut self.blend {
            *turn += T::ONE;
        }
        let point = self.path.next_point();
        self.state.point = point.into();
        match self.targets(&point) {
            Some(joints) => self.state.joints = joints,
            None => self.state.unreachable = self.state.unreachable.wrapping_add(1),
        }
        if let Some((new, turn)) = &self.blend
            && *turn >= blend_turns()
        {
            self.robot = new.robot.clone();
            self.state.fingerprint = new.fingerprint;
            self.state.switches = self.state.switches.wrapping_add(1);
            self.blend = None;
        }
        &self.state.joints
    }

    fn targets(&self, point: &Vector3<T>) -> Option<[T; 3]> {
        let mut joints = self.robot.inverse(point).ok()?;
        if let Some((new, turn)) = &self.blend {
            let other = new.robot.inverse(point).ok()?;
            // s²(3 − 2s): neither the targets nor their speed jumps.
            let s = *turn / blend_turns();
            let share = s * s * (T::from_f64(3.0) - T::TWO * s);
            for (joint, other) in joints.iter_mut().zip(other) {
                *joint += (other - *joint) * share;
            }
        }
        Some(joints)
    }
}

fn blend_turns<T: Real>() -> T {
    T::from_f64(f64::from(BLEND_TURNS))
}
