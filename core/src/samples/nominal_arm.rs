use super::sample::{Noise, Sample, SampleError};
use crate::Real;
use crate::robot::{Arm, ArmIndex, Drive, ParameterKind, Transmission};
use crate::snapshot::Fingerprint;
use crate::state::state;
use nalgebra::Vector3;

/// Features of a sample, the last of which is 1, and columns of its row: these and the constraint at the nominal arm.
pub(crate) const FEATURES: usize = 12;
pub(crate) const ONE: usize = FEATURES - 1;
pub(crate) const COLUMNS: usize = FEATURES + 1;

/// Fourth powers of such distances, times the largest weight, stay finite in single precision.
pub(crate) const FARTHEST_SQUARED: f64 = 1e8;

/// Assumed error of the nominal forearm's direction, in radians: near a singularity, where the three forearms are
/// coplanar, it bounds the variance of a closure from below.
const DIRECTION: f64 = 0.01;

/// The reference for an arm's samples: the uncalibrated arm, a centre and a unit of length similar to those of the
/// workspace, and the noise that weights the samples.
///
/// The constraint is linear in features of one sample (Model 24 expanded):
///
/// ```text
/// φ(X, q) = ( x, y, z, cos q, sin q, X cos q, X sin q, 1 )                          12 numbers
/// c(P)    = ( −2D, 2u·D, 2v·D, −2u, −2v, |D|² + |u|² − Lb² )
/// f(P)    = |X|² + φᵀ c(P) = f(P₀) + φᵀ ( c(P) − c(P₀) )
/// ```
///
/// Relative to the nominal arm P₀, large terms cancel before they are rounded: the row holds φ and f(P₀), which is of
/// the size of the robot's error, and the unknown is the small difference c(P) − c(P₀). Single precision requires this.
///
/// A linear drive's constraint is linear in the same features with s² and s in place of cos q and sin q, and zero
/// coefficients for X s²:
///
/// ```text
/// c(P)    = ( −2D, |v|², 2v·D, 0, −2v, |D|² − Lb² )
/// ```
#[derive(Debug, Clone, PartialEq)]
#[allow(unreachable_pub)] // part of a sealed trait; nameable by no other crate
pub struct NominalArm<T: Real> {
    arm: Arm<T>,
    noise: Option<Noise<T>>,
    centre: Vector3<T>,
    scale: T,
    inverse_scale: T,
    /// D, u, v, Lb in units of the scale, D relative to the centre. A linear drive's v and scale are dimensionless.
    pub(crate) d: Vector3<T>,
    pub(crate) u: Vector3<T>,
    pub(crate) v: Vector3<T>,
    pub(crate) la: (T, T),
    pub(crate) lb: T,
}

/// One sample of one arm, centred and scaled, with the sine and cosine of its joint angle, or the travel of a linear
/// drive and its square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ArmSample<T: Real> {
    pub(crate) x: Vector3<T>,
    pub(crate) sine: T,
    pub(crate) cosine: T,
    /// 1/σf, or 1/(2Lb) without a stated noise. Units of the scale, to the power −2 or −1.
    pub(crate) weight: T,
    /// f(P₀) in units of the scale squared, unweighted.
    pub(crate) constraint: T,
}

state!(ArmSample<T>: x: Vector3<T>, sine: T, cosine: T, weight: T, constraint: T);

/// One arm's closure f at the nominal arm, and the components of its error.
pub(super) struct Closure<T: Real> {
    pub(super) sample: ArmSample<T>,
    /// ∂f/∂X times the σ of the position, by axis: the part that the arms share.
    by_position: Vector3<T>,
    /// The variance of the part that they do not share.
    pub(super) own: T,
}

impl<T: Real> Closure<T> {
    pub(super) fn variance(&self) -> T {
        self.by_position.dot(&self.by_position) + self.own
    }

    pub(super) fn covariance(&self, other: &Self) -> T {
        self.by_position.dot(&other.by_position)
    }
}

impl<T: Real> NominalArm<T> {
    /// The reference for samples of `arm` measured about `centre`, a point within the workspace (length).
    ///
    /// The unit is the largest power of two not above Lb, and the centre is rounded to sixteenths of it, so that
    /// neither rounds a sample.
    #[inline(never)] // 1.2 kB of flash
    pub(crate) fn new(arm: &Arm<T>, centre: &Vector3<T>, noise: Option<Noise<T>>) -> Self {
        let scale = arm.lb().power_of_two_below();
        let inverse_scale = T::ONE / scale;
        let sixteenth = T::from_f64(16.0);
        let centre =
            centre.map(|c| (c * inverse_scale * sixteenth).nearest_integer() / sixteenth * scale);
        let (la_x, la_y) = arm.la();
        Self {
            arm: *arm,
            noise,
            centre,
            scale,
            inverse_scale,
            d: (arm.d() - centre) * inverse_scale,
            u: arm.basis().u * inverse_scale,
            v: match arm.drive() {
                Drive::Rotary => arm.basis().v * inverse_scale,
                Drive::Linear => arm.basis().v,
            },
            la: match arm.drive() {
                Drive::Rotary => (la_x * inverse_scale, la_y * inverse_scale),
                Drive::Linear => (la_x, la_y),
            },
            lb: arm.lb() * inverse_scale,
        }
    }

    /// Everything that distinguishes it from others.
    pub(crate) fn mark(&self, fingerprint: &mut Fingerprint) {
        fingerprint.byte(match self.arm.drive() {
            Drive::Rotary => 0,
            Drive::Linear => 1,
        });
        let centre = self.centre.iter().copied();
        for value in self.arm.parameters().into_iter().chain(centre) {
            fingerprint.number(value);
        }
        for value in self
            .arm
            .transmission()
            .into_iter()
            .flat_map(Transmission::numbers)
        {
            fingerprint.number(value);
        }
    }

    /// The uncalibrated arm.
    pub(crate) const fn arm(&self) -> &Arm<T> {
        &self.arm
    }

    /// The stated noise, if any.
    pub(crate) const fn noise(&self) -> Option<&Noise<T>> {
        self.noise.as_ref()
    }

    /// The internal unit of length.
    pub(crate) const fn scale(&self) -> T {
        self.scale
    }

    /// 1/[`scale`](Self::scale).
    pub(crate) const fn inverse_scale(&self) -> T {
        self.inverse_scale
    }

    /// The origin of internal positions.
    pub(crate) const fn centre(&self) -> &Vector3<T> {
        &self.centre
    }

    /// Centres, scales and weights one sample. To first order, the residual's variance is σf² = |∂f/∂X|² σx² + (∂f/∂q)²
    /// σq² (Sampson), with |∂f/∂X| = 2 Lb. Rounding adds noise of half an ε of the position and about 4ε in f, so that
    /// no stated noise, however small, claims more than the scalar type can hold.
    // Otherwise called, not inlined, in a firmware without a gate, too: 400 bytes more.
    #[inline(always)]
    pub(crate) fn prepare(&self, x: &Vector3<T>, q: T) -> ArmSample<T> {
        let (mut sample, forearm) = self.place(x, q);
        sample.weight = match &self.noise {
            None => T::HALF / self.lb,
            Some(noise) => {
                let two_lb_squared = (T::TWO * self.lb).squared();
                let rounding = self.position_rounding_squared(x);
                let by_position_squared = if let Some(position) = noise.isotropic() {
                    two_lb_squared * ((position * self.inverse_scale).squared() + rounding)
                } else {
                    let by_axis = self.by_position(&forearm, &noise.position_by_axis());
                    by_axis.dot(&by_axis) + two_lb_squared * rounding
                };
                let by_joint = self.by_joint(&sample, &forearm) * noise.joint();
                (by_position_squared + by_joint.squared() + self.constraint_rounding_squared())
                    .inverse_square_root()
            }
        };
        sample
    }

    /// Centres and scales one sample with weight 1; also returns X − B.
    fn place(&self, x: &Vector3<T>, q: T) -> (ArmSample<T>, Vector3<T>) {
        let (sine, cosine) = match self.arm.drive() {
            Drive::Rotary => self.arm.arm_angle(q).sine_cosine(),
            Drive::Linear => {
                let travel = q * self.inverse_scale;
                (travel, travel * travel)
            }
        };
        let x = (x - self.centre) * self.inverse_scale;
        let forearm = x - (self.d + self.u * cosine + self.v * sine);
        let sample = ArmSample {
            x,
            sine,
            cosine,
            weight: T::ONE,
            constraint: forearm.dot(&forearm) - self.lb * self.lb,
        };
        (sample, forearm)
    }

    /// ∂f/∂X times σ, by axis.
    fn by_position(&self, forearm: &Vector3<T>, sigma: &[T; 3]) -> Vector3<T> {
        forearm.component_mul(&(Vector3::from(*sigma) * self.inverse_scale)) * T::TWO
    }

    /// −∂f/∂q.
    fn by_joint(&self, sample: &ArmSample<T>, forearm: &Vector3<T>) -> T {
        if self.arm.drive() == Drive::Linear {
            return T::TWO * forearm.dot(&self.v) * self.inverse_scale;
        }
        T::TWO * forearm.dot(&(self.v * sample.cosine - self.u * sample.sine))
    }

    fn position_rounding_squared(&self, x: &Vector3<T>) -> T {
        x.dot(x) * (T::HALF * T::EPSILON * self.inverse_scale).squared()
    }

    fn constraint_rounding_squared(&self) -> T {
        (T::from_f64(4.0) * T::EPSILON * self.lb * self.lb).squared()
    }

    /// Centres and scales one sample, and computes the components of the closure's error at the nominal arm. Without a
    /// stated noise, every coordinate of the position has σ = `unit`.
    pub(super) fn closure(&self, x: &Vector3<T>, q: T, unit: T) -> Closure<T> {
        let (sample, forearm) = self.place(x, q);
        let (position, joint) = match &self.noise {
            None => ([unit; 3], T::ZERO),
            Some(noise) => (noise.position_by_axis(), noise.joint()),
        };
        let sigma = Vector3::from(position) * self.inverse_scale;
        let of_directions = sigma.dot(&sigma) * T::from_f64(DIRECTION * DIRECTION / 3.0);
        let by_joint = self.by_joint(&sample, &forearm) * joint;
        Closure {
            by_position: self.by_position(&forearm, &position),
            own: (T::TWO * self.lb).squared() * (of_directions + self.position_rounding_squared(x))
                + by_joint.squared()
                + self.constraint_rounding_squared(),
            sample,
        }
    }

    /// Checks that every number of a sample is usable by a robot of these arms, and none too far away.
    pub(crate) fn check_sample(of: [&Self; 3], sample: &Sample<T>) -> Result<(), SampleError> {
        let [first, ..] = of;
        sample.check(first.arm.drive())?;
        let joints = sample.joints.iter().zip(&ArmIndex::ALL);
        for (nominal, (q, arm)) in of.iter().zip(joints) {
            nominal.check(&sample.position, *q, *arm)?;
        }
        Ok(())
    }

    /// Checks that a sample whose numbers are usable can be squared and summed: the position must be within 10,000
    /// forearm lengths of the centre, and so must a travel of 0.
    pub(crate) fn check(&self, x: &Vector3<T>, q: T, arm: ArmIndex) -> Result<(), SampleError> {
        let farthest = T::from_f64(FARTHEST_SQUARED);
        let x = (x - self.centre) * self.inverse_scale;
        if !(x.dot(&x) <= farthest) {
            return Err(SampleError::PositionTooFar(arm));
        }
        let travels = self.arm.drive() == Drive::Linear;
        if travels && !((q * self.inverse_scale).squared() <= farthest) {
            return Err(SampleError::JointTooLarge(arm));
        }
        Ok(())
    }

    /// The correction, in units of the scale and radians, from the nominal arm to `arm`.
    pub(crate) fn correction_to(&self, arm: &Arm<T>) -> [T; 8] {
        let mut difference = arm.parameters();
        let places = self.arm.drive().places().into_iter();
        let nominal = self.arm.parameters().into_iter().zip(places);
        for (value, (nominal, parameter)) in difference.iter_mut().zip(nominal) {
            *value -= nominal;
            if parameter.is_some_and(|parameter| parameter.kind() == ParameterKind::Length) {
                *value *= self.inverse_scale;
            }
        }
        difference
    }

    /// The factor from internal units to the caller's at each place; 0 at an empty one.
    pub(crate) fn units(&self) -> [T; 8] {
        let (length, other) = (self.scale, T::ONE);
        match self.arm.drive() {
            Drive::Rotary => [length, length, length, other, other, length, length, length],
            Drive::Linear => [length, length, length, other, other, other, T::ZERO, length],
        }
    }
}

impl<T: Real> ArmSample<T> {
    /// A placeholder.
    #[inline(always)]
    pub(crate) const fn vacant() -> Self {
        Self {
            x: Vector3::new(T::ZERO, T::ZERO, T::ZERO),
            sine: T::ZERO,
            cosine: T::ZERO,
            weight: T::ZERO,
            constraint: T::ZERO,
        }
    }

    /// The weighted row (φ, f(P₀)).
    pub(crate) fn row(&self) -> [T; COLUMNS] {
        let x = self.x * self.weight;
        let (xc, xs) = (x * self.cosine, x * self.sine);
        [
            x.x,
            x.y,
            x.z,
            self.cosine * self.weight,
            self.sine * self.weight,
            xc.x,
            xc.y,
            xc.z,
            xs.x,
            xs.y,
            xs.z,
            self.weight,
            self.constraint * self.weight,
        ]
    }
}
