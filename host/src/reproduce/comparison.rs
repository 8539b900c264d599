//! A row of the paper beside the case that is nearest to it here.

use super::experiment::{Experiment, PaperValue};
use super::{Reproduction, Results};
use crate::campaign::{CaseColumns, CaseSummary};

/// A row of the paper, and robots calibrated in three ways.
#[derive(Debug, Clone, Copy)]
pub struct Comparison<'a> {
    /// Where it belongs.
    pub experiment: &'static Experiment,
    /// What the paper says.
    pub paper: &'static PaperValue,
    /// Least squares without weights and prior, as in the paper; Levenberg–Marquardt.
    pub as_in_the_paper: &'a CaseSummary,
    /// With the noise and the tolerance stated; `None` for exact measurements.
    pub with_prior: Option<&'a CaseSummary>,
    /// The same from planned poses.
    pub planned: Option<&'a CaseSummary>,
}

impl Comparison<'_> {
    /// The case.
    pub const fn case(&self) -> &CaseColumns {
        &self.as_in_the_paper.case
    }

    /// The best that is offered for this case: with a prior where there is noise.
    pub fn best(&self) -> &CaseSummary {
        self.with_prior.unwrap_or(self.as_in_the_paper)
    }

    /// Whether the median gain of the best is above the paper's; `None` if the paper states none,
    /// nothing was calibrated here, or both are the 100 % of exact measurements.
    pub fn above_the_paper(&self) -> Option<bool> {
        let here = self.with_prior?.gain_percent?;
        let paper = self.paper.gain_percent?;
        Some(here.median > paper)
    }
}

/// Every row of the paper that states a gain or a convergence, for each case here that it concerns.
pub fn comparisons(reproduction: &Reproduction) -> Vec<Comparison<'_>> {
    reproduction
        .experiments
        .iter()
        .flat_map(|results| results.cases.iter().map(move |case| (results, case)))
        .filter(|(_, summary)| {
            let case = &summary.case;
            case.solver == "lm" && !case.weights && !case.prior && !case.planned
        })
        .filter_map(|(results, as_in_the_paper)| {
            Some(Comparison {
                experiment: results.experiment,
                paper: results.experiment.paper_value(&as_in_the_paper.case)?,
                as_in_the_paper,
                with_prior: with_prior(results, &as_in_the_paper.case, false),
                planned: with_prior(results, &as_in_the_paper.case, true),
            })
        })
        .collect()
}

fn with_prior<'a>(
    results: &'a Results,
    case: &CaseColumns,
    planned: bool,
) -> Option<&'a CaseSummary> {
    let wanted = CaseColumns {
        weights: true,
        prior: true,
        planned,
        case: 0,
        ..*case
    };
    results.cases.iter().find(|summary| {
        CaseColumns {
            case: 0,
            ..summary.case
        } == wanted
    })
}
