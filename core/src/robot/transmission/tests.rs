#![allow(clippy::unwrap_used)]

use super::{Transmission, by_numbers};
use crate::robot::{Arm, GeometryError, SymmetricRobot};

const NUMBERS: [f64; 5] = [0.012, -0.02, 0.015, 0.006, -0.01];

fn angles() -> impl Iterator<Item = f64> {
    (-31..=31).map(|step| 0.1 * f64::from(step))
}

/// The definition, with library functions of twice the angle.
#[test]
fn the_arm_turns_as_the_definition_says() {
    let transmission = Transmission::new(NUMBERS).unwrap();
    let [gain, c1, s1, c2, s2] = NUMBERS;
    for q in angles() {
        let expected = q
            + gain * q
            + c1 * q.cos()
            + s1 * q.sin()
            + c2 * (2.0 * q).cos()
            + s2 * (2.0 * q).sin();
        let (angle, slope) = transmission.arm_angle(q);
        assert!((angle - expected).abs() < 1e-15);
        let step = 1e-5;
        let [up, down] = [q + step, q - step].map(|q| transmission.arm_angle(q).0);
        // step² θ‴/6 and ε/step are 1e-11.
        assert!((slope - (up - down) / (2.0 * step)).abs() < 1e-10);
        let product: f64 = by_numbers(q).iter().zip(NUMBERS).map(|(a, b)| a * b).sum();
        assert!((angle - q - product).abs() < 1e-15);
    }
}

/// The largest numbers that are taken, one at a time and together, in both precisions.
#[test]
fn the_joint_angle_leads_back_to_the_arms() {
    for which in 0..6 {
        let mut numbers = [0.0; 5];
        match numbers.get_mut(which) {
            Some(number) => *number = if which < 3 { 0.0999 } else { -0.0499 },
            None => numbers = [0.019, -0.019, 0.019, 0.01, -0.01],
        }
        let double = Transmission::new(numbers).unwrap();
        #[allow(clippy::cast_possible_truncation)]
        let single = Transmission::new(numbers.map(|number| number as f32)).unwrap();
        for q in angles() {
            // Some roundings of a number below π.
            let found = double.joint_angle(double.arm_angle(q).0);
            assert!((found - q).abs() < 2e-15, "{which} {q} {found}");
            #[allow(clippy::cast_possible_truncation)]
            let q = q as f32;
            let found = single.joint_angle(single.arm_angle(q).0);
            assert!((found - q).abs() < 1e-6, "{which} {q} {found}");
        }
    }
}

#[test]
fn transmissions_that_are_not_nearly_exact_are_refused() {
    for numbers in [
        [0.1, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.05, 0.0],
        [0.03, -0.03, 0.03, 0.003, 0.003],
        [f64::NAN, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, f64::INFINITY],
    ] {
        let refused = Transmission::new(numbers);
        assert_eq!(refused, Err(GeometryError::TransmissionTooLarge));
    }
}

/// The robot with transmissions is the robot without them at other angles, in every function of it.
#[test]
fn a_robot_is_at_the_angles_of_its_arms() {
    let drawn = SymmetricRobot::PAPER.robot().unwrap();
    let transmissions = [
        NUMBERS,
        NUMBERS.map(|own| -own),
        NUMBERS.map(|own| 0.5 * own),
    ];
    let transmissions = transmissions.map(|numbers| Transmission::new(numbers).unwrap());
    let real = drawn.with_transmissions(transmissions).unwrap();
    assert_eq!(real.transmissions(), transmissions);
    let joints = [0.5, -0.1, 0.8];
    let mut angles = joints;
    let mut slopes = [1.0; 3];
    for ((angle, slope), own) in angles.iter_mut().zip(&mut slopes).zip(transmissions) {
        (*angle, *slope) = own.arm_angle(*angle);
    }
    let position = real.forward(&joints).unwrap();
    assert_eq!(position, drawn.forward(&angles).unwrap());
    for (found, expected) in real.inverse(&position).unwrap().iter().zip(joints) {
        assert!((found - expected).abs() < 1e-14);
    }
    let found = real.platform_jacobian(&position, &joints).unwrap();
    let expected = drawn.platform_jacobian(&position, &angles).unwrap();
    for (own, other) in found.by_parameters.iter().zip(expected.by_parameters) {
        assert_eq!(*own, other);
    }
    for (joint, slope) in slopes.iter().enumerate() {
        let expected = expected.by_joints.column(joint) * *slope;
        assert!((found.by_joints.column(joint) - expected).norm() < 1e-12);
    }
    // Central differences of the forward kinematics by each number.
    let by_numbers = real.by_transmissions(&position, &joints).unwrap();
    let step = 1e-6;
    for column in 0..15 {
        let [up, down] = [step, -step].map(|step| {
            let mut moved = transmissions.map(|own| own.numbers());
            moved
                .as_flattened_mut()
                .iter_mut()
                .skip(column)
                .take(1)
                .for_each(|own| *own += step);
            let moved = moved.map(|numbers| Transmission::new(numbers).unwrap());
            let robot = drawn.with_transmissions(moved).unwrap();
            robot.forward(&joints).unwrap()
        });
        // ε · 500 mm/step and step² X‴/6 are 1e-7.
        let expected = (up - down) / (2.0 * step);
        assert!((by_numbers.column(column) - expected).norm() < 1e-6);
    }
}

#[test]
fn an_arm_keeps_its_transmission_when_it_is_moved_or_cast() {
    let transmission = Transmission::new(NUMBERS).unwrap();
    let [arm, ..] = *SymmetricRobot::PAPER.robot().unwrap().arms();
    let arm = arm.with_transmission(transmission).unwrap();
    let moved = arm
        .with_parameters([160.0, 1.0, 2.0, 0.1, 0.0, 261.0, 1.0, 479.0])
        .unwrap();
    assert_eq!(moved.transmission(), Some(&transmission));
    let single = arm.cast::<f32>().unwrap();
    #[allow(clippy::cast_possible_truncation)]
    let expected = NUMBERS.map(|number| number as f32);
    assert_eq!(
        single.transmission(),
        Some(&Transmission::new(expected).unwrap())
    );
    // An exact one is none: the same arm as before.
    let [plain, ..] = *SymmetricRobot::PAPER.robot().unwrap().arms();
    assert_eq!(plain.with_transmission(Transmission::EXACT).unwrap(), plain);
}

#[cfg(feature = "linear")]
#[test]
fn a_linear_drive_has_no_transmission() {
    let arm = Arm::linear([140.0, 0.0, 0.0, 0.0, 0.0, 1.0, 330.0]).unwrap();
    let refused = arm.with_transmission(Transmission::new(NUMBERS).unwrap());
    assert_eq!(refused, Err(GeometryError::TransmissionTooLarge));
}
