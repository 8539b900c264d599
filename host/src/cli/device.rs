//! `delta-cal device`.

use super::failure::Failure;
use super::output::{Progress, deliver, or_stream, refused};
use super::paths::{ColumnsArgument, read, robot_path};
use crate::accuracy::position_error::position_errors;
use crate::device::report::{self, Report, hexadecimal, origin};
use crate::device::{
    self, Client, DeviceError, Link, Number, Patience, Port, adopt, check_calibrated,
    check_nominal, in_use, robot as robot_of,
};
use crate::files::{Convention, Tool, example};
use crate::text::{small, tolerance_keys};
use crate::{
    CalibrateError, InputError, InputText, InstrumentFacts, Method, Options, Readings, Record,
    RobotFile, calibrate, read_samples,
};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;
use delta_cal_protocol::{Estimator, ParameterSet, Parameters, Request, RevertTo, Scalar};
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/device.txt"))]
pub(crate) struct DeviceArguments {
    /// Address of the controller: a serial port (/dev/ttyACM0, COM3), tcp:HOST:PORT, or tcp:PORT on this computer
    #[arg(
        long,
        global = true,
        value_name = "PORT",
        help_heading = "The controller"
    )]
    port: Option<Port>,
    /// Bits per second on a serial port [default: 115200]
    #[arg(
        long,
        global = true,
        value_name = "RATE",
        help_heading = "The controller"
    )]
    baud: Option<u32>,
    #[command(subcommand)]
    command: DeviceCommand,
    /// Write the report as JSON to this file, or with - to standard output
    #[arg(long, global = true, value_name = "REPORT.json")]
    json: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum DeviceCommand {
    /// Send samples, let the controller calibrate its robot, and show the result
    #[command(after_help = include_str!("help/device-calibrate.txt"))]
    Calibrate(CalibrateArguments),
    /// Let the controller use a robot that was calibrated on this computer
    #[command(after_help = include_str!("help/device-apply.txt"))]
    Apply {
        /// The robot after calibration
        #[arg(value_name = "CALIBRATED.toml", value_parser = robot_path())]
        robot: PathBuf,
    },
    /// Show what the controller is doing, and the state of its control loop and link
    Status,
    /// Write the geometry that the controller uses as a robot file
    #[command(after_help = include_str!("help/device-parameters.txt"))]
    Parameters(ParametersArguments),
    /// Go back to the parameters before the last change, or to the nominal ones
    Revert {
        /// Go back to the nominal geometry
        #[arg(long)]
        nominal: bool,
    },
    /// Let the joints approach the path again after a stop that status shows
    Resume,
}

#[derive(Debug, Args)]
struct CalibrateArguments {
    /// The controller's nominal robot. Without files: the built-in example
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    robot: Option<PathBuf>,
    /// Joint angles and measured positions; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    samples: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// joint fits all 24 parameters together; ikm fits each arm by itself with a third of the work
    #[arg(long, value_parser = method(), default_value = "joint")]
    method: Method,
    /// Store the result in the controller and let its control loop use it
    #[arg(long)]
    apply: bool,
}

/// The estimators that a controller offers.
fn method() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(["joint", "ikm"]).map(|name| match name.as_str() {
        "ikm" => Method::Ikm,
        _ => Method::Joint,
    })
}

#[derive(Debug, Args)]
struct ParametersArguments {
    /// The robot file from which to take [convention], [joints], [tolerance] and [noise]
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: Option<PathBuf>,
    /// Write the nominal geometry instead of the one in use
    #[arg(long)]
    nominal: bool,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "ROBOT.toml")]
    output: Option<PathBuf>,
}

const BAUD: u32 = 115_200;

/// A command for a controller, with its files already read.
enum Job<'a> {
    Calibrate(&'a CalibrateArguments, Box<RobotFile>, Readings),
    Apply(RobotFile),
    Status,
    /// The robot file, if any, supplies everything but the geometry.
    Parameters(&'a ParametersArguments, Option<RobotFile>),
    Revert(RevertTo),
    Resume,
}

pub(crate) fn run(arguments: &DeviceArguments) -> Result<(), Failure> {
    let job = match &arguments.command {
        DeviceCommand::Calibrate(own) => {
            let (robot, samples) = inputs(own)?;
            Job::Calibrate(own, Box::new(robot), samples)
        }
        DeviceCommand::Apply { robot } => Job::Apply(rotary(robot)?),
        DeviceCommand::Status => Job::Status,
        DeviceCommand::Parameters(own) => {
            Job::Parameters(own, own.robot.as_deref().map(rotary).transpose()?)
        }
        DeviceCommand::Revert { nominal: true } => Job::Revert(RevertTo::Nominal),
        DeviceCommand::Revert { nominal: false } => Job::Revert(RevertTo::Previous),
        DeviceCommand::Resume => Job::Resume,
    };
    let port = port(arguments)?;
    let link = port.open(arguments.baud.unwrap_or(BAUD));
    let link = link.map_err(|error| closed(&port, &error))?;
    let seed = getrandom::u64().map_err(|error| {
        Failure::device(format!("the system has no random numbers: {error}"), "")
    })?;
    let mut client = Client::new(link, Patience::default(), seed);
    let identity = client.identity()?;
    let json = arguments.json.as_deref();
    let report = match identity.scalar {
        Scalar::Single => job.run::<f32>(&mut client, &port, json),
        Scalar::Double => job.run::<f64>(&mut client, &port, json),
    };
    let report = report?.of(&port, &identity);
    let output = match &arguments.command {
        DeviceCommand::Parameters(own) => or_stream(own.output.as_deref(), json),
        _ => None,
    };
    deliver(
        &[(output, &report.robot_file), (json, &report.json())],
        report.text.as_str(),
    )
}

fn port(arguments: &DeviceArguments) -> Result<Port, Failure> {
    match (&arguments.port, arguments.baud) {
        (None, _) => Err(Failure::usage(
            "--port is missing",
            "write for example --port /dev/ttyACM0 or --port tcp:HOST:PORT",
        )),
        (Some(port @ Port::Tcp(_)), Some(_)) => Err(Failure::usage(
            format!("--baud has no meaning with --port {port}"),
            "leave it out; it goes with a serial port",
        )),
        (Some(port), _) => Ok(port.clone()),
    }
}

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
    fn run<T: Number>(
        self,
        client: &mut Client<Link>,
        port: &Port,
        json: Option<&Path>,
    ) -> Result<Report, Failure> {
        match self {
            Self::Calibrate(own, robot, samples) => {
                calibrate_there::<T>(client, own, (&robot, &samples), json)
            }
            Self::Apply(robot) => apply::<T>(client, &robot),
            Self::Status => status::<T>(client),
            Self::Parameters(own, template) => parameters::<T>(client, own, template, port),
            Self::Revert(to) => revert::<T>(client, to),
            Self::Resume => {
                let stopped = client.status::<T>()?.control.stopped;
                client.ask(&Request::<T>::Resume { stopped })?;
                status::<T>(client)
            }
        }
    }
}

/// The two files, or the built-in example.
fn inputs(arguments: &CalibrateArguments) -> Result<(RobotFile, Readings), CalibrateError> {
    let (Some(robot), Some(samples)) = (&arguments.robot, &arguments.samples) else {
        return Ok(example::load()?);
    };
    let robot = rotary(robot)?;
    let stated = robot.tolerance.iter();
    let mut stated = stated.flat_map(|own| tolerance_keys(Drive::Rotary, own));
    let single = stated.find(|(key, _)| !["length_mm", "angle_deg", "zero_deg"].contains(key));
    let cause = "a controller knows one tolerance of lengths and one of angles";
    let fault = match (robot.transmission, single) {
        (Some(_), _) => Some((
            "transmission_deg",
            "a controller cannot estimate transmissions",
        )),
        (None, single) => single.map(|(key, _)| (key, cause)),
    };
    if let Some((key, cause)) = fault {
        let error = InputError::new(&robot.name, cause).at_key(format!("[tolerance] {key}"));
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

/// A robot file with rotary drives and a platform that does not tilt, the only ones that the protocol supports.
fn rotary(path: &Path) -> Result<RobotFile, InputError> {
    let robot = RobotFile::read(&InputText::from_file(path)?)?;
    let (cause, remedy) = if robot.robot.drive() == Drive::Linear {
        (
            "the protocol has no robots with linear drives",
            "calibrate it with delta-cal calibrate, and export the result",
        )
    } else if robot.parallelograms.is_some() {
        (
            "the controller knows no rods that differ, so that its tool would be beside its place",
            "export a correction table, or delete [parallelogram] and calibrate again",
        )
    } else {
        return Ok(robot);
    };
    Err(InputError::new(&robot.name, cause).with_remedy(remedy))
}

fn calibrate_there<T: Number>(
    client: &mut Client<Link>,
    arguments: &CalibrateArguments,
    (robot, samples): (&RobotFile, &Readings),
    json: Option<&Path>,
) -> Result<Report, Failure> {
    let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
    check_nominal(robot, &nominal.geometry)?;
    let options = Options {
        method: Some(arguments.method),
        ..Options::default()
    };
    let here = calibrate(robot, samples, &options).map_err(|error| refused(json, error))?;
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
    let none = Tool::default();
    let [differs, _] = position_errors(
        (&robot_of(&geometry)?, &none),
        (&here.after.robot, &none),
        joints,
    );
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
    let there = (&geometry, &finished.control_loop());
    let repetitions = client.repetitions();
    Ok(report::calibration(
        &here,
        differs,
        there,
        arguments.apply,
        repetitions,
    ))
}

/// Accepted difference of a controller's result, mm: the samples' scatter, or single-precision rounding if larger.
fn tolerated(here: &crate::Report) -> f64 {
    let residuals = here.position_error_mm.map_or(0.0, |error| error.after.rms);
    let [arm, ..] = here.after.robot.arms();
    residuals.max(1e-5 * arm.lb())
}

fn apply<T: Number>(client: &mut Client<Link>, robot: &RobotFile) -> Result<Report, Failure> {
    let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
    let moved = check_calibrated(robot, &robot_of(&nominal.geometry)?)?;
    let before = client.parameters::<T>(ParameterSet::Current)?;
    let after = adopt::<T, _>(client, &robot.robot, before.generation)?;
    let mut report = report::changed(&before, &after, &robot.convention);
    let _ = writeln!(
        report.text,
        "Applied: the control loop uses {}, {} mm rms from the nominal robot.",
        robot.name,
        small(moved)
    );
    Ok(report)
}

fn status<T: Number>(client: &mut Client<Link>) -> Result<Report, Failure> {
    let status = client.status::<T>()?;
    let parameters = client.parameters(ParameterSet::Current)?;
    let counters = client.counters::<T>()?;
    Ok(report::status(&status, &parameters, &counters))
}

fn parameters<T: Number>(
    client: &mut Client<Link>,
    arguments: &ParametersArguments,
    template: Option<RobotFile>,
    port: &Port,
) -> Result<Report, Failure> {
    let (set, name) = if arguments.nominal {
        (ParameterSet::Nominal, "nominal")
    } else {
        (ParameterSet::Current, "current")
    };
    let parameters = client.parameters::<T>(set)?;
    let convention = template.as_ref().map(|own| own.convention);
    let convention = convention.unwrap_or(Convention::usual(Drive::Rotary));
    Ok(Report {
        robot_file: robot_file(template, name, &parameters, port)?,
        ..report::parameters(name, &parameters, &convention)
    })
}

fn robot_file<T: Number>(
    template: Option<RobotFile>,
    set: &str,
    parameters: &Parameters<T>,
    port: &Port,
) -> Result<String, Failure> {
    let mut comment = format!(
        "The {set} geometry of the controller on {}, {}, fingerprint {}.",
        port,
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
            record: Record {
                name: template.record.name.clone(),
                serial: template.record.serial.clone(),
                ..Record::default()
            },
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

fn revert<T: Number>(client: &mut Client<Link>, to: RevertTo) -> Result<Report, Failure> {
    let before = client.parameters::<T>(ParameterSet::Current)?;
    let after = client.revert::<T>(before.generation, to)?;
    let after = in_use::<T, _>(client, after.geometry.fingerprint())?;
    Ok(report::changed(
        &before,
        &after,
        &Convention::usual(Drive::Rotary),
    ))
}
