//! Links for the bare target.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

/// A realistic part, not the board's 4 MiB, so that outgrowing it fails: KiB of flash, bytes of stack and
/// KiB of statics. The stack
/// lies below the statics: growing beyond its end it leaves the memory and faults instead of overwriting them.
/// `STORAGE` stands in for flash that is written.
fn memory(flash: u32, stack: u32, ram: u32) -> String {
    format!(
        "\
MEMORY
{{
  FLASH : ORIGIN = 0x00000000, LENGTH = {flash}K
  STACK : ORIGIN = 0x20000000, LENGTH = {stack}
  RAM   : ORIGIN = 0x20000000 + {stack}, LENGTH = {ram}K
  STORAGE : ORIGIN = 0x20080000, LENGTH = 8K
}}
_stack_start = ORIGIN(STACK) + LENGTH(STACK);
_stack_end = ORIGIN(STACK);
SECTIONS {{ .storage (NOLOAD) : {{ *(.storage) }} > STORAGE }}
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
    let with = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    // Without a program the package is a library: whoever links it has a memory map of their own.
    if !(with("BOARD") || with("SMALL")) || env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo::rustc-link-search={}", out.display());
    // Not files of this package: the linker would find them here before it looks in OUT_DIR.
    fs::write(out.join("memory.x"), "")?;
    fs::write(out.join("device.x"), DEVICE)?;
    let programs = [
        (
            "delta-cal-firmware-example",
            if with("DOUBLE") {
                memory(512, 80 << 10, 100)
            } else {
                memory(512, 48 << 10, 72)
            },
        ),
        ("touch", memory(48, 7_936, 17)),
        ("arms", memory(44, 15_200, 2)),
    ];
    for (program, memory) in programs {
        fs::write(out.join(format!("{program}.x")), memory)?;
        println!("cargo::rustc-link-arg-bin={program}=-T{program}.x");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bin=delta-cal-firmware-example=-Tdefmt.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    Ok(())
}
