//! A text that is too long for the memory: read block by block, as often as needed.

use crate::files::decode::{is_control, is_utf16, letters, without_mark};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::str::from_utf8;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes of a block; it ends with the last line that does.
const BLOCK: usize = 1 << 20;

/// A text that lies in a file.
#[derive(Debug, Clone)]
pub(super) struct TextOnDisk {
    file: Arc<Mutex<File>>,
    /// Or one byte a letter.
    utf8: bool,
}

impl PartialEq for TextOnDisk {
    /// Whether they are the same open file.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.file, &other.file)
    }
}

impl Eq for TextOnDisk {}

/// What a long file is.
pub(super) enum Long {
    Text(TextOnDisk, Sha256),
    /// Two bytes a letter.
    Utf16,
    NotText,
}

impl TextOnDisk {
    /// Reads the file once, to see what it is.
    pub(super) fn scan(mut file: File) -> io::Result<Long> {
        let (mut sha256, mut utf8) = (Sha256::new(), true);
        let mut block = vec![0; BLOCK];
        let (mut left, mut first) = (0, true);
        loop {
            let read = read_most(&mut file, &mut block[left..])?;
            let bytes = &block[left..left + read];
            sha256.update(bytes);
            if first && is_utf16(bytes) {
                return Ok(Long::Utf16);
            }
            first = false;
            if bytes.iter().any(|byte| is_control((*byte).into())) {
                return Ok(Long::NotText);
            }
            let end = left + read;
            left = 0;
            if utf8 && let Err(error) = from_utf8(&block[..end]) {
                let valid = error.valid_up_to();
                utf8 = error.error_len().is_none() && read > 0;
                // The rest of a letter follows in the next block.
                if utf8 {
                    block.copy_within(valid..end, 0);
                    left = end - valid;
                }
            }
            if read == 0 {
                break;
            }
        }
        let file = Arc::new(Mutex::new(file));
        Ok(Long::Text(Self { file, utf8 }, sha256))
    }

    /// The text in blocks of whole lines.
    pub(super) fn each_block<E: From<io::Error>>(
        &self,
        mut take: impl FnMut(&str) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut bytes = Vec::with_capacity(BLOCK);
        let mut at = 0;
        loop {
            let before = bytes.len();
            bytes.resize(before + BLOCK, 0);
            let read = self.read(at, &mut bytes[before..])?;
            bytes.truncate(before + read);
            let last = bytes.iter().rposition(|byte| *byte == b'\n');
            let end = match last {
                Some(last) if read > 0 => last + 1,
                None if read > 0 => {
                    at += read as u64;
                    continue;
                }
                _ => bytes.len(),
            };
            let whole = &bytes[..end];
            let whole = if at == 0 { without_mark(whole) } else { whole };
            at += read as u64;
            if !whole.is_empty() {
                take(&with_newlines(self.decoded(whole)))?;
            }
            if read == 0 {
                return Ok(());
            }
            bytes.drain(..end);
        }
    }

    /// The first block.
    pub(super) fn start(&self) -> io::Result<String> {
        enum Stop {
            Enough(String),
            Fault(io::Error),
        }
        impl From<io::Error> for Stop {
            fn from(fault: io::Error) -> Self {
                Self::Fault(fault)
            }
        }
        match self.each_block(|block| Err(Stop::Enough(block.to_owned()))) {
            Ok(()) => Ok(String::new()),
            Err(Stop::Enough(block)) => Ok(block),
            Err(Stop::Fault(fault)) => Err(fault),
        }
    }

    fn read(&self, at: u64, bytes: &mut [u8]) -> io::Result<usize> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(at))?;
        read_most(&mut file, bytes)
    }

    fn decoded(&self, bytes: &[u8]) -> String {
        match from_utf8(bytes) {
            Ok(text) if self.utf8 => text.to_owned(),
            _ => letters(bytes),
        }
    }
}

/// Lines ended by `\n`.
pub(super) fn with_newlines(text: String) -> String {
    if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n")
    } else {
        text
    }
}

/// As many bytes as there are and fit.
fn read_most(file: &mut File, bytes: &mut [u8]) -> io::Result<usize> {
    let mut read = 0;
    while read < bytes.len() {
        match file.read(&mut bytes[read..]) {
            Ok(0) => break,
            Ok(more) => read += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(read)
}
