//! What the residuals say of the noise, against simulated noise that is known.

use crate::support::{Folder, NOMINAL, TOLERANCE, csv, exact, noisy, true_arms};
use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Robot};
use delta_cal_host::{
    CalibrationMethod, InputText, NoiseTest, NoiseVerdict, Options, RobotFile, SamplesFile,
    calibrate,
};
use delta_cal_tests::documents::print_campaign;
use delta_cal_tests::{Spread, paper_robot, size};
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use std::fmt::Write;

fn robots() -> u64 {
    size(40, 200)
}

/// Each with 95 %: of 200, 190 are expected, and 3 σ of a binomial distribution are 9.2; of 40, 38 and 4.1.
fn at_least() -> usize {
    size(34, 181)
}

/// mm.
const SIGMA: f64 = 0.05;

/// Every length off by up to `length` mm and every angle by up to `degrees`.
fn perturbed(length: f64, degrees: f64, rng: &mut Pcg32) -> Robot<f64> {
    let nominal = paper_robot();
    delta_cal_tests::perturbed(&nominal, length, degrees.to_radians(), Spread::Uniform, rng)
}

/// A robot measured at 30 poses with noise of `SIGMA`, and what is said of the noise.
///
/// `None` if it is refused.
fn tested(seed: u64, sections: &str, method: CalibrationMethod) -> Option<NoiseTest> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = perturbed(0.5, 0.2, &mut rng);
    let noise = Noise::new(SIGMA, 0.0).unwrap();
    let limits = JointLimits::new((-50_f64).to_radians(), 80_f64.to_radians()).unwrap();
    let mut text = crate::support::HEADER.to_owned();
    for _ in 0..30 {
        let pose = random_pose(&truth, &limits, &mut rng).unwrap();
        let sample = simulate_sample(&truth, &pose.joints, Some(&noise), &mut rng).unwrap();
        let [q1, q2, q3] = sample.joints.map(f64::to_degrees);
        let x = sample.position;
        writeln!(text, "{q1},{q2},{q3},{},{},{}", x.x, x.y, x.z).unwrap();
    }
    let robot = format!("{NOMINAL}{sections}");
    let robot = RobotFile::read(&InputText::new("robot.toml", &robot)).unwrap();
    let samples = SamplesFile::read(&InputText::new("samples.csv", &text), &robot.limits).unwrap();
    let options = Options {
        method,
        ..Options::default()
    };
    let report = calibrate(&robot, &samples, options).ok()?;
    Some(report.noise_test.unwrap())
}

#[test]
fn the_interval_of_an_estimated_noise_holds_the_true_one_as_often_as_it_says() {
    for method in [CalibrationMethod::Ikm, CalibrationMethod::Fkm] {
        let held = (0..robots())
            .filter(|seed| {
                let [low, high] = tested(*seed, "", method).unwrap().position.interval;
                low <= SIGMA && SIGMA <= high
            })
            .count();
        print_campaign(
            "docs/diagnosis.md",
            &format!("{}: {held} of {}", method.name(), robots()),
        );
        assert!(held >= at_least(), "{}: {held}", method.name());
    }
}

#[test]
fn a_noise_stated_as_it_is_agrees_and_others_do_not() {
    let stated = |sigma: f64| format!("\n[noise]\nposition_mm = {sigma}\njoint_deg = 0\n");
    for method in [CalibrationMethod::Ikm, CalibrationMethod::Fkm] {
        let (mut likely, mut agrees, mut judged) = (0, 0, 0);
        for seed in 0..robots() {
            let stated = |factor: f64| {
                let test = tested(seed, &stated(factor * SIGMA), method)?;
                Some(test.stated.unwrap())
            };
            let as_it_is = stated(1.0).unwrap();
            likely += usize::from(as_it_is.probability >= 0.05);
            agrees += usize::from(as_it_is.verdict == NoiseVerdict::Agrees);
            // Some are refused: the residuals of an arm are too large by far, or the samples that
            // are said to be so noisy are expected to make the robot worse.
            for (factor, verdict) in [
                (0.5, NoiseVerdict::Understated),
                (4.0, NoiseVerdict::Overstated),
            ] {
                if let Some(wrong) = stated(factor) {
                    judged += 1;
                    assert_eq!(wrong.verdict, verdict, "{seed}");
                }
            }
        }
        // The verdict needs 0.27 %: of 200, half a robot is expected, and four are improbable; of 40, a
        // tenth of a robot, and two are as improbable.
        assert!(agrees > size(38, 196), "{}: {agrees}", method.name());
        assert!(judged > robots(), "{}: {judged}", method.name());
        println!(
            "{}: {likely} of {} probabilities above 5 %",
            method.name(),
            robots()
        );
        assert!(likely >= at_least(), "{}: {likely}", method.name());
    }
}

#[test]
fn what_the_tolerance_allows_is_what_robots_within_it_do() {
    // Evenly within ±√3 tolerances, so that these are one σ.
    let (length, angle) = (0.5 * 3_f64.sqrt(), 0.2 * 3_f64.sqrt());
    let said = tested(1, TOLERANCE, CalibrationMethod::Ikm)
        .unwrap()
        .tolerated
        .unwrap();
    let mut rng = Pcg32::seed_from_u64(7);
    let limits = JointLimits::new((-50_f64).to_radians(), 80_f64.to_radians()).unwrap();
    let robot = paper_robot();
    let mut coordinates: Vec<_> = (0..60)
        .map(|_| {
            let q = random_pose(&robot, &limits, &mut rng).unwrap().joints;
            let squares: Vec<_> = (0..200)
                .filter_map(|_| perturbed(length, angle, &mut rng).forward(&q).ok())
                .map(|x: Vector3<f64>| (x - robot.forward(&q).unwrap()).norm_squared() / 3.0)
                .collect();
            (squares.iter().sum::<f64>() / 200.0).sqrt()
        })
        .collect();
    coordinates.sort_by(f64::total_cmp);
    // Other poses of the same kind: the medians of 30 and of 60 scatter.
    let drawn = coordinates[30];
    assert!((said / drawn - 1.0).abs() < 0.25, "{said} {drawn}");
}

#[test]
fn residuals_beyond_the_tolerance_are_no_noise() {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    // Up to 10 mm; the tolerance of 0.5 mm and 0.2° makes about 1 mm.
    folder.write("samples.csv", csv(&noisy(&true_arms(), 30, 10.0)));
    let calibrate = "calibrate robot.toml samples.csv --output out.toml";
    for method in ["", " --method fkm"] {
        let run = folder.run(&format!("{calibrate}{method}"));
        assert_eq!(run.code, 1, "{}", run.stdout);
        for part in [
            "no [noise] is stated, and if the residuals were all noise, it would be",
            "lets the robot be off by",
            "state the [noise]",
        ] {
            assert!(run.stderr.contains(part), "{}", run.stderr);
        }
        assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
    }
    // A sensor that is said to be so noisy may be; even amplitudes of 10 mm are 5.8 mm rms.
    let noise = "\n[noise]\nposition_mm = 5.8\njoint_deg = 0\n";
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}{noise}"));
    let run = folder.run("calibrate robot.toml samples.csv");
    assert!(
        !run.stderr.contains("no [noise] is stated"),
        "{}",
        run.stderr
    );
    // Right samples are not suspected.
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("samples.csv", csv(&exact(&true_arms(), 30)));
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(
        !run.stdout.contains("the residuals for noise"),
        "{}",
        run.stdout
    );
}
