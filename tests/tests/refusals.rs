//! A calibration is either good or refused with its cause and arm.

use delta_cal::calibration::{Ikm, Instrument, Joint};
use delta_cal::kinematics::JointLimits;
use delta_cal::observations::ObservationNoise;
use delta_cal::robot::GeometryError;
use delta_cal::simulate::made_robot;
use delta_cal::{
    ArmIndex, IkmCalibrator, Noise, Parameter, Real, Refusal, Robot, Sample, SettingError,
    Settings, Tolerance,
};
use delta_cal_tests::geometries::all_geometries;
use delta_cal_tests::{
    DEGREE, Spread, calibrated, converted, generator, measurements_within, paper_robot, size,
};
use nalgebra::Vector3;

fn robot_and_samples(
    seed: u64,
    count: usize,
    noise: Option<&Noise<f64>>,
) -> (Robot<f64>, Vec<Sample<f64>>) {
    let off = (1.0, 0.3 * DEGREE, Spread::Uniform);
    delta_cal_tests::robot_and_samples((81, seed), off, count, noise)
}

fn solve(samples: &[Sample<f64>], settings: &Settings<f64>) -> Result<(), Refusal> {
    calibrated::<_, Ikm>(&paper_robot(), samples, settings).map(|_| ())
}

#[test]
fn too_few_samples() {
    let (_, samples) = robot_and_samples(0, 11, None);
    let few = |samples, needed| {
        let arm = ArmIndex::First;
        Err(Refusal::TooFewSamples {
            arm,
            samples,
            needed,
        })
    };
    let usual = Settings::default();
    assert_eq!(solve(&samples[..7], &usual), few(7, 8));
    assert_eq!(solve(&samples, &usual.with_free_start(true)), few(11, 12));
    let tolerance = Settings::default()
        .with_tolerance(Tolerance::new(1.0, 0.3 * DEGREE).unwrap())
        .with_noise(Noise::new(0.01, 0.0).unwrap());
    assert_eq!(solve(&[], &tolerance), few(0, 1));
    assert_eq!(solve(&samples[..1], &tolerance), Ok(()));
    let mut calibrator = IkmCalibrator::new(&paper_robot(), &tolerance);
    calibrator.add_many(&samples).unwrap();
    calibrator.forget(0.0).unwrap();
    assert_eq!(calibrator.calibrate().map(|_| ()), solve(&[], &tolerance));
}

/// All in one pose, also without a guess; the second joint at rest; equal joint angles.
#[test]
fn poses_that_do_not_determine_the_parameters() {
    let (truth, _) = robot_and_samples(3, 1, None);
    let taken = |joints: &dyn Fn(f64) -> [f64; 3]| {
        let sample = |k: i32| {
            let joints = joints(f64::from(k));
            let position = truth.forward(&joints).unwrap();
            Sample { joints, position }
        };
        (0..30).map(sample).collect::<Vec<_>>()
    };
    let one_pose = taken(&|_| [0.2, 0.3, 0.4]);
    let still = taken(&|t| [0.5 * t.sin(), 0.2, 0.5 * (1.7 * t).cos()]);
    let equal = taken(&|k| [-0.5 + 0.05 * k; 3]);
    for (samples, free, expected) in [
        (&one_pose, false, ArmIndex::First),
        (&one_pose, true, ArmIndex::First),
        (&still, false, ArmIndex::Second),
        (&equal, false, ArmIndex::First),
    ] {
        let refusal = solve(samples, &Settings::default().with_free_start(free)).unwrap_err();
        assert!(
            matches!(refusal, Refusal::Undetermined { arm, .. } if arm == expected),
            "{refusal:?}"
        );
        assert_eq!(refusal.arm(), Some(expected));
    }
}

#[test]
fn noise_that_leaves_a_parameter_unknown() {
    // A metre of noise on a robot half that size, eight poses: σ beyond a tenth of the arm.
    let noise = Noise::new(30.0, 0.0).unwrap();
    let (_, samples) = robot_and_samples(4, 20, Some(&noise));
    let settings = Settings::default().with_noise(noise);
    assert!(matches!(
        solve(&samples, &settings),
        Err(Refusal::Uncertain { .. })
    ));
}

/// Exchanged joint columns describe a robot whose arms are numbered otherwise. Whether that is the
/// robot at hand only a tolerance can tell.
#[test]
fn a_swapped_pair_of_joint_columns_is_far_from_nominal() {
    let noise = Noise::new(0.01, 0.0).unwrap();
    let (_, mut samples) = robot_and_samples(6, 40, Some(&noise));
    for sample in &mut samples {
        sample.joints.swap(0, 1);
    }
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance(Tolerance::new(1.0, 0.3 * DEGREE).unwrap());
    let refusal = solve(&samples, &settings).unwrap_err();
    assert!(matches!(
        refusal,
        Refusal::FarFromNominal { .. } | Refusal::ResidualContradictsNoise { .. }
    ));
    assert_eq!(refusal.arm(), Some(ArmIndex::First));
}

/// What both calibrators from complete positions decide if a tolerance but no noise is stated.
fn balanced<T: Real>(
    nominal: &Robot<T>,
    samples: &[Sample<T>],
    tolerance: Tolerance<T>,
) -> [Result<(), Refusal>; 2] {
    let settings = Settings::default().with_tolerance(tolerance);
    let each_arm = calibrated::<_, Ikm>(nominal, samples, &settings);
    let together = calibrated::<_, Joint>(nominal, samples, &settings);
    [each_arm.map(|_| ()), together.map(|_| ())]
}

/// With a tolerance but no noise stated, the residuals of a mistake would be noise of tens of millimetres, which keeps
/// the robot near nominal. Honest noise as large as the tolerance of lengths is accepted.
#[test]
fn a_noise_beyond_the_tolerance_is_refused_and_one_within_it_never() {
    type Mistake = fn(&mut Sample<f64>);
    let mistakes: [(&str, Mistake); 4] = [
        ("exchanged joints", |sample| sample.joints.swap(0, 1)),
        ("x reversed", |sample| sample.position.x *= -1.0),
        ("joints reversed", |sample| {
            sample.joints = sample.joints.map(|q| -q);
        }),
        ("inches", |sample| sample.position /= 25.4),
    ];
    let (length, angle) = (0.5, 0.2 * DEGREE);
    for (index, (name, nominal, limits)) in (8200..).zip(all_geometries()) {
        let tolerance = Tolerance::new(length, angle).unwrap();
        let in_single = Tolerance::new(f32::from_f64(length), f32::from_f64(angle)).unwrap();
        for robot in 0..size(5, 100) {
            let mut rng = generator(index, robot);
            let truth = made_robot(&nominal, &tolerance, &mut rng).unwrap();
            let count = [1, 3, 12, 20, 40][robot as usize % 5];
            let mut measured = |sigma: f64| {
                let noise = Noise::new(sigma, 0.0).unwrap();
                measurements_within(&truth, &limits, count, Some(&noise), &mut rng)
            };
            let solve = |samples: &[Sample<f64>]| {
                let single = nominal.cast::<f32>().unwrap();
                let [a, b] = balanced(&nominal, samples, tolerance);
                let [c, d] = balanced(&single, &converted(samples), in_single);
                [a, b, c, d]
            };
            for sigma in [0.02, length] {
                let found = solve(&measured(sigma));
                assert_eq!(found, [Ok(()); 4], "{name}, robot {robot}, sigma {sigma}");
            }
            for (what, mistake) in mistakes.iter().filter(|_| count >= 12) {
                let mut samples = measured(0.02);
                samples.iter_mut().for_each(mistake);
                for found in solve(&samples) {
                    assert!(found.is_err(), "{name}, robot {robot}, {what}");
                }
            }
        }
    }
}

#[test]
fn samples_of_no_delta_robot_are_never_accepted_with_a_stated_noise() {
    for seed in 0..100 {
        let mut rng = generator(83, seed);
        let mut random = || delta_cal_tests::uniform(&mut rng);
        let samples: Vec<_> = (0..30)
            .map(|_| Sample {
                joints: [random(), random(), random()],
                position: Vector3::new(random(), random(), random() - 2.0) * 200.0,
            })
            .collect();
        for damped in [true, false] {
            let settings = Settings::default()
                .with_damping(damped)
                .with_noise(Noise::new(0.05, 0.01 * DEGREE).unwrap());
            assert!(solve(&samples, &settings).is_err(), "seed {seed} {damped}");
        }
    }
}

#[test]
fn noises_and_tolerances_that_are_none() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Noise::new(bad, 0.0), Err(SettingError::PositionNoise));
        assert_eq!(Tolerance::new(bad, 0.1), Err(SettingError::LengthTolerance));
        assert_eq!(Tolerance::new(0.1, bad), Err(SettingError::AngleTolerance));
        let tolerance = Tolerance::new(0.1, 0.1).unwrap();
        assert_eq!(
            tolerance.with(Parameter::Zero, bad),
            Err(SettingError::CarriageZeroTolerance)
        );
        assert_eq!(
            tolerance.with(Parameter::Scale, bad),
            Err(SettingError::ScaleTolerance)
        );
        let noise = ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), bad, 1.0);
        assert_eq!(noise, Err(SettingError::HeightNoise));
        let noise = ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), 1.0, bad);
        assert_eq!(noise, Err(SettingError::DistanceNoise));
    }
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Noise::new(1.0, bad), Err(SettingError::JointNoise));
        let tolerance = Tolerance::new(0.1, 0.1).unwrap();
        assert_eq!(
            tolerance.with_radius(bad),
            Err(SettingError::RadiusTolerance)
        );
    }
    for (least, most) in [(f64::NAN, 1.0), (1.0, f64::NAN), (1.0, f64::INFINITY)] {
        let limits = JointLimits::travel(least, most);
        assert_eq!(limits, Err(SettingError::JointLimitNonFinite));
    }
    assert_eq!(
        JointLimits::travel(1.0, 1.0),
        Err(SettingError::JointLimitsEmpty)
    );
}

/// An error's message, and words that its reader cannot do without.
fn says(error: &dyn core::error::Error, words: &[&str]) {
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "{message:?} without {word:?}");
    }
}

#[test]
fn refusals_name_the_arm_and_their_figures() {
    use Refusal::{FarFromNominal, ImpossibleGeometry, ImpossibleRobot, NonFinite, NotConverged};
    use Refusal::{ResidualContradictsNoise, TooFewSamples, Uncertain, Undetermined};
    let (arm, parameter) = (ArmIndex::Third, Parameter::LaX);
    let tilt = GeometryError::TiltTooLarge;
    #[rustfmt::skip]
    let of_an_arm: [(Refusal, &[&str]); 8] = [
        (TooFewSamples { arm, samples: 7, needed: 8 }, &["7", "8"]),
        (Undetermined { arm, parameter, condition: 3e9 }, &["La_x", "3.0e9"]),
        (Uncertain { arm, parameter, sigma: 0.25 }, &["La_x", "2.500e-1"]),
        (NotConverged { arm, iterations: 50 }, &["50"]),
        (ResidualContradictsNoise { arm: Some(arm), ratio: 12.34 }, &["12.3"]),
        (FarFromNominal { arm, parameter, tolerances: 9.87 }, &["La_x", "9.9"]),
        (ImpossibleGeometry { arm, error: tilt }, &["alpha"]),
        (NonFinite { arm }, &["overflow"]),
    ];
    for (refusal, words) in of_an_arm {
        says(&refusal, words);
        says(&refusal, &["arm 3"]);
        assert_eq!(refusal.arm(), Some(arm));
    }
    let parameters = 39;
    let of_none: [(Refusal, &str); 4] = [
        (
            Refusal::TooManyUnknowns { parameters },
            "39 parameters, or for more than 4 planes",
        ),
        (ImpossibleRobot(GeometryError::NoCommonUp), "up"),
        (Refusal::WrongSide, "upside down"),
        (Refusal::Unfinished, "not finished"),
    ];
    for (refusal, word) in of_none {
        says(&refusal, &[word]);
        assert_eq!(refusal.arm(), None);
    }
}

#[test]
fn instruments_are_named_with_their_number() {
    let named = [
        (Instrument::Frame, "frame"),
        (Instrument::Plane(2), "plane 2"),
        (Instrument::Point(5), "point 5"),
        (Instrument::Transmission(ArmIndex::Second), "arm 2"),
    ];
    for (instrument, words) in named {
        assert!(instrument.to_string().contains(words), "{instrument}");
        says(&Refusal::UndeterminedInstrument(instrument), &[words]);
    }
}
