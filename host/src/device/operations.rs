//! A controller's calibration from files, with the judgement and the report that a calibration on
//! this computer gets.

use super::client::Client;
use super::convert;
use super::error::DeviceError;
use super::number::Number;
use super::sending::Sending;
use super::session::{self, Finished, Step};
use super::transport::Transport;
use super::verify::{Comparison, Ended, compare, solve_here};
use crate::accuracy::workspace_poses::WorkspacePoses;
use crate::calibration::case::settings;
use crate::calibration::error::CalibrateError;
use crate::calibration::observations::{self, ObservationsReport};
use crate::calibration::report::CalibrationReport;
use crate::calibration::{Elsewhere, calibrated_elsewhere};
use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Measurements, ObservationsFile, SamplesFile};
use crate::fit::observations::found_elsewhere;
use crate::fit::options::Options;
use crate::fit::stream::{Record, Unweighed};
use crate::text::numbers::small;
use crate::text::words::in_file_units;
use delta_cal::robot::ParameterKind;
use delta_cal::stream::{Added, StreamRefusal};
use delta_cal::{ArmIndex, Parameter, Real, Robot};
use delta_cal_protocol::{Fault, Geometry, ParameterSet};
use std::error::Error;
use std::fmt;

/// Rounding errors by which a nominal parameter may differ.
const ROUNDINGS: f64 = 4.0;
/// Positions that differ by more than this part of the forearm are of another robot.
const ANOTHER_ROBOT: f64 = 0.05;
/// How many parameters a message names.
const NAMED: usize = 3;

/// Why a robot was not calibrated.
#[derive(Debug)]
pub enum DeviceFailure {
    /// The controller, or the link to it.
    Device(DeviceError),
    /// A file, or measurements that cannot calibrate this robot.
    Calibrate(CalibrateError),
}

impl fmt::Display for DeviceFailure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Device(error) => error.fmt(formatter),
            Self::Calibrate(error) => error.fmt(formatter),
        }
    }
}

impl Error for DeviceFailure {}

impl From<DeviceError> for DeviceFailure {
    fn from(error: DeviceError) -> Self {
        Self::Device(error)
    }
}

impl<E: Into<CalibrateError>> From<E> for DeviceFailure {
    fn from(error: E) -> Self {
        Self::Calibrate(error.into())
    }
}

/// Calibrates the robot of a controller. Nothing is applied yet: that is
/// [`apply`](super::apply)'s, once the report was judged to be good.
///
/// # Errors
/// Another robot's file, a sample that is not taken, measurements that cannot calibrate this robot
/// by the controller's or this computer's judgement; a controller or link that fails.
pub fn calibrate_robot<T: Number, L: Transport>(
    client: &mut Client<L>,
    port: &str,
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
    progress: &mut dyn FnMut(Step),
) -> Result<(Finished<T>, CalibrationReport), DeviceFailure> {
    check(robot, options)?;
    let sending = Sending::samples(robot, samples, options);
    let (mut finished, nominal) = calibrated::<T, L>(client, robot, &sending, progress)
        .map_err(|error| samples_at_fault(samples, error))?;
    complete(&mut finished, &nominal, &sending)?;
    let before = RobotFile {
        name: format!("the controller on {port}"),
        robot: convert::robot(&finished.parameters_before.geometry)?,
        ..robot.clone()
    };
    let found = found(samples, options, &finished)?;
    let report = calibrated_elsewhere(robot, &before, samples, options, found)?;
    Ok((finished, report))
}

/// The same from heights, distances and single coordinates. `before` is the robot file's robot.
///
/// # Errors
/// As [`calibrate_robot`], and more rows, planes or points than the controller has memory for.
pub fn calibrate_robot_from_observations<T: Number, L: Transport>(
    client: &mut Client<L>,
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
    progress: &mut dyn FnMut(Step),
) -> Result<(Finished<T>, ObservationsReport), DeviceFailure> {
    observations::check(robot, samples, options)?;
    let at_fault = |error| observations_at_fault(samples, error);
    let sending = Sending::observations(robot, samples).map_err(|error| at_fault(error.into()))?;
    let (finished, _) = calibrated::<T, L>(client, robot, &sending, progress).map_err(at_fault)?;
    let explained = |error| observations::explained(robot, samples, options, error);
    let solution = match &finished.result {
        Ok(solution) => solution,
        Err(StreamRefusal::Calibration(refusal)) => return Err(explained((*refusal).into()).into()),
        Err(_) => return Err(DeviceError::Unexpected.into()),
    };
    let Some(places) = &solution.places else {
        return Err(DeviceError::Unexpected.into());
    };
    let fit = found_elsewhere(
        robot,
        samples,
        convert::outcome(solution)?,
        &places.planes.map(|place| place.map(Real::to_f64)),
        &places.points.map(|place| place.map(Real::to_f64)),
    )
    .map_err(explained)?;
    let report = observations::report(robot, samples, options, fit)?;
    Ok((finished, report))
}

/// What can be asked of a controller.
fn check(robot: &RobotFile, options: Options) -> Result<(), CalibrateError> {
    options.check()?;
    settings(robot, options)?;
    Ok(())
}

/// What became of samples whose answers a restart of the controller took away: the same as here, for both decide alike.
fn complete<T: Number>(
    finished: &mut Finished<T>,
    nominal: &Geometry<T>,
    sending: &Sending<T>,
) -> Result<(), DeviceError> {
    if finished.added.iter().all(Option::is_some) {
        return Ok(());
    }
    let here = solve_here(nominal, sending)?;
    for (added, here) in finished.added.iter_mut().zip(here.added) {
        *added = added.or(here);
    }
    Ok(())
}

/// What the controller found, as the judgement takes it.
fn found<T: Number>(
    samples: &SamplesFile,
    options: Options,
    finished: &Finished<T>,
) -> Result<Result<Elsewhere, Unweighed>, DeviceError> {
    let asked = options.streaming;
    let gate = finished.status_after.gate;
    let alarmed_from = gate.and_then(|gate| gate.alarm).map(|alarm| alarm.first());
    let mut record = Record::default();
    for (index, (row, added)) in (0..).zip(samples.rows.iter().zip(&finished.added)) {
        let added = added.map_or(Added::Taken, |added| added.cast());
        let alarmed = alarmed_from.is_some_and(|first: u64| index >= first);
        record.note(&added, alarmed, || row.line);
    }
    let counts = gate.map(|gate| gate.counts);
    Ok(match &finished.result {
        Err(refusal) => Err(Unweighed::Refused {
            refusal: *refusal,
            before: record.before,
            run: counts.map_or(0, |counts| counts.longest_run),
        }),
        Ok(solution) => {
            let [first, second, third] = solution.arms.map(|arm| arm.held_out);
            let held_out = match (first, second, third) {
                (Some(first), Some(second), Some(third)) => {
                    Some([first.cast(), second.cast(), third.cast()])
                }
                _ => None,
            };
            Ok(Elsewhere {
                outcome: convert::outcome(solution)?,
                stream: asked.asked().then(|| {
                    (
                        record.weights(asked),
                        record.report(asked, counts, held_out),
                    )
                }),
                rejected: record.rejected().to_vec(),
            })
        }
    })
}

/// With the controller's nominal geometry, which must be the file's.
fn calibrated<T: Number, L: Transport>(
    client: &mut Client<L>,
    robot: &RobotFile,
    sending: &Sending<T>,
    progress: &mut dyn FnMut(Step),
) -> Result<(Finished<T>, Geometry<T>), DeviceFailure> {
    let nominal = client.parameters::<T>(ParameterSet::Nominal)?;
    check_nominal(robot, &nominal.geometry)?;
    let finished = session::calibrate(client, sending, progress)?;
    Ok((finished, nominal.geometry))
}

/// A row that is not taken is a fault of the file.
fn samples_at_fault(samples: &SamplesFile, error: DeviceFailure) -> DeviceFailure {
    match error {
        DeviceFailure::Device(DeviceError::Row { index, error }) => {
            samples.fault(index, error.to_string()).into()
        }
        other => other,
    }
}

/// So are more rows, planes or points than the controller has memory for.
fn observations_at_fault(samples: &ObservationsFile, error: DeviceFailure) -> DeviceFailure {
    match error {
        DeviceFailure::Device(DeviceError::Row { index, error }) => {
            samples.fault(index, error.to_string()).into()
        }
        DeviceFailure::Device(
            error @ (DeviceError::TooManyRows { .. }
            | DeviceError::Fault(Fault::TooManyUnknowns { .. })),
        ) => InputError::new(&samples.name, error.to_string())
            .with_remedy(error.remedy())
            .into(),
        other => other,
    }
}

/// A calibration on both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Verified {
    /// Whether the controller calibrated the robot; otherwise it refused.
    pub calibrated: bool,
    /// The figures.
    pub comparison: Comparison,
}

/// Calibrates on the controller and here, and compares. Nothing is applied.
///
/// # Errors
/// As [`calibrate_robot`], but for refusals, which are compared.
pub fn verify<T: Number, L: Transport>(
    client: &mut Client<L>,
    robot: &RobotFile,
    measurements: &Measurements,
    options: Options,
    progress: &mut dyn FnMut(Step),
) -> Result<Verified, DeviceFailure> {
    let at_fault = |error| match measurements {
        Measurements::Positions(samples) => samples_at_fault(samples, error),
        Measurements::Observations(samples) => observations_at_fault(samples, error),
    };
    let sending = match measurements {
        Measurements::Positions(samples) => {
            check(robot, options)?;
            Sending::<T>::samples(robot, samples, options)
        }
        Measurements::Observations(samples) => {
            observations::check(robot, samples, options)?;
            Sending::observations(robot, samples).map_err(|error| at_fault(error.into()))?
        }
    };
    let (finished, nominal) = calibrated(client, robot, &sending, progress).map_err(at_fault)?;
    let Finished { added, result, .. } = finished;
    let device = Ended { added, result };
    let here = solve_here(&nominal, &sending).map_err(|error| at_fault(error.into()))?;
    Ok(Verified {
        calibrated: device.result.is_ok(),
        comparison: compare(&device, &here),
    })
}

/// A robot file must be of the controller's robot: its positions, at joint angles that both reach, near those of the
/// nominal one. By how much they differ, rms, mm.
///
/// # Errors
/// Positions that are elsewhere, as those of another robot.
pub fn check_calibrated<T: Number>(
    robot: &RobotFile,
    nominal: &Geometry<T>,
) -> Result<f64, DeviceFailure> {
    let drawn: Robot<f64> = convert::robot(nominal)?;
    let poses = WorkspacePoses::of(robot);
    let distances = poses.inside.iter().filter_map(|pose| {
        let there = drawn.forward(&pose.joints).ok()?;
        Some((there - pose.position).norm_squared())
    });
    let (count, sum) = distances.fold((0.0, 0.0), |(count, sum), own| (count + 1.0, sum + own));
    let rms = f64::sqrt(sum / count);
    let [arm, ..] = drawn.arms();
    if rms <= ANOTHER_ROBOT * arm.lb() {
        return Ok(rms);
    }
    let cause = format!(
        "is not a robot that the controller was built for: its positions differ by {} mm (rms) from those of the \
         controller's nominal robot",
        small(rms)
    );
    let error = InputError::new(&robot.name, cause).with_remedy(
        "give the calibrated file of this robot; delta-cal device --port PORT parameters --nominal writes the \
         nominal one",
    );
    Err(error.into())
}

/// The nominal geometry of the robot file must be the controller's: the same numbers, or different
/// by no more than the rounding of a controller that computed them itself.
///
/// # Errors
/// The parameters that differ.
pub fn check_nominal<T: Number>(
    robot: &RobotFile,
    nominal: &Geometry<T>,
) -> Result<(), InputError> {
    let file = robot.robot.parameters();
    let mut different = Vec::new();
    for ((index, file), device) in ArmIndex::ALL.into_iter().zip(file).zip(nominal.arms) {
        let longest = file.into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for ((parameter, file), device) in Parameter::ROTARY.into_iter().zip(file).zip(device) {
            let size = match parameter.kind() {
                ParameterKind::Length => longest,
                ParameterKind::Angle | ParameterKind::Ratio => std::f64::consts::TAU,
            };
            let device = device.to_f64();
            if !((file - device).abs() <= ROUNDINGS * T::EPSILON.to_f64() * size) {
                different.push(format!(
                    "{parameter} of {index} is {} in the file and {} in the controller",
                    in_file_units(parameter, file),
                    in_file_units(parameter, device)
                ));
            }
        }
    }
    let rounded = robot.robot.transmissions().map(|own| own.numbers());
    let rounded = rounded.map(|numbers| numbers.map(T::from_f64));
    for ((index, file), device) in ArmIndex::ALL
        .into_iter()
        .zip(rounded)
        .zip(nominal.transmissions.unwrap_or([[T::ZERO; 5]; 3]))
    {
        if file != device {
            different.push(format!("the transmission of {index} is another one"));
        }
    }
    if different.is_empty() {
        return Ok(());
    }
    let more = match different.len().checked_sub(NAMED) {
        Some(more) if more > 0 => format!("; and {more} more"),
        _ => String::new(),
    };
    different.truncate(NAMED);
    let cause = format!(
        "is not the robot that the controller was built for: {}{more}",
        different.join("; ")
    );
    Err(InputError::new(&robot.name, cause).with_remedy(
        "delta-cal device --port PORT parameters --nominal --output ROBOT.toml writes the \
         controller's; a calibrated robot file is no start for it",
    ))
}
