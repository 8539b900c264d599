//! The command `delta-cal`: reads the command line, calls the library, prints and writes.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
