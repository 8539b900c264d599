//! The stream with everything in it: it decides and computes as its parts do by hand, and goes on from a snapshot to the same
//! bits.

mod parts;
mod snapshots;

use delta_cal::calibration::Start;
use delta_cal::stream::{
    AddError, Added, Estimator, Forgetting, Selection, StreamCalibrator, StreamOptions,
    StreamOutcome, StreamRefusal,
};
use delta_cal::{Noise, Progress, Real, Robot, Sample, Settings, Tolerance};
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
