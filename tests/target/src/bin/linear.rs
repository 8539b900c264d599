//! Linear drives, in both precisions: host and target must write the same.

#![cfg_attr(target_os = "none", no_std, no_main)]

use core::fmt;
use delta_cal_target_tests::linear;

fn write(out: &mut dyn fmt::Write) -> fmt::Result {
    linear::run::<f32>(out)?;
    linear::run::<f64>(out)
}

delta_cal_target_tests::program!(write);
