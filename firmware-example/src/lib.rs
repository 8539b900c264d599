//! The robot and the path of the example: its programs, and the tests, run the controller with them.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

use delta_cal::robot::GeometryError;
use delta_cal::{Real, Robot, SymmetricRobot};
use delta_cal_controller::{Limits, Machine, Path};
use nalgebra::Vector3;

/// The robot as designed: that of Bentaleb and Iqbal (2020), in millimetres.
///
/// # Errors
/// None: the dimensions are valid.
pub fn nominal<T: Real>() -> Result<Robot<T>, GeometryError> {
    SymmetricRobot {
        base_radius: T::from_f64(194.0),
        platform_radius: T::from_f64(30.0),
        upper_arm: T::from_f64(260.0),
        forearm: T::from_f64(480.0),
    }
    .robot()
}

/// Corners of the work space, mm.
const WORK: [[f32; 3]; 4] = [
    [120.0, 120.0, -380.0],
    [-120.0, -120.0, -380.0],
    [120.0, -120.0, -520.0],
    [-120.0, 120.0, -520.0],
];

/// What the board states of its robot; `processor` is the core's CPUID.
///
/// # Errors
/// As [`nominal`].
pub fn machine<T: Real>(processor: u32) -> Result<Machine<T>, GeometryError> {
    Ok(Machine {
        nominal: nominal()?,
        work: &WORK,
        processor,
    })
}

/// Turns of the control loop per second.
pub const TURNS_A_SECOND: u32 = 1000;

/// Half a second to blend; 6 rad/s and 100 rad/s².
pub fn limits<T: Real>() -> Limits<T> {
    Limits {
        turns_a_second: TURNS_A_SECOND,
        blend_turns: TURNS_A_SECOND / 2,
        speed: T::from_f64(6.0),
        acceleration: T::from_f64(100.0),
    }
}

/// Turns per revolution, and until the path is as fast.
const TURNS: f64 = 4000.0;
const START: f64 = 256.0;
const RADIUS: f64 = 100.0;
const HEIGHT: f64 = -450.0;
const RISE: f64 = 40.0;

/// A circle with a radius of 100 mm, in 4000 turns; the height oscillates twice per revolution by 40 mm about its mean.
/// It begins at rest. Stands for the motion planner of a real controller.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Circle<T> {
    /// The place, in turns, and how many it goes on in the next one: multiples of 1 / 256, without rounding.
    turn: T,
    step: T,
}

impl<T: Real> Path<T> for Circle<T> {
    fn next_point(&mut self) -> Vector3<T> {
        let turns = T::from_f64(TURNS);
        let (sine, cosine) = (T::TWO * T::PI * self.turn / turns).sine_cosine();
        if self.step < T::ONE {
            self.step += T::ONE / T::from_f64(START);
        }
        self.turn += self.step;
        if self.turn >= turns {
            self.turn -= turns;
        }
        Vector3::new(
            T::from_f64(RADIUS) * cosine,
            T::from_f64(RADIUS) * sine,
            T::from_f64(HEIGHT) + T::from_f64(2.0 * RISE) * sine * cosine,
        )
    }

    fn stopped(&mut self) {
        self.step = T::ZERO;
    }
}
