//! Flash whose power fails, and flash that cannot be read.

use delta_cal_firmware_example::{FlashError, PAGE, RamFlash, WORD};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::ops::Range;

/// Bytes of the flash of the parameters.
const PARAMETERS: usize = 2 * PAGE;

/// How much of a write or an erase is done when the power fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Nothing.
    Before,
    /// The first half.
    FirstHalf,
    /// The second half.
    LastHalf,
    /// Half of the bits, anywhere.
    SomeBits,
    /// Everything, but nobody is told.
    After,
}

impl Cut {
    pub(crate) const ALL: [Self; 5] = [
        Self::Before,
        Self::FirstHalf,
        Self::LastHalf,
        Self::SomeBits,
        Self::After,
    ];
}

/// Flash that fails at one write or erase, and from then on altogether.
#[derive(Debug, Clone)]
pub(crate) struct FailingFlash<const N: usize = PARAMETERS> {
    pub(crate) flash: RamFlash<N>,
    /// Writes and erases so far.
    pub(crate) operations: u32,
    /// Of them, those that erased.
    pub(crate) erasures: u32,
    /// At which of them the power fails.
    pub(crate) cut: Option<(u32, Cut)>,
    dead: bool,
    /// Words that were written a second time without an erase between.
    pub(crate) rewritten: u32,
    /// Reads so far.
    pub(crate) reads: u32,
    /// Reads that fail, by their numbers.
    pub(crate) failing_reads: Range<u32>,
    /// Bytes that none of those reads may touch.
    pub(crate) unreadable: Range<u32>,
}

impl<const N: usize> FailingFlash<N> {
    pub(crate) fn new(flash: RamFlash<N>) -> Self {
        Self {
            flash,
            operations: 0,
            erasures: 0,
            cut: None,
            dead: false,
            rewritten: 0,
            reads: 0,
            failing_reads: 0..0,
            unreadable: 0..u32::MAX,
        }
    }

    /// Reads within these bytes fail for good.
    pub(crate) fn unreadable(flash: RamFlash<N>, bytes: Range<u32>) -> Self {
        Self {
            failing_reads: 0..u32::MAX,
            unreadable: bytes,
            ..Self::new(flash)
        }
    }

    /// Reads of these numbers fail, wherever they are.
    pub(crate) fn failing_reads(flash: RamFlash<N>, reads: Range<u32>) -> Self {
        Self {
            failing_reads: reads,
            ..Self::new(flash)
        }
    }

    /// Counts from here, and fails at the `at`th operation.
    pub(crate) fn fail(flash: RamFlash<N>, at: u32, cut: Cut) -> Self {
        Self {
            cut: Some((at, cut)),
            ..Self::new(flash)
        }
    }

    /// What is left to do of an operation on `length` bytes, in place of which it fails.
    fn failing(&mut self, length: usize) -> Option<Vec<u8>> {
        let at = self.operations;
        self.operations += 1;
        let (_, cut) = self.cut.filter(|(cut, _)| *cut == at)?;
        self.dead = true;
        let mut rng = Pcg32::seed_from_u64(u64::from(at));
        let half = (length / 2).next_multiple_of(WORD);
        Some(
            (0..length)
                .map(|index| match cut {
                    Cut::Before => 0x00,
                    Cut::FirstHalf => u8::from(index < half) * 0xff,
                    Cut::LastHalf => u8::from(index >= half) * 0xff,
                    Cut::SomeBits => rng.next_u32().to_le_bytes()[0],
                    Cut::After => 0xff,
                })
                .collect(),
        )
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Failure {
    NoPower,
    Unreadable,
    Access(FlashError),
}

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const N: usize> ErrorType for FailingFlash<N> {
    type Error = Failure;
}

impl<const N: usize> ReadNorFlash for FailingFlash<N> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        if self.dead {
            return Err(Failure::NoPower);
        }
        let (number, end) = (self.reads, offset + u32::try_from(bytes.len()).unwrap());
        self.reads += 1;
        let touched = offset < self.unreadable.end && self.unreadable.start < end;
        if touched && self.failing_reads.contains(&number) {
            return Err(Failure::Unreadable);
        }
        self.flash.read(offset, bytes).map_err(Failure::Access)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<const N: usize> NorFlash for FailingFlash<N> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        if self.dead {
            return Err(Failure::NoPower);
        }
        self.erasures += 1;
        let range = from as usize..to as usize;
        if let Some(mask) = self.failing(range.len()) {
            for (byte, set) in self.flash.bytes_mut()[range].iter_mut().zip(mask) {
                *byte |= set;
            }
            return Err(Failure::NoPower);
        }
        self.flash.erase(from, to).map_err(Failure::Access)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        if self.dead {
            return Err(Failure::NoPower);
        }
        let start = offset as usize;
        if let Some(mask) = self.failing(bytes.len()) {
            let place = &mut self.flash.bytes_mut()[start..start + bytes.len()];
            for ((place, byte), clear) in place.iter_mut().zip(bytes).zip(mask) {
                *place &= byte | !clear;
            }
            return Err(Failure::NoPower);
        }
        for word in self.flash.bytes()[start..start + bytes.len()].chunks(WORD) {
            self.rewritten += u32::from(word.iter().any(|byte| *byte != 0xff));
        }
        self.flash.write(offset, bytes).map_err(Failure::Access)
    }
}
