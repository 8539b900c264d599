//! The folder of a campaign: what is in it, whether it is this campaign's, and what of it can be
//! trusted.
//!
//! Rows are appended to `robots.csv.partial`. Every second `run.json` records how many bytes of it
//! are on the disk, and their checksum; whatever lies behind those bytes is dropped when the
//! campaign goes on. At the end the file becomes `robots.csv`.

use super::CampaignError;
use super::plan::{Plan, Shard};
use super::row::{cases, columns};
use crate::files::output;
use crc::{CRC_64_XZ, Crc, Digest};
use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// One row a robot and variant.
pub const ROBOTS: &str = "robots.csv";
/// One row a case.
pub const SUMMARY: &str = "summary.csv";
/// One row a case and parameter, if the plan asks for it.
pub const PARAMETERS: &str = "parameters.csv";
/// Wall-clock times, which are no two runs' the same.
pub const TIMING: &str = "timing.csv";
/// The campaign.
pub const PLAN: &str = "plan.toml";
const PLAN_ROBOT: &str = "plan-robot.toml";
const PARTIAL: &str = "robots.csv.partial";
const RECORD: &str = "run.json";
const LOCK: &str = ".delta-cal.lock";

const FORCE: &str = "give another folder, or use --force to delete what is there and start from \
                     the beginning";

static CHECKSUM: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// What of a campaign is on the disk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Record {
    pub(super) shard: String,
    /// Finished robots of all scenarios, each with all its rows.
    pub(super) robots: u64,
    bytes: u64,
    crc64: String,
    pub(super) complete: bool,
    /// Of each case: calibrations, and how long they took together.
    pub(super) calibrations: Vec<u64>,
    pub(super) seconds: Vec<f64>,
}

impl Record {
    fn empty(plan: &Plan, shard: Shard) -> Self {
        let cases = cases(plan).len();
        Self {
            shard: shard.to_string(),
            robots: 0,
            bytes: 0,
            crc64: format!("{:016x}", CHECKSUM.digest().finalize()),
            complete: false,
            calibrations: vec![0; cases],
            seconds: vec![0.0; cases],
        }
    }
}

/// A campaign's folder, and the rows on their way into it.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    /// Held until the folder is dropped.
    _lock: File,
    pub(super) record: Record,
}

/// The unfinished rows of a folder.
pub(super) struct Rows<'a> {
    folder: &'a mut Folder,
    file: File,
    digest: Digest<'static, u64>,
}

impl Folder {
    /// Opens the folder of a campaign, or makes it.
    pub(super) fn open(
        path: &Path,
        plan: &Plan,
        shard: Shard,
        force: bool,
    ) -> Result<Self, CampaignError> {
        fs::create_dir_all(path).map_err(|error| CampaignError::file(path, error))?;
        let lock = lock(path)?;
        if force {
            for name in [
                RECORD, ROBOTS, PARTIAL, SUMMARY, PARAMETERS, TIMING, PLAN, PLAN_ROBOT,
            ] {
                remove(&path.join(name))?;
            }
        }
        let record = match record_of(path, plan, shard)? {
            Some(record) => record,
            None => begin(path, plan, shard)?,
        };
        Ok(Self {
            path: path.to_owned(),
            _lock: lock,
            record,
        })
    }

    /// Opens the folder of a shard that is complete.
    pub(super) fn of_shard(path: &Path) -> Result<Self, CampaignError> {
        let incomplete = || {
            CampaignError::folder(
                path,
                "is not the folder of a finished shard",
                "run `delta-cal simulate --shard` with this folder to its end first",
            )
        };
        if !path.join(RECORD).is_file() {
            return Err(incomplete());
        }
        let lock = lock(path)?;
        let record = read_record(path)?.filter(|record| record.complete);
        Ok(Self {
            path: path.to_owned(),
            _lock: lock,
            record: record.ok_or_else(incomplete)?,
        })
    }

    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The file with the rows, finished or not.
    pub(super) fn rows_file(&self) -> PathBuf {
        self.file(if self.record.complete {
            ROBOTS
        } else {
            PARTIAL
        })
    }

    /// Whether another folder holds shards of the same campaign.
    pub(super) fn same_campaign(&self, other: &Self) -> Result<bool, CampaignError> {
        for name in [PLAN, PLAN_ROBOT] {
            if read(&self.file(name))? != read(&other.file(name))? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The file to which rows are appended, after those that can be trusted.
    pub(super) fn rows(&mut self, plan: &Plan) -> Result<Rows<'_>, CampaignError> {
        let path = self.file(PARTIAL);
        let failed = |error| CampaignError::file(&path, error);
        if !path.exists() && self.file(ROBOTS).exists() {
            // It was stopped between the last two steps.
            fs::rename(self.file(ROBOTS), &path).map_err(failed)?;
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(failed)?;
        let digest = digest_of(&mut file, self.record.bytes).map_err(failed)?;
        let intact = digest.clone().finalize() == self.checksum();
        if !intact {
            let cause = format!(
                "{PARTIAL} was changed after delta-cal wrote it: its checksum \
                                 differs"
            );
            return Err(CampaignError::folder(&self.path, cause, FORCE));
        }
        file.set_len(self.record.bytes).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let mut rows = Rows {
            folder: self,
            file,
            digest,
        };
        if rows.folder.record.bytes == 0 {
            rows.write((columns(plan).join(",") + "\n").as_bytes())?;
        }
        Ok(rows)
    }

    /// Forgets rows that an unfinished run left.
    pub(super) fn restart(&mut self, plan: &Plan) -> Result<(), CampaignError> {
        remove(&self.file(PARTIAL))?;
        remove(&self.file(RECORD))?;
        self.record = Record::empty(plan, Shard::WHOLE);
        Ok(())
    }

    fn checksum(&self) -> u64 {
        u64::from_str_radix(&self.record.crc64, 16).unwrap_or_default()
    }

    /// Whether the finished rows are as they were written.
    pub(super) fn verify(&self) -> Result<(), CampaignError> {
        let path = self.rows_file();
        let failed = |error| CampaignError::file(&path, error);
        let mut file = File::open(&path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let digest = digest_of(&mut file, self.record.bytes).map_err(failed)?;
        if length == self.record.bytes && digest.finalize() == self.checksum() {
            return Ok(());
        }
        let cause = format!("{ROBOTS} was changed after delta-cal wrote it: its checksum differs");
        Err(CampaignError::folder(&self.path, cause, FORCE))
    }

    /// The rows are complete; the tables that follow from them are written, and the rows get their
    /// name.
    pub(super) fn finish(&mut self, tables: &[(&str, String)]) -> Result<(), CampaignError> {
        let (robots, partial) = (self.file(ROBOTS), self.file(PARTIAL));
        let paths: Vec<_> = tables.iter().map(|(name, _)| self.file(name)).collect();
        let texts = tables.iter().map(|(_, text)| text.as_str());
        let files: Vec<_> = paths.iter().map(PathBuf::as_path).zip(texts).collect();
        output::write_all(&files)?;
        fs::rename(&partial, &robots).map_err(|error| CampaignError::file(&robots, error))?;
        self.record.complete = true;
        self.write_record()
    }

    fn write_record(&self) -> Result<(), CampaignError> {
        let path = self.file(RECORD);
        let text = serde_json::to_string_pretty(&self.record)
            .map_err(|error| CampaignError::file(&path, error))?;
        Ok(output::write_all(&[(&path, &(text + "\n"))])?)
    }
}

impl Rows<'_> {
    /// The rows of the next robot, and what each calibration took; `first` is the index of the
    /// first variant's case.
    pub(super) fn append(
        &mut self,
        text: &[u8],
        first: usize,
        times: &[Duration],
    ) -> Result<(), CampaignError> {
        self.write(text)?;
        let record = &mut self.folder.record;
        record.robots += 1;
        for (index, time) in times.iter().enumerate() {
            if let Some(seconds) = record.seconds.get_mut(first + index) {
                *seconds += time.as_secs_f64();
            }
            if let Some(calibrations) = record.calibrations.get_mut(first + index) {
                *calibrations += 1;
            }
        }
        Ok(())
    }

    fn write(&mut self, text: &[u8]) -> Result<(), CampaignError> {
        self.file
            .write_all(text)
            .map_err(|error| CampaignError::file(&self.folder.file(PARTIAL), error))?;
        self.digest.update(text);
        self.folder.record.bytes += text.len() as u64;
        Ok(())
    }

    pub(super) const fn robots(&self) -> u64 {
        self.folder.record.robots
    }

    /// Times that were measured elsewhere.
    pub(super) fn set_times(&mut self, calibrations: Vec<u64>, seconds: Vec<f64>) {
        self.folder.record.calibrations = calibrations;
        self.folder.record.seconds = seconds;
    }

    /// What was appended will be there after a crash.
    pub(super) fn checkpoint(&mut self) -> Result<(), CampaignError> {
        self.file
            .sync_data()
            .map_err(|error| CampaignError::file(&self.folder.file(PARTIAL), error))?;
        self.folder.record.crc64 = format!("{:016x}", self.digest.clone().finalize());
        self.folder.write_record()
    }
}

/// Of the first `length` bytes, or of the whole file if it is shorter.
fn digest_of(file: &mut File, length: u64) -> std::io::Result<Digest<'static, u64>> {
    let mut digest = CHECKSUM.digest();
    let mut buffer = vec![0; 1 << 16];
    let mut rest = file.take(length);
    loop {
        match rest.read(&mut buffer)? {
            0 => return Ok(digest),
            count => digest.update(&buffer[..count]),
        }
    }
}

fn lock(folder: &Path) -> Result<File, CampaignError> {
    let path = folder.join(LOCK);
    let failed = |error| CampaignError::file(&path, error);
    let file = OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(false)
        .open(&path)
        .map_err(failed)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(CampaignError::folder(
            folder,
            "another delta-cal is working in this folder",
            "wait until it ends, or give another folder",
        )),
        // Some parallel file systems have no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

fn read(path: &Path) -> Result<String, CampaignError> {
    fs::read_to_string(path).map_err(|error| CampaignError::file(path, error))
}

fn remove(path: &Path) -> Result<(), CampaignError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(CampaignError::file(path, error))
        }
        _ => Ok(()),
    }
}

/// What is recorded of this campaign; `None` in a folder without one. Another campaign is refused.
fn record_of(path: &Path, plan: &Plan, shard: Shard) -> Result<Option<Record>, CampaignError> {
    let other = |cause: String| Err(CampaignError::folder(path, cause, FORCE));
    if !path.join(PLAN).exists() {
        let foreign = [
            ROBOTS, PARTIAL, SUMMARY, PARAMETERS, TIMING, RECORD, PLAN_ROBOT,
        ]
        .into_iter()
        .find(|name| path.join(name).exists());
        return match foreign {
            Some(name) => other(format!(
                "the folder holds a {name} that is not of this campaign"
            )),
            None => Ok(None),
        };
    }
    let texts = [
        (PLAN, plan.to_toml(PLAN_ROBOT)),
        (PLAN_ROBOT, plan.robot_toml()),
    ];
    for (name, expected) in texts {
        let found = read(&path.join(name))?;
        if found != expected {
            let differs = found
                .lines()
                .map(Some)
                .chain(std::iter::repeat(None))
                .zip(expected.lines())
                .find(|(found, expected)| *found != Some(expected))
                .and_then(|(found, _)| found)
                .map_or_else(String::new, |line| format!(" (`{}`)", line.trim()));
            return other(format!(
                "the folder holds another campaign: {name} there differs{differs}"
            ));
        }
    }
    let Some(record) = read_record(path)? else {
        return Ok(None);
    };
    if record.shard != shard.to_string() {
        return other(format!(
            "the folder holds shard {} of this campaign, not {shard}",
            record.shard
        ));
    }
    Ok(Some(record))
}

fn read_record(path: &Path) -> Result<Option<Record>, CampaignError> {
    let file = path.join(RECORD);
    if !file.exists() {
        return Ok(None);
    }
    serde_json::from_str(&read(&file)?)
        .map(Some)
        .map_err(|error| {
            let cause = format!("{RECORD} is not the record of a campaign: {error}");
            CampaignError::folder(path, cause, FORCE)
        })
}

fn begin(path: &Path, plan: &Plan, shard: Shard) -> Result<Record, CampaignError> {
    // Rows without a record cannot be trusted.
    remove(&path.join(PARTIAL))?;
    output::write_all(&[
        (&path.join(PLAN_ROBOT), &plan.robot_toml()),
        (&path.join(PLAN), &plan.to_toml(PLAN_ROBOT)),
    ])?;
    Ok(Record::empty(plan, shard))
}
