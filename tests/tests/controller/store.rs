use crate::controller::driver::{Driver, Flash, samples, stored};
use crate::controller::flash::{Cut, FailingFlash};
use delta_cal::SymmetricRobot;
use delta_cal_firmware_example::{Controller, FlashError, PAGE, StreamFlash, WORD};
use delta_cal_protocol::{Fault, Geometry, Origin, Request, Response, RevertTo};
use delta_cal_tests::paper_robot;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

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
            (before, after, driver.apply(5, after))
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
        assert!(matches!(answer, Response::Parameters(_)), "{answer:?}");
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
                again += recovers(&left.flash, found);
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
    assert!(matches!(answer, Response::Parameters(_)), "{answer:?}");
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
fn what_cannot_be_stored_is_not_used() {
    let mut driver = Driver::<f32, _>::start(FailingFlash::fail(Flash::new(), 0, Cut::Before));
    let nominal = driver.parameters();
    let calibrated = driver.solved(5, &samples(1, 12));
    assert_eq!(driver.apply(5, calibrated), Response::Fault(Fault::Store));
    assert_eq!(driver.parameters(), nominal);
    assert!(driver.controller.take_switch().is_none());
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

#[test]
fn parameters_of_another_robot_or_scalar_are_not_taken() {
    let (flash, _) = stored(2);
    let mut other = Driver::<f64, _>::start(flash.clone());
    assert_eq!(other.parameters().origin, Origin::NominalStoreDamaged);

    let longer = SymmetricRobot {
        base_radius: 194.0_f32,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.5,
    };
    let mut driver = Driver {
        controller: Controller::new(longer.robot().unwrap(), flash, StreamFlash::new(), 0),
        sequence: 0,
    };
    let parameters = driver.parameters();
    assert_eq!(parameters.origin, Origin::NominalStoreDamaged);
    let [first, ..] = parameters.geometry.arms;
    assert_eq!(first[7].to_bits(), 480.5_f32.to_bits());
    assert!(matches!(
        driver.ask(&Request::Identify),
        Response::Identity(_)
    ));
}

/// Flash that writes and erases as it should, and whose reads fail once a record was written, until
/// it is erased.
struct Unreadable {
    flash: Flash,
    written: bool,
}

impl ErrorType for Unreadable {
    type Error = FlashError;
}

impl ReadNorFlash for Unreadable {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.flash.read(offset, bytes)?;
        if self.written {
            // One bit that is read wrong, as with too little power.
            for byte in bytes.iter_mut().take(1) {
                *byte ^= 1;
            }
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Unreadable {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.written = false;
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.written = true;
        self.flash.write(offset, bytes)
    }
}

/// The driver was told that the new set is not used. It must not come into use later by itself.
#[test]
fn a_set_that_was_not_stored_is_not_used_after_a_restart_either() {
    let (flash, sets) = stored(2);
    let before = sets[1];
    let mut driver = Driver::<f32, _>::start(Unreadable {
        flash,
        written: false,
    });
    assert_eq!(driver.controller.current().fingerprint, before);
    let after = driver.solved(5, &samples(3, 12));
    assert_eq!(driver.apply(5, after), Response::Fault(Fault::Store));
    assert_eq!(driver.controller.current().fingerprint, before);
    let flash = driver.into_flash().flash;
    let (found, _) = start(&mut FailingFlash::new(flash));
    assert_eq!(found, before, "refused with a fault, and used after all");
}
