//! The same by hand: gate, held-out samples and calibrators in the order in which their documentation has them.

use super::{Result, add, end, options, statements, streams};
use delta_cal::calibration::JointCalibrator;
use delta_cal::stream::{
    Added, Estimator, Forgetting, Gate, HeldOut, Selection, StreamCalibrator, StreamOptions,
    StreamOutcome, StreamRefusal, Verdict,
};
use delta_cal::{ArmIndex, Calibrator, Progress, Real, Robot, Sample, Settings};

struct ByHand<T: Real> {
    arms: Calibrator<T>,
    joint: Option<JointCalibrator<T>>,
}

impl<T: Real> ByHand<T> {
    fn take(&mut self, sample: &Sample<T>, forgetting: Option<&Forgetting<T>>) {
        let Some(joint) = &mut self.joint else { return };
        match forgetting {
            Some(forgetting) => joint.add_forgetting(sample, forgetting).unwrap(),
            None => joint.add(sample).unwrap(),
        }
    }

    fn solve(&mut self) -> std::result::Result<StreamOutcome<T>, StreamRefusal> {
        Ok(match &mut self.joint {
            Some(joint) => StreamOutcome::Joint(joint.solve()?),
            None => StreamOutcome::Arms(self.arms.solve()?),
        })
    }
}

fn by_hand<T: Real>(
    robot: &Robot<T>,
    settings: &Settings<T>,
    options: &StreamOptions<T>,
    samples: &[Sample<T>],
) -> Result<T> {
    let mut calibrators = ByHand {
        arms: Calibrator::new(robot, settings),
        joint: (options.estimator == Estimator::Joint)
            .then(|| JointCalibrator::new(robot, settings)),
    };
    let mut added = Vec::new();
    let mut validations = None;
    let end = match options.selection {
        Selection::All { forgetting } => {
            for sample in samples {
                match &forgetting {
                    Some(forgetting) => calibrators.arms.add_forgetting(sample, forgetting),
                    None => calibrators.arms.add(sample),
                }
                .unwrap();
                calibrators.take(sample, forgetting.as_ref());
                added.push(Added::Taken);
            }
            calibrators.solve()
        }
        Selection::Gated { forgetting } => {
            let mut gate = Gate::new(&mut calibrators.arms);
            if let Some(forgetting) = forgetting {
                gate = gate.with_forgetting(forgetting);
            }
            for sample in samples {
                let verdict = gate.add(&mut calibrators.arms, sample).unwrap();
                if !matches!(verdict, Verdict::Rejected(_)) {
                    calibrators.take(sample, forgetting.as_ref());
                }
                if gate.wants_estimate()
                    && let Ok(outcome) = calibrators.arms.solve()
                {
                    gate.adopt(&mut calibrators.arms, &outcome);
                }
                added.push(Added::Tested(verdict));
            }
            let rejected = gate.counts().rejected;
            match gate.alarm() {
                Some(alarm) => Err(StreamRefusal::Alarm(alarm)),
                None if 5 * rejected > samples.len() as u64 => {
                    Err(StreamRefusal::TooManyRejected {
                        rejected,
                        samples: samples.len() as u64,
                    })
                }
                None => calibrators.solve(),
            }
        }
        Selection::HeldOut { every } => {
            let mut held_out = HeldOut::new(&calibrators.arms, every).unwrap();
            for sample in samples {
                let held = held_out.add(&mut calibrators.arms, sample).unwrap();
                calibrators.take(sample, None);
                added.push(if held { Added::HeldOut } else { Added::Taken });
            }
            (|| {
                let fitted = calibrators.arms.solve()?;
                let found = held_out.validate(&mut calibrators.arms, &fitted)?;
                held_out.merge_into(&mut calibrators.arms).unwrap();
                let outcome = calibrators.solve()?;
                validations = Some(found);
                Ok(outcome)
            })()
        }
    };
    Result {
        added,
        end,
        validations,
    }
}

fn compare<T: Real>() {
    let mut ends = [0; 4];
    for (robot, samples) in &streams::<T>(32) {
        for settings in statements() {
            for options in options() {
                let mut stream = StreamCalibrator::new(robot, &settings, &options).unwrap();
                let added = samples
                    .iter()
                    .map(|sample| add(&mut stream, sample))
                    .collect();
                let found = end(stream, added);
                assert_eq!(
                    found,
                    by_hand(robot, &settings, &options, samples),
                    "{options:?}"
                );
                ends[match found.end {
                    Ok(_) => 0,
                    Err(StreamRefusal::Calibration(_)) => 1,
                    Err(StreamRefusal::HeldOut(_)) => 2,
                    Err(_) => 3,
                }] += 1;
            }
        }
    }
    let [solved, refused, contradicted, _] = ends;
    assert!(solved > 50 && refused > 20 && contradicted > 20, "{ends:?}");
}

#[test]
fn a_stream_is_what_its_parts_are_by_hand_in_double_precision() {
    compare::<f64>();
}

#[test]
fn a_stream_is_what_its_parts_are_by_hand_in_single_precision() {
    compare::<f32>();
}

/// A robot that changes, and one of whose samples too many are wrong: refused as the gate's alarm and as what it is.
#[test]
fn a_run_of_rejections_and_too_many_of_them_are_refused() {
    let settings = statements::<f64>()[3];
    let options = StreamOptions {
        estimator: Estimator::Joint,
        selection: Selection::Gated { forgetting: None },
    };
    for (robot, samples) in &streams::<f64>(60) {
        for (wrong, in_a_row) in [(12, true), (20, false)] {
            let mut samples = samples.clone();
            let count = samples.len();
            for number in 0..wrong {
                let place = if in_a_row {
                    count - 1 - number
                } else {
                    1 + count - 2 * wrong + 2 * number - 1
                };
                samples[place].position.y += 8.0;
            }
            let mut stream = StreamCalibrator::new(robot, &settings, &options).unwrap();
            for sample in &samples {
                add(&mut stream, sample);
            }
            let counts = *stream.gate_counts().unwrap();
            let alarmed = stream.alarm().is_some();
            let refusal = end(stream, Vec::new()).end.unwrap_err();
            assert_eq!(alarmed, in_a_row);
            if in_a_row {
                assert!(matches!(refusal, StreamRefusal::Alarm(_)), "{refusal}");
            } else {
                assert!(counts.rejected >= wrong as u64);
                let expected = StreamRefusal::TooManyRejected {
                    rejected: counts.rejected,
                    samples: count as u64,
                };
                assert_eq!(refusal, expected);
            }
        }
    }
}

/// Held-out samples that agree are in the last fit, by either estimator; and what is at work is named.
#[test]
fn held_out_samples_that_agree_are_in_the_result() {
    for (robot, mut samples) in streams::<f64>(32) {
        let wrong = samples.len() / 2 - 1;
        samples[wrong].position.x -= 5.0;
        for estimator in [Estimator::Arms, Estimator::Joint] {
            let options = StreamOptions {
                estimator,
                selection: Selection::HeldOut { every: 4 },
            };
            let settings = statements::<f64>()[3];
            let mut stream = StreamCalibrator::new(&robot, &settings, &options).unwrap();
            let added = samples
                .iter()
                .map(|sample| add(&mut stream, sample))
                .collect();
            assert_eq!((stream.samples(), stream.arm()), (32, None));
            let mut at_work = stream;
            at_work.solve();
            let mut arms = Vec::new();
            while at_work.step() == Progress::Working {
                if arms.last() != Some(&at_work.arm()) {
                    arms.push(at_work.arm());
                }
            }
            let [first, second, third] = ArmIndex::ALL.map(Some);
            // The fit and its judgement go from arm to arm, and so does the last fit of the arms.
            let round = [first, second, third];
            let last = match estimator {
                Estimator::Arms => round.as_slice(),
                Estimator::Joint => &[],
            };
            let expected: Vec<_> = [round.as_slice(), &round, &[None], last].concat();
            assert_eq!(arms, expected);
            let found = end(stream, added);
            assert!(found.end.is_ok() && found.validations.is_some());
            assert_eq!(found, by_hand(&robot, &settings, &options, &samples));
            let samples = match found.end.unwrap() {
                StreamOutcome::Arms(outcome) => outcome.arms[2].samples,
                StreamOutcome::Joint(outcome) => outcome.estimate.samples,
            };
            assert_eq!(samples, 32);
        }
    }
}

/// Without a stated noise the gate wants an estimate at the twelfth sample; a solve that is asked for meanwhile comes
/// after it, and one that is asked for twice comes once.
#[test]
fn a_solve_that_is_asked_for_during_an_estimate_comes_after_it() {
    let options = StreamOptions {
        estimator: Estimator::Arms,
        selection: Selection::Gated { forgetting: None },
    };
    for (robot, samples) in &streams::<f64>(32) {
        for asked_at in [0, 1, 3] {
            let settings = Settings::default();
            let mut stream = StreamCalibrator::new(robot, &settings, &options).unwrap();
            for sample in &samples[..11] {
                add(&mut stream, sample);
            }
            stream.add(&samples[11]).unwrap();
            assert!(stream.solving());
            let mut after = stream;
            for step in 0.. {
                if step == asked_at {
                    stream.solve();
                }
                if stream.step() == Progress::Finished {
                    break;
                }
            }
            while after.step() == Progress::Working {}
            assert!(after.result().is_none());
            after.solve();
            while after.step() == Progress::Working {}
            assert!(stream.result().is_some());
            assert_eq!(stream.result(), after.result());
            assert!(stream.add(&samples[12]).is_ok());
            assert!(!stream.solving() && stream.result().is_none());
        }
    }
}
