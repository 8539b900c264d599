//! Snapshots: what a calibrator or a gate has seen, as bytes to be stored where they outlast a power cut.
//!
//! ```text
//! version  1 byte, kind  1 byte, bytes of a number  1 byte, 0  1 byte
//! length of the whole snapshot  4 bytes
//! fingerprint of the robot, the noise and the options  4 bytes
//! the state: numbers and counts
//! CRC-32 of all before  4 bytes                           all of them little-endian
//! ```
//!
//! A snapshot is restored into a new object of the same robot and noise. With the same settings, from then on that object gives the same
//! results as the one that the snapshot was taken of, bit by bit. Damaged bytes, and those of another robot, another
//! noise, another kind of object or another scalar type are refused, and the object is as it was.

use crate::Real;
use crate::state::{Reader, State, Writer};
use core::fmt;
use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

/// The version of the bytes.
const VERSION: u8 = 1;
const HEADER: usize = 12;
const CHECKSUM: usize = 4;

/// Why bytes are not restored, or a snapshot is not written. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SnapshotError {
    /// The buffer is shorter than the snapshot: it needs `SNAPSHOT_BYTES`.
    BufferTooShort,
    /// The bytes are not a whole snapshot: cut off, damaged, or never written.
    Damaged,
    /// The snapshot is of another version of this crate, which writes snapshots in another form.
    OtherVersion {
        /// The version of the bytes.
        version: u8,
    },
    /// The snapshot is of another kind of object, or of one that computes in another type.
    OtherKind,
    /// The snapshot is of another robot, another noise or other options, or it belongs to a calibrator in another state.
    OtherCalibration,
    /// The calibration is being solved: until that has finished, no sample is taken and no snapshot is written.
    Busy,
}

impl fmt::Display for SnapshotError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BufferTooShort => formatter.write_str("the buffer is shorter than the snapshot"),
            Self::Damaged => formatter.write_str("the bytes are not a whole snapshot"),
            Self::OtherVersion { version } => {
                write!(
                    formatter,
                    "the snapshot is of the unknown version {version}"
                )
            }
            Self::OtherKind => formatter.write_str(
                "the snapshot is of another kind of object or of another type of numbers",
            ),
            Self::OtherCalibration => formatter.write_str(
                "the snapshot is of another robot, of other settings or of another state",
            ),
            Self::Busy => formatter
                .write_str("a snapshot can be taken between two samples, not while solving"),
        }
    }
}

impl core::error::Error for SnapshotError {}

/// What the number of an object's kind is in a snapshot. The numbers never change.
pub(crate) mod kind {
    /// A stream, added to the number of its calibrator: 1 of each arm by itself, 2 jointly.
    pub(crate) const STREAM: u8 = 4;
}

/// The most bytes of a snapshot of such a state.
pub(crate) const fn longest<T: Real, S: State<T>>() -> usize {
    HEADER + S::BYTES + CHECKSUM
}

/// Writes a snapshot, and returns it.
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
    // Not by split_last_chunk_mut, whose check of the place can panic.
    let (content, places) = whole
        .split_at_mut_checked(length.saturating_sub(CHECKSUM))
        .ok_or(SnapshotError::BufferTooShort)?;
    for (place, byte) in places.iter_mut().zip(crc(content).to_le_bytes()) {
        *place = byte;
    }
    Ok(whole)
}

/// Restores what [`write`] has written; bytes behind it are ignored.
pub(crate) fn read<T: Real, S: State<T>>(
    kind: u8,
    fingerprint: u32,
    state: &mut S,
    bytes: &[u8],
) -> Result<(), SnapshotError> {
    let [version, written_kind, size, _, length @ ..] = bytes else {
        return Err(SnapshotError::Damaged);
    };
    // Before the checksum: another version may be longer or shorter.
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
