//! Gate, forgetting and the joint estimator on the controller.

use crate::controller::driver::{
    Cut, Driver, FailingFlash, Flash, accepted, begin, message, samples,
};
use delta_cal::calibration::{Ikm, Joint};
use delta_cal::stream::{Forgetting, Selection, StreamCalibrator};
use delta_cal::{ArmIndex, Progress, Refusal, Sample, calibration};
use delta_cal_controller::{Number, PAGE, StreamFlash, StreamPace};
use delta_cal_protocol::{
    ArmReport, Begin, Estimator, Fault, GateStatus, Geometry, Phase, Request, Response,
};
use delta_cal_tests::paper_robot;
use embedded_storage::nor_flash::NorFlash;

/// Every option, each as the core has it and as it goes over the wire.
pub(crate) fn options<T: Number>() -> Vec<(Selection<T>, Begin<T>)> {
    let age = T::from_f64(20.0);
    let fading = Some(Forgetting::new(age).unwrap());
    let mut all = Vec::new();
    for estimator in [Estimator::Arms, Estimator::Joint] {
        for (gate, age, forgetting) in [
            (false, None, None),
            (false, Some(age), fading),
            (true, None, None),
            (true, Some(age), fading),
        ] {
            let gated = gate;
            let selection = Selection { gated, forgetting };
            let begin = Begin {
                estimator,
                gate,
                forgetting: age,
                ..begin(1)
            };
            all.push((selection, begin));
        }
    }
    all
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
fn compare<T: Number, E: calibration::Estimator>(
    driver: &mut Driver<T, Flash>,
    begin: &Begin<T>,
    here: &StreamCalibrator<T, E>,
) -> bool {
    let status = driver.status();
    let counts = here.gate_counts();
    let gate = counts.map(|counts| GateStatus::new(counts, here.alarm()));
    assert_eq!(status.gate, gate);
    let outcome = match (status.phase, here.outcome()) {
        (Phase::CalibrationRefused { refusal, .. }, Err(expected)) => {
            assert_eq!(refusal, expected);
            return false;
        }
        (Phase::Solved { fingerprint, .. }, Ok(outcome)) => {
            assert_eq!(fingerprint, Geometry::of(E::robot(outcome)).fingerprint());
            outcome
        }
        (phase, expected) => panic!("{begin:?}: {phase:?}, {expected:?}"),
    };
    let session = begin.session;
    for arm in ArmIndex::ALL {
        let Response::Outcome(report) = driver.ask(&Request::Outcome { session, arm }) else {
            panic!("no outcome")
        };
        assert_eq!(report, ArmReport::new(arm, &E::arm(outcome, arm)));
    }
    true
}

/// Whether the samples calibrate the robot, here as there.
fn both_solve<T: Number, E: calibration::Estimator>(
    driver: &mut Driver<T, Flash>,
    begin: &Begin<T>,
    selection: &Selection<T>,
    samples: &[Sample<T>],
) -> bool {
    let (settings, _) = begin.calibrator().unwrap();
    let mut here = StreamCalibrator::<T, E>::new(&paper_robot(), &settings, selection);
    for (index, sample) in (0..).zip(samples) {
        here.add(sample).unwrap();
        while here.step() == Progress::Working {}
        send(driver, index, sample);
    }
    // A refusal is that of the outcome.
    let _ = here.solve();
    while here.step() == Progress::Working {}
    while driver.solve(1, 40) == Phase::Solving || matches!(driver.status().phase, Phase::Solving) {
        driver.rest();
    }
    compare(driver, begin, &here)
}

fn options_have_the_bits_of_the_core<T: Number>() {
    let (mut solved, mut refused) = (0, 0);
    for (selection, begin) in options::<T>() {
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
                let run = match begin.estimator {
                    Estimator::Arms => both_solve::<T, Ikm>,
                    Estimator::Joint => both_solve::<T, Joint>,
                };
                if run(&mut driver, &begin, &selection, &samples) {
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
    options_have_the_bits_of_the_core::<f64>();
}

#[test]
fn a_robot_that_changes_is_told_before_the_solve_and_refused_by_it() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    driver.begin_with(full());
    let mut all = samples::<f32>(2, 60);
    for sample in &mut all[50..] {
        sample.position.z += 1.0;
    }
    for (index, sample) in (0..).zip(&all) {
        send(&mut driver, index, sample);
        let alarm = driver.status().gate.and_then(|gate| gate.alarm);
        // Eight in a row, the first of them the fiftieth, counted from 0.
        let expected = Refusal::RobotChanged { first: 50 };
        assert_eq!(alarm, (index >= 57).then_some(expected));
    }
    driver.solve(1, 60);
    driver.rest();
    assert!(matches!(
        driver.status().phase,
        Phase::CalibrationRefused {
            samples: 60,
            refusal: Refusal::RobotChanged { .. }
        }
    ));
}

/// Bytes of the flash of the samples.
const SAMPLES: usize = 16 * PAGE;

/// Every sample is stored.
pub(crate) const ALWAYS: StreamPace = StreamPace {
    seconds: 0,
    part: u32::MAX,
};

fn started<T: Number, S: NorFlash>(stream_flash: S) -> Driver<T, Flash, S> {
    let mut driver = Driver::start_with(Flash::new(), stream_flash);
    driver.controller.set_stream_pace(ALWAYS);
    driver
}

/// How many samples a controller has, of session 1.
fn kept<T: Number, S: NorFlash>(driver: &mut Driver<T, Flash, S>) -> Option<u32> {
    let status = driver.status();
    match status.phase {
        Phase::Idle => {
            assert_eq!(status.session, 0);
            None
        }
        Phase::Collecting { samples } => {
            assert_eq!(status.session, 1);
            Some(samples)
        }
        phase => panic!("{phase:?}"),
    }
}

/// The rest of the samples, and the result.
fn ended<T: Number, S: NorFlash>(
    driver: &mut Driver<T, Flash, S>,
    from: u32,
    samples: &[Sample<T>],
) -> Phase {
    for (index, sample) in (0..).zip(samples).skip(from as usize) {
        send(driver, index, sample);
    }
    driver.rest();
    driver.solve(1, u32::try_from(samples.len()).unwrap());
    driver.rest();
    driver.status().phase
}

/// The power fails after every sample.
fn goes_on_after_every_sample<T: Number>() {
    for (_, begin) in options::<T>() {
        let samples = one_wrong::<T>(3, 30);
        let mut whole = Driver::<T, _>::start(Flash::new());
        whole.begin_with(begin);
        let expected = ended(&mut whole, 0, &samples);

        let mut driver = started(StreamFlash::new());
        driver.begin_with(begin);
        for (index, sample) in (0..).zip(&samples) {
            send(&mut driver, index, sample);
            driver.rest();
            let (_, stream_flash) = driver.controller.into_flash();
            driver = started(stream_flash);
            assert_eq!(kept(&mut driver), Some(index + 1), "{begin:?}");
            // The same beginning goes on, too.
            assert_eq!(driver.begin_with(begin), index + 1);
        }
        assert_eq!(ended(&mut driver, 30, &samples), expected, "{begin:?}");
    }
}

#[test]
fn a_session_goes_on_after_a_power_cut_at_every_sample() {
    goes_on_after_every_sample::<f32>();
    goes_on_after_every_sample::<f64>();
}

/// A stream with the gate and both estimators: it has the most to store.
fn full() -> Begin<f32> {
    Begin {
        gate: true,
        estimator: Estimator::Joint,
        ..begin(1)
    }
}

/// The flash after two samples were stored, one after the other.
fn two_stored(samples: &[Sample<f32>]) -> StreamFlash {
    let mut driver = started(StreamFlash::new());
    driver.begin_with(full());
    for (index, sample) in (0..).zip(&samples[..2]) {
        send(&mut driver, index, sample);
        driver.rest();
    }
    driver.controller.into_flash().1
}

/// The power fails at every write and erase of a record, in every way: the samples before it, or with it, are there, and the
/// session ends with the bits of the undisturbed one.
#[test]
fn a_power_cut_while_samples_are_stored_loses_none_but_the_last() {
    let samples = one_wrong::<f32>(3, 30);
    let mut whole = Driver::<f32, _>::start(Flash::new());
    whole.begin_with(full());
    let expected = ended(&mut whole, 0, &samples);
    let flash = two_stored(&samples);
    // The third record, in place of the first.
    let third = |flash: FailingFlash<SAMPLES>| {
        let mut driver = started(flash);
        assert_eq!(kept(&mut driver), Some(2));
        send(&mut driver, 2, &samples[2]);
        driver.rest();
        driver.controller.into_flash().1
    };
    let operations = third(FailingFlash::new(flash.clone())).operations;
    assert!(operations > 50);
    let mut counts = [0; 2];
    for at in 0..operations {
        for cut in Cut::ALL {
            let failed = third(FailingFlash::fail(flash.clone(), at, cut));
            let mut driver = started(FailingFlash::new(failed.flash));
            let kept = kept(&mut driver).unwrap_or_else(|| panic!("{at}, {cut:?}: all are gone"));
            assert!(kept == 2 || kept == 3, "{at}, {cut:?}: {kept}");
            counts[kept as usize - 2] += 1;
            // Each of the ways once is gone to the end.
            if at % 7 == 0 {
                assert_eq!(
                    ended(&mut driver, kept, &samples),
                    expected,
                    "{at}, {cut:?}"
                );
            }
        }
    }
    let [before, after] = counts;
    println!("{operations} writes and erases: {before} cuts left two samples, {after} three");
    assert!(before > 0 && after > 0);
}

/// Both records are damaged, or another scalar asks.
#[test]
fn samples_that_cannot_be_used_are_not() {
    let flash = two_stored(&one_wrong::<f32>(3, 30));
    let mut damaged = flash.clone();
    let half = damaged.bytes.len() / 2;
    for place in [100, half + 100] {
        assert!(kept(&mut started::<f32, _>(damaged.clone())).is_some());
        damaged.bytes[place] ^= 1;
    }
    assert_eq!(kept(&mut started::<f32, _>(damaged)), None);
    assert_eq!(kept(&mut started::<f64, _>(flash)), None);
}

/// Turns of the control loop, as its interrupt would report them.
fn at_turn<S: NorFlash>(driver: &mut Driver<f32, Flash, S>, turns: u32) {
    let mut control = driver.status().control;
    (control.turns, control.turns_a_second) = (turns, 1000);
    driver.controller.set_control(control);
    driver.rest();
}

/// Of so many samples, one a second, how many records were stored, and how many samples a power cut would lose.
fn stored(pace: StreamPace, forgetting: Option<f32>, count: u32) -> (u32, u32) {
    let samples = samples::<f32>(3, 60);
    let flash = FailingFlash::<SAMPLES>::new(StreamFlash::new());
    let mut driver = Driver::<f32, Flash, _>::start_with(Flash::new(), flash);
    driver.begin_with(Begin {
        forgetting,
        ..begin(1)
    });
    driver.controller.set_stream_pace(pace);
    for second in 0..count {
        send(&mut driver, second, &samples[second as usize % 60]);
        at_turn(&mut driver, 1000 * (second + 60));
    }
    let (parameters, flash) = driver.controller.into_flash();
    // Both halves have the same pages.
    let erasures = flash.erasures / u32::try_from(SAMPLES / 2 / PAGE).unwrap();
    let mut driver = Driver::<f32, Flash, _>::start_with(parameters, flash.flash);
    (erasures, count - kept(&mut driver).unwrap())
}

/// The wear and the loss that the documentation states.
#[test]
fn samples_are_stored_as_rarely_as_stated() {
    // Two hours. With forgetting a record a minute; without, that for the first 16 minutes, and from 960 samples on one for a
    // sixteenth more, ln(7200/960)/ln(17/16) = 33.
    for (forgetting, expected) in [(None, 47..=51), (Some(160.0), 118..=120)] {
        let (records, lost) = stored(StreamPace::default(), forgetting, 7200);
        println!("memory {forgetting:?}: {records} records of 7200 samples, {lost} would be lost");
        assert!(expected.contains(&records), "{records}");
        assert!(lost < 7200 / 16, "{lost}");
    }
    // However fast: one for each of the first 17, and then for a sixteenth more, 17 + ln(7200/17)/ln(17/16).
    let fast = |part| StreamPace { seconds: 0, part };
    let (records, lost) = stored(fast(16), None, 7200);
    println!("{records} records of 7200 samples without a pause, {lost} would be lost");
    assert!(
        (100..=117).contains(&records) && lost < 7200 / 16,
        "{records}, {lost}"
    );
    // With forgetting from 160 samples on for each ten, a sixteenth of the mean age: 17 + ln(160/17)/ln(17/16) + 56.
    let (records, lost) = stored(fast(16), Some(160.0), 720);
    assert!(
        (100..=110).contains(&records) && lost < 10,
        "{records}, {lost}"
    );
    // And each of them, where that is asked for.
    assert_eq!(stored(fast(u32::MAX), None, 100), (100, 0));
}

/// A calibration whose result is in use is over: its samples do not come back with the next restart.
#[test]
fn samples_of_an_applied_calibration_do_not_come_back() {
    let samples = samples::<f32>(3, 30);
    let mut driver = started::<f32, _>(StreamFlash::new());
    driver.begin_with(full());
    let Phase::Solved { fingerprint, .. } = ended(&mut driver, 0, &samples) else {
        panic!("not solved")
    };
    let (parameters, long) = driver.controller.into_flash();
    let mut driver = Driver::<f32, Flash, _>::start_with(parameters, long.clone());
    driver.controller.set_stream_pace(ALWAYS);
    assert_eq!(kept(&mut driver), Some(30));
    driver.solve(1, 30);
    driver.rest();
    let applied = driver.apply(1, fingerprint);
    accepted(applied);
    driver.rest();
    let (parameters, stream_flash) = driver.controller.into_flash();
    let mut driver = Driver::<f32, Flash, _>::start_with(parameters, stream_flash);
    assert_eq!(driver.controller.current().fingerprint, fingerprint);
    assert_eq!(kept(&mut driver), None);

    // After a long session a new one is stored from its first sample on; and never, where that is asked for.
    for (seconds, part, expected) in [(0, 16, Some(1)), (u32::MAX, u32::MAX, Some(30))] {
        let mut driver = started::<f32, _>(long.clone());
        driver.begin_with(Begin {
            forgetting: Some(1000.0),
            ..full()
        });
        send(&mut driver, 0, &samples[0]);
        driver
            .controller
            .set_stream_pace(StreamPace { seconds, part });
        at_turn(&mut driver, u32::MAX);
        let (_, stream_flash) = driver.controller.into_flash();
        assert_eq!(kept(&mut started::<f32, _>(stream_flash)), expected);
    }
}
