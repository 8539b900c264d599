//! What the page draws: the arms of a robot and the bed of a printer, before and after.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs;
use delta_cal::Robot;
use delta_cal_host::printer::{ACROSS, Off, Printer};
use delta_cal_host::text::joint::inwards;
use serde::{Deserialize, Serialize};
use tsify::Tsify;

/// A robot file with a calibration, and joints in the file's unit.
#[derive(Debug, Default, Deserialize, Tsify)]
#[serde(default)]
#[tsify(rename = "SkeletonRequest")]
pub(crate) struct Request {
    after: String,
    joints: [f64; 3],
}

/// Three arms: shoulder and elbow of each, and the platform; mm.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Arms {
    shoulders: [[f64; 3]; 3],
    elbows: [[f64; 3]; 3],
    platform: [f64; 3],
}

/// The same robot as its file says and as it was found, if both reach these joints.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Skeleton {
    before: Option<Arms>,
    after: Option<Arms>,
}

/// `before`: the robot as its file has it.
pub(crate) fn skeleton(
    files: &Folder,
    before: &inputs::Request,
    request: &Request,
) -> Result<Skeleton, Fault> {
    let machine = before.machine(files)?;
    let before = machine.robot();
    let after = files.robot(&request.after)?;
    let drive = before.robot.drive();
    let joints = request.joints.map(|own| inwards(drive, own));
    Ok(Skeleton {
        before: arms(&before.robot, joints),
        after: arms(&after.robot, joints),
    })
}

fn arms(robot: &Robot<f64>, joints: [f64; 3]) -> Option<Arms> {
    let platform = robot.forward(&joints).ok()?;
    let arms = robot.arms();
    Some(Arms {
        shoulders: arms.each_ref().map(|arm| arm.d().into()),
        elbows: std::array::from_fn(|arm| arms[arm].elbow(joints[arm]).into()),
        platform: platform.into(),
    })
}

/// Where the nozzle is when its controller believes that it touches the bed: x, y and the height about its mean at places so
/// far apart, mm.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Bed {
    radius: f64,
    step: f64,
    before: Vec<[f64; 3]>,
    after: Option<Vec<[f64; 3]>>,
}

impl Bed {
    /// `None` where no height was measured.
    pub(crate) fn of(printer: &Printer) -> Option<Self> {
        let heights = |off: &Off| -> Vec<[f64; 3]> {
            let places = off.map.iter();
            places.map(|([x, y], off)| [*x, *y, off.z]).collect()
        };
        let before = heights(printer.before.as_ref()?);
        let pasted = printer.after.as_ref().filter(|_| printer.lines.is_some());
        (!before.is_empty()).then(|| Self {
            radius: printer.bed_radius_mm,
            step: 2.0 * printer.bed_radius_mm / f64::from(ACROSS),
            before,
            after: pasted.map(heights),
        })
    }
}
