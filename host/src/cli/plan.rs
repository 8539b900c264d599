//! `delta-cal plan`.

use super::failure::Failure;
use super::import::{configuration, includes};
use super::output::{self, Progress, with_content};
use super::paths::{ColumnsArgument, given, is_stream, read, robot_path, without_table};
use crate::files::length::length;
use crate::fit::datum::Datum;
use crate::import::{Firmware, Stated};
use crate::planning::{
    Determined, Kind, LEAST, MOST, Order, PlanError, PlanRequest, Region, Wishes, labelled, others,
    plan,
};
use crate::printer::touches_of_bed;
use crate::report::plan as report;
use crate::{Frame, InputError, InputText, Planned, Refused, RobotFile, read_joints};
use clap::{ArgGroup, ArgMatches, Args};
use std::path::{Path, PathBuf};

const MOST_REPEATS: usize = 100;

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("what").args(["count", "limit", "samples"]).required(true).multiple(true))]
#[command(
    override_usage = "delta-cal plan [OPTIONS] --count <N> <ROBOT.toml>\n       delta-cal plan [OPTIONS] --limit <LENGTH> <ROBOT.toml>\n       delta-cal plan [OPTIONS] --samples <SAMPLES.csv> <ROBOT.toml>"
)]
pub(crate) struct PlanArguments {
    /// The robot as known before the measurement
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// The number of measurements, 4 to 500; with --samples the number to add
    #[arg(long, value_name = "N", value_parser = whole_number, allow_negative_numbers = true)]
    count: Option<usize>,
    /// Plan the fewest measurements that bring the expected error down to this
    #[arg(long, alias = "accuracy", value_name = "LENGTH", value_parser = length, allow_hyphen_values = true, conflicts_with_all = ["count", "samples"])]
    limit: Option<f64>,
    /// Say what the rows of this file determine, and which to add
    #[arg(long, value_name = "SAMPLES.csv", conflicts_with = "measure")]
    samples: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// xyz or some of its letters, plane (heights), distance (between poses), point (from fixed points);
    /// several with commas, distance=8 for eight at most [default: xyz]
    #[arg(long, value_name = "KINDS")]
    measure: Option<Wishes>,
    /// The frame of x, y and z: base, or sensor, which is estimated too [default: base]
    #[arg(long, value_enum, hide_possible_values = true)]
    frame: Option<Frame>,
    /// Only poses within this box or cylinder
    #[arg(long, value_name = "BOX|CYLINDER")]
    within: Option<Region>,
    /// Minimise the absolute error, not the relative one
    #[arg(long)]
    absolute: bool,
    /// random, or shortest: the shortest path of the joints [default: random]
    #[arg(
        long,
        value_enum,
        hide_possible_values = true,
        conflicts_with = "samples"
    )]
    order: Option<Order>,
    /// Write the measurements to this file; - is standard output
    #[arg(long, value_name = "POSES.csv")]
    output: Option<PathBuf>,
    /// Write the result, or the refusal in its place, as JSON; - is standard output
    #[arg(long, value_name = "PLAN.json")]
    json: Option<PathBuf>,
    /// Plan poses to validate with, at random, other than those of this file
    #[arg(long, value_name = "SAMPLES.csv", requires = "count", conflicts_with_all = ["limit", "samples", "measure"])]
    validation: Option<PathBuf>,
    /// Another seed gives other poses
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Name the points, such as P01 with P
    #[arg(long, value_name = "PREFIX")]
    names: Option<String>,
    /// Repeat all poses so many times, for pose repeatability (ISO 9283)
    #[arg(long, value_name = "N", value_parser = repetitions, allow_negative_numbers = true)]
    repeats: Option<usize>,
    /// Replace POSES.csv even if it holds measurements
    #[arg(long)]
    force: bool,
}

fn whole_number(text: &str) -> Result<usize, String> {
    text.parse()
        .map_err(|_| format!("a whole number is needed, {LEAST} to {MOST}"))
}

fn repetitions(text: &str) -> Result<usize, String> {
    let number = text.parse().ok();
    number
        .filter(|own| (2..=MOST_REPEATS).contains(own))
        .ok_or_else(|| format!("a whole number is needed, 2 to {MOST_REPEATS}"))
}

pub(crate) fn run(arguments: &PlanArguments, matches: &ArgMatches) -> Result<(), Failure> {
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    let text = configuration(&arguments.robot)?;
    if !text.is_robot() && Firmware::wrote(&text).is_some() {
        return printer(arguments, matches, &text);
    }
    let robot = RobotFile::read(&text)?;
    keep(arguments, |text| {
        Planned::read(text, &robot).is_ok_and(|plan| plan.is_unmeasured())
    })?;
    if arguments.samples.is_none() && arguments.validation.is_none() {
        without_table(matches, "delta-cal plan robot.toml --samples samples.csv")?;
    }
    let measure = arguments.measure.clone();
    let request = PlanRequest {
        accuracy: arguments.limit,
        frame: arguments.frame.unwrap_or_default(),
        region: arguments.within,
        absolute: arguments.absolute,
        order: arguments.order.unwrap_or_default(),
        seed: arguments.seed,
        ..PlanRequest::new(
            &robot,
            measure.unwrap_or(Wishes::only(Kind::XYZ)),
            arguments.count.unwrap_or(LEAST),
        )
    };
    Datum::of(&robot, request.frame)?;
    if let Some(path) = &arguments.samples {
        return samples(arguments, &request, path);
    }
    let named = |rows| {
        let repeats = arguments.repeats.unwrap_or(1);
        labelled(rows, arguments.names.as_deref(), repeats)
    };
    if let Some(path) = &arguments.validation {
        let measured = read_joints(&read(path, &arguments.columns)?, &robot)?;
        let used: Vec<_> = measured.iter().map(|row| row.value).collect();
        let found = others(&request, &used).map_err(|error| failure(&robot, error, json))?;
        let rows = named(found);
        let csv = report::csv(&rows, &robot.convention);
        let text = report::others(request.count, &robot.name, &path.display().to_string());
        let text = with_content(text, &csv, output);
        let json_text = crate::report::json(&rows);
        return output::deliver(&[(output, &csv), (json, &json_text)], text);
    }
    let waiting = Progress::spinner("planning");
    let planned = plan(&request);
    drop(waiting);
    let mut planned = planned.map_err(|error| failure(&robot, error, json))?;
    planned.measurements = named(planned.measurements);
    let csv = report::csv(&planned.measurements, &robot.convention);
    let text = with_content(report::text(&planned), &csv, output);
    output::deliver(&[(output, &csv), (json, &report::json(&planned))], text)
}

/// Writes the commands that touch a printer's bed.
fn printer(
    arguments: &PlanArguments,
    matches: &ArgMatches,
    text: &InputText,
) -> Result<(), Failure> {
    let others = "limit samples columns rows measure frame within absolute order json validation seed names repeats";
    let others: Vec<_> = others.split(' ').collect();
    if let Some(option) = given(matches, &others) {
        return Err(Failure::usage(
            format!("--{option} does not apply to a printer's configuration"),
            "leave it out, or plan for the robot file that delta-cal import writes",
        ));
    }
    let Some(count) = arguments
        .count
        .filter(|count| (LEAST..=MOST).contains(count))
    else {
        return Err(Failure::usage(
            format!("touches of a printer's bed are planned with --count, {LEAST} to {MOST}"),
            "write for example delta-cal plan printer.cfg --count 16 --output touches.gcode",
        ));
    };
    let firmware = Firmware::of(text)?;
    let imported = firmware.import(text, &Stated::default(), &includes)?;
    let (radius, places) = touches_of_bed(&imported, count);
    let commands = imported.touches(&places)?;
    let said = format!(
        "{} touches of the bed within {:.0} mm of the centre, in machine coordinates.\nRun the commands, save the \
         console output, and run delta-cal calibrate {} console.txt\n",
        places.len(),
        radius,
        text.name()
    );
    keep(arguments, |text| {
        // Only commands, as they are written here.
        let mut lines = text.text().lines();
        lines.all(|line| line.starts_with(['G', ';']) || line == "PROBE")
    })?;
    let output = arguments.output.as_deref();
    let said = with_content(said, &commands, output);
    output::deliver(&[(output, &commands)], said)
}

/// Users fill measurements into files of planned poses: refuses to overwrite what is not an unmeasured plan.
fn keep(arguments: &PlanArguments, is_plan: impl Fn(&InputText) -> bool) -> Result<(), Failure> {
    let path = arguments.output.as_deref();
    let Some(path) = path.filter(|own| !(arguments.force || is_stream(own)) && own.is_file())
    else {
        return Ok(());
    };
    let replaceable = |text: InputText| text.text().trim().is_empty() || is_plan(&text);
    if InputText::from_file(path).is_ok_and(replaceable) {
        return Ok(());
    }
    Err(Failure::usage(
        format!(
            "--output {} exists and holds measurements, or is no plan",
            path.display()
        ),
        "give the output another name, or --force to replace the file",
    ))
}

/// Shows what the rows of a file determine, and which to add: four, if no number is requested.
fn samples(
    arguments: &PlanArguments,
    request: &PlanRequest<'_>,
    path: &Path,
) -> Result<(), Failure> {
    let text = read(path, &arguments.columns)?;
    let file = Planned::read(&text, request.robot)?;
    let (output, to) = (arguments.output.as_deref(), arguments.json.as_deref());
    let waiting = Progress::spinner("looking for measurements to add");
    let determined = Determined::by(request, &file.readings, &file.unmeasured);
    drop(waiting);
    let determined = determined.map_err(|error| failure(request.robot, error, to))?;
    let csv = report::csv(&determined.next, &request.robot.convention);
    let json = report::samples_json(&determined);
    let text = report::samples_text(&determined);
    output::deliver(&[(output, &csv), (to, &json)], text)?;
    if determined.worthwhile {
        return Ok(());
    }
    Err(Failure::refused(
        "a calibration from these rows is not expected to halve the position error",
        "take the proposed measurements as well, or state a [tolerance]",
    ))
}

/// The failure for each cause, with its exit code.
fn failure(robot: &RobotFile, error: PlanError, json: Option<&Path>) -> Failure {
    let remedy = error.remedy();
    match error {
        PlanError::NoPose => Failure::from(
            InputError::new(&robot.name, error.to_string())
                .at_key("[joints]")
                .with_remedy(remedy),
        ),
        PlanError::Singular | PlanError::NotDetermined { .. } => {
            output::refused(json, Refused::new(error.to_string(), remedy).into())
        }
        _ => Failure::usage(error.to_string(), remedy),
    }
}
