//! Snapshots as C takes and restores them: the same bits after that, and nothing from wrong memory.
#![allow(unsafe_code)] // in the place of C
#![allow(clippy::unwrap_used)]

mod support;

use delta_cal_c::kind::SNAPSHOTS;
use delta_cal_c::single::calibrator::{calibrator_add, calibrator_samples};
use delta_cal_c::single::gate::{gate_add, gate_init};
use delta_cal_c::single::joint::{joint_calibrator_add, joint_calibrator_init};
use delta_cal_c::single::sample::{Sample, Settings};
use delta_cal_c::single::snapshot::{
    calibrator_restore, calibrator_snapshot, gate_restore, gate_snapshot, joint_calibrator_restore,
    joint_calibrator_snapshot,
};
use delta_cal_c::{Held, HeldMut, In, Many, New, Out, status};
use support::{Memory, SETTINGS, measured, no_error};

fn add(calibrator: &mut Memory<2048>, sample: &Sample) -> i32 {
    unsafe {
        calibrator_add(
            HeldMut::from_c(calibrator.place()),
            In::from_c((&raw const *sample).cast()),
            no_error(),
        )
    }
}

fn snapshot(calibrator: &mut Memory<2048>, bytes: &mut [u8]) -> (i32, usize) {
    let mut length = 0_u64;
    let status = unsafe {
        calibrator_snapshot(
            Held::from_c(calibrator.place()),
            Out::from_c(bytes.as_mut_ptr()),
            bytes.len(),
            Out::from_c((&raw mut length).cast()),
        )
    };
    (status, usize::try_from(length).unwrap())
}

fn restore(calibrator: &mut Memory<2048>, bytes: &[u8]) -> i32 {
    unsafe {
        calibrator_restore(
            HeldMut::from_c(calibrator.place()),
            Many::from_c(bytes.as_ptr()),
            bytes.len(),
        )
    }
}

#[test]
fn a_calibrator_goes_on_to_the_same_bits() {
    let (_, [size, _]) = SNAPSHOTS[0];
    let mut robot = Memory::<512>::robot();
    let mut whole = Memory::<2048>::calibrator(&mut robot, &SETTINGS);
    let mut broken = Memory::<2048>::calibrator(&mut robot, &SETTINGS);
    let (mut bytes, mut other) = (vec![0xa5; size], vec![0xa5; size]);
    for sample in measured() {
        assert_eq!(add(&mut whole, &sample), status::OK);
        assert_eq!(add(&mut broken, &sample), status::OK);
        assert_eq!(snapshot(&mut broken, &mut bytes), (status::OK, size));
        broken = Memory::calibrator(&mut robot, &SETTINGS);
        assert_eq!(restore(&mut broken, &bytes), status::OK);
    }
    snapshot(&mut whole, &mut bytes);
    snapshot(&mut broken, &mut other);
    assert_eq!(bytes, other);
}

#[test]
fn wrong_memory_and_wrong_bytes_are_refused() {
    let (_, [size, _]) = SNAPSHOTS[0];
    let mut robot = Memory::<512>::robot();
    let mut calibrator = Memory::<2048>::calibrator(&mut robot, &SETTINGS);
    for sample in measured() {
        add(&mut calibrator, &sample);
    }
    let mut bytes = vec![0; size];
    let (status, _) = snapshot(&mut calibrator, &mut bytes[..size - 1]);
    assert_eq!(status, status::SNAPSHOT_BUFFER);
    assert_eq!(snapshot(&mut calibrator, &mut bytes).0, status::OK);

    let mut empty = Memory::<2048>::calibrator(&mut robot, &SETTINGS);
    let mut wrong = bytes.clone();
    wrong[size / 2] ^= 1;
    assert_eq!(restore(&mut empty, &wrong), status::SNAPSHOT_DAMAGED);
    assert_eq!(
        restore(&mut empty, &bytes[..size - 1]),
        status::SNAPSHOT_DAMAGED
    );
    assert_eq!(restore(&mut empty, &[]), status::SNAPSHOT_DAMAGED);
    assert_eq!(
        restore(&mut empty, &vec![0xff; size]),
        status::SNAPSHOT_DAMAGED
    );
    let other = Settings {
        position_noise: [0.5; 3],
        ..SETTINGS
    };
    let mut other = Memory::<2048>::calibrator(&mut robot, &other);
    assert_eq!(
        restore(&mut other, &bytes),
        status::SNAPSHOT_OTHER_CALIBRATION
    );
    let mut count = 1_u64;
    unsafe {
        calibrator_samples(
            Held::from_c(empty.place()),
            Out::from_c((&raw mut count).cast()),
        );
    }
    assert_eq!(count, 0, "a refused restore changed it");

    // Bytes within the object, or none.
    let mut length = 0_u64;
    unsafe {
        let inside = calibrator.place().add(64);
        let within = calibrator_snapshot(
            Held::from_c(calibrator.place()),
            Out::from_c(inside),
            size,
            Out::from_c((&raw mut length).cast()),
        );
        assert_eq!(within, status::OVERLAP);
        let none = calibrator_restore(
            HeldMut::from_c(calibrator.place()),
            Many::from_c(core::ptr::null()),
            size,
        );
        assert_eq!(none, status::NULL_POINTER);
        let within = calibrator_restore(
            HeldMut::from_c(calibrator.place()),
            Many::from_c(calibrator.place().add(64)),
            size,
        );
        assert_eq!(within, status::OVERLAP);
    }
}

#[test]
fn joint_calibrator_and_gate_are_restored() {
    let (_, [size, _]) = SNAPSHOTS[1];
    let (_, [gate_size, _]) = SNAPSHOTS[2];
    let mut robot = Memory::<512>::robot();
    let mut arms = Memory::<2048>::calibrator(&mut robot, &SETTINGS);
    let (mut joint, mut gate) = (Memory::<4608>::zeroed(), Memory::<2048>::zeroed());
    let (mut bytes, mut gate_bytes) = (vec![0; size], vec![0; gate_size]);
    let mut length = 0_u64;
    unsafe {
        let made = joint_calibrator_init(
            New::from_c(joint.place()),
            4608,
            Held::from_c(robot.place()),
            In::from_c((&raw const SETTINGS).cast()),
            no_error(),
        );
        assert_eq!(made, status::OK);
        let made = gate_init(
            New::from_c(gate.place()),
            2048,
            HeldMut::from_c(arms.place()),
            0.0,
        );
        assert_eq!(made, status::OK);
        let mut verdict = [0_u64; 4];
        for sample in measured() {
            let added = joint_calibrator_add(
                HeldMut::from_c(joint.place()),
                In::from_c((&raw const sample).cast()),
                no_error(),
            );
            assert_eq!(added, status::OK);
            let added = gate_add(
                HeldMut::from_c(gate.place()),
                HeldMut::from_c(arms.place()),
                In::from_c((&raw const sample).cast()),
                Out::from_c(verdict.as_mut_ptr().cast()),
                no_error(),
            );
            assert_eq!(added, status::OK);
        }
        let taken = joint_calibrator_snapshot(
            Held::from_c(joint.place()),
            Out::from_c(bytes.as_mut_ptr()),
            size,
            Out::from_c((&raw mut length).cast()),
        );
        assert_eq!((taken, length), (status::OK, size as u64));
        let restored = joint_calibrator_restore(
            HeldMut::from_c(joint.place()),
            Many::from_c(bytes.as_ptr()),
            size,
        );
        assert_eq!(restored, status::OK);
        let taken = gate_snapshot(
            Held::from_c(gate.place()),
            Held::from_c(arms.place()),
            Out::from_c(gate_bytes.as_mut_ptr()),
            gate_size,
            Out::from_c((&raw mut length).cast()),
        );
        assert_eq!((taken, length), (status::OK, gate_size as u64));
        let mut restore = |arms: &mut Memory<2048>, bytes: &[u8]| {
            gate_restore(
                HeldMut::from_c(gate.place()),
                Held::from_c(arms.place()),
                Many::from_c(bytes.as_ptr()),
                bytes.len(),
            )
        };
        assert_eq!(restore(&mut arms, &gate_bytes), status::OK);
        assert_eq!(restore(&mut arms, &bytes), status::SNAPSHOT_OTHER_KIND);
        let mut empty = Memory::<2048>::calibrator(&mut robot, &SETTINGS);
        let other = status::SNAPSHOT_OTHER_CALIBRATION;
        assert_eq!(restore(&mut empty, &gate_bytes), other);
    }
}
