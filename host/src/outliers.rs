//! Which samples fit worst, found by fits that assume nothing of noise and tolerance.

use crate::position_error::{distances, median, sorted};
use crate::words::list;
use crate::{Options, PositionError, Row};
use delta_cal::{Calibrator, Robot, Sample, Settings};

/// A sample this many times as far off as the median sample fits badly.
const OUTLIER: f64 = 4.0;
/// How many of them are named.
const NAMED: usize = 3;
/// Distances below this part of the forearm are rounding errors.
const ROUNDING: f64 = 1e-6;
/// One sample among more than this many cannot draw the fit to itself.
const MANY: usize = 200;
/// So many samples or more determine an arm without a guess, and average the noise a little.
const ENOUGH: usize = 12;

/// The samples of a robot and how to fit them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit<'a> {
    pub(crate) nominal: &'a Robot<f64>,
    pub(crate) measured: &'a [Sample<f64>],
    pub(crate) rows: &'a [Row<Sample<f64>>],
    pub(crate) options: Options,
}

/// Samples left out of a fit, and how far every sample is off after it.
struct Without {
    left_out: Vec<usize>,
    distances: Vec<Option<f64>>,
}

impl Fit<'_> {
    /// The samples that fit worst, in words; `None` if none stands out or the samples give no fit.
    pub(crate) fn worst_samples(&self) -> Option<String> {
        let without = self
            .one_after_the_other()
            .or_else(|| self.one_that_spoils_the_fit())?;
        let mut worst: Vec<_> = without
            .left_out
            .iter()
            .filter_map(|index| {
                let distance = (*without.distances.get(*index)?)?;
                Some((distance, self.rows.get(*index)?.line))
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
            median(&sorted(&without.distances, self.rows))
        ))
    }

    /// Fits without these samples.
    fn without(&self, left_out: &[usize]) -> Option<Without> {
        let settings = Settings {
            method: self.options.solver,
            start: self.options.start(),
            ..Settings::default()
        };
        let kept: Vec<_> = self
            .measured
            .iter()
            .enumerate()
            .filter(|(index, _)| !left_out.contains(index))
            .map(|(_, sample)| *sample)
            .collect();
        let mut calibrator = Calibrator::new(self.nominal, &settings);
        calibrator.add_many(&kept).ok()?;
        let outcome = calibrator.solve().ok()?;
        Some(Without {
            left_out: left_out.to_vec(),
            distances: distances(&outcome.robot, self.measured),
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
        let [arm, ..] = self.nominal.arms();
        let median = median(&sorted(distances, self.rows));
        (OUTLIER * median).max(ROUNDING * arm.lb())
    }

    /// At the edge of the poses one sample can draw the fit to itself, so that none stands out. It
    /// does when the fit leaves it out; without it, the others fit far better.
    fn one_that_spoils_the_fit(&self) -> Option<Without> {
        if !(ENOUGH + 1..=MANY).contains(&self.measured.len()) {
            return None;
        }
        let rms = |distances: &[Option<f64>]| PositionError::of(distances, self.rows).rms;
        let together = self.without(&[]);
        let mut least = together.map_or(f64::INFINITY, |fit| rms(&fit.distances) / OUTLIER);
        let mut found = None;
        for index in 0..self.measured.len() {
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
