//! `delta-cal plan`.

use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs::{self, Machine};
use delta_cal_host::export::positions::Wanted;
use delta_cal_host::import::Imported;
use delta_cal_host::planning::{
    LEAST, MOST, Order, PlanError, PlanRequest, Precision, Region, Wishes, labelled, others, plan,
};
use delta_cal_host::printer::touches_of_bed;
use delta_cal_host::report::{json, plan as report};
use delta_cal_host::{RobotFile, read_joints};
use serde::{Deserialize, Serialize};
use tsify::Tsify;

#[derive(Debug, Default, Deserialize, Tsify)]
#[serde(default)]
#[tsify(rename = "PlanRequest")]
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
    /// As `--seed`; 1 if not stated.
    seed: Option<u64>,
    /// As `--names`.
    names: Option<String>,
}

#[derive(Debug, Serialize, Tsify)]
#[serde(untagged)]
pub(crate) enum Planned {
    Poses(Poses),
    Touches(Touches),
}

#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Poses {
    text: String,
    csv: String,
    json: String,
    /// What is measured, mm.
    places: Vec<[f64; 3]>,
    /// Expected error before any measurement, if a tolerance is stated, and after these, mm; neither of poses to validate with.
    before: Option<f64>,
    after: Option<f64>,
    /// Places all over the workspace, mm.
    workspace: Vec<[f64; 3]>,
}

/// Of a printer's bed.
#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Touches {
    /// The commands for its console.
    gcode: String,
    /// x and y of the nozzle, mm.
    places: Vec<[f64; 2]>,
    /// Of the bed, mm.
    radius: f64,
}

/// `of`: the robot, the frame, and the samples of a calibration that the poses are to validate.
pub(crate) fn run(
    files: &Folder,
    of: &inputs::Request,
    request: &Request,
) -> Result<Planned, Fault> {
    match of.machine(files)? {
        Machine::Printer(imported) => touches(&imported, request).map(Planned::Touches),
        Machine::Robot(robot) => poses(files, &robot, of, request).map(Planned::Poses),
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

fn poses(
    files: &Folder,
    robot: &RobotFile,
    of: &inputs::Request,
    request: &Request,
) -> Result<Poses, Fault> {
    let kinds: Wishes = request.measure.parse().map_err(Fault::of_request)?;
    let within = request.within.as_deref();
    let within = within.map(str::parse::<Region>).transpose();
    let within = within.map_err(Fault::of_request)?;
    let wanted = PlanRequest {
        accuracy: request.accuracy,
        frame: of.frame(),
        region: within,
        absolute: request.absolute,
        order: if request.shortest {
            Order::Shortest
        } else {
            Order::Random
        },
        seed: request.seed.unwrap_or(1),
        ..PlanRequest::new(robot, kinds, request.count.unwrap_or(LEAST))
    };
    let impossible = |error: PlanError| Fault::refused(error.to_string(), error.remedy());
    let named = |rows| labelled(rows, request.names.as_deref(), 1);
    let expected = |own: &Precision| own.of(request.absolute);
    let (rows, text, rows_json, before, after) = if let Some(used) = of.samples(files)? {
        let joints = read_joints(&used, robot)?.into_iter().map(|row| row.value);
        let rows = named(others(&wanted, &joints.collect::<Vec<_>>()).map_err(impossible)?);
        let text = report::others(wanted.count, &robot.name, used.name());
        let rows_json = json(&rows);
        (rows, text, rows_json, None, None)
    } else {
        let mut planned = plan(&wanted).map_err(impossible)?;
        planned.measurements = named(planned.measurements);
        let before = planned.before.as_ref().map(expected);
        let (text, plan_json) = (report::text(&planned), report::json(&planned));
        let after = expected(&planned.after);
        (planned.measurements, text, plan_json, before, Some(after))
    };
    let workspace = Wanted::in_workspace(robot).evaluated;
    let workspace = workspace
        .iter()
        .map(|at| robot.convention.vector(at).into());
    Ok(Poses {
        places: rows.iter().map(|own| own.position_mm).collect(),
        before,
        after,
        text,
        csv: report::csv(&rows, &robot.convention),
        json: rows_json,
        workspace: workspace.collect(),
    })
}
