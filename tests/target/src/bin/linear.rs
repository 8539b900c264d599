//! Linear drives, in both precisions: host and target must write the same.

#![cfg_attr(target_os = "none", no_std, no_main)]

use core::fmt;
use delta_cal_target_tests::linear;

fn write(out: &mut dyn fmt::Write) -> fmt::Result {
    linear::run::<f32>(out)?;
    linear::run::<f64>(out)
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    delta_cal_target_tests::console::run(|console| write(console))
}

#[cfg(not(target_os = "none"))]
fn main() -> fmt::Result {
    let mut lines = String::new();
    write(&mut lines)?;
    print!("{lines}");
    Ok(())
}
