use delta_cal::Real;
use nalgebra::Vector3;

/// Turns for once around.
const TURNS: f64 = 4000.0;
const RADIUS: f64 = 100.0;
const HEIGHT: f64 = -450.0;
const RISE: f64 = 40.0;

/// Where the platform is to go: the motion planner of your controller.
pub trait Path<T: Real> {
    /// The point of the next turn, mm.
    fn next_point(&mut self) -> Vector3<T>;
}

/// Around a circle with a radius of 100 mm, in four seconds; on the way the height rises and falls twice by 40 mm
/// about its mean. Stands in for the motion planner of a real controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle<T> {
    /// A whole number.
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
