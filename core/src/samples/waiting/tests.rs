use super::{CAPACITY, Waiting};
use crate::robot::ArmIndex;
use crate::samples::Sample;
use crate::samples::factor::BLOCK;
use nalgebra::Vector3;

/// The nth sample: its numbers tell which it is.
fn sample(number: u16) -> Sample<f64> {
    let number = f64::from(number);
    Sample {
        joints: [number, number + 0.25, number + 0.5],
        position: Vector3::new(number, 0.0, 0.0),
    }
}

/// In order, and no two arms at the same sample.
#[test]
fn every_arm_takes_every_sample_once() {
    let mut waiting = Waiting::none();
    let mut next = [0_u16; 3];
    let mut take = |waiting: &mut Waiting<f64>, arm: ArmIndex| {
        let mut count = 0;
        for (position, q) in waiting.block(arm) {
            let expected = sample(next[arm.index()]);
            assert_eq!(*position, expected.position);
            assert!((q - expected.joints[arm.index()]).abs() < 1e-12);
            next[arm.index()] += 1;
            count += 1;
        }
        waiting.take(arm);
        count
    };
    for number in 0..103 {
        waiting.push(&sample(number));
        // Every fourth sample completes a block; the arms take it in one after the other, at the sample
        // that completes it and the two after that.
        let expected = match number {
            0..3 => None,
            _ => ArmIndex::ALL.get(usize::from(number + 1) % BLOCK).copied(),
        };
        let due = waiting.due();
        assert_eq!(due, expected, "{number}");
        if let Some(arm) = due {
            assert_eq!(take(&mut waiting, arm), BLOCK);
        }
    }
    // Whatever is left, in blocks.
    for arm in ArmIndex::ALL {
        while waiting.waiting_for(arm) > 0 {
            assert!(take(&mut waiting, arm) > 0);
        }
    }
    assert_eq!(next, [103; 3]);
    // Nothing is left behind: it is as it was at the beginning.
    assert_eq!(waiting, Waiting::none());
}

#[test]
fn a_full_queue_takes_no_more() {
    let mut waiting = Waiting::none();
    for number in 0..20 {
        waiting.push(&sample(number));
    }
    for arm in ArmIndex::ALL {
        assert_eq!(waiting.waiting_for(arm), CAPACITY);
        assert_eq!(waiting.block(arm).count(), BLOCK);
    }
}
