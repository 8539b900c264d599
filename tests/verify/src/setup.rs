//! What the checks need beside Rust: found, or installed.

use crate::check::{Check, attempt, output};
use crate::linuxcnc;
use delta_cal_verify::firmware::{OTHER_TARGETS, TARGET};
use std::io::{IsTerminal, Write};
use std::path::Path;

/// The Rust target of a Cortex-M without a floating-point unit.
const SOFT_TARGET: &str = "thumbv7em-none-eabi";

/// Something that a check needs.
struct Need {
    /// In words.
    what: &'static str,
    /// What of it there is; `None` if it is missing.
    found: fn() -> Option<String>,
    /// The commands that install it; `None` where it is not known how.
    install: fn() -> Option<Vec<String>>,
    /// How to install it by hand.
    by_hand: &'static str,
}

const NEEDS: [Need; 8] = [
    Need {
        what: "the bare Rust target, for firmware",
        found: || target(TARGET),
        install: || Some(vec![format!("rustup target add {TARGET}")]),
        by_hand: "rustup target add thumbv7em-none-eabihf",
    },
    Need {
        what: "the bare Rust target without floating-point unit, for firmware in C",
        found: || target(SOFT_TARGET),
        install: || Some(vec![format!("rustup target add {SOFT_TARGET}")]),
        by_hand: "rustup target add thumbv7em-none-eabi",
    },
    Need {
        what: "three more bare Rust targets, of other boards",
        found: || {
            let found: Option<Vec<_>> = OTHER_TARGETS.into_iter().map(target).collect();
            found.map(|found| found.join(", "))
        },
        install: || {
            Some(vec![format!(
                "rustup target add {}",
                OTHER_TARGETS.join(" ")
            )])
        },
        by_hand: "rustup target add thumbv6m-none-eabi riscv32imac-unknown-none-elf thumbv8m.main-none-eabihf",
    },
    Need {
        what: "QEMU for Arm, which runs firmware",
        found: || version("qemu-system-arm --version"),
        install: || packages("qemu-system-arm"),
        by_hand: "apt-get install qemu-system-arm (macOS: brew install qemu)",
    },
    Need {
        what: "a C++ compiler, for C++ programs that use the C library, and for libFuzzer",
        found: || version("c++ --version"),
        install: || packages("g++"),
        by_hand: "apt-get install g++ (macOS: xcode-select --install)",
    },
    Need {
        what: "a C compiler for Arm with its library, for firmware in C",
        found: c_for_arm,
        install: || packages("gcc-arm-none-eabi libnewlib-arm-none-eabi"),
        by_hand: "apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi (macOS: brew install --cask gcc-arm-embedded)",
    },
    Need {
        what: "CMake, which builds the C library and its firmware",
        found: || version("cmake --version"),
        install: || packages("cmake"),
        by_hand: "apt-get install cmake (macOS: brew install cmake)",
    },
    Need {
        what: "pkg-config, which finds the installed C library",
        found: || version("pkg-config --version").map(|number| format!("pkg-config {number}")),
        install: || packages("pkg-config"),
        by_hand: "apt-get install pkg-config (macOS: brew install pkg-config)",
    },
];

/// What a stage can do without, by being skipped: large, and installed only if somebody says so.
const OPTIONAL: Need = Need {
    what: "LinuxCNC and its component compiler (60 MB to fetch, 210 MB on the disk); without it the stage linuxcnc is skipped",
    found: linuxcnc::found,
    install: || packages(linuxcnc::PACKAGE),
    by_hand: "apt-get install linuxcnc-uspace-dev",
};

/// Says what is there, and what it would install; asks on a terminal, and installs.
pub(crate) fn check(check: &mut Check) {
    needed(check);
    offer();
}

/// Installs what is optional if somebody at a terminal agrees. Nothing fails without it.
fn offer() {
    if let Some(found) = (OPTIONAL.found)() {
        return println!("{found}");
    }
    println!("\nNot needed, and not here: {}", OPTIONAL.what);
    match (OPTIONAL.install)() {
        Some(lines) => {
            for line in &lines {
                println!("    {line}");
            }
            if somebody_sits_here() && agreed() {
                for line in &lines {
                    let _ = attempt(line);
                }
            }
        }
        None => println!("    {}, by hand", OPTIONAL.by_hand),
    }
}

fn needed(check: &mut Check) {
    let mut missing = Vec::new();
    for need in &NEEDS {
        match (need.found)() {
            Some(found) => println!("{found}"),
            None => missing.push(need),
        }
    }
    if missing.is_empty() {
        return;
    }
    println!("\nMissing, with the commands that install it:");
    let mut commands: Vec<String> = Vec::new();
    for need in &missing {
        println!("  {}", need.what);
        match (need.install)() {
            Some(lines) => {
                for line in lines {
                    println!("    {line}");
                    if !commands.contains(&line) {
                        commands.push(line);
                    }
                }
            }
            None => println!("    {}, by hand", need.by_hand),
        }
    }
    if !commands.is_empty() && agreed() {
        for line in &commands {
            // A failure does not count: what counts is whether the tool is there afterwards.
            let _ = attempt(line);
        }
    }
    for need in missing {
        match (need.found)() {
            Some(found) => println!("{found}"),
            None => check.fail(format!(
                "missing: {}. Install it: {}",
                need.what, need.by_hand
            )),
        }
    }
}

/// Whether the user agrees; whoever cannot be asked does.
fn agreed() -> bool {
    if !somebody_sits_here() {
        return true;
    }
    print!("Install this now? [y/N] ");
    let mut answer = String::new();
    let read = std::io::stdout()
        .flush()
        .and_then(|()| std::io::stdin().read_line(&mut answer));
    read.is_ok() && is_yes(&answer)
}

fn somebody_sits_here() -> bool {
    let automatic = std::env::var("CI").is_ok_and(|value| !matches!(&*value, "" | "false" | "0"));
    must_ask(std::io::stdin().is_terminal(), automatic)
}

/// Somebody sits at the terminal, and this is no automatic build (`CI` is set).
fn must_ask(terminal: bool, automatic: bool) -> bool {
    terminal && !automatic
}

fn is_yes(answer: &str) -> bool {
    matches!(answer.trim().to_lowercase().as_str(), "y" | "yes")
}

fn target(name: &str) -> Option<String> {
    let libraries = output(&format!("rustc --print target-libdir --target {name}"))?;
    let installed = Path::new(libraries.trim()).is_dir();
    installed.then(|| format!("Rust target {name}"))
}

/// The compiler, if its C library is there as well.
fn c_for_arm() -> Option<String> {
    let library = output("arm-none-eabi-gcc --print-file-name=libc_nano.a")?;
    let found = Path::new(library.trim()).is_file();
    found.then(|| version("arm-none-eabi-gcc --version"))?
}

/// The first line of what a command prints.
fn version(command: &str) -> Option<String> {
    let text = output(command)?;
    text.lines().next().map(str::to_owned)
}

/// The commands that install a package of a Debian-like system.
fn packages(name: &str) -> Option<Vec<String>> {
    output("apt-get --version")?;
    let root = output("id -u").is_some_and(|id| id.trim() == "0");
    let sudo = if root { "" } else { "sudo " };
    let apt = format!("{sudo}env DEBIAN_FRONTEND=noninteractive apt-get --yes --quiet");
    Some(vec![
        format!("{apt} update"),
        format!("{apt} install --no-install-recommends {name}"),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_who_sits_at_a_terminal_is_asked() {
        assert!(must_ask(true, false));
        assert!(!must_ask(true, true));
        assert!(!must_ask(false, false));
        assert!(!must_ask(false, true));
    }

    #[test]
    fn only_a_yes_agrees() {
        assert!(is_yes("y\n") && is_yes("Yes\n"));
        assert!(!is_yes("\n") && !is_yes("no\n") && !is_yes(""));
    }
}
