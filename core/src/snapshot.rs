//! Snapshots: the state of a calibrator or gate as bytes, to be stored where they survive a power cut.
//!
//! ```text
//! version  1 byte, kind  1 byte, bytes per number  1 byte, 0  1 byte
//! length of the whole snapshot  4 bytes
//! fingerprint of the robot, the noise and the options  4 bytes
//! state: numbers and counts
//! CRC-32 of everything before  4 bytes                    all little-endian
//! ```
//!
//! A snapshot is restored into a new object for the same robot and noise. With the same settings, that object then
//! gives bit-identical results to the original. Bytes that are damaged, or come from another robot, noise, kind of
//! object or scalar type are refused, and the object is unchanged.

use crate::robot::{Robot, Transmission};
use crate::state::{Reader, State, Writer};
use crate::{Busy, Real};
use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

/// Version of the format.
const VERSION: u8 = 1;
const HEADER: usize = 12;
const CHECKSUM: usize = 4;

/// Why a snapshot was not restored or not written. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SnapshotError {
    /// The buffer is shorter than the snapshot: it needs `SNAPSHOT_BYTES`.
    #[error("the buffer is shorter than the snapshot")]
    BufferTooShort,
    /// The bytes are not a complete snapshot: truncated, damaged, or never written.
    #[error("the bytes are not a whole snapshot")]
    Damaged,
    /// The snapshot comes from another version of this crate, with a different format.
    #[error("the snapshot is of the unknown version {version}")]
    OtherVersion {
        /// The version of the bytes.
        version: u8,
    },
    /// The snapshot comes from another kind of object, or one with another scalar type.
    #[error("the snapshot is of another kind of object or of another type of numbers")]
    OtherKind,
    /// The snapshot has another robot, noise or options, or belongs to a calibrator in another state.
    #[error("the snapshot is of another robot, of other settings or of another state")]
    OtherCalibration,
    /// A solve is in progress.
    #[error(transparent)]
    Busy(#[from] Busy),
}

/// The largest snapshot of a state, bytes.
pub(crate) const fn longest<T: Real, S: State<T>>() -> usize {
    HEADER + S::BYTES + CHECKSUM
}

/// Writes a snapshot and returns the part of the buffer used.
pub(crate) fn write<'a, T: Real, S: State<T>>(
    kind: u8,
    fingerprint: u32,
    state: &S,
    bytes: &'a mut [u8],
) -> Result<&'a [u8], SnapshotError> {
    let enough = bytes.len() >= longest::<T, S>();
    let (header, place) = bytes
        .split_first_chunk_mut::<HEADER>()
        .filter(|_| enough)
        .ok_or(SnapshotError::BufferTooShort)?;
    let mut writer = Writer::new(place);
    state.save(&mut writer);
    let length = HEADER + writer.written() + CHECKSUM;
    let mut beginning = Writer::new(header);
    beginning.put(&[VERSION, kind, number_size::<T>(), 0]);
    #[allow(clippy::cast_possible_truncation)] // some kilobytes
    beginning.put(&(length as u32).to_le_bytes());
    beginning.put(&fingerprint.to_le_bytes());
    let whole = bytes
        .get_mut(..length)
        .ok_or(SnapshotError::BufferTooShort)?;
    // Not `split_last_chunk_mut`: its bounds check can panic.
    let (content, places) = whole
        .split_at_mut_checked(length.saturating_sub(CHECKSUM))
        .ok_or(SnapshotError::BufferTooShort)?;
    for (place, byte) in places.iter_mut().zip(crc(content).to_le_bytes()) {
        *place = byte;
    }
    Ok(whole)
}

/// Restores a snapshot written by [`write`]; trailing bytes are ignored.
pub(crate) fn read<T: Real, S: State<T>>(
    kind: u8,
    fingerprint: u32,
    state: &mut S,
    bytes: &[u8],
) -> Result<(), SnapshotError> {
    let [version, written_kind, size, _, length @ ..] = bytes else {
        return Err(SnapshotError::Damaged);
    };
    // Checked before the checksum: another version may have another length.
    if *version != VERSION {
        return Err(match *version {
            0 | u8::MAX => SnapshotError::Damaged,
            version => SnapshotError::OtherVersion { version },
        });
    }
    if *written_kind != kind || *size != number_size::<T>() {
        return Err(SnapshotError::OtherKind);
    }
    let length = length
        .first_chunk()
        .map_or(0, |bytes| u32::from_le_bytes(*bytes));
    let (content, checksum) = usize::try_from(length)
        .ok()
        .and_then(|length| bytes.get(..length))
        .and_then(|whole| whole.split_last_chunk::<CHECKSUM>())
        .ok_or(SnapshotError::Damaged)?;
    if crc(content).to_le_bytes() != *checksum {
        return Err(SnapshotError::Damaged);
    }
    let (header, content) = content
        .split_first_chunk::<HEADER>()
        .ok_or(SnapshotError::Damaged)?;
    let [.., a, b, c, d] = *header;
    if u32::from_le_bytes([a, b, c, d]) != fingerprint {
        return Err(SnapshotError::OtherCalibration);
    }
    // A matching checksum is no proof: other software may have written it.
    if !state.accepts(content) {
        return Err(SnapshotError::Damaged);
    }
    state.load(&mut Reader::new(content));
    Ok(())
}

#[allow(clippy::cast_possible_truncation)] // 4 or 8
const fn number_size<T: Real>() -> u8 {
    T::BYTES as u8
}

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

const fn crc(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A checksum of everything a snapshot must agree with.
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

    /// Includes whether the numbers are there, and their values.
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

impl<T: Real> Robot<T> {
    /// A checksum over the bits of all parameters, by which a message, a store or a log names them: CRC-32 of the
    /// parameters as little-endian `f64`, arm by arm, then of the transmissions, if there are any.
    pub fn fingerprint(&self) -> u32 {
        let mut fingerprint = Fingerprint::new();
        let inexact = self.arms().iter().any(|arm| arm.transmission().is_some());
        let transmissions = self.arms().iter().filter(|_| inexact).flat_map(|arm| {
            arm.transmission()
                .map_or([T::ZERO; 5], Transmission::numbers)
        });
        for value in self
            .parameters()
            .as_flattened()
            .iter()
            .copied()
            .chain(transmissions)
        {
            fingerprint.count(value.to_f64().to_bits());
        }
        fingerprint.finish()
    }
}
