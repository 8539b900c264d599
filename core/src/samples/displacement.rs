use super::nominal_arm::{ArmSample, NominalArm};
use crate::Real;
use crate::kinematics::constraint_gradient;
use crate::robot::{Arm, Drive, DriveOf, GeometryError};
use nalgebra::{SVector, Vector3};

/// The nominal arm displaced by a correction δP, and the exact difference c(P₀ + δP) − c(P₀).
///
/// The difference is computed from δP by addition theorems rather than by subtracting two large numbers, so its
/// rounding is relative to the correction and not to the robot.
#[derive(Debug, Clone, PartialEq)]
#[allow(unreachable_pub)] // part of a sealed trait; nameable by no other crate
pub struct Displacement<T: Real> {
    pub(super) drive: DriveOf,
    /// P₀ + δP in internal units.
    pub(crate) d: Vector3<T>,
    pub(crate) la: (T, T),
    pub(crate) lb: T,
    pub(crate) ex: Vector3<T>,
    pub(crate) ey: Vector3<T>,
    pub(crate) ez: Vector3<T>,
    pub(crate) u: Vector3<T>,
    pub(crate) v: Vector3<T>,
    /// c(P₀ + δP) − c(P₀), twelve numbers.
    pub(crate) coefficients: [T; 12],
}

impl<T: Real> Displacement<T> {
    #[inline]
    pub(crate) fn new(nominal: &NominalArm<T>, correction: &[T; 8]) -> Self {
        T::displaced(nominal, correction)
    }

    pub(crate) fn exactly(nominal: &NominalArm<T>, correction: &[T; 8]) -> Self {
        #[cfg(feature = "linear")]
        if nominal.arm().drive() == Drive::Linear {
            return Self::of_linear_drive(nominal, correction);
        }
        let [dx, dy, dz, theta, alpha, delta_la_x, delta_la_y, delta_lb] = *correction;
        let basis = nominal.arm().basis();
        let (ex0, ez0) = (basis.ex, basis.ez);
        let (sin_alpha0, cos_alpha0) = (basis.ey.z, basis.ez.z);
        let tangent0 = Vector3::new(-ex0.y, ex0.x, T::ZERO);

        let (sin_theta, versine_theta) = small_turn(theta);
        let (sin_alpha, versine_alpha) = small_turn(alpha);

        let delta_ex = tangent0 * sin_theta - ex0 * versine_theta;
        let delta_tangent = -(ex0 * sin_theta + tangent0 * versine_theta);
        let delta_sin_alpha = cos_alpha0 * sin_alpha - sin_alpha0 * versine_alpha;
        let delta_cos_alpha = -(sin_alpha0 * sin_alpha + cos_alpha0 * versine_alpha);
        let new_sin_alpha = sin_alpha0 + delta_sin_alpha;
        let mut delta_ez = -(delta_tangent * new_sin_alpha + tangent0 * delta_sin_alpha);
        delta_ez.z = delta_cos_alpha;

        let (ex, ez) = (ex0 + delta_ex, ez0 + delta_ez);
        let (la_x0, la_y0) = nominal.la;
        let (la_x, la_y) = (la_x0 + delta_la_x, la_y0 + delta_la_y);
        let delta_u = delta_ex * la_x0 + ex * delta_la_x + delta_ez * la_y0 + ez * delta_la_y;
        let delta_v = delta_ex * la_y0 + ex * delta_la_y - delta_ez * la_x0 - ez * delta_la_x;
        let delta_d = Vector3::new(dx, dy, dz);

        let d = nominal.d + delta_d;
        let (u, v) = (nominal.u + delta_u, nominal.v + delta_v);
        let delta_ud = delta_u.dot(&d) + nominal.u.dot(&delta_d);
        let delta_vd = delta_v.dot(&d) + nominal.v.dot(&delta_d);
        let delta_constant = delta_d.dot(&(nominal.d + d))
            + delta_la_x * (la_x0 + la_x)
            + delta_la_y * (la_y0 + la_y)
            - delta_lb * (T::TWO * nominal.lb + delta_lb);

        Self {
            drive: DriveOf::ROTARY,
            d,
            la: (la_x, la_y),
            lb: nominal.lb + delta_lb,
            ex,
            ey: ez.cross(&ex),
            ez,
            u,
            v,
            coefficients: [
                -(dx * T::TWO),
                -(dy * T::TWO),
                -(dz * T::TWO),
                delta_ud * T::TWO,
                delta_vd * T::TWO,
                -(delta_u.x * T::TWO),
                -(delta_u.y * T::TWO),
                -(delta_u.z * T::TWO),
                -(delta_v.x * T::TWO),
                -(delta_v.y * T::TWO),
                -(delta_v.z * T::TWO),
                delta_constant,
            ],
        }
    }

    fn forearm(&self, sample: &ArmSample<T>) -> Vector3<T> {
        sample.x - (self.d + self.u * sample.cosine + self.v * sample.sine)
    }

    /// f/σf of one sample, directly from the constraint (3.8).
    pub(crate) fn weighted_constraint(&self, sample: &ArmSample<T>) -> T {
        let forearm = self.forearm(sample);
        (forearm.dot(&forearm) - self.lb * self.lb) * sample.weight
    }

    /// One row of the Jacobian (3.21) and f, both divided by σf.
    pub(crate) fn constraint_row(&self, sample: &ArmSample<T>) -> (SVector<T, 8>, T) {
        let gradient = constraint_gradient(
            self.drive.get(),
            [&self.ex, &self.ey, &self.ez],
            self.la,
            self.lb,
            &self.forearm(sample),
            (sample.sine, sample.cosine),
        );
        (gradient * sample.weight, self.weighted_constraint(sample))
    }

    /// Features, in the order of φ in [`NominalArm`], times ∂c/∂P:
    ///
    /// ```text
    /// ∂(φᵀc)/∂D = 2 (φc u + φs v + φ₁ D − φx)    ∂(φᵀc)/∂u = 2 (φc D − φxc)    ∂(φᵀc)/∂v = 2 (φs D − φxs)
    /// ```
    ///
    /// u and v rotate with θ and α and scale with the upper arm; |u|² depends only on the upper arm's length. With a
    /// linear drive the same, but ∂(φᵀc)/∂v = 2 (φc v + φs D − φxs).
    #[inline(never)] // with `nearest_turn` 0.8 kB of joint flash built for size
    pub(crate) fn gradient_of(&self, features: &[T; 12]) -> [T; 8] {
        let [x, y, z, cosine, sine, xc, yc, zc, xs, ys, zs, one] = *features;
        let two = T::TWO;
        if self.drive.get() == Drive::Linear {
            return self.linear_gradient_of(features);
        }
        let (la_x, la_y) = self.la;
        let sin_alpha = self.ey.z;
        let by_d = self.u * cosine + self.v * sine + self.d * one - Vector3::new(x, y, z);
        let by_u = self.d * cosine - Vector3::new(xc, yc, zc);
        let by_v = self.d * sine - Vector3::new(xs, ys, zs);
        let along_tangent = |by: &Vector3<T>| self.ex.x * by.y - self.ex.y * by.x;
        let (u_x, v_x) = (self.ex.dot(&by_u), self.ex.dot(&by_v));
        let (u_z, v_z) = (self.ez.dot(&by_u), self.ez.dot(&by_v));
        let theta = la_x * (along_tangent(&by_u) - sin_alpha * v_x)
            + la_y * (along_tangent(&by_v) + sin_alpha * u_x);
        let alpha = la_x * self.ey.dot(&by_v) - la_y * self.ey.dot(&by_u);
        [
            by_d.x * two,
            by_d.y * two,
            by_d.z * two,
            theta * two,
            alpha * two,
            (u_x - v_z + la_x * one) * two,
            (u_z + v_x + la_y * one) * two,
            -(self.lb * one * two),
        ]
    }
}

/// sin δ and 1 − cos δ = 2 sin²(δ/2), without cancellation for small δ.
pub(crate) fn small_turn<T: Real>(angle: T) -> (T, T) {
    let (sine, _) = angle.sine_cosine();
    let (half_sine, _) = (angle * T::HALF).sine_cosine();
    (sine, T::TWO * half_sine * half_sine)
}

/// The same direction, within half a turn.
#[inline(never)] // see `gradient_of`
pub(crate) fn nearest_turn<T: Real>(angle: T) -> T {
    let turn = T::TWO * T::PI;
    angle - (angle / turn).nearest_integer() * turn
}

/// The calibrated arm: nominal arm plus correction, in the caller's unit.
///
/// Lb enters the constraint squared, so a negative root means the same forearm. An azimuth beyond ±360° is equivalent
/// to one within.
pub(crate) fn corrected_arm<T: Real>(
    nominal: &NominalArm<T>,
    correction: &[T; 8],
) -> Result<Arm<T>, GeometryError> {
    let mut displacement = *correction;
    for (delta, unit) in displacement.iter_mut().zip(nominal.units()) {
        *delta *= unit;
    }
    moved_arm(nominal.arm(), &displacement)
}

/// The arm whose parameters differ by a displacement, in the caller's unit.
pub(crate) fn moved_arm<T: Real>(
    arm: &Arm<T>,
    displacement: &[T; 8],
) -> Result<Arm<T>, GeometryError> {
    let mut parameters = arm.parameters();
    for (value, delta) in parameters.iter_mut().zip(displacement) {
        *value += *delta;
    }
    let [_, _, _, theta, .., lb] = &mut parameters;
    *lb = lb.magnitude();
    if arm.drive() == Drive::Rotary && theta.magnitude() > T::TWO * T::PI {
        *theta = nearest_turn(*theta);
    }
    arm.with_parameters(parameters)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const CENTRE: Vector3<f64> = Vector3::new(10.0, -20.0, -430.0);
    const CORRECTION: [f64; 8] = [0.02, -0.01, 0.03, 0.05, -0.04, 0.01, 0.0, -0.03];

    /// An arm of each drive.
    fn nominals() -> impl Iterator<Item = NominalArm<f64>> {
        let rotary = Arm::new([150.0, 30.0, -5.0, 0.7, 0.2, 240.0, 35.0, 470.0]).unwrap();
        let arms = [
            Some(rotary),
            #[cfg(feature = "linear")]
            Arm::linear([120.0, 70.0, -5.0, 0.1, -0.2, 1.1, 330.0]).ok(),
        ];
        let nominal = |arm| NominalArm::new(&arm, &CENTRE, None);
        arms.into_iter().flatten().map(nominal)
    }

    /// The places at which an arm has a parameter.
    fn places(nominal: &NominalArm<f64>) -> impl Iterator<Item = usize> {
        let places = nominal.arm().drive().places().into_iter().enumerate();
        places.filter_map(|(place, parameter)| parameter.map(|_| place))
    }

    /// c(P) by definition, from the arm's own vectors.
    fn coefficients(nominal: &NominalArm<f64>, correction: &[f64; 8]) -> [f64; 12] {
        let arm = corrected_arm(nominal, correction).unwrap();
        let scale = nominal.scale();
        let d = (arm.d() - nominal.centre()) / scale;
        let lb = arm.lb() / scale;
        let (u, v, by_cosine, upper_arm) = match arm.drive() {
            Drive::Rotary => {
                let (u, v) = (arm.basis().u / scale, arm.basis().v / scale);
                (u, v, 2.0 * u.dot(&d), u.dot(&u))
            }
            Drive::Linear => {
                let v = arm.basis().v;
                (Vector3::zeros(), v, v.dot(&v), 0.0)
            }
        };
        let [[x, y, z], [ux, uy, uz], [vx, vy, vz]] = [d, u, v].map(|own| (own * -2.0).into());
        let constant = d.dot(&d) + upper_arm - lb * lb;
        let by_sine = 2.0 * v.dot(&d);
        [
            x, y, z, by_cosine, by_sine, ux, uy, uz, vx, vy, vz, constant,
        ]
    }

    #[test]
    fn coefficients_are_the_difference_of_their_definition() {
        for nominal in nominals() {
            let at = Displacement::new(&nominal, &CORRECTION);
            let before = coefficients(&nominal, &[0.0; 8]);
            let after = coefficients(&nominal, &CORRECTION);
            for ((found, before), after) in at.coefficients.iter().zip(before).zip(after) {
                // Numbers of about 1, subtracted: a few ε.
                assert!((found - (after - before)).abs() < 1e-14);
            }
        }
    }

    /// The product with arbitrary features, and the row of a single weighted sample.
    #[test]
    fn derivatives_equal_central_differences() {
        let mut angle = 0.0;
        let features = [(); 12].map(|()| {
            angle += 1.7;
            libm::sin(angle)
        });
        let step = 1e-6;
        for nominal in nominals() {
            let at = Displacement::new(&nominal, &CORRECTION);
            let gradient = at.gradient_of(&features);
            let mut sample = nominal.prepare(&Vector3::new(30.0, -50.0, -380.0), 0.3);
            sample.weight = 0.7;
            let (constraints, _) = at.constraint_row(&sample);
            for parameter in places(&nominal) {
                let [above, below] = [step, -step].map(|by| {
                    let mut correction = CORRECTION;
                    correction[parameter] += by;
                    Displacement::new(&nominal, &correction)
                });
                let mut product = 0.0;
                let slopes = above.coefficients.iter().zip(below.coefficients);
                for (feature, (above, below)) in features.iter().zip(slopes) {
                    product += feature * (above - below) / (2.0 * step);
                }
                // Twelve times step² · c‴/6 + ε/step ≈ 1e-10.
                assert!((gradient[parameter] - product).abs() < 1e-8);
                let [above, below] = [above, below].map(|own| own.weighted_constraint(&sample));
                let slope = (above - below) / (2.0 * step);
                assert!((constraints[parameter] - slope).abs() < 1e-8);
            }
        }
    }

    /// The reason for the addition theorems: in single precision, a correction of a micrometre keeps its relative
    /// accuracy although it is the last digit of the numbers it corrects.
    #[test]
    fn small_corrections_keep_their_digits_in_single_precision() {
        let rounded = nominals().next().unwrap().arm().cast::<f32>().unwrap();
        let single = NominalArm::new(&rounded, &Vector3::new(10.0, -20.0, -430.0), None);
        let double = NominalArm::new(&rounded.cast::<f64>().unwrap(), &CENTRE, None);
        let correction = CORRECTION.map(|value| value * 1e-6);
        let expected = Displacement::new(&double, &correction).coefficients;
        let found = Displacement::new(&single, &correction.map(<f32 as crate::Real>::from_f64))
            .coefficients;
        for (found, expected) in found.iter().zip(expected) {
            // About ten roundings of 6e-8 each, of terms as large as 1e-7.
            assert!((f64::from(*found) - expected).abs() < 1e-13);
        }
    }
}
