//! Runs a campaign: robots in parallel, rows in order.

use super::CampaignError;
use super::folder::{Folder, PARAMETERS, Rows, SUMMARY, TIMING};
use super::plan::{Plan, Shard};
use super::planned::AllMeasuredAt;
use super::row::{RobotRows, robot_rows};
use super::summary::{CaseSummary, parameters_csv, summarise, summary_csv, timing_csv};
use rayon::ThreadPoolBuilder;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Robots a thread between two times that rows are written.
const ROBOTS_A_THREAD: usize = 64;
/// Between two times that the rows are made safe.
const CHECKPOINT: Duration = Duration::from_secs(1);

/// How a campaign is run. None of it changes a bit of the rows.
#[derive(Debug, Clone, Copy)]
pub struct RunOptions<'a> {
    /// Threads; 0 for one a processor.
    pub threads: usize,
    /// Delete what is in the folder and start anew.
    pub force: bool,
    /// Set from outside to stop: what is finished is kept.
    pub interrupted: &'a AtomicBool,
}

/// Runs a campaign, or what is left of it, in a folder. `progress` is told how many robots are
/// finished, of how many.
///
/// # Errors
/// A folder that holds something else, a file that cannot be written, or an interruption.
pub fn run(
    plan: &Plan,
    shard: Shard,
    folder: &Path,
    options: &RunOptions<'_>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<CaseSummary>, CampaignError> {
    let mut folder = Folder::open(folder, plan, shard, options.force)?;
    if folder.record.complete {
        folder.verify()?;
    } else {
        let mut rows = folder.rows(plan)?;
        let computed = compute(plan, shard, &mut rows, options, progress);
        // Whatever stopped it: what is finished is kept.
        rows.checkpoint()?;
        computed?;
    }
    conclude(plan, shard, &mut folder)
}

/// Writes what follows from the rows, if that is not there yet.
pub(super) fn conclude(
    plan: &Plan,
    shard: Shard,
    folder: &mut Folder,
) -> Result<Vec<CaseSummary>, CampaignError> {
    let summaries = summarise(&folder.rows_file(), plan, shard, &folder.record)?;
    if !folder.record.complete {
        let mut tables = vec![
            (SUMMARY, summary_csv(&summaries)?),
            (TIMING, timing_csv(&summaries)?),
        ];
        if plan.parameters {
            tables.push((PARAMETERS, parameters_csv(&summaries)?));
        }
        folder.finish(&tables)?;
    }
    Ok(summaries)
}

fn compute(
    plan: &Plan,
    shard: Shard,
    rows: &mut Rows<'_>,
    options: &RunOptions<'_>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), CampaignError> {
    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(|error| CampaignError::Threads(error.to_string()))?;
    let each = shard.robots(plan);
    // What an earlier run has finished is not planned again.
    let finished = usize::try_from(rows.robots().checked_div(each).unwrap_or(0)).unwrap_or(0);
    let measured_at = pool.install(|| AllMeasuredAt::of(plan, finished))?;
    let total = each * plan.scenarios().len() as u64;
    let variants = plan.variants();
    let batch = (ROBOTS_A_THREAD * pool.current_num_threads()) as u64;
    // The scenario, the index of its first case, and the robot.
    let place = |index: u64| {
        let scenario = usize::try_from(index / each).unwrap_or(usize::MAX);
        (
            scenario,
            scenario * variants.len(),
            shard.robot(index % each),
        )
    };
    let robot = |index: u64| -> Result<RobotRows, CampaignError> {
        let (scenario, first, robot) = place(index);
        let at = measured_at.scenario(scenario);
        let scenario = &plan.scenarios()[scenario];
        robot_rows(plan, at, (first + 1, scenario), &variants, robot)
            .map_err(|error| CampaignError::file(Path::new("rows"), error))
    };
    let stopped = || options.interrupted.load(Ordering::Relaxed);

    let mut safe = Instant::now();
    while rows.robots() < total {
        progress(rows.robots(), total);
        let begin = rows.robots();
        let end = total.min(begin + batch);
        let finished: Vec<_> = pool.install(|| {
            (begin..end)
                .into_par_iter()
                .map(|index| (!stopped()).then(|| robot(index)))
                .collect()
        });
        for (index, robot) in (begin..end).zip(finished.into_iter().map_while(|robot| robot)) {
            let robot = robot?;
            rows.append(&robot.text, place(index).1, &robot.times)?;
        }
        if stopped() && rows.robots() < total {
            let finished = rows.robots();
            return Err(CampaignError::Interrupted {
                finished,
                robots: total,
            });
        }
        if safe.elapsed() >= CHECKPOINT {
            rows.checkpoint()?;
            safe = Instant::now();
        }
    }
    progress(total, total);
    Ok(())
}
