use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Erase size, bytes.
pub const PAGE: usize = 2048;
/// Write size, bytes.
pub const WORD: usize = 4;

/// Size for the parameters: two halves of one page each, see [`Controller`](crate::Controller).
pub type ParameterFlash = RamFlash<{ 2 * PAGE }>;

/// Size for the samples of a session: two halves of eight pages each.
pub type StreamFlash = RamFlash<{ 16 * PAGE }>;

const ERASED: u8 = 0xff;

/// Memory that behaves like NOR flash: pages erase to ones, and writing only clears bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RamFlash<const N: usize> {
    bytes: [u8; N],
}

/// An access to a [`RamFlash`] that is not aligned to words or pages, or beyond its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashError(NorFlashErrorKind);

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl<const N: usize> Default for RamFlash<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> RamFlash<N> {
    /// Erased, as from the factory.
    pub const fn new() -> Self {
        Self { bytes: [ERASED; N] }
    }

    /// Its content.
    pub const fn bytes(&self) -> &[u8; N] {
        &self.bytes
    }

    /// Its content, mutable, to damage it.
    pub const fn bytes_mut(&mut self) -> &mut [u8; N] {
        &mut self.bytes
    }

    fn range(&mut self, offset: u32, length: usize, unit: usize) -> Result<&mut [u8], FlashError> {
        let start = offset as usize;
        if !(start.is_multiple_of(unit) && length.is_multiple_of(unit)) {
            return Err(FlashError(NorFlashErrorKind::NotAligned));
        }
        self.bytes
            .get_mut(start..start.saturating_add(length))
            .ok_or(FlashError(NorFlashErrorKind::OutOfBounds))
    }
}

impl<const N: usize> ErrorType for RamFlash<N> {
    type Error = FlashError;
}

impl<const N: usize> ReadNorFlash for RamFlash<N> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        bytes.copy_from_slice(self.range(offset, bytes.len(), Self::READ_SIZE)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        N
    }
}

impl<const N: usize> NorFlash for RamFlash<N> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let length = to
            .checked_sub(from)
            .ok_or(FlashError(NorFlashErrorKind::OutOfBounds))?;
        self.range(from, length as usize, PAGE)?.fill(ERASED);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        for (place, byte) in self.range(offset, bytes.len(), WORD)?.iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}
