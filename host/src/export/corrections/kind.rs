//! What a controller adds: to the commanded position, or to the joint angles.

use crate::export::shape::within_half_turn;
use crate::geometry::reach::hangs_below;
use delta_cal::Robot;
use delta_cal::kinematics::SingularityDistance;
use delta_cal::robot::Drive;
use nalgebra::Vector3;

/// What is corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// The commanded position, before the controller's inverse kinematics.
    #[default]
    Position,
    /// The joint angles (with towers the travels) after it.
    Joint,
}

/// The two robots of a table: the one that the controller moves, and the one that it computes with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<'a> {
    /// As it was built.
    pub(crate) calibrated: &'a Robot<f64>,
    /// The controller's.
    pub(crate) nominal: &'a Robot<f64>,
}

impl Kind {
    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Joint => "joint",
        }
    }

    /// The unit of the corrections of robots with such drives.
    pub const fn unit(self, drive: Drive) -> &'static str {
        match (self, drive) {
            (Self::Joint, Drive::Rotary) => "deg",
            (Self::Joint, Drive::Linear) | (Self::Position, _) => "mm",
        }
    }

    /// What to add, in mm or degrees, so that the robot is at a position; `None` where there is no such pose, or
    /// where it is so near to a parallel singularity that the correction there says nothing of those around it.
    pub(crate) fn correction(self, pair: &Pair<'_>, at: &Vector3<f64>) -> Option<Vector3<f64>> {
        let joints = pair.calibrated.inverse(at).ok()?;
        let distance = pair.calibrated.singularity_distance(at, &joints);
        if !hangs_below(pair.calibrated, at, &joints)
            || distance.parallel < SingularityDistance::<f64>::LEAST_PARALLEL
        {
            return None;
        }
        match self {
            Self::Position => Some(pair.nominal.forward(&joints).ok()? - at),
            Self::Joint => {
                let nominal = pair.nominal.inverse(at).ok()?;
                let by = Vector3::from(joints) - Vector3::from(nominal);
                Some(match pair.calibrated.drive() {
                    Drive::Rotary => by.map(within_half_turn).map(f64::to_degrees),
                    Drive::Linear => by,
                })
            }
        }
    }

    /// Where the robot is if it is wanted at a position and this is added.
    pub(crate) fn reached(
        self,
        pair: &Pair<'_>,
        at: &Vector3<f64>,
        correction: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let joints = match self {
            Self::Position => pair.nominal.inverse(&(at + correction)).ok()?,
            Self::Joint => {
                let nominal = Vector3::from(pair.nominal.inverse(at).ok()?);
                let by = match pair.calibrated.drive() {
                    Drive::Rotary => correction.map(f64::to_radians),
                    Drive::Linear => *correction,
                };
                (nominal + by).into()
            }
        };
        pair.calibrated.forward(&joints).ok()
    }
}
