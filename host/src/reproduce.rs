//! Section 4 of the paper, run again: its simulations as campaigns, its figures, and its numbers
//! beside those found here.
//!
//! ```text
//! EXPERIMENTS ─→ campaign::run ─┬→ Reproduction ─→ results.csv
//! robot ─→ workspace::Analysis ─┘       ├→ figures ─→ SVG, PNG
//!                                       └→ report.html
//! ```
//!
//! The paper: T. Bentaleb, J. Iqbal, "On the improvement of calibration accuracy of parallel robots –
//! modeling and optimization", JTAM 58(1), 2020, doi 10.15632/jtam-pl/115863.

mod boundary;
mod comparison;
mod experiment;
mod figures;
mod report;
mod results;

pub use comparison::{Comparison, comparisons};
pub use experiment::{EXPERIMENTS, Experiment, PaperValue};
pub use figures::{NamedFigure, figures};
pub use report::render;
pub use results::results_csv;

use crate::campaign;
use crate::campaign::{CampaignError, CaseSummary, RunOptions, Shard};
use crate::workspace::Analysis;
use std::path::Path;

/// The folder of the campaigns within that of the reproduction.
pub const CAMPAIGNS: &str = "campaigns";

/// Every experiment and what came of it.
#[derive(Debug, Clone)]
pub struct Reproduction {
    /// In the order of [`EXPERIMENTS`].
    pub experiments: Vec<Results>,
    /// The boundary of the workspace, and the influence of the parameters on it.
    pub boundary: Analysis,
}

/// One experiment and what came of it.
#[derive(Debug, Clone)]
pub struct Results {
    /// What was run.
    pub experiment: &'static Experiment,
    /// Its cases.
    pub cases: Vec<CaseSummary>,
}

impl Reproduction {
    /// The cases of an experiment; empty for a name that is none.
    pub fn cases(&self, name: &str) -> &[CaseSummary] {
        self.experiments
            .iter()
            .find(|results| results.experiment.name == name)
            .map_or(&[], |results| &results.cases)
    }

    /// Calibrations of all experiments.
    pub fn calibrations(&self) -> u64 {
        let cases = self.experiments.iter().flat_map(|results| &results.cases);
        cases.map(|case| case.robots).sum()
    }
}

/// Runs every experiment, or what is left of it, in folders of its own within `folder`. `robots`
/// replaces the number of robots of each case. `progress` is told how many robots are finished, of
/// how many.
///
/// # Errors
/// A folder that holds something else, a file that cannot be written, or an interruption.
pub fn run(
    folder: &Path,
    robots: Option<u64>,
    options: &RunOptions<'_>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Reproduction, CampaignError> {
    let mut plans = Vec::with_capacity(EXPERIMENTS.len());
    for experiment in &EXPERIMENTS {
        let mut plan = experiment.plan()?;
        plan.robots = robots.unwrap_or(plan.robots);
        plans.push((experiment, plan));
    }
    let of = |plan: &campaign::Plan| plan.robots * plan.scenarios().len() as u64;
    let total = plans.iter().map(|(_, plan)| of(plan)).sum();
    let mut before = 0;
    let mut experiments = Vec::with_capacity(plans.len());
    for (experiment, plan) in &plans {
        let folder = folder.join(CAMPAIGNS).join(experiment.name);
        let cases = campaign::run(plan, Shard::WHOLE, &folder, options, &mut |finished, _| {
            progress(before + finished, total);
        })?;
        before += of(plan);
        progress(before, total);
        experiments.push(Results { experiment, cases });
    }
    Ok(Reproduction {
        experiments,
        boundary: boundary::compute()?,
    })
}
