use delta_cal::{Noise, Real, Robot, Sample, SymmetricRobot};
use nalgebra::Vector3;

#[allow(clippy::unreadable_literal)] // bit patterns
mod built_in {
    include!(concat!(env!("OUT_DIR"), "/samples.rs"));
}

/// How many samples are built in.
pub const SAMPLES: usize = built_in::SAMPLES.len();

/// The built-in measurements (simulated): radians and millimetres, each number rounded to nearest.
pub fn samples<T: Real>() -> [Sample<T>; SAMPLES] {
    built_in::SAMPLES.map(|bits| {
        let [q1, q2, q3, x, y, z] = bits.map(|bits| T::from_f64(f64::from_bits(bits)));
        Sample {
            joints: [q1, q2, q3],
            position: Vector3::new(x, y, z),
        }
    })
}

/// The robot as drawn: Ra 194, Rb 30, La 260, Lb 480 mm.
///
/// # Panics
/// Never: the dimensions are a robot's.
pub fn nominal<T: Real>() -> Robot<T> {
    SymmetricRobot {
        base_radius: T::from_f64(194.0),
        platform_radius: T::from_f64(30.0),
        upper_arm: T::from_f64(260.0),
        forearm: T::from_f64(480.0),
    }
    .robot()
    .expect("the dimensions are a robot's")
}

/// The noise of the built-in measurements: 0.02 mm and 0.002°.
///
/// # Panics
/// Never: the numbers are a noise.
pub fn noise<T: Real>() -> Noise<T> {
    Noise::new(T::from_f64(0.02), T::from_f64(0.002_f64.to_radians()))
        .expect("the numbers are a noise")
}
