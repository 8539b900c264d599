//! Random calibrations of every kind, 1,000 in single precision and 100 in double, one line each:
//! host and target must write the same.

#![cfg_attr(target_os = "none", no_std, no_main)]

use core::fmt;
use delta_cal_target_tests::cases;

const SINGLE: u64 = 1000;
const DOUBLE: u64 = 100;

fn write(out: &mut dyn fmt::Write) -> fmt::Result {
    cases::run::<f32>(out, SINGLE)?;
    cases::run::<f64>(out, DOUBLE)
}

delta_cal_target_tests::program!(write);
