use super::noise::Noise;
use super::sample::{SampleError, check_joint, check_position};
use crate::Real;
use crate::robot::{Arm, ArmIndex, Parameter, ParameterKind};
use nalgebra::Vector3;

/// Number of columns of a sample's row: twelve features and the constraint at the nominal arm.
pub(crate) const COLUMNS: usize = 13;

/// Squares of squares of such distances, times the largest weight, stay finite in single precision.
const FARTHEST_SQUARED: f64 = 1e8;

/// What an arm's samples are expressed against: the arm before calibration, a centre and a unit of
/// length near those of the workspace, and the noise that weights the samples.
///
/// The constraint is linear in features of one sample (Model 24 expanded):
///
/// ```text
/// φ(X, q) = ( x, y, z, cos q, sin q, X cos q, X sin q, 1 )                          12 numbers
/// c(P)    = ( −2D, 2u·D, 2v·D, −2u, −2v, |D|² + |u|² − Lb² )
/// f(P)    = |X|² + φᵀ c(P) = f(P₀) + φᵀ ( c(P) − c(P₀) )
/// ```
///
/// Against the nominal arm P₀ the large terms cancel before they are rounded: the row holds φ and
/// f(P₀), which is of the size of the robot's error, and the unknown is the small difference
/// c(P) − c(P₀). That is what single precision needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalArm<T: Real> {
    arm: Arm<T>,
    noise: Option<Noise<T>>,
    centre: Vector3<T>,
    scale: T,
    inverse_scale: T,
    /// D, u, v, Lb in units of the scale, D from the centre.
    pub(crate) d: Vector3<T>,
    pub(crate) u: Vector3<T>,
    pub(crate) v: Vector3<T>,
    pub(crate) la: (T, T),
    pub(crate) lb: T,
}

/// One sample of one arm, centred and scaled, with the sine and cosine of its joint angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ArmSample<T: Real> {
    pub(crate) x: Vector3<T>,
    pub(crate) sine: T,
    pub(crate) cosine: T,
    /// 1/σf, or 1/(2Lb) without a stated noise. Units of the scale, to the power −2 or −1.
    pub(crate) weight: T,
    /// f(P₀) in units of the scale squared, not weighted.
    pub(crate) constraint: T,
}

impl<T: Real> NominalArm<T> {
    /// Samples of `arm` measured about `centre`, a point within the workspace (length).
    ///
    /// The unit is the largest power of two not above Lb, and the centre is rounded to sixteenths
    /// of it, so that neither rounds a sample.
    #[inline(never)]
    pub fn new(arm: &Arm<T>, centre: &Vector3<T>, noise: Option<Noise<T>>) -> Self {
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
            v: arm.basis().v * inverse_scale,
            la: (la_x * inverse_scale, la_y * inverse_scale),
            lb: arm.lb() * inverse_scale,
        }
    }

    /// The arm before calibration.
    pub const fn arm(&self) -> &Arm<T> {
        &self.arm
    }

    /// The stated noise, if any.
    pub const fn noise(&self) -> Option<&Noise<T>> {
        self.noise.as_ref()
    }

    /// The unit in which lengths are held.
    pub const fn scale(&self) -> T {
        self.scale
    }

    /// The point from which positions are counted.
    pub const fn centre(&self) -> &Vector3<T> {
        &self.centre
    }

    /// Centres, scales and weights one sample. The residual's variance is, to first order,
    /// σf² = |∂f/∂X|² σx² + (∂f/∂q)² σq² (Sampson), with |∂f/∂X| = 2 Lb. Rounding is a noise too, of
    /// half an ε of the position and of about 4ε in f, and is added: no stated noise, however
    /// small, claims more than the scalar type can hold.
    pub(crate) fn prepare(&self, x: &Vector3<T>, q: T) -> ArmSample<T> {
        let (sine, cosine) = q.sine_cosine();
        let position_rounding_squared =
            x.dot(x) * (T::HALF * T::EPSILON * self.inverse_scale).squared();
        let x = (x - self.centre) * self.inverse_scale;
        let forearm = x - (self.d + self.u * cosine + self.v * sine);
        let constraint = forearm.dot(&forearm) - self.lb * self.lb;
        let weight = match &self.noise {
            None => T::HALF / self.lb,
            Some(noise) => {
                let by_position_squared = (T::TWO * self.lb).squared()
                    * ((noise.position() * self.inverse_scale).squared()
                        + position_rounding_squared);
                let by_joint =
                    T::TWO * forearm.dot(&(self.v * cosine - self.u * sine)) * noise.joint();
                let rounding = T::from_f64(4.0) * T::EPSILON * self.lb * self.lb;
                (by_position_squared + by_joint.squared() + rounding.squared())
                    .inverse_square_root()
            }
        };
        ArmSample {
            x,
            sine,
            cosine,
            weight,
            constraint,
        }
    }

    /// Whether a position can be squared and summed up with others: it must be finite, and no more
    /// than 10,000 forearms away from the centre.
    pub(crate) fn check(&self, x: &Vector3<T>, arm: ArmIndex) -> Result<(), SampleError> {
        check_position(x)?;
        let x = (x - self.centre) * self.inverse_scale;
        if x.dot(&x) <= T::from_f64(FARTHEST_SQUARED) {
            Ok(())
        } else {
            Err(SampleError::PositionTooFar(arm))
        }
    }

    /// Checks, centres, scales and weights one sample.
    pub(crate) fn sample(
        &self,
        x: &Vector3<T>,
        q: T,
        arm: ArmIndex,
    ) -> Result<ArmSample<T>, SampleError> {
        check_joint(q, arm)?;
        self.check(x, arm)?;
        Ok(self.prepare(x, q))
    }

    /// The correction, in units of the scale and radians, that takes the nominal arm to `arm`.
    pub(crate) fn correction_to(&self, arm: &Arm<T>) -> [T; 8] {
        let mut difference = arm.parameters();
        for (value, nominal) in difference.iter_mut().zip(self.arm.parameters()) {
            *value -= nominal;
        }
        self.in_internal_units(difference)
    }

    /// User units to internal: lengths divided by the scale.
    pub(crate) fn in_internal_units(&self, mut values: [T; 8]) -> [T; 8] {
        for (value, parameter) in values.iter_mut().zip(Parameter::ALL) {
            if parameter.kind() == ParameterKind::Length {
                *value *= self.inverse_scale;
            }
        }
        values
    }

    /// Internal units to the user's: the factor of each parameter.
    pub(crate) fn unit_of(&self, parameter: Parameter) -> T {
        match parameter.kind() {
            ParameterKind::Length => self.scale,
            ParameterKind::Angle => T::ONE,
        }
    }
}

impl<T: Real> ArmSample<T> {
    /// A place that holds no sample.
    pub(crate) const fn vacant() -> Self {
        Self {
            x: Vector3::new(T::ZERO, T::ZERO, T::ZERO),
            sine: T::ZERO,
            cosine: T::ONE,
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
