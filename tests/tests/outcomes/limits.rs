//! The limits beyond which a calibration is refused.

use crate::outcomes::{calibrate, case, sums};
use delta_cal::calibration::limits::chi_square_quantile;
use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Noise, Parameter, Refusal, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::{generator, measurements, paper_robot};

/// Twice the quantile, with n − 8 degrees of freedom: just within it is accepted, just beyond refused.
#[test]
fn a_stated_noise_is_contradicted_beyond_twice_the_quantile() {
    let (_, samples) = case(21, 20);
    let outcome = calibrate(&samples, &Settings::default()).unwrap();
    // The largest Σd² of the three arms decides.
    let largest = ArmIndex::ALL
        .into_iter()
        .zip(&outcome.arms)
        .map(|(index, arm)| sums(&arm.arm, index, &samples).0)
        .fold(0.0, f64::max);
    let with = |share: f64, freedom: f64, tolerance: Option<Tolerance<f64>>| {
        let cost = 2.0 * chi_square_quantile(freedom) * share;
        let settings = Settings::default()
            .with_noise(Noise::new((largest / cost).sqrt(), 0.0).unwrap())
            .with_tolerance(tolerance);
        (cost, calibrate(&samples, &settings))
    };
    assert!(with(0.98, 12.0, None).1.is_ok());
    let (cost, refused) = with(1.02, 12.0, None);
    let Err(Refusal::ResidualContradictsNoise { ratio, .. }) = refused else {
        panic!("{refused:?}");
    };
    assert!((f64::from(ratio) / (cost / 12.0).sqrt() - 1.0).abs() < 1e-3);
    // With a tolerance there are as many as samples, less what it costs: so wide that it costs nothing.
    let wide = Some(Tolerance::new(50.0, 0.5).unwrap());
    assert!(with(0.97, 20.0, wide).1.is_ok());
    assert!(matches!(
        with(1.03, 20.0, wide).1,
        Err(Refusal::ResidualContradictsNoise { .. })
    ));
}

/// Without a stated noise no residual is judged; how far a parameter is from nominal still is.
#[test]
fn six_tolerances_are_the_limit_with_and_without_a_stated_noise() {
    let off = |index: usize, by: f64| {
        let mut arms = *paper_robot::<f64>().arms();
        let mut p = arms[1].parameters();
        p[index] += by;
        arms[1] = Arm::new(p).unwrap();
        let truth = Robot::new(arms).unwrap();
        measurements(&truth, 30, None, &mut generator(642, 0))
    };
    for noise in [None, Some(Noise::new(1e-4, 0.0).unwrap())] {
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(Tolerance::new(0.1, 0.001).unwrap());
        for (index, tolerance) in [(2, 0.1), (4, 0.001), (7, 0.1)] {
            assert!(calibrate(&off(index, 4.0 * tolerance), &settings).is_ok());
            let refused = calibrate(&off(index, -12.0 * tolerance), &settings);
            let Err(Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances,
            }) = refused
            else {
                panic!("{refused:?}");
            };
            assert_eq!(arm, ArmIndex::Second);
            assert_eq!(parameter, Parameter::ROTARY[index]);
            assert!((tolerances - 12.0).abs() < 0.2, "{tolerances}");
        }
    }
}

/// The other intersection of the forearms' spheres, above the plane of the elbows: the constraints hold,
/// and the robot never gets there.
fn above_the_elbows(robot: &Robot<f64>, joints: [f64; 3]) -> Option<Sample<f64>> {
    let below = robot.forward(&joints).ok()?;
    let [first, second, third] = robot.arms();
    let corner = first.elbow(joints[0]);
    let normal = (second.elbow(joints[1]) - corner)
        .cross(&(third.elbow(joints[2]) - corner))
        .normalize();
    let position = below - normal * (2.0 * normal.dot(&(below - corner)));
    Some(Sample { joints, position })
}

#[test]
fn a_platform_above_its_elbows_is_refused_wherever_they_are() {
    let nominal = paper_robot::<f64>();
    for centre in [-0.6, 0.0, 0.5, 1.1] {
        let mut rng = generator(643, 0);
        let mut samples = Vec::new();
        while samples.len() < 20 {
            let joints = [(); 3].map(|()| centre + 0.4 * delta_cal_tests::uniform(&mut rng));
            samples.extend(above_the_elbows(&nominal, joints));
        }
        assert_eq!(
            calibrate(&samples, &Settings::default()),
            Err(Refusal::WrongSide)
        );
        // Below them the same joint angles are accepted.
        for sample in &mut samples {
            sample.position = nominal.forward(&sample.joints).unwrap();
        }
        assert!(calibrate(&samples, &Settings::default()).is_ok());
    }
}
