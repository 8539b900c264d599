//! Links for the bare target.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

/// A realistic part, not the board's 4 MiB, so that outgrowing it fails: 192 KiB of memory, in `f64` 232 KiB. The
/// stack lies below the statics: growing beyond its end it leaves the memory and faults instead of overwriting them.
fn memory(ram: &str) -> String {
    format!(
        "\
MEMORY
{{
  FLASH : ORIGIN = 0x00000000, LENGTH = 512K
  STACK : ORIGIN = 0x20000000, LENGTH = 88K
  RAM   : ORIGIN = 0x20016000, LENGTH = {ram}
}}
_stack_start = ORIGIN(STACK) + LENGTH(STACK);
_stack_end = ORIGIN(STACK);
"
    )
}

/// The interrupts of `board.rs`, for `cortex-m-rt`: unhandled they end the run.
const DEVICE: &str = "\
PROVIDE(UART0_RX = DefaultHandler);
PROVIDE(TIMER0 = DefaultHandler);
";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    // Without the board the package is a library: whoever links it has a memory map of their own.
    let board = env::var_os("CARGO_FEATURE_BOARD").is_some();
    if board && env::var("CARGO_CFG_TARGET_OS")? == "none" {
        let out = PathBuf::from(env::var("OUT_DIR")?);
        // Not files of this package: the linker would find them here before it looks in OUT_DIR.
        let double = env::var_os("CARGO_FEATURE_DOUBLE").is_some();
        let ram = if double { "144K" } else { "104K" };
        fs::write(out.join("memory.x"), memory(ram))?;
        fs::write(out.join("device.x"), DEVICE)?;
        println!("cargo::rustc-link-search={}", out.display());
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
        println!("cargo::rustc-link-arg-bins=--nmagic");
    }
    Ok(())
}
