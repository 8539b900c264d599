//! The stream with everything in it: it decides and computes as its parts do by hand, and goes on from a snapshot to the same
//! bits.

use delta_cal::calibration::{Calibrator, Estimator, Ikm, Joint, Start};
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{
    AddError, Added, Alarm, Forgetting, Selection, StreamCalibrator, StreamRefusal, Verdict,
};
use delta_cal::{
    IkmCalibrator, JointCalibrator, Noise, Progress, Real, Robot, Sample, Settings, Tolerance,
};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, measurements, perturbed};

type Arms = StreamCalibrator<f64, Ikm>;
type Jointly = StreamCalibrator<f32, Joint>;

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

fn selections<T: Real>() -> [Selection<T>; 4] {
    let fading = Some(Forgetting::new(T::from_f64(20.0)).unwrap());
    [
        Selection::All { forgetting: None },
        Selection::All { forgetting: fading },
        Selection::Gated { forgetting: None },
        Selection::Gated { forgetting: fading },
    ]
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
type End<T, E> = (
    Vec<Added<T>>,
    Result<<E as Estimator>::Outcome<T>, StreamRefusal>,
);

fn add<T: Real, E: Estimator>(stream: &mut StreamCalibrator<T, E>, sample: &Sample<T>) -> Added<T> {
    let added = stream.add(sample).unwrap();
    while stream.step() == Progress::Working {
        // Nothing comes in while the gate's estimate is solved.
        assert_eq!(stream.add(sample), Err(AddError::Busy));
    }
    added
}

fn end<T: Real, E: Estimator>(
    mut stream: StreamCalibrator<T, E>,
    added: Vec<Added<T>>,
) -> End<T, E> {
    assert!(!stream.finished());
    // A refusal is that of the outcome.
    let _ = stream.solve();
    while stream.step() == Progress::Working {}
    (added, stream.outcome().cloned())
}

/// The calibrator alone, of the samples that the stream has taken.
fn by_hand<T: Real, E: Estimator>(
    robot: &Robot<T>,
    settings: &Settings<T>,
    selection: &Selection<T>,
    samples: &[Sample<T>],
    added: &[Added<T>],
) -> Result<E::Outcome<T>, StreamRefusal> {
    let mut calibrator = Calibrator::<T, E>::new(robot, settings);
    let (Selection::All { forgetting } | Selection::Gated { forgetting }) = selection;
    for (sample, added) in samples.iter().zip(added) {
        if matches!(added, Added::Tested(Verdict::Rejected(_))) {
            continue;
        }
        match forgetting {
            Some(forgetting) => calibrator.add_forgetting(sample, forgetting),
            None => calibrator.add(sample),
        }
        .unwrap();
    }
    Ok(calibrator.calibrate()?)
}

fn compare<T: Real, E: Estimator>(ends: &mut [u32; 3]) {
    for (robot, samples) in &streams::<T>(32) {
        // Noise and tolerance stated, so that no estimate of the gate comes between.
        for settings in &statements()[3..] {
            for selection in selections() {
                let mut stream = StreamCalibrator::<T, E>::new(robot, settings, &selection);
                let added = samples.iter().map(|sample| add(&mut stream, sample));
                let added = added.collect();
                let (added, found) = end(stream, added);
                ends[match &found {
                    Ok(_) => 0,
                    Err(StreamRefusal::Calibration(_)) => 1,
                    Err(_) => 2,
                }] += 1;
                // A gate takes samples in by other blocks.
                if let Selection::All { .. } = selection {
                    let expected = by_hand::<T, E>(robot, settings, &selection, samples, &added);
                    assert_eq!(found, expected, "{selection:?}");
                }
            }
        }
    }
}

#[test]
fn a_stream_is_its_calibrator_of_the_samples_that_it_takes() {
    let mut ends = [0; 3];
    compare::<f64, Ikm>(&mut ends);
    compare::<f64, Joint>(&mut ends);
    compare::<f32, Ikm>(&mut ends);
    compare::<f32, Joint>(&mut ends);
    println!("{ends:?} solved, refused, rejected");
    assert!(ends[0] > 50, "{ends:?}");
}

/// Without a stated noise the gate wants an estimate at the twelfth sample; a solve that is asked for meanwhile comes
/// after it, and one that is asked for twice comes once.
#[test]
fn a_solve_that_is_asked_for_during_an_estimate_comes_after_it() {
    let gated = Selection::Gated { forgetting: None };
    for (robot, samples) in &streams::<f64>(32) {
        for asked_at in [0, 1, 3] {
            let settings = Settings::default();
            let mut stream = Arms::new(robot, &settings, &gated);
            for sample in &samples[..11] {
                add(&mut stream, sample);
            }
            stream.add(&samples[11]).unwrap();
            assert!(stream.solving());
            let mut after = stream.clone();
            for step in 0.. {
                if step == asked_at {
                    stream.solve().unwrap();
                }
                if stream.step() == Progress::Finished {
                    break;
                }
            }
            while after.step() == Progress::Working {}
            assert!(!after.finished());
            after.solve().unwrap();
            while after.step() == Progress::Working {}
            assert!(stream.finished());
            assert_eq!(stream.outcome(), after.outcome());
            assert!(stream.add(&samples[12]).is_ok());
            assert!(!stream.solving() && !stream.finished());
        }
    }
}

/// After every sample the stream is written, forgotten and restored; the other one is not.
fn interrupted<T: Real, E: Estimator>() {
    let mut bytes = vec![0; StreamCalibrator::<T, E>::SNAPSHOT_BYTES];
    for (robot, samples) in &streams::<T>(32) {
        for settings in statements() {
            for selection in selections() {
                let new = || StreamCalibrator::<T, E>::new(robot, &settings, &selection);
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
                assert_eq!(
                    end(broken, of_broken),
                    end(whole, of_whole),
                    "{selection:?}"
                );
            }
        }
    }
}

#[test]
fn a_stream_goes_on_to_the_same_bits_in_double_precision() {
    interrupted::<f64, Ikm>();
    interrupted::<f64, Joint>();
}

#[test]
fn a_stream_goes_on_to_the_same_bits_in_single_precision() {
    interrupted::<f32, Ikm>();
    interrupted::<f32, Joint>();
}

/// Every bit of a snapshot, every length of it, and what flash holds before anything was written.
#[test]
fn damaged_bytes_are_refused_and_change_nothing() {
    let (robot, samples) = &streams::<f32>(24)[0];
    let settings = statements::<f32>()[3];
    for selection in selections() {
        let mut stream = Jointly::new(robot, &settings, &selection);
        for sample in samples {
            add(&mut stream, sample);
        }
        let mut bytes = vec![0; Jointly::SNAPSHOT_BYTES];
        let good = stream.snapshot(&mut bytes).unwrap().to_vec();
        let mut target = Jointly::new(robot, &settings, &selection);
        for sample in &samples[..7] {
            add(&mut target, sample);
        }
        let mut before = bytes.clone();
        let length = target.snapshot(&mut before).unwrap().len();
        before.truncate(length);
        let mut refused = |bytes: &[u8]| {
            assert!(target.restore(bytes).is_err());
            let mut after = vec![0; Jointly::SNAPSHOT_BYTES];
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
            IkmCalibrator::new(robot, &settings).snapshot(&mut bytes[..short.min(100)]),
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
    let gated = Selection::Gated { forgetting: None };
    let fading = |age| Selection::Gated {
        forgetting: Some(Forgetting::new(age).unwrap()),
    };
    let other_selections = [Selection::All { forgetting: None }, fading(20.0)];

    let mut stream = Arms::new(robot, &settings, &gated);
    for sample in samples {
        add(&mut stream, sample);
    }
    let mut bytes = vec![0; Arms::SNAPSHOT_BYTES];
    stream.snapshot(&mut bytes).unwrap();
    let restored =
        |robot, settings, selection| Arms::new(robot, settings, selection).restore(&bytes);
    assert_eq!(restored(robot, &settings, &gated), Ok(()));
    let other = Err(SnapshotError::OtherCalibration);
    for (robot, _) in &all[1..] {
        assert_eq!(restored(robot, &settings, &gated), other);
    }
    for settings in &others {
        assert_eq!(restored(robot, settings, &gated), other, "{settings:?}");
    }
    for selection in &other_selections {
        assert_eq!(
            restored(robot, &settings, selection),
            other,
            "{selection:?}"
        );
    }
    let kind = Err(SnapshotError::OtherKind);
    let mut jointly = StreamCalibrator::<f64, Joint>::new(robot, &settings, &gated);
    assert_eq!(jointly.restore(&bytes), kind);
    assert_eq!(IkmCalibrator::new(robot, &settings).restore(&bytes), kind);
    assert_eq!(JointCalibrator::new(robot, &settings).restore(&bytes), kind);
    let (robot, _) = &streams::<f32>(20)[0];
    let settings = statements::<f32>()[3];
    assert_eq!(IkmCalibrator::new(robot, &settings).restore(&bytes), kind);
    bytes[0] = 2;
    let version = Err(SnapshotError::OtherVersion { version: 2 });
    assert_eq!(
        IkmCalibrator::new(robot, &settings).restore(&bytes),
        version
    );
}

/// Early samples that a run contradicts, and many of them: the alarm and its sample outlast a power cut.
#[test]
fn an_alarm_is_in_the_snapshot() {
    let gated = Selection::Gated { forgetting: None };
    let settings = statements::<f64>()[3];
    let (robot, samples) = &streams::<f64>(80)[0];
    for good in [9, 30] {
        let new = || Arms::new(robot, &settings, &gated);
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
        let mut bytes = vec![0; Arms::SNAPSHOT_BYTES];
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
    let mut stream = Arms::new(robot, &Settings::default(), &Selection::default());
    for sample in samples {
        add(&mut stream, sample);
    }
    stream.solve().unwrap();
    let mut bytes = vec![0; Arms::SNAPSHOT_BYTES];
    assert_eq!(stream.snapshot(&mut bytes), Err(SnapshotError::Busy));
}
