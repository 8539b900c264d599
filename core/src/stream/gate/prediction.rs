//! The next sample as predicted from an arm's earlier samples and its prior.

use super::prior;
use crate::Real;
use crate::calibration::step_control::LONGEST_STEP;
use crate::calibration::{Normal, Settings, TolerancePrior, workspace_centre};
use crate::robot::{ArmIndex, OF_ARM, Robot};
use crate::samples::{ArmFactor, Displacement, NominalArm, put_row};
use crate::state::state;
use nalgebra::Vector3;

/// The variance of Student's t exists above two degrees of freedom.
const LEAST_FREEDOM: f64 = 3.0;
/// Above this many degrees of freedom, Student's t is treated as normal.
const NORMAL_FREEDOM: f64 = 1000.0;
/// Rounding residue of exact samples, in ε.
const ROUNDING: f64 = 32.0;
/// A linearisation is valid until the number of samples has grown by one part in this many.
const LASTS: u64 = 8;

/// The linearised problem of one arm, updated sample by sample: a square-root information filter (Bierman 1977),
/// relinearised from the factor as the number of samples grows.
///
/// ```text
/// minimise |T δ + b|²,   T = R ∂c/∂P and the prior's rows, reduced
/// y = T⁻ᵀ hᵀ,   innovation = f − y·b,   its variance = 1 + y·y
/// ```
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prediction<T: Real> {
    /// The correction at which it is linearised.
    pub(super) correction: [T; 8],
    at: Displacement<T>,
    normal: Normal<T>,
    /// The part of the squared residuals that no parameters explain.
    beyond: T,
    /// The effective number of samples in it.
    samples: T,
    /// Samples since it was linearised, and their limit.
    since: u64,
    lasts: u64,
}

// Without `at`, which follows from the correction.
state!(
    Prediction<T>:
    correction: [T; 8],
    normal: Normal<T>,
    beyond: T,
    samples: T,
    since: u64,
    lasts: u64,
);

/// A sample as one arm sees it: its row of the Jacobian (3.21) and f, both divided by σf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row<T: Real> {
    entries: [T; 9],
    /// 1/σf, in squared lengths of the nominal arm's unit.
    pub(super) weight: T,
}

/// A sample compared to its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Predicted<T> {
    /// In σf.
    pub(super) innovation: T,
    /// Divided by its own σ.
    pub(super) normalized: T,
}

impl<T: Real> Prediction<T> {
    /// At the nominal arm, without samples.
    pub(super) fn new(robot: &Robot<T>, arm: ArmIndex, settings: &Settings<T>) -> Self {
        let nominal = NominalArm::new(robot.arm(arm), &workspace_centre(robot), settings.noise);
        let correction = [T::ZERO; 8];
        Self {
            correction,
            at: Displacement::new(&nominal, &correction),
            normal: prior(&nominal, settings).rows(T::ONE, &correction),
            beyond: T::ZERO,
            samples: T::ZERO,
            since: 0,
            lasts: 0,
        }
    }

    /// Recomputes derived state after its correction was restored.
    pub(super) fn displace(&mut self, nominal: &NominalArm<T>) {
        self.at = Displacement::new(nominal, &self.correction);
    }

    /// A position and a joint angle as the arm sees them.
    pub(crate) fn row_of(&self, nominal: &NominalArm<T>, (x, q): (&Vector3<T>, T)) -> Row<T> {
        let sample = nominal.prepare(x, q);
        let (derivatives, residual) = self.at.constraint_row(&sample);
        let [a, b, c, d, e, f, g, h] = derivatives.into();
        Row {
            entries: [a, b, c, d, e, f, g, h, residual],
            weight: sample.weight,
        }
    }

    /// The innovation of a sample, and its variance. `None` if the samples so far and the prior do not determine the arm.
    pub(crate) fn innovation(&self, row: &Row<T>) -> Option<(T, T)> {
        let (mut rest, mut spread) = (&mut { row.entries }[..], T::ZERO);
        let mut below = self.normal.entries();
        // A row of constant length at a time: in a program built for size the compiler unrolls no loop.
        macro_rules! substitute {
            ($($length:literal)+) => {$(
                let (first, others) = below.split_first_chunk::<$length>()?;
                below = others;
                let values = rest.first_chunk_mut::<$length>()?;
                let ([pivot, right @ ..], [value, later @ ..]) = (first, values);
                if !(pivot.magnitude() > T::ZERO) {
                    return None;
                }
                let part = *value / *pivot;
                spread += part.squared();
                for (entry, factor) in later.iter_mut().zip(right) {
                    *entry -= part * *factor;
                }
                rest = later;
            )+};
        }
        substitute! { 9 8 7 6 5 4 3 2 }
        let _ = below;
        Some((*rest.first()?, T::ONE + spread))
    }

    /// `None` as of [`innovation`](Self::innovation).
    pub(super) fn predict(&self, row: &Row<T>, noise_stated: bool) -> Option<Predicted<T>> {
        let (innovation, variance) = self.innovation(row)?;
        let normalized = if noise_stated {
            innovation / variance.square_root()
        } else {
            let freedom = self.freedom();
            let scale =
                (self.residual() / freedom).larger((T::from_f64(ROUNDING) * T::EPSILON).squared());
            let squared = normal_equivalent(innovation.squared() / (scale * variance), freedom);
            let size = squared.square_root();
            if innovation < T::ZERO { -size } else { size }
        };
        Some(Predicted {
            innovation,
            normalized,
        })
    }

    /// Whether the residuals suffice to estimate the noise.
    pub(super) fn knows_noise(&self) -> bool {
        self.freedom() >= T::from_f64(LEAST_FREEDOM)
    }

    /// Without a stated noise the parameters take eight degrees of freedom from the residuals.
    fn freedom(&self) -> T {
        self.samples - T::from_count(OF_ARM as u64)
    }

    fn residual(&self) -> T {
        let last = self.normal.row(OF_ARM).first().copied();
        last.map_or(T::ZERO, T::squared) + self.beyond
    }

    /// Takes in one or two rows.
    pub(super) fn take_in(&mut self, rows: [Option<&Row<T>>; 2]) {
        if let [Some(row), None] = rows {
            let mut columns = row.entries.map(|entry| [entry]);
            self.samples += T::ONE;
            self.since += 1;
            T::absorb_nine(self.normal.entries_mut(), &mut columns);
            return;
        }
        let mut columns = [[T::ZERO; 2]; 9];
        for (index, row) in rows.into_iter().flatten().enumerate() {
            put_row(&mut columns, index, 0, &row.entries);
            self.samples += T::ONE;
            self.since += 1;
        }
        T::absorb_two(self.normal.entries_mut(), &mut columns, OF_ARM + 1);
    }

    /// Whether enough samples were added for a new linearisation. The first samples are few enough for each to move the
    /// estimate far.
    pub(super) const fn stale(&self) -> bool {
        self.since > self.lasts
    }

    /// Relinearises at the current estimate from the factor, which holds the same samples.
    pub(super) fn renew(&mut self, factor: &ArmFactor<T>, prior: &TolerancePrior<T, 8>) {
        let step = self.normal.minimiser(&[T::ZERO; 8]);
        if let Some(step) = step {
            let longest = T::from_f64(LONGEST_STEP);
            if step.iter().all(|delta| delta.magnitude() <= longest) {
                self.correction = prior.advanced(&self.correction, &step);
            }
        }
        self.linearize(factor, prior);
    }

    /// Relinearises at the correction.
    pub(super) fn linearize(&mut self, factor: &ArmFactor<T>, prior: &TolerancePrior<T, 8>) {
        self.at = Displacement::new(factor.nominal(), &self.correction);
        self.normal = prior.rows(T::ONE, &self.correction);
        T::linearize_arm(factor, &self.at, &mut self.normal);
        self.beyond = ArmFactor::least_sum_of_squares(factor);
        self.samples = ArmFactor::effective_samples(factor);
        self.since = 0;
        self.lasts = factor.recent() / LASTS;
    }
}

/// z² as improbable for a normal distribution as t² is for Student's t with ν degrees of freedom: z = (8ν + 1)/(8ν + 3)
/// · √(ν ln(1 + t²/ν)) (Wallace 1959). Up to z = 5 it is too small by at most 0.19 for ν = 3 and by 0.02 from ν = 12
/// on.
fn normal_equivalent<T: Real>(t_squared: T, freedom: T) -> T {
    if freedom > T::from_f64(NORMAL_FREEDOM) {
        return t_squared;
    }
    let eight = T::from_f64(8.0) * freedom;
    let ratio = (eight + T::ONE) / (eight + T::from_f64(3.0));
    freedom * (T::ONE + t_squared / freedom).natural_logarithm() * ratio.squared()
}

#[cfg(test)]
mod tests {
    use super::normal_equivalent;

    /// Tables of Student's t: two-sided values as improbable as 1.960, 2.576 and 3.291 for a normal distribution.
    #[test]
    fn students_t_is_told_as_a_normal_number() {
        for (freedom, quantiles) in [
            (3.0_f64, [3.182, 5.841, 12.924]),
            (5.0, [2.571, 4.032, 6.869]),
            (10.0, [2.228, 3.169, 4.587]),
            (30.0, [2.042, 2.750, 3.646]),
            (120.0, [1.980, 2.617, 3.373]),
            (1e5, [1.960, 2.576, 3.291]),
        ] {
            for (t, normal) in quantiles.into_iter().zip([1.960, 2.576, 3.291]) {
                let found = libm::sqrt(normal_equivalent(t * t, freedom));
                // The error of Wallace's formula in the tails, at most 0.07 for ν = 3 in this range.
                let allowed = 0.24 / freedom + 0.003;
                assert!((found - normal).abs() < allowed, "{freedom} {t} {found}");
            }
        }
    }
}
