//! What the core costs on a Cortex-M4F: instructions, stack, bytes. One line a figure,
//! `MEASURED <item> <value> <unit>, <words>`; `budgets.toml` limits some of them.
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
mod instructions;
#[cfg(target_os = "none")]
mod joint;
#[cfg(target_os = "none")]
mod memory;
#[cfg(target_os = "none")]
mod observations;
#[cfg(target_os = "none")]
mod peer_problem;
#[cfg(target_os = "none")]
mod peers;
#[cfg(target_os = "none")]
mod report;
#[cfg(target_os = "none")]
mod solve;
#[cfg(target_os = "none")]
mod stream;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("This measures a Cortex-M: build it with --target thumbv7em-none-eabihf.");
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use core::fmt::Write;
    use delta_cal_target_tests::{Counter, console};
    use report::Report;

    console::run(|console| {
        let Some(mut counter) = Counter::start() else {
            writeln!(
                console,
                "No instruction counts: they need -icount shift=6,sleep=off."
            )?;
            return Err(core::fmt::Error);
        };
        let mut report = Report::new(console);
        instructions::report::<f32>(&mut report, &mut counter)?;
        instructions::report::<f64>(&mut report, &mut counter)?;
        solve::report_single(&mut report, &mut counter)?;
        solve::report_double(&mut report, &mut counter)?;
        stream::report::<f32>(&mut report, &mut counter)?;
        stream::report::<f64>(&mut report, &mut counter)?;
        joint::report(&mut report, &mut counter)?;
        observations::report(&mut report, &mut counter)?;
        memory::report(&mut report)?;
        peers::report(&mut report, &mut counter)
    })
}
