//! Golden values in the generators' format: bit patterns in hexadecimal.

use delta_cal::{Noise, Real, Robot, Sample, Settings, Tolerance};
use serde::Deserialize;
use std::num::ParseIntError;

/// A number in that format.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub struct Bits(pub f64);

impl TryFrom<String> for Bits {
    type Error = ParseIntError;

    fn try_from(hexadecimal: String) -> Result<Self, ParseIntError> {
        let bits = u64::from_str_radix(&hexadecimal, 16)?;
        Ok(Self(f64::from_bits(bits)))
    }
}

impl Bits {
    /// In either precision.
    pub fn real<T: Real>(self) -> T {
        T::from_f64(self.0)
    }
}

/// All numbers.
pub fn numbers(bits: &[Bits]) -> Vec<f64> {
    bits.iter().map(|bits| bits.0).collect()
}

/// The robot of 24 parameters.
pub fn robot(parameters: &[Bits]) -> Robot<f64> {
    let numbers = numbers(parameters);
    let arms = numbers.as_chunks().0.try_into().expect("24 parameters");
    Robot::from_parameters(arms).expect("the golden robot is valid")
}

/// Measurements and assumptions of a case, written by both generators.
#[derive(Debug, Deserialize)]
pub struct GoldenInput {
    joints: Vec<Bits>,
    positions: Vec<Bits>,
    noise: Option<[Bits; 2]>,
    /// σx, σy, σz and σq.
    #[serde(default)]
    noise_by_axis: Option<[Bits; 4]>,
    tolerance: Option<[Bits; 2]>,
}

impl GoldenInput {
    /// The samples, in radians and mm.
    pub fn samples(&self) -> Vec<Sample<f64>> {
        let joints = self.joints.as_chunks().0.iter();
        let positions = self.positions.as_chunks::<3>().0.iter();
        let pairs = joints.zip(positions);
        let sample = |(joints, position): (&[Bits; 3], &[Bits; 3])| Sample {
            joints: joints.map(|own| own.0),
            position: position.map(|own| own.0).into(),
        };
        pairs.map(sample).collect()
    }

    /// The stated noise and tolerance, and defaults otherwise.
    pub fn settings(&self) -> Settings<f64> {
        let alike = self
            .noise
            .map(|[position, joint]| Noise::new(position.0, joint.0));
        let by_axis = self.noise_by_axis.map(|sigmas| {
            let [x, y, z, joint] = sigmas.map(|own| own.0);
            Noise::by_axis([x, y, z], joint)
        });
        let tolerance = self
            .tolerance
            .map(|[length, angle]| Tolerance::new(length.0, angle.0));
        Settings::default()
            .with_noise(alike.or(by_axis).map(|own| own.expect("a noise")))
            .with_tolerance(tolerance.map(|own| own.expect("a tolerance")))
    }
}
