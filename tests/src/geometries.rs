//! Robots of other proportions than the paper's.

use crate::closures::inverse_of;
use delta_cal::robot::Arm;
use delta_cal::{Noise, Robot, Sample, SymmetricRobot, Tolerance};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Base radius, platform radius, upper arm and forearm, mm.
const SYMMETRIC: [(&str, [f64; 4]); 6] = [
    ("paper 194/30/260/480", [194.0, 30.0, 260.0, 480.0]),
    ("large 200/45/235/800", [200.0, 45.0, 235.0, 800.0]),
    ("tall 60/40/400/900", [60.0, 40.0, 400.0, 900.0]),
    ("wide platform 60/110/250/520", [60.0, 110.0, 250.0, 520.0]),
    ("short 150/60/250/275", [150.0, 60.0, 250.0, 275.0]),
    ("tiny 60/25/80/180", [60.0, 25.0, 80.0, 180.0]),
];

/// Eight robots, each with its name: small, large, tall, with a platform larger than the base, with short
/// forearms, with three different arms, and with tilted motor axes. Lengths in mm.
pub fn geometries() -> Vec<(&'static str, Robot<f64>)> {
    let mut robots: Vec<_> = SYMMETRIC
        .iter()
        .map(
            |(name, [base_radius, platform_radius, upper_arm, forearm])| {
                let robot = SymmetricRobot {
                    base_radius: *base_radius,
                    platform_radius: *platform_radius,
                    upper_arm: *upper_arm,
                    forearm: *forearm,
                };
                (*name, robot.robot().expect("the robot is valid"))
            },
        )
        .collect();
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

/// The Cramér–Rao bound of all 24 parameters (lengths in mm, angles in rad) from three coordinates a
/// sample, the tolerance counted as a prior. By central differences of forward kinematics and a dense
/// inverse, so that it shares nothing with what it is compared with.
pub fn bound(
    truth: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<SMatrix<f64, 24, 24>> {
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
        for index in 0..24 {
            let parameter = delta_cal::Parameter::ROTARY[index % 8];
            information[(index, index)] += tolerance.of(parameter).powi(-2);
        }
    }
    inverse_of(&information)
}

/// ∂X/∂P by central differences: mm per mm, mm per rad. `None` where the pose is out of reach.
pub fn position_jacobian(robot: &Robot<f64>, joints: &[f64; 3]) -> Option<SMatrix<f64, 3, 24>> {
    let mut jacobian = SMatrix::<f64, 3, 24>::zeros();
    for index in 0..24 {
        let at = |by: f64| -> Option<Vector3<f64>> {
            let mut parameters = robot.parameters();
            parameters[index / 8][index % 8] += by;
            Robot::from_parameters(parameters)
                .ok()?
                .forward(joints)
                .ok()
        };
        let step = if matches!(index % 8, 3 | 4) {
            1e-6
        } else {
            1e-4
        };
        jacobian.set_column(index, &((at(step)? - at(-step)?) / (2.0 * step)));
    }
    Some(jacobian)
}
