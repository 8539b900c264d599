//! More rows than are kept in memory: all of them in a temporary file, and some of them in memory, chosen
//! evenly over the file.

use super::row::Row;
use crate::files::input_error::InputError;
use delta_cal::Sample;
use nalgebra::Vector3;
use std::convert::Infallible;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Files with more rows are kept on disk.
pub const MOST_IN_MEMORY: usize = 20_000;
/// A line and six numbers.
const NUMBERS: usize = 7;
const RECORD: usize = 8 * NUMBERS;
/// Rows that are read at once.
const PART: usize = 4096;

/// All rows of a file, in a temporary file that is gone with the last copy of this.
#[derive(Debug, Clone)]
pub struct ManyRows {
    file: Arc<Mutex<File>>,
    count: usize,
    /// What every position is moved by.
    moved_by: Vector3<f64>,
    /// The places of the rows that are kept in memory as well.
    chosen: Arc<Vec<Chosen>>,
    /// The first error in reading the temporary file.
    fault: Arc<OnceLock<String>>,
}

/// The place of a row among all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) index: usize,
    /// The direction of each joint's last move.
    pub(crate) directions: [f64; 3],
}

impl PartialEq for ManyRows {
    /// Whether they are of the same file.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.file, &other.file) && self.moved_by == other.moved_by
    }
}

impl ManyRows {
    /// How many there are.
    pub const fn count(&self) -> usize {
        self.count
    }

    /// The places of the rows that are kept in memory as well.
    pub(crate) fn chosen(&self) -> &[Chosen] {
        &self.chosen
    }

    /// With every position moved.
    #[must_use]
    pub(crate) fn moved(mut self, by: &Vector3<f64>) -> Self {
        self.moved_by += by;
        self
    }

    /// Every row, one after the other.
    pub fn each(&self, mut take: impl FnMut(&Row<Sample<f64>>)) {
        let Ok(()) = self.each_part(|_, rows| {
            rows.iter().for_each(&mut take);
            Ok::<_, Infallible>(())
        });
    }

    /// Every row, some thousand at a time, with the index of the first of them. Where the temporary file cannot
    /// be read this ends early, and [`fault`](Self::fault) says so.
    ///
    /// # Errors
    /// The first error of `take`.
    pub(crate) fn each_part<E>(
        &self,
        mut take: impl FnMut(usize, &[Row<Sample<f64>>]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut rows = Vec::with_capacity(PART.min(self.count));
        let mut first = 0;
        while first < self.count {
            if let Err(error) = self.read(first, PART, &mut rows) {
                self.fault.get_or_init(|| error.to_string());
                return Ok(());
            }
            take(first, &rows)?;
            first += rows.len();
        }
        Ok(())
    }

    /// The line of the row at an index.
    pub(crate) fn line(&self, index: usize) -> Option<u64> {
        let mut rows = Vec::new();
        self.read(index, 1, &mut rows).ok()?;
        rows.first().map(|row| row.line)
    }

    fn read(&self, first: usize, most: usize, rows: &mut Vec<Row<Sample<f64>>>) -> io::Result<()> {
        rows.clear();
        let mut bytes = vec![0; RECORD * most.min(self.count.saturating_sub(first))];
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start((RECORD * first) as u64))?;
        file.read_exact(&mut bytes)?;
        let records = bytes.as_chunks::<8>().0.as_chunks::<NUMBERS>().0;
        rows.extend(records.iter().map(|[line, numbers @ ..]| {
            let [q1, q2, q3, x, y, z] = numbers.map(f64::from_le_bytes);
            Row {
                line: u64::from_le_bytes(*line),
                value: Sample {
                    joints: [q1, q2, q3],
                    position: Vector3::new(x, y, z) + self.moved_by,
                },
            }
        }));
        Ok(())
    }

    /// That the temporary file could not be read, if that happened.
    ///
    /// # Errors
    /// That.
    pub(crate) fn fault(&self, name: &str) -> Result<(), InputError> {
        match self.fault.get() {
            None => Ok(()),
            Some(error) => Err(unusable(name, "read", error)),
        }
    }
}

/// The temporary file cannot be written or read.
pub(super) fn unusable(name: &str, how: &str, error: &impl ToString) -> InputError {
    let cause = format!(
        "its rows are kept in a temporary file, which cannot be {how}: {}",
        error.to_string()
    );
    InputError::new(name, cause).with_remedy(
        "make room in the folder for temporary files, or choose another one with the environment variable TMPDIR",
    )
}
