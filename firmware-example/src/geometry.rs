//! Manages the parameters in use; every change goes to flash first.

use crate::halves::{Halves, StoreError, mark};
use crate::{NewParameters, Number};
use delta_cal::Robot;
use delta_cal_protocol::{
    Fault, Geometry, Origin, ParameterSet, Parameters, Reader, RevertTo, Wire, Writer,
};
use embedded_storage::nor_flash::NorFlash;

/// Version of the stored record.
const VERSION: u8 = 5;
/// Bytes of both sets in `f64`: 2 × 39 numbers, and a byte for each option, rounded up.
const LARGEST: usize = 640;

/// The parameters in use, and those before the last calibration was applied; `None` is the robot as designed.
type Sets<T> = (Option<Geometry<T>>, Option<Geometry<T>>);

/// The designed robot, the current and previous parameters, and their store.
#[derive(Debug)]
pub(crate) struct Geometries<T: Number, F> {
    pub(crate) nominal: NewParameters<T>,
    pub(crate) current: NewParameters<T>,
    sets: Sets<T>,
    /// Whether the store held unusable data, so that the parameters in use may not be the newest.
    damaged: bool,
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
    pub(crate) fn load(nominal: Robot<T>, flash: F) -> Self {
        let nominal = named(nominal);
        // Another robot's parameters are useless.
        let mark = mark::<T>(VERSION, nominal.fingerprint);
        let mut geometries = Self {
            store: Halves::new(flash, mark, LARGEST),
            nominal: nominal.clone(),
            current: nominal,
            sets: (None, None),
            damaged: false,
        };
        if let Err(error) = geometries.read() {
            log!(warn, "store damaged: {}", error);
            geometries.damaged = true;
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
    #[inline(never)]
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

    pub(crate) fn message(&self, set: ParameterSet) -> Parameters<T> {
        let (origin, parameters) = match (set, self.sets.0, self.damaged) {
            (ParameterSet::Nominal, ..) => (Origin::Nominal, &self.nominal),
            (_, Some(_), false) => (Origin::Calibration, &self.current),
            (_, Some(_), true) => (Origin::CalibrationStoreDamaged, &self.current),
            (_, None, false) => (Origin::Nominal, &self.current),
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
            RevertTo::Previous => previous,
            RevertTo::Nominal => None,
        };
        // A rejected calibration cannot be reverted to.
        self.change_to(from, geometry, previous)
    }

    /// Updates flash before anything else.
    #[inline(never)]
    fn change_to(
        &mut self,
        from: u32,
        geometry: Option<Geometry<T>>,
        previous: Option<Geometry<T>>,
    ) -> Result<bool, Fault> {
        let new = self.of(geometry.as_ref()).map_err(|_| Fault::Store)?;
        let there = self.current.fingerprint;
        let same = new.fingerprint == there && geometry.is_some() == self.sets.0.is_some();
        if same && !self.damaged {
            return Ok(false);
        }
        if !same && from != self.store.generation() {
            return Err(Fault::OtherParameters { there });
        }
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
        self.damaged = false;
        Ok(!same)
    }
}
