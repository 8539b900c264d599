//! A store whose flash was damaged, and one whose flash cannot be read.

use crate::controller::driver::{
    Cut, Driver, FailingFlash, Flash, accepted, begin, samples, stored,
};
use delta_cal::Robot;
use delta_cal_controller::{Controller, PAGE, RamFlash, StreamFlash};
use delta_cal_firmware_example::machine;
use delta_cal_protocol::{Fault, Geometry, Origin, Request, Response, RevertTo};
use delta_cal_tests::{is_long, paper_robot};
use std::ops::Range;

/// One change of the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    /// To the calibration of this random robot's samples.
    Apply(u64),
    Revert(RevertTo),
}

/// As many as fill every page twice, no calibration twice: an older set than the one before would
/// show.
fn changes() -> Vec<Change> {
    (0..90)
        .map(|number| match number % 6 {
            2 | 5 => Change::Revert(RevertTo::Previous),
            4 => Change::Revert(RevertTo::Nominal),
            _ => Change::Apply(number),
        })
        .collect()
}

/// A controller that starts from this flash and is asked for the change; the fingerprints before
/// and (wanted) after, and the answer.
fn attempt(flash: &mut FailingFlash, change: Change) -> (u32, u32, Response<f32>) {
    let mut driver = Driver::<f32, _>::start(flash);
    let before = driver.controller.current().fingerprint;
    match change {
        Change::Apply(robot) => {
            let after = driver.solved(5, &samples(robot, 12));
            let answer = driver.apply(5, after);
            if answer == Response::Fault(Fault::Store) {
                // What cannot be stored is not used.
                assert_eq!(driver.controller.current().fingerprint, before);
                assert!(driver.controller.take_switch().is_none());
            }
            (before, after, answer)
        }
        Change::Revert(to) => {
            let answer = driver.revert(to);
            let after = driver.controller.current().fingerprint;
            (before, after, answer)
        }
    }
}

pub(crate) fn start(flash: &mut FailingFlash) -> (u32, Origin) {
    let mut driver = Driver::<f32, _>::start(flash);
    let parameters = driver.parameters();
    let current = driver.controller.current();
    assert_eq!(Geometry::of(&current.robot), parameters.geometry);
    (current.fingerprint, parameters.origin)
}

/// The power fails at every write and erase of every change, in every way; after the restart there
/// is the old or the new set, and the next change is stored in spite of whatever was left behind,
/// also if the power fails during that one too.
#[test]
fn power_cut_at_every_write_leaves_the_old_or_the_new_set() {
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    let mut flash = Flash::new();
    let (mut points, mut cuts, mut kept, mut changed, mut again, mut told) = (0, 0, 0, 0, 0, 0);
    for change in changes() {
        let mut whole = FailingFlash::new(flash.clone());
        let (before, after, answer) = attempt(&mut whole, change);
        accepted(answer);
        assert_eq!(whole.rewritten, 0, "a word was written twice");
        assert_ne!(before, after);
        points += whole.operations;
        for at in 0..whole.operations {
            for cut in Cut::ALL {
                let mut failing = FailingFlash::fail(flash.clone(), at, cut);
                let (_, _, answer) = attempt(&mut failing, change);
                assert_eq!(answer, Response::Fault(Fault::Store));
                cuts += 1;

                let mut left = FailingFlash::new(failing.flash.clone());
                let (found, origin) = start(&mut left);
                assert!(
                    found == before || found == after,
                    "{change:?}, operation {at}, {cut:?}: neither the old nor the new set"
                );
                kept += u32::from(found == before);
                changed += u32::from(found == after);
                // A cut cannot be told from damage: whoever asks hears of it.
                match origin {
                    Origin::Calibration => assert_ne!(found, nominal),
                    Origin::CalibrationStoreDamaged => {
                        assert_ne!(found, nominal);
                        told += 1;
                    }
                    _ => assert_eq!(found, nominal),
                }
                assert_eq!(
                    start(&mut left),
                    (found, origin),
                    "another set at the next start"
                );
                // The long campaign cuts the next change after each.
                if is_long() || cuts % 4 == 0 {
                    again += recovers(&left.flash, found);
                }
            }
        }
        flash = whole.flash;
    }
    println!(
        "power cut at {points} writes and erases, {cuts} ways: old set {kept}, new set {changed}; \
         {told} left traces, and the controller says so; cut again at {again} of the next change"
    );
    assert!(kept > 0 && changed > 0 && points > 2 * 90);
}

/// The next change is stored; how many ways to cut it were tried.
pub(crate) fn recovers(flash: &Flash, current: u32) -> u32 {
    let change = Change::Apply(1000);
    let mut whole = FailingFlash::new(flash.clone());
    let (before, after, answer) = attempt(&mut whole, change);
    assert_eq!(before, current);
    accepted(answer);
    let (found, origin) = start(&mut FailingFlash::new(whole.flash));
    assert_eq!((found, origin), (after, Origin::Calibration));

    let mut tried = 0;
    for at in 0..whole.operations {
        let cut = Cut::ALL[at as usize % Cut::ALL.len()];
        let mut failing = FailingFlash::fail(flash.clone(), at, cut);
        attempt(&mut failing, change);
        let (found, _) = start(&mut FailingFlash::new(failing.flash));
        assert!(found == before || found == after, "{at} {cut:?}");
        tried += 1;
    }
    tried
}

#[test]
fn what_is_current_is_not_written_again() {
    let mut driver = Driver::<f32, _>::start(FailingFlash::new(Flash::new()));
    let calibrated = driver.solved(5, &samples(1, 12));
    let applied = driver.apply(5, calibrated);
    let mut flash = driver.into_flash();
    assert!(flash.operations > 0);
    flash.operations = 0;
    let mut driver = Driver::<f32, _>::start(flash);
    assert_eq!(driver.solved(6, &samples(1, 12)), calibrated);
    for _ in 0..5 {
        assert_eq!(driver.apply(6, calibrated), applied);
    }
    assert_eq!(driver.into_flash().operations, 0);
}

/// As after an update whose nominal robot differs by one bit: nothing replaces the stored parameters but a request for the
/// nominal robot.
#[test]
fn parameters_of_another_robot_or_scalar_are_kept_until_told_otherwise() {
    let (flash, sets) = stored(2);
    let mut other = Driver::<f64, _>::start(flash.clone());
    assert_eq!(other.parameters().origin, Origin::NominalStoreOther);

    let mut updated = machine::<f32>(0).unwrap();
    let mut arms = updated.nominal.parameters();
    arms[0][7] = f32::from_bits(arms[0][7].to_bits() + 1);
    updated.nominal = Robot::from_parameters(arms).unwrap();
    let mut kept = flash.clone();
    let mut driver = Driver {
        controller: Controller::new(updated, &mut kept, StreamFlash::new()),
        sequence: 0,
    };
    let parameters = driver.parameters();
    assert_eq!(parameters.origin, Origin::NominalStoreOther);
    assert_eq!(parameters.geometry.arms, arms);
    let fingerprint = driver.solved(5, &samples(1, 12));
    for answer in [
        driver.apply(5, fingerprint),
        driver.revert(RevertTo::Previous),
    ] {
        assert_eq!(answer, Response::Fault(Fault::OtherStore));
    }
    let nominal = accepted(driver.revert(RevertTo::Nominal));
    assert_eq!(nominal.origin, Origin::Nominal);
    accepted(driver.apply(5, fingerprint));
    // The former firmware finds that, as this one found the former's.
    assert_eq!(
        start(&mut FailingFlash::new(kept)).1,
        Origin::NominalStoreOther
    );
    assert_eq!(
        start(&mut FailingFlash::new(flash)),
        (sets[1], Origin::Calibration)
    );
}

/// The half of the newest set is blank, as after an erase that went wrong: the set before is in use, and that is said.
#[test]
fn a_blank_half_is_missed() {
    for count in [3, 4] {
        let (flash, sets) = stored(count);
        let found = [LOWER, UPPER].map(|half| {
            let mut blank = flash.clone();
            blank.bytes[half.start as usize..half.end as usize].fill(0xff);
            start(&mut FailingFlash::new(blank))
        });
        let [before, newest] = [sets[sets.len() - 2], sets[sets.len() - 1]];
        let damaged = Origin::CalibrationStoreDamaged;
        assert!(found.contains(&(before, damaged)) && found.contains(&(newest, damaged)));
    }
}

#[test]
fn flash_regions_that_do_not_fit_are_named() {
    fn of<const P: usize, const S: usize>() -> Fault {
        let (parameters, samples) = (RamFlash::<P>::new(), RamFlash::<S>::new());
        let controller = Controller::new(machine(0).unwrap(), parameters, samples);
        let fault = controller.check().unwrap_err();
        let mut driver = Driver::<f32, _, _> {
            controller,
            sequence: 0,
        };
        assert!(matches!(
            driver.ask(&Request::Identify),
            Response::Identity(_)
        ));
        assert_eq!(driver.fault(&Request::Begin(begin(1))), fault);
        fault
    }
    const SAMPLES: usize = 16 * PAGE;
    let faults = [
        of::<PAGE, SAMPLES>(),
        of::<{ 2 * PAGE }, { 2 * PAGE }>(),
        of::<0, SAMPLES>(),
    ];
    assert_eq!(faults, [Fault::Region; 3]);
}

/// A byte of either set is damaged after it was stored whole; nothing was cut. The controller works with one of the sets
/// that were stored, and says so if it is not the newest, however many were stored before.
#[test]
fn damage_to_the_store_never_makes_another_set_and_replaces_none_in_silence() {
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    for count in [1, 2, 3, 20] {
        let (flash, sets) = stored(count);
        let (newest, older) = sets.split_last().unwrap();
        let mut replaced = 0;
        for place in 0..flash.bytes.len() {
            for mask in [0xff, 1 << (place % 8)] {
                let mut damaged = flash.clone();
                damaged.bytes[place] ^= mask;
                let (found, origin) = start(&mut FailingFlash::new(damaged));
                if found == *newest {
                    // What was damaged is an older set, or nothing that counts.
                    assert!(
                        [Origin::Calibration, Origin::CalibrationStoreDamaged].contains(&origin)
                    );
                    continue;
                }
                replaced += 1;
                let what = format!("{count} stored, byte {place}");
                let expected = if older.contains(&found) {
                    Origin::CalibrationStoreDamaged
                } else {
                    assert_eq!(found, nominal, "{what}: another set");
                    Origin::NominalStoreDamaged
                };
                assert_eq!(origin, expected, "{what}");
            }
        }
        assert!(replaced > 200, "the damage did not reach the newest set");
    }
}

#[test]
fn the_same_set_applied_again_repairs_the_store_and_keeps_the_set_before() {
    let (flash, sets) = stored(3);
    let mut repaired = 0;
    for place in 0..flash.bytes.len() {
        let mut damaged = flash.clone();
        damaged.bytes[place] ^= 0x10;
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
        accepted(answer);
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
            // Nothing is read, or one bit wrong, as with too little power.
            for (length, wrong) in [(1, 0), (2, 0), (3, 0), (8, 0), (1, 1), (8, 1)] {
                let reads = first..first + length;
                let what = format!("{count} stored, reads {reads:?} fail, {wrong}");
                let mut failing = FailingFlash::failing_reads(flash.clone(), reads);
                failing.wrong = wrong;
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
