//! A campaign's summary against the same cases computed without it: other random numbers, the core
//! alone, the figures from their definitions.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)]

use delta_cal::simulate::random_pose;
use delta_cal::{Calibrator, Noise, Robot, Settings, Tolerance};
use delta_cal_host::InputText;
use delta_cal_host::campaign::{CaseSummary, Distribution, Plan, run, summarize};
use delta_cal_tests::{
    Spread, generator, measurements, paper_limits, paper_robot, parameter_differences, perturbed,
};
use std::path::Path;

const ROBOTS: u64 = 1000;

fn summaries(toml: &str) -> Vec<CaseSummary> {
    let text = InputText::new("campaign.toml", &format!("robots = {ROBOTS}\n{toml}"));
    let plan = Plan::read(&text, &|name| InputText::from_file(Path::new(name))).unwrap();
    summarize(&run(&plan, &(0..ROBOTS), &mut |_, _| {}).unwrap())
}

/// Of each robot: gain (4.1), and the rms position error over 100 other poses before and after.
fn without_campaign(number: u64, poses: usize, prior: bool) -> [Vec<f64>; 3] {
    let (length, angle) = (0.1, 0.1f64.to_radians());
    let nominal = paper_robot::<f64>();
    let noise = Noise::new(0.001, 0.01f64.to_radians()).unwrap();
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance(prior.then(|| Tolerance::new(length, angle).unwrap()));
    let mut figures: [Vec<f64>; 3] = Default::default();
    for robot in 0..ROBOTS {
        let mut rng = generator(number, robot);
        let truth = perturbed(&nominal, length, angle, Spread::Uniform, &mut rng);
        let samples = measurements(&truth, poses, Some(&noise), &mut rng);
        let mut calibrator = Calibrator::new(&nominal, &settings);
        calibrator.add_many(&samples).unwrap();
        let Ok(outcome) = calibrator.solve() else {
            continue;
        };
        let distance = |robot: &Robot<f64>| {
            let differences = parameter_differences(robot, &truth);
            differences.iter().map(|d| d * d).sum::<f64>().sqrt()
        };
        let (before, after) = (distance(&nominal), distance(&outcome.robot));
        figures[0].push(100.0 * (before - after) / before);
        let mut squares = [0.0; 2];
        for _ in 0..100 {
            let pose = random_pose(&truth, &paper_limits(), &mut rng).unwrap();
            for (square, robot) in squares.iter_mut().zip([&nominal, &outcome.robot]) {
                let said = robot.forward(&pose.joints).unwrap();
                *square += (said - pose.position).norm_squared() / 100.0;
            }
        }
        figures[1].push(squares[0].sqrt());
        figures[2].push(squares[1].sqrt());
    }
    for figure in &mut figures {
        figure.sort_by(f64::total_cmp);
    }
    figures
}

/// The standard error of the median of n values is 1.2533 σ/√n if they are normal, and σ is the
/// interquartile range over 1.349; two medians of independent samples differ by √2 of that, and by
/// more than five times as much once in two million.
fn assert_same_median(what: &str, campaign: Option<Distribution>, sorted: &[f64]) {
    let quantiles = campaign.unwrap();
    let n = sorted.len() as f64;
    let sigma = (sorted[sorted.len() * 3 / 4] - sorted[sorted.len() / 4]) / 1.349;
    let allowed = 5.0 * 2f64.sqrt() * 1.2533 * sigma / n.sqrt();
    let expected = sorted[sorted.len() / 2];
    println!(
        "{what}: {:.4}, without campaign {expected:.4} ± {allowed:.4}",
        quantiles.median
    );
    assert!((quantiles.median - expected).abs() < allowed, "{what}");
}

#[test]
fn a_campaigns_medians_are_those_of_the_same_case_computed_without_it() {
    let summaries = summaries(
        "poses = [20, 60]\nprior = [true, false]\n\
         start_errors = [{ length_mm = 0.1, angle_deg = 0.1 }]\n\
         noise_levels = [{ position_mm = 0.001, joint_deg = 0.01 }]\n",
    );
    assert_eq!(summaries.len(), 4);
    for (number, summary) in (71..).zip(&summaries) {
        let (poses, prior) = (summary.case.poses, summary.case.prior);
        let [gain, before, after] = without_campaign(number, poses, prior);
        let name = |what| format!("{poses} poses, prior {prior}, {what}");
        assert_same_median(&name("gain"), summary.gain_percent, &gain);
        assert_same_median(&name("error before"), summary.error_before_mm, &before);
        assert_same_median(&name("error after"), summary.error_after_mm, &after);
    }
}

/// Without a prior the estimate is unbiased to first order and reaches the Cramér–Rao bound: over
/// many robots the ratio of the errors to the bound is 1. 24,000 numbers, few of them independent,
/// whose own scatter was seen to be some 2 %.
#[test]
fn over_many_robots_the_error_is_the_cramer_rao_bound() {
    let summaries = summaries(
        "poses = [20, 60]\nprior = [false]\nmethods = [\"ikm\", \"fkm\"]\n\
         start_errors = [{ length_mm = 1, angle_deg = 1 }]\n\
         noise_levels = [{ position_mm = 0.01, joint_deg = 0.001 }]\n",
    );
    for summary in &summaries {
        let ratio = summary.ratios.error_to_bound.unwrap();
        println!(
            "{} poses, {:?}: {ratio:.3}",
            summary.case.poses, summary.case.method
        );
        assert_eq!(summary.accepted as u64, ROBOTS);
        assert!((0.95..1.05).contains(&ratio), "{ratio}");
    }
}
