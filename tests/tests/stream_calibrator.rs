//! The stream with everything in it: it decides and computes as its parts do by hand, and goes on from a snapshot to the same
//! bits.

use delta_cal::calibration::{JointCalibrator, Start};
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{
    AddError, Added, Alarm, Estimator, Forgetting, Gate, Selection, StreamCalibrator,
    StreamOptions, StreamOutcome, StreamRefusal, Verdict,
};
use delta_cal::{Calibrator, Noise, Progress, Real, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, measurements, perturbed};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// What is stated: nothing, the noise, the tolerance, both.
fn statements<T: Real>() -> Vec<Settings<T>> {
    let noise = Noise::new(T::from_f64(0.02), T::from_f64(0.002 * DEGREE)).unwrap();
    let tolerance = Tolerance::new(T::from_f64(0.5), T::from_f64(0.2 * DEGREE)).unwrap();
    let mut all = Vec::new();
    for noise in [None, Some(noise)] {
        for tolerance in [None, Some(tolerance)] {
            all.push(
                Settings::default()
                    .with_noise(noise)
                    .with_tolerance(tolerance),
            );
        }
    }
    all.push(all[3].with_start(Start::Free));
    all
}

fn options<T: Real>() -> Vec<StreamOptions<T>> {
    let fading = Some(Forgetting::new(T::from_f64(20.0)).unwrap());
    let mut all = Vec::new();
    for estimator in [Estimator::Arms, Estimator::Joint] {
        for selection in [
            Selection::All { forgetting: None },
            Selection::All { forgetting: fading },
            Selection::Gated { forgetting: None },
            Selection::Gated { forgetting: fading },
        ] {
            all.push(StreamOptions {
                estimator,
                selection,
            });
        }
    }
    all
}

/// A robot as drawn, and measurements of one that was built to the tolerance; one sample in the middle is 5 mm off.
fn streams<T: Real>(count: usize) -> Vec<(Robot<T>, Vec<Sample<T>>)> {
    let noise = Noise::new(0.02, 0.002 * DEGREE).unwrap();
    let robots = geometries().into_iter().zip(0..);
    robots
        .map(|((_, nominal), number)| {
            let mut rng = generator(1700, number);
            let truth = perturbed(&nominal, 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
            let mut samples = measurements(&truth, count, Some(&noise), &mut rng);
            samples[count / 2 - 1].position.x += 5.0;
            let converted = samples.iter().map(|sample| Sample {
                joints: sample.joints.map(T::from_f64),
                position: sample.position.map(T::from_f64),
            });
            (nominal.cast().unwrap(), converted.collect())
        })
        .collect()
}

/// Everything that comes of samples.
#[derive(Debug, PartialEq)]
struct Result<T: Real> {
    added: Vec<Added<T>>,
    end: std::result::Result<StreamOutcome<T>, StreamRefusal>,
}

fn add<T: Real>(stream: &mut StreamCalibrator<T>, sample: &Sample<T>) -> Added<T> {
    let added = stream.add(sample).unwrap();
    while stream.step() == Progress::Working {
        // Nothing comes in while the gate's estimate is solved.
        assert_eq!(stream.add(sample), Err(AddError::Busy));
    }
    added
}

fn end<T: Real>(mut stream: StreamCalibrator<T>, added: Vec<Added<T>>) -> Result<T> {
    assert!(stream.result().is_none());
    stream.solve();
    while stream.step() == Progress::Working {}
    Result {
        added,
        end: stream.result().unwrap().copied(),
    }
}

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
    };
    Result { added, end }
}

fn compare<T: Real>() {
    let mut ends = [0; 3];
    for (robot, samples) in &streams::<T>(32) {
        for settings in statements() {
            for options in options() {
                let mut stream = StreamCalibrator::new(robot, &settings, &options);
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
            let mut stream = StreamCalibrator::new(robot, &settings, &options);
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

/// After every sample the stream is written, forgotten and restored; the other one is not.
fn interrupted<T: Real>() {
    let mut bytes = vec![0; StreamCalibrator::<T>::SNAPSHOT_BYTES];
    for (robot, samples) in &streams::<T>(32) {
        for settings in statements() {
            for options in options() {
                let new = || StreamCalibrator::new(robot, &settings, &options);
                let (mut whole, mut broken) = (new(), new());
                let mut added = [Vec::new(), Vec::new()];
                for sample in samples {
                    added[0].push(add(&mut whole, sample));
                    added[1].push(add(&mut broken, sample));
                    let length = broken.snapshot(&mut bytes).unwrap().len();
                    broken = new();
                    broken.restore(&bytes[..length]).unwrap();
                }
                let [of_whole, of_broken] = added;
                assert_eq!(end(broken, of_broken), end(whole, of_whole), "{options:?}");
            }
        }
    }
}

#[test]
fn a_stream_goes_on_to_the_same_bits_in_double_precision() {
    interrupted::<f64>();
}

#[test]
fn a_stream_goes_on_to_the_same_bits_in_single_precision() {
    interrupted::<f32>();
}

/// Every bit of a snapshot, every length of it, and what flash holds before anything was written.
#[test]
fn damaged_bytes_are_refused_and_change_nothing() {
    let (robot, samples) = &streams::<f32>(24)[0];
    let settings = statements::<f32>()[3];
    for options in options() {
        let mut stream = StreamCalibrator::new(robot, &settings, &options);
        for sample in samples {
            add(&mut stream, sample);
        }
        let mut bytes = vec![0; StreamCalibrator::<f32>::SNAPSHOT_BYTES];
        let good = stream.snapshot(&mut bytes).unwrap().to_vec();
        let mut target = StreamCalibrator::new(robot, &settings, &options);
        for sample in &samples[..7] {
            add(&mut target, sample);
        }
        let mut before = bytes.clone();
        let length = target.snapshot(&mut before).unwrap().len();
        before.truncate(length);
        let mut refused = |bytes: &[u8]| {
            assert!(target.restore(bytes).is_err());
            let mut after = vec![0; StreamCalibrator::<f32>::SNAPSHOT_BYTES];
            assert_eq!(target.snapshot(&mut after).unwrap(), before);
        };
        for bit in 0..8 * good.len() {
            // All bits of the header, and one in seven of the rest.
            if bit < 200 || bit % 7 == 0 {
                let mut damaged = good.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                refused(&damaged);
            }
        }
        for length in (0..good.len()).step_by(13) {
            refused(&good[..length]);
        }
        refused(&vec![0xff; good.len()]);
        refused(&vec![0; good.len()]);
        // What stands behind it does not matter: flash is read in whole pages.
        let mut longer = good.clone();
        longer.resize(good.len() + 500, 0xff);
        target.restore(&longer).unwrap();
        let short = good.len() - 1;
        assert_eq!(
            Calibrator::new(robot, &settings).snapshot(&mut bytes[..short.min(100)]),
            Err(SnapshotError::BufferTooShort)
        );
    }
}

/// Another robot, noise, tolerance of the gate, or option.
#[test]
fn foreign_bytes_are_refused_as_what_they_are() {
    let all = streams::<f64>(20);
    let (robot, samples) = &all[0];
    let noise = Noise::new(0.02, 0.0).unwrap();
    let tolerance = Tolerance::new(0.5, 0.2 * DEGREE).unwrap();
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance(tolerance);
    let others = [
        settings.with_noise(None),
        settings.with_noise(Noise::new(0.03, 0.0).unwrap()),
        settings.with_noise(Noise::new(0.02, 1e-6).unwrap()),
        settings.with_noise(Noise::by_axis([0.02, 0.02, 0.03], 0.0).unwrap()),
        settings.with_tolerance(None),
        settings.with_tolerance(Tolerance::new(0.6, 0.2 * DEGREE).unwrap()),
        settings.with_tolerance(Tolerance::new(0.5, 0.3 * DEGREE).unwrap()),
    ];
    let gated = StreamOptions {
        estimator: Estimator::Arms,
        selection: Selection::Gated { forgetting: None },
    };
    let fading = |age| Selection::Gated {
        forgetting: Some(Forgetting::new(age).unwrap()),
    };
    let other_options = [
        StreamOptions {
            estimator: Estimator::Joint,
            ..gated
        },
        StreamOptions {
            selection: Selection::All { forgetting: None },
            ..gated
        },
        StreamOptions {
            selection: fading(20.0),
            ..gated
        },
    ];

    let mut stream = StreamCalibrator::new(robot, &settings, &gated);
    for sample in samples {
        add(&mut stream, sample);
    }
    let mut bytes = vec![0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
    stream.snapshot(&mut bytes).unwrap();
    let restored =
        |robot, settings, options| StreamCalibrator::new(robot, settings, options).restore(&bytes);
    assert_eq!(restored(robot, &settings, &gated), Ok(()));
    let other = Err(SnapshotError::OtherCalibration);
    for (robot, _) in &all[1..] {
        assert_eq!(restored(robot, &settings, &gated), other);
    }
    for settings in &others {
        assert_eq!(restored(robot, settings, &gated), other, "{settings:?}");
    }
    for options in &other_options {
        assert_eq!(restored(robot, &settings, options), other, "{options:?}");
    }
    let kind = Err(SnapshotError::OtherKind);
    assert_eq!(Calibrator::new(robot, &settings).restore(&bytes), kind);
    assert_eq!(JointCalibrator::new(robot, &settings).restore(&bytes), kind);
    let (robot, _) = &streams::<f32>(20)[0];
    let settings = statements::<f32>()[3];
    assert_eq!(Calibrator::new(robot, &settings).restore(&bytes), kind);
    bytes[0] = 2;
    let version = Err(SnapshotError::OtherVersion { version: 2 });
    assert_eq!(Calibrator::new(robot, &settings).restore(&bytes), version);
}

/// A gate's snapshot belongs to its calibrator as it was then.
#[test]
fn a_gate_is_not_restored_in_front_of_another_state() {
    let (robot, samples) = &streams::<f64>(20)[1];
    let settings = statements::<f64>()[3];
    let mut arms = Calibrator::new(robot, &settings);
    let mut gate = Gate::new(&mut arms);
    let mut bytes = vec![0; Gate::<f64>::SNAPSHOT_BYTES];
    let mut before = arms;
    for sample in samples {
        before = arms;
        gate.add(&mut arms, sample).unwrap();
    }
    gate.snapshot(&arms, &mut bytes).unwrap();
    let other = Err(SnapshotError::OtherCalibration);

    // Made before: a new gate takes in what waits in the calibrator.
    let new = || Gate::new(&mut Calibrator::new(robot, &settings));
    let mut wide = new().with_sigmas(6.0).unwrap();
    assert_eq!(wide.restore(&arms, &bytes), other);
    assert_eq!(new().restore(&before, &bytes), other);
    assert_eq!(new().restore(&arms, &bytes), Ok(()));
}

/// Early samples that a run contradicts, and many of them: the alarm and its sample outlast a power cut.
#[test]
fn an_alarm_is_in_the_snapshot() {
    let options = StreamOptions {
        estimator: Estimator::Arms,
        selection: Selection::Gated { forgetting: None },
    };
    let settings = statements::<f64>()[3];
    let (robot, samples) = &streams::<f64>(80)[0];
    for good in [9, 30] {
        let new = || StreamCalibrator::new(robot, &settings, &options);
        let mut stream = new();
        for (index, sample) in samples.iter().enumerate().take(good + 8) {
            let mut sample = *sample;
            if index >= good {
                sample.position.y += 8.0;
            }
            add(&mut stream, &sample);
        }
        let first = good as u64;
        let expected = if good < 16 {
            Alarm::EarlySamplesWrong { first }
        } else {
            Alarm::RobotChanged { first }
        };
        assert_eq!(stream.alarm(), Some(expected));
        let mut bytes = vec![0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
        let length = stream.snapshot(&mut bytes).unwrap().len();
        let mut restored = new();
        restored.restore(&bytes[..length]).unwrap();
        assert_eq!(restored.alarm(), Some(expected));
        assert_eq!(restored.samples(), stream.samples());
    }
}

/// While something is solved there is nothing to write.
#[test]
fn a_stream_that_solves_has_no_snapshot() {
    let (robot, samples) = &streams::<f64>(20)[0];
    let all = StreamOptions::default();
    let mut stream = StreamCalibrator::new(robot, &Settings::default(), &all);
    for sample in samples {
        add(&mut stream, sample);
    }
    stream.solve();
    let mut bytes = vec![0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
    assert_eq!(stream.snapshot(&mut bytes), Err(SnapshotError::Busy));
}
