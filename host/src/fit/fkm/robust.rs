//! The FKM method's robust fit: an M-estimate by iteratively reweighted least squares.
//!
//! ```text
//! minimise  Σ ρ(dₖ/s),   dₖ = |Lₖ⁻¹ (Xₖ − FK(P; qₖ))|,   s = median d / 1.538 · √(n/(n − 8))
//! ```
//!
//! One weight a sample: it is right or wrong as a whole. d is the length of three residuals, of normal
//! ones 1.538 in the median, and the losses are so much wider that they are worth 95 % of the squared
//! one here as well. The IKM method's robust fit is the start. Without a stated noise s is no less than
//! that fit's estimate of the noise: of few samples the 24 parameters may come so near to half that the
//! median says nothing.

use super::problem::{Problem, as_number, residual_length};
use super::search::Search;
use crate::fit::outcome::Outcome;
use crate::fit::weights::{Fit, SampleWeight};
use delta_cal::calibration::limits::{LARGEST_SUSPECTED, SUSPECTED};
use delta_cal::calibration::{Start, StartUsed};
use delta_cal::robust::{Loss, RobustRefusal};
use delta_cal::{Noise, Refusal, Robot, RobotOutcome, Sample, Settings};

/// The median length of three normal residuals with σ = 1.
const MEDIAN: f64 = 1.538_172;
/// By how much the losses are wider than those for single residuals: k = 1.628, c = 5.490.
const HUBER_STRETCH: f64 = 1.210_396;
const TUKEY_STRETCH: f64 = 1.171_878;
const DIMENSIONS: f64 = 3.0;
/// Rounds of reweighting at most; after half of them the scale stays, and what is rejected.
const ROUNDS: u16 = 50;
/// The scale of exact samples, as a part of the forearm: what rounding leaves.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Fits with weights that the samples were given.
struct Weighing<'a> {
    robot: &'a Robot<f64>,
    settings: &'a Settings<f64>,
    loss: Loss,
    samples: &'a [Sample<f64>],
    weights: Vec<f64>,
    suspected: Vec<bool>,
    scale: f64,
    least_scale: f64,
}

/// What counts: samples, their factors in the sum of squares, and the effective number of samples.
struct Counted {
    samples: Vec<Sample<f64>>,
    factors: Vec<f64>,
    effective_samples: f64,
}

/// Continues from the IKM method's robust fit.
pub(crate) fn calibrate_robust(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
    loss: Loss,
    ikm: &RobotOutcome<f64>,
) -> Result<Fit, RobustRefusal> {
    let mut weighing = Weighing {
        robot,
        settings,
        loss,
        samples,
        weights: vec![1.0; samples.len()],
        suspected: vec![false; samples.len()],
        scale: 0.0,
        least_scale: least_scale(robot, settings, ikm),
    };
    let (mut current, mut sizes) = (ikm.robot, weighing.sizes(&ikm.robot));
    let (mut rounds, mut settled) = (0, false);
    while rounds < ROUNDS && !settled {
        let late = rounds >= ROUNDS / 2;
        if !late {
            weighing.scale = weighing.scale_of(&sizes);
        }
        let change = weighing.weigh(&sizes, late);
        settled = rounds > 0 && change <= f64::EPSILON.sqrt();
        rounds += 1;
        let Some(next) = weighing.fit(&sizes, &current) else {
            break;
        };
        sizes = weighing.sizes(&next);
        current = next;
    }
    let suspected = weighing.suspected.iter().filter(|s| **s).count();
    if as_number(suspected) > LARGEST_SUSPECTED * as_number(samples.len()) {
        return Err(RobustRefusal::TooManySuspected {
            suspected,
            samples: samples.len(),
        });
    }
    let outcome = weighing.outcome(&sizes, &current, ikm)?;
    let weights = weighing.weights.iter().zip(&weighing.suspected);
    Ok(Fit {
        outcome,
        samples: weights
            .map(|(weight, suspected)| SampleWeight {
                weight: *weight,
                suspected: *suspected,
            })
            .collect(),
        settled,
    })
}

fn least_scale(robot: &Robot<f64>, settings: &Settings<f64>, ikm: &RobotOutcome<f64>) -> f64 {
    if settings.noise.is_some() {
        return 1.0;
    }
    let [arm, ..] = robot.arms();
    let estimated = Outcome::from(*ikm).estimated_noise().unwrap_or(0.0);
    estimated.max(ROUNDING * arm.lb())
}

impl Weighing<'_> {
    fn noise(&self) -> Option<&Noise<f64>> {
        self.settings.noise.as_ref()
    }

    /// Infinite where the robot does not reach the joint angles.
    fn sizes(&self, robot: &Robot<f64>) -> Vec<f64> {
        let size = |sample| residual_length(robot, sample, self.noise()).unwrap_or(f64::INFINITY);
        self.samples.iter().map(size).collect()
    }

    fn scale_of(&self, sizes: &[f64]) -> f64 {
        let mut sorted = sizes.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |index: usize| sorted.get(index).copied().unwrap_or(f64::INFINITY);
        let median = f64::midpoint(at((sorted.len() - 1) / 2), at(sorted.len() / 2));
        let count = as_number(sizes.len());
        (median / MEDIAN * (count / (count - 8.0)).sqrt()).max(self.least_scale)
    }

    fn stretch(&self) -> f64 {
        match self.loss {
            Loss::Huber => HUBER_STRETCH,
            Loss::Tukey => TUKEY_STRETCH,
        }
    }

    /// Weighs every sample; returns the largest change of a weight. Late in the rounds what was
    /// suspected stays so.
    fn weigh(&mut self, sizes: &[f64], late: bool) -> f64 {
        let unit = self.scale * self.stretch();
        let mut largest: f64 = 0.0;
        for ((weight, suspected), size) in
            self.weights.iter_mut().zip(&mut self.suspected).zip(sizes)
        {
            *suspected = (late && *suspected) || !(size / unit < SUSPECTED);
            let next = if *suspected {
                0.0
            } else {
                self.loss.weight(size / unit)
            };
            largest = largest.max((next - *weight).abs());
            *weight = next;
        }
        largest
    }

    fn counted(&self, sizes: &[f64]) -> Counted {
        let kept = || {
            let all = self.samples.iter().zip(&self.weights).zip(sizes);
            all.filter(|((_, weight), _)| **weight > 0.0)
        };
        let in_scales = kept().map(|(_, size)| size / self.scale);
        let normalization = self
            .loss
            .normalization(in_scales, DIMENSIONS, self.stretch());
        Counted {
            samples: kept().map(|((sample, _), _)| *sample).collect(),
            factors: kept()
                .map(|((_, weight), _)| weight / normalization.divisor)
                .collect(),
            effective_samples: normalization.effective_samples,
        }
    }

    fn problem<'b>(&'b self, weights: &Robot<f64>, counted: &'b Counted) -> Problem<'b> {
        Problem::new(
            self.robot,
            weights,
            &counted.samples,
            self.noise(),
            self.settings.tolerance.as_ref(),
        )
        .weighted(&counted.factors, counted.effective_samples)
    }

    fn fit(&self, sizes: &[f64], from: &Robot<f64>) -> Option<Robot<f64>> {
        let counted = self.counted(sizes);
        let problem = self.problem(from, &counted);
        let mut search = Search::new(&problem, self.settings);
        search.start(&problem.correction_to(from), StartUsed::Ikm);
        search.balance_tolerance();
        problem.robot(&search.end()?).ok()
    }

    fn outcome(
        &self,
        sizes: &[f64],
        weights: &Robot<f64>,
        ikm: &RobotOutcome<f64>,
    ) -> Result<Outcome, Refusal> {
        let counted = self.counted(sizes);
        let problem = self.problem(weights, &counted);
        let mut search = Search::new(&problem, self.settings);
        if self.settings.start == Start::Nominal {
            search.start(&super::Vector24::zeros(), StartUsed::Nominal);
        }
        search.second_start(ikm);
        search.balance_tolerance();
        search.outcome(None)
    }
}
