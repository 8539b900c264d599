//! What a release consists of, in target/release-VERSION. Each part is tried in an empty folder, as its users have it: by
//! a script in `release`, after `prelude.sh`.

use crate::Stage;

/// All parts. Some are the same everywhere, and built on one of the systems only.
pub(crate) const PARTS: [Stage; 8] = [PAPERS, COMMAND, PYTHON, LIBRARY, CRATES, WEB, BOARD, SUMS];

/// The parts that are built on this machine.
pub(crate) fn parts() -> impl Iterator<Item = &'static Stage> {
    PARTS.iter().filter(|part| match part.name {
        "c-library" => cfg!(target_os = "linux"),
        "crates" | "web" | "board" => cfg!(all(target_os = "linux", target_arch = "x86_64")),
        _ => true,
    })
}

/// What every script begins with: it stops at the first failure, and knows where it is.
pub(crate) const PRELUDE: &str = concat!(
    "set -eu; root=$PWD; release=$PWD/target/release-",
    env!("CARGO_PKG_VERSION"),
    "\n",
    include_str!("release/prelude.sh")
);

const PAPERS: Stage = Stage {
    name: "papers",
    about: "licences and bill of materials of what a release contains",
    commands: &[include_str!("release/papers.sh")],
};

const CRATES: Stage = Stage {
    name: "crates",
    about: "the crates for crates.io, each built from its package",
    commands: &[include_str!("release/crates.sh")],
};

const COMMAND: Stage = Stage {
    name: "command",
    about: "the command for this machine, with completions and manual pages",
    commands: &[include_str!("release/command.sh")],
};

const LIBRARY: Stage = Stage {
    name: "c-library",
    about: "the C library for this machine, found by CMake and pkg-config",
    commands: &[include_str!("release/library.sh")],
};

pub(crate) const WEB: Stage = Stage {
    name: "web",
    about: "the page: clippy, builds, and works in a browser (node, npm, python3, chromium)",
    commands: &[
        "cargo clippy --quiet --package delta-cal-host --package delta-cal-web --no-default-features \
         --target wasm32-unknown-unknown -- --deny warnings",
        "npm ci --prefix bindings/web --no-audit --no-fund",
        "node bindings/web/build.mjs",
        "npm run --silent check --prefix bindings/web",
        "cargo test --quiet --no-run --package delta-cal-host --test it",
        include_str!("release/web.sh"),
    ],
};

pub(crate) const PYTHON: Stage = Stage {
    name: "python",
    about: "the Python package: clippy, source archive, wheel from it, its tests, types, examples",
    commands: &[
        "cargo clippy --quiet --package delta-cal-python --all-targets -- --deny warnings",
        "cargo test --quiet --no-run --package delta-cal-host --test it",
        include_str!("release/python.sh"),
    ],
};

const BOARD: Stage = Stage {
    name: "board",
    about: "the controller for a real board, Raspberry Pi Pico 2, as UF2 (python3)",
    commands: &[
        "rustup target add thumbv8m.main-none-eabihf",
        "cargo build --quiet --locked --release --manifest-path firmware-example/boards/pico2/Cargo.toml \
         --target thumbv8m.main-none-eabihf --target-dir target/pico2",
        include_str!("release/board.sh"),
    ],
};

const SUMS: Stage = Stage {
    name: "sums",
    about: "SHA-256 of every file of a release",
    commands: &[include_str!("release/sums.sh")],
};
