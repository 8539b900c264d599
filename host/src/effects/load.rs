//! Effects of the load: the platform sinks where the arms reach far.

use super::Place;
use nalgebra::Vector3;

/// Sag at the largest distance from the robot's axis, growing with the square of the distance.
pub(super) fn columns(place: &Place) -> Vec<Vector3<f64>> {
    vec![Vector3::new(0.0, 0.0, -place.radius_squared)]
}
