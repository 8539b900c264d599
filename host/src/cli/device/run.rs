//! Running `delta-cal device`.

use super::{CalibrateArguments, DeviceArguments, DeviceCommand, ParametersArguments};
use crate::cli::failure::Failure;
use crate::cli::output::{self, deliver};
use crate::cli::paths::{is_stream, read};
use crate::cli::progress::Progress;
use crate::device::report::{self, Report, hexadecimal, origin};
use crate::device::{
    self, Client, DeviceError, Link, Number, Patience, Port, adopt, check_calibrated,
    check_nominal, difference, in_use, robot as robot_of,
};
use crate::files::example;
use crate::text::small;
use crate::{
    CalibrateError, InputError, InputText, InstrumentFacts, Method, Options, Readings, RobotFile,
    calibrate, read_samples,
};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;
use delta_cal_protocol::{Estimator, Identity, ParameterSet, Parameters, RevertTo, Scalar};
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Display;
use std::io;
use std::path::Path;

const BAUD: u32 = 115_200;

/// A command for a controller, with its files already read.
enum Job<'a> {
    Calibrate(&'a CalibrateArguments, RobotFile, Readings),
    Apply(RobotFile),
    Status,
    /// The robot file, if any, supplies everything but the geometry.
    Parameters(&'a ParametersArguments, Option<RobotFile>),
    Revert(RevertTo),
}

pub(crate) fn run(arguments: &DeviceArguments) -> Result<(), Failure> {
    let json = ("--json", arguments.json.as_deref());
    let job = match &arguments.command {
        DeviceCommand::Calibrate(own) => {
            let robot = ("the robot file", own.robot.as_deref());
            let samples = ("the samples file", own.samples.as_deref());
            output::check(&[robot, samples], &[json])?;
            let (robot, samples) = inputs(own)?;
            Job::Calibrate(own, robot, samples)
        }
        DeviceCommand::Apply { robot } => {
            output::check(&[("the robot file", Some(robot))], &[json])?;
            Job::Apply(rotary(robot)?)
        }
        DeviceCommand::Status => Job::Status,
        DeviceCommand::Parameters(own) => {
            let robot = ("the robot file", own.robot.as_deref());
            let output = ("--output", own.output.as_deref());
            output::check(&[robot], &[output, json])?;
            Job::Parameters(own, own.robot.as_deref().map(rotary).transpose()?)
        }
        DeviceCommand::Revert { nominal: true } => Job::Revert(RevertTo::Nominal),
        DeviceCommand::Revert { nominal: false } => Job::Revert(RevertTo::Previous),
    };
    let port = port(arguments)?;
    let link = port.open(arguments.baud.unwrap_or(BAUD));
    let link = link.map_err(|error| closed(&port, &error))?;
    let seed = getrandom::u64().map_err(|error| {
        Failure::device(format!("the system has no random numbers: {error}"), "")
    })?;
    let mut client = Client::new(link, Patience::default(), seed);
    let mut device = Device {
        identity: client.identity()?,
        client,
        port,
        json: arguments.json.as_deref(),
    };
    match device.identity.scalar {
        Scalar::Single => job.run::<f32>(&mut device),
        Scalar::Double => job.run::<f64>(&mut device),
    }
}

/// A controller that has identified itself.
struct Device<'a> {
    client: Client<Link>,
    identity: Identity,
    port: Port,
    /// Where the JSON report goes.
    json: Option<&'a Path>,
}

fn port(arguments: &DeviceArguments) -> Result<Port, Failure> {
    match (&arguments.port, arguments.baud) {
        (None, _) => Err(Failure::usage(
            "which controller? --port is missing",
            "--port /dev/ttyACM0 or --port tcp:HOST:PORT",
        )),
        (Some(port @ Port::Tcp(_)), Some(_)) => Err(Failure::usage(
            format!("--baud has no meaning with --port {port}"),
            "leave it out; it goes with a serial port",
        )),
        (Some(port), _) => Ok(port.clone()),
    }
}

/// The error for a port that cannot be opened.
fn closed(port: &Port, error: &io::Error) -> Failure {
    let remedy = match (port, error.kind()) {
        (Port::Serial(_), io::ErrorKind::PermissionDenied) => {
            "on Linux, join the group that owns it: sudo usermod -aG dialout $USER, then log in again"
        }
        (Port::Serial(_), _) => "check the name (ls /dev/ttyACM* /dev/ttyUSB*) and the cable",
        (Port::Tcp(_), _) => "check the address, and that the serial server runs",
    };
    Failure::device(format!("{port}: cannot be opened: {error}"), remedy)
}

impl Job<'_> {
    fn run<T: Number>(self, device: &mut Device<'_>) -> Result<(), Failure> {
        match self {
            Self::Calibrate(own, robot, samples) => {
                calibrate_there::<T>(device, own, &robot, &samples)
            }
            Self::Apply(robot) => apply::<T>(device, &robot),
            Self::Status => status::<T>(device),
            Self::Parameters(own, template) => parameters::<T>(device, own, template),
            Self::Revert(to) => revert::<T>(device, to),
        }
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

/// A robot file with rotary drives, the only ones that the protocol supports.
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
    device: &Device<'_>,
    contents: C,
    file: Option<(&Path, &str)>,
) -> Result<(), Failure> {
    let report = Report::new(&device.port, &device.identity, contents);
    let (path, text) = file.unzip();
    let outputs = [
        (path, text.unwrap_or_default()),
        (device.json, &report.json()),
    ];
    deliver(&outputs, report.text())
}

fn calibrate_there<T: Number>(
    device: &mut Device<'_>,
    arguments: &CalibrateArguments,
    robot: &RobotFile,
    samples: &Readings,
) -> Result<(), Failure> {
    let client = &mut device.client;
    let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
    check_nominal(robot, &nominal.geometry)?;
    let options = Options {
        method: Some(arguments.method),
        ..Options::default()
    };
    let here = calibrate(robot, samples, &options)?;
    let estimator = match arguments.method {
        Method::Ikm => Estimator::Arms,
        _ => Estimator::Joint,
    };
    let begin = device::begin::<T>(robot, estimator);
    let rows = device::samples::<T>(samples);
    let bar = Progress::bar("samples");
    let finished = device::calibrate(client, &begin, &rows, &mut |taken| {
        bar.show(taken as u64, rows.len() as u64);
    })?;
    drop(bar);
    let geometry = finished.geometry().map_err(|refusal| {
        Failure::refused(
            format!("the controller refuses the calibration: {refusal}"),
            "this computer accepts the same samples: send its result with delta-cal device apply",
        )
    })?;
    let joints = samples.rows.iter().map(|row| row.value.joints);
    let differs = difference(&robot_of(&geometry)?, &here.after.robot, joints);
    if !(differs <= tolerated(&here)) {
        return Err(Failure::device(
            format!(
                "the controller's positions differ by {} mm rms from this computer's",
                small(differs)
            ),
            "use the firmware that belongs to this delta-cal; nothing was applied",
        ));
    }
    if arguments.apply {
        device::apply(client, &begin, &rows, &finished)?;
    }
    let repetitions = client.repetitions();
    let there = finished.control_loop();
    let there = (&geometry, &there);
    let calibration = report::Calibration::new(&here, differs, there, arguments.apply, repetitions);
    publish(device, calibration, None)
}

/// Accepted difference of a controller's result, mm: the samples' scatter, or single-precision rounding if larger.
fn tolerated(here: &crate::Report) -> f64 {
    let residuals = here.position_error_mm.map_or(0.0, |error| error.after.rms);
    let [arm, ..] = here.after.robot.arms();
    residuals.max(1e-5 * arm.lb())
}

fn apply<T: Number>(device: &mut Device<'_>, robot: &RobotFile) -> Result<(), Failure> {
    let client = &mut device.client;
    let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
    let moved = check_calibrated(robot, &robot_of(&nominal.geometry)?)?;
    let before = client.parameters::<T>(ParameterSet::Current)?;
    let after = adopt::<T, _>(client, &robot.robot, before.generation)?;
    let changed = report::Parameters::changed(&before, &after).note(format!(
        "Applied: the control loop uses {}, {} mm rms from the nominal robot.",
        robot.name,
        small(moved)
    ));
    publish(device, changed, None)
}

fn status<T: Number>(device: &mut Device<'_>) -> Result<(), Failure> {
    let client = &mut device.client;
    let status = client.status::<T>()?;
    let parameters = client.parameters(ParameterSet::Current)?;
    let counters = client.counters::<T>()?;
    let status = report::Status::new(&status, &parameters, &counters);
    publish(device, status, None)
}

fn parameters<T: Number>(
    device: &mut Device<'_>,
    arguments: &ParametersArguments,
    template: Option<RobotFile>,
) -> Result<(), Failure> {
    let (set, name) = if arguments.nominal {
        (ParameterSet::Nominal, "nominal")
    } else {
        (ParameterSet::Current, "current")
    };
    let parameters = device.client.parameters::<T>(set)?;
    let toml = robot_file(template, name, &parameters, device)?;
    let output = match arguments.output.as_deref() {
        // The robot file is itself the report.
        None if !device.json.is_some_and(is_stream) => Some(Path::new("-")),
        output => output,
    };
    let contents = report::Parameters::new(name, &parameters);
    publish(device, contents, output.map(|path| (path, toml.as_str())))
}

/// The geometry as a robot file.
fn robot_file<T: Number>(
    template: Option<RobotFile>,
    set: &str,
    parameters: &Parameters<T>,
    device: &Device<'_>,
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
        // A range that fits every Delta, until the user states the right one.
        let limits = JointLimits::new(-FRAC_PI_2, FRAC_PI_2);
        RobotFile::of(
            "",
            robot,
            limits.map_err(|_| DeviceError::ImpossibleGeometry)?,
        )
    };
    Ok(file.to_toml(&comment))
}

fn revert<T: Number>(device: &mut Device<'_>, to: RevertTo) -> Result<(), Failure> {
    let client = &mut device.client;
    let before = client.parameters::<T>(ParameterSet::Current)?;
    let after = client.revert::<T>(before.generation, to)?;
    let after = in_use::<T, _>(client, after.geometry.fingerprint())?;
    publish(device, report::Parameters::changed(&before, &after), None)
}
