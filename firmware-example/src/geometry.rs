//! Manages the parameters in use; every change goes to flash first.

use crate::Number;
use crate::halves::StoreError;
use crate::handover::NewParameters;
use crate::store::{Sets, Store};
use delta_cal::Robot;
use delta_cal_protocol::{Fault, Geometry, Origin, Parameters, RevertTo};
use embedded_storage::nor_flash::NorFlash;

/// The designed robot, the current and previous parameters, and their store.
#[derive(Debug)]
pub(crate) struct Geometries<T: Number, F> {
    nominal: NewParameters<T>,
    current: NewParameters<T>,
    sets: Sets<T>,
    /// Whether the store held unusable data, so that the parameters in use may not be the newest.
    damaged: bool,
    store: Store<F>,
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
        let mut geometries = Self {
            store: Store::new::<T>(flash, nominal.fingerprint),
            nominal,
            current: nominal,
            sets: Sets {
                current: None,
                previous: None,
            },
            damaged: false,
        };
        match geometries.read() {
            Ok(()) => {}
            Err(error) => {
                warning!("store damaged: {}", error);
                geometries.damaged = true;
            }
        }
        info!(
            "parameters {=u32:08x}, calibrated: {}, store damaged: {}",
            geometries.current.fingerprint,
            geometries.sets.current.is_some(),
            geometries.damaged
        );
        geometries
    }

    fn read(&mut self) -> Result<(), StoreError> {
        if let Some(loaded) = self.store.load::<T>()? {
            self.current = self.of(loaded.sets.current.as_ref())?;
            self.sets = loaded.sets;
            self.damaged = !loaded.complete;
        }
        Ok(())
    }

    fn of(&self, geometry: Option<&Geometry<T>>) -> Result<NewParameters<T>, StoreError> {
        match geometry {
            None => Ok(self.nominal),
            Some(geometry) => geometry.robot().map(named).map_err(|_| StoreError::Record),
        }
    }

    pub(crate) const fn nominal(&self) -> &NewParameters<T> {
        &self.nominal
    }

    pub(crate) const fn current(&self) -> NewParameters<T> {
        self.current
    }

    pub(crate) fn into_flash(self) -> F {
        self.store.into_flash()
    }

    pub(crate) fn current_message(&self) -> Parameters<T> {
        Parameters {
            origin: match (self.sets.current, self.damaged) {
                (Some(_), false) => Origin::Calibration,
                (Some(_), true) => Origin::CalibrationStoreDamaged,
                (None, false) => Origin::Nominal,
                (None, true) => Origin::NominalStoreDamaged,
            },
            generation: self.store.generation(),
            geometry: Geometry::of(&self.current.robot),
        }
    }

    pub(crate) fn nominal_message(&self) -> Parameters<T> {
        Parameters {
            origin: Origin::Nominal,
            generation: self.store.generation(),
            geometry: Geometry::of(&self.nominal.robot),
        }
    }

    /// Makes a calibrated robot current, replacing the parameters of generation `from`; returns whether it was not
    /// already.
    pub(crate) fn apply(&mut self, from: u32, robot: &Robot<T>) -> Result<bool, Fault> {
        self.change_to(from, Some(Geometry::of(robot)), self.sets.current)
    }

    /// Reverts the parameters of generation `from`; returns whether that changed anything.
    pub(crate) fn revert(&mut self, from: u32, to: RevertTo) -> Result<bool, Fault> {
        let previous = self.sets.previous;
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
        let same = new.fingerprint == there && geometry.is_some() == self.sets.current.is_some();
        if same && !self.damaged {
            return Ok(false);
        }
        if !same && from != self.store.generation() {
            return Err(Fault::OtherParameters { there });
        }
        // Storing the same set again repairs the store and keeps the previous set.
        let sets = Sets {
            current: geometry,
            previous: if same { self.sets.previous } else { previous },
        };
        if let Err(error) = self.store.save(&sets) {
            warning!("not stored: {}", error);
            return Err(Fault::Store);
        }
        info!(
            "stored, and changed from {=u32:08x} to {=u32:08x}",
            there, new.fingerprint
        );
        self.current = new;
        self.sets = sets;
        self.damaged = false;
        Ok(!same)
    }
}
