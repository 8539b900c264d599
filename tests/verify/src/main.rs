//! Every check of the project in one command: `cargo verify`.

mod papers;
mod release;

use delta_cal_verify::{REQUIRE, at_root, is_here, tail};
use release::{PARTS, PRELUDE, PYTHON, WEB};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

const USAGE: &str = "\
Runs every check of the code, two stages at a time, and prints a summary. Output is in target/verify/STAGE.log.

Usage: cargo verify [all | quick | release | STAGE...]

  all         then also the page in a browser and the Python package, or says which of them it skips
  quick       format, clippy on this machine, unit tests (about a minute)
  release     builds what a release consists of into target/release-VERSION, and tries it (docs/release.md)
  STAGE...    only these, in sequence, with output on the terminal
  --help      print this and the stages
";

/// Named commands that run in sequence.
struct Stage {
    name: &'static str,
    about: &'static str,
    /// Words are separated by spaces; several lines are a shell script, after `release::PRELUDE`.
    commands: &'static [&'static str],
}

/// Takes seconds and finishes before compilation begins.
const FORMAT: Stage = Stage {
    name: "format",
    about: "rustfmt",
    commands: &[
        "cargo fmt --all --check",
        "cargo fmt --manifest-path tests/fuzz/programs/Cargo.toml --check",
        "cargo fmt --manifest-path firmware-example/boards/pico2/Cargo.toml --check",
    ],
};

const CLIPPY: Stage = Stage {
    name: "clippy",
    about: "clippy on this machine",
    commands: &[
        "cargo clippy --quiet --workspace --exclude delta-cal-python --exclude delta-cal-web* --all-targets \
         -- --deny warnings",
    ],
};

const BARE: Stage = Stage {
    name: "bare",
    about: "clippy on the Cortex-M code",
    commands: &[
        "cargo clippy --quiet --all-features --package delta-cal --package delta-cal-protocol --package delta-cal-c \
         --package delta-cal-target-tests --package delta-cal-link-tests --package delta-cal-controller \
         --package delta-cal-firmware-example \
         --target thumbv7em-none-eabihf -- --deny warnings",
    ],
};

const DOCS: Stage = Stage {
    name: "docs",
    about: "rustdoc without warnings",
    commands: &[
        "env RUSTDOCFLAGS=-Dwarnings cargo doc --quiet --no-deps --workspace --exclude delta-cal-python \
         --exclude delta-cal-web*",
    ],
};

const TESTS: Stage = Stage {
    name: "tests",
    about: "all tests: units, programs, examples in the documentation, firmware under QEMU, the C library, \
            budgets, no panic; LinuxCNC where it is installed",
    // Optimised, but with debug assertions and overflow checks: `profile.test`.
    commands: &["cargo test --no-fail-fast"],
};

const FIRMWARE: Stage = Stage {
    name: "firmware",
    about: "builds the Cortex-M programs for the tests, and the archives for the panic proof",
    commands: &[
        "cargo build --quiet --profile firmware --package delta-cal-target-tests --bin measure --bin flash \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
        "cargo build --quiet --profile firmware --package delta-cal-link-tests \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
        "cargo build --quiet --profile firmware --package delta-cal-firmware-example --features board \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
        "cargo build --quiet --profile firmware --package delta-cal-firmware-example --features double \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
        "cargo build --quiet --profile small --package delta-cal-firmware-example --features small --bin touch --bin arms \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
        "cargo build --quiet --profile small --package delta-cal-target-tests --bin measure \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
        "cargo build --quiet --profile small --package delta-cal-link-tests \
         --target thumbv7em-none-eabihf --target-dir target/firmware",
    ],
};

const C: Stage = Stage {
    name: "c",
    about: "builds the C library for firmware, which the tests link",
    commands: &[
        "cargo rustc --quiet --lib --package delta-cal-c --profile firmware --target thumbv7em-none-eabihf \
         --features panic-handler --crate-type staticlib --target-dir target/firmware",
        "env CARGO_BUILD_BUILD_DIR=target/firmware \
         cargo rustc --quiet --lib --package delta-cal-c --profile firmware --target thumbv7em-none-eabihf \
         --features panic-handler --config target.thumbv7em-none-eabihf.rustflags=['-Ctarget-cpu=cortex-m7'] \
         --crate-type staticlib --target-dir target/firmware/cortex-m7",
        "cargo rustc --quiet --lib --package delta-cal-c --profile firmware --target thumbv7em-none-eabi \
         --features panic-handler --crate-type staticlib --target-dir target/firmware",
    ],
};

/// Two lists that run in parallel. The tests build in one folder while the second list builds in another, and then find its
/// programs there; what follows in that list has the first folder to itself while the tests run.
const SIDE_BY_SIDE: [&[Stage]; 2] = [&[TESTS], &[FIRMWARE, C, CLIPPY, BARE, DOCS]];

const UNITS: Stage = Stage {
    name: "units",
    about: "the unit tests of core and host",
    commands: &["cargo test --quiet --lib"],
};

/// Runs only on request, and in the workflow: everything else is built with the features that it needs.
const FEATURES: Stage = Stage {
    name: "features",
    about: "the core with none and with each of its features; the host without its command; the controller for boards \
            without a floating-point unit",
    commands: &[
        "cargo check --quiet --package delta-cal-host --no-default-features --features device",
        "rustup target add thumbv7em-none-eabihf thumbv6m-none-eabi riscv32imac-unknown-none-elf",
        "cargo check --quiet --package delta-cal --target thumbv7em-none-eabihf",
        "cargo check --quiet --package delta-cal --features defmt --target thumbv7em-none-eabihf",
        "cargo check --quiet --package delta-cal --features linear --target thumbv7em-none-eabihf",
        "cargo check --quiet --package delta-cal --features simulate --target thumbv7em-none-eabihf",
        "cargo check --quiet --package delta-cal --features transmission --target thumbv7em-none-eabihf",
        "cargo check --quiet --package delta-cal-controller --target thumbv6m-none-eabi",
        "cargo check --quiet --package delta-cal-controller --target riscv32imac-unknown-none-elf",
    ],
};

/// Runs only on request.
const MIRI: Stage = Stage {
    name: "miri",
    about: "memory accesses of the C library under Miri (nightly, five minutes)",
    // 32-bit Arm is closest to a Cortex-M; natively, the core's square root is an instruction unknown to Miri.
    commands: &[
        "cargo +nightly miri test --target arm-unknown-linux-gnueabi --target-dir target/miri --package delta-cal-c \
         --test it -- misuse calibrations",
    ],
};

/// A required program and the Debian packages that provide it: of the tests, of the page, and of the Python package.
const PROGRAMS: [(&str, &str); 5] = [
    ("qemu-system-arm", "qemu-system-arm"),
    ("c++", "g++"),
    (
        "arm-none-eabi-gcc",
        "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    ),
    ("cmake", "cmake"),
    ("pkg-config", "pkg-config"),
];
const FOR_WEB: [(&str, &str); 5] = [
    ("node", "nodejs"),
    ("npm", "npm"),
    ("xz", "xz-utils"),
    ("python3", "python3"),
    ("chromium", "chromium"),
];
const FOR_PYTHON: [(&str, &str); 2] = [("python3", "python3"), ("ensurepip", "python3-venv")];
const TARGETS: [&str; 3] = [
    "thumbv7em-none-eabihf",
    "thumbv7em-none-eabi",
    "wasm32-unknown-unknown",
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(|it| &**it).collect();
    let stages = [FORMAT, CLIPPY, UNITS, FEATURES, MIRI];
    let all = || {
        let usual = stages.iter().chain(SIDE_BY_SIDE.into_iter().flatten());
        usual.chain(&PARTS)
    };
    let begin = Instant::now();
    let mut failed = Vec::new();
    match arguments[..] {
        ["write-papers", target, folder] => {
            let written = papers::write(target, Path::new(folder));
            let written = written.inspect_err(|error| eprintln!("{error}"));
            return ExitCode::from(u8::from(written.is_err()));
        }
        ["release"] => {
            install(&TARGETS, &[&PROGRAMS[..], &FOR_PYTHON, &FOR_WEB].concat());
            failed.extend(release::parts().filter_map(in_silence));
        }
        [] | ["all"] => {
            install(&TARGETS, &PROGRAMS);
            failed.extend(in_silence(&FORMAT));
            failed.extend(side_by_side());
            if arguments == ["all"] {
                failed.extend(with_programs(&PYTHON, &FOR_PYTHON));
                failed.extend(with_programs(&WEB, &FOR_WEB));
            }
        }
        _ if arguments.iter().any(|it| ["-h", "--help"].contains(it)) => {
            print!("{USAGE}\nStages:\n");
            for (index, stage) in all().enumerate() {
                if all().take(index).all(|before| before.name != stage.name) {
                    println!("  {:<9}  {}", stage.name, stage.about);
                }
            }
            return ExitCode::SUCCESS;
        }
        _ => {
            for name in arguments {
                let quick = [FORMAT, CLIPPY, UNITS];
                let chosen: Vec<&Stage> = match name {
                    "quick" => quick.iter().collect(),
                    _ => all().find(|stage| stage.name == name).into_iter().collect(),
                };
                if chosen.is_empty() {
                    eprintln!("Unknown stage {name:?}; cargo verify --help lists all stages.");
                    return ExitCode::from(2);
                }
                failed.extend(chosen.into_iter().filter_map(on_the_terminal));
            }
        }
    }
    let seconds = begin.elapsed().as_secs_f64();
    if failed.is_empty() {
        println!("all passed  {seconds:.0} s");
        return ExitCode::SUCCESS;
    }
    println!("failed: {}  {seconds:.0} s", failed.join(", "));
    ExitCode::FAILURE
}

/// Installs what stages need besides Rust. If that fails, they report what is missing.
fn install(targets: &[&str], programs: &[(&str, &str)]) {
    let missing: Vec<&str> = targets.iter().filter(|it| !is_here(it)).copied().collect();
    if !missing.is_empty() {
        let _ = attempt(&format!("rustup target add {}", missing.join(" ")), None);
    }
    let missing = programs.iter().filter(|(program, _)| !is_here(program));
    let packages: Vec<&str> = missing.map(|(_, package)| *package).collect();
    if packages.is_empty() {
        return;
    }
    let line = format!(
        "apt-get install --yes --no-install-recommends {}",
        packages.join(" ")
    );
    let id = at_root("id").arg("-u").output();
    if is_here("apt-get") && id.is_ok_and(|it| it.stdout.trim_ascii() == b"0") {
        let _ = attempt("apt-get update --quiet=2", None);
        let _ = attempt(&format!("env DEBIAN_FRONTEND=noninteractive {line}"), None);
    } else {
        println!("Missing packages; install them: {line}");
    }
}

/// Runs a stage if its programs are there or can be installed; otherwise prints one line.
fn with_programs(stage: &Stage, programs: &[(&str, &str)]) -> Option<&'static str> {
    install(&[], programs);
    let missing = programs.iter().filter(|(program, _)| !is_here(program));
    let missing: Vec<&str> = missing.map(|(program, _)| *program).collect();
    if missing.is_empty() {
        return in_silence(stage);
    }
    println!("{:<9}  skipped: {} missing", stage.name, missing.join(", "));
    None
}

/// Runs both lists in parallel and returns the names of failed stages.
fn side_by_side() -> Vec<&'static str> {
    let failed = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for list in SIDE_BY_SIDE {
            let failed = &failed;
            scope.spawn(move || {
                for stage in list {
                    let name = in_silence(stage);
                    let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
                    failed.extend(name);
                }
            });
        }
    });
    failed.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a stage; prints only what was skipped, and on failure the end of the log. Returns its name if it fails.
fn in_silence(stage: &Stage) -> Option<&'static str> {
    let begin = Instant::now();
    let path = logs().join(format!("{}.log", stage.name));
    let done = fs::create_dir_all(logs())
        .and_then(|()| File::create(&path))
        .map_err(|error| error.to_string())
        .and_then(|file| run(stage, Some(&file)));
    let printed = fs::read_to_string(&path).unwrap_or_default();
    let skipped = printed.lines().filter(|line| line.starts_with("skipped"));
    println!("{}", verdict(stage, begin.elapsed(), done.is_ok()));
    skipped.for_each(|line| println!("    {line}"));
    let why = done.err()?;
    println!("{}\n{why}\nfull log: {}", tail(&printed), path.display());
    Some(stage.name)
}

fn on_the_terminal(stage: &Stage) -> Option<&'static str> {
    let begin = Instant::now();
    let done = run(stage, None);
    println!("{}", verdict(stage, begin.elapsed(), done.is_ok()));
    let why = done.err()?;
    println!("{why}");
    Some(stage.name)
}

fn verdict(stage: &Stage, time: Duration, passed: bool) -> String {
    let verdict = if passed { "ok" } else { "FAILED" };
    format!(
        "{:<9}  {verdict:<6}  {:>6.1} s",
        stage.name,
        time.as_secs_f64()
    )
}

/// Runs all commands, even if an earlier one fails.
fn run(stage: &Stage, into: Option<&File>) -> Result<(), String> {
    let failed = stage
        .commands
        .iter()
        .filter_map(|line| attempt(line, into).err());
    let failed: Vec<String> = failed.collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(failed.join("\n"))
    }
}

/// Runs a command that must succeed, with its output in the file or on the terminal.
fn attempt(line: &str, into: Option<&File>) -> Result<(), String> {
    let mut words = line.split_whitespace();
    let mut command = if line.contains('\n') {
        let mut shell = at_root("sh");
        shell.arg("-c").arg(format!("{PRELUDE}{line}"));
        shell
    } else {
        let mut command = at_root(words.next().unwrap_or_default());
        command.args(words);
        command
    };
    command.env(REQUIRE, "1");
    if let Some(file) = into {
        let copy = || file.try_clone().map_err(|error| error.to_string());
        command.stdout(copy()?).stderr(copy()?);
    } else {
        println!("$ {line}");
    }
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{line}: {status}")),
        Err(error) => Err(format!("{line}: {error}")),
    }
}

fn logs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/verify")
}
