//! Snapshots: the same bits after a restart, and nothing from damaged or foreign bytes.

use super::{DEGREE, add, end, options, statements, streams};
use delta_cal::calibration::{JointCalibrator, Settings, Solver};
use delta_cal::robot::SymmetricLinearRobot;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{
    Alarm, Estimator, Forgetting, Gate, Selection, StreamCalibrator, StreamOptions,
};
use delta_cal::{Calibrator, Noise, Real, Tolerance};

/// After every sample the stream is written, forgotten and restored; the other one is not.
fn interrupted<T: Real>() {
    let mut bytes = vec![0; StreamCalibrator::<T>::SNAPSHOT_BYTES];
    for (robot, samples) in &streams::<T>(32) {
        for settings in statements() {
            for options in options() {
                let new = || StreamCalibrator::new(robot, &settings, &options).unwrap();
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
        let mut stream = StreamCalibrator::new(robot, &settings, &options).unwrap();
        for sample in samples {
            add(&mut stream, sample);
        }
        let mut bytes = vec![0; StreamCalibrator::<f32>::SNAPSHOT_BYTES];
        let good = stream.snapshot(&mut bytes).unwrap().to_vec();
        let mut target = StreamCalibrator::new(robot, &settings, &options).unwrap();
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

/// Another robot, and every setting and option that is another one.
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
        settings.with_solver(Solver::GaussNewton),
        settings.with_start(delta_cal::calibration::Start::Free),
        settings.with_iteration_limit(49),
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

    let mut stream = StreamCalibrator::new(robot, &settings, &gated).unwrap();
    for sample in samples {
        add(&mut stream, sample);
    }
    let mut bytes = vec![0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
    stream.snapshot(&mut bytes).unwrap();
    let restored = |robot, settings, options| {
        StreamCalibrator::new(robot, settings, options)
            .unwrap()
            .restore(&bytes)
    };
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

/// Of towers the common radius is a part of the tolerance, too.
#[test]
fn a_snapshot_of_towers_belongs_to_its_common_radius() {
    let robot = SymmetricLinearRobot {
        tower_radius: 140.0,
        forearm: 330.0,
    };
    let robot = robot.robot().unwrap();
    let with_radius = |radius| {
        let tolerance = Tolerance::new(0.5, 0.2 * DEGREE).unwrap();
        Settings::default().with_tolerance(tolerance.with_radius(radius).unwrap())
    };
    let mut bytes = vec![0; Calibrator::<f64>::SNAPSHOT_BYTES];
    Calibrator::new(&robot, &with_radius(2.0))
        .snapshot(&mut bytes)
        .unwrap();
    let restored = |radius| Calibrator::new(&robot, &with_radius(radius)).restore(&bytes);
    assert_eq!(restored(2.0), Ok(()));
    assert_eq!(restored(3.0), Err(SnapshotError::OtherCalibration));
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
        let new = || StreamCalibrator::new(robot, &settings, &options).unwrap();
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
    let mut stream = StreamCalibrator::new(robot, &Settings::default(), &all).unwrap();
    for sample in samples {
        add(&mut stream, sample);
    }
    stream.solve();
    let mut bytes = vec![0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
    assert_eq!(stream.snapshot(&mut bytes), Err(SnapshotError::Busy));
}
