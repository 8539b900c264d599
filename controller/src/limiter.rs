//! Joint targets that the drives can follow, whatever is asked for.

use delta_cal::Real;
use nalgebra::clamp;

/// What the board states about its control loop and its drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<T> {
    /// Turns of the control loop per second.
    pub turns_a_second: u32,
    /// Turns over which the joint targets blend from old to new parameters.
    pub blend_turns: u32,
    /// Largest speed of a joint, rad/s.
    pub speed: T,
    /// Largest acceleration of a joint, rad/s².
    pub acceleration: T,
}

/// The joint targets and their last moves. No move exceeds the limits: neither when it follows, nor when it stops or
/// approaches.
#[derive(Debug, Clone)]
pub struct Limiter<T: Real> {
    /// The targets, rad.
    pub joints: [T; 3],
    /// How far they moved in the last turn, rad.
    moved: [T; 3],
    /// Largest move in a turn, rad, and the largest change of a move from one turn to the next.
    most: T,
    change: T,
}

impl<T: Real> Limiter<T> {
    /// At rest.
    pub fn new(limits: &Limits<T>, joints: [T; 3]) -> Self {
        let turns = T::from_f64(limits.turns_a_second.max(1).into());
        let most = limits.speed / turns;
        // Two angles that are right to a few roundings differ by as much without any acceleration.
        let change = limits.acceleration / (turns * turns) + T::from_f64(16.0) * T::EPSILON;
        Self {
            joints,
            moved: [T::ZERO; 3],
            most,
            change: if change < most { change } else { most },
        }
    }

    /// Whether the targets stand still.
    pub(crate) fn at_rest(&self) -> bool {
        self.moved.iter().all(|moved| *moved == T::ZERO)
    }

    /// Moves to exactly these targets, or if that would exceed a limit (or they are not numbers) returns `false` and
    /// moves nothing.
    pub fn follow(&mut self, wanted: &[T; 3]) -> bool {
        let mut moves = [T::ZERO; 3];
        for (arm, own) in moves.iter_mut().enumerate() {
            *own = wanted[arm] - self.joints[arm];
            let change = *own - self.moved[arm];
            if !(own.magnitude() <= self.most && change.magnitude() <= self.change) {
                return false;
            }
        }
        (self.joints, self.moved) = (*wanted, moves);
        true
    }

    /// Slows down as fast as the limits allow.
    pub(crate) fn brake(&mut self) {
        for (joint, moved) in self.joints.iter_mut().zip(&mut self.moved) {
            *moved -= clamp(*moved, -self.change, self.change);
            *joint += *moved;
        }
    }

    /// Moves towards targets that stand still, and stops there; returns whether it has.
    pub(crate) fn approach(&mut self, wanted: &[T; 3]) -> bool {
        let (most, change) = (self.most, self.change);
        let joints = self.joints.iter_mut().zip(&mut self.moved);
        for ((joint, moved), wanted) in joints.zip(wanted) {
            let way = *wanted - *joint;
            if way.magnitude() <= change && (way - *moved).magnitude() <= change {
                (*joint, *moved) = (*wanted, way);
                continue;
            }
            // In proportion to the way that is left, which slows down by the limit at most.
            let fastest = clamp(way.magnitude() * change / most, change, most);
            let aim = if way < T::ZERO { -fastest } else { fastest };
            *moved = clamp(aim, *moved - change, *moved + change);
            *joint += *moved;
        }
        self.joints == *wanted && self.at_rest()
    }
}
