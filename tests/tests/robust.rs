//! The robust fit of either method: wrong samples do not spoil it, and are named; without any it is
//! worth 95 % of the plain fit; and its optimum is that of an independent program.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

mod clean;
mod goldens;
mod wrong_rows;

use delta_cal::{Noise, Robot, Sample, Settings};
use delta_cal_host::fit::method;
use delta_cal_host::{CalibrationMethod, Frame};

/// The document with the figures.
const DIAGNOSIS: &str = "docs/diagnosis.md";

fn noise() -> Noise<f64> {
    Noise::new(0.02, 0.002f64.to_radians()).unwrap()
}

fn settings(stated: bool) -> Settings<f64> {
    Settings::default().with_noise(stated.then(noise))
}

const fn stated_or_not(stated: bool) -> &'static str {
    if stated { "stated" } else { "unknown" }
}

/// The fit that counts every sample alike.
fn plain(
    nominal: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
    method: CalibrationMethod,
) -> Option<Robot<f64>> {
    method::calibrate(method, nominal, samples.into(), None, settings, Frame::Base)
        .ok()
        .map(|outcome| outcome.fit.robot)
}

/// The value below which that part of the values lies.
fn quantile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = (values.len() as f64 - 1.0) * part;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    values[index.round() as usize]
}
