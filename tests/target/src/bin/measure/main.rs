//! What the core costs on a Cortex-M4F in single precision: instructions, bytes of state and of stack. One line a figure,
//! `MEASURED <item> <value>`; `budgets.toml` has the limits.
//!
//! ```text
//! qemu-system-arm -machine mps2-an386 -nographic -monitor none -serial none \
//!     -semihosting-config enable=on,target=native -icount shift=6,sleep=off \
//!     -kernel target/thumbv7em-none-eabihf/firmware/measure
//! ```
//!
//! Instructions are not cycles: division, square root and flash wait states cost more on silicon.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod kinematics;
#[cfg(target_os = "none")]
mod observations;
#[cfg(target_os = "none")]
mod positions;
#[cfg(target_os = "none")]
mod report;
#[cfg(target_os = "none")]
mod stream;
#[cfg(target_os = "none")]
mod usual;

#[cfg(target_os = "none")]
use delta_cal::calibration::{Ikm, Joint};

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("This measures a Cortex-M: build it with --target thumbv7em-none-eabihf.");
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    delta_cal_target_tests::bare::run(|console| {
        let mut report = report::Report::new(console)?;
        usual::measure::<Ikm>(&mut report, "", 40)?;
        usual::measure::<Joint>(&mut report, "joint-", 4)?;
        if cfg!(feature = "usual-alone") {
            return Ok(());
        }
        kinematics::measure(&mut report)?;
        positions::measure::<Ikm>(&mut report, "", 4, 300)?;
        positions::measure::<Joint>(&mut report, "joint-", 1, 60)?;
        observations::measure(&mut report)?;
        stream::measure(&mut report)
    })
}
