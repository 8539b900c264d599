//! `delta-cal export`.

use crate::calibrate::calibrated;
use crate::fault::Fault;
use crate::folder::Folder;
use crate::inputs;
use delta_cal::robot::Drive;
use delta_cal_host::export::positions::{Wanted, bed};
use delta_cal_host::export::{Case, Settings, target, targets as all_targets};
use delta_cal_host::files::kinematics;
use delta_cal_host::printer::as_printed;
use delta_cal_host::text::joint::inwards;
use delta_cal_host::{Options, RobotFile, read_samples};
use serde::{Deserialize, Serialize};
use tsify::Tsify;

#[derive(Debug, Default, Deserialize, Tsify)]
#[serde(default)]
#[tsify(rename = "ExportRequest")]
pub(crate) struct Request {
    /// The calibrated robot.
    robot: String,
    /// The calibration that it comes from: a printer's bed and end stops are then as in its own lines.
    #[tsify(type = "Request | null")]
    calibrated_from: Option<inputs::Request>,
    target: String,
    nominal: Option<String>,
    positions: Option<String>,
    /// With towers: the samples file with heights of the bed.
    bed: Option<String>,
    /// One joint at the end stops, or three: degrees, or mm of travel.
    home: Vec<f64>,
    height: Option<f64>,
    platform_radius: Option<f64>,
    inches: bool,
    limit: Option<f64>,
}

#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Exported {
    /// The lines with the summary as their comment.
    text: String,
    summary: String,
    json: String,
}

#[derive(Debug, Serialize, Tsify)]
pub(crate) struct Named {
    name: &'static str,
    title: &'static str,
}

/// Those that take a robot.
pub(crate) fn targets(files: &Folder, request: &Request) -> Result<Vec<Named>, Fault> {
    let drive = files.robot(&request.robot)?.robot.drive();
    let taking = all_targets().iter();
    let taking = taking.filter(|own| own.drive.is_none_or(|own| own == drive));
    let named = taking.map(|own| Named {
        name: &own.name,
        title: &own.title,
    });
    Ok(named.collect())
}

/// Where the printer that was calibrated prints, if it is one.
fn printed(
    files: &Folder,
    request: &Request,
    robot: &RobotFile,
) -> Result<Option<(Wanted, Settings)>, Fault> {
    let Some(from) = &request.calibrated_from else {
        return Ok(None);
    };
    let (inputs, report) = calibrated(files, from)?;
    let printer = inputs.printer.as_ref();
    Ok(printer.map(|own| as_printed(own, robot, &report.solution)))
}

pub(crate) fn run(files: &Folder, request: &Request) -> Result<Exported, Fault> {
    let robot = files.robot(&request.robot)?;
    let drive = robot.robot.drive();
    let nominal = request.nominal.as_deref();
    let nominal = nominal.map(|name| files.robot(name)).transpose()?;
    let home = match request.home.as_slice() {
        [] => None,
        [all] => Some([*all; 3]),
        all => Some(all.try_into().map_err(|_| {
            let remedy = "write one number, or three with semicolons";
            Fault::new("end stops need one joint, or three", remedy)
        })?),
    };
    let level = match request.bed.as_deref() {
        Some(name) if drive == Drive::Linear => {
            let samples = read_samples(&files.table(name)?, &robot, &Options::default())?;
            Some(bed(&robot.robot, &samples)?)
        }
        _ => None,
    };
    let wanted = match request.positions.as_deref() {
        Some(name) => {
            let poses = kinematics::inverse(&robot, &robot.platform_point(), &files.table(name)?)?;
            Wanted::of(name, poses.into_iter().map(|pose| pose.position).collect())
        }
        None => Wanted::in_workspace(&robot),
    };
    let (wanted, settings) = match printed(files, request, &robot)? {
        Some((printed, settings)) if request.positions.is_none() => (printed, settings),
        Some((_, settings)) => (wanted, settings),
        None => (wanted, Settings::default()),
    };
    let settings = Settings {
        height: request.height.or(settings.height),
        home: home
            .map(|own: [f64; 3]| own.map(|joint| inwards(drive, joint)))
            .or(settings.home),
        platform_radius: request.platform_radius,
        inches: request.inches,
        limit: request.limit,
        level: level.or(settings.level),
        ..settings
    };
    let case = Case {
        robot: &robot,
        nominal: nominal.as_ref(),
        wanted: &wanted,
        settings,
    };
    let export = target(&request.target, drive).and_then(|own| case.export(own));
    let export = export.map_err(|error| Fault::new(error.to_string(), error.remedy()))?;
    Ok(Exported {
        text: export.to_text(),
        summary: export.summary(),
        json: export.to_json(),
    })
}
