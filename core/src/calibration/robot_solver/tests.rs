#![allow(clippy::unwrap_used)]

use super::check_side;
use crate::calibration::arm_problem::Means;
use crate::calibration::refusal::Refusal;
use crate::robot::SymmetricRobot;
use crate::samples::NominalArm;
use nalgebra::{Matrix3, Vector3};

/// Arms that are bent unequally: their mean elbows span a plane that is far from level. By how much the mean sample may
/// be above or below follows from the elbows' places, by trigonometry.
#[test]
fn the_mean_sample_must_lie_below_the_plane_of_the_mean_elbows() {
    let robot = SymmetricRobot::<f64>::PAPER;
    let (base, upper_arm) = (robot.base_radius - robot.platform_radius, robot.upper_arm);
    let robot = robot.robot().unwrap();
    let centre = Vector3::new(10.0, -20.0, -450.0);
    let nominal = robot
        .arms()
        .each_ref()
        .map(|arm| NominalArm::new(arm, &centre, None));
    let [first, second, third] = &nominal;
    // Means of cosines and sines, which no single angle need have.
    let bent = [[0.8, 0.6], [0.95, 0.28], [0.5, 0.8]];
    let azimuths = [0.0, 1.0, 2.0].map(|third| third * core::f64::consts::TAU / 3.0);
    let mut elbows = Matrix3::zeros();
    for (index, ([cosine, sine], azimuth)) in bent.into_iter().zip(azimuths).enumerate() {
        let out = base + upper_arm * cosine;
        let elbow = [
            out * libm::cos(azimuth),
            out * libm::sin(azimuth),
            -upper_arm * sine,
        ];
        elbows.set_row(index, &Vector3::from(elbow).transpose());
    }
    // z = c + a x + b y of all three.
    let mut known = elbows;
    known.set_column(2, &Vector3::repeat(1.0));
    let [a, b, c] = (known.try_inverse().unwrap() * elbows.column(2)).into();
    for (x, y) in [(0.0, 0.0), (150.0, 90.0), (-80.0, 200.0), (-120.0, -160.0)] {
        for (above, expected) in [(-1.0, Ok(())), (1.0, Err(Refusal::WrongSide))] {
            let point = Vector3::new(x, y, c + a * x + b * y + above);
            let means = bent.map(|[cosine, sine]| Means {
                x: (point - third.centre()) / third.scale(),
                spread: 1.0,
                sine,
                cosine,
            });
            assert_eq!(check_side(&robot, [first, second, third], means), expected);
        }
    }
}
