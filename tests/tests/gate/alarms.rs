//! Alarms: a robot that changes, and early samples that are wrong.

use crate::gate::{DEGREE, Stream, noise, robot, stated};
use delta_cal::Sample;
use delta_cal::stream::Alarm;
use delta_cal_tests::{Spread, generator, measurements, perturbed};

/// What a changed robot does, and after how many samples the gate says so.
#[test]
fn a_robot_that_changes_is_detected() {
    let settings = stated(0.5, 0.2 * DEGREE);
    for change in [0.05, 0.1, 0.2, 0.5, 2.0] {
        let (mut detected, mut delay, mut at_once, mut early) = (0, 0, 0, 0);
        for number in 0..300 {
            let mut rng = generator(911, number);
            let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
            // As after a crash: every parameter is off.
            let changed = perturbed(&truth, change, change / 260.0, Spread::Normal, &mut rng);
            let mut stream = Stream::new(&settings);
            for sample in measurements(&truth, 40, Some(&noise()), &mut rng) {
                stream.add(&sample);
            }
            early += u32::from(stream.gate.alarm().is_some());
            for (index, sample) in measurements(&changed, 100, Some(&noise()), &mut rng)
                .iter()
                .enumerate()
            {
                stream.add(sample);
                if let Some(alarm) = stream.gate.alarm() {
                    detected += 1;
                    delay += index + 1;
                    at_once += u32::from(alarm == Alarm::RobotChanged { first: 40 });
                    break;
                }
            }
        }
        println!(
            "| {change} mm | {detected} of 300 | {:.1} | {at_once} |",
            delay as f64 / f64::from(detected).max(1.0),
        );
        assert_eq!(early, 0);
        if change >= 2.0 {
            assert!(detected == 300 && delay < 300 * 10, "{detected}, {delay}");
        }
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
        if let Some(alarm) = stream.gate.alarm() {
            alarmed += 1;
            as_early += u32::from(matches!(alarm, Alarm::EarlySamplesWrong { .. }));
        }
    }
    println!(
        "{alarmed} of 300 streams were refused, {as_early} of them with the early samples named"
    );
    assert!(alarmed >= 295 && as_early >= 290, "{alarmed}, {as_early}");
}

/// Two joint columns exchanged: not one sample agrees with the stated robot.
#[test]
fn exchanged_joints_are_rejected_from_the_first_sample_on() {
    let settings = stated(0.5, 0.2 * DEGREE);
    for number in 0..100 {
        let mut rng = generator(913, number);
        let truth = robot(0.5, 0.2 * DEGREE, &mut rng);
        let mut stream = Stream::new(&settings);
        for sample in measurements(&truth, 40, Some(&noise()), &mut rng) {
            let [q1, q2, q3] = sample.joints;
            stream.add(&Sample {
                joints: [q2, q1, q3],
                ..sample
            });
        }
        let alarm = stream.gate.alarm().expect("an alarm");
        assert!(matches!(alarm, Alarm::EarlySamplesWrong { .. }), "{alarm}");
    }
}
