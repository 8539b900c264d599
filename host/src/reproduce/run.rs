//! Runs the experiments.

use super::boundary;
use super::experiment::EXPERIMENTS;
use super::reproduction::{Reproduction, Results};
use crate::campaign::{self, CampaignError, RunOptions, Shard};
use std::path::Path;

/// The folder of the campaigns within that of the reproduction.
pub const CAMPAIGNS: &str = "campaigns";

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
