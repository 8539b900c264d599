//! Writes every bit of the fixture.
//!
//! ```text
//! cargo build --profile firmware -p delta-cal-target-tests --target thumbv7em-none-eabihf
//! qemu-system-arm -machine mps2-an386 -nographic -monitor none -serial none \
//!     -semihosting-config enable=on,target=native \
//!     -kernel target/thumbv7em-none-eabihf/firmware/delta-cal-target-tests
//! ```

#![cfg_attr(target_os = "none", no_std, no_main)]

delta_cal_target_tests::program!(delta_cal_target_tests::fixture::write);
