//! The stages.

use crate::budgets;
use crate::check::{Check, attempt, output};
use crate::licences;
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
        about: "the bare Rust target and QEMU; installs what is missing where it can",
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
        name: "licences",
        about: "every dependency's licence is on the list of deny.toml",
        run: licences::check,
    },
];

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
    if let Some(version) = qemu_version() {
        println!("{version}");
    } else {
        install_qemu(check);
    }
}

fn target_installed() -> bool {
    output(&format!("rustc --print target-libdir --target {TARGET}"))
        .is_some_and(|directory| Path::new(directory.trim()).is_dir())
}

fn qemu_version() -> Option<String> {
    let text = output("qemu-system-arm --version")?;
    text.lines().next().map(str::to_owned)
}

fn install_qemu(check: &mut Check) {
    if output("apt-get --version").is_some() {
        let root = output("id -u").is_some_and(|id| id.trim() == "0");
        let sudo = if root { "" } else { "sudo -n " };
        let apt = format!("{sudo}env DEBIAN_FRONTEND=noninteractive apt-get --yes --quiet");
        // Neither's failure counts: what counts is whether QEMU is there afterwards.
        let _ = attempt(&format!("{apt} update"));
        let _ = attempt(&format!(
            "{apt} install --no-install-recommends qemu-system-arm"
        ));
    }
    match qemu_version() {
        Some(version) => println!("{version}"),
        None => check.fail(
            "qemu-system-arm is missing. Install it: apt-get install qemu-system-arm \
             (macOS: brew install qemu)"
                .to_owned(),
        ),
    }
}

fn format(check: &mut Check) {
    check.command("cargo fmt --all --check");
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
    for features in ["", "--features defmt", "--features serde", "--all-features"] {
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
