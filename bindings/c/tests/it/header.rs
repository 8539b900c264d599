//! `include/delta_cal.h` is what the Rust source makes of it, documentation included. After a change of the interface:
//!
//! ```text
//! DELTA_CAL_HEADER=write cargo test --package delta-cal-c --test it header
//! ```

mod page;
mod source;
mod types;

use source::Source;

const HEADER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/include/delta_cal.h");

#[test]
fn the_header_is_that_of_the_source() {
    let made = page::header(&Source::read());
    if std::env::var("DELTA_CAL_HEADER").is_ok_and(|value| value == "write") {
        std::fs::write(HEADER, &made).unwrap();
    }
    let found = std::fs::read_to_string(HEADER).unwrap_or_default();
    for (number, (found, made)) in (1..).zip(found.lines().zip(made.lines())) {
        assert_eq!(
            found, made,
            "line {number} of delta_cal.h; write it again with DELTA_CAL_HEADER=write"
        );
    }
    assert_eq!(found, made, "write it again with DELTA_CAL_HEADER=write");
}

/// C's layout, which the header asserts, is Rust's.
#[test]
fn the_header_states_the_sizes_that_rust_uses() {
    use delta_cal_c::{double, single};
    macro_rules! sizes {
        ($($name:literal $module:ident $structure:ident)+) => {
            [$(
                (concat!($name, "_f32"), size_of::<single::$module::$structure>()),
                (concat!($name, "_f64"), size_of::<double::$module::$structure>())
            ),+]
        };
    }
    let source = Source::read();
    let sizes = sizes! {
        "dcal_dimensions" robot Dimensions
        "dcal_sample" sample Sample
        "dcal_settings" sample Settings
        "dcal_arm_summary" outcome ArmSummary
        "dcal_verdict" gate Verdict
        "dcal_gate_counts" gate GateCounts
        "dcal_observation" observations Observation
        "dcal_plane" observations Plane
        "dcal_point" observations Point
        "dcal_instruments" observations Instruments
    };
    let error = ("dcal_error", size_of::<delta_cal_c::error::Error>());
    let mut asserted: Vec<_> = page::structures(&source);
    asserted.sort_unstable();
    let mut expected: Vec<_> = sizes
        .into_iter()
        .chain([error])
        .map(|(name, size)| (name.to_owned(), size))
        .collect();
    expected.sort_unstable();
    assert_eq!(asserted, expected);
}
