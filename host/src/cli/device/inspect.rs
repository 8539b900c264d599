use super::args::{LinkArguments, ParametersArguments, RevertArguments, StatusArguments};
use super::connect::{Device, Task, with_device};
use super::files::{publish, refuse_linear};
use crate::cli::failure::Failure;
use crate::cli::outputs;
use crate::cli::paths::is_stream;
use crate::device::report::{json, text};
use crate::device::{DeviceError, Number, in_use, robot as robot_of};
use crate::{InputText, InstrumentFacts, Record, RobotFile};
use delta_cal::kinematics::{JointLimits, JointLimitsError};
use delta_cal_protocol::{ParameterSet, Parameters, RevertTo};
use std::path::Path;

pub(super) fn status(link: &LinkArguments, arguments: &StatusArguments) -> Result<(), Failure> {
    with_device(link, Status(arguments))
}

struct Status<'a>(&'a StatusArguments);

impl Task for Status<'_> {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure> {
        let client = &mut device.client;
        let status = client.status::<T>()?;
        let parameters = client.parameters(ParameterSet::Current)?;
        let counters = client.counters::<T>()?;
        let port = device.port.to_string();
        let mut shown = text::identity(&port, &device.identity);
        shown.push_str(&text::status(&status, &parameters, &counters, device.pace));
        let json = json::status(&status, &parameters, &counters, device.pace);
        let json = json::of_device(&port, &device.identity, json);
        publish(&[], self.0.json.as_deref(), &json, shown)
    }
}

pub(super) fn parameters(
    link: &LinkArguments,
    arguments: &ParametersArguments,
) -> Result<(), Failure> {
    let robot = ("the robot file", arguments.robot.as_deref());
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    outputs::check(&[robot], &[("--output", output), ("--json", json)])?;
    let template = match &arguments.robot {
        Some(path) => {
            let robot = RobotFile::read(&InputText::from_file(path)?)?;
            refuse_linear(&robot)?;
            Some(robot)
        }
        None => None,
    };
    with_device(
        link,
        ReadParameters {
            arguments,
            template,
        },
    )
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
        let port = device.port.to_string();
        let json = json::geometry(name, &parameters);
        let json = json::of_device(&port, &device.identity, json);
        let json_path = arguments.json.as_deref();
        let output = match arguments.output.as_deref() {
            // The robot file is the report.
            None if !json_path.is_some_and(is_stream) => Some(Path::new("-")),
            output => output,
        };
        publish(&[(output, &toml)], json_path, &json, String::new())
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
        text::origin_in_words(parameters.origin),
        json::hexadecimal(parameters.geometry.fingerprint())
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
        RobotFile {
            name: String::new(),
            robot,
            limits: any_limits().map_err(|_| DeviceError::ImpossibleGeometry)?,
            forearm_limit: None,
            tolerance: None,
            noise: None,
            sensor_frame: None,
            transmission: None,
            instruments: InstrumentFacts::default(),
            record: Record::default(),
        }
    };
    Ok(file.to_toml(&comment))
}

/// A range for every Delta, until somebody states the right one.
fn any_limits() -> Result<JointLimits<f64>, JointLimitsError> {
    JointLimits::new(-90_f64.to_radians(), 90_f64.to_radians())
}

pub(super) fn revert(link: &LinkArguments, arguments: &RevertArguments) -> Result<(), Failure> {
    with_device(link, Revert(arguments))
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
        let port = device.port.to_string();
        let mut shown = text::identity(&port, &device.identity);
        shown.push_str(&text::reverted(&before, &after));
        let json = json::geometry("current", &after);
        let json = json::of_device(&port, &device.identity, json);
        publish(&[], self.0.json.as_deref(), &json, shown)
    }
}
