//! The gate: the same verdicts as the core, an alarm that is answered, and samples over a power cut.

use crate::place::{Place, in_c, input, no_error, noise_and_tolerance, ok, output, robot, row};
use delta_cal_c::double::gate::*;
use delta_cal_c::error::Error;
use delta_cal_c::plain::{NO_ALARM, REJECTED, ROBOT_CHANGED, TAKEN};
use delta_cal_c::status;
use delta_cal_target_tests::samples as measured;

const NOTHING: Verdict = Verdict {
    verdict: 0,
    reason: 0,
    arm: 0,
    reserved: 0,
    distance: 0.0,
    normalized: 0.0,
};

fn made() -> Place<Own> {
    let (mut robot, mut gate, settings) = (robot(), Place::new(), noise_and_tolerance());
    let (new, size, own) = (gate.new_object(), gate.size(), robot.held());
    ok(init(new, size, own, input(&settings), 0.0, 0.0, no_error()));
    gate
}

/// Adds some of the built-in samples, so far off.
fn added(gate: &mut Place<Own>, which: std::ops::Range<usize>, off: f64) -> Vec<i32> {
    let all = measured::<f64>();
    let verdicts = all[which].iter().map(|sample| {
        let (mut sample, mut verdict) = (in_c(sample), NOTHING);
        sample.position[0] += off;
        let place = output(&mut verdict);
        ok(add(gate.held_mut(), input(&sample), place, no_error()));
        verdict.verdict
    });
    verdicts.collect()
}

fn counts(gate: &mut Place<Own>) -> GateCounts {
    let mut counts = GateCounts::default();
    ok(state(gate.held(), output(&mut counts)));
    counts
}

fn solved(gate: &mut Place<Own>) -> Error {
    let mut error = Error::from(status::OK);
    if solve(gate.held_mut(), output(&mut error)) == status::OK {
        while step(gate.held_mut()) == status::WORKING {}
        let mut outcome = Place::new();
        let (new, size) = (outcome.new_object(), outcome.size());
        finish(gate.held(), new, size, output(&mut error));
    }
    error
}

#[test]
fn an_alarm_is_answered() {
    let mut gate = made();
    assert_eq!(added(&mut gate, 0..20, 0.0), [TAKEN; 20]);
    assert_eq!(added(&mut gate, 20..28, 5.0), [REJECTED; 8]);
    assert_eq!(counts(&mut gate).alarm, ROBOT_CHANGED);
    let refused = solved(&mut gate);
    assert_eq!(
        (refused.status, refused.count),
        (status::ROBOT_HAS_CHANGED, 20)
    );

    // The samples were wrong.
    ok(acknowledge(gate.held_mut()));
    assert_eq!(counts(&mut gate).alarm, NO_ALARM);
    assert_eq!(added(&mut gate, 0..40, 0.0), [TAKEN; 40]);
    assert_eq!(solved(&mut gate).status, status::OK);

    // The robot has changed.
    ok(reset(gate.held_mut()));
    assert_eq!(counts(&mut gate).taken, 0);
    assert_eq!(added(&mut gate, 0..20, 0.0), [TAKEN; 20]);
    assert_eq!(solved(&mut gate).status, status::OK);
}

#[test]
fn too_many_rejected_are_no_calibration() {
    let mut gate = made();
    for index in 0..20 {
        let off = if index % 3 == 2 { 5.0 } else { 0.0 };
        added(&mut gate, index..index + 1, off);
    }
    assert_eq!(solved(&mut gate).status, status::TOO_MANY_REJECTED);
}

#[test]
fn what_the_gate_has_seen_outlasts_a_power_cut() {
    let mut gate = made();
    added(&mut gate, 0..12, 0.0);
    added(&mut gate, 12..13, 5.0);
    // Without a place for the verdict nothing is taken in.
    let good = in_c(&measured::<f64>()[0]);
    let nowhere = crate::place::at(std::ptr::null_mut());
    let found = add(gate.held_mut(), input(&good), nowhere, no_error());
    assert_eq!(found, status::NULL_POINTER);

    let size = Own::SNAPSHOT_BYTES;
    let (mut bytes, mut length) = (vec![0x5a; size], 7);
    let place = crate::place::at(bytes.as_mut_ptr());
    let short = snapshot(gate.held(), place, size - 1, output(&mut length));
    assert_eq!((short, length), (status::SNAPSHOT_BUFFER, 7));
    assert!(bytes.iter().all(|byte| *byte == 0x5a));
    let place = crate::place::at(bytes.as_mut_ptr());
    ok(snapshot(gate.held(), place, size, output(&mut length)));
    let mut other = made();
    ok(restore(other.held_mut(), row(&bytes), length));
    let seen = counts(&mut other);
    assert_eq!((seen.taken, seen.rejected), (12, 1));

    ok(solve(gate.held_mut(), no_error()));
    let place = output(&mut NOTHING.clone());
    let found = add(gate.held_mut(), input(&good), place, no_error());
    assert_eq!(found, status::BUSY);
}
