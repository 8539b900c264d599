//! How far the robot is from where it was wanted.

use super::wanted::Wanted;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use nalgebra::Vector3;

/// Distances between where the platform was wanted and where it is, over many positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Root of the mean square, mm.
    pub rms: f64,
    /// The largest, mm.
    pub worst: f64,
    /// Where it is the largest: the wanted position in the robot's frame, mm.
    pub at: Vector3<f64>,
    /// How many positions were compared.
    pub positions: usize,
    /// How many were left out because the controller's kinematics does not reach them.
    pub unreached: usize,
}

impl Loss {
    /// Of wanted positions and of the distance at each, if it is known.
    pub(crate) fn of(distances: impl Iterator<Item = (Vector3<f64>, Option<f64>)>) -> Self {
        let mut loss = Self {
            rms: 0.0,
            worst: 0.0,
            at: Vector3::zeros(),
            positions: 0,
            unreached: 0,
        };
        let (mut sum, mut count) = (0.0, 0.0);
        for (at, distance) in distances {
            let Some(distance) = distance else {
                loss.unreached += 1;
                continue;
            };
            loss.positions += 1;
            count += 1.0;
            sum += distance * distance;
            if distance >= loss.worst {
                (loss.worst, loss.at) = (distance, at);
            }
        }
        if loss.positions > 0 {
            loss.rms = f64::sqrt(sum / count);
        }
        loss
    }

    /// Where the calibrated robot is if a controller with the kinematics of `controller` is told to go to
    /// each position; `frame` takes the robot's frame to the controller's.
    pub(crate) fn of_controller(
        calibrated: &Robot<f64>,
        controller: &Robot<f64>,
        frame: &RigidTransform<f64>,
        wanted: &Wanted,
    ) -> Self {
        Self::of(wanted.evaluated.iter().map(|at| {
            let is = reached(calibrated, controller, &frame.apply(at));
            (*at, is.map(|is| (is - at).norm()))
        }))
    }

    /// The same for a controller in the robot's own frame, as it is and after the rigid motion that explains
    /// most of it.
    pub(crate) fn uncalibrated(
        calibrated: &Robot<f64>,
        nominal: &Robot<f64>,
        wanted: &Wanted,
    ) -> (Self, Self) {
        let found: Vec<_> = wanted
            .evaluated
            .iter()
            .map(|at| (*at, reached(calibrated, nominal, at)))
            .collect();
        let as_it_is = found
            .iter()
            .map(|(at, is)| (*at, is.map(|is| (is - at).norm())));
        let pairs: Vec<_> = found
            .iter()
            .filter_map(|(at, is)| is.map(|is| (is, *at)))
            .collect();
        let motion = RigidTransform::align(pairs.iter().copied()).unwrap_or_default();
        let moved = found
            .iter()
            .map(|(at, is)| (*at, is.map(|is| (motion.apply(&is) - at).norm())));
        (Self::of(as_it_is), Self::of(moved))
    }
}

/// Where the calibrated robot is at the joint angles that a controller computes for a commanded position.
pub(crate) fn reached(
    calibrated: &Robot<f64>,
    controller: &Robot<f64>,
    commanded: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let joints = controller.inverse(commanded).ok()?;
    calibrated.forward(&joints).ok()
}
