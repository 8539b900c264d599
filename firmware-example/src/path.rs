use delta_cal::Real;
use nalgebra::Vector3;

/// Turns per revolution.
const TURNS: f64 = 4000.0;
const RADIUS: f64 = 100.0;
const HEIGHT: f64 = -450.0;
const RISE: f64 = 40.0;

/// The platform's path: stands for your controller's motion planner.
pub trait Path<T: Real> {
    /// The point for the next turn, mm.
    fn next_point(&mut self) -> Vector3<T>;
}

/// A circle with a radius of 100 mm, in four seconds; the height oscillates twice per revolution by 40 mm about its
/// mean. Stands for the motion planner of a real controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle<T> {
    /// An integer.
    turn: T,
}

impl<T: Real> Default for Circle<T> {
    fn default() -> Self {
        Self { turn: T::ZERO }
    }
}

impl<T: Real> Path<T> for Circle<T> {
    fn next_point(&mut self) -> Vector3<T> {
        let turns = T::from_f64(TURNS);
        let (sine, cosine) = (T::TWO * T::PI * self.turn / turns).sine_cosine();
        self.turn += T::ONE;
        if self.turn >= turns {
            self.turn = T::ZERO;
        }
        Vector3::new(
            T::from_f64(RADIUS) * cosine,
            T::from_f64(RADIUS) * sine,
            T::from_f64(HEIGHT) + T::from_f64(2.0 * RISE) * sine * cosine,
        )
    }
}
