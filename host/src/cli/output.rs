//! Output of commands: each file completely or not at all, several files all or none, and one output to standard output
//! in place of the report; the progress of long commands.

use super::failure::Failure;
use super::paths::{folder_of, identity, is_stream};
use crate::CalibrateError;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tempfile::{Builder, NamedTempFile, TempPath};

/// Writes the files, then prints either the output meant for standard output, or the report and the names of the files.
pub(crate) fn deliver<C: AsRef<[u8]>>(
    outputs: &[(Option<&Path>, C)],
    report: impl Into<String>,
) -> Result<(), Failure> {
    let given = outputs.iter();
    let given = given.filter_map(|(path, text)| Some(((*path)?, text.as_ref())));
    let (streams, files): (Vec<_>, Vec<_>) = given.partition(|(path, _)| is_stream(path));
    write_all(&files)?;
    if let [(_, text), ..] = streams.as_slice() {
        return print(&String::from_utf8_lossy(text));
    }
    let mut report = report.into();
    for (path, _) in &files {
        let _ = writeln!(report, "Written: {}", path.display());
    }
    print(&report)
}

/// Where to write what is itself the report: to standard output if to no file, and if the JSON is not there.
pub(crate) fn or_stream<'a>(output: Option<&'a Path>, json: Option<&Path>) -> Option<&'a Path> {
    let free = !json.is_some_and(is_stream);
    output.or(free.then_some(Path::new("-")))
}

/// Text that is printed, with what goes to no file below it.
pub(crate) fn with_content(text: String, content: &str, output: Option<&Path>) -> String {
    match output {
        Some(_) => text,
        None => format!("{text}\n{content}"),
    }
}

/// Reports a refusal, which replaces the report of an earlier run where JSON is wanted; no other file is written.
pub(crate) fn refused(to: Option<&Path>, error: CalibrateError) -> Failure {
    let json = error.refused().then(|| error.to_json());
    let written = match (to, json) {
        (Some(path), Some(json)) if is_stream(path) => print(&json),
        (Some(path), Some(json)) => write_all(&[(path, json)]),
        _ => Ok(()),
    };
    written.map_or_else(|failure| failure, |()| error.into())
}

/// The command line of this process.
pub(crate) fn command() -> String {
    let words = std::env::args_os().skip(1);
    let words = words.map(|own| own.to_string_lossy().into_owned());
    format!("delta-cal {}", words.collect::<Vec<_>>().join(" "))
}

/// Prints to standard output, in colour only where it is supported and wanted.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = anstream::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::output(format!(
            "standard output: cannot be written: {error}"
        ))),
        _ => Ok(()),
    }
}

/// Writes all files. Each is first written in full beside its destination; only when all are complete are they renamed.
/// An existing file is replaced and keeps its permissions; a write-protected one is not replaced. Pipes and devices are
/// written to.
///
/// # Errors
/// The first file that could not be written; all files are then as they were.
pub(super) fn write_all<C: AsRef<[u8]>>(files: &[(&Path, C)]) -> Result<(), Failure> {
    let (others, files): (Vec<_>, Vec<_>) = files.iter().partition(|(path, _)| takes_bytes(path));
    let prepared = files.iter();
    let prepared = prepared.map(|(path, bytes)| Prepared::new(path, bytes.as_ref()));
    let prepared = prepared.collect::<Result<_, _>>()?;
    for (path, bytes) in others {
        let file = fs::OpenOptions::new().write(true).open(path);
        let written = file.and_then(|mut file| file.write_all(bytes.as_ref()));
        written.map_err(|error| failure(path, &error))?;
    }
    commit(prepared)
}

pub(super) fn make_folder(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|error| failure(path, &error))
}

/// Checks that an output could be written, before doing something that takes long or cannot be undone.
pub(super) fn check_writable(path: &Path) -> Result<(), Failure> {
    if !(is_stream(path) || takes_bytes(path)) {
        Prepared::new(path, &[])?;
    }
    Ok(())
}

/// A file that is written but does not have its final name yet.
struct Prepared {
    path: PathBuf,
    /// The destination: a symbolic link is kept and its target replaced.
    target: PathBuf,
    file: NamedTempFile,
    /// The file to be replaced, under another name.
    kept: Option<TempPath>,
}

impl Prepared {
    fn new(path: &Path, bytes: &[u8]) -> Result<Self, Failure> {
        Self::write(path, bytes).map_err(|error| failure(path, &error))
    }

    fn write(path: &Path, bytes: &[u8]) -> io::Result<Self> {
        let target = identity(path);
        let existing = target.exists().then_some(target.as_path());
        let replaced = existing.map(replaceable).transpose()?;
        let folder = folder_of(&target);
        if !folder.is_dir() {
            let cause = format!("there is no folder {}", folder.display());
            return Err(io::Error::other(cause));
        }
        #[cfg_attr(not(unix), expect(unused_mut, reason = "only Unix has a mode"))]
        let mut builder = hidden();
        #[cfg(unix)]
        if replaced.is_none() {
            use std::os::unix::fs::PermissionsExt;
            // The mode of any new file; the user's mask applies.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        // Omit the temporary file's name, which means nothing to the user.
        let named = |error: io::Error| io::Error::from(error.kind());
        let mut file = builder.tempfile_in(folder).map_err(named)?;
        file.write_all(bytes)?;
        let mut kept = None;
        if let Some(permissions) = replaced {
            file.as_file().set_permissions(permissions)?;
            // Not every file system supports hard links.
            let keep = |name: &Path| {
                fs::hard_link(&target, name).or_else(|_| fs::copy(&target, name).map(|_| ()))
            };
            kept = Some(hidden().make_in(folder, keep)?.into_temp_path());
        }
        file.as_file().sync_all()?;
        Ok(Self {
            path: path.to_owned(),
            target,
            file,
            kept,
        })
    }
}

/// Renames all files to their final names. If one fails, those already renamed are restored.
fn commit(prepared: Vec<Prepared>) -> Result<(), Failure> {
    let mut done = Vec::new();
    for Prepared {
        path,
        target,
        file,
        kept,
    } in prepared
    {
        if let Err(error) = file.persist(&target) {
            for (target, kept) in done {
                // Report the original failure even if restoring fails, too.
                let _ = match kept {
                    Some(kept) => TempPath::persist(kept, target).map_err(|error| error.error),
                    None => fs::remove_file(target),
                };
            }
            return Err(failure(&path, &error.error));
        }
        done.push((target, kept));
    }
    Ok(())
}

/// Whether this is a pipe, a device or the like.
fn takes_bytes(path: &Path) -> bool {
    let metadata = path.metadata();
    metadata.is_ok_and(|own| !(own.is_file() || own.is_dir()))
}

/// The permissions of a file, if it may be replaced.
fn replaceable(existing: &Path) -> io::Result<fs::Permissions> {
    let metadata = existing.metadata()?;
    let cause = if metadata.is_dir() {
        "it is a folder"
    } else if metadata.permissions().readonly() {
        "it exists and is write-protected, so it is not replaced"
    } else {
        return Ok(metadata.permissions());
    };
    Err(io::Error::other(cause))
}

fn hidden() -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(".delta-cal-");
    builder
}

fn failure(path: &Path, error: &io::Error) -> Failure {
    Failure::output(format!("{}: cannot be written: {error}", path.display()))
}

/// The variable from the Reproducible Builds specification that replaces the clock's time.
const SOURCE_DATE_EPOCH: &str = "SOURCE_DATE_EPOCH";

/// The time of the report, in seconds since 1970-01-01 UTC.
pub(super) fn now() -> Result<u64, Failure> {
    // The end of the year 9999, where calendars end.
    const LAST: u64 = 253_402_300_799;
    let Some(value) = std::env::var_os(SOURCE_DATE_EPOCH) else {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        return Ok(since.map_or(0, |since| since.as_secs()));
    };
    let seconds = value.to_str().and_then(|text| text.parse().ok());
    seconds.filter(|seconds| *seconds <= LAST).ok_or_else(|| {
        Failure::usage(
            format!("{SOURCE_DATE_EPOCH} is {}, not a time", value.display()),
            "set it to whole seconds since the beginning of 1970, or unset it",
        )
    })
}

/// A progress bar, or a spinner for computations of unknown duration: on a terminal, nothing elsewhere. Removed when
/// dropped.
pub(super) struct Progress(ProgressBar);

impl Progress {
    fn new(template: &str) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        Self(bar.with_finish(ProgressFinish::AndClear))
    }

    /// A bar; `what` is being counted, such as `robots`.
    pub(super) fn bar(what: &str) -> Self {
        Self::new(&format!(
            "[{{bar:40}}] {{pos}}/{{len}} {what}, {{eta}} left"
        ))
    }

    /// A spinner; `what` is being done, such as `planning 20 poses`.
    pub(super) fn spinner(what: impl Into<Cow<'static, str>>) -> Self {
        let own = Self::new("{spinner} {msg}, {elapsed}");
        own.0.set_message(what);
        own.0.enable_steady_tick(Duration::from_millis(200));
        own
    }

    pub(super) fn show(&self, finished: u64, whole: u64) {
        self.0.set_length(whole);
        self.0.set_position(finished);
    }

    /// Shows what is being computed now.
    pub(super) fn now(&self, what: &'static str) {
        self.0.set_message(what);
    }
}

#[cfg(test)]
mod tests {
    use super::{Prepared, commit, write_all};
    use std::fs;
    use std::path::Path;

    #[test]
    fn if_a_file_cannot_take_its_name_all_are_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name| folder.path().join(name);
        let (old, new, last) = (path("old"), path("new"), path("last"));
        fs::write(&old, "of yesterday").unwrap();
        let prepared = [&old, &new, &last].map(|path| Prepared::new(path, b"of today").unwrap());
        // Meanwhile a folder takes the name of the last file.
        fs::create_dir(&last).unwrap();
        let error = commit(prepared.into()).unwrap_err();
        assert!(format!("{error:?}").contains("last: "), "{error:?}");
        assert_eq!(fs::read_to_string(&old).unwrap(), "of yesterday");
        assert!(!new.exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);

        fs::remove_dir(&last).unwrap();
        write_all(&[(&old, "1"), (&new, "2"), (&last, "3")]).unwrap();
        let written = [&old, &new, &last].map(|path| fs::read_to_string(path).unwrap());
        assert_eq!(written, ["1", "2", "3"]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    /// A device takes the bytes; a link that leads to no file yet stays a link.
    #[cfg(unix)]
    #[test]
    fn devices_and_links_stay_what_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let (link, target) = (folder.path().join("link"), folder.path().join("target"));
        std::os::unix::fs::symlink("target", &link).unwrap();
        write_all(&[(Path::new("/dev/null"), "lost"), (&link, "kept")]).unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "kept");
        assert!(link.is_symlink() && !target.is_symlink());
        write_all(&[(folder.path(), "1")]).unwrap_err();
        let (read, written) = std::io::pipe().unwrap();
        let path = format!("/dev/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&written));
        write_all(&[(Path::new(&path), "through")]).unwrap();
        drop(written);
        assert_eq!(std::io::read_to_string(read).unwrap(), "through");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_keeps_its_mode_and_a_protected_one_is_not() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret.toml");
        for mode in [0o600, 0o664] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            write_all(&[(&path, "new")]).unwrap();
            let metadata = fs::metadata(&path).unwrap();
            assert_eq!(metadata.permissions().mode() & 0o777, mode);
            assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        }
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        let error = write_all(&[(&path, "newer")]).unwrap_err();
        assert!(
            format!("{error:?}").contains("write-protected"),
            "{error:?}"
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    }
}
