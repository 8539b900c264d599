//! Standard output.

use super::failure::Failure;
use std::io::{self, Write};

/// Prints to standard output, with colour only where it is wanted.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = anstream::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Output(format!(
            "standard output: cannot be written: {error}"
        ))),
        _ => Ok(()),
    }
}
