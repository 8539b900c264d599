//! The gate in the stream: how often it rejects a good sample, how surely a wrong one, and how soon it
//! says that the robot has changed.

use delta_cal::calibration::Ikm;
use delta_cal::samples::SampleError;
use delta_cal::stream::{Forgetting, GateCounts, Innovation, Selection, StreamCalibrator, Verdict};
use delta_cal::{
    Busy, IkmCalibrator, Noise, Progress, Real, Refusal, Robot, RobotOutcome, Sample, SettingError,
    Settings, Tolerance,
};
use delta_cal_tests::{
    DEGREE, Spread, converted, generator, measurements, noise, paper_robot, perturbed, size,
    uniform,
};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

/// Noise and tolerance stated, the robot drawn by them.
fn stated(length: f64, angle: f64) -> Settings<f64> {
    Settings::default()
        .with_noise(noise())
        .with_tolerance(Tolerance::new(length, angle).unwrap())
}

fn robot(length: f64, angle: f64, rng: &mut Pcg32) -> Robot<f64> {
    perturbed(&paper_robot(), length, angle, Spread::Normal, rng)
}

/// A gated stream, which solves its estimate when it is asked to.
struct Stream<T: Real = f64>(StreamCalibrator<T, Ikm>);

impl<T: Real> Stream<T> {
    fn new(settings: &Settings<T>) -> Self {
        let gated = Selection {
            gated: true,
            forgetting: None,
        };
        Self(StreamCalibrator::new(&paper_robot(), settings, &gated))
    }

    fn add(&mut self, sample: &Sample<T>) -> Verdict<T> {
        let verdict = self.0.add(sample).unwrap();
        while self.0.step() == Progress::Working {}
        verdict
    }

    fn innovations(&self, sample: &Sample<T>) -> Result<[Innovation<T>; 3], Verdict<T>> {
        self.0.innovations(sample)
    }

    fn counts(&self) -> &GateCounts {
        self.0.gate_counts().unwrap()
    }

    fn solve(&mut self) -> Result<RobotOutcome<T>, Refusal> {
        self.0.solve()?;
        while self.0.step() == Progress::Working {}
        self.0.outcome().cloned()
    }
}

/// Σ λᵏ = N + 1, of which a sample k ago is λᵏ.
#[test]
fn a_memory_is_a_forgetting_factor() {
    for (samples, factor) in [(1.0_f64, 0.5_f64), (49.0, 0.98), (999.0, 0.999)] {
        let memory = Forgetting::new(samples).unwrap();
        assert!((memory.factor() - factor).abs() < 1e-15);
        assert!((memory.mean_age() - samples).abs() < 1e-12);
    }
    assert_eq!(Forgetting::new(0.999), Err(SettingError::AgeTooShort));
    assert_eq!(Forgetting::new(f64::NAN), Err(SettingError::AgeTooShort));
    // ε of single precision is 2⁻²³: 2¹⁶ samples and no more.
    assert!(Forgetting::new(65_536.0_f32).is_ok());
    assert_eq!(Forgetting::new(65_540.0_f32), Err(SettingError::AgeTooLong));
}

#[test]
fn a_gate_has_a_width() {
    let mut rng = generator(660, 16);
    let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
    let all = measurements(&truth, 30, Some(&noise()), &mut rng);
    let rejected = |sigmas: f64| {
        let mut stream = Stream::new(&stated(0.5, 0.2 * DEGREE));
        for sigmas in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(stream.0.set_sigmas(sigmas), Err(SettingError::GateWidth));
        }
        stream.0.set_sigmas(sigmas).unwrap();
        for sample in &all {
            stream.add(sample);
        }
        stream.counts().rejected
    };
    assert_eq!(rejected(100.0), 0);
    assert!(rejected(0.5) > 15);
}

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
        let (mut wrong, mut found, mut falsely) = (0, 0, 0);
        let (mut alarms, mut error, mut clean_error) = (0, 0.0, 0.0);
        for number in 0..size(100, 400) {
            let mut rng = generator(910, number);
            let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
            let mut stream = Stream::new(&settings);
            let mut clean = IkmCalibrator::new(&paper_robot(), &settings);
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
                    clean.add(sample).unwrap();
                    falsely += u32::from(matches!(stream.add(sample), Verdict::Rejected(_)));
                }
            }
            let alarmed = stream.0.alarm().is_some();
            alarms += u32::from(alarmed);
            if !alarmed && let Ok(outcome) = stream.solve() {
                let sum = |robot: &Robot<f64>| -> f64 {
                    let differences = delta_cal_tests::parameter_differences(robot, &truth);
                    differences.iter().map(|error| error * error).sum()
                };
                error += sum(&outcome.robot);
                clean_error += sum(&clean.calibrate().unwrap().robot);
            }
        }
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
    let mut stream = Stream::new(&settings);
    for (index, sample) in measurements(&truth, 12, Some(&noise()), &mut rng)
        .iter()
        .enumerate()
    {
        assert_eq!(stream.0.add(sample), Ok(Verdict::NoEstimate));
        // The estimate is solved then.
        assert_eq!(stream.0.solving(), index == 11, "{index}");
    }
    let [sample, wrong] = &measurements(&truth, 2, Some(&noise()), &mut rng)[..] else {
        panic!("two samples")
    };
    assert_eq!(stream.0.add(sample), Err(SampleError::Busy(Busy)));
    while stream.0.step() == Progress::Working {}
    assert!(matches!(stream.add(sample), Verdict::Taken(_)));
    let mut wrong = *wrong;
    wrong.joints[1] += 2.0 * DEGREE;
    let Verdict::Rejected(innovation) = stream.add(&wrong) else {
        panic!("it is not rejected")
    };
    // A joint angle spoils one arm.
    assert_eq!(innovation.arm.index(), 1);
    assert_eq!(stream.counts().rejected_by_arm, [0, 1, 0]);
    assert_eq!((stream.counts().taken, stream.counts().untested), (13, 12));
    assert_eq!(stream.0.samples(), 14);
    // A faulty number changes nothing.
    wrong.position.x = f64::NAN;
    let before = *stream.counts();
    assert!(stream.0.add(&wrong).is_err());
    assert_eq!((*stream.counts(), stream.0.samples()), (before, 14));
}

/// A long stream in single precision is judged as in double.
#[test]
fn single_precision_decides_as_double() {
    let settings = stated(0.5, 0.2 * DEGREE);
    let single = Settings::default()
        .with_noise(Noise::<f32>::new(0.02, 3.490_658_5e-5).unwrap())
        .with_tolerance(Tolerance::<f32>::new(0.5, 3.490_658_5e-3).unwrap());
    let (mut samples, mut otherwise, mut apart) = (0, 0, 0.0_f64);
    for number in 0..size(5, 20) {
        let mut rng = generator(916, number);
        let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
        let mut wide = Stream::new(&settings);
        let mut narrow = Stream::new(&single);
        let mut measured = measurements(&truth, 5000, Some(&noise()), &mut rng);
        for sample in measured.iter_mut().skip(30).step_by(50) {
            *sample = slipped(sample, &mut rng);
        }
        for (sample, rounded) in measured.iter().zip(converted(&measured)) {
            let a = wide.add(sample);
            let b = narrow.add(&rounded);
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

/// A position that is measured too far from an elbow has a positive innovation there, one too near a negative one,
/// whether the noise is stated or not.
#[test]
fn the_sign_of_an_innovation_is_that_of_the_error() {
    for settings in [stated(0.5, 0.2 * DEGREE), Settings::default()] {
        let mut rng = generator(1190, 0);
        let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
        let mut stream = Stream::new(&settings);
        for sample in measurements(&truth, 60, Some(&noise()), &mut rng) {
            stream.add(&sample);
        }
        for next in measurements(&truth, 20, None, &mut rng) {
            for (index, (arm, q)) in truth.arms().iter().zip(next.joints).enumerate() {
                let away = (next.position - arm.elbow(q)).normalize();
                // Fifty times the noise.
                for by in [1.0, -1.0] {
                    let position = next.position + away * by;
                    let moved = Sample { position, ..next };
                    let found = stream.innovations(&moved).unwrap();
                    assert!(found[index].normalized * by > 0.0, "{:?}", found[index]);
                }
            }
        }
    }
}

/// Normalised innovations of good samples: mean square, and how many are beyond a number of σ.
#[derive(Debug, Default)]
struct Innovations {
    number: u32,
    sum: f64,
    beyond: [u32; 3],
    rejected: u64,
    samples: u64,
}

const SIGMAS: [f64; 3] = [2.0, 3.0, 4.0];
/// 2Φ(−z) of those.
const EXPECTED: [f64; 3] = [0.045_500, 0.002_699_8, 0.000_063_342];

fn innovations(campaign: u64, settings: &Settings<f64>, length: f64, angle: f64) -> Innovations {
    let mut found = Innovations::default();
    for number in 0..size(150, 300) {
        let mut rng = generator(campaign, number);
        let truth = robot(length, angle, &mut rng);
        let mut stream = Stream::new(settings);
        for sample in measurements(&truth, 120, Some(&noise()), &mut rng) {
            if let Ok(arms) = stream.innovations(&sample) {
                for arm in arms {
                    found.number += 1;
                    found.sum += arm.normalized.powi(2);
                    for (count, sigmas) in found.beyond.iter_mut().zip(SIGMAS) {
                        *count += u32::from(arm.normalized.abs() > sigmas);
                    }
                }
            }
            stream.add(&sample);
        }
        found.rejected += stream.counts().rejected;
        found.samples += 120;
    }
    found
}

/// The distribution of good samples' normalised innovations squared is χ² with one degree of freedom: so is
/// how often they are rejected.
#[test]
fn good_samples_are_rejected_as_often_as_chi_square_has_it() {
    let no_tolerance = Settings::default().with_noise(noise());
    for (what, campaign, settings, length, angle) in [
        (
            "noise, tolerance 0.5 mm/0.2°",
            900,
            stated(0.5, 0.2 * DEGREE),
            0.5,
            0.2 * DEGREE,
        ),
        (
            "noise, tolerance 2 mm/1°",
            901,
            stated(2.0, DEGREE),
            2.0,
            DEGREE,
        ),
        ("noise alone", 902, no_tolerance, 0.5, 0.2 * DEGREE),
        (
            "nothing stated",
            903,
            Settings::default(),
            0.5,
            0.2 * DEGREE,
        ),
    ] {
        let found = innovations(campaign, &settings, length, angle);
        let number = f64::from(found.number);
        let mean = found.sum / number;
        let [two, three, four] = found.beyond;
        let [of_two, of_three, of_four] = EXPECTED.map(|probability| number * probability);
        println!(
            "| {what} | {} | {mean:.3} | {two} ({of_two:.0}), {three} ({of_three:.0}), {four} \
                 ({of_four:.1}) | {} of {} |",
            found.number, found.rejected, found.samples
        );
        // The mean square of 100,000 numbers is known to √(2/1e5), three arms of one position to no
        // more than √3 times that; curvature adds a hundredth with the wide tolerance.
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
        for (found, expected) in found.beyond.iter().zip(EXPECTED) {
            let expected = number * expected;
            // √3 of the arms again, and 3.5 σ of a count.
            let off = (f64::from(*found) - expected).abs();
            assert!(off < 6.0 * expected.sqrt() + 0.03 * expected, "{found}");
        }
        // 2Φ(−4.685) = 2.8e-6 an arm: 0.3 in all.
        assert!(found.rejected <= 4, "{}", found.rejected);
    }
}

/// What a changed robot does, and after how many samples the gate says so.
#[test]
fn a_robot_that_changes_is_detected() {
    let (settings, robots) = (stated(0.5, 0.2 * DEGREE), size(60_u32, 300));
    for change in [0.05, 0.1, 0.2, 0.5, 2.0] {
        let (mut detected, mut delay, mut at_once, mut early) = (0, 0, 0, 0);
        for number in 0..robots {
            let mut rng = generator(911, number.into());
            let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
            // As after a crash: every parameter is off.
            let changed = perturbed(&truth, change, change / 260.0, Spread::Normal, &mut rng);
            let mut stream = Stream::new(&settings);
            for sample in measurements(&truth, 40, Some(&noise()), &mut rng) {
                stream.add(&sample);
            }
            early += u32::from(stream.0.alarm().is_some());
            for (index, sample) in measurements(&changed, 100, Some(&noise()), &mut rng)
                .iter()
                .enumerate()
            {
                stream.add(sample);
                if let Some(alarm) = stream.0.alarm() {
                    detected += 1;
                    delay += index as u64 + 1;
                    at_once += u32::from(alarm == Refusal::RobotChanged { first: 40 });
                    break;
                }
            }
        }
        println!(
            "| {change} mm | {detected} of {robots} | {:.1} | {at_once} |",
            delay as f64 / f64::from(detected).max(1.0),
        );
        assert_eq!(early, 0);
        if change >= 2.0 {
            assert!(
                detected == robots && delay < 10 * u64::from(robots),
                "{detected}, {delay}"
            );
        }
    }
}

/// 60 samples of a robot, solved, and 540 of one that has changed, each alarm acknowledged: with forgetting the stream follows it,
/// without it stays with the first.
#[test]
fn a_changed_robot_is_followed_with_forgetting_alone() {
    let at = |robot: &Robot<f64>| robot.forward(&[0.1, 0.2, -0.3]).unwrap();
    for case in 0..12 {
        let settings = Settings::default().with_noise((case < 6).then(noise));
        let change = [0.2, 1.0, 5.0][case / 2 % 3];
        let forgets = case % 2 == 1;
        let forgetting = forgets.then(|| Forgetting::new(50.0).unwrap());
        // A small change is not told from noise that nobody has stated.
        let told = forgets || change >= 1.0;
        let (mut rejected, mut error) = (0, 0.0_f64);
        for number in 0..20 {
            let mut rng = generator(917, number);
            let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
            let changed = perturbed(&truth, change, change / 260.0, Spread::Normal, &mut rng);
            let mut all = measurements(&truth, 60, Some(&noise()), &mut rng);
            all.extend(measurements(&changed, 540, Some(&noise()), &mut rng));
            let gated = Selection {
                gated: true,
                forgetting,
            };
            let mut stream = Stream(StreamCalibrator::new(&paper_robot(), &settings, &gated));
            for (index, sample) in all.iter().enumerate() {
                if index == 60 {
                    stream.solve().unwrap();
                }
                stream.add(sample);
                // Nothing comes of it, whatever was solved before, until that is answered.
                if let Some(alarm) = stream.0.alarm() {
                    assert_eq!(stream.solve(), Err(alarm));
                    assert_eq!(stream.0.outcome(), Err(alarm));
                    stream.0.acknowledge();
                }
            }
            rejected += stream.counts().rejected;
            if told {
                let now = at(if forgets { &changed } else { &truth });
                error = error.max((at(&stream.solve().unwrap().robot) - now).norm());
            }
        }
        println!("| {change} mm | {forgets} | {rejected} of 10,800 | {error:.3} mm |");
        assert!(!told || rejected == if forgets { 160 } else { 10_800 });
        assert!(error < 0.03, "{error}");
    }
}

/// The first few samples are wrong and the prior is wide enough to let them in: those that follow
/// disagree, and it is not said that the robot has changed.
#[test]
fn early_samples_that_are_wrong_are_not_taken_for_a_changed_robot() {
    let settings = stated(2.0, DEGREE);
    let (mut alarmed, mut as_early) = (0, 0);
    for number in 0..300 {
        let mut rng = generator(912, number);
        let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
        // Another robot altogether for the first ten samples.
        let other = robot(2.0, DEGREE, &mut rng);
        let mut stream = Stream::new(&settings);
        let first = measurements(&other, 10, Some(&noise()), &mut rng);
        for sample in first
            .iter()
            .chain(&measurements(&truth, 60, Some(&noise()), &mut rng))
        {
            stream.add(sample);
        }
        if let Some(alarm) = stream.0.alarm() {
            alarmed += 1;
            as_early += u32::from(matches!(alarm, Refusal::EarlySamplesWrong { .. }));
        }
    }
    println!(
        "{alarmed} of 300 streams were refused, {as_early} of them with the early samples named"
    );
    assert!(alarmed >= 295 && as_early >= 290, "{alarmed}, {as_early}");
}
