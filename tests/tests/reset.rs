//! What is reset is new: every field and every byte of its snapshot, and whatever is called next. So is what a stream that
//! forgets holds after an alarm is acknowledged, but for its statistics. What is restored goes on to the same bits, and
//! bytes that are no snapshot are refused.

use crate::stream_calibrator::{selections, statements};
use delta_cal::calibration::{Calibrator, Estimator, Ikm, Joint};
use delta_cal::observations::{
    Distance, DistanceFrom, FkmCalibrator, Height, Instruments, Observation, ObservationNoise,
    Plane, Point,
};
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{Forgetting, StreamCalibrator};
use delta_cal::{Noise, Progress, Real, Refusal, Robot, Sample};
use delta_cal_tests::{Spread, converted, generator, measurements, paper_robot, perturbed, size};
use nalgebra::Vector3;
use rand_core::Rng;
use rand_pcg::Pcg32;
use std::fmt::Debug;

/// What is called next: one of several calls, a number of samples or steps, and the samples themselves.
struct Call<T: Real> {
    kind: u32,
    count: usize,
    samples: Vec<Sample<T>>,
}

trait Subject<T: Real>: Debug {
    /// The answer, and everything that can be asked for afterwards.
    fn call(&mut self, call: &Call<T>) -> String;
    /// Writes its snapshot; an error if there is none now.
    fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError>;
    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError>;
    fn samples(&self) -> u64;
    fn reset(&mut self);

    /// Its snapshot; empty if there is none now.
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; 16_384];
        let written = self.snapshot(&mut bytes).map_or(0, <[u8]>::len);
        bytes.truncate(written);
        bytes
    }
}

/// What the three kinds of calibrator have alike.
macro_rules! alike {
    () => {
        fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
            Self::snapshot(self, bytes)
        }

        fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
            Self::restore(self, bytes)
        }

        fn samples(&self) -> u64 {
            Self::samples(self)
        }

        fn reset(&mut self) {
            Self::reset(self);
        }
    };
}

/// Calls that all understand alike.
const SOLVE: u32 = 0;
const STEP: u32 = 1;
const ADD: u32 = 39;

fn call<T: Real>(kind: u32, count: usize, sample: &Sample<f64>) -> Call<T> {
    let samples = converted(std::slice::from_ref(sample));
    Call {
        kind,
        count,
        samples,
    }
}

impl<T: Real, E: Estimator> Subject<T> for Calibrator<T, E> {
    fn call(&mut self, call: &Call<T>) -> String {
        let [sample, others @ ..] = &call.samples[..] else {
            panic!("no sample")
        };
        let answer = match call.kind {
            0 => format!("{:?}", self.solve()),
            1 => format!("{:?}", (0..4 * call.count).map(|_| self.step()).last()),
            2 => format!("{:?}", self.calibrate()),
            3 => format!("{:?}", self.stop()),
            4 => format!("{:?}", self.flush()),
            5 => format!("{:?}", self.forget(T::HALF)),
            6 => format!("{:?}", self.add_many(others)),
            7 => {
                let mut other = Self::new(&self.robot(), self.settings());
                other.add_many(others).unwrap();
                format!("{:?}", self.merge(&other))
            }
            8 => format!("{:?}", self.restore(&self.bytes())),
            9..20 => {
                let forgetting = Forgetting::new(T::from_f64(12.0)).unwrap();
                format!("{:?}", self.add_forgetting(sample, &forgetting))
            }
            _ => format!("{:?}", self.add(sample)),
        };
        let state = (self.samples(), self.solving(), self.finished());
        format!("{answer} {state:?} {:?}", self.outcome())
    }

    alike!();
}

impl<T: Real, E: Estimator> Subject<T> for StreamCalibrator<T, E> {
    fn call(&mut self, call: &Call<T>) -> String {
        let [sample, ..] = &call.samples[..] else {
            panic!("no sample")
        };
        let answer = match call.kind {
            0 | 2 | 3 => format!("{:?}", self.solve()),
            1 | 4 | 5 => format!("{:?}", (0..4 * call.count).map(|_| self.step()).last()),
            6 => format!("{:?}", self.stop()),
            7 => format!("{:?}", self.restore(&self.bytes())),
            8 => format!("{:?}", self.innovations(sample)),
            9 if call.count == 1 => format!("{:?}", self.acknowledge()),
            _ => {
                let added = self.add(sample);
                while !call.kind.is_multiple_of(8) && self.step() == Progress::Working {}
                format!("{added:?}")
            }
        };
        let state = (self.samples(), self.solving(), self.finished());
        let gate = (self.alarm(), self.gate_counts());
        format!("{answer} {state:?} {gate:?} {:?}", self.outcome())
    }

    alike!();
}

/// Room for fewer rows than are added.
type Rows<T> = FkmCalibrator<T, 40, 30>;

impl<T: Real> Subject<T> for Rows<T> {
    fn call(&mut self, call: &Call<T>) -> String {
        let answer = match call.kind {
            0 => format!("{:?}", self.solve()),
            1 => format!("{:?}", (0..4 * call.count).map(|_| self.step()).last()),
            2 => format!("{:?}", self.calibrate()),
            3 => format!("{:?}", self.stop()),
            4 => format!("{:?}", self.restore(&self.bytes())),
            _ => {
                let Sample { joints, position } = call.samples[0];
                let mut observation = Observation::at(joints);
                let distance = |from, distance| Some(Distance { from, distance });
                match call.count % 4 {
                    0 => observation.position = [Some(position.x), None, Some(position.z)],
                    1 => {
                        observation.distance = distance(DistanceFrom::Point(0), length(&position));
                    }
                    2 => {
                        let other = [T::from_f64(0.1); 3];
                        let apart = position - self.robot().forward(&other).unwrap();
                        observation.distance = distance(DistanceFrom::Pose(other), length(&apart));
                    }
                    _ => {
                        let height = position.z + T::from_f64(560.0);
                        observation.height = Some(Height { plane: 0, height });
                    }
                }
                format!("{:?}", self.add(&observation))
            }
        };
        let state = (self.samples(), self.solving(), self.finished());
        format!("{answer} {state:?} {:?}", self.outcome())
    }

    alike!();
}

fn length<T: Real>(of: &Vector3<T>) -> T {
    of.dot(of).square_root()
}

fn noise() -> Noise<f64> {
    Noise::new(0.02, 3e-5).unwrap()
}

/// Calls with the samples of one robot, or of one measured upside down; one in twenty samples is wrong, or no number.
fn episode<T: Real>(truth: &Robot<f64>, calls: usize, rng: &mut Pcg32) -> Vec<Call<T>> {
    let (mirrored, noise) = (rng.next_u32().is_multiple_of(3), noise());
    (0..calls)
        .map(|_| {
            let mut samples = measurements(truth, 6, Some(&noise), rng);
            for sample in &mut samples {
                if mirrored {
                    sample.position.z = -sample.position.z;
                }
            }
            match rng.next_u32() % 40 {
                0 => samples[0].position.x += 5.0,
                1 => samples[0].joints[2] = f64::NAN,
                _ => {}
            }
            Call {
                kind: rng.next_u32() % 40,
                count: 1 + (rng.next_u32() % 12) as usize,
                samples: converted(&samples),
            }
        })
        .collect()
}

fn assert_same<T: Real>(what: &str, found: &impl Subject<T>, expected: &impl Subject<T>) {
    assert!(
        found.bytes() == expected.bytes(),
        "{what}: bytes of the snapshot differ"
    );
    let (found, expected) = (format!("{found:#?}"), format!("{expected:#?}"));
    let fields = found.lines().zip(expected.lines());
    for (line, (found, expected)) in fields.enumerate() {
        assert_eq!(found, expected, "{what}: field at line {line}");
    }
    assert_eq!(found.len(), expected.len(), "{what}");
}

/// Whatever was called before `reset`, the object and a new one answer alike ever after.
fn reset_is_new<T: Real, S: Subject<T>>(what: &str, seed: u64, new: impl Fn() -> S) {
    let mut rng = generator(1750, seed);
    let mut found = new();
    for _ in 0..size(1, 3) {
        let truth = perturbed(&paper_robot(), 0.4, 2e-3, Spread::Normal, &mut rng);
        let calls = 20 + (rng.next_u32() % 50) as usize;
        for call in episode(&truth, calls, &mut rng) {
            found.call(&call);
        }
        found.reset();
        let mut expected = new();
        assert_same(what, &found, &expected);
        for (index, call) in episode(&truth, 45, &mut rng).iter().enumerate() {
            let answers = [found.call(call), expected.call(call)];
            assert_eq!(answers[0], answers[1], "{what}: call {index}");
        }
        assert_same(what, &found, &expected);
    }
}

/// Written, and restored into another that holds something else, after every sample; of a gate also when it has raised the
/// alarm.
fn restored_goes_on<T: Real, S: Subject<T>>(what: &str, seed: u64, new: impl Fn() -> S) {
    let mut rng = generator(1770, seed);
    let truth = perturbed(&paper_robot(), 0.4, 2e-3, Spread::Normal, &mut rng);
    let mut samples = measurements(&truth, 42, Some(&noise()), &mut rng);
    samples[15].position.x += 5.0;
    let solved = |own: &mut S| {
        own.call(&call(SOLVE, 0, &samples[0]));
        own.call(&call(STEP, 10_000, &samples[0]))
    };
    let (mut whole, mut broken) = (new(), new());
    for (index, sample) in samples.iter().enumerate() {
        let mut sample = *sample;
        if index >= 32 {
            sample.position.y += 8.0;
        }
        let kind = if index % 3 == 0 { 12 } else { ADD };
        let added = call(kind, index, &sample);
        let bytes = broken.bytes();
        broken = new();
        broken.call(&call(ADD, 3, &samples[41 - index]));
        broken.restore(&bytes).unwrap();
        assert_eq!(broken.call(&added), whole.call(&added), "{what}: {index}");
        if [31, 41].contains(&index) {
            let bytes = broken.bytes();
            assert_eq!(solved(&mut broken), solved(&mut whole), "{what}");
            whole.restore(&bytes).unwrap();
            broken.restore(&bytes).unwrap();
        }
    }
}

/// With the length and the checksum that belong to it.
fn sealed(content: &[u8]) -> Vec<u8> {
    let mut bytes = content.to_vec();
    let length = u32::try_from(bytes.len() + 4).unwrap();
    bytes[4..8].copy_from_slice(&length.to_le_bytes());
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// Every bit of a snapshot, every length of it, and what flash holds before anything was written are refused and change
/// nothing. What other software wrote, with a valid checksum, is refused if its length is another; otherwise it is
/// refused, or every later sample counts.
fn damage_is_refused<T: Real, S: Subject<T>>(what: &str, new: impl Fn() -> S) {
    let mut rng = generator(1780, 0);
    let samples = measurements(&paper_robot(), 33, Some(&noise()), &mut rng);
    let filled = |count: usize| {
        let mut own = new();
        for (index, sample) in samples.iter().enumerate().take(count) {
            own.call(&call(ADD, index, sample));
        }
        own
    };
    let (good, mut target) = (filled(23).bytes(), filled(7));
    let before = target.bytes();
    let mut refused = |bytes: &[u8]| {
        assert!(target.restore(bytes).is_err(), "{what}");
        assert!(target.bytes() == before, "{what}");
    };
    // All bits of the header, and one in seven of the rest.
    for bit in (0..8 * good.len()).filter(|bit| *bit < 200 || bit % 7 == 0) {
        let mut damaged = good.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        refused(&damaged);
    }
    for length in (0..good.len()).step_by(13) {
        refused(&good[..length]);
    }
    refused(&vec![0xff; good.len()]);
    refused(&vec![0; good.len()]);
    let content = &good[..good.len() - 4];
    for length in [
        12,
        200,
        content.len() - 1,
        content.len() + 1,
        good.len() + 100,
    ] {
        let mut cut = content.to_vec();
        cut.resize(length, 0);
        refused(&sealed(&cut));
    }
    // What stands behind it does not matter: flash is read in whole pages.
    let longer = [&good[..], &[0xff; 500]].concat();
    target.restore(&longer).unwrap();
    assert!(target.bytes() == good, "{what}");

    assert_eq!(new().restore(&sealed(content)), Ok(()));
    let mut refused = 0;
    // The first and the last counts, and one byte in five of the rest.
    for place in 12..content.len() {
        if !place.is_multiple_of(5) && (30..content.len() - 200).contains(&place) {
            continue;
        }
        let mut changed = content.to_vec();
        changed[place] = if changed[place] == 5 { 4 } else { 5 };
        let mut restored = new();
        if restored.restore(&sealed(&changed)).is_err() {
            refused += 1;
            continue;
        }
        let count = restored.samples();
        for (index, sample) in samples.iter().enumerate().skip(23) {
            restored.call(&call(ADD, index, sample));
        }
        assert_eq!(restored.samples(), count + 10, "{what}: {place}");
    }
    assert!(refused > 0, "{what}");
}

/// All of it, of one that states what the statement of this number does.
fn holds<T: Real, S: Subject<T>>(what: &str, statement: u64, new: impl Fn() -> S) {
    reset_is_new(what, statement, &new);
    restored_goes_on(what, statement, &new);
    if statement == 3 && T::BYTES == 4 {
        damage_is_refused(what, &new);
    }
}

/// In double precision what states everything.
fn of_positions<T: Real, E: Estimator>(kind: &str) {
    let nominal = paper_robot::<T>();
    let single = T::BYTES == 4;
    for (number, settings) in statements().iter().enumerate() {
        if !single && number != 3 {
            continue;
        }
        let seed = number as u64;
        let what = format!("{kind}, statement {number}");
        holds(&what, seed, || Calibrator::<T, E>::new(&nominal, settings));
        for selection in selections() {
            let what = format!("{kind} stream, statement {number}, {selection:?}");
            holds(&what, seed, || {
                let mut new = StreamCalibrator::<T, E>::new(&nominal, settings, &selection);
                // The width is a setting, and stays.
                new.set_sigmas(T::from_f64(6.0)).unwrap();
                new
            });
        }
    }
}

#[test]
fn what_calibrates_each_arm_is_new_once_reset_and_goes_on_once_restored() {
    of_positions::<f64, Ikm>("arms");
    of_positions::<f32, Ikm>("arms");
}

#[test]
fn what_calibrates_all_arms_jointly_is_new_once_reset_and_goes_on_once_restored() {
    of_positions::<f64, Joint>("joint");
    of_positions::<f32, Joint>("joint");
}

fn of_readings<T: Real>() {
    let nominal = paper_robot::<T>();
    let number = T::from_f64;
    let noise = Noise::new(number(0.02), T::ZERO).unwrap();
    let noise = ObservationNoise::new(noise, number(0.02), number(0.02)).unwrap();
    let known = |height: f64| Plane {
        known: Some((number(height), number(1.0))),
        level: None,
    };
    let made = |plane: Plane<T>, settings: &_| {
        let instruments = Instruments {
            planes: &[plane],
            points: &[Point::default()],
            ..Instruments::new(noise)
        };
        Rows::<T>::new(&nominal, &instruments, settings).unwrap()
    };
    for (number, settings) in (0..).zip(&statements()) {
        let what = format!("readings, statement {number}");
        holds(&what, number, || made(known(-560.0), settings));
        for other in [known(-561.0), Plane::default()] {
            let refused = made(other, settings).restore(&made(known(-560.0), settings).bytes());
            assert_eq!(refused, Err(SnapshotError::OtherCalibration));
        }
    }
}

#[test]
fn what_calibrates_from_readings_is_new_once_reset_and_goes_on_once_restored() {
    of_readings::<f64>();
    of_readings::<f32>();
}

/// Bytes of a stream's snapshot without the count of samples before, and the gate's statistics and checksum behind.
fn without_statistics<T: Real, E: Estimator>(stream: &StreamCalibrator<T, E>) -> Vec<u8> {
    let mut bytes = stream.bytes();
    if !bytes.is_empty() {
        bytes.drain(..20);
        bytes.truncate(bytes.len() - 93);
    }
    bytes
}

/// The same with indices that begin at the acknowledgement.
fn later(refusal: Refusal, before: u64) -> Refusal {
    match refusal {
        Refusal::RobotChanged { first } => Refusal::RobotChanged {
            first: first - before,
        },
        Refusal::EarlySamplesWrong { first } => Refusal::EarlySamplesWrong {
            first: first - before,
        },
        other => other,
    }
}

fn acknowledged_is_new<T: Real, E: Estimator>() {
    let [.., selection] = selections();
    let (mut solved, noise) = (0, noise());
    for (number, settings) in statements().iter().enumerate() {
        for seed in 0..4 {
            let mut rng = generator(1760 + seed, number as u64);
            let new = || StreamCalibrator::<T, E>::new(&paper_robot(), settings, &selection);
            let mut found = new();
            // A robot, and after it the same in a frame that is upside down, until the alarm.
            let truth = perturbed(&paper_robot(), 0.4, 2e-3, Spread::Normal, &mut rng);
            for (index, mut sample) in measurements(&truth, 80, Some(&noise), &mut rng)
                .into_iter()
                .enumerate()
            {
                if index >= 40 {
                    sample.position.z = -sample.position.z;
                }
                if found.alarm().is_none() {
                    found.add(&converted(&[sample])[0]).unwrap();
                    while found.step() == Progress::Working {}
                }
            }
            assert!(found.alarm().is_some());
            found.acknowledge();
            let (before, mut expected) = (found.samples(), new());
            let bytes = [without_statistics(&found), without_statistics(&expected)];
            assert!(bytes[0] == bytes[1], "bytes of the snapshot differ");
            for call in episode::<T>(&truth, 60, &mut rng) {
                let sample = &call.samples[0];
                let answers = [&mut found, &mut expected].map(|stream| {
                    let added = stream.add(sample);
                    while stream.step() == Progress::Working {}
                    let mut end = None;
                    if call.kind == 0 {
                        let _ = stream.solve();
                        while stream.step() == Progress::Working {}
                        end = Some(stream.outcome().cloned());
                    }
                    (added, end, without_statistics(stream))
                });
                let [(added, end, bytes), (of_new, end_of_new, bytes_of_new)] = answers;
                assert_eq!(added, of_new);
                assert_eq!(
                    end.clone()
                        .map(|end| end.map_err(|refusal| later(refusal, before))),
                    end_of_new
                );
                assert!(bytes == bytes_of_new, "bytes of the snapshot differ");
                solved += u32::from(matches!(end, Some(Ok(_))));
            }
        }
    }
    println!("{solved} solved after an acknowledgement");
}

#[test]
fn a_stream_that_forgets_begins_anew_when_its_alarm_is_acknowledged() {
    acknowledged_is_new::<f64, Ikm>();
    acknowledged_is_new::<f64, Joint>();
    acknowledged_is_new::<f32, Ikm>();
    acknowledged_is_new::<f32, Joint>();
}
