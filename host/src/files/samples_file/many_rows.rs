//! More rows than are kept in memory: all of them in a temporary file, and some of them in memory, chosen
//! evenly over the file.

use super::row::Row;
use crate::files::input_error::InputError;
use crate::geometry::directions::Directions;
use delta_cal::Sample;
use nalgebra::Vector3;
use std::convert::Infallible;
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
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

/// The rows, or those that were chosen of many and where all are.
type Collected = (Vec<Row<Sample<f64>>>, Option<ManyRows>);

/// Takes rows in one after the other, in memory as long as they are not too many.
pub(super) struct RowCollector {
    rows: Vec<Row<Sample<f64>>>,
    overflow: Option<Overflow>,
}

struct Overflow {
    writer: BufWriter<File>,
    count: usize,
    selection: Selection,
    directions: Directions,
}

impl RowCollector {
    pub(super) const fn new() -> Self {
        Self {
            rows: Vec::new(),
            overflow: None,
        }
    }

    pub(super) fn push(&mut self, row: Row<Sample<f64>>) -> io::Result<()> {
        match &mut self.overflow {
            Some(overflow) => overflow.push(row),
            None if self.rows.len() < MOST_IN_MEMORY => {
                self.rows.push(row);
                Ok(())
            }
            None => {
                let mut overflow = Overflow {
                    writer: BufWriter::with_capacity(RECORD * PART, tempfile::tempfile()?),
                    count: 0,
                    selection: Selection::new(),
                    directions: Directions::default(),
                };
                for row in std::mem::take(&mut self.rows).into_iter().chain([row]) {
                    overflow.push(row)?;
                }
                self.overflow = Some(overflow);
                Ok(())
            }
        }
    }

    pub(super) fn finish(self) -> io::Result<Collected> {
        let Some(overflow) = self.overflow else {
            return Ok((self.rows, None));
        };
        let file = overflow.writer.into_inner().map_err(io::Error::from)?;
        let (rows, chosen) = overflow.selection.chosen.into_iter().unzip();
        let many = ManyRows {
            file: Arc::new(Mutex::new(file)),
            count: overflow.count,
            moved_by: Vector3::zeros(),
            chosen: Arc::new(chosen),
            fault: Arc::default(),
        };
        Ok((rows, Some(many)))
    }
}

impl Overflow {
    fn push(&mut self, row: Row<Sample<f64>>) -> io::Result<()> {
        let [x, y, z] = row.value.position.data.0[0];
        let [q1, q2, q3] = row.value.joints;
        self.writer.write_all(&row.line.to_le_bytes())?;
        for number in [q1, q2, q3, x, y, z] {
            self.writer.write_all(&number.to_le_bytes())?;
        }
        let chosen = Chosen {
            index: self.count,
            directions: self.directions.next(&row.value.joints),
        };
        self.count += 1;
        self.selection.push((row, chosen));
        Ok(())
    }
}

/// One row of each stretch of equally many, any with the same chance: rows that come again every so often are not
/// all left out, nor all taken.
struct Selection {
    chosen: Vec<(Row<Sample<f64>>, Chosen)>,
    /// Rows of a stretch.
    stretch: u32,
    /// Rows of the last one, so far.
    of_last: u32,
    random: u32,
}

impl Selection {
    fn new() -> Self {
        Self {
            chosen: Vec::with_capacity(MOST_IN_MEMORY),
            stretch: 1,
            of_last: 0,
            random: 0x9e37_79b9,
        }
    }

    fn push(&mut self, row: (Row<Sample<f64>>, Chosen)) {
        if self.of_last == 0 {
            if self.chosen.len() == MOST_IN_MEMORY {
                self.halve();
            }
            self.chosen.push(row);
        } else if self.below(self.of_last + 1) == 0
            && let Some(last) = self.chosen.last_mut()
        {
            *last = row;
        }
        self.of_last = (self.of_last + 1) % self.stretch;
    }

    /// One of each two.
    fn halve(&mut self) {
        for pair in 0..self.chosen.len() / 2 {
            let either = usize::from(self.below(2) == 1);
            self.chosen[pair] = self.chosen[2 * pair + either];
        }
        self.chosen.truncate(MOST_IN_MEMORY / 2);
        self.stretch *= 2;
    }

    /// A number below `bound`, all alike: Marsaglia's xorshift (2003).
    fn below(&mut self, bound: u32) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        ((u64::from(self.random) * u64::from(bound)) >> 32) as u32
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
