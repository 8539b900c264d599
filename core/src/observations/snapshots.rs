//! Snapshots of the calibrator from any readings: its observations.

use super::calibrator::FkmCalibrator;
use super::instruments::Instruments;
use super::observation::{Distance, DistanceFrom, Height, Observation, ObservationRow};
use crate::robot::Robot;
use crate::samples::Unknowns;
use crate::snapshot::{Fingerprint, SnapshotError, longest, read, write};
use crate::state::{Reader, State, Writer};
use crate::{Busy, Real};

/// The number of this kind of calibrator, beside those of [`Parts`](crate::calibration::Parts).
const KIND: u8 = 3;
/// Bits of the byte that tells what an observation reads; the first three are the coordinates.
const HEIGHT: u8 = 8;
const FROM_POINT: u8 = 16;
const FROM_POSE: u8 = 32;
/// That byte, the plane and the point.
const MARKS: usize = 3;

impl<T: Unknowns<N>, const ROWS: usize, const N: usize> FkmCalibrator<T, ROWS, N> {
    /// Size of the largest [`snapshot`](Self::snapshot), bytes.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// Writes the observations into `bytes` and returns the part used. A calibrator restored from it continues with
    /// bit-identical results, so that a touch probe's readings survive a restart of the controller.
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; `bytes` is unchanged.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        write(KIND, self.mark(), self, bytes)
    }

    /// Replaces the observations of this calibrator by those of a [`snapshot`](Self::snapshot) of the same robot and
    /// instruments; the solver settings may differ, and the number of rows if they fit.
    ///
    /// # Errors
    /// Damaged bytes, or a snapshot of something else; [`SnapshotError::Busy`] during a solve. The calibrator is
    /// unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        if self.solving() {
            return Err(Busy.into());
        }
        read(KIND, self.mark(), self, bytes)
    }

    /// Everything a snapshot must agree with.
    fn mark(&self) -> u32 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.byte(u8::from(self.robot.drive() == crate::robot::Drive::Linear));
        fingerprint.count(u64::from(self.robot.fingerprint()));
        self.instruments.view().mark(&mut fingerprint);
        fingerprint.finish()
    }
}

impl<T: Unknowns<N>, const ROWS: usize, const N: usize> State<T> for FkmCalibrator<T, ROWS, N> {
    const BYTES: usize = 8 + ROWS * <Observation<T> as State<T>>::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        State::<T>::save(&self.samples(), to);
        for row in self.rows.iter() {
            row.observation().save(to);
        }
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        self.reset();
        let mut count = 0_u64;
        State::<T>::load(&mut count, from);
        for _ in 0..count {
            let loaded = placed(&self.robot, &self.instruments.view(), from);
            if loaded.is_none_or(|row| self.rows.push(row).is_err()) {
                break;
            }
        }
    }

    fn accepts(&self, bytes: &[u8]) -> bool {
        let Some((count, observations)) = bytes.split_first_chunk() else {
            return false;
        };
        let count = u64::from_le_bytes(*count);
        let of_each = observations.chunks_exact(<Observation<T> as State<T>>::BYTES);
        count <= ROWS as u64
            && of_each.len() as u64 == count
            && of_each.remainder().is_empty()
            && of_each.into_iter().all(|own| {
                let instruments = self.instruments.view();
                placed(&self.robot, &instruments, &mut Reader::new(own)).is_some()
            })
    }
}

/// The next row, unless it would have been refused.
fn placed<T: Real>(
    robot: &Robot<T>,
    instruments: &Instruments<'_, T>,
    from: &mut Reader<'_>,
) -> Option<ObservationRow<T>> {
    let mut observation = Observation::at([T::ZERO; 3]);
    observation.load(from);
    observation.check(robot, instruments).ok()?;
    let mut row = ObservationRow::new(observation);
    row.place(robot).ok()?;
    Some(row)
}

/// Always as many bytes: 0 for what is not read.
impl<T: Real> State<T> for Observation<T> {
    const BYTES: usize = MARKS + 11 * T::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        let mut reads = 0;
        for (bit, coordinate) in [1, 2, 4].into_iter().zip(self.position) {
            reads += if coordinate.is_some() { bit } else { 0 };
        }
        let (mut plane, mut point) = (0, 0);
        let (mut height, mut distance, mut other) = (T::ZERO, T::ZERO, [T::ZERO; 3]);
        if let Some(own) = self.height {
            reads += HEIGHT;
            (plane, height) = (own.plane, own.height);
        }
        if let Some(own) = self.distance {
            distance = own.distance;
            match own.from {
                DistanceFrom::Point(from) => (reads, point) = (reads + FROM_POINT, from),
                DistanceFrom::Pose(from) => (reads, other) = (reads + FROM_POSE, from),
            }
        }
        to.put(&[reads, plane, point]);
        self.joints.save(to);
        let coordinates = self.position.map(Option::unwrap_or_default);
        coordinates.save(to);
        [height, distance].save(to);
        other.save(to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        let [reads, plane, point] = from.take();
        let (mut position, mut other) = ([T::ZERO; 3], [T::ZERO; 3]);
        let mut lengths = [T::ZERO; 2];
        self.joints.load(from);
        position.load(from);
        lengths.load(from);
        other.load(from);
        let ([x, y, z], [height, distance]) = (position, lengths);
        let has = |bit: u8| reads & bit != 0;
        self.position = [(1, x), (2, y), (4, z)].map(|(bit, value)| has(bit).then_some(value));
        self.height = has(HEIGHT).then_some(Height { plane, height });
        let from = if has(FROM_POSE) {
            DistanceFrom::Pose(other)
        } else {
            DistanceFrom::Point(point)
        };
        self.distance = has(FROM_POINT | FROM_POSE).then_some(Distance { from, distance });
    }
}

impl<T: Real> Instruments<'_, T> {
    fn mark(&self, fingerprint: &mut Fingerprint) {
        fingerprint.byte(u8::from(self.sensor_frame));
        fingerprint.count(self.planes.len() as u64);
        for plane in self.planes {
            fingerprint.optional(plane.known.map(|(height, sigma)| [height, sigma]));
            fingerprint.optional(plane.level.map(|sigma| [sigma]));
        }
        for point in self.points {
            let known =
                |(place, sigma): (nalgebra::Vector3<T>, T)| [place.x, place.y, place.z, sigma];
            fingerprint.optional(point.known.map(known));
            fingerprint.byte(u8::from(point.offset));
        }
        let noise = &self.noise;
        fingerprint.optional(Some(noise.position().position_by_axis()));
        let [joint, height, distance] =
            [noise.position().joint(), noise.height(), noise.distance()];
        fingerprint.optional(Some([joint, height, distance]));
        fingerprint.optional(noise.scale().map(|sigma| [sigma]));
        fingerprint.optional(self.transmission.map(|tolerance| [tolerance.sigma()]));
    }
}
