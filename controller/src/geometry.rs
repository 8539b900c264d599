//! Manages the parameters in use; every change goes to flash first.

use crate::halves::{Halves, StoreError, mark};
use crate::{NewParameters, Number};
use delta_cal::{ArmIndex, Real, Robot};
use delta_cal_protocol::{
    ControlLoop, Fault, Geometry, Motion, Origin, ParameterSet, Parameters, Reader, RevertTo, Wire,
    Writer,
};
use embedded_storage::nor_flash::NorFlash;
use nalgebra::Vector3;

/// Version of the stored record.
const VERSION: u8 = 5;
/// Bytes of both sets in `f64`: 2 × 39 numbers, and a byte for each option, rounded up.
const LARGEST: usize = 640;
/// Positions that differ by more than this fraction of the forearm are those of another robot.
const ANOTHER_ROBOT: f64 = 0.05;
/// Changes that may follow one another; then there is one a minute. Flash rated for 10,000 erasures lasts two weeks even so.
const CHANGES: u32 = 60;
const SECONDS_A_CHANGE: u32 = 60;

/// What the board states of its robot.
#[derive(Debug, Clone)]
pub struct Machine<T: Real> {
    /// The robot as designed.
    pub nominal: Robot<T>,
    /// Points around the work space, mm. Parameters are refused if a point is out of reach with them, or if its position
    /// differs from the nominal one by more than a twentieth of the forearm.
    pub work: &'static [[f32; 3]],
    /// The core's CPUID.
    pub processor: u32,
}

/// The parameters in use, and those before the last calibration was applied; `None` is the robot as designed.
type Sets<T> = (Option<Geometry<T>>, Option<Geometry<T>>);

/// The designed robot, the current and previous parameters, and their store.
#[derive(Debug)]
pub(crate) struct Geometries<T: Number, F> {
    pub(crate) nominal: NewParameters<T>,
    pub(crate) current: NewParameters<T>,
    work: &'static [[f32; 3]],
    sets: Sets<T>,
    /// Whether the store held unusable data, so that the parameters in use may not be the newest.
    damaged: bool,
    /// Whether that is whole, and of another version or robot.
    other: bool,
    /// The changes that may follow, and the turn that allowed the last of them.
    spare: u32,
    spared: u32,
    /// The point that the joints follow, mm.
    at: Option<Vector3<T>>,
    pub(crate) store: Halves<F>,
}

fn named<T: Number>(robot: Robot<T>) -> NewParameters<T> {
    NewParameters {
        fingerprint: Geometry::of(&robot).fingerprint(),
        robot,
    }
}

impl<T: Number, F: NorFlash> Geometries<T, F> {
    /// Reads the store.
    pub(crate) fn load(machine: Machine<T>, flash: F) -> Self {
        let nominal = named(machine.nominal);
        // Another robot's parameters are useless.
        let mark = mark::<T>(VERSION, nominal.fingerprint);
        let mut geometries = Self {
            store: Halves::new(flash, mark, LARGEST),
            nominal: nominal.clone(),
            current: nominal,
            work: machine.work,
            sets: (None, None),
            damaged: false,
            other: false,
            spare: CHANGES,
            spared: 0,
            at: None,
        };
        if let Err(error) = geometries.read() {
            log!(warn, "nothing usable stored: {}", error);
            geometries.damaged = true;
            geometries.other = error == StoreError::Other;
        }
        log!(
            info,
            "parameters {=u32:08x}, calibrated: {}, store damaged: {}",
            geometries.current.fingerprint,
            geometries.sets.0.is_some(),
            geometries.damaged
        );
        geometries
    }

    /// Reads and validates the stored sets. Writes nothing.
    fn read(&mut self) -> Result<(), StoreError> {
        let mut bytes = [0; LARGEST];
        let Some(content) = self.store.load(&mut bytes)? else {
            return Ok(());
        };
        let mut reader = Reader::new(content);
        let (Some(sets), []) = (Sets::get(&mut reader), reader.rest()) else {
            return Err(StoreError::Record);
        };
        self.of(sets.1.as_ref())?;
        self.current = self.of(sets.0.as_ref())?;
        self.sets = sets;
        self.damaged = !self.store.complete();
        Ok(())
    }

    /// Stores sets and reads them back.
    fn save(&mut self, sets: &Sets<T>) -> Result<(), StoreError> {
        let mut bytes = [0; LARGEST];
        let mut writer = Writer::new(&mut bytes);
        sets.put(&mut writer);
        let length = writer.finish().ok_or(StoreError::Record)?;
        self.store
            .save(bytes.get(..length).ok_or(StoreError::Record)?)
    }

    fn of(&self, geometry: Option<&Geometry<T>>) -> Result<NewParameters<T>, StoreError> {
        match geometry {
            None => Ok(self.nominal.clone()),
            Some(geometry) => geometry.robot().map(named).map_err(|_| StoreError::Record),
        }
    }

    /// Whether a robot is the nominal one but for its tolerance, and reaches the work points.
    pub(crate) fn near(&self, robot: &Robot<T>) -> bool {
        let nominal = &self.nominal.robot;
        let most = T::from_f64(ANOTHER_ROBOT) * nominal.arm(ArmIndex::First).lb();
        let near = |point: &[f32; 3]| {
            let point = Vector3::from(point.map(|own| T::from_f64(own.into())));
            let there = nominal.inverse(&point).and_then(|own| robot.forward(&own));
            let off = there.map(|there| there - point);
            robot.inverse(&point).is_ok() && off.is_ok_and(|own| own.dot(&own) <= most * most)
        };
        robot.arms().iter().all(|arm| arm.la().0 > T::ZERO) && self.work.iter().all(near)
    }

    /// Notes where the joints are, and allows for another change when its time has come.
    pub(crate) fn note(&mut self, control: &ControlLoop<T>) {
        self.at = (control.motion == Motion::Following).then(|| control.point.into());
        let turns = control
            .turns_a_second
            .max(1)
            .saturating_mul(SECONDS_A_CHANGE);
        if control.turns.wrapping_sub(self.spared) >= turns {
            self.spared = control.turns;
            self.spare = CHANGES.min(self.spare + 1);
        }
    }

    pub(crate) fn message(&self, set: ParameterSet) -> Parameters<T> {
        let (origin, parameters) = match (set, self.sets.0, self.damaged) {
            (ParameterSet::Nominal, ..) => (Origin::Nominal, &self.nominal),
            (_, Some(_), false) => (Origin::Calibration, &self.current),
            (_, Some(_), true) => (Origin::CalibrationStoreDamaged, &self.current),
            (_, None, false) => (Origin::Nominal, &self.current),
            (_, None, true) if self.other => (Origin::NominalStoreOther, &self.current),
            (_, None, true) => (Origin::NominalStoreDamaged, &self.current),
        };
        Parameters {
            origin,
            generation: self.store.generation(),
            geometry: Geometry::of(&parameters.robot),
        }
    }

    /// Makes a calibrated robot current, replacing the parameters of generation `from`; returns whether it was not
    /// already.
    pub(crate) fn apply(&mut self, from: u32, robot: &Robot<T>) -> Result<bool, Fault> {
        self.change_to(from, Some(Geometry::of(robot)), self.sets.0)
    }

    /// Reverts the parameters of generation `from`; returns whether that changed anything.
    pub(crate) fn revert(&mut self, from: u32, to: RevertTo) -> Result<bool, Fault> {
        let (_, previous) = self.sets;
        let geometry = match to {
            RevertTo::Previous if self.other => return Err(Fault::OtherStore),
            RevertTo::Previous => previous,
            RevertTo::Nominal => None,
        };
        // A rejected calibration cannot be reverted to.
        self.change_to(from, geometry, previous)
    }

    /// Updates flash before anything else.
    fn change_to(
        &mut self,
        from: u32,
        geometry: Option<Geometry<T>>,
        previous: Option<Geometry<T>>,
    ) -> Result<bool, Fault> {
        if self.other && geometry.is_some() {
            return Err(Fault::OtherStore);
        }
        let new = self.of(geometry.as_ref()).map_err(|_| Fault::Store)?;
        let there = self.current.fingerprint;
        let same = new.fingerprint == there && geometry.is_some() == self.sets.0.is_some();
        if same && !self.damaged {
            return Ok(false);
        }
        if !same && from != self.store.generation() {
            return Err(Fault::OtherParameters { there });
        }
        if geometry.is_some() && !self.near(&new.robot) {
            return Err(Fault::OtherRobot);
        }
        // The joints would have to jump. Where they stand still anyway, nothing moves.
        if (self.at).is_some_and(|point| new.robot.inverse(&point).is_err()) {
            return Err(Fault::Unreachable);
        }
        self.spare = self.spare.checked_sub(1).ok_or(Fault::TooOften)?;
        // Storing the same set again repairs the store and keeps the previous set.
        let sets = (geometry, if same { self.sets.1 } else { previous });
        if let Err(error) = self.save(&sets) {
            log!(warn, "not stored: {}", error);
            return Err(Fault::Store);
        }
        log!(
            info,
            "stored, and changed from {=u32:08x} to {=u32:08x}",
            there,
            new.fingerprint
        );
        self.current = new;
        self.sets = sets;
        (self.damaged, self.other) = (false, false);
        Ok(!same)
    }
}
