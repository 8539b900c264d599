//! Which parameters are in use, and how that changes: in flash first.

use crate::Number;
use crate::handover::NewParameters;
use crate::store::{Geometry, Sets, Store, StoreError};
use delta_cal::Robot;
use delta_cal_protocol::{Fault, Origin, Parameters, RevertTo, fingerprint};
use embedded_storage_async::nor_flash::NorFlash;

/// The robot as drawn, the parameters in use, those before, and the store of them.
#[derive(Debug)]
pub(crate) struct Geometries<T: Number, F> {
    nominal: NewParameters<T>,
    current: NewParameters<T>,
    sets: Sets<T>,
    /// Whether the store held something that was no use: what is in use may not be the newest.
    damaged: bool,
    store: Store<F>,
}

fn named<T: Number>(robot: Robot<T>) -> NewParameters<T> {
    NewParameters {
        fingerprint: fingerprint(&robot.parameters()),
        robot,
    }
}

impl<T: Number, F: NorFlash> Geometries<T, F> {
    /// Reads the store.
    pub(crate) fn load(nominal: Robot<T>, flash: F) -> Self {
        let nominal = named(nominal);
        let mut geometries = Self {
            store: Store::new(flash, nominal.fingerprint),
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

    fn of(&self, geometry: Option<&[[T; 8]; 3]>) -> Result<NewParameters<T>, StoreError> {
        match geometry {
            None => Ok(self.nominal),
            Some(arms) => Robot::from_parameters(*arms)
                .map(named)
                .map_err(|_| StoreError::Record),
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
            arms: self.current.robot.parameters(),
        }
    }

    pub(crate) fn nominal_message(&self) -> Parameters<T> {
        Parameters {
            origin: Origin::Nominal,
            arms: self.nominal.robot.parameters(),
        }
    }

    /// Makes a calibrated robot the current one; whether it was not already.
    pub(crate) fn apply(&mut self, robot: &Robot<T>) -> Result<bool, Fault> {
        self.change_to(Some(robot.parameters()))
    }

    /// Goes back from the parameters named `from`; whether that changed anything.
    pub(crate) fn revert(&mut self, from: u32, to: RevertTo) -> Result<bool, Fault> {
        let there = self.current.fingerprint;
        if from != there {
            return Err(Fault::OtherParameters { there });
        }
        self.change_to(match to {
            RevertTo::Previous => self.sets.previous,
            RevertTo::Nominal => None,
        })
    }

    /// First the flash, then the rest.
    #[inline(never)]
    fn change_to(&mut self, geometry: Geometry<T>) -> Result<bool, Fault> {
        let new = self.of(geometry.as_ref()).map_err(|_| Fault::Store)?;
        let same = new.fingerprint == self.current.fingerprint
            && geometry.is_some() == self.sets.current.is_some();
        if same && !self.damaged {
            return Ok(false);
        }
        // What is stored again repairs the store; the set before is still the one before.
        let previous = if same {
            self.sets.previous
        } else {
            self.sets.current
        };
        let sets = Sets {
            current: geometry,
            previous,
        };
        if let Err(error) = self.store.save(&sets) {
            warning!("not stored: {}", error);
            return Err(Fault::Store);
        }
        info!(
            "stored, and changed from {=u32:08x} to {=u32:08x}",
            self.current.fingerprint, new.fingerprint
        );
        self.current = new;
        self.sets = sets;
        self.damaged = false;
        Ok(!same)
    }
}
