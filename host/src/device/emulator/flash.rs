//! The controller's flash, which is memory in the emulator, kept in a file from run to run.

use super::monitor::Monitor;
use super::shown;
use object::{Object, ObjectSection};
use std::error::Error;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use tempfile::Builder;

/// The firmware's section for what a reset leaves as it is.
const SECTION: &str = ".uninit";

/// Where a firmware keeps what survives a restart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashRegion {
    /// Its first byte.
    pub address: u64,
    /// Its size in bytes.
    pub size: u64,
}

/// Why the flash is not kept.
#[derive(Debug)]
pub struct FlashFileError {
    file: PathBuf,
    cause: Cause,
}

#[derive(Debug)]
enum Cause {
    Unreadable(io::Error),
    Unwritable(io::Error),
    OtherSize { is: u64, needed: u64 },
    NotElf,
    NoRegion,
}

impl fmt::Display for FlashFileError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: ", shown(&self.file))?;
        match &self.cause {
            Cause::Unreadable(error) => write!(formatter, "cannot be read: {error}"),
            Cause::Unwritable(error) => write!(formatter, "cannot be written: {error}"),
            Cause::OtherSize { is, needed } => write!(
                formatter,
                "is not the flash of this firmware: it has {is} bytes, the flash {needed}"
            ),
            Cause::NotElf => formatter.write_str("is not an ELF file"),
            Cause::NoRegion => write!(formatter, "has no section {SECTION}, so no flash to keep"),
        }
    }
}

impl Error for FlashFileError {}

impl FlashFileError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self.cause {
            Cause::Unreadable(_) | Cause::Unwritable(_) => "check its name and its permissions",
            Cause::OtherSize { .. } => "name another file, or delete this one to begin with none",
            Cause::NotElf | Cause::NoRegion => {
                "name the firmware of firmware-example, or leave out --flash"
            }
        }
    }
}

impl FlashRegion {
    /// Looks it up in a firmware.
    ///
    /// # Errors
    /// No ELF file, or none with such a region.
    pub fn of(firmware: &Path) -> Result<Self, FlashFileError> {
        let fault = |cause| FlashFileError {
            file: firmware.to_owned(),
            cause,
        };
        let bytes = std::fs::read(firmware).map_err(|error| fault(Cause::Unreadable(error)))?;
        let elf = object::File::parse(&*bytes).map_err(|_| fault(Cause::NotElf))?;
        let section = elf.section_by_name(SECTION);
        let section = section.filter(|section| section.size() > 0);
        let section = section.ok_or_else(|| fault(Cause::NoRegion))?;
        Ok(Self {
            address: section.address(),
            size: section.size(),
        })
    }

    /// QEMU's arguments that put the file's content there; none if the file is not there yet.
    pub(super) fn loader(self, file: &Path) -> Result<Vec<String>, FlashFileError> {
        let fault = |cause| FlashFileError {
            file: file.to_owned(),
            cause,
        };
        let size = match file.metadata() {
            Ok(metadata) => metadata.len(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(fault(Cause::Unreadable(error))),
        };
        if size != self.size {
            return Err(fault(Cause::OtherSize {
                is: size,
                needed: self.size,
            }));
        }
        let name = file
            .to_str()
            .ok_or_else(|| fault(Cause::Unreadable(io::Error::other("the name is not UTF-8"))))?
            .replace(',', ",,");
        let address = self.address;
        Ok(vec![
            "-device".to_owned(),
            format!("loader,file={name},addr={address:#x},force-raw=on"),
        ])
    }

    /// Writes it to the file, whole or not at all.
    pub(super) fn save(self, monitor: &mut Monitor, file: &Path) -> Result<(), FlashFileError> {
        self.try_save(monitor, file)
            .map_err(|error| FlashFileError {
                file: file.to_owned(),
                cause: Cause::Unwritable(error),
            })
    }

    fn try_save(self, monitor: &mut Monitor, file: &Path) -> io::Result<()> {
        let folder = match file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let temporary = Builder::new()
            .prefix(".delta-cal-")
            .tempfile_in(folder.canonicalize()?)?;
        monitor.save_memory(self.address, self.size, temporary.path())?;
        if temporary.path().metadata()?.len() != self.size {
            return Err(io::Error::other("the emulator did not write it"));
        }
        temporary.persist(file).map_err(|error| error.error)?;
        Ok(())
    }
}
