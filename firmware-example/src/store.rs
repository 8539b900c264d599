//! The parameters in flash.

use crate::Number;
use crate::halves::{Halves, StoreError};
use delta_cal_protocol::{Geometry, Reader, Wire, Writer};
use embedded_storage::nor_flash::NorFlash;

/// Version of the stored record.
const VERSION: u8 = 5;
/// Bytes of both sets in `f64`: 2 × 39 numbers, and a byte for each option, rounded up.
const LARGEST: usize = 640;

/// The stored sets: the parameters in use, and those before the last calibration was applied; `None` is the robot as
/// designed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sets<T> {
    pub(crate) current: Option<Geometry<T>>,
    pub(crate) previous: Option<Geometry<T>>,
}

/// The result of loading at start-up.
#[derive(Debug)]
pub(crate) struct Loaded<T> {
    pub(crate) sets: Sets<T>,
    /// Whether it is certainly the newest.
    pub(crate) complete: bool,
}

/// The store of both sets.
#[derive(Debug)]
pub(crate) struct Store<F> {
    halves: Halves<F>,
}

impl<F: NorFlash> Store<F> {
    /// A store for a nominal robot with this fingerprint: another robot's parameters are useless.
    pub(crate) const fn new<T: Number>(flash: F, nominal: u32) -> Self {
        Self {
            halves: Halves::new(flash, mark::<T>(VERSION, nominal), LARGEST),
        }
    }

    pub(crate) fn into_flash(self) -> F {
        self.halves.into_flash()
    }

    /// Number of the newest record, which counts every change; 0 if there is none.
    pub(crate) fn generation(&self) -> u32 {
        self.halves.generation()
    }

    /// The stored sets, fully validated; `None` if nothing was ever stored. Writes nothing.
    pub(crate) fn load<T: Number>(&mut self) -> Result<Option<Loaded<T>>, StoreError> {
        let mut bytes = [0; LARGEST];
        let Some(content) = self.halves.load(&mut bytes)? else {
            return Ok(None);
        };
        let mut reader = Reader::new(content);
        let sets = <(Option<Geometry<T>>, Option<Geometry<T>>)>::get(&mut reader);
        let (Some((current, previous)), []) = (sets, reader.rest()) else {
            return Err(StoreError::Record);
        };
        let sets = Sets { current, previous };
        let valid = [sets.current, sets.previous]
            .iter()
            .flatten()
            .all(|geometry| geometry.robot().is_ok());
        if !valid {
            return Err(StoreError::Record);
        }
        Ok(Some(Loaded {
            sets,
            complete: self.halves.complete(),
        }))
    }

    /// Stores both sets and reads them back.
    #[inline(never)]
    pub(crate) fn save<T: Number>(&mut self, sets: &Sets<T>) -> Result<(), StoreError> {
        let mut bytes = [0; LARGEST];
        let mut writer = Writer::new(&mut bytes);
        sets.current.put(&mut writer);
        sets.previous.put(&mut writer);
        let length = writer.finish().ok_or(StoreError::Record)?;
        self.halves
            .save(bytes.get(..length).ok_or(StoreError::Record)?)
    }
}

/// The mark of records with this version, scalar and nominal robot.
#[allow(clippy::cast_possible_truncation)] // 4 or 8
pub(crate) const fn mark<T: Number>(version: u8, nominal: u32) -> u32 {
    nominal.rotate_left(8) ^ u32::from_le_bytes([b'd', version, size_of::<T>() as u8, b'c'])
}
