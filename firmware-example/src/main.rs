//! The firmware; for a host there is only the library.
#![cfg_attr(target_os = "none", no_std, no_main)]
#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("The firmware is built with --target thumbv7em-none-eabihf.");
}
