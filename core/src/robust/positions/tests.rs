#![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

use super::Positions;
use crate::calibration::{Settings, Start, Tolerance};
use crate::robust::WeighedSample;
use crate::robust::fits::Fits;
use crate::samples::Sample;
use crate::samples::joint_factor_tests::{changed, empty, noises, samples};

/// Random subsets of the start: as many exact samples as they hold lead to the robot, and with a tolerance to one that
/// agrees with them.
#[test]
fn a_subset_of_the_start_determines_the_robot() {
    let truth = changed(40);
    let measured = samples::<12>(&truth, 41).map(|sample| Sample {
        position: truth.forward(&sample.joints).unwrap(),
        ..sample
    });
    let noise = Settings::default().with_noise(noises()[1]);
    let tolerance = Tolerance::new(0.5, 0.002).unwrap();
    for (settings, close) in [
        (noise, 1e-6),
        (noise.with_start(Start::Free), 1e-6),
        // What the samples leave open is as the nominal robot has it.
        (noise.with_tolerance(tolerance), f64::INFINITY),
    ] {
        let mut fits = Positions {
            settings: &settings,
            samples: &measured,
            empty: empty(noises()[1]),
        };
        let subset = fits.subset();
        let mut weighed = [WeighedSample::vacant(); 12];
        for sample in &mut weighed[subset..] {
            sample.factor = 0.0;
        }
        let correction = fits.fit(&settings, &weighed, subset as f64).unwrap();
        fits.measure(&correction, &mut weighed);
        // Less than σ.
        assert!(weighed[..subset].iter().all(|own| own.distance < 1.0));
        let nominal = fits.empty.nominal_arms();
        let arms = truth.arms().iter().zip(nominal);
        let expected = arms.flat_map(|(arm, nominal)| nominal.correction_to(arm));
        for (found, expected) in correction.iter().zip(expected) {
            assert!(
                (found - expected).abs() < close,
                "{subset}: {found} {expected}"
            );
        }
    }
}
