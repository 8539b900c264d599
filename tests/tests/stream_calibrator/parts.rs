//! The same by hand: gate and calibrators in the order in which their documentation has them.

use super::{Result, add, end, options, statements, streams};
use delta_cal::calibration::JointCalibrator;
use delta_cal::stream::{
    Added, Estimator, Forgetting, Gate, Selection, StreamCalibrator, StreamOptions, StreamOutcome,
    StreamRefusal, Verdict,
};
use delta_cal::{Calibrator, Progress, Real, Robot, Sample, Settings};

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
        Selection::HeldOut { .. } => unreachable!(),
    };
    Result { added, end }
}

fn compare<T: Real>() {
    let mut ends = [0; 3];
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
                    Err(_) => 2,
                }] += 1;
            }
        }
    }
    let [solved, refused, _] = ends;
    assert!(solved > 50 && refused > 20, "{ends:?}");
}

#[test]
fn a_stream_is_what_its_parts_are_by_hand_in_double_precision() {
    compare::<f64>();
}

#[test]
fn a_stream_is_what_its_parts_are_by_hand_in_single_precision() {
    compare::<f32>();
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
