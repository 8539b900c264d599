//! The probability that a calibration makes a robot worse because its parameters are noisy.
//!
//! docs/method.md derives it. The calibrated parameters differ by u = δ + ε from those before: δ is the robot's true
//! difference, ε ~ N(0, C). With M the mean of JᵀJ over the workspace, the mean squared position error falls by
//! 2 uᵀM δ − uᵀM u. The samples' own estimates d along the eigenvectors of C reveal the size τ of δ:
//!
//! ```text
//! dᵢ ~ N(0, τ² + λᵢ),   δᵢ | dᵢ ~ N(τ² dᵢ/(τ² + λᵢ), τ² λᵢ/(τ² + λᵢ))
//! ```
//!
//! Without a tolerance, d = u and λ are the eigenvalues of C. A tolerance with covariance P has drawn u towards the
//! robot before calibration: with c the eigenvalues of C in tolerances, d = u/(1 − c) and λ = c/(1 − c), because C⁻¹ =
//! A + P⁻¹ with A the samples' information.

use super::information::{differences, prior_covariance, units};
use super::quantiles::noise_levels;
use super::uncertainty::Sensitivities;
use crate::files::Tool;
use crate::fit::Solution;
use crate::order::sort_by;
use delta_cal::robot::Arm;
use delta_cal::{Robot, Sample, Tolerance};
use nalgebra::{DMatrix, DVector, SMatrix};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// Number of values of τ tried, from the largest change or `LARGEST_TOLERANCE` tolerances to `SMALLEST` of that.
const SIZES: u32 = 49;
const SMALLEST: f64 = 1e-4;
const LARGEST_TOLERANCE: f64 = 2.0;
/// Smallest 1 − c, for combinations that the samples do not determine.
const UNDETERMINED: f64 = 1e-9;
/// Quantiles of an estimated noise: the midpoints of equally probable intervals.
const NOISE_LEVELS: u32 = 5;

/// A change of the parameters, all in mm, and its uncertainty.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// u.
    pub(crate) difference: DVector<f64>,
    /// C; with an estimated noise, the covariance of Student's distribution.
    pub(crate) covariance: DMatrix<f64>,
    /// M.
    pub(crate) sensitivity: DMatrix<f64>,
    /// Covariance of a stated tolerance, which is included in C.
    pub(crate) prior: Option<DMatrix<f64>>,
    /// Degrees of freedom of an estimated noise; `None` if it is stated.
    pub(crate) degrees_of_freedom: Option<f64>,
}

impl Change {
    /// Removes the kernel of M, which has `dimensions` dimensions.
    pub(crate) fn without_kernel(self, dimensions: usize) -> Self {
        let eigen = self.sensitivity.clone().symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        sort_by(&mut order, |own| -eigen.eigenvalues[*own]);
        order.truncate(order.len().saturating_sub(dimensions));
        let kept = eigen.eigenvectors.select_columns(&order);
        let projected = |matrix: &DMatrix<f64>| kept.tr_mul(matrix) * &kept;
        Self {
            difference: kept.tr_mul(&self.difference),
            covariance: projected(&self.covariance),
            sensitivity: projected(&self.sensitivity),
            prior: self.prior.as_ref().map(projected),
            ..self
        }
    }

    /// √(uᵀM u), mm.
    pub(crate) fn size(&self) -> f64 {
        let weights = &self.sensitivity * &self.difference;
        weights.dot(&self.difference).sqrt()
    }

    /// √tr(M C), mm.
    pub(crate) fn sigma(&self) -> f64 {
        self.sensitivity
            .component_mul(&self.covariance)
            .sum()
            .sqrt()
    }

    /// √tr(M S), mm: S = C − C P⁻¹ C is the covariance of u due to the samples' noise, C without a tolerance.
    pub(crate) fn scatter(&self) -> f64 {
        let scatter = match &self.prior {
            None => self.covariance.clone(),
            Some(prior) => {
                let (_, inverse) = roots(prior);
                let drawn = inverse * &self.covariance;
                &self.covariance - drawn.tr_mul(&drawn)
            }
        };
        self.sensitivity
            .component_mul(&scatter)
            .sum()
            .max(0.0)
            .sqrt()
    }

    /// The probability that the mean squared position error grows. `None` if there are too few degrees of freedom to
    /// estimate the noise.
    pub(crate) fn chance_of_harm(&self) -> Option<f64> {
        let levels = match (self.degrees_of_freedom, &self.prior) {
            (Some(freedom), None) => noise_levels(freedom, NOISE_LEVELS)?,
            _ => vec![1.0],
        };
        let (combinations, squared) = self.combinations();
        let said = combinations.iter().map(|own| own.said.abs());
        let largest = match &self.prior {
            Some(_) => LARGEST_TOLERANCE,
            None => said.fold(0.0, f64::max),
        };
        let (mut total, mut harmed) = (0.0, 0.0);
        let mut best = f64::NEG_INFINITY;
        for level in levels {
            for size in 0..SIZES {
                let part = f64::from(size) / f64::from(SIZES - 1);
                let own = (largest * SMALLEST.powf(part)).powi(2);
                let (mut logarithm, mut gain, mut variance) = (0.0, -squared, 0.0);
                for combination in &combinations {
                    let (said, weight) = (combination.said, combination.weight);
                    let noise = level * combination.variance;
                    let sum = own + noise;
                    logarithm -= 0.5 * (sum.ln() + said * said / sum);
                    gain += 2.0 * weight * own / sum * said;
                    variance += 4.0 * weight * weight * own * noise / sum;
                }
                // Sums relative to the largest term so far.
                if logarithm > best {
                    let rescale = (best - logarithm).exp();
                    (total, harmed) = (total * rescale, harmed * rescale);
                    best = logarithm;
                }
                let likelihood = (logarithm - best).exp();
                total += likelihood;
                harmed += likelihood * harm(gain, variance);
            }
        }
        let chance: f64 = harmed / total;
        chance.is_finite().then_some(chance)
    }

    /// The samples' estimates along the eigenvectors of C, in mm or, with a tolerance, in tolerances; and uᵀM u.
    fn combinations(&self) -> (Vec<Combination>, f64) {
        let size = self.difference.len();
        let (root, inverse) = match &self.prior {
            Some(prior) => roots(prior),
            None => (DMatrix::identity(size, size), DMatrix::identity(size, size)),
        };
        let eigen = (&inverse * &self.covariance * inverse.transpose()).symmetric_eigen();
        let least = f64::EPSILON * eigen.eigenvalues.amax();
        let change = eigen.eigenvectors.tr_mul(&(&inverse * &self.difference));
        let weights = root.tr_mul(&(&self.sensitivity * &self.difference));
        let weights = eigen.eigenvectors.tr_mul(&weights);
        let squared = weights.dot(&change);
        let each = change.iter().zip(&weights).zip(&eigen.eigenvalues);
        let combinations = each.map(|((u, weight), value)| {
            let value = value.max(least);
            // The share of the samples' estimate that the tolerance leaves.
            let part = match &self.prior {
                Some(_) => (1.0 - value).max(UNDETERMINED),
                None => 1.0,
            };
            Combination {
                said: u / part,
                variance: value / part,
                weight: *weight,
            }
        });
        (combinations.collect(), squared)
    }
}

/// A parameter combination along an eigenvector of C.
struct Combination {
    /// The samples' own estimate d.
    said: f64,
    /// Its variance λ.
    variance: f64,
    /// M u.
    weight: f64,
}

/// S with S Sᵀ = P, and its inverse on the span of P.
fn roots(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let eigen = matrix.clone().symmetric_eigen();
    let least = f64::EPSILON * eigen.eigenvalues.amax();
    let (mut root, mut inverse) = (Vec::new(), Vec::new());
    let vectors = eigen.eigenvectors.column_iter();
    for (value, vector) in eigen.eigenvalues.iter().zip(vectors) {
        if *value > least {
            root.push(vector * value.sqrt());
            inverse.push(vector / value.sqrt());
        }
    }
    let root = DMatrix::from_columns(&root);
    (root, DMatrix::from_columns(&inverse).transpose())
}

/// The probability that a normally distributed gain is negative.
fn harm(gain: f64, variance: f64) -> f64 {
    if variance > 0.0
        && let Ok(normal) = Normal::new(gain, variance.sqrt())
    {
        normal.cdf(0.0)
    } else if gain > 0.0 {
        0.0
    } else {
        1.0
    }
}

/// A change below this fraction of its scatter by noise alone counts as none.
const UNCHANGED: f64 = 0.3;
/// Uncertainty, as a fraction of the forearms, below what any instrument resolves: 2 µm of 480 mm.
const NEGLIGIBLE: f64 = 5e-6;
/// Above this probability of making the robot worse, a calibration is doubtful.
const DOUBTFUL: f64 = 0.005;
/// With a stated tolerance, a calibration is refused above this probability. Without one, every doubtful one is
/// refused, because the probability is then slightly underestimated (docs/method.md).
const HARMFUL: f64 = 0.05;

/// How far positions over the workspace move with a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moved {
    /// rms distance, mm.
    pub change: f64,
    /// rms standard deviation after the calibration, mm.
    pub sigma: f64,
    /// rms standard deviation of the change due to the samples' noise alone, mm.
    pub scatter: f64,
}

/// How far the calibration moves the platform over poses evenly spread in joint space
/// ([`inside`](crate::accuracy::uncertainty::WorkspacePoses::inside)), and the uncertainty of the calibrated positions
/// there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WorkspaceComparison {
    /// rms distance between the calibrated and the original robot's positions, mm.
    #[serde(rename = "change_mm")]
    pub change: f64,
    /// rms standard deviation of the calibrated positions, mm: √ of the mean of tr(J C Jᵀ) over all
    /// poses that the calibrated robot reaches.
    #[serde(rename = "position_sigma_mm")]
    pub sigma: f64,
    /// `change` and `sigma`; with `--frame sensor`, those of the relative positions.
    #[serde(skip)]
    pub judged: Moved,
    /// A `judged.sigma` up to this is negligible, mm.
    #[serde(skip)]
    pub negligible: f64,
    /// The probability that the rms position error is larger after the calibration than before; with `--frame sensor`,
    /// of the relative positions. `None` if the robot stays as it is, or if the noise is neither stated nor estimated well
    /// enough.
    pub chance_of_harm: Option<f64>,
    /// The same of positions in the frame of the base, whether or not the readings show it.
    pub absolute_chance_of_harm: Option<f64>,
    /// The same of relative positions.
    pub relative_chance_of_harm: Option<f64>,
}

impl WorkspaceComparison {
    /// Compares a robot before and after a calibration whose covariance includes the stated tolerance, over poses inside
    /// the calibrated robot's workspace; `None` if no pose is reached by both robots.
    pub(crate) fn of(
        before: &Robot<f64>,
        solution: &Solution,
        tolerance: Option<&Tolerance<f64>>,
        inside: &[Sample<f64>],
    ) -> Option<Self> {
        let (after, covariance) = (&solution.robot, &solution.of_parameters());
        let there = Sensitivities::of(after, &Tool::default(), inside.iter().copied());
        let moves = there.0.iter().filter_map(|(pose, _)| {
            let from = before.forward(&pose.joints).ok()?;
            Some((pose.position - from).norm_squared())
        });
        let (sum, poses) = moves.fold((0.0, 0.0), |(sum, poses), own| (sum + own, poses + 1.0));
        if poses == 0.0 {
            return None;
        }
        let absolute = there.mean_square();
        let units = units(before);
        let products = units * units.transpose();
        let dynamic =
            |matrix: SMatrix<f64, 24, 24>| DMatrix::from_column_slice(24, 24, matrix.as_slice());
        let of = |sensitivity: SMatrix<f64, 24, 24>| Change {
            difference: DVector::from_column_slice(differences(after, before).as_slice()),
            covariance: dynamic(covariance.component_mul(&products)),
            sensitivity: dynamic(sensitivity.component_div(&products)),
            prior: tolerance.map(|tolerance| {
                // Joint zeros known only in degrees: the tolerance applies about the upper arms' calibrated directions.
                let about = match tolerance.joint_zero() {
                    Some(_) => after,
                    None => before,
                };
                dynamic(prior_covariance(about, tolerance).component_mul(&products))
            }),
            degrees_of_freedom: solution.estimated_freedom(),
        };
        let whole_change = f64::sqrt(sum / poses);
        let whole_sigma = covariance.component_mul(&absolute).sum().sqrt();
        let absolute = of(absolute);
        // Besides the six rigid motions, the unused places of a tower's parameters.
        let empty = 24 - 3 * before.drive().parameters().len();
        let relative = of(there.relative()?.mean_square()).without_kernel(6 + empty);
        let (size, change) = if solution.is_absolute() {
            (whole_change, &absolute)
        } else {
            (relative.size(), &relative)
        };
        let judged = Moved {
            change: size,
            sigma: change.sigma(),
            scatter: change.scatter(),
        };
        let mut own = Self {
            change: whole_change,
            sigma: whole_sigma,
            judged,
            negligible: NEGLIGIBLE * after.arms().iter().map(Arm::lb).fold(0.0, f64::max),
            chance_of_harm: None,
            absolute_chance_of_harm: None,
            relative_chance_of_harm: None,
        };
        if !own.unchanged() {
            own.absolute_chance_of_harm = absolute.chance_of_harm();
            own.relative_chance_of_harm = relative.chance_of_harm();
            own.chance_of_harm = if solution.is_absolute() {
                own.absolute_chance_of_harm
            } else {
                own.relative_chance_of_harm
            };
        }
        Some(own)
    }

    /// Whether the calibrated robot may well be less accurate than before.
    ///
    /// False if the calibration left the robot unchanged, and for exact samples of an exact robot.
    pub fn may_be_worse(&self) -> bool {
        !self.unchanged()
            && self.judged.sigma > self.negligible
            && self.chance_of_harm.is_some_and(|chance| chance > DOUBTFUL)
    }

    /// Whether harm is so likely that the calibration is refused.
    pub(crate) fn is_harmful(&self, has_tolerance: bool) -> bool {
        let likely = self.chance_of_harm.is_some_and(|chance| chance > HARMFUL);
        self.may_be_worse() && (likely || !has_tolerance)
    }

    /// Whether the calibration left the robot unchanged, as when the same samples are calibrated again.
    pub fn unchanged(&self) -> bool {
        self.judged.change <= UNCHANGED * self.judged.scatter
    }
}

#[cfg(test)]
mod tests {
    use super::{Change, SMALLEST};
    use delta_cal::simulate::standard_normal;
    use nalgebra::{DMatrix, DVector};
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    /// A robot of 24 parameters with differences of this size, determined well or badly depending on `spread`, with an
    /// optional tolerance of 0.7 in every parameter; and whether the calibration made it worse.
    fn made(size: f64, spread: f64, stated: bool, rng: &mut Pcg32) -> (Change, bool) {
        let mut normal = || standard_normal::<f64, _>(rng);
        let sigma = DVector::from_fn(24, |_, _| 0.1 * 10_f64.powf(0.5 * spread * normal()));
        let own = DVector::from_fn(24, |_, _| size * normal());
        let noise = DVector::from_fn(24, |index, _| sigma[index] * normal());
        let squares = sigma.component_mul(&sigma);
        let prior = DVector::from_element(24, 0.7 * 0.7);
        // The share of the samples' estimate that a tolerance leaves.
        let part = prior.zip_map(
            &squares,
            |prior, own| {
                if stated { prior / (prior + own) } else { 1.0 }
            },
        );
        let difference = (&own + &noise).component_mul(&part);
        let variances = squares.component_mul(&part);
        let harmed = (&difference - &own).norm() > own.norm();
        let change = Change {
            difference,
            covariance: DMatrix::from_diagonal(&variances),
            sensitivity: DMatrix::identity(24, 24),
            prior: stated.then(|| DMatrix::from_diagonal(&prior)),
            degrees_of_freedom: None,
        };
        (change, harmed)
    }

    /// The size of the differences is unknown. Robots with a stated tolerance have any size up to twice the tolerance:
    /// some were calibrated before.
    #[test]
    fn as_many_become_worse_as_the_chances_say() {
        let spreads = [1.0, 2.0, 3.0];
        for (spread, stated) in spreads.iter().flat_map(|own| [(*own, false), (*own, true)]) {
            let (mut said, mut variance, mut all) = (0.0, 0.0, 0.0);
            let mut rng = Pcg32::seed_from_u64(1);
            for _ in 0..1000 {
                let part = f64::from(rng.next_u32()) / f64::from(u32::MAX);
                let size = if stated {
                    1.4 * SMALLEST.powf(part)
                } else {
                    0.7
                };
                let (change, harmed) = made(size, spread, stated, &mut rng);
                let chance = change.chance_of_harm().unwrap_or(f64::NAN);
                said += chance;
                variance += chance * (1.0 - chance);
                all += f64::from(u8::from(harmed));
            }
            // Four standard deviations, plus 1 % because τ is not known exactly.
            let limit = 4.0 * f64::sqrt(variance) + 0.01 * said;
            println!("{spread} {stated}: {all} {said:.1} {limit:.1}");
            assert!(
                f64::abs(all - said) < limit,
                "{spread} {stated}: {all} {said}"
            );
        }
    }

    /// With the tolerance P and the samples' own variances S: C = SP/(S + P), and noise alone scatters u with the
    /// variance C²/S.
    #[test]
    fn a_tolerance_leaves_less_scatter() {
        let mut rng = Pcg32::seed_from_u64(3);
        let (change, _) = made(0.7, 1.0, true, &mut rng);
        let mut expected = 0.0;
        for own in change.covariance.diagonal().iter() {
            expected += own * own * (1.0 / own - 1.0 / 0.49);
        }
        assert!((change.scatter() - f64::sqrt(expected)).abs() < 1e-12);
    }

    /// The change along other axes.
    fn along(axes: &DMatrix<f64>, change: &Change) -> Change {
        let turned = |matrix: &DMatrix<f64>| axes * matrix * axes.transpose();
        Change {
            difference: axes * &change.difference,
            covariance: turned(&change.covariance),
            sensitivity: turned(&change.sensitivity),
            prior: change.prior.as_ref().map(turned),
            degrees_of_freedom: None,
        }
    }

    /// Six of 24 combinations move the robot as a whole: the probability is that of the other 18 alone, along any axes.
    #[test]
    fn motions_of_the_whole_robot_do_not_count() {
        let mut rng = Pcg32::seed_from_u64(2);
        for number in 0..100 {
            let (mut change, _) = made(0.5, 2.0, number % 2 == 0, &mut rng);
            change.sensitivity *= 1.0 + f64::from(number % 3);
            change.sensitivity.view_mut((18, 18), (6, 6)).fill(0.0);
            let mut normal = || standard_normal::<f64, _>(&mut rng);
            let axes = DMatrix::from_fn(24, 24, |_, _| normal()).qr().q();
            let found = along(&axes, &change).without_kernel(6);
            let expected = along(&DMatrix::identity(18, 24), &change);
            let figures = |own: &Change| {
                let chance = own.chance_of_harm().unwrap_or(f64::NAN);
                [chance, own.size(), own.sigma()]
            };
            for (found, expected) in figures(&found).iter().zip(figures(&expected)) {
                // Rounding of numbers up to 1e3, squared.
                assert!((found - expected).abs() < 1e-8, "{found} {expected}");
            }
        }
    }
}
