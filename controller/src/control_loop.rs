//! What happens at every turn: the next point of a path, its joint angles, and whether the drives can follow them.

use crate::limiter::{Limiter, Limits};
use delta_cal::{Real, Robot};
use delta_cal_protocol::{ControlLoop as State, Motion};
use nalgebra::Vector3;

/// The platform's path: your controller's motion planner.
pub trait Path<T: Real> {
    /// The point for the next turn, mm. It is not called while the joints brake, stand still or approach the last point.
    fn next_point(&mut self) -> Vector3<T>;

    /// The joints stop: whatever comes next begins at rest.
    fn stopped(&mut self) {}
}

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
/// It owns its parameters. New ones arrive as a whole, and the joint targets blend over smoothly. No move of the joint
/// targets exceeds the [`Limits`]: at the start they approach the path from where the joints are; where the path is out
/// of reach or too fast, they brake to a stop, and stay there until [`resume`](Self::resume).
#[derive(Debug, Clone)]
pub struct ControlLoop<T: Real, P> {
    /// The path, to give it another target.
    pub path: P,
    /// The parameters in use; while [`switching`](Self::switching), the previous ones.
    pub robot: Robot<T>,
    /// New parameters being blended in, and the turn of that, an integer.
    blend: Option<(NewParameters<T>, T)>,
    blend_turns: T,
    limiter: Limiter<T>,
    /// Whether the point to approach is still to be asked for.
    begins: bool,
    /// The last point and its joint targets, and counters.
    pub state: State<T>,
}

impl<T: Real, P: Path<T>> ControlLoop<T, P> {
    /// At rest at these joint angles, rad, and about to approach the path.
    pub fn new(parameters: &NewParameters<T>, path: P, limits: &Limits<T>, joints: [T; 3]) -> Self {
        Self {
            path,
            robot: parameters.robot.clone(),
            blend: None,
            blend_turns: T::from_f64(limits.blend_turns.max(1).into()),
            limiter: Limiter::new(limits, joints),
            begins: true,
            state: State {
                turns_a_second: limits.turns_a_second,
                joints,
                ..State::new(parameters.fingerprint)
            },
        }
    }

    /// Blends over to other parameters, or switches at once while the joints do not follow the path. Returns `false`
    /// without effect while a previous change is in progress, and while the new robot cannot reach the point that the
    /// joints are at.
    pub fn switch_to(&mut self, parameters: &NewParameters<T>) -> bool {
        let reachable = || parameters.robot.inverse(&self.state.point.into()).is_ok();
        if self.switching() || (self.state.motion == Motion::Following && !reachable()) {
            return false;
        }
        self.blend = Some((parameters.clone(), T::ZERO));
        true
    }

    /// Whether it is blending over to other parameters.
    pub const fn switching(&self) -> bool {
        self.blend.is_some()
    }

    /// Approaches the path again after the stop at this [turn](State::stopped), once the joints stand still; otherwise
    /// does nothing.
    pub fn resume(&mut self, stopped: u32) {
        let State { motion, .. } = self.state;
        let stops = matches!(motion, Motion::Unreachable | Motion::TooFast);
        if stops && stopped == self.state.stopped && self.limiter.at_rest() {
            self.state.motion = Motion::Approaching;
            self.begins = true;
        }
    }

    /// One turn.
    pub fn turn(&mut self) -> &[T; 3] {
        self.state.turns = self.state.turns.wrapping_add(1);
        if let Some((_, turn)) = &mut self.blend {
            *turn += T::ONE;
        }
        let motion = self.state.motion;
        let following = motion == Motion::Following;
        if core::mem::take(&mut self.begins) || following {
            self.state.point = self.path.next_point().into();
        }
        if following || motion == Motion::Approaching {
            self.state.motion = match self.targets(&self.state.point.into()) {
                None => Motion::Unreachable,
                Some(joints) if following && !self.limiter.follow(&joints) => Motion::TooFast,
                Some(joints) if !following && !self.limiter.approach(&joints) => motion,
                Some(_) => Motion::Following,
            };
        }
        if matches!(self.state.motion, Motion::Unreachable | Motion::TooFast) {
            if self.state.motion != motion {
                self.state.stopped = self.state.turns;
                self.state.stops = self.state.stops.wrapping_add(1);
                self.path.stopped();
            }
            self.limiter.brake();
        }
        self.state.joints = self.limiter.joints;
        // What does not follow the path does not move with the parameters either.
        let over = |turn: T| turn >= self.blend_turns || self.state.motion != Motion::Following;
        if let Some((new, _)) = self.blend.take_if(|(_, turn)| over(*turn)) {
            self.robot = new.robot;
            self.state.fingerprint = new.fingerprint;
            self.state.switches = self.state.switches.wrapping_add(1);
        }
        &self.state.joints
    }

    fn targets(&self, point: &Vector3<T>) -> Option<[T; 3]> {
        let mut joints = self.robot.inverse(point).ok()?;
        if let Some((new, turn)) = &self.blend {
            let other = new.robot.inverse(point).ok()?;
            // s²(3 − 2s): neither the targets nor their speed jumps.
            let s = *turn / self.blend_turns;
            let share = s * s * (T::from_f64(3.0) - T::TWO * s);
            for (joint, other) in joints.iter_mut().zip(other) {
                *joint += (other - *joint) * share;
            }
        }
        Some(joints)
    }
}
