//! The stages.

use crate::budgets;
use crate::check::{Check, output};
use crate::docs;
use crate::features::{self, ELSEWHERE, EVERYTHING};
use crate::fuzz;
use crate::licences;
use crate::linuxcnc;
use crate::mutants;
use crate::package;
use crate::programs::{self, Campaigns};
use crate::setup;
use crate::structure;
use crate::versions;
use delta_cal_verify::firmware::{BOARD_TARGET, TARGET};

/// One group of checks.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) run: fn(&mut Check),
}

/// What comes before all others: it installs what they need, or takes no time.
pub(crate) const FIRST: &[Stage] = &[
    Stage {
        name: "setup",
        about: "the bare Rust targets, QEMU, C and C++ compilers, CMake; says what is missing, asks, installs it",
        run: setup::check,
    },
    FORMAT,
    STRUCTURE,
];

/// Two lists that run side by side. What the first compiles stands in one folder, where two builds would wait for each
/// other; what the second compiles stands in others, until its tests need programs that the first has compiled by then.
pub(crate) const SIDE_BY_SIDE: [&[Stage]; 2] = [
    &[
        Stage {
            name: "lint",
            about: "clippy on host and bare target",
            run: lint,
        },
        Stage {
            name: "docs",
            about: "rustdoc without warnings; links and code blocks of every page",
            run: docs::check,
        },
        Stage {
            name: "tests",
            about: "all tests but those under QEMU and of the C library, and the examples in the documentation",
            run: tests,
        },
        Stage {
            name: "licences",
            about: "every dependency's licence is on the list of deny.toml",
            run: licences::check,
        },
        Stage {
            name: "versions",
            about: "no dependency demands a newer Rust than Cargo.toml states",
            run: versions::check,
        },
        Stage {
            name: "package",
            about: "core and protocol can be published; no public item changed that a release has promised",
            run: package::check,
        },
    ],
    &[
        Stage {
            name: "board",
            about: "the controller on a real board: the program for a Raspberry Pi Pico 2 is built, without a warning",
            run: board,
        },
        Stage {
            name: "budgets",
            about: "instructions, stack and flash on a Cortex-M4F against budgets.toml; no panic path",
            run: budgets::check,
        },
        Stage {
            name: "features",
            about: "the core with none, each, all but one and all of its features, on the bare target with none and all; the controller for other boards",
            run: features::check,
        },
        Stage {
            name: "firmware",
            about: "under QEMU a Cortex-M4F and a Cortex-M7 give the host's bits, and calibrate when the host drives them",
            run: firmware,
        },
        Stage {
            name: "c",
            about: "the C library: header, misuse, and C and C++ programs that give the core's bits, on this machine and under QEMU",
            run: c,
        },
        Stage {
            name: "linuxcnc",
            about: "LinuxCNC's component: built by its compiler, and asked by its motion controller, without a screen",
            run: linuxcnc::check,
        },
    ],
];

const FORMAT: Stage = Stage {
    name: "format",
    about: "rustfmt",
    run: format,
};

const STRUCTURE: Stage = Stage {
    name: "structure",
    about: "no cycle between the files or the folders of any crate",
    run: structure::check,
};

/// `cargo verify quick`: what to run after every change.
pub(crate) const QUICK: &[Stage] = &[
    FORMAT,
    STRUCTURE,
    Stage {
        name: "pages",
        about: "links and code blocks of every page",
        run: docs::pages,
    },
    Stage {
        name: "clippy",
        about: "clippy on the host",
        run: clippy,
    },
    Stage {
        name: "units",
        about: "the unit tests of core and host",
        run: units,
    },
];

/// What takes too long to be among them.
pub(crate) const BY_HAND: &[Stage] = &[
    Stage {
        name: "long",
        about: "the tests with campaigns of full size (an hour)",
        run: long,
    },
    Stage {
        name: "fuzz",
        about: "arbitrary files, frames, flash contents and numbers, guided by what they reach, a minute each",
        run: fuzz::check,
    },
    Stage {
        name: "oldest",
        about: "a build with the oldest Rust that Cargo.toml states, which rustup fetches",
        run: versions::oldest,
    },
    Stage {
        name: "advisories",
        about: "no dependency has a known weakness (cargo-deny, network)",
        run: licences::advisories,
    },
    Stage {
        name: "profiles",
        about: "what the core costs at three levels of optimisation, without and with link-time optimisation; panic paths",
        run: budgets::profiles,
    },
    Stage {
        name: "miri",
        about: "every access to memory of the C library is allowed (Miri of the nightly toolchain, five minutes)",
        run: miri,
    },
    Stage {
        name: "mutants",
        about: "cargo-mutants: the tests notice every change of the core's arithmetic, or it is explained (hours)",
        run: mutants::check,
    },
];

/// What is compiled for the bare target.
const ON_TARGET: &str = "--package delta-cal --package delta-cal-protocol --package delta-cal-c \
    --package delta-cal-target-tests --package delta-cal-link-tests --package delta-cal-firmware-example";

fn format(check: &mut Check) {
    check.command("cargo fmt --all --check");
    check.command("cargo fmt --manifest-path tests/fuzz/programs/Cargo.toml --check");
    check.command("cargo fmt --manifest-path firmware-example/boards/pico2/Cargo.toml --check");
}

fn clippy(check: &mut Check) {
    // One selection for the stages `lint` and `docs`, so that what the packages depend on is checked once.
    check.command(&format!(
        "cargo clippy --quiet --all-targets {EVERYTHING} -- --deny warnings"
    ));
}

fn lint(check: &mut Check) {
    clippy(check);
    // Several packages in one command, so that what they depend on is checked once; that each builds without the
    // features of the others, the stages `features`, `firmware`, `c` and `budgets` say.
    check.command(&format!(
        "cargo clippy --quiet {ON_TARGET} --all-features {ELSEWHERE} {TARGET} -- --deny warnings"
    ));
}

fn units(check: &mut Check) {
    // Of core and host. The same packages as for all tests, so that nothing is built twice.
    check.chosen_tests(2, "cargo test --lib");
}

fn tests(check: &mut Check) {
    // Optimised, but with debug assertions and overflow checks: `profile.test`.
    programs::run(check, Campaigns::Short);
}

fn long(check: &mut Check) {
    programs::run(check, Campaigns::Long);
}

fn firmware(check: &mut Check) {
    check.chosen_tests(
        2,
        "cargo test --test across_crates --test it -- --nocapture on_target::",
    );
}

/// A workspace of its own, which names its target.
fn board(check: &mut Check) {
    check.command(&format!(
        "env RUSTFLAGS=-Dwarnings cargo build --quiet --locked --manifest-path firmware-example/boards/pico2/Cargo.toml --target {BOARD_TARGET} --target-dir target/pico2 --release"
    ));
}

fn c(check: &mut Check) {
    // Without naming the package, so that nothing is built again with the features that it needs by itself.
    check.chosen_tests(
        9,
        "cargo test --test agreement --test fixture --test header --test misuse --test objects --test page --test sizes \
         --test snapshots --test status -- --nocapture",
    );
}

fn miri(check: &mut Check) {
    if output("cargo +nightly miri --version").is_none() {
        return check.fail(
            "Miri is missing; install it: rustup toolchain install nightly --component miri,rust-src".to_owned(),
        );
    }
    // Of a 32-bit Arm, which is nearest to a Cortex-M: on this machine the core's square root is an instruction that
    // Miri does not know.
    check.command(
        "cargo +nightly miri test --target arm-unknown-linux-gnueabi --target-dir target/miri --package delta-cal-c \
         --test misuse --test objects",
    );
}
