//! A store whose flash was damaged, and one whose flash cannot be read.

use crate::controller::driver::{Driver, Flash, samples, stored};
use crate::controller::flash::FailingFlash;
use crate::controller::store::{recovers, start};
use delta_cal_protocol::{Fault, Geometry, Origin, Response, RevertTo};
use delta_cal_tests::{generator, paper_robot};
use rand_core::Rng;
use std::ops::Range;

#[test]
fn damage_to_the_store_never_makes_another_set() {
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    let (flash, sets) = stored(2);
    let (old, new) = (sets[0], sets[1]);
    let mut counts = [0; 3];
    for place in 0..flash.bytes().len() {
        let masks = [0xff, 1, 0x80, 1 << (place % 8), 0x0f];
        for mask in masks {
            let mut damaged = flash.clone();
            damaged.bytes_mut()[place] ^= mask;
            let (found, origin) = start(&mut FailingFlash::new(damaged));
            let (kind, expected) = if found == new {
                // What was damaged is the older set, or nothing that counts.
                assert!([Origin::Calibration, Origin::CalibrationStoreDamaged].contains(&origin));
                (0, origin)
            } else if found == old {
                (1, Origin::CalibrationStoreDamaged)
            } else {
                assert_eq!(found, nominal, "byte {place}: another set");
                (2, Origin::NominalStoreDamaged)
            };
            assert_eq!(origin, expected, "byte {place}");
            counts[kind] += 1;
        }
    }
    let [new, old, nominal] = counts;
    println!("{new} damages left the new set, {old} the old, {nominal} nominal and say so");
    assert!(old + nominal > 500, "the damage did not reach the records");
}

#[test]
fn rubbish_in_the_flash_is_nominal_and_says_so() {
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    let (flash, _) = stored(2);
    let mut rng = generator(0xdead, 1);
    for round in 0..3000 {
        let mut rubbish = flash.clone();
        for (place, byte) in rubbish.bytes_mut().iter_mut().enumerate() {
            match round % 3 {
                0 => *byte = rng.next_u32().to_le_bytes()[0],
                1 => *byte &= rng.next_u32().to_le_bytes()[0],
                // What lies before stays: headers that lead to rubbish.
                _ if place > 12 => *byte ^= rng.next_u32().to_le_bytes()[0],
                _ => {}
            }
        }
        let mut flash = FailingFlash::new(rubbish);
        assert_eq!(start(&mut flash), (nominal, Origin::NominalStoreDamaged));
        if round < 300 {
            recovers(&flash.flash, nominal);
        }
    }
}

#[test]
fn a_damaged_store_is_put_right_by_the_next_change() {
    let (flash, _) = stored(2);
    let mut damaged = flash;
    damaged.bytes_mut().fill(0);
    let mut driver = Driver::<f32, _>::start(&mut damaged);
    assert_eq!(driver.parameters().origin, Origin::NominalStoreDamaged);
    // Also one that only says "nominal".
    assert!(matches!(
        driver.revert(RevertTo::Nominal),
        Response::Parameters(parameters) if parameters.origin == Origin::Nominal
    ));
    let mut driver = Driver::<f32, _>::start(&mut damaged);
    assert_eq!(driver.parameters().origin, Origin::Nominal);
}

/// The newest set is damaged after it was stored whole; nothing was cut. The controller then works
/// with parameters that were replaced, and must say so, however many sets were stored before.
#[test]
fn a_damaged_newest_set_is_not_replaced_by_an_older_one_in_silence() {
    for count in [2, 3, 4, 20] {
        let (flash, sets) = stored(count);
        let (newest, older) = sets.split_last().unwrap();
        let (mut silent, mut replaced) = (0, 0);
        for place in 0..flash.bytes().len() {
            for mask in [0x10, 0xff] {
                let mut damaged = flash.clone();
                damaged.bytes_mut()[place] ^= mask;
                let (found, origin) = start(&mut FailingFlash::new(damaged));
                replaced += u32::from(found != *newest);
                silent += u32::from(older.contains(&found) && origin == Origin::Calibration);
            }
        }
        assert!(replaced > 300, "the damage did not reach the newest set");
        assert_eq!(
            silent, 0,
            "{count} stored: damages that bring an older set back unnoticed"
        );
    }
}

#[test]
fn the_same_set_applied_again_repairs_the_store_and_keeps_the_set_before() {
    let (flash, sets) = stored(3);
    let mut repaired = 0;
    for place in 0..flash.bytes().len() {
        let mut damaged = flash.clone();
        damaged.bytes_mut()[place] ^= 0x10;
        let newest_but_damaged = (sets[2], Origin::CalibrationStoreDamaged);
        if start(&mut FailingFlash::new(damaged.clone())) != newest_but_damaged {
            continue;
        }
        let mut driver = Driver::<f32, _>::start(&mut damaged);
        assert_eq!(driver.solved(9, &samples(3, 12)), sets[2]);
        assert!(matches!(
            driver.apply(9, sets[2]),
            Response::Parameters(parameters) if parameters.origin == Origin::Calibration
        ));
        // The control loop has these parameters already.
        assert!(driver.controller.take_switch().is_none());
        let mut driver = Driver::<f32, _>::start(&mut damaged);
        assert_eq!(driver.parameters().origin, Origin::Calibration);
        driver.revert(RevertTo::Previous);
        assert_eq!(driver.controller.current().fingerprint, sets[1]);
        repaired += 1;
        if repaired == 50 {
            break;
        }
    }
    assert_eq!(repaired, 50, "the damage did not reach the older set");
}

const LOWER: Range<u32> = 0..HALF;
const UPPER: Range<u32> = HALF..2 * HALF;
#[allow(clippy::cast_possible_truncation)]
const HALF: u32 = size_of::<Flash>() as u32 / 2;

/// Applies the calibration of another robot; its fingerprint and the answer.
fn apply_another(driver: &mut Driver<f32, &mut FailingFlash>) -> (u32, Response<f32>) {
    let fingerprint = driver.solved(40, &samples(40, 12));
    (fingerprint, driver.apply(40, fingerprint))
}

/// What cannot be read is damaged for as long as it cannot; the other half is not.
#[test]
fn a_half_that_cannot_be_read_is_the_fault_of_that_half_alone() {
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    for count in [2, 3, 4] {
        let (flash, sets) = stored(count);
        let (newest, before) = (sets[sets.len() - 1], sets[sets.len() - 2]);
        let mut found = Vec::new();
        for half in [LOWER, UPPER] {
            let mut unreadable = FailingFlash::unreadable(flash.clone(), half);
            found.push(start(&mut unreadable));
            // It is stored, or refused: never acknowledged and lost.
            let mut driver = Driver::<f32, _>::start(&mut unreadable);
            let there = driver.controller.current().fingerprint;
            let (another, answer) = apply_another(&mut driver);
            let expected = match answer {
                Response::Parameters(_) => another,
                _ => there,
            };
            assert_eq!(start(&mut unreadable).0, expected, "{answer:?}");
        }
        found.sort_by_key(|(set, _)| *set == newest);
        let origin = Origin::CalibrationStoreDamaged;
        assert_eq!(found, [(before, origin), (newest, origin)]);

        let mut unreadable = FailingFlash::unreadable(flash.clone(), 0..2 * HALF);
        assert_eq!(
            start(&mut unreadable),
            (nominal, Origin::NominalStoreDamaged)
        );
        let mut driver = Driver::<f32, _>::start(&mut unreadable);
        assert_eq!(apply_another(&mut driver).1, Response::Fault(Fault::Store));
        assert_eq!(driver.controller.current().fingerprint, nominal);
        // Nothing was lost: what can be read again is in use again.
        let (found, _) = start(&mut FailingFlash::new(unreadable.flash));
        assert_eq!(found, newest);
    }
}

/// With one half unreadable from the beginning there is still the other.
#[test]
fn a_set_is_stored_in_the_half_that_can_be_read() {
    for half in [LOWER, UPPER] {
        let mut unreadable = FailingFlash::unreadable(Flash::new(), half);
        let mut driver = Driver::<f32, _>::start(&mut unreadable);
        let (applied, answer) = apply_another(&mut driver);
        assert!(matches!(answer, Response::Parameters(_)), "{answer:?}");
        let expected = (applied, Origin::CalibrationStoreDamaged);
        assert_eq!(start(&mut unreadable), expected);
        let healed = start(&mut FailingFlash::new(unreadable.flash));
        assert_eq!(healed, (applied, Origin::Calibration));
    }
}

/// Reads fail for a moment, at the start or while a set is being stored: what is acknowledged is there
/// at the next start, and what is refused is not.
#[test]
fn reads_that_fail_for_a_moment_lose_nothing_that_was_acknowledged() {
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    let (mut refused, mut acknowledged, mut nominal_used) = (0, 0, 0);
    for count in [1, 2, 3, 4] {
        let (flash, sets) = stored(count);
        let newest = *sets.last().unwrap();
        let mut whole = FailingFlash::new(flash.clone());
        apply_another(&mut Driver::start(&mut whole));
        for first in 0..whole.reads {
            for length in [1, 2, 3, 8] {
                let reads = first..first + length;
                let what = format!("{count} stored, reads {reads:?} fail");
                let mut failing = FailingFlash::failing_reads(flash.clone(), reads);
                let mut driver = Driver::<f32, _>::start(&mut failing);
                let there = driver.controller.current().fingerprint;
                let origin = driver.parameters().origin;
                if there != newest {
                    let said = [Origin::NominalStoreDamaged, Origin::CalibrationStoreDamaged];
                    assert!(said.contains(&origin), "{what}: {origin:?}");
                }
                nominal_used += u32::from(there == nominal);
                let (another, answer) = apply_another(&mut driver);
                let (found, origin) = start(&mut FailingFlash::new(failing.flash));
                if matches!(answer, Response::Parameters(_)) {
                    assert_eq!((found, origin), (another, Origin::Calibration), "{what}");
                    acknowledged += 1;
                } else {
                    assert_eq!(answer, Response::Fault(Fault::Store));
                    assert!(found == newest || found == there, "{what}");
                    refused += 1;
                }
            }
        }
    }
    println!("{acknowledged} sets acknowledged, {refused} refused, {nominal_used} starts nominal");
    assert!(acknowledged > 0 && refused > 0 && nominal_used > 0);
}
