//! The command `delta-cal`. All of it is in the library, with which it is compiled at the same time.

use std::process::ExitCode;

fn main() -> ExitCode {
    delta_cal_host::cli::run()
}
