//! Which samples fit worst, found by fits that assume nothing of noise and tolerance.

use super::case::Case;
use crate::accuracy::position_error::{PositionError, distances, median, sorted};
use crate::fit::outlier::SUSPECT;
use crate::text::words::list;
use delta_cal::{Calibrator, Settings};

/// How many of them are named.
const NAMED: usize = 3;
/// Distances below this part of the forearm are rounding errors.
const ROUNDING: f64 = 1e-6;
/// One sample among more than this many cannot draw the fit to itself. So there are no more than
/// `MANY + NAMED + 2` fits: one without each sample, and those that leave out one after the other.
const MANY: usize = 200;
/// So many samples or more determine an arm without a guess, and average the noise a little.
const ENOUGH: usize = 12;

/// Samples left out of a fit, and how far every sample is off after it.
struct Without {
    left_out: Vec<usize>,
    distances: Vec<Option<f64>>,
}

/// The samples that fit worst, in words; `None` if none stands out or the samples give no fit.
pub(super) fn worst_samples(case: &Case<'_>) -> Option<String> {
    Search { case }.worst_samples()
}

struct Search<'a> {
    case: &'a Case<'a>,
}

impl Search<'_> {
    fn worst_samples(&self) -> Option<String> {
        let without = self
            .one_after_the_other()
            .or_else(|| self.one_that_spoils_the_fit())?;
        let mut worst: Vec<_> = without
            .left_out
            .iter()
            .filter_map(|index| {
                let distance = (*without.distances.get(*index)?)?;
                Some((distance, self.case.samples.rows.get(*index)?.line))
            })
            .collect();
        worst.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (subject, fit, them) = if worst.len() == 1 {
            ("the sample in line", "fits", "it")
        } else {
            ("the samples in lines", "fit", "them")
        };
        let named: Vec<_> = worst
            .iter()
            .map(|(distance, line)| format!("{line} ({distance:.3} mm)"))
            .collect();
        Some(format!(
            "{subject} {} {fit} worst, while half of the samples are off by less than {:.3} mm: \
             measure {them} again or leave {them} out",
            list(&named),
            median(&sorted(&without.distances, &self.case.samples.rows))
        ))
    }

    /// Fits without these samples.
    fn without(&self, left_out: &[usize]) -> Option<Without> {
        let settings = Settings::default()
            .with_solver(self.case.options.solver)
            .with_start(self.case.options.start());
        let kept: Vec<_> = self
            .case
            .measured
            .iter()
            .enumerate()
            .filter(|(index, _)| !left_out.contains(index))
            .map(|(_, sample)| *sample)
            .collect();
        let mut calibrator = Calibrator::new(&self.case.robot.robot, &settings);
        calibrator.add_many(&kept).ok()?;
        let outcome = calibrator.solve().ok()?;
        Some(Without {
            left_out: left_out.to_vec(),
            distances: distances(&outcome.robot, &self.case.measured),
        })
    }

    /// Leaves out the sample that is farthest off as long as it is far off. The next fit tells
    /// whether others were only drawn away by it.
    fn one_after_the_other(&self) -> Option<Without> {
        let mut fit = self.without(&[])?;
        while fit.left_out.len() < NAMED
            && let Some(worst) = self.farthest_off(&fit)
        {
            let left_out = [fit.left_out.as_slice(), &[worst]].concat();
            let Some(next) = self.without(&left_out) else {
                fit.left_out = left_out;
                break;
            };
            fit = next;
        }
        (!fit.left_out.is_empty()).then_some(fit)
    }

    /// The sample of the fit that is farthest off, if it is an outlier.
    fn farthest_off(&self, fit: &Without) -> Option<usize> {
        let farthest = |(index, distance): (usize, &Option<f64>)| {
            let kept = !fit.left_out.contains(&index);
            distance.filter(|_| kept).map(|distance| (index, distance))
        };
        let (index, distance) = fit
            .distances
            .iter()
            .enumerate()
            .filter_map(farthest)
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        (distance > self.least_outlier(&fit.distances)).then_some(index)
    }

    fn least_outlier(&self, distances: &[Option<f64>]) -> f64 {
        let [arm, ..] = self.case.robot.robot.arms();
        let median = median(&sorted(distances, &self.case.samples.rows));
        (SUSPECT * median).max(ROUNDING * arm.lb())
    }

    /// At the edge of the poses one sample can draw the fit to itself, so that none stands out. It
    /// does when the fit leaves it out; without it, the others fit far better.
    fn one_that_spoils_the_fit(&self) -> Option<Without> {
        if !(ENOUGH + 1..=MANY).contains(&self.case.measured.len()) {
            return None;
        }
        let rms =
            |distances: &[Option<f64>]| PositionError::of(distances, &self.case.samples.rows).rms;
        let together = self.without(&[]);
        let mut least = together.map_or(f64::INFINITY, |fit| rms(&fit.distances) / SUSPECT);
        let mut found = None;
        for index in 0..self.case.measured.len() {
            let Some(fit) = self.without(&[index]) else {
                continue;
            };
            let mut others = fit.distances.clone();
            let Some(own) = others.get_mut(index).and_then(Option::take) else {
                continue;
            };
            let of_others = rms(&others);
            if of_others < least && own > self.least_outlier(&others) {
                least = of_others;
                found = Some(fit);
            }
        }
        found
    }
}
