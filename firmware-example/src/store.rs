//! The parameters in flash: written whole or not at all.

use crate::Number;
use crate::read_only::ReadOnly;
use core::ops::Range;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal::Robot;
use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, CacheImpl};
use sequential_storage::map::{MapConfig, MapStorage};
use serde::{Deserialize, Serialize};

/// Version of the stored record.
const VERSION: u8 = 1;
/// The one key: everything is one record, so that it changes at once.
const KEY: u8 = 1;
const CHECKSUM: usize = 4;
/// Bytes of a record in `f64`, key included: 2 × 24 numbers and some twenty bytes.
const LARGEST: usize = 432;
/// Looked at together when looking for anything at all; divides every page.
const CHUNK: usize = 64;
const ERASED: u8 = 0xff;

/// Eight parameters for each arm; `None` is the robot as drawn.
pub(crate) type Geometry<T> = Option<[[T; 8]; 3]>;

/// What is stored: the parameters in use and those before.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sets<T> {
    pub(crate) current: Geometry<T>,
    pub(crate) previous: Geometry<T>,
}

/// What a start finds.
#[derive(Debug)]
pub(crate) struct Loaded<T> {
    pub(crate) sets: Sets<T>,
    /// Whether that is surely the newest: no half is damaged, and none lost a record.
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
    /// The flash region is not two halves of two pages or more.
    Region,
    /// The flash failed, or holds nothing whole.
    Flash,
    /// What is stored is damaged, of another version or another robot's.
    Record,
    /// What was written did not read back the same.
    ReadBack,
}

/// The store in a region of NOR flash: two halves, written in turn.
///
/// The newest record lies in one half; the next one is written to the other. Whatever a power cut
/// makes of the half that is being written or erased, the newest record is not in it.
#[derive(Debug)]
pub(crate) struct Store<F> {
    flash: F,
    nominal: u32,
    /// The newest record's, and where it lies.
    generation: u32,
    newest: Half,
    /// Whether neither half holds anything but rubbish.
    rubbish: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Half {
    Lower,
    Upper,
}

impl Half {
    const fn other(self) -> Self {
        match self {
            Self::Lower => Self::Upper,
            Self::Upper => Self::Lower,
        }
    }
}

impl<F: NorFlash> Store<F> {
    pub(crate) const fn new(flash: F, nominal: u32) -> Self {
        Self {
            flash,
            nominal,
            generation: 0,
            newest: Half::Upper,
            rubbish: false,
        }
    }

    pub(crate) fn into_flash(self) -> F {
        self.flash
    }

    /// What is stored, every number of it valid; `None` if nothing ever was. Writes nothing.
    pub(crate) fn load<T: Number>(&mut self) -> Result<Option<Loaded<T>>, StoreError> {
        let mut newest: Option<Record<T>> = None;
        let mut complete = true;
        let mut fault = None;
        for half in [Half::Lower, Half::Upper] {
            if self.blank(half)? {
                continue;
            }
            match self.load_half::<T>(half) {
                Ok(record) => {
                    let (older, newer) = match &newest {
                        Some(found) if follows(found.generation, record.generation) => {
                            (Some(record.generation), found.generation)
                        }
                        other => {
                            self.newest = half;
                            (
                                other.as_ref().map(|found| found.generation),
                                record.generation,
                            )
                        }
                    };
                    // The halves are written in turn: with a gap between them a record is lost.
                    complete &= older.is_none_or(|older| older.wrapping_add(1) == newer);
                    if self.newest == half {
                        newest = Some(record);
                    }
                }
                Err(error) => fault = Some(error),
            }
        }
        match (newest, fault) {
            (None, None) => Ok(None),
            (None, Some(error)) => {
                self.rubbish = true;
                Err(error)
            }
            (Some(record), fault) => {
                self.generation = record.generation;
                Ok(Some(Loaded {
                    sets: record.sets,
                    complete: complete && fault.is_none(),
                }))
            }
        }
    }

    #[inline(never)]
    fn load_half<T: Number>(&mut self, half: Half) -> Result<Record<T>, StoreError> {
        let mut buffer = [0; LARGEST];
        let range = self.range(half)?;
        let bytes = fetch(ReadOnly(&mut self.flash), range, &mut buffer)?;
        self.decode::<T>(bytes).ok_or(StoreError::Record)
    }

    /// Stores both sets and reads them back.
    #[inline(never)]
    pub(crate) fn save<T: Number>(&mut self, sets: &Sets<T>) -> Result<(), StoreError> {
        let half = self.newest.other();
        let range = self.range(half)?;
        let generation = self.generation.wrapping_add(1);
        let mut buffer = [0; LARGEST];
        let record = self
            .encode(sets, generation, &mut buffer)
            .ok_or(StoreError::Record)?;
        let mut stored = write(&mut self.flash, range.clone(), record);
        if stored.is_err() {
            // What an earlier power cut left in this half may be beyond the map's own repair.
            block_on(self.flash.erase(range.start, range.end)).map_err(|_| StoreError::Flash)?;
            stored = write(&mut self.flash, range.clone(), record);
        }
        if stored.is_err() {
            // It may be there in spite of the error: what was refused must not be in use after a restart.
            let _ = block_on(self.flash.erase(range.start, range.end));
        }
        if stored.is_ok() {
            self.generation = generation;
            self.newest = half;
            if core::mem::take(&mut self.rubbish) {
                // Otherwise the next start would take it for a lost record.
                let other = self.range(half.other())?;
                let _ = block_on(self.flash.erase(other.start, other.end));
            }
        }
        stored
    }

    fn range(&self, half: Half) -> Result<Range<u32>, StoreError> {
        let length = u32::try_from(self.flash.capacity()).map_err(|_| StoreError::Region)?;
        Ok(match half {
            Half::Lower => 0..length / 2,
            Half::Upper => length / 2..length,
        })
    }

    /// Whether nothing is written there.
    fn blank(&mut self, half: Half) -> Result<bool, StoreError> {
        let range = self.range(half)?;
        let mut chunk = [0; CHUNK];
        for offset in range.step_by(CHUNK) {
            block_on(self.flash.read(offset, &mut chunk)).map_err(|_| StoreError::Flash)?;
            if chunk.iter().any(|byte| *byte != ERASED) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn encode<'b, T: Number>(
        &self,
        sets: &Sets<T>,
        generation: u32,
        buffer: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let record = Record {
            version: VERSION,
            number: number_size::<T>(),
            nominal: self.nominal,
            generation,
            sets: *sets,
        };
        let length = postcard::to_slice(&record, buffer).ok()?.len();
        let checksum = checksum(buffer.get(..length)?).to_le_bytes();
        buffer
            .get_mut(length..length + CHECKSUM)?
            .copy_from_slice(&checksum);
        buffer.get(..length + CHECKSUM)
    }

    /// A whole record of this robot, every number of it valid.
    fn decode<T: Number>(&self, bytes: &[u8]) -> Option<Record<T>> {
        let (record, sent) = bytes.split_last_chunk::<CHECKSUM>()?;
        if checksum(record) != u32::from_le_bytes(*sent) {
            return None;
        }
        let (record, rest) = postcard::take_from_bytes::<Record<T>>(record).ok()?;
        let ours = record.version == VERSION
            && record.number == number_size::<T>()
            && record.nominal == self.nominal
            && rest.is_empty();
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

/// A map over part of the flash.
fn map<F: NorFlash>(
    flash: F,
    range: Range<u32>,
) -> Result<MapStorage<u8, F, impl CacheImpl<u8>>, StoreError> {
    let config = MapConfig::try_new(range).map_err(|_| StoreError::Region)?;
    Ok(MapStorage::new(flash, config, Cache::new_uncached()))
}

fn fetch<F: NorFlash>(flash: F, range: Range<u32>, buffer: &mut [u8]) -> Result<&[u8], StoreError> {
    match block_on(map(flash, range)?.fetch_item(buffer, &KEY)) {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) | Err(_) => Err(StoreError::Flash),
    }
}

/// Writes a record and reads it back.
#[inline(never)]
fn write<F: NorFlash>(flash: &mut F, range: Range<u32>, record: &[u8]) -> Result<(), StoreError> {
    let mut buffer = [0; LARGEST];
    block_on(map(&mut *flash, range.clone())?.store_item(&mut buffer, &KEY, &record))
        .map_err(|_| StoreError::Flash)?;
    if fetch(flash, range, &mut buffer)? == record {
        Ok(())
    } else {
        Err(StoreError::ReadBack)
    }
}

#[allow(clippy::cast_possible_truncation)] // 4 or 8
const fn number_size<T>() -> u8 {
    size_of::<T>() as u8
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}
