use super::robots::{paper, perturbed, reach, symmetric, uniform};
use delta_cal::Robot;
use delta_cal::simulate::random_pose;
use delta_cal_host::geometry::reach::Limit;
use delta_cal_host::workspace::nearest_singularity;
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

fn unit(rng: &mut Pcg32) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| uniform(rng));
        if v.norm() > 0.1 && v.norm() < 1.0 {
            return v.normalize();
        }
    }
}

/// Whether every arm reaches, elbows out, and the volume that the forearms span has this sign.
fn regular(robot: &Robot<f64>, x: &Vector3<f64>, sign: f64) -> bool {
    robot
        .inverse(x)
        .is_ok_and(|q| volume(robot, x, &q) * sign > 0.0)
}

fn volume(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> f64 {
    let [w1, w2, w3] = [0, 1, 2].map(|arm| x - robot.arms()[arm].elbow(q[arm]));
    w1.dot(&w2.cross(&w3))
}

#[test]
fn the_nearest_singularity_is_singular_and_no_other_is_nearer() {
    let mut rng = Pcg32::seed_from_u64(21);
    let limits = reach(-70.0, 100.0, None).limits;
    // The second one's forearms come near to one plane.
    let nominal = [paper(), symmetric(250.0, 300.0, 450.0)];
    let (mut serial, mut parallel) = (0, 0);
    for number in 0..300 {
        let robot = perturbed(&nominal[number % 2], &mut rng, 20.0, 5.0);
        let Ok(pose) = random_pose(&robot, &limits, &mut rng) else {
            panic!("robot {number} has poses");
        };
        let (x, q) = (pose.position, pose.joints);
        if robot
            .inverse(&x)
            .is_ok_and(|out| (0..3).any(|arm| (out[arm] - q[arm]).abs() > 1e-6))
        {
            continue; // An elbow is in: `regular` asks for elbows out.
        }
        let sign = volume(&robot, &x, &q).signum();
        let regular = |x: Vector3<f64>| regular(&robot, &x, sign);
        let nearest = nearest_singularity(&robot, &x, &q);
        assert!((nearest.position - x).norm() - nearest.distance < 1e-6);
        // Just before it is regular, just beyond it is not.
        let way = (nearest.position - x) / nearest.distance;
        assert!(regular(x + way * (nearest.distance - 1e-3)), "{nearest:?}");
        assert!(!regular(x + way * (nearest.distance + 1e-3)), "{nearest:?}");
        match nearest.kind {
            Limit::Serial(_) => serial += 1,
            _ => parallel += 1,
        }
        // The rays that find a parallel singularity are some 20° apart: what is nearer by less
        // than 2 % can be missed.
        for _ in 0..3000 {
            let nearer = x + unit(&mut rng) * (0.98 * nearest.distance);
            assert!(regular(nearer), "robot {number}: {nearest:?}");
        }
    }
    println!("{serial} serial, {parallel} parallel");
    assert!(serial > 50 && parallel > 10);
}

#[test]
fn stretched_along_the_axis_the_distance_is_in_closed_form() {
    let robot = paper();
    // Straight below the base, the arms are stretched at √((260 + 480)² − 164²); on the way there
    // the nearest stretched pose is on the line from the motor: 740 less the distance from it.
    let x = Vector3::new(0.0, 0.0, -700.0);
    let q = robot.inverse(&x).unwrap();
    let nearest = nearest_singularity(&robot, &x, &q);
    let elbow = 700f64.hypot(164.0) - 260.0;
    let expected = 480.0 - elbow;
    println!("{nearest:?} {expected}");
    assert!(nearest.distance <= expected + 1e-9);
    if matches!(nearest.kind, Limit::Serial(_)) {
        assert!((nearest.distance - expected).abs() < 1e-9);
    }
}
