use delta_cal::Real;
use nalgebra::Vector3;

/// Turns for once around.
const TURNS: u32 = 4000;
const RADIUS: f64 = 100.0;
const HEIGHT: f64 = -450.0;
const RISE: f64 = 40.0;

/// Where the platform is to go: around a circle of 100 mm that rises and falls by 40 mm twice on
/// the way, in four seconds. Stands in for the motion planner of a real controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Path {
    turn: u32,
}

impl Path {
    /// The next point, mm.
    pub fn next_point<T: Real>(&mut self) -> Vector3<T> {
        let angle =
            T::TWO * T::PI * T::from_count(u64::from(self.turn)) / T::from_count(u64::from(TURNS));
        self.turn = if self.turn + 1 < TURNS {
            self.turn + 1
        } else {
            0
        };
        let (sine, cosine) = angle.sine_cosine();
        Vector3::new(
            T::from_f64(RADIUS) * cosine,
            T::from_f64(RADIUS) * sine,
            T::from_f64(HEIGHT) + T::from_f64(2.0 * RISE) * sine * cosine,
        )
    }
}
