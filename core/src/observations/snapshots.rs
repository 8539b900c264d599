//! Snapshots of the calibrator from any readings: its observations.

use super::calibrator::FkmCalibrator;
use super::instruments::{Instruments, PositionFrame};
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
        fingerprint.byte(u8::from(self.frame == PositionFrame::Sensor));
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::KIND;
    use crate::calibration::{Progress, Settings, Tolerance};
    use crate::fixtures::{instruments, joints, paper};
    use crate::observations::{
        Distance, DistanceFrom, FkmCalibrator, Height, Instruments, Observation, ObservationError,
        Plane, Point, PositionFrame,
    };
    use crate::snapshot::{SnapshotError, longest, write};
    use crate::state::{State, Writer};

    type Calibrator = FkmCalibrator<f64, 31, 36>;
    const LENGTH: usize = Calibrator::SNAPSHOT_BYTES;

    fn made(of: &Instruments<'_, f64>) -> Calibrator {
        let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
        Calibrator::new(&paper(), of, &settings).unwrap()
    }

    /// By turns a height, two coordinates, a distance from a point and one from a pose.
    fn observation(index: usize) -> Observation<f64> {
        let (own, other) = (joints(index), [0.1, 0.2, 0.3]);
        let x = paper().forward(&own).unwrap();
        let mut observation = Observation::at(own);
        let distance = |from, distance| Some(Distance { from, distance });
        match index % 4 {
            0 => {
                let height = x.z + 560.0;
                observation.height = Some(Height { plane: 1, height });
            }
            1 => observation.position = [Some(x.x), None, Some(x.z)],
            2 => observation.distance = distance(DistanceFrom::Point(0), x.norm()),
            _ => {
                let apart = (x - paper().forward(&other).unwrap()).norm();
                observation.distance = distance(DistanceFrom::Pose(other), apart);
            }
        }
        observation
    }

    #[test]
    fn a_restored_calibrator_goes_on_as_the_original_would() {
        let level = Plane {
            known: Some((-560.0, 1.0)),
            level: Some(0.1),
        };
        let (planes, points) = ([level; 2], [Point::default()]);
        let stated = instruments(&planes, &points);
        let (mut original, mut restored) = (made(&stated), made(&stated));
        for index in 0..30 {
            // The first plane is touched as well, and what a calibrator holds is replaced.
            let mut own = observation(index);
            own.height = own.height.map(|height| Height {
                plane: u8::from(index > 4),
                ..height
            });
            original.add(&own).unwrap();
            restored.add(&observation(index + 40)).unwrap();
        }
        restored.calibrate().unwrap_err();
        let mut bytes = [0; LENGTH];
        let short = original.snapshot(&mut bytes[1..]).unwrap_err();
        assert_eq!(short, SnapshotError::BufferTooShort);
        original.snapshot(&mut bytes).unwrap();
        restored.restore(&bytes).unwrap();
        let mut again = [0; LENGTH];
        restored.snapshot(&mut again).unwrap();
        assert_eq!(bytes, again);
        for calibrator in [&mut original, &mut restored] {
            assert_eq!(calibrator.samples(), 30);
            calibrator.add(&observation(33)).unwrap();
            let full = calibrator.add(&observation(34));
            assert_eq!(full, Err(ObservationError::Full));
        }
        original.solve().unwrap();
        assert_eq!(original.step(), Progress::Working);
        let busy = original.restore(&bytes).unwrap_err();
        assert!(matches!(busy, SnapshotError::Busy(_)));
        while original.step() == Progress::Working {}
        assert_eq!(restored.calibrate(), original.outcome().cloned());
        assert!(original.outcome().is_ok());
    }

    /// Whatever is refused, nothing changes.
    #[test]
    fn what_is_no_snapshot_of_it_is_refused() {
        let planes = [Plane::default(); 2];
        let stated = instruments(&planes, &[]);
        let mut calibrator = made(&stated);
        for index in [0, 1, 4] {
            calibrator.add(&observation(index)).unwrap();
        }
        let (mut buffer, mut kept) = ([0; LENGTH], [0; LENGTH]);
        let used = calibrator.snapshot(&mut buffer).unwrap().len();
        calibrator.snapshot(&mut kept).unwrap();
        let bytes = buffer.get(..used).unwrap();
        let mut restored = made(&stated);
        for place in 0..used {
            restored.restore(&bytes[..place]).unwrap_err();
            let mut wrong = kept;
            wrong[place] ^= 0x10;
            restored.restore(&wrong[..used]).unwrap_err();
        }
        let mut others = stated;
        others.frame = PositionFrame::Sensor;
        let other = made(&others).restore(bytes).unwrap_err();
        assert_eq!(other, SnapshotError::OtherCalibration);
        let other = made(&instruments(&planes[..1], &[])).restore(bytes);
        assert_eq!(other, Err(SnapshotError::OtherCalibration));

        // A valid checksum of what no calibrator wrote: too many rows, fewer bytes, and rows that `add` refuses.
        let wrong = |index: usize, place: usize| {
            let start = 12 + 8 + index * <Observation<f64> as State<f64>>::BYTES;
            start + place
        };
        for (place, byte) in [
            (12, 32),
            (12, 2),
            (13, 1),
            // No reading, an unknown plane, and a joint angle that is no number.
            (wrong(0, 0), 0),
            (wrong(2, 1), 2),
            (wrong(1, 3 + 7), 0xff),
        ] {
            let mut forged = [0; LENGTH];
            forged[..used].copy_from_slice(bytes);
            forged[place] = byte;
            if place == wrong(1, 3 + 7) {
                forged[place - 1] = 0xff;
            }
            let state = Forged(forged.get(12..used - 4).unwrap());
            let mut forged = [0; LENGTH];
            write::<f64, _>(KIND, restored.mark(), &state, &mut forged).unwrap();
            let refused = restored.restore(&forged);
            assert_eq!(refused, Err(SnapshotError::Damaged), "{place}");
        }
        assert_eq!(restored.samples(), 0);
        restored.restore(bytes).unwrap();
        assert_eq!(restored.samples(), 3);
    }

    /// Any bytes as a state.
    struct Forged<'a>(&'a [u8]);

    impl State<f64> for Forged<'_> {
        const BYTES: usize = LENGTH - longest::<f64, ()>();

        fn save(&self, to: &mut Writer<'_>) {
            to.put(self.0);
        }

        fn load(&mut self, _: &mut crate::state::Reader<'_>) {}
    }
}
