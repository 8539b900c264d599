use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
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

/// Memory that behaves like NOR flash: pages erase to ones, and writing only clears bits. It refuses accesses that are
/// not aligned to words or pages, or beyond its end.
#[derive(Debug, Clone, PartialEq, Eq)]
#[repr(align(4))]
pub struct RamFlash<const N: usize> {
    /// Its content, to look at and to damage.
    pub bytes: [u8; N],
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

    fn from(&mut self, offset: u32) -> &mut [u8] {
        self.bytes.get_mut(offset as usize..).unwrap_or_default()
    }
}

impl<const N: usize> ErrorType for RamFlash<N> {
    type Error = NorFlashErrorKind;
}

impl<const N: usize> ReadNorFlash for RamFlash<N> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        for (byte, place) in bytes.iter_mut().zip(self.from(offset)) {
            *byte = *place;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        N
    }
}

impl<const N: usize> NorFlash for RamFlash<N> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        let pages = self.bytes.as_chunks_mut::<PAGE>().0;
        let pages = pages.get_mut(from as usize / PAGE..to as usize / PAGE);
        pages.unwrap_or_default().as_flattened_mut().fill(ERASED);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (place, byte) in self.from(offset).iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}
