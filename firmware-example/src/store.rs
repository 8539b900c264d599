//! The parameters in flash: written whole or not at all.

use crate::Number;
use core::fmt;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal::{Arm, GeometryError, Real, Robot};
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

/// The sets and what they are sets of.
#[derive(Serialize, Deserialize)]
struct Record<T> {
    version: u8,
    /// Bytes of a number.
    number: u8,
    /// Fingerprint of the nominal robot: another robot's parameters are useless.
    nominal: u32,
    sets: Sets<T>,
}

/// Why parameters were not stored, or not found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
#[non_exhaustive]
pub enum StoreError {
    /// The flash region is no whole number of pages, or fewer than two.
    Region,
    /// The flash failed, or holds nothing whole.
    Flash,
    /// What is stored is damaged, of another version or another robot's.
    Record,
    /// What was written did not read back the same.
    ReadBack,
}

impl fmt::Display for StoreError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Region => "the flash region is not two pages or more",
            Self::Flash => "the flash failed or holds nothing whole",
            Self::Record => "the stored parameters are damaged or another robot's",
            Self::ReadBack => "the stored parameters did not read back",
        })
    }
}

impl core::error::Error for StoreError {}

/// The store in a region of NOR flash.
#[derive(Debug)]
pub(crate) struct Store<F> {
    flash: F,
    nominal: u32,
}

impl<F: NorFlash> Store<F> {
    pub(crate) const fn new(flash: F, nominal: u32) -> Self {
        Self { flash, nominal }
    }

    pub(crate) fn into_flash(self) -> F {
        self.flash
    }

    /// What is stored, every number of it valid; `None` if nothing ever was.
    pub(crate) fn load<T: Number>(&mut self) -> Result<Option<Sets<T>>, StoreError> {
        if self.blank()? {
            return Ok(None);
        }
        let mut buffer = [0; LARGEST];
        let bytes = self.fetch(&mut buffer)?.ok_or(StoreError::Flash)?;
        let sets = self.decode::<T>(bytes).ok_or(StoreError::Record)?;
        for arms in [sets.current, sets.previous].iter().flatten() {
            robot(arms).map_err(|_| StoreError::Record)?;
        }
        Ok(Some(sets))
    }

    /// Stores both sets and reads them back.
    pub(crate) fn save<T: Number>(&mut self, sets: &Sets<T>) -> Result<(), StoreError> {
        let mut written = [0; LARGEST];
        let written = self
            .encode(sets, &mut written)
            .ok_or(StoreError::ReadBack)?;
        let mut buffer = [0; LARGEST];
        block_on(self.map()?.store_item(&mut buffer, &KEY, &written))
            .map_err(|_| StoreError::Flash)?;
        match self.fetch(&mut buffer)? {
            Some(read) if read == written => Ok(()),
            _ => Err(StoreError::ReadBack),
        }
    }

    fn map(&mut self) -> Result<MapStorage<u8, &mut F, impl CacheImpl<u8>>, StoreError> {
        let length = u32::try_from(self.flash.capacity()).map_err(|_| StoreError::Region)?;
        let config = MapConfig::try_new(0..length).map_err(|_| StoreError::Region)?;
        Ok(MapStorage::new(
            &mut self.flash,
            config,
            Cache::new_uncached(),
        ))
    }

    fn fetch<'b>(&mut self, buffer: &'b mut [u8]) -> Result<Option<&'b [u8]>, StoreError> {
        block_on(self.map()?.fetch_item(buffer, &KEY)).map_err(|_| StoreError::Flash)
    }

    /// Whether nothing was ever written.
    fn blank(&mut self) -> Result<bool, StoreError> {
        let length = u32::try_from(self.flash.capacity()).map_err(|_| StoreError::Region)?;
        let mut chunk = [0; CHUNK];
        for offset in (0..length).step_by(CHUNK) {
            block_on(self.flash.read(offset, &mut chunk)).map_err(|_| StoreError::Flash)?;
            if chunk.iter().any(|byte| *byte != ERASED) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn encode<'b, T: Number>(&self, sets: &Sets<T>, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let record = Record {
            version: VERSION,
            number: number_size::<T>(),
            nominal: self.nominal,
            sets: *sets,
        };
        let length = postcard::to_slice(&record, buffer).ok()?.len();
        let checksum = checksum(buffer.get(..length)?).to_le_bytes();
        buffer
            .get_mut(length..length + CHECKSUM)?
            .copy_from_slice(&checksum);
        buffer.get(..length + CHECKSUM)
    }

    fn decode<T: Number>(&self, bytes: &[u8]) -> Option<Sets<T>> {
        let (record, sent) = bytes.split_last_chunk::<CHECKSUM>()?;
        if checksum(record) != u32::from_le_bytes(*sent) {
            return None;
        }
        let (record, rest) = postcard::take_from_bytes::<Record<T>>(record).ok()?;
        let ours = record.version == VERSION
            && record.number == number_size::<T>()
            && record.nominal == self.nominal
            && rest.is_empty();
        ours.then_some(record.sets)
    }
}

/// The robot of these parameters, if they are a robot's.
pub(crate) fn robot<T: Real>(arms: &[[T; 8]; 3]) -> Result<Robot<T>, GeometryError> {
    let [first, second, third] = *arms;
    Robot::new([Arm::new(first)?, Arm::new(second)?, Arm::new(third)?])
}

#[allow(clippy::cast_possible_truncation)] // 4 or 8
const fn number_size<T>() -> u8 {
    size_of::<T>() as u8
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}
