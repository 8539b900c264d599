//! Files written whole or not at all.

use std::error::Error;
use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// A file that could not be written.
#[derive(Debug)]
pub struct OutputError {
    path: PathBuf,
    error: io::Error,
}

impl fmt::Display for OutputError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{}: cannot be written: {}",
            self.path.display(),
            self.error
        )
    }
}

impl Error for OutputError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        Some(&self.error)
    }
}

/// Writes every text to its file. Each is first written in full beside its destination; only when
/// all are there do they take their names. A file that exists is replaced, and keeps its old
/// content until then; a write-protected one is not replaced.
///
/// # Errors
/// The first file that could not be written; while the texts are being written nothing is changed.
pub fn write_all(files: &[(&Path, &str)]) -> Result<(), OutputError> {
    let bytes: Vec<_> = files
        .iter()
        .map(|(path, text)| (*path, text.as_bytes()))
        .collect();
    write_all_bytes(&bytes)
}

/// As [`write_all`], for files of which some are no texts.
///
/// # Errors
/// As [`write_all`].
pub fn write_all_bytes(files: &[(&Path, &[u8])]) -> Result<(), OutputError> {
    let mut prepared = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        let file = prepare(path, bytes).map_err(|error| failure(path, error))?;
        prepared.push((*path, file));
    }
    persist(prepared)
}

/// A folder for files, made if it is not there.
///
/// # Errors
/// It cannot be made, or something else has its name.
pub fn make_folder(path: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(path).map_err(|error| failure(path, error))
}

/// Whether a file could be written, for those who want to know before they do what cannot be undone.
///
/// # Errors
/// As [`write_all`].
pub fn check(path: &Path) -> Result<(), OutputError> {
    prepare(path, &[]).map_or_else(|error| Err(failure(path, error)), |_| Ok(()))
}

/// Writes a file that is no text, as [`write_all`] does.
///
/// # Errors
/// It could not be written; a file that exists is then as it was.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let file = prepare(path, bytes).map_err(|error| failure(path, error))?;
    persist(vec![(path, file)])
}

fn persist(prepared: Vec<(&Path, (PathBuf, NamedTempFile))>) -> Result<(), OutputError> {
    for (path, (target, file)) in prepared {
        file.persist(target)
            .map_err(|error| failure(path, error.error))?;
    }
    Ok(())
}

fn failure(path: &Path, error: io::Error) -> OutputError {
    OutputError {
        path: path.to_owned(),
        error,
    }
}

fn prepare(path: &Path, bytes: &[u8]) -> io::Result<(PathBuf, NamedTempFile)> {
    // A link stays a link: what it points to is replaced.
    let target = match path.canonicalize() {
        Ok(existing) if existing.is_dir() => return Err(io::Error::other("it is a folder")),
        Ok(existing) if existing.is_file() => {
            if existing.metadata()?.permissions().readonly() {
                let cause = "it exists and is write-protected, so it is not replaced";
                return Err(io::Error::other(cause));
            }
            existing
        }
        Ok(_) => return Err(io::Error::other("it exists and is not a regular file")),
        Err(_) => path.to_owned(),
    };
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let cause = format!("there is no folder {}", folder.display());
        return Err(io::Error::other(cause));
    }
    let mut builder = Builder::new();
    builder.prefix(".delta-cal-");
    #[cfg(unix)]
    {
        use std::fs::Permissions;
        use std::os::unix::fs::PermissionsExt;
        // As any new file: what the user's mask leaves of this.
        builder.permissions(Permissions::from_mode(0o666));
    }
    // Without the temporary file's name, which means nothing to anyone.
    let named = |error: io::Error| io::Error::from(error.kind());
    let mut file = builder.tempfile_in(folder).map_err(named)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    Ok((target, file))
}
