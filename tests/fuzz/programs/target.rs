//! Every target: the function of the program's name.
#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| delta_cal_fuzz::target(env!("CARGO_BIN_NAME"))(data));
