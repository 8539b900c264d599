//! Calibration from measurements that are less than a position.
#![allow(unsafe_code)] // naming symbols, and promises about plain numbers

use super::Real;
use super::sample::Settings;
use crate::error::{Error, report, status_of};
use crate::memory::{Held, In, Many, New, Out, Plain, Workspace};
use crate::observed::{E, M, N, Observed, OwnInstruments};
use crate::plain::{
    FRAME_BASE, FRAME_SENSOR, PLANES, POINTS, READ_DISTANCE, READ_DISTANCE_BETWEEN, READ_HEIGHT,
    READ_X, READ_Y, READ_Z,
};
use crate::status::{self, Status};
use delta_cal::Robot;
use delta_cal::calibration::JointOutcome;
use delta_cal::nalgebra::Vector3;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, ObservationNoise, ObservationProblem, ObservationRow,
    PositionFrame,
};

/// What was measured at one set of joint angles: any of the coordinates, a height, a distance.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// q1, q2, q3. Radians.
    pub joints: [Real; 3],
    /// x, y, z, as far as they were measured. Length.
    pub position: [Real; 3],
    /// Height of the platform point above a plane, along the plane's upward normal. Length.
    pub height: Real,
    /// Distance of the platform point from a point, or from where it is at `other_joints`. Length.
    pub distance: Real,
    /// The joint angles at the other end of a distance. Radians.
    pub other_joints: [Real; 3],
    /// Which plane the height is above, from 0 on.
    pub plane: u32,
    /// Which point the distance is from, from 0 on.
    pub point: u32,
    /// What was measured: bits `DCAL_READ_...`, at most one of the two kinds of distance.
    pub readings: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: C's layout, numbers alone, no padding (the header's test looks).
unsafe impl Plain for Observation {}

/// A plane z = c + a x + b y, whose c, a and b are unknown.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// What is known of c. Length.
    pub known: Real,
    /// One sigma of that; 0: nothing is known. Length.
    pub sigma: Real,
}

/// A fixed point, whose place is unknown.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// What is known of the place: x, y, z. Length.
    pub known: [Real; 3],
    /// One sigma of each coordinate; 0: nothing is known. Length.
    pub sigma: Real,
    /// 1 if the sensor there reads a constant too much that is unknown, too; otherwise 0.
    pub has_offset: u32,
    /// 0.
    pub reserved: u32,
}

/// What the readings refer to. All zeros: coordinates in the robot's own frame, no plane, no point.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruments {
    /// `DCAL_FRAME_BASE` or `DCAL_FRAME_SENSOR`.
    pub frame: i32,
    /// How many planes there are.
    pub plane_count: u32,
    /// How many points there are.
    pub point_count: u32,
    /// 0.
    pub reserved: u32,
    /// One sigma of a height; 0 where none is measured. Length.
    pub height_noise: Real,
    /// One sigma of a distance; 0 where none is measured. Length.
    pub distance_noise: Real,
    /// The planes that heights are measured above.
    pub planes: [Plane; PLANES],
    /// The points that distances are measured from.
    pub points: [Point; POINTS],
}

// SAFETY: C's layout, numbers alone, no padding (the header's test looks).
unsafe impl Plain for Instruments {}

impl Observation {
    fn reads(&self, bit: u32) -> bool {
        self.readings & bit != 0
    }

    fn checked(&self) -> Result<delta_cal::observations::Observation<Real>, Error> {
        let all = READ_X | READ_Y | READ_Z | READ_HEIGHT | READ_DISTANCE | READ_DISTANCE_BETWEEN;
        if self.readings & !all != 0
            || self.reads(READ_DISTANCE) && self.reads(READ_DISTANCE_BETWEEN)
        {
            return Err(status::NO_SUCH_CHOICE.into());
        }
        let [x, y, z] = self.position;
        let [read_x, read_y, read_z] = [READ_X, READ_Y, READ_Z].map(|bit| self.reads(bit));
        let height = if self.reads(READ_HEIGHT) {
            Some(Height {
                plane: u8::try_from(self.plane).map_err(|_| Error::from(status::NO_SUCH_PLANE))?,
                height: self.height,
            })
        } else {
            None
        };
        let from = if self.reads(READ_DISTANCE) {
            let point = u8::try_from(self.point).map_err(|_| Error::from(status::NO_SUCH_POINT))?;
            Some(DistanceFrom::Point(point))
        } else if self.reads(READ_DISTANCE_BETWEEN) {
            Some(DistanceFrom::Pose(self.other_joints))
        } else {
            None
        };
        Ok(delta_cal::observations::Observation {
            joints: self.joints,
            position: [
                read_x.then_some(x),
                read_y.then_some(y),
                read_z.then_some(z),
            ],
            height,
            distance: from.map(|from| Distance {
                from,
                distance: self.distance,
            }),
        })
    }
}

/// `true` with something known, and an error where it is not usable.
fn is_known(numbers: &[Real], sigma: Real) -> Result<bool, Error> {
    // Zero means zero here: it stands for "nothing is known".
    #[allow(clippy::float_cmp)]
    if sigma == 0.0 {
        return Ok(false);
    }
    if sigma > 0.0 && sigma.is_finite() && numbers.iter().all(|number| number.is_finite()) {
        return Ok(true);
    }
    Err(status::KNOWN_PLACE.into())
}

impl Instruments {
    fn checked(&self, settings: &delta_cal::Settings<Real>) -> Result<OwnInstruments<Real>, Error> {
        let frame = match self.frame {
            FRAME_BASE => PositionFrame::Base,
            FRAME_SENSOR => PositionFrame::Sensor,
            _ => return Err(status::NO_SUCH_CHOICE.into()),
        };
        let mut planes = [delta_cal::observations::Plane::default(); PLANES];
        let mut points = [delta_cal::observations::Point::default(); POINTS];
        let plane_count = self.plane_count as usize;
        let point_count = self.point_count as usize;
        if plane_count > PLANES || point_count > POINTS {
            return Err(status::TOO_MANY_UNKNOWNS.into());
        }
        for (own, plane) in planes.iter_mut().zip(&self.planes).take(plane_count) {
            if is_known(&[plane.known], plane.sigma)? {
                own.known = Some((plane.known, plane.sigma));
            }
        }
        for (own, point) in points.iter_mut().zip(&self.points).take(point_count) {
            if is_known(&point.known, point.sigma)? {
                own.known = Some((Vector3::from(point.known), point.sigma));
            }
            own.offset = point.has_offset != 0;
        }
        let noise = settings
            .noise
            .ok_or(Error::from(status::NOISE_OF_POSITION))?;
        // Zero means zero here: nothing of the kind is measured, so that any sigma will do.
        #[allow(clippy::float_cmp)]
        let or_any = |sigma: Real| {
            if sigma == 0.0 {
                noise.position()
            } else {
                sigma
            }
        };
        Ok(OwnInstruments {
            frame,
            planes,
            plane_count,
            points,
            point_count,
            noise: ObservationNoise::new(
                noise,
                or_any(self.height_noise),
                or_any(self.distance_noise),
            )?,
        })
    }

    /// Whether the noise of every kind of reading is stated.
    #[allow(clippy::float_cmp)] // zero means zero: not stated
    fn covers(&self, observation: &Observation) -> Result<(), Error> {
        if observation.reads(READ_HEIGHT) && self.height_noise == 0.0 {
            return Err(status::NOISE_OF_HEIGHT.into());
        }
        if observation.reads(READ_DISTANCE | READ_DISTANCE_BETWEEN) && self.distance_noise == 0.0 {
            return Err(status::NOISE_OF_DISTANCE.into());
        }
        Ok(())
    }
}

/// Calibrates a robot from `count` observations: touches on planes, distances, single coordinates, in any mixture.
/// `robot` is the robot before calibration. `settings` must state the noise of positions and joint angles, and a
/// tolerance unless x, y and z were measured often enough; `instruments` states the noise of heights and distances.
/// `workspace` is memory for `count` observations, `workspace_size` its size in bytes; its content has no meaning before
/// or after the call. `size` is `sizeof *outcome`.
///
/// This is one long call, unlike the solvers: its time grows with `count`, and its temporaries lie on the stack
/// (docs/c.md states how much).
///
/// Errors: `DCAL_OBSERVATION_...`, `DCAL_SAMPLE_JOINT_...`, `DCAL_NO_SUCH_PLANE` and `..._POINT` with the
/// index of the observation; `DCAL_TOO_MANY_UNKNOWNS`, `DCAL_NOISE_...`, `DCAL_KNOWN_PLACE`, and every
/// refusal (`DCAL_TOO_FEW_SAMPLES` to `DCAL_OVERFLOW`).
#[unsafe(export_name = name!("observations_solve"))]
pub extern "C" fn observations_solve(
    robot: Held<Robot<Real>>,
    observations: Many<Observation>,
    count: usize,
    instruments: In<Instruments>,
    settings: In<Settings>,
    mut workspace: Workspace<ObservationRow<Real>>,
    workspace_size: usize,
    mut outcome: New<Observed<Real>>,
    size: usize,
    error: Out<Error>,
) -> Status {
    report(error, || {
        outcome.usable(size)?;
        // By value: the workspace may then lie anywhere.
        let robot = *robot.get()?;
        let stated = instruments.get()?;
        let settings = settings.get()?.checked()?;
        let own = stated.checked(&settings)?;
        for (index, observation) in (0..).zip(observations.values(count)?) {
            observation
                .checked()
                .and_then(|_| stated.covers(&observation))
                .map_err(|error| Error { index, ..error })?;
        }
        let rows = observations
            .values(count)?
            .filter_map(|observation| observation.checked().ok())
            .map(ObservationRow::new);
        let rows = workspace.rows(workspace_size, super::OBSERVATION_ROW, count, rows)?;
        let instruments = own.instruments();
        let problem = ObservationProblem::<Real, N>::prepare(&robot, &instruments, rows)?;
        let found = problem.solve::<M, E>(&settings)?;
        outcome.put(
            size,
            &Observed {
                outcome: found,
                instruments: own,
            },
        )?;
        Ok(status::OK)
    })
}

/// Makes the outcome of the robot's 24 parameters alone, in `size` bytes of memory: write `sizeof *joint`. Its covariance
/// takes the unknowns of the instruments into account.
#[unsafe(export_name = name!("observation_outcome_joint"))]
pub extern "C" fn observation_outcome_joint(
    outcome: Held<Observed<Real>>,
    mut joint: New<JointOutcome<Real>>,
    size: usize,
) -> Status {
    status_of(|| {
        joint.usable(size)?;
        let found = outcome.get()?.outcome.of_robot();
        joint.put(size, &found)?;
        Ok(status::OK)
    })
}

/// Writes where a plane z = c + a x + b y lies: c (length), a, b.
///
/// Errors: `DCAL_NO_SUCH_PLANE`.
#[unsafe(export_name = name!("observation_outcome_plane"))]
pub extern "C" fn observation_outcome_plane(
    outcome: Held<Observed<Real>>,
    plane: u32,
    mut coefficients: Out<[Real; 3]>,
) -> Status {
    status_of(|| {
        let observed = outcome.get()?;
        let instruments = observed.instruments.instruments();
        match u8::try_from(plane) {
            Ok(index) if usize::from(index) < instruments.planes.len() => {
                let found = observed.outcome.plane(&instruments, index);
                coefficients.put(found)?;
                Ok(status::OK)
            }
            _ => Err(status::NO_SUCH_PLANE.into()),
        }
    })
}

/// Writes where a point is, and what the sensor there reads too much: x, y, z, offset. Length.
///
/// Errors: `DCAL_NO_SUCH_POINT`.
#[unsafe(export_name = name!("observation_outcome_point"))]
pub extern "C" fn observation_outcome_point(
    outcome: Held<Observed<Real>>,
    point: u32,
    mut place: Out<[Real; 4]>,
) -> Status {
    status_of(|| {
        let observed = outcome.get()?;
        let instruments = observed.instruments.instruments();
        match u8::try_from(point) {
            Ok(index) if usize::from(index) < instruments.points.len() => {
                let found = observed.outcome.point(&instruments, index);
                place.put(found)?;
                Ok(status::OK)
            }
            _ => Err(status::NO_SUCH_POINT.into()),
        }
    })
}

/// Writes the frame in which coordinates were measured, from the robot's frame to it: the rotation row by row, and the
/// translation (length). The identity for `DCAL_FRAME_BASE`.
#[unsafe(export_name = name!("observation_outcome_frame"))]
pub extern "C" fn observation_outcome_frame(
    outcome: Held<Observed<Real>>,
    mut rotation: Out<[[Real; 3]; 3]>,
    mut translation: Out<[Real; 3]>,
) -> Status {
    status_of(|| {
        rotation.usable()?;
        translation.usable()?;
        let observed = outcome.get()?;
        let (turned, moved) = match observed.instruments.frame {
            PositionFrame::Base => {
                let mut identity = [[0.0; 3]; 3];
                for (index, row) in identity.iter_mut().enumerate() {
                    row[index] = 1.0;
                }
                (identity, [0.0; 3])
            }
            PositionFrame::Sensor => {
                let frame = observed.outcome.frame();
                (frame.rotation.transpose().into(), frame.translation.into())
            }
        };
        rotation.put(turned)?;
        translation.put(moved)?;
        Ok(status::OK)
    })
}
