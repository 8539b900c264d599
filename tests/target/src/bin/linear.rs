//! Linear drives, in both precisions: host and target must write the same.

#![cfg_attr(target_os = "none", no_std, no_main)]

delta_cal_target_tests::program!(delta_cal_target_tests::linear::write);
