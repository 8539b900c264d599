//! Between what files hold, in `f64`, and what goes over the wire.

use super::error::DeviceError;
use super::number::Number;
use super::solution::Solution;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, SamplesFile};
use crate::fit::observations;
use crate::fit::options::{Options, Streaming};
use crate::fit::outcome::Outcome;
use delta_cal::calibration::ArmOutcome;
use delta_cal::observations::DistanceFrom;
use delta_cal::robot::Arm;
use delta_cal::stream::Estimator;
use delta_cal::{Parameter, Real, Robot, RobotOutcome};
use delta_cal_protocol::{
    ArmReport, Begin, BeginObservations, Fault, Geometry, ObservationMessage, PLANES, POINTS,
    PlaneMessage, PointMessage, UNKNOWNS,
};
use nalgebra::{SMatrix, SVector};
use std::num::NonZeroU32;

/// One measurement as it is sent: joint angles in radians, position in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement<T> {
    /// q₁, q₂, q₃ in radians.
    pub joints: [T; 3],
    /// Measured platform position, mm.
    pub position: [T; 3],
}

/// What a session is begun with: what a robot file states of tolerance and noise, rounded to the controller's numbers, and the
/// options. The session is 0: it is drawn when it begins.
pub(super) fn begin<T: Number>(robot: &RobotFile, options: Options) -> Begin<T> {
    let rounded = T::from_f64;
    let Streaming {
        gate,
        held_out,
        forget,
    } = options.streaming;
    Begin {
        session: 0,
        tolerance: tolerance(robot),
        noise: robot
            .noise
            .map(|n| (n.position_by_axis().map(rounded), rounded(n.joint()))),
        without_guess: options.no_guess,
        estimator: if options.method.separates_arms() {
            Estimator::Arms
        } else {
            Estimator::Joint
        },
        gate,
        held_out: held_out.map(NonZeroU32::get),
        forgetting: forget.map(|samples| rounded(f64::from(samples.get()))),
    }
}

fn tolerance<T: Number>(robot: &RobotFile) -> Option<(T, T)> {
    robot.tolerance.map(|t| {
        (
            T::from_f64(t.of(Parameter::Lb)),
            T::from_f64(t.of(Parameter::Theta)),
        )
    })
}

/// The samples of a file, rounded to the controller's numbers.
pub(super) fn measurements<T: Number>(samples: &SamplesFile) -> Vec<Measurement<T>> {
    samples
        .rows
        .iter()
        .map(|row| Measurement {
            joints: row.value.joints.map(T::from_f64),
            position: row.value.position.map(T::from_f64).data.0[0],
        })
        .collect()
}

/// As [`begin`], of a file of observations: the planes and points with what the robot file knows of them.
///
/// # Errors
/// [`Fault::TooManyUnknowns`].
pub(super) fn begin_observations<T: Number>(
    robot: &RobotFile,
    file: &ObservationsFile,
) -> Result<BeginObservations<T>, DeviceError> {
    let rounded = T::from_f64;
    let (planes, points) = observations::places(robot, file);
    let noise = observations::noise(robot).ok_or(DeviceError::Fault(Fault::Settings))?;
    let unknowns = || {
        DeviceError::Fault(Fault::TooManyUnknowns {
            capacity: u32::try_from(UNKNOWNS).unwrap_or(u32::MAX),
        })
    };
    if planes.len() > PLANES || points.len() > POINTS {
        return Err(unknowns());
    }
    let mut begin = BeginObservations {
        session: 0,
        tolerance: tolerance(robot),
        noise: (
            noise.position().position_by_axis().map(rounded),
            rounded(noise.position().joint()),
        ),
        height_noise: rounded(noise.height()),
        distance_noise: rounded(noise.distance()),
        plane_count: u8::try_from(planes.len()).map_err(|_| unknowns())?,
        planes: [PlaneMessage::default(); PLANES],
        point_count: u8::try_from(points.len()).map_err(|_| unknowns())?,
        points: [PointMessage::default(); POINTS],
    };
    for (message, plane) in begin.planes.iter_mut().zip(&planes) {
        message.known = plane.known.map(|(c, sigma)| (rounded(c), rounded(sigma)));
        message.level = plane.level.map(rounded);
    }
    for (message, point) in begin.points.iter_mut().zip(&points) {
        message.known = point
            .known
            .map(|(place, sigma)| (place.data.0[0].map(rounded), rounded(sigma)));
        message.offset = point.offset;
    }
    Ok(begin)
}

/// The rows of a file, rounded to the controller's numbers.
///
/// # Errors
/// [`Fault::TooManyUnknowns`].
pub(super) fn observations<T: Number>(
    file: &ObservationsFile,
) -> Result<Vec<ObservationMessage<T>>, DeviceError> {
    let capacity = u32::try_from(UNKNOWNS).unwrap_or(u32::MAX);
    let rounded = T::from_f64;
    file.rows
        .iter()
        .map(|row| {
            let own = observations::observation(&row.value)
                .map_err(|_| DeviceError::Fault(Fault::TooManyUnknowns { capacity }))?;
            Ok(ObservationMessage {
                session: 0,
                index: 0,
                joints: own.joints.map(rounded),
                position: own.position.map(|value| value.map(rounded)),
                height: own
                    .height
                    .map(|height| (height.plane, rounded(height.height))),
                distance: own.distance.map(|distance| {
                    let from = match distance.from {
                        DistanceFrom::Point(point) => DistanceFrom::Point(point),
                        DistanceFrom::Pose(joints) => DistanceFrom::Pose(joints.map(rounded)),
                    };
                    (from, rounded(distance.distance))
                }),
            })
        })
        .collect()
}

/// The numbers of a robot as a controller has them.
///
/// # Errors
/// They are not the geometry of a robot in that type.
pub(super) fn geometry<T: Real>(robot: &Robot<f64>) -> Result<Geometry<T>, DeviceError> {
    let robot = robot.cast::<T>();
    let robot = robot.map_err(|_| DeviceError::ImpossibleGeometry)?;
    Ok(Geometry::of(&robot))
}

/// The robot of these numbers, in another type.
///
/// # Errors
/// They are not the geometry of a robot.
pub fn robot<T: Real, U: Real>(geometry: &Geometry<T>) -> Result<Robot<U>, DeviceError> {
    let number = |value: T| U::from_f64(value.to_f64());
    let transmissions = geometry.transmissions.as_ref();
    let converted = Geometry {
        arms: geometry.arms.map(|arm| arm.map(number)),
        transmissions: transmissions.map(|all| all.map(|own| own.map(number))),
    };
    let robot = converted.robot();
    robot.map_err(|_| DeviceError::ImpossibleGeometry)
}

/// A controller's result in `f64`, which changes no number.
///
/// # Errors
/// The parameters are not the geometry of a robot, or another figure is impossible.
pub fn outcome<T: Number>(solution: &Solution<T>) -> Result<Outcome, DeviceError> {
    let blocks = solution.across.iter().flatten();
    let mut across = blocks.flat_map(|block| block.covariance.iter().flatten().flatten());
    let places = solution.places.iter();
    let mut places = places.flat_map(|own| {
        let planes = own.planes.as_flattened().iter();
        planes.chain(own.points.as_flattened())
    });
    let possible = solution.arms.iter().all(possible)
        && across.all(|entry| entry.finite())
        && places.all(|number| number.finite());
    if !possible {
        return Err(DeviceError::ImpossibleOutcome);
    }
    let robot: Robot<f64> = robot(&solution.geometry())?;
    let [first, second, third] = &solution.arms;
    let [arm_1, arm_2, arm_3] = *robot.arms();
    let mut outcome = Outcome::from(RobotOutcome {
        robot,
        arms: [
            arm_outcome(first, arm_1),
            arm_outcome(second, arm_2),
            arm_outcome(third, arm_3),
        ],
    });
    for block in solution.across.iter().flatten() {
        outcome.covariance = outcome
            .covariance
            .zip(block.covariance)
            .map(|(mut all, own)| {
                let (row, column) = (8 * block.rows.index(), 8 * block.columns.index());
                let own = SMatrix::<f64, 8, 8>::from_fn(|row, column| own[column][row].to_f64());
                all.fixed_view_mut::<8, 8>(row, column).copy_from(&own);
                all.fixed_view_mut::<8, 8>(column, row)
                    .copy_from(&own.transpose());
                all
            });
    }
    Ok(outcome)
}

/// Whether every figure beside the parameters is finite, and none negative that cannot be. A frame can
/// be whole and hold anything.
fn possible<T: Real>(report: &ArmReport<T>) -> bool {
    let sizes = [
        report.residual_rms,
        report.degrees_of_freedom,
        report.condition,
    ];
    let variances = report
        .covariance
        .iter()
        .flat_map(|columns| (0..8).map(|index| columns[index][index]));
    let mut sizes = sizes
        .into_iter()
        .chain(report.estimated_noise)
        .chain(report.prior_share)
        .chain(variances);
    let mut entries = report.covariance.iter().flatten().flatten();
    sizes.all(|size| size.finite() && size >= T::ZERO) && entries.all(|entry| entry.finite())
}

fn arm_outcome<T: Real>(report: &ArmReport<T>, arm: Arm<f64>) -> ArmOutcome<f64> {
    ArmOutcome {
        arm,
        covariance: report
            .covariance
            .map(|columns| SMatrix::from_fn(|row, column| columns[column][row].to_f64())),
        residual_rms: report.residual_rms.to_f64(),
        estimated_noise: report.estimated_noise.map(Real::to_f64),
        degrees_of_freedom: report.degrees_of_freedom.to_f64(),
        samples: report.samples,
        iterations: report.iterations,
        termination: report.termination,
        start: report.start,
        condition: report.condition.to_f64(),
        prior_share: SVector::from(report.prior_share.map(Real::to_f64)),
    }
}
