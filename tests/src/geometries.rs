//! Robots with proportions other than the paper's.

use crate::paper_limits;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Arm, Drive, ParameterKind};
use delta_cal::simulate::random_pose;
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Sample, SymmetricRobot, Tolerance};
use nalgebra::{DMatrix, DVector, Dyn, Matrix3, OMatrix, SMatrix, U8, Vector2, Vector3};
use rand_core::Rng;

/// Base radius, platform radius, upper arm and forearm, mm.
const SYMMETRIC: [(&str, [f64; 4]); 6] = [
    ("paper 194/30/260/480", [194.0, 30.0, 260.0, 480.0]),
    ("large 200/45/235/800", [200.0, 45.0, 235.0, 800.0]),
    ("tall 60/40/400/900", [60.0, 40.0, 400.0, 900.0]),
    ("wide platform 60/110/250/520", [60.0, 110.0, 250.0, 520.0]),
    ("short 150/60/250/275", [150.0, 60.0, 250.0, 275.0]),
    ("tiny 60/25/80/180", [60.0, 25.0, 80.0, 180.0]),
];

/// A symmetric robot: base radius, platform radius, upper arm and forearm.
///
/// # Panics
/// They are no robot's.
pub fn symmetric([base_radius, platform_radius, upper_arm, forearm]: [f64; 4]) -> Robot<f64> {
    let robot = SymmetricRobot {
        base_radius,
        platform_radius,
        upper_arm,
        forearm,
    };
    robot.robot().expect("the robot is valid")
}

/// Eight named robots: small, large, tall, with a platform larger than the base, with short forearms, with three
/// different arms, and with tilted motor axes. Lengths in mm.
pub fn geometries() -> Vec<(&'static str, Robot<f64>)> {
    let mut robots = SYMMETRIC
        .map(|(name, lengths)| (name, symmetric(lengths)))
        .to_vec();
    let changed = |lengths: [[f64; 4]; 3]| {
        let (_, paper) = &robots[0];
        let mut arms = *paper.arms();
        for (arm, [turn, tilt, upper_arm, forearm]) in arms.iter_mut().zip(lengths) {
            let [x, y, z, theta, _, ..] = arm.parameters();
            *arm = Arm::new([x, y, z, theta + turn, tilt, upper_arm, 0.0, forearm])
                .expect("the arm is valid");
        }
        Robot::new(arms).expect("the robot is valid")
    };
    let asymmetric = changed([
        [0.0, 0.0, 260.0, 480.0],
        [0.2, 0.0, 230.0, 520.0],
        [-0.3, 0.0, 290.0, 450.0],
    ]);
    let tilted = changed([
        [0.0, 0.35, 260.0, 480.0],
        [0.0, -0.25, 260.0, 480.0],
        [0.1, 0.2, 260.0, 480.0],
    ]);
    robots.push(("asymmetric arms", asymmetric));
    robots.push(("tilted axes", tilted));
    robots
}

/// The Cramér–Rao bound of all 24 parameters (lengths in mm, angles in rad) from three coordinates per sample, with the
/// tolerance as a prior. Computed by central differences of forward kinematics and a dense inverse, so that it shares
/// no code with what it verifies.
pub fn bound(
    truth: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<SMatrix<f64, 24, 24>> {
    let places = truth.drive().places();
    let mut information = SMatrix::<f64, 24, 24>::zeros();
    for sample in samples {
        let mut by_joints = Matrix3::zeros();
        for joint in 0..3 {
            let at = |by: f64| {
                let mut joints = sample.joints;
                joints[joint] += by;
                truth.forward(&joints).ok()
            };
            by_joints.set_column(joint, &((at(1e-6)? - at(-1e-6)?) / 2e-6));
        }
        let mut covariance = by_joints * by_joints.transpose() * noise.joint().powi(2);
        for (axis, sigma) in noise.position_by_axis().into_iter().enumerate() {
            covariance[(axis, axis)] += sigma * sigma;
        }
        let jacobian = position_jacobian(truth, &sample.joints)?;
        information += jacobian.transpose() * covariance.try_inverse()? * jacobian;
    }
    if let Some(tolerance) = tolerance {
        information += inverse_of(&made_to(truth, tolerance))?;
    }
    // A parameter that the arms do not have carries no information.
    let empty = |index: usize| places[index % 8].is_none();
    for index in (0..24).filter(|index| empty(*index)) {
        information[(index, index)] = 1.0;
    }
    let mut covariance = inverse_of(&information)?;
    for index in (0..24).filter(|index| empty(*index)) {
        covariance[(index, index)] = 0.0;
    }
    Some(covariance)
}

/// The covariance of the parameters of robots made to a tolerance, 1 for parameters that the arms do not have: the
/// common radius moves every tower along its azimuth, and a joint zero turns the upper arm.
pub fn made_to(robot: &Robot<f64>, tolerance: &Tolerance<f64>) -> SMatrix<f64, 24, 24> {
    let places = robot.drive().places();
    let mut covariance = SMatrix::<f64, 24, 24>::identity();
    for index in 0..24 {
        if let Some(parameter) = places[index % 8] {
            covariance[(index, index)] = tolerance.of(parameter).powi(2);
        }
    }
    if let Some(zero) = tolerance.joint_zero() {
        for (index, arm) in robot.arms().iter().enumerate() {
            let [.., x, y, _] = arm.parameters();
            let (along, across) = (Vector2::new(x, y).normalize(), Vector2::new(-y, x) * zero);
            let length = tolerance.of(Parameter::LaX) * along;
            let own = length * length.transpose() + across * across.transpose();
            let mut place = covariance.fixed_view_mut::<2, 2>(8 * index + 5, 8 * index + 5);
            place.copy_from(&own);
        }
    }
    if robot.drive() == Drive::Linear {
        let azimuths = robot.arms().map(|arm| arm.d().y.atan2(arm.d().x));
        let outwards = |index: usize| match index % 8 {
            0 => azimuths[index / 8].cos(),
            1 => azimuths[index / 8].sin(),
            _ => 0.0,
        };
        let variance = tolerance.radius().powi(2);
        covariance += SMatrix::from_fn(|i, j| variance * outwards(i) * outwards(j));
    }
    covariance
}

/// ∂X/∂P by central differences: mm per mm, mm per rad. `None` if the pose is unreachable.
pub fn position_jacobian(robot: &Robot<f64>, joints: &[f64; 3]) -> Option<SMatrix<f64, 3, 24>> {
    let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
    for index in 0..24 {
        let at = |by: f64| -> Option<Vector3<f64>> {
            let mut parameters = robot.parameters();
            parameters[index / 8][index % 8] += by;
            robot.with_parameters(parameters).ok()?.forward(joints).ok()
        };
        let step = match robot.drive().places()[index % 8].map(Parameter::kind) {
            Some(ParameterKind::Length) => 1e-4,
            Some(ParameterKind::Angle | ParameterKind::Ratio) => 1e-6,
            None => continue,
        };
        jacobian.set_column(index, &((at(step)? - at(-step)?) / (2.0 * step)));
    }
    Some(jacobian)
}

/// Four named robots with linear drives and their range of travel, mm: a printer, a small one, a tall one with long
/// forearms, and one with leaning, uneven towers and unequal forearms.
pub fn linear_geometries() -> Vec<(&'static str, Robot<f64>, [f64; 2])> {
    let symmetric = |tower_radius: f64, forearm: f64| {
        Robot::linear(tower_radius, forearm, None).expect("the robot is valid")
    };
    let printer = symmetric(140.0, 330.0);
    let mut arms = *printer.arms();
    for (arm, [x, y, z, lean_x, lean_y, scale, forearm]) in arms.iter_mut().zip([
        [6.0, -9.0, 12.0, 0.10, -0.05, 1.0, 330.0],
        [-12.0, 4.0, -20.0, -0.06, 0.12, 0.8, 300.0],
        [3.0, 15.0, 5.0, 0.02, -0.15, 1.25, 360.0],
    ]) {
        let d = arm.d();
        *arm = Arm::linear([d.x + x, d.y + y, d.z + z, lean_x, lean_y, scale, forearm])
            .expect("the arm is valid");
    }
    let uneven = Robot::new(arms).expect("the robot is valid");
    vec![
        ("printer 140/330", printer, [100.0, 600.0]),
        ("small 80/180", symmetric(80.0, 180.0), [50.0, 300.0]),
        ("tall 120/700", symmetric(120.0, 700.0), [300.0, 1500.0]),
        ("leaning, uneven towers", uneven, [150.0, 550.0]),
    ]
}

/// Those with this drive, and the limits of their joints, radians or mm.
///
/// # Panics
/// Never: the limits are some.
pub fn geometries_of(drive: Drive) -> Vec<(&'static str, Robot<f64>, JointLimits<f64>)> {
    let rotary = geometries().into_iter();
    let linear = linear_geometries().into_iter();
    match drive {
        Drive::Rotary => rotary
            .map(|(name, robot)| (name, robot, paper_limits()))
            .collect(),
        Drive::Linear => linear
            .map(|(name, robot, [low, high])| {
                let limits = JointLimits::travel(low, high).expect("the limits are valid");
                (name, robot, limits)
            })
            .collect(),
    }
}

/// Those with either drive.
pub fn all_geometries() -> Vec<(&'static str, Robot<f64>, JointLimits<f64>)> {
    [Drive::Rotary, Drive::Linear].map(geometries_of).concat()
}

/// Number of poses over which a robot's accuracy is evaluated.
const JUDGED: usize = 30;

/// Sensitivity of positions to the parameters; if `relative`, without what a common rigid motion explains.
///
/// # Panics
/// The robot has no poses.
pub fn judged(
    robot: &Robot<f64>,
    limits: &JointLimits<f64>,
    relative: bool,
    rng: &mut impl Rng,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(3 * JUDGED, 24);
    let mut motions = DMatrix::zeros(3 * JUDGED, 6);
    let mut row = 0;
    while row < 3 * JUDGED {
        let pose = random_pose(robot, limits, rng).expect("a pose");
        let Some(own) = position_jacobian(robot, &pose.joints) else {
            continue;
        };
        jacobian.view_mut((row, 0), (3, 24)).copy_from(&own);
        motions.view_mut((row, 0), (3, 3)).fill_with_identity();
        motions
            .view_mut((row, 3), (3, 3))
            .copy_from(&-pose.position.cross_matrix());
        row += 3;
    }
    if !relative {
        return jacobian;
    }
    let normal = motions.transpose() * &motions;
    let motion = normal.try_inverse().expect("spread poses") * motions.transpose() * &jacobian;
    jacobian - motions * motion
}

/// The difference of all parameters.
pub fn difference(robot: &Robot<f64>, truth: &Robot<f64>) -> DVector<f64> {
    let [a, b] =
        [robot, truth].map(|own| DVector::from_column_slice(own.parameters().as_flattened()));
    a - b
}

/// d = f/(2 Lb) of an arm, the distance along the forearm of the robot before calibration, and ∂d/∂P.
pub fn distances(
    nominal: &Robot<f64>,
    index: ArmIndex,
    arm: &Arm<f64>,
    samples: &[Sample<f64>],
) -> (DVector<f64>, OMatrix<f64, Dyn, U8>) {
    let unit = 2.0 * nominal.arm(index).lb();
    let mut distances = DVector::zeros(samples.len());
    let mut jacobian = OMatrix::<f64, Dyn, U8>::zeros(samples.len());
    for (k, sample) in samples.iter().enumerate() {
        let q = sample.joints[index.index()];
        distances[k] = arm.constraint(&sample.position, q) / unit;
        let row = arm.constraint_by_parameters(&sample.position, q) / unit;
        jacobian.set_row(k, &row.transpose());
    }
    (distances, jacobian)
}

/// Inverts an information matrix of lengths and angles; scaled first, since they differ by a factor of some hundred.
fn inverse_of(information: &SMatrix<f64, 24, 24>) -> Option<SMatrix<f64, 24, 24>> {
    let scale = information.map_diagonal(|entry| entry.sqrt().recip());
    let scale = SMatrix::<f64, 24, 24>::from_diagonal(&scale);
    let inverse = (scale * information * scale).try_inverse()?;
    Some(scale * inverse * scale)
}
