//! What a command writes: files, all or none, and one of its outputs to standard output in place of its report.

use super::failure::Failure;
use super::output;
use super::paths::{is_stream, refuse_same};
use super::print::print;
use std::fmt::Write;
use std::path::Path;

/// An option or what it names, and the path that was given.
pub(crate) type Place<'a> = (&'static str, Option<&'a Path>);

/// That no output is an input or another output, and that at most one goes to standard output.
pub(crate) fn check(inputs: &[Place<'_>], outputs: &[Place<'_>]) -> Result<(), Failure> {
    let mut taken = inputs.to_vec();
    for (option, path) in outputs {
        for other in &taken {
            refuse_same(option, *path, *other, "give the output another name")?;
        }
        taken.push((option, *path));
    }
    let streams = outputs
        .iter()
        .filter(|(_, path)| path.is_some_and(is_stream));
    let streams: Vec<&str> = streams.map(|(option, _)| *option).collect();
    if let [first, second, ..] = streams.as_slice() {
        return Err(Failure::Usage {
            cause: format!("{first} - and {second} - both write to standard output"),
            remedy: "give one of them the name of a file".to_owned(),
        });
    }
    Ok(())
}

/// Writes the files, and prints what goes to standard output, or the report and where everything is.
pub(crate) fn deliver(
    outputs: &[(Option<&Path>, &str)],
    report: impl Into<String>,
) -> Result<(), Failure> {
    let given = outputs
        .iter()
        .filter_map(|(path, text)| Some(((*path)?, *text)));
    let (streams, files): (Vec<_>, Vec<_>) = given.partition(|(path, _)| is_stream(path));
    output::write_all(&files)?;
    if let [(_, text), ..] = streams.as_slice() {
        return print(text);
    }
    let mut report = report.into();
    for (path, _) in &files {
        let _ = writeln!(report, "Written: {}", path.display());
    }
    print(&report)
}

/// A refusal writes no file; a program that reads the JSON on standard output is told there as well.
pub(crate) fn refused(to: Option<&Path>, refusal: &str, failure: Failure) -> Failure {
    if to.is_some_and(is_stream)
        && let Err(failure) = print(refusal)
    {
        return failure;
    }
    failure
}
