//! Joins the shards of a campaign.

use super::CampaignError;
use super::folder::{Folder, PLAN};
use super::plan::{Plan, Shard};
use super::run::conclude;
use super::summary::CaseSummary;
use crate::files::input_text::InputText;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// A finished shard and its place among the others.
struct Part {
    path: PathBuf,
    folder: Folder,
    shard: Shard,
}

/// Joins all shards of a campaign in a new folder, whose files are those that the campaign would
/// have made by itself, to the byte; only the times are the shards'.
///
/// # Errors
/// A folder that does not hold a finished shard, a shard that is missing, there twice, damaged or of
/// another campaign, or a file that cannot be written.
pub fn merge(
    folders: &[PathBuf],
    output: &Path,
    force: bool,
) -> Result<(Plan, Vec<CaseSummary>), CampaignError> {
    let mut places = vec![identity(output)];
    for path in folders {
        if places.contains(&identity(path)) {
            let cause = "the folder is named twice";
            let remedy = "name every shard once, and another folder for the output";
            return Err(CampaignError::folder(path, cause, remedy));
        }
        places.push(identity(path));
    }
    let parts = parts(folders)?;
    let Some(first) = parts.first() else {
        let cause = "there are no shards to join";
        return Err(CampaignError::folder(output, cause, "name their folders"));
    };
    let text = InputText::from_file(&first.folder.file(PLAN))?;
    let plan = Plan::read(&text, &first.path)?;
    for part in &parts {
        part.folder.verify()?;
    }

    let mut folder = Folder::open(output, &plan, Shard::WHOLE, force)?;
    if !folder.record.complete {
        folder.restart(&plan)?;
        let mut rows = folder.rows(&plan)?;
        join(&plan, &parts, &mut |text| rows.append(text, 0, &[]))?;
        let (calibrations, seconds) = times(&parts);
        rows.set_times(calibrations, seconds);
        rows.checkpoint()?;
    }
    let summaries = conclude(&plan, Shard::WHOLE, &mut folder)?;
    Ok((plan, summaries))
}

/// The folder behind a name, if it is there.
fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// In the order of their numbers, and every one of them there.
fn parts(folders: &[PathBuf]) -> Result<Vec<Part>, CampaignError> {
    let mut parts: Vec<Part> = Vec::new();
    for path in folders {
        let folder = Folder::of_shard(path)?;
        let shard = folder.record.shard.parse().map_err(|cause: String| {
            CampaignError::folder(path, cause, "run this shard once more")
        })?;
        let part = Part {
            path: path.clone(),
            folder,
            shard,
        };
        if let Some(first) = parts.first()
            && (part.shard.of != first.shard.of || !part.folder.same_campaign(&first.folder)?)
        {
            let cause = format!(
                "holds another campaign than {}, or is cut into another number of shards",
                first.path.display()
            );
            let remedy = "join only shards of one campaign file, run by one delta-cal";
            return Err(CampaignError::folder(path, cause, remedy));
        }
        if let Some(same) = parts.iter().find(|other| other.shard == part.shard) {
            let cause = format!("holds shard {shard}, as {} does", same.path.display());
            return Err(CampaignError::folder(path, cause, "name every shard once"));
        }
        parts.push(part);
    }
    parts.sort_by_key(|part| part.shard.number);
    if let Some(first) = parts.first() {
        let mut numbers = parts.iter().map(|part| part.shard.number);
        if let Some(missing) = (1..=first.shard.of).find(|number| numbers.next() != Some(*number)) {
            let cause = format!("shard {missing}/{} is missing", first.shard.of);
            return Err(CampaignError::folder(
                &first.path,
                cause,
                "name the folders of all shards",
            ));
        }
    }
    Ok(parts)
}

/// Every robot's rows in the order of the whole campaign.
fn join(
    plan: &Plan,
    parts: &[Part],
    append: &mut dyn FnMut(&[u8]) -> Result<(), CampaignError>,
) -> Result<(), CampaignError> {
    let mut sources = Vec::with_capacity(parts.len());
    for part in parts {
        let path = part.folder.rows_file();
        let failed = |error| CampaignError::file(&path, error);
        let mut source = BufReader::new(File::open(&path).map_err(failed)?);
        source.skip_until(b'\n').map_err(failed)?;
        sources.push((path, source));
    }
    let variants = plan.variants().len();
    let mut text = Vec::new();
    for _ in plan.scenarios() {
        for robot in 0..plan.robots {
            let turn = usize::try_from(robot % sources.len() as u64).unwrap_or(0);
            let (path, source) = &mut sources[turn];
            text.clear();
            for _ in 0..variants {
                let read = source.read_until(b'\n', &mut text);
                if read.map_err(|error| CampaignError::file(path, error))? == 0 {
                    let cause = "the rows end too early";
                    return Err(CampaignError::folder(
                        path,
                        cause,
                        "run this shard once more",
                    ));
                }
            }
            append(&text)?;
        }
    }
    Ok(())
}

/// Of each case, added up over the shards.
fn times(parts: &[Part]) -> (Vec<u64>, Vec<f64>) {
    let mut calibrations = Vec::new();
    let mut seconds = Vec::new();
    for part in parts {
        let record = &part.folder.record;
        calibrations.resize(record.calibrations.len(), 0);
        seconds.resize(record.seconds.len(), 0.0);
        for (sum, value) in calibrations.iter_mut().zip(&record.calibrations) {
            *sum += value;
        }
        for (sum, value) in seconds.iter_mut().zip(&record.seconds) {
            *sum += value;
        }
    }
    (calibrations, seconds)
}
