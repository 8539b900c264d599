//! The controller's flash, which is memory in the emulator, kept in a file from run to run.

use super::monitor::Monitor;
use crate::files::output::{OutputError, write_bytes};
use object::elf::{FileHeader32, PT_LOAD, ProgramHeader32};
use object::read::elf::FileHeader;
use object::{LittleEndian, Object, ObjectSection};
use std::error::Error;
use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// The firmware's section for what a reset leaves as it is.
const SECTION: &str = ".uninit";

/// A file that is to hold the controller's flash, and where a firmware has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FlashFile {
    file: PathBuf,
    address: u64,
    size: u64,
}

/// Why the flash is not kept.
#[derive(Debug)]
pub struct FlashError {
    file: PathBuf,
    cause: Cause,
}

#[derive(Debug)]
enum Cause {
    Unreadable(io::Error),
    OtherSize {
        is: usize,
        needed: u64,
    },
    NotElf,
    NoRegion,
    /// The copy of the firmware with the flash in it.
    NoCopy(io::Error),
}

impl fmt::Display for FlashError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: ", self.file.display())?;
        match &self.cause {
            Cause::Unreadable(error) => write!(formatter, "cannot be read: {error}"),
            Cause::OtherSize { is, needed } => write!(
                formatter,
                "is not the flash of this firmware: it has {is} bytes, the flash {needed}"
            ),
            Cause::NotElf => formatter.write_str("is not an ELF file for a Cortex-M"),
            Cause::NoRegion => write!(formatter, "has no section {SECTION}, so no flash to keep"),
            Cause::NoCopy(error) => write!(formatter, "cannot be copied: {error}"),
        }
    }
}

impl Error for FlashError {}

impl FlashError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self.cause {
            Cause::Unreadable(_) => "check its name and its permissions",
            Cause::OtherSize { .. } => "name another file, or delete this one to begin with none",
            Cause::NotElf | Cause::NoRegion => {
                "name the firmware of firmware-example, or leave out --flash"
            }
            Cause::NoCopy(_) => "check that the folder for temporary files has space",
        }
    }
}

impl FlashFile {
    /// Looks up in a firmware where the flash is. If the file is there: a copy of the firmware
    /// with the file's content in it, as a board is programmed with both.
    pub(super) fn prepare(
        file: &Path,
        firmware: &Path,
    ) -> Result<(Self, Option<NamedTempFile>), FlashError> {
        let fault = |file: &Path, cause| FlashError {
            file: file.to_owned(),
            cause,
        };
        let program =
            std::fs::read(firmware).map_err(|error| fault(firmware, Cause::Unreadable(error)))?;
        let (address, size) = region(&program).map_err(|cause| fault(firmware, cause))?;
        let flash = Self {
            file: file.to_owned(),
            address,
            size,
        };
        let content = match std::fs::read(file) {
            Ok(content) => content,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((flash, None)),
            Err(error) => return Err(fault(file, Cause::Unreadable(error))),
        };
        if u64::try_from(content.len()) != Ok(size) {
            let is = content.len();
            return Err(fault(file, Cause::OtherSize { is, needed: size }));
        }
        let program = with_content(program, address, &content)
            .ok_or_else(|| fault(firmware, Cause::NotElf))?;
        let copy = || {
            let mut copy = NamedTempFile::new()?;
            copy.write_all(&program)?;
            copy.flush()?;
            Ok(copy)
        };
        let copy = copy().map_err(|error| fault(firmware, Cause::NoCopy(error)))?;
        Ok((flash, Some(copy)))
    }

    /// Writes what is in the flash now to the file, whole or not at all.
    pub(super) fn save(&self, monitor: &mut Monitor) -> Result<(), SaveError> {
        let mut read = || {
            let folder = tempfile::tempdir()?;
            let name = folder.path().join("flash");
            monitor.save_memory(self.address, self.size, &name)?;
            std::fs::read(&name)
        };
        let content = read().map_err(SaveError::Memory)?;
        write_bytes(&self.file, &content).map_err(SaveError::File)
    }
}

/// Why the flash was not saved.
#[derive(Debug)]
pub(super) enum SaveError {
    Memory(io::Error),
    File(OutputError),
}

/// Address and size of the flash.
fn region(program: &[u8]) -> Result<(u64, u64), Cause> {
    let elf = object::File::parse(program).map_err(|_| Cause::NotElf)?;
    let section = elf.section_by_name(SECTION);
    let section = section.filter(|section| section.size() > 0);
    let section = section.ok_or(Cause::NoRegion)?;
    Ok((section.address(), section.size()))
}

/// The program with memory at `address` that is not cleared but loaded. `None` if it is not a
/// program for a Cortex-M, or has no memory there.
fn with_content(mut program: Vec<u8>, address: u64, content: &[u8]) -> Option<Vec<u8>> {
    let (start, count) = {
        let header = FileHeader32::<LittleEndian>::parse(&*program).ok()?;
        (
            usize::try_from(header.e_phoff(LittleEndian)).ok()?,
            usize::from(header.e_phnum(LittleEndian)),
        )
    };
    let end = program.len();
    let headers = program.get_mut(start..)?;
    let (headers, _) =
        object::pod::slice_from_bytes_mut::<ProgramHeader32<LittleEndian>>(headers, count).ok()?;
    let header = headers.iter_mut().find(|header| {
        let first = u64::from(header.p_vaddr.get(LittleEndian));
        let behind = first + u64::from(header.p_memsz.get(LittleEndian));
        header.p_type.get(LittleEndian) == PT_LOAD && (first..behind).contains(&address)
    })?;
    // Everything before the flash is cleared at the start anyway: it had nothing in the file.
    if header.p_filesz.get(LittleEndian) != 0 {
        return None;
    }
    let offset = address - u64::from(header.p_vaddr.get(LittleEndian));
    let zeros = usize::try_from(offset).ok()?;
    let length = header.p_memsz.get(LittleEndian);
    header.p_offset.set(LittleEndian, u32::try_from(end).ok()?);
    header.p_filesz.set(LittleEndian, length);
    program.resize(end + zeros, 0);
    program.extend_from_slice(content);
    program.resize(end + usize::try_from(length).ok()?, 0);
    Some(program)
}
