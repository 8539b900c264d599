//! The numbers in the messages of which the page shows the bytes.

use super::pieces::Bits;
use crate::Geometry;

pub(super) const SESSION: u32 = 300;
pub(super) const SAMPLES: u32 = 20;
pub(super) const GENERATION: u32 = 3;

pub(super) fn arms<T: Bits>() -> [[T; 8]; 3] {
    let arm = |dx: f64, dy, theta| [dx, dy, 0.25, theta, 0.0, 260.75, -0.5, 480.0].map(T::from_f64);
    [
        arm(164.0, 0.0, 0.0),
        arm(-82.0, 142.0, 2.1),
        arm(-82.0, -142.0, -2.1),
    ]
}

pub(super) fn transmissions<T: Bits>() -> [[T; 5]; 3] {
    [
        [0.0; 5],
        [0.001, 0.0005, -0.0005, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.00025, -0.0001],
    ]
    .map(numbers)
}

pub(super) fn geometry<T: Bits>(with_transmissions: bool) -> Geometry<T> {
    Geometry {
        arms: arms(),
        transmissions: with_transmissions.then(transmissions),
    }
}

pub(super) fn numbers<T: Bits, const N: usize>(numbers: [f64; N]) -> [T; N] {
    numbers.map(T::from_f64)
}
