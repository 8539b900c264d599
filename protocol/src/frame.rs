//! Frames: how messages are encoded as bytes on the link and recovered from them.

use crate::wire::{Reader, Wire, Writer};
use cobs::{decode_in_place, try_encode};
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

/// The protocol version, part of every frame.
pub const VERSION: u8 = 6;

/// Sequence number of the answer to a frame whose own is unreadable. Requests never use it.
pub const UNKNOWN_SEQUENCE: u16 = 0;

/// Size of the largest frame in bytes, with delimiters and a margin: a geometry with transmissions in `f64`.
pub const LARGEST_FRAME: usize = 384;

/// Version and direction (1 byte), sequence number (2 bytes).
const HEAD: usize = 3;
const CHECKSUM: usize = 4;
/// Set in the first byte of a response, so that an echo is not mistaken for a request.
const ANSWER: u8 = 0x80;

/// The direction of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the driver to the controller.
    Request,
    /// From the controller to the driver.
    Response,
}

impl Direction {
    const fn bit(self) -> u8 {
        match self {
            Self::Request => 0,
            Self::Response => ANSWER,
        }
    }
}

/// The message is larger than [`LARGEST_FRAME`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the message does not fit a frame")]
pub struct EncodeError;

/// Why received bytes are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Wrong checksum, too short, or invalid COBS.
    #[error("a damaged frame")]
    Damaged,
    /// More bytes between two delimiters than in the largest frame.
    #[error("a frame longer than any message")]
    TooLong,
    /// The frame has the opposite direction: an echo.
    #[error("an echo of what was sent")]
    WrongDirection,
    /// An intact frame of an unsupported protocol version.
    #[error("a frame of protocol version {version}")]
    UnknownVersion {
        /// Its sequence number.
        sequence: u16,
        /// Its version.
        version: u8,
    },
}

/// Encodes a message for the wire:
///
/// ```text
/// 0x00  COBS( version | direction << 7, sequence u16, message, CRC-32 of all that )  0x00
/// ```
///
/// Numbers are little-endian. The leading delimiter terminates any noise before the frame.
///
/// # Errors
/// [`EncodeError`] if it exceeds [`LARGEST_FRAME`].
///
/// ```
/// use delta_cal_protocol::{Direction, LARGEST_FRAME, Receiver, Request, encode};
/// let sent: Request<f32> = Request::Identify;
/// let bytes = encode(Direction::Request, 7, &sent)?;
/// let mut receiver = Receiver::<LARGEST_FRAME>::new(Direction::Request);
/// let mut received = None;
/// for byte in bytes {
///     if let Some(Ok(frame)) = receiver.push(byte) {
///         received = frame.message::<Request<f32>>().map(|message| (frame.sequence, message));
///     }
/// }
/// assert_eq!(received, Some((7, sent)));
/// # Ok::<(), delta_cal_protocol::EncodeError>(())
/// ```
pub fn encode<M: Wire>(
    direction: Direction,
    sequence: u16,
    message: &M,
) -> Result<Vec<u8, LARGEST_FRAME>, EncodeError> {
    let mut content = [0; LARGEST_FRAME];
    let [low, high] = sequence.to_le_bytes();
    let mut writer = Writer::new(&mut content);
    writer.bytes(&[VERSION | direction.bit(), low, high]);
    message.put(&mut writer);
    let length = writer.finish().ok_or(EncodeError)?;
    let checksum = checksum(content.get(..length).unwrap_or_default());
    let mut writer = Writer::new(content.get_mut(length..).unwrap_or_default());
    checksum.put(&mut writer);
    let length = length + writer.finish().ok_or(EncodeError)?;
    let content = content.get(..length).unwrap_or_default();

    let mut frame = Vec::new();
    let sized = frame.resize_default(LARGEST_FRAME);
    sized.map_err(|_| EncodeError)?;
    let stuffed = frame.get_mut(1..LARGEST_FRAME - 1).unwrap_or_default();
    let length = try_encode(content, stuffed).map_err(|_| EncodeError)?;
    frame.truncate(length + 2);
    // After a final block of 254 bytes the encoder has already started the next one.
    *frame.last_mut().ok_or(EncodeError)? = 0;
    Ok(frame)
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}

/// An intact frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The sequence number; a response has that of its request.
    pub sequence: u16,
    pub(crate) body: &'a [u8],
}

impl Frame<'_> {
    /// The message; `None` if it is not of this type or is followed by other bytes.
    pub fn message<M: Wire>(&self) -> Option<M> {
        let mut reader = Reader::new(self.body);
        let message = M::get(&mut reader)?;
        reader.rest().is_empty().then_some(message)
    }
}

/// Assembles frames from a stream of bytes.
#[derive(Debug, Clone)]
pub struct Receiver<const N: usize> {
    direction: Direction,
    bytes: Vec<u8, N>,
    complete: bool,
    too_long: bool,
}

impl<const N: usize> Receiver<N> {
    /// Creates a receiver for one direction. Frames of the other are echoes.
    pub const fn new(direction: Direction) -> Self {
        Self {
            direction,
            bytes: Vec::new(),
            complete: false,
            too_long: false,
        }
    }

    /// Processes a byte; at the delimiter that ends a frame, returns the frame or its error.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        if self.complete {
            self.bytes.clear();
            self.complete = false;
        }
        if byte != 0 {
            self.too_long |= self.bytes.push(byte).is_err();
            return None;
        }
        self.complete = true;
        if core::mem::take(&mut self.too_long) {
            return Some(Err(FrameError::TooLong));
        }
        if self.bytes.is_empty() {
            return None;
        }
        Some(self.frame())
    }

    fn frame(&mut self) -> Result<Frame<'_>, FrameError> {
        let length = decode_in_place(&mut self.bytes).map_err(|_| FrameError::Damaged)?;
        let content = self.bytes.get(..length).ok_or(FrameError::Damaged)?;
        let (content, sent) = content
            .split_last_chunk::<CHECKSUM>()
            .ok_or(FrameError::Damaged)?;
        if checksum(content) != u32::from_le_bytes(*sent) {
            return Err(FrameError::Damaged);
        }
        let ([first, low, high], body) = content
            .split_first_chunk::<HEAD>()
            .ok_or(FrameError::Damaged)?;
        if first & ANSWER != self.direction.bit() {
            return Err(FrameError::WrongDirection);
        }
        let sequence = u16::from_le_bytes([*low, *high]);
        let version = first & !ANSWER;
        if version != VERSION {
            return Err(FrameError::UnknownVersion { sequence, version });
        }
        Ok(Frame { sequence, body })
    }
}
