//! What the commands do.

use super::connect::{Device, Task, with_device};
use super::{
    ApplyArguments, CalibrateArguments, DeviceArguments, DeviceCommand, ParametersArguments,
    RevertArguments, StatusArguments,
};
use crate::cli::failure::Failure;
use crate::cli::outputs::{self, deliver};
use crate::cli::paths::{is_stream, read};
use crate::device::report::{self, Report, hexadecimal, origin};
use crate::device::{
    self, DeviceError, Number, adopt, check_calibrated, check_nominal, difference, in_use,
    robot as robot_of,
};
use crate::files::example;
use crate::text::small;
use crate::{
    CalibrateError, InputError, InputText, InstrumentFacts, Options, Readings, RobotFile,
    calibrate, read_samples,
};
use delta_cal::kinematics::{JointLimits, JointLimitsError};
use delta_cal::robot::Drive;
use delta_cal_protocol::{ParameterSet, Parameters, RevertTo};
use indicatif::{ProgressBar, ProgressDrawTarget};
use serde::Serialize;
use std::fmt::Display;
use std::path::Path;

pub(crate) fn run(arguments: &DeviceArguments) -> Result<(), Failure> {
    let link = &arguments.link;
    match &arguments.command {
        DeviceCommand::Calibrate(arguments) => {
            let robot = ("the robot file", arguments.robot.as_deref());
            let samples = ("the samples file", arguments.samples.as_deref());
            let json = ("--json", arguments.json.as_deref());
            outputs::check(&[robot, samples], &[json])?;
            let (robot, samples) = inputs(arguments)?;
            let task = Calibrate {
                arguments,
                robot,
                samples,
            };
            with_device(link, task)
        }
        DeviceCommand::Apply(arguments) => {
            let file = ("the robot file", Some(arguments.robot.as_path()));
            outputs::check(&[file], &[("--json", arguments.json.as_deref())])?;
            let robot = rotary(&arguments.robot)?;
            with_device(link, Apply { arguments, robot })
        }
        DeviceCommand::Status(arguments) => with_device(link, Status(arguments)),
        DeviceCommand::Parameters(arguments) => {
            let file = ("the robot file", arguments.robot.as_deref());
            let output = ("--output", arguments.output.as_deref());
            outputs::check(&[file], &[output, ("--json", arguments.json.as_deref())])?;
            let template = arguments.robot.as_deref().map(rotary).transpose()?;
            let task = ReadParameters {
                arguments,
                template,
            };
            with_device(link, task)
        }
        DeviceCommand::Revert(arguments) => with_device(link, Revert(arguments)),
    }
}

/// The two files, or the built-in example.
fn inputs(arguments: &CalibrateArguments) -> Result<(RobotFile, Readings), CalibrateError> {
    let (Some(robot), Some(samples)) = (&arguments.robot, &arguments.samples) else {
        return Ok(example::load()?);
    };
    let robot = rotary(robot)?;
    if robot.transmission.is_some() {
        let cause = "a controller cannot estimate transmissions";
        let error = InputError::new(&robot.name, cause).at_key("[tolerance] transmission_deg");
        return Err(error.with_remedy(ELSEWHERE).into());
    }
    let text = read(samples, &arguments.columns)?;
    let readings = read_samples(&text, &robot, &Options::default())?;
    if readings.is_complete() {
        return Ok((robot, readings));
    }
    let cause = "a controller calibrates from complete positions, x, y and z in each row";
    let error = InputError::new(&readings.name, cause);
    Err(error.with_remedy(ELSEWHERE).into())
}

const ELSEWHERE: &str = "calibrate with delta-cal calibrate --output calibrated.toml, and send the result with \
                         delta-cal device apply calibrated.toml";

/// A robot file. The protocol carries robots with rotary drives alone.
fn rotary(path: &Path) -> Result<RobotFile, InputError> {
    let robot = RobotFile::read(&InputText::from_file(path)?)?;
    if robot.robot.drive() == Drive::Rotary {
        return Ok(robot);
    }
    let cause = "the protocol has no robots with linear drives";
    let remedy = "calibrate it with delta-cal calibrate, and export the result";
    Err(InputError::new(&robot.name, cause).with_remedy(remedy))
}

/// Writes the files and the JSON report, and prints the report unless something else goes to standard output.
fn publish<C: Serialize + Display>(
    device: &Device,
    contents: C,
    json: Option<&Path>,
    files: &[(Option<&Path>, &str)],
) -> Result<(), Failure> {
    let report = Report::new(&device.port, &device.identity, contents);
    let text = report
        .json()
        .map_err(|error| Failure::Output(error.to_string()))?;
    let mut outputs = files.to_vec();
    outputs.push((json, &text));
    deliver(&outputs, report.text())
}

struct Calibrate<'a> {
    arguments: &'a CalibrateArguments,
    robot: RobotFile,
    samples: Readings,
}

impl Task for Calibrate<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let Self {
            arguments,
            robot,
            samples,
        } = self;
        let client = &mut device.client;
        let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
        check_nominal(&robot, &nominal.geometry)?;
        let options = Options {
            method: Some(arguments.method.here()),
            ..Options::default()
        };
        let here = calibrate(&robot, &samples, &options)?;
        let begin = device::begin::<T>(&robot, arguments.method.on_the_controller());
        let rows = device::samples::<T>(&samples);
        let bar =
            ProgressBar::with_draw_target(Some(rows.len() as u64), ProgressDrawTarget::stderr());
        let mut progress = |taken| bar.set_position(taken as u64);
        let finished = device::calibrate(client, &begin, &rows, &mut progress);
        bar.finish_and_clear();
        let finished = finished?;
        let geometry = match (&finished.result, finished.geometry()) {
            (_, Some(geometry)) => geometry,
            (Err(refusal), _) => {
                return Err(Failure::NotDetermined {
                    cause: format!("the controller refuses the calibration: {refusal}"),
                    remedy: "this computer accepts the same samples: send its result with delta-cal device apply"
                        .to_owned(),
                });
            }
            (Ok(_), None) => return Err(DeviceError::Unexpected.into()),
        };
        let joints = samples.rows.iter().map(|row| row.value.joints);
        let differs = difference(&robot_of(&geometry)?, &here.after.robot, joints);
        if !(differs <= tolerated(&here)) {
            return Err(Failure::Device {
                cause: format!(
                    "the controller's positions differ by {} mm rms from this computer's",
                    small(differs)
                ),
                remedy: "use the firmware that belongs to this delta-cal; nothing was applied"
                    .to_owned(),
            });
        }
        if arguments.apply {
            device::apply(client, &begin, &rows, &finished)?;
        }
        let calibration = report::Calibration::new(
            serde_json::to_value(&here).unwrap_or_default(),
            here.to_text(),
            differs,
            &finished,
            arguments.apply,
            client.repetitions(),
        );
        publish(device, calibration, arguments.json.as_deref(), &[])
    }
}

/// By how much a controller's result may differ: by its rounding in single precision, and by far less than the samples scatter.
fn tolerated(here: &crate::Report) -> f64 {
    let residuals = here.position_error_mm.map_or(0.0, |error| error.after.rms);
    let [arm, ..] = here.after.robot.arms();
    residuals.max(1e-5 * arm.lb())
}

struct Apply<'a> {
    arguments: &'a ApplyArguments,
    robot: RobotFile,
}

impl Task for Apply<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let client = &mut device.client;
        let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
        let moved = check_calibrated(&self.robot, &robot_of(&nominal.geometry)?)?;
        let before = client.parameters::<T>(ParameterSet::Current)?;
        let after = adopt::<T, _>(client, &self.robot.robot, before.generation)?;
        let changed = report::Parameters::changed(&before, &after).note(format!(
            "Applied: the control loop uses {}, {} mm rms from the nominal robot.",
            self.robot.name,
            small(moved)
        ));
        publish(device, changed, self.arguments.json.as_deref(), &[])
    }
}

struct Status<'a>(&'a StatusArguments);

impl Task for Status<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let client = &mut device.client;
        let status = client.status::<T>()?;
        let parameters = client.parameters(ParameterSet::Current)?;
        let counters = client.counters::<T>()?;
        let status = report::Status::new(&status, &parameters, &counters);
        publish(device, status, self.0.json.as_deref(), &[])
    }
}

struct ReadParameters<'a> {
    arguments: &'a ParametersArguments,
    /// Where everything but the geometry comes from.
    template: Option<RobotFile>,
}

impl Task for ReadParameters<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let arguments = self.arguments;
        let (set, name) = if arguments.nominal {
            (ParameterSet::Nominal, "nominal")
        } else {
            (ParameterSet::Current, "current")
        };
        let parameters = device.client.parameters::<T>(set)?;
        let toml = robot_file(self.template, name, &parameters, device)?;
        let json = arguments.json.as_deref();
        let output = match arguments.output.as_deref() {
            // The robot file is the report.
            None if !json.is_some_and(is_stream) => Some(Path::new("-")),
            output => output,
        };
        let contents = report::Parameters::new(name, &parameters);
        publish(device, contents, json, &[(output, &toml)])
    }
}

/// The geometry as a robot file.
fn robot_file<T: Number>(
    template: Option<RobotFile>,
    set: &str,
    parameters: &Parameters<T>,
    device: &Device,
) -> Result<String, Failure> {
    let mut comment = format!(
        "The {set} geometry of the controller on {}, {}, fingerprint {}.",
        device.port,
        origin(parameters.origin),
        hexadecimal(parameters.geometry.fingerprint())
    );
    let robot = robot_of(&parameters.geometry)?;
    let file = if let Some(template) = template {
        RobotFile {
            robot,
            sensor_frame: None,
            transmission: None,
            instruments: InstrumentFacts::default(),
            record: template.record.of_the_robot(),
            ..template
        }
    } else {
        comment.push_str(
            "\nThe controller does not know [joints]: correct the range below. State [tolerance] \
             and [noise] if you can.",
        );
        let limits = any_limits().map_err(|_| DeviceError::ImpossibleGeometry)?;
        RobotFile::of("", robot, limits)
    };
    Ok(file.to_toml(&comment))
}

/// A range for every Delta, until somebody states the right one.
fn any_limits() -> Result<JointLimits<f64>, JointLimitsError> {
    JointLimits::new(-90_f64.to_radians(), 90_f64.to_radians())
}

struct Revert<'a>(&'a RevertArguments);

impl Task for Revert<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let client = &mut device.client;
        let before = client.parameters::<T>(ParameterSet::Current)?;
        let to = if self.0.nominal {
            RevertTo::Nominal
        } else {
            RevertTo::Previous
        };
        let after = client.revert::<T>(before.generation, to)?;
        let after = in_use::<T, _>(client, after.geometry.fingerprint())?;
        let changed = report::Parameters::changed(&before, &after);
        publish(device, changed, self.0.json.as_deref(), &[])
    }
}
