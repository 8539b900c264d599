//! CRC-32, by the byte.

use crate::Real;
use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

pub(super) const fn crc(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A checksum over all that a snapshot must agree with.
pub(crate) struct Fingerprint(Digest<'static, u32, Table<1>>);

impl Fingerprint {
    pub(crate) const fn new() -> Self {
        Self(CRC.digest())
    }

    pub(crate) fn byte(&mut self, value: u8) {
        self.0.update(&[value]);
    }

    pub(crate) fn count(&mut self, value: u64) {
        self.0.update(&value.to_le_bytes());
    }

    pub(crate) fn number<T: Real>(&mut self, value: T) {
        self.count(value.bit_pattern());
    }

    /// Whether there are such numbers, and which.
    pub(crate) fn optional<T: Real, const N: usize>(&mut self, values: Option<[T; N]>) {
        self.byte(u8::from(values.is_some()));
        for value in values.iter().flatten() {
            self.number(*value);
        }
    }

    pub(crate) fn finish(self) -> u32 {
        self.0.finalize()
    }
}
