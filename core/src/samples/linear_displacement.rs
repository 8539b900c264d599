//! Displacements of arms with linear drives.

use super::displacement::Displacement;
#[cfg(feature = "linear")]
use super::displacement::small_turn;
#[cfg(feature = "linear")]
use super::nominal_arm::NominalArm;
use crate::Real;
#[cfg(feature = "linear")]
use crate::robot::DriveOf;
use nalgebra::Vector3;

impl<T: Real> Displacement<T> {
    #[cfg(feature = "linear")]
    pub(super) fn of_linear_drive(nominal: &NominalArm<T>, correction: &[T; 8]) -> Self {
        let [dx, dy, dz, lean_x, lean_y, delta_scale, _, delta_lb] = *correction;
        let [_, _, _, lean_x0, lean_y0, ..] = nominal.arm().parameters();
        let direction0 = nominal.arm().basis().ez;
        // sin (lean + δ) − sin lean, and cos (lean + δ).
        let leaning = |lean: T, delta: T| {
            let (sine0, cosine0) = lean.sine_cosine();
            let (sine, versine) = small_turn(delta);
            let (_, cosine) = (lean + delta).sine_cosine();
            (cosine0 * sine - sine0 * versine, cosine)
        };
        let (delta_x, cos_x) = leaning(lean_x0, lean_x);
        let (delta_y, cos_y) = leaning(lean_y0, lean_y);
        let (x, y) = (direction0.x + delta_x, direction0.y + delta_y);
        // z² − z₀², and z − z₀ from it.
        let delta_z_squared = -(delta_x * (direction0.x + x) + delta_y * (direction0.y + y));
        let z = (direction0.z * direction0.z + delta_z_squared).square_root();
        let delta_z = delta_z_squared / (direction0.z + z);
        let delta_direction = Vector3::new(delta_x, delta_y, delta_z);

        let (scale0, _) = nominal.la;
        let scale = scale0 + delta_scale;
        let delta_v = delta_direction * scale + direction0 * delta_scale;
        let delta_d = Vector3::new(dx, dy, dz);
        let (d, v) = (nominal.d + delta_d, nominal.v + delta_v);
        let zero = T::ZERO;
        Self {
            drive: DriveOf::LINEAR,
            d,
            la: (scale, zero),
            lb: nominal.lb + delta_lb,
            ex: Vector3::new(cos_x, zero, -(x * cos_x / z)),
            ey: Vector3::new(zero, cos_y, -(y * cos_y / z)),
            ez: Vector3::new(x, y, z),
            u: Vector3::zeros(),
            v,
            coefficients: [
                -(dx * T::TWO),
                -(dy * T::TWO),
                -(dz * T::TWO),
                delta_v.dot(&(nominal.v + v)),
                (delta_v.dot(&d) + nominal.v.dot(&delta_d)) * T::TWO,
                zero,
                zero,
                zero,
                -(delta_v.x * T::TWO),
                -(delta_v.y * T::TWO),
                -(delta_v.z * T::TWO),
                delta_d.dot(&(nominal.d + d)) - delta_lb * (T::TWO * nominal.lb + delta_lb),
            ],
        }
    }

    /// Features, in the order of φ in [`NominalArm`](super::NominalArm), times ∂c/∂P.
    pub(super) fn linear_gradient_of(&self, features: &[T; 12]) -> [T; 8] {
        let [x, y, z, squared, travel, _, _, _, xs, ys, zs, one] = *features;
        let two = T::TWO;
        let (scale, _) = self.la;
        let by_d = self.v * travel + self.d * one - Vector3::new(x, y, z);
        let by_v = self.v * squared + self.d * travel - Vector3::new(xs, ys, zs);
        [
            by_d.x * two,
            by_d.y * two,
            by_d.z * two,
            scale * self.ex.dot(&by_v) * two,
            scale * self.ey.dot(&by_v) * two,
            self.ez.dot(&by_v) * two,
            T::ZERO,
            -(self.lb * one * two),
        ]
    }
}
