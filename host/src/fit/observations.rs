//! The fit to heights, distances and single coordinates. The calibration itself is the core's.

use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, Reading, ReadingFrom};
use crate::fit::options::Frame;
use crate::fit::outcome::{Outcome, RobotCovariance, WITH_TRANSMISSIONS, with_exact_transmissions};
use delta_cal::calibration::Solver;
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationOutcome,
    ObservationProblem, ObservationRow, Plane, Point, PositionFrame, PrepareError,
    RobustObservationError, robust_fit_observations,
};
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample};
use delta_cal::{Noise, Refusal, Settings};
use nalgebra::Vector3;

/// The robot's parameters and the unknowns of as many instruments as a file may have: a frame and 14
/// points, for example.
pub(crate) const PARAMETERS: usize = 72;
/// Readings of a row: x, y, z, height, distance.
pub(crate) const READINGS: usize = 5;
const COLUMNS: usize = PARAMETERS + 1;
const ENTRIES: usize = COLUMNS * (COLUMNS + 1) / 2;

type ObservedProblem<'a> = ObservationProblem<'a, f64, PARAMETERS>;

/// A fit, and where the instruments are.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedFit {
    /// The robot and the covariance of its parameters.
    pub outcome: Outcome,
    /// Of the robot's parameters and of the numbers of its transmissions.
    pub covariance: Option<RobotCovariance>,
    /// From the robot's frame to that of the coordinates, if it was unknown.
    pub frame: Option<RigidTransform<f64>>,
    /// The planes in the order of the file.
    pub planes: Vec<PlaneFound>,
    /// The points in the order of the file.
    pub points: Vec<PointFound>,
    /// Each row's readings less what they should be, in σ: x, y, z, height, distance; 0 where nothing was
    /// read. The readings of a row share the noise of its joints.
    pub residuals: Vec<[f64; READINGS]>,
    /// By what each row's squared residuals are multiplied in the fit: 1 without a loss.
    pub weights: Vec<f64>,
    /// What all rows are worth together.
    pub effective_rows: f64,
    /// The rows that do not count, because they disagree with the others.
    pub suspected: Vec<usize>,
    /// The rows that do not count, because the robot of the file does not reach their joint angles.
    pub left_out: Vec<usize>,
    /// How many parameters there are beside the robot's.
    pub unknowns: usize,
}

/// Where a plane is: a height above it is `normal · X − offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneFound {
    /// Upward, of length 1.
    pub normal: Vector3<f64>,
    /// mm.
    pub offset: f64,
}

/// Where a point is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointFound {
    /// mm.
    pub place: Vector3<f64>,
    /// What its sensor reads too much, mm.
    pub offset: f64,
}

/// Why there is no fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObservedError {
    /// A row is not usable.
    Row(usize, delta_cal::observations::ObservationError),
    /// The file has more planes and points than there is room for.
    TooManyInstruments,
    /// The measurements cannot calibrate this robot.
    Refused(Refusal),
    /// They are too few for a robust fit, or too many of them disagree.
    Robust(RobustRefusal),
}

impl From<RobustObservationError> for ObservedError {
    fn from(error: RobustObservationError) -> Self {
        match error {
            RobustObservationError::Prepare(error) => error.into(),
            RobustObservationError::Refused(RobustRefusal::Fit(refusal)) => Self::Refused(refusal),
            RobustObservationError::Refused(refusal) => Self::Robust(refusal),
            _ => Self::Refused(Refusal::Unfinished),
        }
    }
}

impl From<Refusal> for ObservedError {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl From<PrepareError> for ObservedError {
    fn from(error: PrepareError) -> Self {
        match error {
            PrepareError::Row { index, error } => Self::Row(index, error),
            PrepareError::Refused(refusal) => Self::Refused(refusal),
            _ => Self::TooManyInstruments,
        }
    }
}

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration. Kinds of
/// readings that the file holds must have a noise in the robot file.
///
/// # Errors
/// An [`ObservedError`].
pub fn calibrate(
    robot: &RobotFile,
    file: &ObservationsFile,
    frame: Frame,
    solver: Solver,
) -> Result<ObservedFit, ObservedError> {
    with_problem(robot, file, frame, |problem| {
        let settings = settings(robot, solver);
        let outcome = problem.solve::<COLUMNS, ENTRIES>(&settings)?;
        Ok(found(problem, file, frame, &outcome))
    })
}

fn settings(robot: &RobotFile, solver: Solver) -> Settings<f64> {
    Settings::new()
        .with_tolerance(robot.tolerance)
        .with_solver(solver)
}

/// The same from rows of which some may be wrong.
///
/// # Errors
/// As [`calibrate`]; too few rows, or too many that disagree.
pub fn calibrate_robust(
    robot: &RobotFile,
    file: &ObservationsFile,
    frame: Frame,
    solver: Solver,
    loss: Loss,
) -> Result<ObservedFit, ObservedError> {
    with_rows(robot, file, frame, |instruments, rows| {
        let mut work = vec![WeighedSample::vacant(); rows.len()];
        let found_robustly = robust_fit_observations::<f64, PARAMETERS, COLUMNS, ENTRIES>(
            &robot.robot,
            instruments,
            rows,
            &settings(robot, solver),
            loss,
            &mut work,
        )?;
        let weights: Vec<_> = rows.iter().map(ObservationRow::weight).collect();
        // The residuals as they are, whatever the rows weigh.
        for row in rows.iter_mut() {
            row.set_weight(1.0);
        }
        let problem = ObservedProblem::prepare(&robot.robot, instruments, rows)?;
        let suspected = work.iter().enumerate().filter(|(_, own)| own.suspected());
        Ok(ObservedFit {
            weights,
            effective_rows: found_robustly.effective_samples,
            suspected: suspected.map(|(index, _)| index).collect(),
            ..found(&problem, file, frame, &found_robustly.fit)
        })
    })
}

fn found(
    problem: &ObservedProblem<'_>,
    file: &ObservationsFile,
    frame: Frame,
    outcome: &ObservationOutcome<f64, PARAMETERS>,
) -> ObservedFit {
    let instruments = problem.instruments();
    let planes = (0..).zip(instruments.planes);
    let planes = planes.map(|(index, _)| outcome.plane(instruments, index));
    let points = (0..).zip(instruments.points);
    let points = points.map(|(index, _)| outcome.point(instruments, index));
    let own = placed(problem, Outcome::from(outcome.of_robot()), planes, points);
    let with_transmissions = match instruments.transmission {
        Some(_) => outcome.estimate.covariance.as_ref().map(|all| {
            all.fixed_view::<WITH_TRANSMISSIONS, WITH_TRANSMISSIONS>(0, 0)
                .into_owned()
        }),
        None => own.covariance,
    };
    ObservedFit {
        frame: (frame == Frame::Sensor).then(|| outcome.frame()),
        residuals: residuals(file, |row| problem.residuals(outcome, row)),
        covariance: with_transmissions,
        ..own
    }
}

/// What was fitted elsewhere to the rows of a file, with coordinates in the robot's frame: the planes' c, a and b,
/// and the points' x, y, z and offset.
///
/// # Errors
/// As [`calibrate`].
pub fn found_elsewhere(
    robot: &RobotFile,
    file: &ObservationsFile,
    outcome: Outcome,
    planes: &[[f64; 3]],
    points: &[[f64; 4]],
) -> Result<ObservedFit, ObservedError> {
    with_problem(robot, file, Frame::Base, |problem| {
        let instruments = problem.instruments();
        let unknowns = instruments.unknowns_at::<PARAMETERS>(planes, points);
        let found = outcome.fit.robot;
        let own = placed(
            problem,
            outcome,
            planes.iter().copied().take(instruments.planes.len()),
            points.iter().copied().take(instruments.points.len()),
        );
        Ok(ObservedFit {
            residuals: residuals(file, |row| problem.residuals_at(&found, &unknowns, row)),
            ..own
        })
    })
}

fn residuals(
    file: &ObservationsFile,
    of_row: impl Fn(usize) -> Option<[f64; READINGS]>,
) -> Vec<[f64; READINGS]> {
    let rows = (0..file.rows.len()).map(of_row);
    rows.map(Option::unwrap_or_default).collect()
}

/// A fit but for the residuals, in the robot's frame.
fn placed(
    problem: &ObservedProblem<'_>,
    outcome: Outcome,
    planes: impl Iterator<Item = [f64; 3]>,
    points: impl Iterator<Item = [f64; 4]>,
) -> ObservedFit {
    let rows = problem.rows();
    let left_out = rows.iter().enumerate().filter(|(_, row)| row.is_left_out());
    let planes = planes.map(|[c, a, b]| {
        let up = Vector3::new(-a, -b, 1.0);
        PlaneFound {
            normal: up.normalize(),
            offset: c / up.norm(),
        }
    });
    let points = points.map(|[x, y, z, offset]| PointFound {
        place: Vector3::new(x, y, z),
        offset,
    });
    ObservedFit {
        covariance: outcome.covariance.as_ref().map(with_exact_transmissions),
        frame: None,
        planes: planes.collect(),
        points: points.collect(),
        residuals: Vec::new(),
        weights: rows.iter().map(ObservationRow::weight).collect(),
        effective_rows: rows.iter().map(ObservationRow::weight).sum(),
        suspected: Vec::new(),
        left_out: left_out.map(|(index, _)| index).collect(),
        unknowns: problem.instruments().unknowns(),
        outcome,
    }
}

fn with_problem<T>(
    robot: &RobotFile,
    file: &ObservationsFile,
    frame: Frame,
    then: impl FnOnce(&ObservedProblem<'_>) -> Result<T, ObservedError>,
) -> Result<T, ObservedError> {
    with_rows(robot, file, frame, |instruments, rows| {
        then(&ObservationProblem::prepare(
            &robot.robot,
            instruments,
            rows,
        )?)
    })
}

fn with_rows<T>(
    robot: &RobotFile,
    file: &ObservationsFile,
    frame: Frame,
    then: impl FnOnce(&Instruments<'_, f64>, &mut [ObservationRow<f64>]) -> Result<T, ObservedError>,
) -> Result<T, ObservedError> {
    let (planes, points) = places(robot, file);
    let instruments = Instruments {
        frame: match frame {
            Frame::Base => PositionFrame::Base,
            Frame::Sensor => PositionFrame::Sensor,
        },
        planes: &planes,
        points: &points,
        noise: noise(robot).ok_or(ObservedError::Refused(Refusal::Unfinished))?,
        transmission: robot.transmission,
    };
    let mut rows = Vec::with_capacity(file.rows.len());
    for row in &file.rows {
        rows.push(ObservationRow::new(observation(&row.value)?));
    }
    then(&instruments, &mut rows)
}

/// The planes and points of a file, with what the robot file knows of them.
pub fn places(robot: &RobotFile, file: &ObservationsFile) -> (Vec<Plane<f64>>, Vec<Point<f64>>) {
    let facts = &robot.instruments;
    let planes = file.planes.iter().map(|name| {
        let known = facts.planes.iter().find(|plane| plane.name == *name);
        Plane {
            known: known.map(|plane| (plane.height, plane.sigma)),
            level: known.and_then(|plane| plane.tilt).map(f64::tan),
        }
    });
    let points = file.points.iter().map(|name| {
        let known = facts.points.iter().find(|point| point.name == *name);
        Point {
            known: known.and_then(|point| point.place),
            offset: known.is_some_and(|point| point.offset_unknown),
        }
    });
    (planes.collect(), points.collect())
}

/// Of every kind of reading; 1 mm for one that the robot file says nothing of.
pub fn noise(robot: &RobotFile) -> Option<ObservationNoise<f64>> {
    let facts = &robot.instruments;
    let joint = facts.joint_noise.unwrap_or_default();
    let position = robot.noise.or_else(|| Noise::new(1.0, joint).ok())?;
    ObservationNoise::new(
        position,
        facts.height_noise.unwrap_or(1.0),
        facts.distance_noise.unwrap_or(1.0),
    )
    .ok()
}

/// A row as the core has it.
///
/// # Errors
/// More planes or points than the core can number.
pub fn observation(reading: &Reading) -> Result<Observation<f64>, ObservedError> {
    let index = |index: usize| u8::try_from(index).map_err(|_| ObservedError::TooManyInstruments);
    let height = match reading.height {
        Some((plane, height)) => Some(Height {
            plane: index(plane)?,
            height,
        }),
        None => None,
    };
    let distance = match reading.distance {
        Some((from, distance)) => Some(Distance {
            from: match from {
                ReadingFrom::Point(point) => DistanceFrom::Point(index(point)?),
                ReadingFrom::Pose(joints) => DistanceFrom::Pose(joints),
            },
            distance,
        }),
        None => None,
    };
    Ok(Observation {
        joints: reading.joints,
        position: reading.position,
        height,
        distance,
    })
}
