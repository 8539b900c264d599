//! What the page draws: the arms of a robot and the bed of a printer, before and after.

use delta_cal::Robot;
use delta_cal::robot::Drive;
use delta_cal_host::RobotFile;
use delta_cal_host::printer::{ACROSS, Off, Printer};
use serde::Serialize;

/// A calibration that can be drawn.
#[derive(Debug)]
pub(crate) struct Pictured {
    before: RobotFile,
    after: RobotFile,
    bed: Option<Bed>,
}

/// Three arms: shoulder and elbow of each, and the platform; mm.
#[derive(Debug, Serialize)]
pub(crate) struct Arms {
    shoulders: [[f64; 3]; 3],
    elbows: [[f64; 3]; 3],
    platform: [f64; 3],
}

/// The same robot as its file says and as it was found.
#[derive(Debug, Serialize)]
pub(crate) struct Skeleton {
    before: Arms,
    after: Arms,
}

/// Where the nozzle is when its controller believes that it touches the bed: x, y and the height about its mean at places so
/// far apart, mm.
#[derive(Debug, Serialize)]
pub(crate) struct Bed {
    radius: f64,
    step: f64,
    before: Vec<[f64; 3]>,
    after: Option<Vec<[f64; 3]>>,
}

impl Pictured {
    pub(crate) fn new(before: RobotFile, after: RobotFile, printer: Option<&Printer>) -> Self {
        Self {
            before,
            after,
            bed: printer.and_then(|own| {
                let heights = |off: &Off| {
                    let places = off.map.iter();
                    places.map(|([x, y], off)| [*x, *y, off.z]).collect()
                };
                Some(Bed {
                    radius: own.bed_radius_mm,
                    step: 2.0 * own.bed_radius_mm / f64::from(ACROSS),
                    before: heights(own.before.as_ref()?),
                    after: own.after.as_ref().map(heights),
                })
            }),
        }
    }

    /// At joints in degrees or mm of travel.
    pub(crate) fn skeleton(&self, joints: &[f64]) -> Option<Skeleton> {
        let joints = <[f64; 3]>::try_from(joints).ok()?;
        let joints = match self.before.robot.drive() {
            Drive::Rotary => joints.map(f64::to_radians),
            Drive::Linear => joints,
        };
        Some(Skeleton {
            before: arms(&self.before.robot, joints)?,
            after: arms(&self.after.robot, joints)?,
        })
    }

    pub(crate) const fn bed(&self) -> Option<&Bed> {
        self.bed.as_ref()
    }
}

fn arms(robot: &Robot<f64>, joints: [f64; 3]) -> Option<Arms> {
    let platform = robot.forward(&joints).ok()?;
    let mut own = Arms {
        shoulders: [[0.0; 3]; 3],
        elbows: [[0.0; 3]; 3],
        platform: platform.into(),
    };
    for (index, (arm, joint)) in robot.arms().iter().zip(joints).enumerate() {
        if let (Some(shoulder), Some(elbow)) =
            (own.shoulders.get_mut(index), own.elbows.get_mut(index))
        {
            *shoulder = arm.d().into();
            *elbow = arm.elbow(joint).into();
        }
    }
    Some(own)
}
