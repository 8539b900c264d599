//! The calibrator from any readings: touches of planes, distances, single coordinates, in any mixture.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use super::outcome::{ArmSummary, Found, deviations_of, index_of};
use super::sample::{Settings, stated};
use crate::error::{Error, report, status_alone, status_of};
use crate::memory::{Held, HeldMut, In, New, Out, plain};
use crate::plain::{
    FRAME_BASE, FRAME_SENSOR, PLANES, POINTS, READ_DISTANCE, READ_DISTANCE_BETWEEN, READ_HEIGHT,
    READ_X, READ_Y, READ_Z,
};
use crate::status::{self, Status};
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{Distance, DistanceFrom, Height, ObservationNoise};
use delta_cal::{Progress, Robot};

/// The calibrator.
pub type Own = crate::kind::Fkm<Real>;

/// Stands for a noise that is not stated: a reading of that kind is refused. The core takes little more.
const NOT_STATED: Real = 1e12;

plain! {
    /// What was measured at one set of joint angles: any of the coordinates, a height, a distance.
    pub struct Observation {
        /// q1, q2, q3. Radians.
        pub joints: [Real; 3],
        /// x, y, z, where measured. Length.
        pub position: [Real; 3],
        /// Height of the platform point above a plane, along the plane's upward normal. Length.
        pub height: Real,
        /// Distance of the platform point from a point, or from where it is at `other_joints`. Length.
        pub distance: Real,
        /// The joint angles at the other end of a distance. Radians.
        pub other_joints: [Real; 3],
        /// Index of the plane below the height, from 0.
        pub plane: u32,
        /// Index of the point that the distance is from, from 0.
        pub point: u32,
        /// What was measured: bits `DCAL_READ_...`, at most one of the two kinds of distance.
        pub readings: u32,
        /// 0.
        pub reserved: u32,
    }
}

plain! {
    /// A plane z = c + a x + b y with unknown c, a and b.
    pub struct Plane {
        /// The approximate c, if known. Length.
        pub known: Real,
        /// One sigma of it; 0: unknown. Length.
        pub sigma: Real,
        /// One sigma of the slopes a and b of a nearly level plane; 0: unknown. No unit.
        pub level: Real,
    }
}

plain! {
    /// A fixed point at an unknown position.
    pub struct Point {
        /// The approximate x, y, z, if known. Length.
        pub known: [Real; 3],
        /// One sigma of each coordinate; 0: unknown. Length.
        pub sigma: Real,
        /// 1 if the sensor there has an unknown constant offset, otherwise 0.
        pub has_offset: u32,
        /// 0.
        pub reserved: u32,
    }
}

plain! {
    /// What the readings refer to. All zeros: coordinates in the robot's own frame, no planes, no points.
    pub struct Instruments {
        /// `DCAL_FRAME_BASE` or `DCAL_FRAME_SENSOR`.
        pub frame: i32,
        /// Number of planes.
        pub plane_count: u32,
        /// Number of points.
        pub point_count: u32,
        /// 0.
        pub reserved: u32,
        /// One sigma of a height; 0 if none is measured. Length.
        pub height_noise: Real,
        /// One sigma of a distance; 0 if none is measured. Length.
        pub distance_noise: Real,
        /// The planes that heights are measured above.
        pub planes: [Plane; PLANES],
        /// The points that distances are measured from.
        pub points: [Point; POINTS],
    }
}

impl Observation {
    fn reads(&self, bit: u32) -> bool {
        self.readings & bit != 0
    }

    fn checked(&self) -> Result<delta_cal::observations::Observation<Real>, Error> {
        let all = READ_X | READ_Y | READ_Z | READ_HEIGHT | READ_DISTANCE | READ_DISTANCE_BETWEEN;
        if self.readings & !all != 0 {
            return Err(status::NO_SUCH_CHOICE.into());
        }
        // There is no plane and no point of the highest number.
        let place = |number: u32| u8::try_from(number).unwrap_or(u8::MAX);
        let from = match self.readings & (READ_DISTANCE | READ_DISTANCE_BETWEEN) {
            0 => None,
            READ_DISTANCE => Some(DistanceFrom::Point(place(self.point))),
            READ_DISTANCE_BETWEEN => Some(DistanceFrom::Pose(self.other_joints)),
            _ => return Err(status::NO_SUCH_CHOICE.into()),
        };
        let [x, y, z] = self.position;
        Ok(delta_cal::observations::Observation {
            joints: self.joints,
            position: [(READ_X, x), (READ_Y, y), (READ_Z, z)]
                .map(|(bit, own)| self.reads(bit).then_some(own)),
            height: self.reads(READ_HEIGHT).then(|| Height {
                plane: place(self.plane),
                height: self.height,
            }),
            distance: from.map(|from| Distance {
                from,
                distance: self.distance,
            }),
        })
    }
}

/// Makes a calibrator without observations, in `size` bytes of memory: write `sizeof *calibrator`. `robot` is the
/// uncalibrated robot. `settings` must state the noise of positions and joint angles, and a tolerance unless x, y and z
/// are measured often enough; `instruments` states the noise of heights and distances.
///
/// Errors: `DCAL_NOISE_...`, `DCAL_TOLERANCE_...`, `DCAL_NO_SUCH_CHOICE`, `DCAL_KNOWN_PLACE`, `DCAL_TOO_MANY_UNKNOWNS`.
#[unsafe(export_name = family!(fkm, "init"))]
pub extern "C" fn init(
    mut calibrator: New<Own>,
    size: usize,
    robot: Held<Robot<Real>>,
    instruments: In<Instruments>,
    settings: In<Settings>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        calibrator.usable(size)?;
        let robot = robot.get()?;
        let (own, settings) = (instruments.get()?, settings.get()?.checked()?);
        make(&mut calibrator, size, robot, &own, &settings)
    })
}

/// In its place, and not inlined: its temporaries are as large as the object.
#[inline(never)]
fn make(
    calibrator: &mut New<Own>,
    size: usize,
    robot: &Robot<Real>,
    own: &Instruments,
    settings: &delta_cal::Settings<Real>,
) -> Result<(), Error> {
    let (mut planes, mut points) = (
        [delta_cal::observations::Plane::default(); PLANES],
        [delta_cal::observations::Point::default(); POINTS],
    );
    let (plane_count, point_count) = (own.plane_count as usize, own.point_count as usize);
    let (Some(used_planes), Some(used_points)) =
        (planes.get_mut(..plane_count), points.get_mut(..point_count))
    else {
        return Err(status::TOO_MANY_UNKNOWNS.into());
    };
    for (used, plane) in used_planes.iter_mut().zip(&own.planes) {
        used.known = stated(plane.sigma).map(|sigma| (plane.known, sigma));
        used.level = stated(plane.level);
    }
    for (used, point) in used_points.iter_mut().zip(&own.points) {
        used.known = stated(point.sigma).map(|sigma| (point.known.into(), sigma));
        used.offset = point.has_offset != 0;
    }
    let noise = settings
        .noise
        .ok_or(Error::from(status::NOISE_OF_POSITION))?;
    let instruments = delta_cal::observations::Instruments {
        sensor_frame: match own.frame {
            FRAME_BASE => false,
            FRAME_SENSOR => true,
            _ => return Err(status::NO_SUCH_CHOICE.into()),
        },
        planes: used_planes,
        points: used_points,
        noise: ObservationNoise::new(
            noise,
            stated(own.height_noise).unwrap_or(NOT_STATED),
            stated(own.distance_noise).unwrap_or(NOT_STATED),
        )?,
        transmission: None,
    };
    match &Own::new(robot, &instruments, settings) {
        Ok(made) => Ok(calibrator.put(size, made)?),
        Err(refusal) => Err((*refusal).into()),
    }
}

/// Adds one observation, at most `DCAL_FKM_ROWS` in all. Every one that was added takes part in the calibration.
///
/// Errors: `DCAL_OBSERVATION_...`, also where the uncalibrated robot does not reach the joint angles;
/// `DCAL_SAMPLE_JOINT_...`, `DCAL_NO_SUCH_PLANE` and `..._POINT`, `DCAL_NOISE_...` of a height or distance if it is not
/// stated, `DCAL_NO_SUCH_CHOICE`, `DCAL_BUSY`; nothing is added.
#[unsafe(export_name = family!(fkm, "add"))]
pub extern "C" fn add(
    mut calibrator: HeldMut<Own>,
    observation: In<Observation>,
    error: Out<Error>,
) -> Status {
    report(error, || {
        let own = calibrator.get()?;
        let observation = observation.get()?.checked()?;
        let noise = own.instruments().noise;
        if observation.height.is_some() && noise.height() >= NOT_STATED {
            return Err(status::NOISE_OF_HEIGHT.into());
        }
        if observation.distance.is_some() && noise.distance() >= NOT_STATED {
            return Err(status::NOISE_OF_DISTANCE.into());
        }
        Ok(own.add(&observation)?)
    })
}

/// Writes c (length), a and b of a plane z = c + a x + b y.
///
/// Errors: `DCAL_NO_SUCH_PLANE`, and those of `finish`.
#[unsafe(export_name = family!(fkm, "plane"))]
pub extern "C" fn plane(
    calibrator: Held<Own>,
    plane: u32,
    mut coefficients: Out<[Real; 3]>,
) -> Status {
    status_of(|| {
        let own = calibrator.get()?;
        let (outcome, instruments) = (own.outcome()?, own.instruments());
        let plane = place_of(plane, instruments.planes).ok_or(status::NO_SUCH_PLANE)?;
        Ok(coefficients.put(outcome.plane(&instruments, plane))?)
    })
}

/// Writes the position of a point and the offset of its sensor: x, y, z, offset. Length.
///
/// Errors: `DCAL_NO_SUCH_POINT`, and those of `finish`.
#[unsafe(export_name = family!(fkm, "point"))]
pub extern "C" fn point(calibrator: Held<Own>, point: u32, mut place: Out<[Real; 4]>) -> Status {
    status_of(|| {
        let own = calibrator.get()?;
        let (outcome, instruments) = (own.outcome()?, own.instruments());
        let point = place_of(point, instruments.points).ok_or(status::NO_SUCH_POINT)?;
        Ok(place.put(outcome.point(&instruments, point))?)
    })
}

/// The number of a plane or point, if there is one.
fn place_of<P>(number: u32, all: &[P]) -> Option<u8> {
    let number = u8::try_from(number).ok()?;
    (usize::from(number) < all.len()).then_some(number)
}

/// Writes the transform from the robot's frame to that of the measured coordinates: the rotation row by row, and the
/// translation (length). The identity for `DCAL_FRAME_BASE`.
///
/// Errors: those of `finish`.
#[unsafe(export_name = family!(fkm, "frame"))]
pub extern "C" fn frame(
    calibrator: Held<Own>,
    mut rotation: Out<[[Real; 3]; 3]>,
    mut translation: Out<[Real; 3]>,
) -> Status {
    status_of(|| {
        rotation.usable()?;
        translation.usable()?;
        let own = calibrator.get()?;
        let outcome = own.outcome()?;
        let frame = (own.instruments().sensor_frame).then(|| outcome.frame());
        let frame = frame.unwrap_or_else(RigidTransform::identity);
        rotation.put(frame.rotation.transpose().into())?;
        Ok(translation.put(frame.translation.into())?)
    })
}

calibrator!(fkm);
