//! Prior of an upper arm with an uncertain joint zero: its direction and its length.

use crate::Real;
use crate::samples::small_turn;

/// An upper arm a = (`La_x`, `La_y`) known by its direction at joint reading 0 and its length:
///
/// ```text
/// r = ( ∠(a₀, a)/σ_zero,  (|a| − |a₀|)/σ_length )
/// ```
///
/// A zero error of ten degrees moves `La_x` by 1.5 % of the upper arm and `La_y` by 17 %. No normal distribution of the
/// two represents that together with a length known to a fraction of a millimetre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UpperArm<T> {
    /// a₀ in the problem's unit of length.
    nominal: [T; 2],
    /// 1/`σ_zero` per radian, and 1/`σ_length` per unit of length.
    weights: [T; 2],
}

/// Direction and length of a displaced upper arm relative to the nominal one.
struct Moved<T> {
    arm: [T; 2],
    length: T,
    /// ∠(a₀, a), and |a| − |a₀|.
    turned: T,
    longer: T,
}

impl<T: Real> UpperArm<T> {
    pub(super) const fn new(nominal: [T; 2], weights: [T; 2]) -> Self {
        Self { nominal, weights }
    }

    /// Computed without cancellation.
    fn moved(&self, by: [T; 2]) -> Moved<T> {
        let ([x, y], [dx, dy]) = (self.nominal, by);
        let arm = [x + dx, y + dy];
        let length = length(arm);
        let along = x * dx + y * dy;
        let squared = dx.squared() + dy.squared();
        let nominal = x.squared() + y.squared();
        Moved {
            arm,
            length,
            turned: (x * dy - y * dx).angle_over(nominal + along),
            longer: (T::TWO * along + squared) / (nominal.square_root() + length),
        }
    }

    /// r, direction first.
    pub(super) fn residuals(&self, by: [T; 2]) -> [T; 2] {
        let Moved { turned, longer, .. } = self.moved(by);
        let [direction, length] = self.weights;
        [direction * turned, length * longer]
    }

    /// ∂r/∂(`La_x`, `La_y`), direction first.
    pub(super) fn jacobian(&self, by: [T; 2]) -> [[T; 2]; 2] {
        let Moved {
            arm: [x, y],
            length,
            ..
        } = self.moved(by);
        let [turn, stretch] = self.weights.map(|weight| weight / length);
        let turn = turn / length;
        [[-(turn * y), turn * x], [stretch * x, stretch * y]]
    }

    /// The result of a step given to first order: its part across the arm follows the circle, the other part leads
    /// outwards.
    pub(super) fn advanced(&self, by: [T; 2], step: [T; 2]) -> [T; 2] {
        let Moved {
            arm: [x, y],
            length,
            ..
        } = self.moved(by);
        let ([dx, dy], [sx, sy]) = (by, step);
        let squared = length.squared();
        let (sine, versine) = small_turn((x * sy - y * sx) / squared);
        let stretch = (x * sx + y * sy) / squared;
        let cosine = T::ONE - versine;
        let (radial, tangential) = (stretch * cosine - versine, sine * (T::ONE + stretch));
        [
            dx + radial * x - tangential * y,
            dy + radial * y + tangential * x,
        ]
    }
}

fn length<T: Real>([x, y]: [T; 2]) -> T {
    (x.squared() + y.squared()).square_root()
}

#[cfg(test)]
mod tests {
    use super::UpperArm;

    const ARM: UpperArm<f64> = UpperArm::new([0.8, 0.3], [9.0, 400.0]);

    /// The nominal arm rotated and lengthened.
    fn polar(turn: f64, longer: f64) -> [f64; 2] {
        let length = libm::hypot(0.8, 0.3) + longer;
        let angle = libm::atan2(0.3, 0.8) + turn;
        [
            length * libm::cos(angle) - 0.8,
            length * libm::sin(angle) - 0.3,
        ]
    }

    /// The part of a step across the arm rotates it without lengthening it; the part along it lengthens it.
    #[test]
    fn a_step_leads_along_the_circle() {
        let by = polar(0.2, 0.05);
        let [x, y] = [0.8 + by[0], 0.3 + by[1]];
        let length = libm::hypot(x, y);
        for (across, along) in [(0.0, 0.0), (0.25, 0.0), (0.0, 0.1), (-0.2, 0.03)] {
            let step = [
                (along * x - across * y) / length,
                (along * y + across * x) / length,
            ];
            let found = ARM.advanced(by, step);
            let expected = polar(0.2 + across / length, 0.05 + along);
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-15, "{found} {expected}");
            }
        }
    }
}
