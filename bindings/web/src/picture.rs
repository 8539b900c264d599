//! What the page draws: the arms of a robot and the bed of a printer, before and after.

use delta_cal::Robot;
use delta_cal::robot::Drive;
use delta_cal_host::RobotFile;
use delta_cal_host::export::geometry::Frame;
use delta_cal_host::printer::Printer;
use nalgebra::Vector3;
use serde::Serialize;

/// A calibration that can be drawn.
#[derive(Debug)]
pub(crate) struct Pictured {
    before: RobotFile,
    after: RobotFile,
    bed: Option<Pasted>,
}

/// A printer's bed, and what its controller is to be told.
#[derive(Debug)]
struct Pasted {
    radius: f64,
    level: Frame,
    controller: Option<(Robot<f64>, Frame)>,
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

/// Places of the bed and the height of the nozzle there about its mean, mm: x, y, height.
#[derive(Debug, Serialize)]
pub(crate) struct Bed {
    radius: f64,
    before: Vec<[f64; 3]>,
    after: Option<Vec<[f64; 3]>>,
}

/// Nodes from the middle of the bed to its edge.
const NODES: i32 = 12;

impl Pictured {
    pub(crate) fn new(before: RobotFile, after: RobotFile, printer: Option<&Printer>) -> Self {
        Self {
            before,
            after,
            bed: printer.map(|own| Pasted {
                radius: own.bed_radius_mm,
                level: own.level,
                controller: own.controller,
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

    /// Where the nozzle is when its controller believes that it touches the bed.
    pub(crate) fn bed(&self) -> Option<Bed> {
        let own = self.bed.as_ref()?;
        let nodes = |controller: &Robot<f64>, frame: &Frame| {
            let at = |step: i32| f64::from(step) / f64::from(NODES) * own.radius;
            let rows = (-NODES..=NODES).map(at);
            let places =
                rows.flat_map(|y| (-NODES..=NODES).map(move |step| Vector3::new(at(step), y, 0.0)));
            let places = places.filter(|place| place.xy().norm() <= own.radius);
            let found = places.filter_map(|place| {
                let joints = controller.inverse(&place).ok()?;
                let there = self.after.robot.forward(&joints).ok()?;
                Some([place.x, place.y, frame.transform().apply(&there).z])
            });
            let mut found: Vec<_> = found.collect();
            let count = u32::try_from(found.len()).map_or(1.0, f64::from);
            let mean = found.iter().map(|[_, _, z]| z).sum::<f64>() / count;
            for [_, _, z] in &mut found {
                *z -= mean;
            }
            found
        };
        Some(Bed {
            radius: own.radius,
            before: nodes(&self.before.robot, &own.level),
            after: own
                .controller
                .map(|(controller, frame)| nodes(&controller, &frame)),
        })
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
