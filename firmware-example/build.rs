//! Links for the bare target; `memory` has the memory map of each program.

use std::env;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=memory");
    let with = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    // Without a program the package is a library: whoever links it has a memory map of their own.
    if !(with("BOARD") || with("SMALL")) || env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let scalar = if with("DOUBLE") { "double" } else { "single" };
    let programs = [
        ("delta-cal-firmware-example", scalar),
        ("touch", "touch"),
        ("arms", "arms"),
    ];
    let memory = concat!(env!("CARGO_MANIFEST_DIR"), "/memory");
    println!("cargo::rustc-link-search={memory}");
    for (program, map) in programs {
        println!("cargo::rustc-link-arg-bin={program}=-L{memory}/{map}");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bin=delta-cal-firmware-example=-Tdefmt.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    Ok(())
}
