//! One record in flash, written entirely or not at all.

use core::ops::Range;
use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};
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
    /// The stored record is damaged, or belongs to another version or robot.
    Record,
    /// The record did not read back as written.
    ReadBack,
}

/// A region of NOR flash in two halves, erased and written alternately.
///
/// A half holds one record, at its beginning. The next record goes to the half that does not hold the newest one, so a
/// power cut while erasing or writing cannot damage the newest record. No older record remains behind the newest in the
/// same half, where it could reappear if the newest is damaged.
#[derive(Debug)]
pub struct Halves<F> {
    flash: F,
    /// The mark at the start of a record. A record with another mark is ignored.
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

    /// The flash.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Number of the newest record, which counts every record; 0 if there is none.
    pub fn generation(&self) -> u32 {
        self.newest().map_or(0, |(_, found)| found.generation)
    }

    /// Whether the newest record is certainly there: no half is damaged or unreadable, and no record was lost.
    pub fn complete(&self) -> bool {
        match self.found {
            // The halves are written alternately: a gap between their numbers means a lost record.
            [Ok(Some(lower)), Ok(Some(upper))] => {
                matches!(
                    lower.generation.wrapping_sub(upper.generation),
                    1 | u32::MAX
                )
            }
            [lower, upper] => lower.is_ok() && upper.is_ok(),
        }
    }

    fn newest(&self) -> Option<(Half, Found)> {
        match self.found.map(|half| half.ok().flatten()) {
            [None, None] => None,
            [Some(lower), None] => Some((Half::Lower, lower)),
            [Some(lower), Some(upper)] if follows(lower.generation, upper.generation) => {
                Some((Half::Lower, lower))
            }
            [_, Some(upper)] => Some((Half::Upper, upper)),
        }
    }

    /// The newest record's content, read into `content`; `None` if nothing was ever stored. Writes nothing.
    ///
    /// # Errors
    /// The stored record cannot be read.
    pub fn load<'a>(&mut self, content: &'a mut [u8]) -> Result<Option<&'a [u8]>, StoreError> {
        let lower = self.look(Half::Lower);
        let upper = self.look(Half::Upper);
        while let Some((half, found)) = self.newest() {
            match self.read_content(half, &found, content) {
                Ok(()) => return Ok(content.get(..found.length)),
                // It can no longer be read: fall back to the previous record.
                Err(error) => self.found[half as usize] = Err(error),
            }
        }
        match self.found {
            [Err(error), _] | [_, Err(error)] => Err(error),
            _ => lower.and(upper).map(|_| None),
        }
    }

    fn read_content(
        &mut self,
        half: Half,
        found: &Found,
        content: &mut [u8],
    ) -> Result<(), StoreError> {
        let content = content.get_mut(..found.length).ok_or(StoreError::Record)?;
        let start = self.range(half)?.start;
        let mut places = content.iter_mut();
        for offset in (0..self.room()).step_by(CHUNK) {
            let mut bytes = [0; CHUNK];
            self.flash
                .read(start + offset, &mut bytes)
                .map_err(|_| StoreError::Flash)?;
            let before = if offset == 0 { HEADER } else { 0 };
            for (byte, place) in bytes.iter().skip(before).zip(&mut places) {
                *place = *byte;
            }
        }
        // Failing flash may return different bytes at the second reading.
        let mut digest = self.digest(found.generation, found.length);
        digest.update(content);
        if digest.finalize() == found.checksum {
            Ok(())
        } else {
            Err(StoreError::Record)
        }
    }

    /// Stores a content and reads it back.
    ///
    /// # Errors
    /// The cause; the previous record then stays in use.
    #[inline(never)]
    pub fn save(&mut self, content: &[u8]) -> Result<(), StoreError> {
        if content.len() > self.largest {
            return Err(StoreError::Record);
        }
        // An earlier read failure may have been temporary.
        for half in Half::BOTH {
            if self.unread(half) {
                let _ = self.look(half);
            }
        }
        let half = match self.newest() {
            Some((newest, _)) => newest.other(),
            None if !self.unread(Half::Lower) => Half::Lower,
            None if !self.unread(Half::Upper) => Half::Upper,
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

    fn unread(&self, half: Half) -> bool {
        self.found[half as usize] == Err(StoreError::Flash)
    }

    /// Replaces the record in a half.
    fn replace(&mut self, half: Half, content: &[u8]) -> Result<(), StoreError> {
        let generation = self.generation().wrapping_add(1);
        let written = self.write(half, content, generation)?;
        match self.look(half) {
            Ok(Some(found)) if found == written => {}
            Ok(_) | Err(StoreError::Record) => return Err(StoreError::ReadBack),
            Err(error) => return Err(error),
        }
        let other = half.other();
        match self.found[other as usize] {
            Ok(_) => Ok(()),
            // The next start would take garbage for a lost record, and what it can read again may have a higher
            // generation.
            Err(_) => self.erase(other),
        }
    }

    /// Examines a half.
    #[inline(never)]
    fn look(&mut self, half: Half) -> Result<Option<Found>, StoreError> {
        let found = self.read(half);
        self.found[half as usize] = found;
        found
    }

    /// Chunk by chunk: a record may be larger than the stack.
    fn read(&mut self, half: Half) -> Result<Option<Found>, StoreError> {
        let Range { start, .. } = self.range(half)?;
        let (mut erased, mut header) = (true, None);
        let mut digest = CRC.digest();
        let (mut rest, mut checksum, mut computed) = (0, [0; CHECKSUM], 0);
        let mut behind = 0;
        for offset in (0..self.room()).step_by(CHUNK) {
            let mut bytes = [0; CHUNK];
            self.flash
                .read(start + offset, &mut bytes)
                .map_err(|_| StoreError::Flash)?;
            erased &= bytes.iter().all(|byte| *byte == ERASED);
            let mut content = bytes.as_slice();
            if header.is_none() {
                let Some((first, others)) = bytes.split_first_chunk::<HEADER>() else {
                    return Err(StoreError::Record);
                };
                let found = self.header(first);
                if let Some(found) = &found {
                    digest = self.digest(found.generation, found.length);
                    rest = found.length;
                }
                header = Some(found);
                content = others;
            }
            let (own, others) = content.split_at(rest.min(content.len()));
            digest.update(own);
            rest -= own.len();
            if rest == 0 && !own.is_empty() {
                computed = digest.clone().finalize();
            }
            if rest == 0 {
                for byte in others {
                    if let Some(place) = checksum.get_mut(behind) {
                        *place = *byte;
                        behind += 1;
                    }
                }
            }
        }
        if erased {
            return Ok(None);
        }
        let whole = u32::from_le_bytes(checksum) == computed && behind == CHECKSUM;
        match header.flatten() {
            Some(found) if whole => Ok(Some(Found {
                checksum: computed,
                ..found
            })),
            _ => Err(StoreError::Record),
        }
    }

    /// `None` if it is not one of our headers.
    fn header(&self, bytes: &[u8; HEADER]) -> Option<Found> {
        let [a, b, c, d, e, f, g, h, i, j, k, l] = *bytes;
        let length = usize::try_from(u32::from_le_bytes([i, j, k, l])).ok()?;
        let ours = u32::from_le_bytes([a, b, c, d]) == self.mark;
        (ours && length > 0 && length <= self.largest).then_some(Found {
            generation: u32::from_le_bytes([e, f, g, h]),
            length,
            checksum: 0,
        })
    }

    /// Digest of the header; the content follows.
    fn digest(&self, generation: u32, length: usize) -> Digest<'static, u32, NoTable> {
        let mut digest = CRC.digest();
        digest.update(&self.header_bytes(generation, length));
        digest
    }

    #[allow(clippy::cast_possible_truncation)] // some kilobytes
    fn header_bytes(&self, generation: u32, length: usize) -> [u8; HEADER] {
        let mut bytes = [0; HEADER];
        let words = [self.mark, generation, length as u32];
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    #[inline(never)]
    fn write(&mut self, half: Half, content: &[u8], generation: u32) -> Result<Found, StoreError> {
        let header = self.header_bytes(generation, content.len());
        let mut digest = self.digest(generation, content.len());
        digest.update(content);
        let checksum = digest.finalize();
        let end = checksum.to_le_bytes();
        self.erase(half)?;
        let start = self.range(half)?.start;
        let mut bytes = header.iter().chain(content).chain(&end);
        let length = HEADER + content.len() + CHECKSUM;
        for offset in (0..length).step_by(CHUNK) {
            let mut chunk = [ERASED; CHUNK];
            for place in &mut chunk {
                *place = bytes.next().copied().unwrap_or(ERASED);
            }
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
        })
    }

    fn erase(&mut self, half: Half) -> Result<(), StoreError> {
        let Range { start, end } = self.range(half)?;
        // Until it has been examined again.
        self.found[half as usize] = Err(StoreError::Flash);
        self.flash
            .erase(start, end)
            .map_err(|_| StoreError::Flash)?;
        self.found[half as usize] = Ok(None);
        Ok(())
    }

    /// Space in a half for a record, in whole chunks, bytes.
    #[allow(clippy::cast_possible_truncation)] // some kilobytes
    const fn room(&self) -> u32 {
        ((HEADER + self.largest + CHECKSUM).div_ceil(CHUNK) * CHUNK) as u32
    }

    fn range(&self, half: Half) -> Result<Range<u32>, StoreError> {
        let capacity = u32::try_from(self.flash.capacity()).map_err(|_| StoreError::Region)?;
        let length = capacity / 2;
        let pages = (length as usize).is_multiple_of(F::ERASE_SIZE);
        if !pages || length < self.room() {
            return Err(StoreError::Region);
        }
        Ok(match half {
            Half::Lower => 0..length,
            Half::Upper => length..2 * length,
        })
    }
}

/// Whether one generation is newer than another: ahead of it by less than half of their range.
const fn follows(generation: u32, other: u32) -> bool {
    generation.wrapping_sub(other).cast_signed() > 0
}
