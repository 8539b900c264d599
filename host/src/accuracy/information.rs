//! Prior knowledge of the parameters, and the unit in which they are compared: mm, angles times the upper arm's length.

use crate::files::RobotFile;
pub(crate) use crate::fit::solution::PARAMETERS;
use crate::fit::solution::{RobotCovariance, WITH_TRANSMISSIONS};
use crate::geometry::Parallelograms;
use delta_cal::robot::{Arm, Drive, ParameterKind, TransmissionTolerance};
use delta_cal::{ArmIndex, Parameter, Robot, Tolerance};
use nalgebra::{SMatrix, SVector, Vector2};
use std::f64::consts::TAU;

/// Parameters per arm.
pub const ARM: usize = 8;
/// Arm and parameter at an index; `None` at an index that this kind of arm does not use.
pub(crate) fn parameter_at(robot: &Robot<f64>, index: usize) -> Option<(ArmIndex, Parameter)> {
    let arm = ArmIndex::ALL.get(index / ARM).copied();
    let parameter = robot.drive().places()[index % ARM]?;
    Some((arm?, parameter))
}

/// All parameters of all arms.
pub fn parameters(robot: &Robot<f64>) -> impl Iterator<Item = (ArmIndex, Parameter)> {
    let parameters = robot.drive().parameters();
    ArmIndex::ALL
        .into_iter()
        .flat_map(|arm| parameters.iter().map(move |parameter| (arm, *parameter)))
}

/// Whether this kind of arm does not use the index.
pub(crate) fn is_empty(robot: &Robot<f64>, index: usize) -> bool {
    robot.drive().places()[index % ARM].is_none()
}

/// Covariance of the parameters under a tolerance: mm and radians.
pub(crate) fn prior_covariance(
    robot: &Robot<f64>,
    tolerance: &Tolerance<f64>,
) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    let places = robot.drive().places();
    let own = SVector::<f64, PARAMETERS>::from_fn(|index, _| {
        places[index % ARM].map_or(0.0, |parameter| tolerance.of(parameter).powi(2))
    });
    // All towers move outwards by one σ of their common radius.
    let radius = SVector::<f64, PARAMETERS>::from_fn(|index, _| {
        let outwards = tolerance.outwards(&robot.arms()[index / ARM]);
        outwards.get(index % ARM).copied().unwrap_or(0.0)
    });
    let forearm = SVector::<f64, PARAMETERS>::from_fn(|index, _| match places[index % ARM] {
        Some(Parameter::Lb) => tolerance.forearm(),
        _ => 0.0,
    });
    let mut covariance =
        SMatrix::from_diagonal(&own) + radius * radius.transpose() + forearm * forearm.transpose();
    if let Some(zero) = tolerance
        .joint_zero()
        .filter(|_| robot.drive() == Drive::Rotary)
    {
        let length = tolerance.of(Parameter::LaX);
        for (arm, geometry) in robot.arms().iter().enumerate() {
            let (x, y) = geometry.la();
            let along = Vector2::new(x, y) * (length / geometry.upper_arm_length());
            let across = Vector2::new(-y, x) * zero;
            let place = ARM * arm + Parameter::LaX.index();
            covariance
                .fixed_view_mut::<2, 2>(place, place)
                .copy_from(&(along * along.transpose() + across * across.transpose()));
        }
    }
    covariance
}

/// Prior covariance of a robot's parameters, and of its transmissions and rods if they are unknown; `None` without a
/// tolerance.
pub(crate) fn prior(file: &RobotFile) -> Option<RobotCovariance> {
    let mut covariance = RobotCovariance::zeros();
    let parameters = prior_covariance(&file.robot, file.tolerance.as_ref()?);
    covariance
        .fixed_view_mut::<PARAMETERS, PARAMETERS>(0, 0)
        .copy_from(&parameters);
    let sigma = file
        .transmission
        .as_ref()
        .map_or(0.0, TransmissionTolerance::sigma);
    for number in PARAMETERS..WITH_TRANSMISSIONS {
        covariance[(number, number)] = sigma.powi(2);
    }
    let rods = file.parallelograms.iter().flat_map(Parallelograms::sigmas);
    for (number, sigma) in (WITH_TRANSMISSIONS..).zip(rods) {
        covariance[(number, number)] = sigma.powi(2);
    }
    Some(covariance)
}

/// Factor for each parameter: 1, or the upper arm's length (with linear drives, the forearm's) for angles.
pub fn units(robot: &Robot<f64>) -> SVector<f64, PARAMETERS> {
    let mut units = SVector::repeat(1.0);
    for (arm, parameter) in parameters(robot) {
        units[ARM * arm.index() + parameter.index()] = unit(robot.arm(arm), parameter);
    }
    units
}

/// All 24 parameter differences, a − truth: mm, with angles times the true upper arm's length.
pub fn differences(a: &Robot<f64>, truth: &Robot<f64>) -> SVector<f64, PARAMETERS> {
    let mut differences = SVector::zeros();
    for (arm, parameter) in parameters(truth) {
        let true_arm = truth.arm(arm);
        let mut difference = a.arm(arm).get(parameter) - true_arm.get(parameter);
        if parameter == Parameter::Theta {
            // 359° and −1° are the same azimuth.
            difference -= (difference / TAU).round() * TAU;
        }
        let index = ARM * arm.index() + parameter.index();
        differences[index] = difference * unit(true_arm, parameter);
    }
    differences
}

/// The factor of one parameter.
pub fn unit(arm: &Arm<f64>, parameter: Parameter) -> f64 {
    match parameter.kind() {
        ParameterKind::Length => 1.0,
        ParameterKind::Angle | ParameterKind::Ratio => arm.upper_arm_length(),
    }
}
