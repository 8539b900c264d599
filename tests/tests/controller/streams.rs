//! Gate, forgetting and the joint estimator on the controller.

use crate::controller::driver::{Driver, Flash, begin, message, samples};
use delta_cal::stream::{
    Estimator, Forgetting, Selection, StreamCalibrator, StreamOptions, StreamOutcome, StreamRefusal,
};
use delta_cal::{ArmIndex, Noise, Progress, RobotOutcome, Sample, Settings, Tolerance};
use delta_cal_firmware_example::Number;
use delta_cal_protocol::{Begin, Fault, GateStatus, Geometry, Phase, Request, Response};
use delta_cal_tests::paper_robot;
use embedded_storage::nor_flash::NorFlash;

/// Every option, each as the core has it and as it goes over the wire.
pub(crate) fn options<T: Number>() -> Vec<(StreamOptions<T>, Begin<T>)> {
    let age = T::from_f64(20.0);
    let fading = Some(Forgetting::new(age).unwrap());
    let mut all = Vec::new();
    for estimator in [Estimator::Arms, Estimator::Joint] {
        let plain = Begin {
            estimator,
            ..begin(1)
        };
        let gate = Begin {
            gate: true,
            ..plain
        };
        for (selection, begin) in [
            (Selection::All { forgetting: None }, plain),
            (
                Selection::All { forgetting: fading },
                Begin {
                    forgetting: Some(age),
                    ..plain
                },
            ),
            (Selection::Gated { forgetting: None }, gate),
            (
                Selection::Gated { forgetting: fading },
                Begin {
                    forgetting: Some(age),
                    ..gate
                },
            ),
        ] {
            let options = StreamOptions {
                estimator,
                selection,
            };
            all.push((options, begin));
        }
    }
    all
}

fn settings<T: Number>(begin: &Begin<T>) -> Settings<T> {
    let noise = begin
        .noise
        .map(|(position, joint)| Noise::by_axis(position, joint).unwrap());
    let tolerance = begin
        .tolerance
        .map(|(length, angle)| Tolerance::new(length, angle).unwrap());
    Settings::default()
        .with_noise(noise)
        .with_tolerance(tolerance)
}

/// Samples of a robot, of which one is 5 mm off.
pub(crate) fn one_wrong<T: Number>(robot: u64, count: usize) -> Vec<Sample<T>> {
    let mut samples = samples::<T>(robot, count);
    samples[count / 2].position.x += T::from_f64(5.0);
    samples
}

/// Sends a sample as often as it takes.
pub(crate) fn send<T: Number, F: NorFlash, S: NorFlash>(
    driver: &mut Driver<T, F, S>,
    index: u32,
    sample: &Sample<T>,
) {
    loop {
        match driver.ask(&message(1, index, sample)) {
            Response::Taken { next, .. } => return assert_eq!(next, index + 1),
            Response::Fault(Fault::Busy) => {
                let solving = matches!(driver.status().phase, Phase::Solving);
                assert!(solving, "busy with nothing");
                driver.rest();
            }
            other => panic!("{other:?}"),
        }
    }
}

/// The controller's result against the core's, every bit of it.
fn compare<T: Number>(
    driver: &mut Driver<T, Flash>,
    begin: &Begin<T>,
    here: &StreamCalibrator<T>,
) -> bool {
    let status = driver.status();
    let counts = here.gate_counts();
    let gate = counts.map(|counts| GateStatus::new(counts, here.alarm()));
    assert_eq!(status.gate, gate);
    let outcome = match (status.phase, here.result().unwrap()) {
        (Phase::CalibrationRefused { refusal, .. }, Err(expected)) => {
            assert_eq!(refusal, expected);
            return false;
        }
        (Phase::Solved { fingerprint, .. }, Ok(outcome)) => {
            assert_eq!(fingerprint, Geometry::of(outcome.robot()).fingerprint());
            outcome
        }
        (phase, expected) => panic!("{begin:?}: {phase:?}, {expected:?}"),
    };
    let session = begin.session;
    let arms = match outcome {
        StreamOutcome::Arms(outcome) => outcome.arms,
        StreamOutcome::Joint(outcome) => RobotOutcome::from(outcome).arms,
    };
    for (arm, expected) in ArmIndex::ALL.into_iter().zip(arms) {
        let Response::Outcome(report) = driver.ask(&Request::Outcome { session, arm }) else {
            panic!("no outcome")
        };
        assert_eq!(report.parameters, expected.arm.parameters());
        let sigma = expected
            .covariance
            .map(|c| std::array::from_fn(|i| c[(i, i)].square_root()));
        assert_eq!(report.sigma, sigma);
    }
    true
}

fn options_have_the_bits_of_the_core<T: Number>() {
    let (mut solved, mut refused) = (0, 0);
    for (options, begin) in options::<T>() {
        for robot in 0..6 {
            // Noise and tolerance stated; neither, so that the gate waits for an estimate.
            for begin in [
                begin,
                Begin {
                    noise: None,
                    tolerance: None,
                    ..begin
                },
            ] {
                let samples = one_wrong::<T>(robot, 40);
                let mut driver = Driver::<T, _>::start(Flash::new());
                assert_eq!(driver.begin_with(begin), 0);
                let mut here =
                    StreamCalibrator::new(&paper_robot(), &settings(&begin), &options).unwrap();
                for (index, sample) in (0..).zip(&samples) {
                    here.add(sample).unwrap();
                    while here.step() == Progress::Working {}
                    send(&mut driver, index, sample);
                }
                here.solve();
                while here.step() == Progress::Working {}
                while driver.solve(1, 40) == Phase::Solving
                    || matches!(driver.status().phase, Phase::Solving)
                {
                    driver.rest();
                }
                if compare(&mut driver, &begin, &here) {
                    solved += 1;
                } else {
                    refused += 1;
                }
            }
        }
    }
    println!("{solved} solved, {refused} refused, all as by the core");
    assert!(solved > 30 && refused > 10);
}

#[test]
fn every_option_has_the_bits_of_the_core() {
    options_have_the_bits_of_the_core::<f32>();
}

#[test]
fn every_option_in_double_precision_has_the_bits_of_the_core() {
    options_have_the_bits_of_the_core::<f64>();
}

#[test]
fn a_robot_that_changes_is_told_before_the_solve_and_refused_by_it() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let begin = Begin {
        gate: true,
        estimator: Estimator::Joint,
        ..begin(1)
    };
    driver.begin_with(begin);
    let mut all = samples::<f32>(2, 60);
    for sample in &mut all[50..] {
        sample.position.z += 1.0;
    }
    for (index, sample) in (0..).zip(&all) {
        send(&mut driver, index, sample);
        let alarm = driver.status().gate.and_then(|gate| gate.alarm);
        // Eight in a row, the first of them the fiftieth, counted from 0.
        assert_eq!(
            alarm.map(|alarm| alarm.first()),
            (index >= 57).then_some(50)
        );
    }
    driver.solve(1, 60);
    driver.rest();
    assert!(matches!(
        driver.status().phase,
        Phase::CalibrationRefused {
            samples: 60,
            refusal: StreamRefusal::Alarm(_)
        }
    ));
}
