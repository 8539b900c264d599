//! Every hand-written derivative against dual numbers (`num-dual`, on the model written anew) and
//! against finite differences of the functions themselves.

use delta_cal::robot::Drive;
use delta_cal::{Robot, Sample};
use delta_cal_tests::geometries::{geometries_of, position_jacobian};
use delta_cal_tests::{
    Spread, generator, measurements, measurements_within, paper_robot, perturbed,
};
use nalgebra::Vector3;
use num_dual::{Dual64, DualNum};

/// f(P; X, q) from the equations of the model, for any number type.
fn constraint<D: DualNum<Primitive = f64> + Copy>(p: &[D; 8], x: &[D; 3], q: D) -> D {
    let [dx, dy, dz, theta, tilt, la_x, la_y, lb] = *p;
    let zero = D::from(0.0);
    let ex = [theta.cos(), theta.sin(), zero];
    let ez = [
        theta.sin() * tilt.sin(),
        -(theta.cos() * tilt.sin()),
        tilt.cos(),
    ];
    let radial = la_x * q.cos() + la_y * q.sin();
    let up = la_y * q.cos() - la_x * q.sin();
    let d = [dx, dy, dz];
    let mut squared = zero;
    for axis in 0..3 {
        let w = x[axis] - (d[axis] + ex[axis] * radial + ez[axis] * up);
        squared += w * w;
    }
    squared - lb * lb
}

/// Derivatives of the dual-number model by all of P (8), X (3) and q (1).
fn dual_gradient(p: &[f64; 8], x: &[f64; 3], q: f64) -> [f64; 12] {
    std::array::from_fn(|by| {
        let number = |place: usize, value: f64| {
            let own = Dual64::from(value);
            if place == by { own.derivative() } else { own }
        };
        let p = std::array::from_fn(|k| number(k, p[k]));
        let x = std::array::from_fn(|k| number(8 + k, x[k]));
        constraint(&p, &x, number(11, q)).eps
    })
}

fn random_cases(campaign: u64) -> impl Iterator<Item = (Robot<f64>, Sample<f64>)> {
    (0..200).map(move |robot| {
        let mut rng = generator(campaign, robot);
        let truth = perturbed(&paper_robot(), 20.0, 0.1, Spread::Uniform, &mut rng);
        let sample = measurements(&truth, 1, None, &mut rng)[0];
        (truth, sample)
    })
}

#[test]
fn constraint_and_its_derivatives_equal_the_dual_number_model() {
    for (robot, sample) in random_cases(21) {
        // Off the constraint surface as well as on it.
        let x = sample.position + Vector3::new(3.0, -2.0, 1.0);
        for (arm, q) in robot.arms().iter().zip(sample.joints) {
            let p = arm.parameters();
            let coordinates = x.data.0[0];
            let value = constraint(&p, &coordinates, q);
            // Sums of squares of some 500 mm: ε · 500² ≈ 6e-11, a few operations deep.
            assert!((arm.constraint(&x, q) - value).abs() < 1e-9);
            let expected = dual_gradient(&p, &coordinates, q);
            let by_p = arm.constraint_by_parameters(&x, q);
            for k in 0..8 {
                assert!((by_p[k] - expected[k]).abs() < 1e-9, "parameter {k}");
            }
            let by_x = arm.constraint_by_position(&x, q);
            for k in 0..3 {
                assert!((by_x[k] - expected[8 + k]).abs() < 1e-10);
            }
            assert!((arm.constraint_by_joint(&x, q) - expected[11]).abs() < 1e-9);
        }
    }
}

/// Rotary and linear drives.
#[test]
fn platform_jacobians_equal_finite_differences_of_forward_kinematics() {
    let towers = geometries_of(Drive::Linear).into_iter().zip(0..);
    let towers = towers.flat_map(|((_, nominal, limits), index)| {
        let mut rng = generator(9101, index);
        let robot = perturbed(&nominal, 5.0, 5e-3, Spread::Normal, &mut rng);
        let samples = measurements_within(&robot, &limits, 20, None, &mut rng);
        samples
            .into_iter()
            .map(move |sample| (robot.clone(), sample))
    });
    for (robot, sample) in random_cases(22).chain(towers) {
        let (x, q) = (sample.position, sample.joints);
        let found = robot.platform_jacobian(&x, &q).unwrap();
        let expected = position_jacobian(&robot, &q).unwrap();
        for (arm, block) in found.by_parameters.iter().enumerate() {
            for (parameter, column) in block.column_iter().enumerate() {
                let off = (column - expected.column(8 * arm + parameter)).norm();
                // Central differences keep some seven digits; near singular poses there are fewer.
                assert!(
                    off < 1e-5 * (1.0 + column.norm()),
                    "{arm} {parameter}: {off}"
                );
            }
        }
        for (joint, column) in found.by_joints.column_iter().enumerate() {
            let moved = |by: f64| {
                let mut q = q;
                q[joint] += by;
                robot.forward(&q).unwrap()
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            // step²·f‴/6 ≈ 1e-10 · 1e3, near singular poses 1e2 more.
            assert!((slope - column).norm() < 1e-5 * (1.0 + column.norm()));
        }
    }
}
