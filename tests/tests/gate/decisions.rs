//! Which samples are rejected: gross outliers, none without an estimate, the same in single precision.

use crate::gate::{DEGREE, Stream, noise, robot, stated};
use delta_cal::stream::{Gate, Untested, Verdict};
use delta_cal::{Calibrator, Noise, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::{generator, measurements, paper_robot, to_single, uniform};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

/// Evenly on the unit sphere.
fn direction(rng: &mut Pcg32) -> Vector3<f64> {
    let z = uniform(rng);
    let (sin, cos) = (std::f64::consts::PI * uniform(rng)).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    Vector3::new(radius * cos, radius * sin, z)
}

/// A position 5 to 50 mm off in any direction.
fn slipped(sample: &Sample<f64>, rng: &mut Pcg32) -> Sample<f64> {
    Sample {
        position: sample.position + direction(rng) * (27.5 + 22.5 * uniform(rng)),
        ..*sample
    }
}

/// One in five is wrong, from the n-th sample on: how many of those are rejected, how many good ones.
#[test]
fn gross_outliers_are_rejected_once_a_few_samples_are_in() {
    let settings = stated(0.5, 0.2 * DEGREE);
    for after in [0, 8, 12, 20] {
        let (mut wrong, mut found, mut good, mut falsely) = (0, 0, 0, 0);
        let (mut alarms, mut error, mut clean_error) = (0, 0.0, 0.0);
        for number in 0..400 {
            let mut rng = generator(910, number);
            let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
            let mut stream = Stream::new(&settings);
            let mut clean = Calibrator::new(&paper_robot(), &settings);
            for (index, sample) in measurements(&truth, 60, Some(&noise()), &mut rng)
                .iter()
                .enumerate()
            {
                let spoilt = index >= after && index % 5 == 4;
                if spoilt {
                    let verdict = stream.add(&slipped(sample, &mut rng));
                    wrong += 1;
                    found += u32::from(matches!(verdict, Verdict::Rejected(_)));
                } else {
                    good += 1;
                    clean.add(sample).unwrap();
                    falsely += u32::from(matches!(stream.add(sample), Verdict::Rejected(_)));
                }
            }
            let alarmed = stream.gate.alarm().is_some();
            alarms += u32::from(alarmed);
            if !alarmed && let Ok(outcome) = stream.calibrator.solve() {
                let sum = |robot: &Robot<f64>| -> f64 {
                    let differences = delta_cal_tests::parameter_differences(robot, &truth);
                    differences.iter().map(|error| error * error).sum()
                };
                error += sum(&outcome.robot);
                clean_error += sum(&clean.solve().unwrap().robot);
            }
        }
        println!(
            "| {after} | {found} of {wrong} | {falsely} of {good} | {alarms} of 400 | {:.3} |",
            (error / clean_error).sqrt(),
        );
        // Before as many samples as there are parameters the prior alone may let one in.
        if after >= 8 {
            assert_eq!((found, alarms), (wrong, 0));
            assert!(falsely <= 2, "{falsely}");
        } else {
            assert!(f64::from(found) > 0.999 * f64::from(wrong));
        }
        assert!(error < 1.01 * 1.01 * clean_error);
    }
}

#[test]
fn without_prior_and_estimate_the_gate_takes_everything_and_says_so() {
    let settings = Settings::default().with_noise(noise());
    let mut rng = generator(914, 0);
    let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
    let mut calibrator = Calibrator::new(&paper_robot(), &settings);
    let mut gate = Gate::new(&mut calibrator);
    for (index, sample) in measurements(&truth, 30, Some(&noise()), &mut rng)
        .iter()
        .enumerate()
    {
        let verdict = gate.add(&mut calibrator, sample).unwrap();
        assert_eq!(gate.wants_estimate(), index == 11 || index == 23, "{index}");
        assert_eq!(verdict, Verdict::Untested(Untested::NoEstimate));
    }
    let outcome = calibrator.solve().unwrap();
    gate.adopt(&mut calibrator, &outcome);
    assert!(!gate.wants_estimate());
    let [sample, wrong] = &measurements(&truth, 2, Some(&noise()), &mut rng)[..] else {
        panic!("two samples")
    };
    assert!(matches!(
        gate.add(&mut calibrator, sample),
        Ok(Verdict::Taken(_))
    ));
    let mut wrong = *wrong;
    wrong.joints[1] += 2.0 * DEGREE;
    let Ok(Verdict::Rejected(innovation)) = gate.add(&mut calibrator, &wrong) else {
        panic!("it is not rejected")
    };
    // A joint angle spoils one arm.
    assert_eq!(innovation.arm.index(), 1);
    assert_eq!(gate.counts().rejected_by_arm, [0, 1, 0]);
    assert_eq!((gate.counts().taken, gate.counts().untested), (31, 30));
    assert_eq!(calibrator.samples(), 31);
    // A faulty number changes nothing.
    wrong.position.x = f64::NAN;
    let before = gate;
    assert!(gate.add(&mut calibrator, &wrong).is_err());
    assert_eq!(gate, before);
}

/// A long stream in single precision is judged as in double.
#[test]
fn single_precision_decides_as_double() {
    let settings = stated(0.5, 0.2 * DEGREE);
    let single = Settings::default()
        .with_noise(Noise::<f32>::new(0.02, 3.490_658_5e-5).unwrap())
        .with_tolerance(Tolerance::<f32>::new(0.5, 3.490_658_5e-3).unwrap());
    let (mut samples, mut otherwise, mut apart) = (0, 0, 0.0_f64);
    for number in 0..20 {
        let mut rng = generator(916, number);
        let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
        let mut wide = Stream::new(&settings);
        let mut narrow = Calibrator::<f32>::new(&paper_robot(), &single);
        let mut gate = Gate::new(&mut narrow);
        let mut measured = measurements(&truth, 5000, Some(&noise()), &mut rng);
        for sample in measured.iter_mut().skip(30).step_by(50) {
            *sample = slipped(sample, &mut rng);
        }
        for (sample, rounded) in measured.iter().zip(to_single(&measured)) {
            let a = wide.add(sample);
            let b = gate.add(&mut narrow, &rounded).unwrap();
            samples += 1;
            match (a, b) {
                (Verdict::Taken(a), Verdict::Taken(b)) if a.arm == b.arm => {
                    apart = apart.max((a.normalized - f64::from(b.normalized)).abs());
                }
                (Verdict::Taken(_), Verdict::Taken(_))
                | (Verdict::Rejected(_), Verdict::Rejected(_)) => {}
                _ => otherwise += 1,
            }
        }
    }
    println!(
        "f32 and f64: {otherwise} of {samples} samples decided otherwise; taken ones at most \
         {apart:.3} sigma apart"
    );
    assert_eq!(otherwise, 0);
    // Half an ε of a position of 600 mm is 0.04 µm, some ten of them in f: 2 % of σ.
    assert!(apart < 0.05, "{apart}");
}
