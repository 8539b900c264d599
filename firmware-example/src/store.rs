//! The parameters in flash: written whole or not at all.

use crate::Number;
use core::ops::Range;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal::Robot;
use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use serde::{Deserialize, Serialize};

/// Version of the stored record.
const VERSION: u8 = 2;
const CHECKSUM: usize = 4;
/// Bytes that are written together: a whole number of any flash's units.
const CHUNK: usize = 64;
/// Bytes for a record in whole chunks; in `f64` it has 2 × 24 numbers and some twenty bytes.
const LARGEST: usize = 7 * CHUNK;
const ERASED: u8 = 0xff;

/// Eight parameters for each arm; `None` is the robot as drawn.
pub(crate) type Geometry<T> = Option<[[T; 8]; 3]>;

/// What is stored: the parameters in use, and those before the last calibration was applied.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sets<T> {
    pub(crate) current: Geometry<T>,
    pub(crate) previous: Geometry<T>,
}

/// What a start finds.
#[derive(Debug)]
pub(crate) struct Loaded<T> {
    pub(crate) sets: Sets<T>,
    /// Whether that is surely the newest: no half is damaged or unreadable, and none lost a record.
    pub(crate) complete: bool,
}

/// The sets and what they are sets of.
#[derive(Serialize, Deserialize)]
struct Record<T> {
    version: u8,
    /// Bytes of a number.
    number: u8,
    /// Fingerprint of the nominal robot: another robot's parameters are useless.
    nominal: u32,
    /// Counts up, and around; the newest is in use.
    generation: u32,
    sets: Sets<T>,
}

/// Why parameters were not stored, or not found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub(crate) enum StoreError {
    /// The flash region is not two halves of whole pages, each with room for a record.
    Region,
    /// The flash failed.
    Flash,
    /// What is stored is damaged, of another version or another robot's.
    Record,
    /// What was written did not read back the same.
    ReadBack,
}

/// The store in a region of NOR flash: two halves, written in turn, each erased before.
///
/// A half holds one record, at its beginning. The next record is written to the half that does not
/// hold the newest one: whatever a power cut makes of the half that is being erased or written, the
/// newest record is not in it. And no older record is left behind the newest in the same half, which
/// could come back in its place if the newest is damaged.
#[derive(Debug)]
pub(crate) struct Store<F> {
    flash: F,
    nominal: u32,
    /// What the lower and the upper half hold: a record of this generation, nothing, or what is no use.
    /// [`StoreError::Flash`] is not known, because it could not be read.
    halves: [Result<Option<u32>, StoreError>; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Half {
    Lower,
    Upper,
}

impl Half {
    const BOTH: [Self; 2] = [Self::Lower, Self::Upper];

    const fn other(self) -> Self {
        match self {
            Self::Lower => Self::Upper,
            Self::Upper => Self::Lower,
        }
    }
}

impl<F: NorFlash> Store<F> {
    pub(crate) const fn new(flash: F, nominal: u32) -> Self {
        const {
            assert!(
                CHUNK.is_multiple_of(F::WRITE_SIZE) && CHUNK.is_multiple_of(F::READ_SIZE),
                "64 bytes must be a whole number of what the flash reads and writes at once"
            );
        }
        Self {
            flash,
            nominal,
            halves: [Err(StoreError::Flash); 2],
        }
    }

    pub(crate) fn into_flash(self) -> F {
        self.flash
    }

    /// The newest record's number, 0 without one: it counts up with every change.
    pub(crate) fn generation(&self) -> u32 {
        self.newest().map_or(0, |(_, generation)| generation)
    }

    fn newest(&self) -> Option<(Half, u32)> {
        match self.halves.map(|half| half.ok().flatten()) {
            [None, None] => None,
            [Some(lower), None] => Some((Half::Lower, lower)),
            [Some(lower), Some(upper)] if follows(lower, upper) => Some((Half::Lower, lower)),
            [_, Some(upper)] => Some((Half::Upper, upper)),
        }
    }

    /// What is stored, every number of it valid; `None` if nothing ever was. Writes nothing.
    pub(crate) fn load<T: Number>(&mut self) -> Result<Option<Loaded<T>>, StoreError> {
        let lower = self.look(Half::Lower);
        let upper = self.look(Half::Upper);
        let complete = match self.halves {
            // The halves are written in turn: with a gap between them a record is lost.
            [Ok(Some(lower)), Ok(Some(upper))] => {
                matches!(lower.wrapping_sub(upper), 1 | u32::MAX)
            }
            [lower, upper] => lower.is_ok() && upper.is_ok(),
        };
        let newest = match self.newest() {
            Some((Half::Lower, _)) => lower,
            Some((Half::Upper, _)) => upper,
            None => lower.and(upper),
        };
        Ok(newest?.map(|Record { sets, .. }| Loaded { sets, complete }))
    }

    /// Stores both sets and reads them back.
    #[inline(never)]
    pub(crate) fn save<T: Number>(&mut self, sets: &Sets<T>) -> Result<(), StoreError> {
        // What could not be read before may have failed for a moment only.
        for half in Half::BOTH {
            if self.unread(half) {
                let _ = self.look::<T>(half);
            }
        }
        let half = match self.newest() {
            Some((newest, _)) => newest.other(),
            None if !self.unread(Half::Lower) => Half::Lower,
            None if !self.unread(Half::Upper) => Half::Upper,
            // What is there may be good, and the newest.
            None => return Err(StoreError::Flash),
        };
        let stored = self.replace(half, sets);
        if stored.is_err() {
            // It may be there in spite of the error: what was refused must not be in use after a restart.
            let _ = self.erase(half);
        }
        stored
    }

    fn unread(&self, half: Half) -> bool {
        self.halves[half as usize] == Err(StoreError::Flash)
    }

    /// Puts a record in place of what the half holds.
    fn replace<T: Number>(&mut self, half: Half, sets: &Sets<T>) -> Result<(), StoreError> {
        let generation = self.generation().wrapping_add(1);
        self.write(half, sets, generation)?;
        match self.look::<T>(half) {
            Ok(Some(record)) if record.generation == generation && record.sets == *sets => {}
            Ok(_) | Err(StoreError::Record) => return Err(StoreError::ReadBack),
            Err(error) => return Err(error),
        }
        let other = half.other();
        match self.halves[other as usize] {
            Ok(_) => Ok(()),
            // The next start would take rubbish for a lost record, and what it can read again may be
            // of a higher generation.
            Err(_) => self.erase(other),
        }
    }

    /// Finds out what a half holds.
    #[inline(never)]
    fn look<T: Number>(&mut self, half: Half) -> Result<Option<Record<T>>, StoreError> {
        let found = self.read(half);
        self.halves[half as usize] = match &found {
            Ok(record) => Ok(record.as_ref().map(|record| record.generation)),
            Err(error) => Err(*error),
        };
        found
    }

    fn read<T: Number>(&mut self, half: Half) -> Result<Option<Record<T>>, StoreError> {
        let start = self.range(half)?.start;
        let mut bytes = [0; LARGEST];
        block_on(self.flash.read(start, &mut bytes)).map_err(|_| StoreError::Flash)?;
        if bytes.iter().all(|byte| *byte == ERASED) {
            return Ok(None);
        }
        self.decode(&bytes).map(Some).ok_or(StoreError::Record)
    }

    #[inline(never)]
    fn write<T: Number>(
        &mut self,
        half: Half,
        sets: &Sets<T>,
        generation: u32,
    ) -> Result<(), StoreError> {
        let mut bytes = [ERASED; LARGEST];
        let length = self
            .encode(sets, generation, &mut bytes)
            .ok_or(StoreError::Record)?;
        self.erase(half)?;
        let start = self.range(half)?.start;
        for (chunk, offset) in bytes.chunks(CHUNK).zip((start..).step_by(CHUNK)) {
            if ((offset - start) as usize) < length {
                block_on(self.flash.write(offset, chunk)).map_err(|_| StoreError::Flash)?;
            }
        }
        Ok(())
    }

    fn erase(&mut self, half: Half) -> Result<(), StoreError> {
        let Range { start, end } = self.range(half)?;
        // Until it has been looked at again.
        self.halves[half as usize] = Err(StoreError::Flash);
        block_on(self.flash.erase(start, end)).map_err(|_| StoreError::Flash)?;
        self.halves[half as usize] = Ok(None);
        Ok(())
    }

    fn range(&self, half: Half) -> Result<Range<u32>, StoreError> {
        let capacity = u32::try_from(self.flash.capacity()).map_err(|_| StoreError::Region)?;
        let length = capacity / 2;
        let pages = (length as usize).is_multiple_of(F::ERASE_SIZE);
        if !pages || (length as usize) < LARGEST {
            return Err(StoreError::Region);
        }
        Ok(match half {
            Half::Lower => 0..length,
            Half::Upper => length..2 * length,
        })
    }

    /// The record's bytes and its checksum; how many.
    fn encode<T: Number>(
        &self,
        sets: &Sets<T>,
        generation: u32,
        buffer: &mut [u8],
    ) -> Option<usize> {
        let record = Record {
            version: VERSION,
            number: number_size::<T>(),
            nominal: self.nominal,
            generation,
            sets: *sets,
        };
        let length = postcard::to_slice(&record, buffer).ok()?.len();
        let checksum = checksum(buffer.get(..length)?).to_le_bytes();
        let end = length + CHECKSUM;
        buffer.get_mut(length..end)?.copy_from_slice(&checksum);
        Some(end)
    }

    /// A whole record of this robot, every number of it valid; erased bytes follow it.
    fn decode<T: Number>(&self, bytes: &[u8]) -> Option<Record<T>> {
        let (record, rest) = postcard::take_from_bytes::<Record<T>>(bytes).ok()?;
        let content = bytes.get(..bytes.len() - rest.len())?;
        if checksum(content).to_le_bytes() != *rest.first_chunk::<CHECKSUM>()? {
            return None;
        }
        let ours = record.version == VERSION
            && record.number == number_size::<T>()
            && record.nominal == self.nominal;
        let valid = [record.sets.current, record.sets.previous]
            .iter()
            .flatten()
            .all(|arms| Robot::from_parameters(*arms).is_ok());
        (ours && valid).then_some(record)
    }
}

/// Whether one generation is newer than another: it is ahead of it by less than half of all there are.
const fn follows(generation: u32, other: u32) -> bool {
    generation.wrapping_sub(other).cast_signed() > 0
}

#[allow(clippy::cast_possible_truncation)] // 4 or 8
const fn number_size<T>() -> u8 {
    size_of::<T>() as u8
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}
