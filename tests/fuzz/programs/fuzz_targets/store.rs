//! See the function.
#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| delta_cal_fuzz::store(data));
