//! The stages.

use crate::budgets;
use crate::check::{Check, attempt, output};
use crate::fuzz;
use crate::licences;
use crate::mutants;
use std::path::Path;

const TARGET: &str = "thumbv7em-none-eabihf";

/// One group of checks.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) run: fn(&mut Check),
}

pub(crate) const STAGES: &[Stage] = &[
    Stage {
        name: "setup",
        about: "the bare Rust target, QEMU and a C++ compiler; installs what is missing where it can",
        run: setup,
    },
    Stage {
        name: "format",
        about: "rustfmt",
        run: format,
    },
    Stage {
        name: "lint",
        about: "clippy on host and bare target",
        run: lint,
    },
    Stage {
        name: "docs",
        about: "rustdoc, without warnings",
        run: docs,
    },
    Stage {
        name: "tests",
        about: "all tests but those under QEMU, and the examples in the documentation",
        run: tests,
    },
    Stage {
        name: "features",
        about: "the core with every combination of its features, on host and bare target",
        run: features,
    },
    Stage {
        name: "firmware",
        about: "under QEMU a Cortex-M4F and a Cortex-M7 give the host's bits, and calibrate when the host drives them",
        run: firmware,
    },
    Stage {
        name: "budgets",
        about: "instructions, stack and flash on a Cortex-M4F against budgets.toml; no panic path",
        run: budgets::check,
    },
    Stage {
        name: "fuzz",
        about: "arbitrary files, frames, flash contents and numbers, for some seconds each",
        run: fuzz::check,
    },
    Stage {
        name: "licences",
        about: "every dependency's licence is on the list of deny.toml",
        run: licences::check,
    },
];

/// What takes too long to be among them.
pub(crate) const BY_HAND: &[Stage] = &[Stage {
    name: "mutants",
    about: "cargo-mutants: the tests notice every change of the core's arithmetic, or it is explained (hours)",
    run: mutants::check,
}];

fn setup(check: &mut Check) {
    if target_installed() {
        println!("the Rust target {TARGET} is installed");
    } else {
        let line = format!("rustup target add {TARGET}");
        let _ = attempt(&line);
        if !target_installed() {
            check.fail(format!(
                "the Rust target {TARGET} is missing. Install it: {line}"
            ));
        }
    }
    for tool in [&QEMU, &COMPILER] {
        install(check, tool);
    }
}

fn target_installed() -> bool {
    output(&format!("rustc --print target-libdir --target {TARGET}"))
        .is_some_and(|directory| Path::new(directory.trim()).is_dir())
}

/// A program of the system's own packages.
struct Tool {
    /// Prints its version.
    version: &'static str,
    package: &'static str,
    elsewhere: &'static str,
}

const QEMU: Tool = Tool {
    version: "qemu-system-arm --version",
    package: "qemu-system-arm",
    elsewhere: "macOS: brew install qemu",
};

/// libFuzzer is C++.
const COMPILER: Tool = Tool {
    version: "c++ --version",
    package: "g++",
    elsewhere: "macOS: xcode-select --install",
};

impl Tool {
    fn found(&self) -> Option<String> {
        let text = output(self.version)?;
        text.lines().next().map(str::to_owned)
    }
}

fn install(check: &mut Check, tool: &Tool) {
    let package = tool.package;
    if tool.found().is_none() && output("apt-get --version").is_some() {
        let root = output("id -u").is_some_and(|id| id.trim() == "0");
        let sudo = if root { "" } else { "sudo -n " };
        let apt = format!("{sudo}env DEBIAN_FRONTEND=noninteractive apt-get --yes --quiet");
        // Neither's failure counts: what counts is whether the tool is there afterwards.
        let _ = attempt(&format!("{apt} update"));
        let _ = attempt(&format!("{apt} install --no-install-recommends {package}"));
    }
    match tool.found() {
        Some(version) => println!("{version}"),
        None => check.fail(format!(
            "{package} is missing. Install it: apt-get install {package} ({})",
            tool.elsewhere
        )),
    }
}

fn format(check: &mut Check) {
    check.command("cargo fmt --all --check");
    check.command("cargo fmt --manifest-path fuzz/Cargo.toml --check");
}

fn lint(check: &mut Check) {
    for what in [
        "--all-targets".to_owned(),
        "--package delta-cal-target-tests --all-targets".to_owned(),
        "--package delta-cal --all-features".to_owned(),
        format!("--package delta-cal --all-features --target {TARGET}"),
        format!("--package delta-cal-protocol --target {TARGET}"),
        format!("--package delta-cal-target-tests --target {TARGET}"),
        format!("--package delta-cal-link-tests --target {TARGET}"),
        format!("--package delta-cal-firmware-example --target {TARGET}"),
        format!("--package delta-cal-firmware-example --features double --target {TARGET}"),
    ] {
        check.command(&format!("cargo clippy --quiet {what} -- --deny warnings"));
    }
    check.command(
        "cargo clippy --quiet --locked --manifest-path fuzz/Cargo.toml --all-targets -- --deny warnings",
    );
}

fn docs(check: &mut Check) {
    check.command("env RUSTDOCFLAGS=-Dwarnings cargo doc --quiet --workspace --no-deps");
}

fn tests(check: &mut Check) {
    // Optimised, but with debug assertions and overflow checks: `profile.test`.
    check.command("cargo test --no-fail-fast -- --skip on_target::");
    check.chosen_tests("cargo test --doc --package delta-cal-firmware-example");
}

fn features(check: &mut Check) {
    for features in [
        "",
        "--features classical",
        "--features defmt",
        "--features serde",
        "--features simulate",
        "--all-features",
    ] {
        check.command(&format!(
            "cargo check --quiet --package delta-cal {features}"
        ));
    }
    check.chosen_tests(
        "cargo test --package delta-cal-tests --test target -- on_target::core_builds",
    );
}

fn firmware(check: &mut Check) {
    check.chosen_tests(
        "cargo test --package delta-cal-tests --test target -- --nocapture on_target::same_bits",
    );
    check.chosen_tests(
        "cargo test --package delta-cal-host --test device_on_target -- --nocapture on_target::",
    );
}
