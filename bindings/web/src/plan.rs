//! `delta-cal plan`.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::{self, Machine};
use delta_cal_host::export::positions::Wanted;
use delta_cal_host::import::Imported;
use delta_cal_host::planning::{LEAST, MOST, Order, PlanRequest, Region, Wishes, plan, plan_for};
use delta_cal_host::printer::touches_of_bed;
use delta_cal_host::report::plan as report;
use delta_cal_host::{Frame, RobotFile};
use serde::{Deserialize, Serialize};

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Request {
    /// As `--measure`.
    measure: String,
    count: Option<usize>,
    /// The expected error that is asked for in place of a count, mm.
    accuracy: Option<f64>,
    /// As `--within`.
    within: Option<String>,
    absolute: bool,
    shortest: bool,
}

#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum Planned {
    Poses(Poses),
    Touches(Touches),
}

#[derive(Debug, Serialize)]
pub(crate) struct Poses {
    text: String,
    csv: String,
    json: String,
    /// Places all over the workspace, mm.
    workspace: Vec<[f64; 3]>,
}

/// Of a printer's bed.
#[derive(Debug, Serialize)]
pub(crate) struct Touches {
    /// The commands for its console.
    gcode: String,
    /// x and y of the nozzle, mm.
    places: Vec<[f64; 2]>,
    /// Of the bed, mm.
    radius: f64,
}

/// `of`: the robot and the frame.
pub(crate) fn run(
    files: &Folder,
    of: &inputs::Request,
    request: &Request,
) -> Result<Planned, Fault> {
    match of.machine(files)? {
        Machine::Printer(imported) => touches(&imported, request).map(Planned::Touches),
        Machine::Robot(robot) => poses(&robot, of.frame(), request).map(Planned::Poses),
    }
}

fn touches(imported: &Imported, request: &Request) -> Result<Touches, Fault> {
    let count = request.count.filter(|own| (LEAST..=MOST).contains(own));
    let count = count.ok_or_else(|| {
        Fault::new(
            "the number of touches is missing or out of range",
            format!("write {LEAST} to {MOST}"),
        )
    })?;
    let (radius, places) = touches_of_bed(imported, count);
    Ok(Touches {
        gcode: imported.touches(&places)?,
        places,
        radius,
    })
}

fn poses(robot: &RobotFile, frame: Frame, request: &Request) -> Result<Poses, Fault> {
    let kinds: Wishes = request.measure.parse().map_err(Fault::of_request)?;
    let within = request.within.as_deref();
    let within = within.map(str::parse::<Region>).transpose();
    let within = within.map_err(Fault::of_request)?;
    if frame == Frame::Sensor && !kinds.positions() {
        return Err(Fault::new(
            "the sensor frame is for coordinates, and none are measured",
            "choose the robot's frame, or measure coordinates too",
        ));
    }
    let wanted = PlanRequest {
        frame,
        region: within,
        absolute: request.absolute,
        order: if request.shortest {
            Order::Shortest
        } else {
            Order::Random
        },
        ..PlanRequest::new(robot, kinds, request.count.unwrap_or(LEAST))
    };
    let planned = match request.accuracy {
        Some(accuracy) => plan_for(&wanted, accuracy),
        None => plan(&wanted),
    };
    let planned = planned.map_err(|error| Fault::refused(error.to_string(), error.remedy()))?;
    let workspace = Wanted::in_workspace(robot).evaluated;
    let places = workspace
        .iter()
        .map(|at| robot.convention.vector(at).into());
    Ok(Poses {
        text: report::text(&planned),
        csv: report::csv(&planned.measurements, &robot.convention),
        json: report::json(&planned),
        workspace: places.collect(),
    })
}
