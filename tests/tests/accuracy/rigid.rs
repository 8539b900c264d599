//! The rigid motion that the intrinsic error leaves out, against Kabsch's.

use delta_cal::frame::RigidTransform;
use delta_cal_host::accuracy::evaluation::Evaluation;
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};

#[test]
fn the_intrinsic_error_is_what_the_best_rigid_alignment_leaves() {
    let nominal = paper_robot();
    for number in 0..20 {
        let mut rng = generator(132, number);
        let truth = perturbed(&nominal, 5e-3, 3e-5, Spread::Normal, &mut rng);
        let joints: Vec<_> = measurements(&truth, 50, None, &mut rng)
            .iter()
            .map(|sample| sample.joints)
            .collect();
        let evaluation = Evaluation {
            truth: &truth,
            before: &nominal,
            after: &nominal,
        };
        let found = evaluation.position_error_before(&joints);
        let pairs: Vec<_> = joints
            .iter()
            .map(|q| (nominal.forward(q).unwrap(), truth.forward(q).unwrap()))
            .collect();
        let motion = RigidTransform::align(pairs.iter().copied()).unwrap();
        let left = pairs
            .iter()
            .map(|(from, to)| (motion.apply(from) - to).norm_squared());
        let expected = (left.sum::<f64>() / 50.0).sqrt();
        // Of an angle θ the linear motion leaves θ²/2: of some 3e-5 rad, a part of 1e-5 of the error.
        assert!((found.intrinsic_rms / expected - 1.0).abs() < 1e-3);
        assert!(found.intrinsic_rms < found.rms);
    }
}
