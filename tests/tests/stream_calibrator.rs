//! The stream with everything in it: it decides and computes as its parts do by hand. Nothing changes the samples of a
//! calibrator while it solves.

use delta_cal::calibration::{Calibrator, Estimator, Ikm, Joint};
use delta_cal::samples::{MergeError, SampleError};
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{Forgetting, Selection, StreamCalibrator, Verdict};
use delta_cal::{
    Busy, IkmCalibrator, JointCalibrator, Noise, Progress, Real, Refusal, Robot, Sample, Settings,
    Tolerance,
};
use delta_cal_tests::geometries::{geometries, symmetric};
use delta_cal_tests::{DEGREE, Spread, converted, generator, measurements, noise, perturbed};

type Arms = StreamCalibrator<f64, Ikm>;

const GATED: Selection<f64> = Selection {
    gated: true,
    forgetting: None,
};

fn stated() -> Settings<f64> {
    statements()[3]
}

/// What is stated: nothing, the noise, the tolerance, both.
pub(crate) fn statements<T: Real>() -> Vec<Settings<T>> {
    let noise = noise();
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
    all.push(all[3].with_free_start(true));
    all
}

pub(crate) fn selections<T: Real>() -> [Selection<T>; 4] {
    let fading = Some(Forgetting::new(T::from_f64(20.0)).unwrap());
    [(false, None), (false, fading), (true, None), (true, fading)]
        .map(|(gated, forgetting)| Selection { gated, forgetting })
}

/// A robot as drawn, and measurements of one that was built to the tolerance; one sample in the middle is 5 mm off.
fn streams<T: Real>(count: usize) -> Vec<(Robot<T>, Vec<Sample<T>>)> {
    let robots = geometries().into_iter().zip(0..);
    robots
        .map(|((_, nominal), number)| {
            let mut rng = generator(1700, number);
            let truth = perturbed(&nominal, 0.5, 0.2 * DEGREE, Spread::Normal, &mut rng);
            let mut samples = measurements(&truth, count, Some(&noise()), &mut rng);
            samples[count / 2 - 1].position.x += 5.0;
            (nominal.cast().unwrap(), converted(&samples))
        })
        .collect()
}

/// Everything that comes of samples.
type End<T, E> = (
    Vec<Verdict<T>>,
    Result<<E as Estimator>::Outcome<T>, Refusal>,
);

fn add<T: Real, E: Estimator>(
    stream: &mut StreamCalibrator<T, E>,
    sample: &Sample<T>,
) -> Verdict<T> {
    let added = stream.add(sample).unwrap();
    while stream.step() == Progress::Working {
        // Nothing comes in while the gate's estimate is solved.
        assert_eq!(stream.add(sample), Err(SampleError::Busy(Busy)));
    }
    added
}

fn end<T: Real, E: Estimator>(
    mut stream: StreamCalibrator<T, E>,
    added: Vec<Verdict<T>>,
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
    added: &[Verdict<T>],
) -> Result<E::Outcome<T>, Refusal> {
    let mut calibrator = Calibrator::<T, E>::new(robot, settings);
    let forgetting = selection.forgetting.as_ref();
    for (sample, added) in samples.iter().zip(added) {
        if matches!(added, Verdict::Rejected(_)) {
            continue;
        }
        match forgetting {
            Some(forgetting) => calibrator.add_forgetting(sample, forgetting),
            None => calibrator.add(sample),
        }
        .unwrap();
    }
    calibrator.calibrate()
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
                    Err(
                        Refusal::RobotChanged { .. }
                        | Refusal::EarlySamplesWrong { .. }
                        | Refusal::TooManyRejected { .. },
                    ) => 2,
                    Err(_) => 1,
                }] += 1;
                let expected = by_hand::<T, E>(robot, settings, &selection, samples, &added);
                assert_eq!(found, expected, "{selection:?}");
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
    for (robot, samples) in &streams::<f64>(32) {
        for asked_at in [0, 1, 3] {
            let settings = Settings::default();
            let mut stream = Arms::new(robot, &settings, &GATED);
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
    let [plain, _, _, fading] = selections();
    let mut stream = Arms::new(robot, &settings, &GATED);
    for sample in samples {
        add(&mut stream, sample);
    }
    let mut bytes = vec![0; Arms::SNAPSHOT_BYTES];
    let short = stream.snapshot(&mut bytes[1..]);
    assert_eq!(short, Err(SnapshotError::BufferTooShort));
    stream.snapshot(&mut bytes).unwrap();
    let restored =
        |robot, settings, selection| Arms::new(robot, settings, selection).restore(&bytes);
    assert_eq!(restored(robot, &settings, &GATED), Ok(()));
    let other = Err(SnapshotError::OtherCalibration);
    for (robot, _) in &all[1..] {
        assert_eq!(restored(robot, &settings, &GATED), other);
    }
    for settings in &others {
        assert_eq!(restored(robot, settings, &GATED), other, "{settings:?}");
    }
    for selection in &[plain, fading] {
        assert_eq!(
            restored(robot, &settings, selection),
            other,
            "{selection:?}"
        );
    }
    let kind = Err(SnapshotError::OtherKind);
    let mut jointly = StreamCalibrator::<f64, Joint>::new(robot, &settings, &GATED);
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

/// The paper's robot with other forearms.
fn with_forearms(forearm: f64) -> Robot<f64> {
    symmetric([194.0, 30.0, 260.0, forearm])
}

/// An exact measurement, at other joint angles for every index.
fn sample(of: &Robot<f64>, index: usize) -> Sample<f64> {
    let t = index as f64;
    let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
    let position = of.forward(&joints).unwrap();
    Sample { joints, position }
}

/// The position error of the platform.
fn solved(stream: &mut Arms, truth: &Robot<f64>) -> Result<f64, Refusal> {
    stream.solve()?;
    while stream.step() == Progress::Working {}
    let outcome = stream.outcome()?;
    let at = |robot: &Robot<f64>| robot.forward(&[0.1, 0.2, -0.3]).unwrap();
    Ok((at(&outcome.robot) - at(truth)).norm())
}

/// Without a tolerance, the gate needs an estimate at the twelfth sample. While it is solved nothing is written or restored; once
/// stopped it is solved at the next sample, and not what was asked for besides.
#[test]
fn a_stopped_estimate_is_solved_at_the_next_sample() {
    let (nominal, truth) = (with_forearms(480.0), with_forearms(480.4));
    let mut stream = Arms::new(&nominal, &Settings::default(), &GATED);
    let mut bytes = [0; Arms::SNAPSHOT_BYTES];
    stream.snapshot(&mut bytes).unwrap();
    for k in 0..12 {
        stream.add(&sample(&truth, k)).unwrap();
    }
    stream.solve().unwrap();
    let busy = SnapshotError::Busy(Busy);
    assert_eq!(stream.restore(&bytes), Err(busy));
    assert_eq!(stream.snapshot(&mut bytes), Err(busy));
    stream.stop();
    add(&mut stream, &sample(&truth, 12));
    assert!(!stream.finished() && !stream.solving());
    let wrong = add(&mut stream, &sample(&nominal, 13));
    assert!(matches!(wrong, Verdict::Rejected(_)));
    stream.restore(&bytes).unwrap();
}

/// The stored samples depend only on robot and noise.
#[test]
fn samples_outlast_a_change_of_how_they_are_solved() {
    let (nominal, truth) = (with_forearms(480.0), with_forearms(480.4));
    let all = Selection::default();
    let changed = [
        stated().with_iteration_limit(20),
        stated().with_damping(false),
        stated().with_tolerance(Tolerance::new(0.8, 0.003).unwrap()),
        stated().with_tolerance(None),
    ];
    let mut stream = Arms::new(&nominal, &stated(), &all);
    for k in 0..30 {
        stream.add(&sample(&truth, k)).unwrap();
    }
    let mut bytes = [0; Arms::SNAPSHOT_BYTES];
    stream.snapshot(&mut bytes).unwrap();
    for settings in changed {
        let mut restored = Arms::new(&nominal, &settings, &all);
        restored.restore(&bytes).unwrap();
        assert_eq!(restored.samples(), 30);
        assert!(solved(&mut restored, &truth).unwrap() < 0.02);
    }
    let noise = stated().with_noise(Noise::new(0.03, 0.0).unwrap());
    let mut other = Arms::new(&nominal, &noise, &all);
    assert!(other.restore(&bytes).is_err());
}

/// Adding, forgetting, merging or restoring during a solve would mix two factors: each call is refused at every
/// step, and the outcome is that of an undisturbed solve.
fn nothing_changes_the_samples<E: Estimator>() {
    let (drawn, forgetting) = (with_forearms(480.0), Forgetting::new(19.0).unwrap());
    let mut calibrator = Calibrator::<f64, E>::new(&drawn, &Settings::default());
    for count in 0..21 {
        calibrator
            .add(&sample(&with_forearms(480.3), count))
            .unwrap();
    }
    let other = calibrator.clone();
    let mut bytes = [0; 8192];
    let stored = other.snapshot(&mut bytes).unwrap();
    let another = sample(&with_forearms(490.0), 30);
    let expected = calibrator.clone().calibrate();
    calibrator.solve().unwrap();
    while calibrator.step() == Progress::Working {
        for refused in [
            calibrator.add(&another),
            calibrator.add_forgetting(&another, &forgetting),
            calibrator.add_many(&[another]).map_err(|(_, error)| error),
            calibrator.forget(0.5).map_err(SampleError::from),
        ] {
            assert_eq!(refused, Err(SampleError::Busy(Busy)));
        }
        assert_eq!(calibrator.merge(&other), Err(MergeError::Busy(Busy)));
        assert_eq!(calibrator.restore(stored), Err(SnapshotError::Busy(Busy)));
        calibrator.flush();
        calibrator.solve().unwrap();
    }
    assert_eq!(calibrator.outcome().cloned(), expected);
    assert!(expected.is_ok());
}

#[test]
fn while_it_solves_nothing_changes_the_samples() {
    nothing_changes_the_samples::<Ikm>();
    nothing_changes_the_samples::<Joint>();
}
