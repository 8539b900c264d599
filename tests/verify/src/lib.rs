//! Support for tests that need more than Rust: checks for tools, builds for a bare target, runs under QEMU.

#![forbid(unsafe_code)]

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The Rust target for Cortex-M with a floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// The cargo profile of what ships for it.
pub const PROFILE: &str = "firmware";
/// The package whose programs run on both host and target.
pub const PACKAGE: &str = "delta-cal-target-tests";
/// If this variable is set, as `cargo verify` does, a test fails where it would otherwise be skipped.
pub const REQUIRE: &str = "DELTA_CAL_REQUIRE";
/// Time limit for runs that take at most a minute, so that firmware that hangs does not hang the tests.
const LONGEST_RUN: Duration = Duration::from_secs(600);

/// Whether the programs and bare Rust targets that a test needs are available. If not, prints one line, and the test
/// should return.
///
/// # Panics
/// If [`REQUIRE`] is set and one is missing.
#[allow(clippy::panic)] // fails the test
pub fn have(needs: &[&str]) -> bool {
    let missing: Vec<&str> = needs
        .iter()
        .filter(|need| !is_here(need))
        .copied()
        .collect();
    if missing.is_empty() {
        return true;
    }
    let what = format!("{} missing; cargo verify installs it", missing.join(", "));
    assert!(std::env::var_os(REQUIRE).is_none(), "{what}");
    // Bypasses the test harness, which would capture it.
    let test = std::thread::current();
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        format!("skipped {}: {what}\n", test.name().unwrap_or("a test")).as_bytes(),
    );
    false
}

/// Whether a program is in the path, a bare Rust target is installed, or Python has its module `ensurepip`. The variable
/// `CHROMIUM` names the browser that stands in for `chromium`.
pub fn is_here(need: &str) -> bool {
    if need.starts_with("thumb") || need.starts_with("riscv") {
        let mut rustc = at_root("rustc");
        rustc.args(["--print", "target-libdir", "--target", need]);
        return run(rustc).is_ok_and(|path| Path::new(path.trim()).is_dir());
    }
    if need == "ensurepip" {
        let mut python = at_root("python3");
        python.args(["-c", "import ensurepip"]);
        return run(python).is_ok();
    }
    if need == "chromium" && std::env::var_os("CHROMIUM").is_some() {
        return true;
    }
    let program = format!("{need}{}", std::env::consts::EXE_SUFFIX);
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(&program).is_file())
}

/// An emulated board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// Cortex-M4F: single precision in hardware.
    M4,
    /// Cortex-M7: both precisions in hardware.
    M7,
}

/// Timing of an emulated program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// As fast as possible.
    Free,
    /// The board's timer counts instructions, so that every run is identical.
    Instructions,
}

/// A command at the repository's root.
pub fn at_root(program: impl AsRef<std::ffi::OsStr>) -> Command {
    let mut command = Command::new(program);
    command
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .stdin(Stdio::null());
    command
}

/// Runs cargo at the repository's root with a target directory of its own, so that no other build replaces the programs
/// in the meantime.
///
/// # Errors
/// A description of the failure; the same for all functions here.
pub fn cargo(directory: &Path, arguments: &[&str]) -> Result<String, String> {
    let mut command = at_root(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .args(arguments)
        .arg("--quiet")
        .arg("--target-dir")
        .arg(directory);
    run(command)
}

/// Standard output of a program on a board; it must exit successfully.
///
/// # Errors
/// The program's failure.
pub fn emulate(board: Board, clock: Clock, program: &Path) -> Result<String, String> {
    let machine = match board {
        Board::M4 => "mps2-an386",
        Board::M7 => "mps2-an500",
    };
    let mut command = Command::new("qemu-system-arm");
    command
        .args(["-machine", machine])
        .args("-nographic -monitor none -serial none".split(' '))
        .args("-semihosting-config enable=on,target=native".split(' '));
    if clock == Clock::Instructions {
        command.args("-icount shift=6,sleep=off".split(' '));
    }
    command.arg("-kernel").arg(program).stdin(Stdio::null());
    within(command, LONGEST_RUN)
}

/// Standard output of a command that must succeed.
///
/// # Errors
/// The failure, with the end of the output: expected failures leave no trace on the terminal.
pub fn run(command: Command) -> Result<String, String> {
    within(command, Duration::MAX)
}

fn within(mut command: Command, limit: Duration) -> Result<String, String> {
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| format!("{}: {error}", command.get_program().display()))?;
    let (output, errors) = (reader(child.stdout.take()), reader(child.stderr.take()));
    let start = Instant::now();
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if start.elapsed() > limit => {
                let _ = child.kill();
                return Err(format!("{command:?} did not finish within {limit:?}"));
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(20)),
            Err(error) => return Err(format!("{command:?}: {error}")),
        }
    };
    let (Ok(output), Ok(errors)) = (output.join(), errors.join()) else {
        return Err(format!("{command:?}: cannot read its output"));
    };
    if status.success() {
        Ok(output)
    } else {
        let (output, errors) = (tail(&output), tail(&errors));
        Err(format!("{command:?}: {status}\n{output}{errors}"))
    }
}

/// Reads a pipe to its end, so that the writer never blocks.
fn reader(pipe: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // Output before an error is still worth showing.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Compares figures on a page, each with its name behind it, `137,060<!--f32/solve-20-mean-->`, with what a test measured:
/// for a name and the decimals shown, the figure and by how much it may be off; nothing for the name of another test. Returns
/// how many there were. With `DELTA_CAL_FIGURES=write` it writes them instead.
///
/// # Panics
/// If one is off, or no number.
#[allow(clippy::expect_used)] // fails the test
pub fn check_page(page: &str, measured: impl Fn(&str, usize) -> Option<(f64, f64)>) -> usize {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(page);
    let text = std::fs::read_to_string(&path).expect(page);
    let (mut count, mut written, mut wrong) = (0, String::new(), Vec::new());
    let mut rest = text.as_str();
    while let Some((before, (name, after))) = rest
        .split_once("<!--")
        .and_then(|(before, after)| Some((before, after.split_once("-->")?)))
    {
        let figure = |own: char| own.is_ascii_digit() || ",.".contains(own);
        let (text, shown) = before.split_at(before.trim_end_matches(figure).len());
        let decimals = shown.split_once('.').map_or(0, |(_, own)| own.len());
        written += text;
        if let Some((measured, off)) = measured(name, decimals) {
            count += 1;
            let stated: f64 = shown.replace(',', "").parse().expect(name);
            if (stated - measured).abs() > off {
                wrong.push(format!("{page}: {name} is {measured}, not {shown}"));
            }
            written += &grouped(measured, decimals);
        } else {
            written += shown;
        }
        written.extend(["<!--", name, "-->"]);
        rest = after;
    }
    if std::env::var("DELTA_CAL_FIGURES").is_ok_and(|value| value == "write") {
        std::fs::write(&path, written + rest).expect(page);
    } else {
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
    count
}

/// The same of all of some figures: name, figure, and by how much it may be off.
///
/// # Panics
/// If one is off or missing.
pub fn check_figures(page: &str, figures: &[(&str, f64, f64)]) {
    let found = check_page(page, |name, _| {
        let own = figures.iter().find(|own| own.0 == name)?;
        Some((own.1, own.2))
    });
    assert!(found >= figures.len(), "{page}: {found} of {figures:?}");
}

/// The same of the least and the most of some figures, each of which may be off by so much.
///
/// # Panics
/// If one is off or missing.
pub fn check_range(page: &str, name: &str, figures: &[f64], off: f64) {
    let [least, most] = [f64::min, f64::max].map(|of| figures.iter().copied().fold(figures[0], of));
    let [first, last] = ["least", "most"].map(|end| format!("{name}/{end}"));
    check_figures(page, &[(&first, least, off), (&last, most, off)]);
}

/// With commas between thousands.
fn grouped(number: f64, decimals: usize) -> String {
    let shown = format!("{number:.decimals$}");
    let whole = shown.find('.').unwrap_or(shown.len());
    let comma = |(place, digit): (usize, char)| {
        let is_due = place > 0 && place < whole && (whole - place).is_multiple_of(3);
        is_due.then_some(',').into_iter().chain([digit])
    };
    shown.chars().enumerate().flat_map(comma).collect()
}

/// The last 2,000 bytes of a text, approximately.
pub fn tail(text: &str) -> &str {
    let start = text.len().saturating_sub(2000);
    text.get(start..).unwrap_or(text)
}

#[cfg(test)]
mod tests {
    #[test]
    fn thousands_are_grouped() {
        for (number, decimals, text) in [
            (7.0, 0, "7"),
            (137_060.0, 0, "137,060"),
            (2_289_723.0, 0, "2,289,723"),
            (1340.14, 1, "1,340.1"),
            (0.25, 2, "0.25"),
        ] {
            assert_eq!(super::grouped(number, decimals), text);
        }
    }
}
