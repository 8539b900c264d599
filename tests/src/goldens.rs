//! Golden values in the generators' format: bit patterns in hexadecimal.

use delta_cal::{Noise, Sample, Settings, Tolerance};
use nalgebra::Vector3;
use serde::Deserialize;

/// Measurements and assumptions of a case, written by both generators.
#[derive(Debug, Deserialize)]
pub struct GoldenInput {
    joints: Vec<String>,
    positions: Vec<String>,
    noise: Option<[String; 2]>,
    /// σx, σy, σz and σq.
    #[serde(default)]
    noise_by_axis: Option<[String; 4]>,
    tolerance: Option<[String; 2]>,
}

/// Parses one number.
pub fn number(bits: &str) -> f64 {
    f64::from_bits(u64::from_str_radix(bits, 16).expect("sixteen hexadecimal digits"))
}

/// Parses several numbers.
pub fn numbers(bits: &[String]) -> Vec<f64> {
    bits.iter().map(|bits| number(bits)).collect()
}

impl GoldenInput {
    /// The samples, in radians and mm.
    pub fn samples(&self) -> Vec<Sample<f64>> {
        let (joints, positions) = (numbers(&self.joints), numbers(&self.positions));
        let (joints, _) = joints.as_chunks::<3>();
        let (positions, _) = positions.as_chunks::<3>();
        joints
            .iter()
            .zip(positions)
            .map(|(joints, position)| Sample {
                joints: *joints,
                position: Vector3::from(*position),
            })
            .collect()
    }

    /// The stated noise and tolerance, and defaults otherwise.
    pub fn settings(&self) -> Settings<f64> {
        let pair = |[first, second]: &[String; 2]| (number(first), number(second));
        let alike = self.noise.as_ref().map(pair).map(|(position, joint)| {
            Noise::new(position, joint).expect("the golden noise is valid")
        });
        let by_axis = self.noise_by_axis.as_ref().map(|sigmas| {
            let [x, y, z, joint] = sigmas.each_ref().map(|sigma| number(sigma));
            Noise::by_axis([x, y, z], joint).expect("the golden noise is valid")
        });
        Settings::default()
            .with_noise(alike.or(by_axis))
            .with_tolerance(self.tolerance.as_ref().map(pair).map(|(length, angle)| {
                Tolerance::new(length, angle).expect("the golden tolerance is valid")
            }))
    }
}
