//! Every experiment and what came of it.

use super::experiment::Experiment;
use crate::campaign::CaseSummary;
use crate::workspace::Analysis;

/// Every experiment and what came of it.
#[derive(Debug, Clone)]
pub struct Reproduction {
    /// In the order of [`EXPERIMENTS`](super::EXPERIMENTS).
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
