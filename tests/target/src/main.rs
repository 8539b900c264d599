//! Calibrates the built-in measurements on a Cortex-M and prints the result and every bit of the
//! fixture.
//!
//! ```text
//! cargo build --profile firmware -p delta-cal-target-tests --target thumbv7em-none-eabihf
//! qemu-system-arm -machine mps2-an386 -nographic -monitor none -serial none \
//!     -semihosting-config enable=on,target=native \
//!     -kernel target/thumbv7em-none-eabihf/firmware/delta-cal-target-tests
//! ```
//!
//! Built for a host it writes the fixture's bits alone, for comparison.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target;

#[cfg(not(target_os = "none"))]
fn main() -> std::fmt::Result {
    use delta_cal_target_tests::fixture;

    eprintln!(
        "The firmware is built with --target thumbv7em-none-eabihf. These are the host's bits:"
    );
    let mut lines = String::new();
    fixture::run::<f32>(&mut lines)?;
    fixture::run::<f64>(&mut lines)?;
    print!("{lines}");
    Ok(())
}
