//! One record in flash, written entirely or not at all.

use core::ops::Range;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use delta_cal_protocol::{Reader, Wire, Writer};
use embedded_storage::nor_flash::NorFlash;

/// Bytes written together: a multiple of any flash's write unit.
const CHUNK: usize = 64;
/// Mark, generation and length of the content, four bytes each. A checksum follows the content.
const HEADER: usize = 12;
const CHECKSUM: usize = 4;
const ERASED: u8 = 0xff;

/// Without a table, which would take a kilobyte: records are short.
static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why a record was not stored or not found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(target_os = "none", feature = "defmt"), derive(defmt::Format))]
pub enum StoreError {
    /// The flash region is not two halves of whole pages, each with room for a record.
    Region,
    /// The flash failed.
    Flash,
    /// The stored record is damaged, or does not read back as written.
    Record,
    /// The stored record is whole and has another mark: it belongs to another version or robot.
    Other,
}

/// A region of NOR flash in two halves, erased and written alternately.
///
/// A half holds one record, at its beginning. The next record goes to the half that does not hold the newest one, so a
/// power cut while erasing or writing cannot damage the newest record. No older record remains behind the newest in the
/// same half, where it could reappear if the newest is damaged: a log of records, as `sequential-storage` keeps it, has them.
#[derive(Debug)]
pub struct Halves<F> {
    pub(crate) flash: F,
    /// The mark at the start of a record.
    mark: u32,
    /// Maximum size of a content, bytes.
    largest: usize,
    /// The lower and upper half: a record, nothing, or unusable bytes. [`StoreError::Flash`] means unknown, because the
    /// half could not be read.
    found: [Result<Option<Found>, StoreError>; 2],
}

/// A complete record with the right mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Found {
    /// Counts up and wraps; the newest is in use.
    generation: u32,
    length: usize,
    checksum: u32,
    /// Whether the other half held nothing that counts when it was written.
    alone: bool,
}

/// In a header's length: the record is alone.
const ALONE: u32 = 1 << 31;

/// Indices of the halves.
const LOWER: usize = 0;
const UPPER: usize = 1;

impl<F: NorFlash> Halves<F> {
    /// A store that owns its flash. `mark` starts every record of this program, version and robot; `largest` is the
    /// maximum size of a content, bytes.
    pub const fn new(flash: F, mark: u32, largest: usize) -> Self {
        const {
            assert!(
                CHUNK.is_multiple_of(F::WRITE_SIZE) && CHUNK.is_multiple_of(F::READ_SIZE),
                "64 bytes must be a whole number of what the flash reads and writes at once"
            );
        }
        Self {
            flash,
            mark,
            largest,
            found: [Err(StoreError::Flash); 2],
        }
    }

    /// Number of the newest record, which counts every record; 0 if there is none.
    pub fn generation(&self) -> u32 {
        self.newest().map_or(0, |(_, generation)| generation)
    }

    /// Whether the newest record is certainly there: no half is damaged or unreadable, and no record was lost.
    pub fn complete(&self) -> bool {
        match self.found {
            // The halves are written alternately: a gap between their numbers means a lost record.
            [Ok(Some(lower)), Ok(Some(upper))] => {
                let gap = lower.generation.wrapping_sub(upper.generation);
                gap == 1 || gap == u32::MAX
            }
            [Ok(Some(only)), Ok(None)] | [Ok(None), Ok(Some(only))] => {
                only.alone || only.generation == 1
            }
            [lower, upper] => lower.is_ok() && upper.is_ok(),
        }
    }

    /// The half of the newest record, and its generation.
    fn newest(&self) -> Option<(usize, u32)> {
        let generations = self
            .found
            .map(|half| half.ok().flatten().map(|own| own.generation));
        match generations {
            [None, None] => None,
            [Some(lower), None] => Some((LOWER, lower)),
            [Some(lower), Some(upper)] if follows(lower, upper) => Some((LOWER, lower)),
            [_, Some(upper)] => Some((UPPER, upper)),
        }
    }

    /// The newest record's content, read into `content`; `None` if nothing was ever stored. Writes nothing.
    ///
    /// # Errors
    /// The stored record cannot be read.
    pub fn load<'a>(&mut self, content: &'a mut [u8]) -> Result<Option<&'a [u8]>, StoreError> {
        for half in [LOWER, UPPER] {
            let _ = self.look(half);
        }
        while let Some((half, _)) = self.newest() {
            // Failing flash may return different bytes at the second reading.
            match self.read(half, content) {
                Ok(Some(again)) if self.found[half] == Ok(Some(again)) => {
                    return Ok(content.get(..again.length));
                }
                // It can no longer be read: fall back to the previous record.
                Ok(_) => self.found[half] = Err(StoreError::Record),
                Err(error) => self.found[half] = Err(error),
            }
        }
        match self.found {
            [Err(StoreError::Other), _] | [_, Err(StoreError::Other)] => Err(StoreError::Other),
            [Err(error), _] | [_, Err(error)] => Err(error),
            _ => Ok(None),
        }
    }

    /// Stores a content and reads it back.
    ///
    /// # Errors
    /// The cause; the previous record then stays in use.
    pub fn save(&mut self, content: &[u8]) -> Result<(), StoreError> {
        if content.len() > self.largest {
            return Err(StoreError::Record);
        }
        // An earlier read failure may have been temporary.
        for half in [LOWER, UPPER] {
            if self.unread(half) {
                let _ = self.look(half);
            }
        }
        let half = match self.newest() {
            Some((newest, _)) => UPPER - newest,
            None if !self.unread(LOWER) => LOWER,
            None if !self.unread(UPPER) => UPPER,
            // The half may hold a good record, even the newest.
            None => return Err(StoreError::Flash),
        };
        let stored = self.replace(half, content);
        if stored.is_err() {
            // It may be stored in spite of the error: what was refused must not be in use after a restart.
            let _ = self.erase(half);
        }
        stored
    }

    fn unread(&self, half: usize) -> bool {
        self.found[half] == Err(StoreError::Flash)
    }

    /// Replaces the record in a half.
    fn replace(&mut self, half: usize, content: &[u8]) -> Result<(), StoreError> {
        let other = UPPER - half;
        let alone = self.found[other].is_err();
        let written = self.write(half, content, self.generation().wrapping_add(1), alone)?;
        if self.look(half)? != Some(written) {
            return Err(StoreError::Record);
        }
        match self.found[other] {
            Ok(_) => Ok(()),
            // The next start would take garbage for a lost record, and what it can read again may have a higher
            // generation.
            Err(_) => self.erase(other),
        }
    }

    /// Examines a half.
    fn look(&mut self, half: usize) -> Result<Option<Found>, StoreError> {
        let found = self.read(half, &mut []);
        self.found[half] = found;
        found
    }

    /// Reads a half, and the content of its record as far as there is room. Chunk by chunk: a record may be larger than
    /// the stack.
    fn read(&mut self, half: usize, content: &mut [u8]) -> Result<Option<Found>, StoreError> {
        let Range { start, .. } = self.range(half)?;
        let mut content = content.iter_mut();
        let (mut erased, mut ours, mut header, mut stored, mut place) = (true, false, None, 0, 0);
        let mut digest = CRC.digest();
        for offset in (0..self.room()).step_by(CHUNK) {
            let mut bytes = [0; CHUNK];
            self.flash
                .read(start + offset, &mut bytes)
                .map_err(|_| StoreError::Flash)?;
            if offset == 0 {
                (ours, header) = self.header(&bytes);
            }
            for &byte in &bytes {
                erased &= byte == ERASED;
                let Some(found) = header else { continue };
                let end = HEADER + found.length;
                if place < end {
                    digest.update(&[byte]);
                    if place >= HEADER
                        && let Some(own) = content.next()
                    {
                        *own = byte;
                    }
                } else if place < end + CHECKSUM {
                    stored = stored >> 8 | u32::from(byte) << 24;
                }
                place += 1;
            }
        }
        let checksum = digest.finalize();
        match header {
            Some(_) if checksum == stored && !ours => Err(StoreError::Other),
            Some(found) if checksum == stored => Ok(Some(Found { checksum, ..found })),
            _ if erased => Ok(None),
            _ => Err(StoreError::Record),
        }
    }

    /// Whether a record has our mark, and its header; `None` if the bytes do not begin with one.
    fn header(&self, bytes: &[u8; CHUNK]) -> (bool, Option<Found>) {
        let [mark, generation, length] = Wire::get(&mut Reader::new(bytes)).unwrap_or([0; 3]);
        let found = Found {
            generation,
            length: (length & !ALONE) as usize,
            checksum: 0,
            alone: length & ALONE != 0,
        };
        let fits = found.length > 0 && found.length <= self.largest;
        (mark == self.mark, fits.then_some(found))
    }

    fn write(
        &mut self,
        half: usize,
        content: &[u8],
        generation: u32,
        alone: bool,
    ) -> Result<Found, StoreError> {
        let mut header = [0; HEADER];
        #[allow(clippy::cast_possible_truncation)] // some kilobytes
        let length = content.len() as u32 | if alone { ALONE } else { 0 };
        [self.mark, generation, length].put(&mut Writer::new(&mut header));
        let mut digest = CRC.digest();
        for byte in header.iter().chain(content) {
            digest.update(&[*byte]);
        }
        let checksum = digest.finalize();
        let end = checksum.to_le_bytes();
        self.erase(half)?;
        let start = self.range(half)?.start;
        let mut bytes = header.iter().chain(content).chain(&end);
        let length = HEADER + content.len() + CHECKSUM;
        for offset in (0..length).step_by(CHUNK) {
            let chunk = [(); CHUNK].map(|()| bytes.next().copied().unwrap_or(ERASED));
            #[allow(clippy::cast_possible_truncation)] // some kilobytes
            let offset = start + offset as u32;
            self.flash
                .write(offset, &chunk)
                .map_err(|_| StoreError::Flash)?;
        }
        Ok(Found {
            generation,
            length: content.len(),
            checksum,
            alone,
        })
    }

    fn erase(&mut self, half: usize) -> Result<(), StoreError> {
        let Range { start, end } = self.range(half)?;
        // Until it has been examined again.
        self.found[half] = Err(StoreError::Flash);
        // Page by page: where a busy flash stalls the processor, interrupts run between two pages.
        #[allow(clippy::cast_possible_truncation)] // some kilobytes
        let page = F::ERASE_SIZE as u32;
        for start in (start..end).step_by(F::ERASE_SIZE) {
            self.flash
                .erase(start, start + page)
                .map_err(|_| StoreError::Flash)?;
        }
        self.found[half] = Ok(None);
        Ok(())
    }

    /// Space in a half for a record, in whole chunks, bytes.
    #[allow(clippy::cast_possible_truncation)] // some kilobytes
    const fn room(&self) -> u32 {
        ((HEADER + self.largest + CHECKSUM).div_ceil(CHUNK) * CHUNK) as u32
    }

    /// Where a half is.
    ///
    /// # Errors
    /// The region is not two halves of whole pages with room for a record.
    pub(crate) fn range(&self, half: usize) -> Result<Range<u32>, StoreError> {
        let capacity = u32::try_from(self.flash.capacity()).map_err(|_| StoreError::Region)?;
        let length = capacity / 2;
        let pages = (length as usize).is_multiple_of(F::ERASE_SIZE);
        if !pages || length < self.room() {
            return Err(StoreError::Region);
        }
        Ok(if half == LOWER {
            0..length
        } else {
            length..2 * length
        })
    }
}

/// Whether one generation is newer than another: ahead of it by less than half of their range.
const fn follows(generation: u32, other: u32) -> bool {
    generation.wrapping_sub(other).cast_signed() > 0
}

/// The mark of records with this version, scalar and nominal robot.
#[allow(clippy::cast_possible_truncation)] // 4 or 8
pub(crate) const fn mark<T>(version: u8, nominal: u32) -> u32 {
    nominal.rotate_left(8) ^ u32::from_le_bytes([b'd', version, size_of::<T>() as u8, b'c'])
}
