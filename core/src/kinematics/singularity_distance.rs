use crate::Real;
use crate::robot::Robot;
use nalgebra::Vector3;

/// How far a pose is from both kinds of singularity. Numbers without units, 0 at a singularity and
/// 1 at best.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SingularityDistance<T> {
    /// Type 1: |cosine| of the angle between each forearm and its elbow's direction of motion, 0
    /// where upper arm and forearm are in line, or a forearm stands square to its tower.
    pub serial: [T; 3],
    /// Type 2: |det| of the forearms' unit vectors, the volume they span, 0 where they lie in one
    /// plane.
    pub parallel: T,
}

impl<T: Real> SingularityDistance<T> {
    /// [`serial`](Self::serial) above which a pose is clear of singularities: the forearm at least
    /// 6° away from its upper arm's line.
    pub const LEAST_SERIAL: f64 = 0.1;
    /// [`parallel`](Self::parallel) above which a pose is clear of singularities.
    pub const LEAST_PARALLEL: f64 = 0.05;

    /// Whether the pose is clear of both kinds.
    pub fn is_clear(&self) -> bool {
        let least = T::from_f64(Self::LEAST_SERIAL);
        self.serial.iter().all(|serial| *serial > least)
            && self.parallel > T::from_f64(Self::LEAST_PARALLEL)
    }
}

impl<T: Real> Robot<T> {
    /// The distance from singularities at the pose (`x`, `q`), which must satisfy the constraints
    /// (as `x = self.forward(q)` does): ∂f/∂q of each arm over 2 La Lb, and det ∂f/∂X over 8 Lb³.
    ///
    /// ```
    /// use delta_cal::SymmetricRobot;
    /// # fn main() -> Result<(), Box<dyn core::error::Error>> {
    /// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
    ///     .robot()?;
    /// let q = [0.1, 0.2, 0.3];
    /// assert!(robot.singularity_distance(&robot.forward(&q)?, &q).is_clear());
    /// # Ok(())
    /// # }
    /// ```
    pub fn singularity_distance(&self, x: &Vector3<T>, q: &[T; 3]) -> SingularityDistance<T> {
        let mut forearms = [Vector3::zeros(); 3];
        let mut serial = [T::ZERO; 3];
        let poses = self.arms().iter().zip(q);
        for ((arm, q), (forearm, serial)) in poses.zip(forearms.iter_mut().zip(&mut serial)) {
            *forearm = (x - arm.elbow(*q)) / arm.lb();
            let tangent = arm.elbow_derivative(*q) / arm.elbow_speed();
            *serial = forearm.dot(&tangent).magnitude();
        }
        let [w1, w2, w3] = forearms;
        SingularityDistance {
            serial,
            parallel: w1.dot(&w2.cross(&w3)).magnitude(),
        }
    }
}
