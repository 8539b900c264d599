//! What is reset is new: every field and every byte of its snapshot, and whatever is called next. So is what a stream that
//! forgets holds after an alarm is acknowledged, but for its statistics.

use crate::stream_calibrator::{selections, statements};
use delta_cal::calibration::{Calibrator, Estimator, Ikm, Joint};
use delta_cal::observations::{
    Height, Instruments, Observation, ObservationNoise, Plane, PositionFrame, TouchCalibrator,
};
use delta_cal::stream::{Alarm, Forgetting, StreamCalibrator, StreamRefusal};
use delta_cal::{Noise, Progress, Real, Robot, Sample};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
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
    /// Its snapshot; empty if there is none now.
    fn bytes(&self) -> Vec<u8>;
    fn reset(&mut self);
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

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; Self::SNAPSHOT_BYTES];
        self.snapshot(&mut bytes).unwrap().to_vec()
    }

    fn reset(&mut self) {
        Self::reset(self);
    }
}

impl<T: Real, E: Estimator> Subject<T> for StreamCalibrator<T, E> {
    fn call(&mut self, call: &Call<T>) -> String {
        let [sample, ..] = &call.samples[..] else {
            panic!("no sample")
        };
        let answer = match call.kind {
            0..3 => format!("{:?}", self.solve()),
            3..6 => format!("{:?}", (0..4 * call.count).map(|_| self.step()).last()),
            6 => format!("{:?}", self.stop()),
            7 => format!("{:?}", self.restore(&self.bytes())),
            8 => format!("{:?}", self.innovations(sample)),
            9 if call.count == 1 => format!("{:?}", self.acknowledge()),
            _ => {
                let added = self.add(sample);
                while call.kind % 8 != 0 && self.step() == Progress::Working {}
                format!("{added:?}")
            }
        };
        let state = (self.samples(), self.solving(), self.finished());
        let gate = (self.alarm(), self.gate_counts());
        format!("{answer} {state:?} {gate:?} {:?}", self.outcome())
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; Self::SNAPSHOT_BYTES];
        let written = self.snapshot(&mut bytes).map_or(0, <[u8]>::len);
        bytes.truncate(written);
        bytes
    }

    fn reset(&mut self) {
        Self::reset(self);
    }
}

/// Room for fewer rows than are added.
type Touches<T> = TouchCalibrator<T, 40>;

impl<T: Real> Subject<T> for Touches<T> {
    fn call(&mut self, call: &Call<T>) -> String {
        let answer = match call.kind {
            0 => format!("{:?}", self.solve()),
            1 => format!("{:?}", (0..4 * call.count).map(|_| self.step()).last()),
            2 => format!("{:?}", self.calibrate()),
            3 => format!("{:?}", self.stop()),
            _ => {
                let sample = &call.samples[0];
                let height = sample.position.z + T::from_f64(560.0);
                let observation = Observation {
                    height: Some(Height { plane: 0, height }),
                    ..Observation::at(sample.joints)
                };
                format!("{:?}", self.add(&observation))
            }
        };
        let state = (self.samples(), self.solving(), self.finished());
        format!("{answer} {state:?} {:?}", self.outcome())
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; Self::SNAPSHOT_BYTES];
        let written = self.snapshot(&mut bytes).map_or(0, <[u8]>::len);
        bytes.truncate(written);
        bytes
    }

    fn reset(&mut self) {
        Self::reset(self);
    }
}

fn noise() -> Noise<f64> {
    Noise::new(0.02, 3e-5).unwrap()
}

fn converted<T: Real>(sample: &Sample<f64>) -> Sample<T> {
    Sample {
        joints: sample.joints.map(T::from_f64),
        position: sample.position.map(T::from_f64),
    }
}

/// Calls with the samples of one robot, or of one measured upside down; one in twenty samples is wrong, or no number.
fn episode<T: Real>(truth: &Robot<f64>, calls: usize, rng: &mut Pcg32) -> Vec<Call<T>> {
    let (mirrored, noise) = (rng.next_u32() % 3 == 0, noise());
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
                samples: samples.iter().map(converted).collect(),
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
    for _ in 0..3 {
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

fn resets<T: Real, E: Estimator>(kind: &str) {
    let nominal = paper_robot::<T>();
    for (number, settings) in statements().iter().enumerate() {
        let seed = number as u64;
        let what = format!("{kind}, statement {number}");
        reset_is_new(&what, seed, || Calibrator::<T, E>::new(&nominal, settings));
        for selection in selections() {
            let what = format!("{kind} stream, statement {number}, {selection:?}");
            reset_is_new(&what, seed, || {
                let mut new = StreamCalibrator::<T, E>::new(&nominal, settings, &selection);
                // The width is a setting, and stays.
                new.set_sigmas(T::from_f64(6.0)).unwrap();
                new
            });
        }
    }
}

#[test]
fn what_calibrates_each_arm_is_new_once_reset() {
    resets::<f64, Ikm>("arms");
    resets::<f32, Ikm>("arms");
}

#[test]
fn what_calibrates_all_arms_jointly_is_new_once_reset() {
    resets::<f64, Joint>("joint");
    resets::<f32, Joint>("joint");
}

fn resets_of_touches<T: Real>() {
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane::default()],
        points: &[],
        noise: ObservationNoise::new(
            Noise::new(T::from_f64(0.02), T::ZERO).unwrap(),
            T::from_f64(0.02),
            T::from_f64(0.02),
        )
        .unwrap(),
        transmission: None,
    };
    for (number, settings) in statements().iter().enumerate() {
        let what = format!("touches, statement {number}");
        let nominal = paper_robot::<T>();
        reset_is_new(&what, number as u64, || {
            Touches::<T>::new(&nominal, &instruments, settings).unwrap()
        });
    }
}

#[test]
fn what_calibrates_from_touches_is_new_once_reset() {
    resets_of_touches::<f64>();
    resets_of_touches::<f32>();
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
fn later(refusal: StreamRefusal, before: u64) -> StreamRefusal {
    StreamRefusal::Alarm(match refusal {
        StreamRefusal::Alarm(Alarm::RobotChanged { first }) => Alarm::RobotChanged {
            first: first - before,
        },
        StreamRefusal::Alarm(Alarm::EarlySamplesWrong { first }) => Alarm::EarlySamplesWrong {
            first: first - before,
        },
        other => return other,
    })
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
                    found.add(&converted(&sample)).unwrap();
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
