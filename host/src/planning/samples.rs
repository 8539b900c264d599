//! What the rows of a samples file determine, whether already measured or only planned, and which measurements to add
//! with the same instruments.

use super::PlanError;
use super::candidates::Candidates;
use super::judge::{Information, Judge};
use super::plan::unknown_parameter;
use super::request::{Kind, Region, Wish, Wishes};
use super::search::Search;
use super::selection::Selection;
use super::setup::{PlaneAt, Planned, PointAt, Setup, blocks_or_usual, place, with_noise};
use crate::accuracy::information::prior;
use crate::accuracy::uncertainty::{ExpectedError, inside};
use crate::calibration::known::Known;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind as ReadingKind, Readings};
use crate::fit::observations::{observation, places};
use crate::fit::solution::{RobotCovariance, of_parameters};
use crate::fit::{Frame, Options, solve};
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{DistanceFrom, Observation};
use delta_cal::{ArmIndex, Parameter};
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// A calibration is worthwhile if it leaves at most this fraction of the error.
const WORTHWHILE: f64 = 0.5;
/// With at least this leverage, a row is hardly checked by any other.
const UNCHECKED: f64 = 0.9;
/// Heights closer together than this belong to the same gauge block, and distances to the same bar, mm.
const SAME: f64 = 1.0;
/// A file with more different heights than this was not measured on gauge blocks.
const BLOCKS: usize = 8;
/// A plane steeper than about 60° is not touched from above.
const STEEP: f64 = 0.5;
/// Seed of the random numbers: the same files give the same proposals.
const SEED: u64 = 1;

/// What the rows of a file determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Determined {
    /// Where the instruments are, and the robot with the noise assumed.
    pub setup: Setup,
    /// Lines that do not count, because the nominal robot does not reach their joint angles.
    pub not_reached: Vec<u64>,
    /// Lines hardly checked by any other: an error in them goes into the parameters unnoticed.
    pub unchecked: Vec<u64>,
    /// The expected position error within the tolerance; `None` without a tolerance.
    pub before: Option<ExpectedError>,
    /// The expected error after these rows; `None` if they cannot be measured.
    pub now: Option<ExpectedError>,
    /// The expected error after these rows and the proposed ones.
    pub with_next: Option<ExpectedError>,
    /// What the rows determine better than the tolerance does.
    pub known: Known,
    /// A parameter whose σ (mm or radians) would make a calibration refuse.
    pub unknown: Option<(ArmIndex, Parameter, f64)>,
    /// The measurements best added, the best first.
    pub next: Vec<Planned>,
    /// Why no measurement is proposed.
    pub no_next: Option<PlanError>,
}

/// A question about the rows of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SamplesRequest {
    /// The frame of the coordinates.
    pub frame: Frame,
    /// The number of measurements to propose.
    pub add: usize,
    /// Where the platform may be in the proposed measurements; anywhere if `None`.
    pub region: Option<Region>,
    /// Minimise the absolute position error instead of the relative one.
    pub absolute: bool,
}

impl Determined {
    /// Evaluates the rows of a file; those in the lines `unmeasured` are only planned.
    ///
    /// # Errors
    /// More instruments than a calibration has room for, or rows that determine nothing.
    pub fn by(
        robot: &RobotFile,
        file: &Readings,
        unmeasured: &[u64],
        request: &SamplesRequest,
    ) -> Result<Self, PlanError> {
        let given = rows_of(file)?;
        let mut setup = setup_of(robot, file, unmeasured, request.frame);
        let robot = setup.robot.robot;
        let rows: Vec<_> = given.iter().map(|row| setup.read(&robot, row)).collect();
        instruments_as_used(&mut setup, &rows);
        let found = Information::of(&setup.robot, &setup, &rows, &[]).or_else(|_| {
            // An instrument with fewer readings than unknowns cannot be located by the rows alone.
            let anchors = anchors(&setup, &rows, request)?;
            Information::of(&setup.robot, &setup, &rows, &anchors)
        })?;
        let covariance = found.covariance().ok_or(PlanError::Singular)?;
        let of_robot = found.of_robot(&covariance);
        let error = |of: &RobotCovariance| ExpectedError::of_robot(&setup.robot, &robot, of);
        let before = prior(&setup.robot).and_then(|own| error(&own));
        let now = error(&of_robot);
        let unchecked = |rows: &nalgebra::DMatrix<f64>| {
            let own = (rows.transpose() * &covariance * rows).diagonal();
            own.max() > UNCHECKED
        };
        let lines = |which: &dyn Fn(usize) -> bool| -> Vec<u64> {
            let all = file.rows.iter().enumerate();
            let those = all.filter(|(index, _)| which(*index));
            those.map(|(_, row)| row.line).collect()
        };
        let mut determined = Self {
            not_reached: lines(&|index| !reached(&setup, &rows[index])),
            unchecked: lines(&|index| unchecked(&found.rows[index])),
            known: Known::of(
                &setup.robot.robot,
                setup.robot.tolerance.as_ref(),
                &of_parameters(&of_robot),
                before.as_ref(),
                now.as_ref(),
            ),
            unknown: unknown_parameter(&robot, &of_robot),
            before,
            now,
            with_next: None,
            next: Vec::new(),
            no_next: None,
            setup,
        };
        if request.add > 0 {
            match determined.additions(&rows, &found, request) {
                Ok(next) => determined.next = next,
                Err(error) => determined.no_next = Some(error),
            }
        }
        Ok(determined)
    }

    fn additions(
        &mut self,
        rows: &[Observation<f64>],
        found: &Information,
        request: &SamplesRequest,
    ) -> Result<Vec<Planned>, PlanError> {
        let setup = &self.setup;
        let mut rng = Pcg32::seed_from_u64(SEED);
        let kinds = kinds(setup, rows);
        let selection = Selection::new(&setup.robot, request.region.as_ref());
        let judge = Judge::new(&setup.robot, None, &mut rng)?;
        let candidates = Candidates::new(setup, &selection, &mut rng)?;
        let mut anchors = rows.to_vec();
        let more = candidates.anchors(&kinds, &mut rng)?;
        anchors.extend(more.iter().map(|own| setup.row(own)));
        let prior = found.prior.clone();
        let search = Search {
            setup,
            kinds: &kinds,
            candidates: &candidates,
            anchors: &anchors,
            prior: found
                .rows
                .iter()
                .fold(prior, |sum, rows| sum + rows * rows.transpose()),
            weights: judge.weights(request.absolute),
        };
        let next = search.added(request.add, &mut rng)?;
        let mut all = rows.to_vec();
        all.extend(next.iter().map(|own| setup.row(own)));
        let with_next = Information::of(&setup.robot, setup, &all, &anchors)?;
        let covariance = with_next.covariance().ok_or(PlanError::Singular)?;
        let robot = &setup.robot;
        self.with_next =
            ExpectedError::of_robot(robot, &robot.robot, &with_next.of_robot(&covariance));
        Ok(next)
    }

    /// Whether the rows, not the tolerance, determine everything that relative positions depend on.
    pub fn complete(&self) -> bool {
        self.unknown.is_none() && self.known.relative_positions()
    }

    /// Whether a calibration is expected to halve the relative position error or, without a tolerance, to be accepted.
    pub fn worthwhile(&self) -> bool {
        let rms = |own: &Option<ExpectedError>| own.as_ref().map(|own| own.intrinsic.rms);
        self.unknown.is_none()
            && match (rms(&self.before), rms(&self.now)) {
                (Some(before), Some(now)) => now <= WORTHWHILE * before,
                (None, Some(_)) => true,
                (_, None) => false,
            }
    }
}

/// The covariance of a robot's parameters (mm, radians) after these measurements; `None` if they cannot be taken.
pub(crate) fn covariance_after(
    robot: &RobotFile,
    file: &Readings,
    frame: Frame,
) -> Option<RobotCovariance> {
    let setup = Setup {
        robot: robot.clone(),
        ..unplaced(robot, file, frame)
    };
    let found = Information::of(robot, &setup, &rows_of(file).ok()?, &[]).ok()?;
    Some(found.of_robot(&found.covariance()?))
}

fn rows_of(file: &Readings) -> Result<Vec<Observation<f64>>, PlanError> {
    let rows = file.rows.iter().map(|row| observation(&row.value));
    rows.collect::<Result<_, _>>()
        .map_err(|_| PlanError::TooManyInstruments)
}

fn reached(setup: &Setup, row: &Observation<f64>) -> bool {
    let robot = &setup.robot.robot;
    let mut poses = std::iter::once(&row.joints).chain(row.other_joints());
    poses.all(|joints| robot.forward(joints).is_ok())
}

fn anchors(
    setup: &Setup,
    rows: &[Observation<f64>],
    request: &SamplesRequest,
) -> Result<Vec<Observation<f64>>, PlanError> {
    let mut rng = Pcg32::seed_from_u64(SEED);
    let selection = Selection::new(&setup.robot, request.region.as_ref());
    let candidates = Candidates::new(setup, &selection, &mut rng)?;
    let anchors = candidates.anchors(&kinds(setup, rows), &mut rng)?;
    Ok(anchors.iter().map(|own| setup.row(own)).collect())
}

/// The instruments named in a file, and what the robot file says about them.
fn unplaced(robot: &RobotFile, file: &Readings, frame: Frame) -> Setup {
    let (planes, points) = places(robot, file);
    let planes = file.planes.iter().zip(planes).map(|(name, known)| PlaneAt {
        name: name.clone(),
        normal: Vector3::z(),
        offset: known.known.map_or(0.0, |(height, _)| height),
        blocks: Vec::new(),
        known,
    });
    let points = file.points.iter().zip(points).map(|(name, known)| PointAt {
        name: name.clone(),
        place: Vector3::zeros(),
        lengths: (0.0, f64::INFINITY),
        known,
    });
    let measured = [
        file.holds(ReadingKind::Position),
        file.holds(ReadingKind::Height),
        file.holds(ReadingKind::Distance),
    ];
    let (with, noise_stated) = with_noise(robot, measured);
    Setup {
        robot: with,
        planes: planes.collect(),
        points: points.collect(),
        on_table: robot
            .instruments
            .points
            .iter()
            .all(|own| own.place.is_none()),
        lengths: (0.0, f64::INFINITY),
        frame,
        to_frame: RigidTransform::identity(),
        noise_stated,
    }
}

/// The instruments where a calibration locates them, if every row is measured and the calibration succeeds. Otherwise
/// planes are level, points are where a plan would put them, and the frame is the robot's.
fn setup_of(robot: &RobotFile, file: &Readings, unmeasured: &[u64], frame: Frame) -> Setup {
    let mut setup = unplaced(robot, file, frame);
    if unmeasured.is_empty()
        && let Ok(fit) = solve(
            &setup.robot,
            file,
            &Options {
                frame,
                ..Options::default()
            },
        )
    {
        let found = fit.places;
        setup.to_frame = found.frame.unwrap_or_else(RigidTransform::identity);
        for (own, found) in setup.planes.iter_mut().zip(&found.planes) {
            (own.normal, own.offset) = (found.normal, found.offset);
        }
        for (own, found) in setup.points.iter_mut().zip(&found.points) {
            own.place = found.place;
        }
        return setup;
    }
    let robot = setup.robot.robot;
    for (index, plane) in setup.planes.iter_mut().enumerate() {
        if plane.known.known.is_none() {
            plane.offset = level(&robot, file, unmeasured, index);
        }
    }
    let poses = inside(&robot, &setup.robot.reach());
    place(&mut setup.points, &poses);
    setup
}

/// The height of a plane according to the nominal robot's touches; without measurements, that of its lowest pose.
fn level(robot: &delta_cal::Robot<f64>, file: &Readings, unmeasured: &[u64], plane: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut lowest = f64::INFINITY;
    for row in &file.rows {
        let height = row.value.height.filter(|(own, _)| *own == plane);
        if let (Some((_, height)), Ok(there)) = (height, robot.forward(&row.value.joints)) {
            lowest = lowest.min(there.z);
            if unmeasured.binary_search(&row.line).is_err() {
                sum += there.z - height;
                count += 1.0;
            }
        }
    }
    match (count > 0.0, lowest.is_finite()) {
        (true, _) => sum / count,
        (false, true) => lowest,
        (false, false) => 0.0,
    }
}

/// Takes gauge blocks and lengths from the rows where the robot file states none.
fn instruments_as_used(setup: &mut Setup, rows: &[Observation<f64>]) {
    let facts = setup.robot.instruments.clone();
    for (index, plane) in setup.planes.iter_mut().enumerate() {
        let stated = facts.planes.iter().find(|own| own.name == plane.name);
        let stated = stated.map(|own| own.blocks.as_slice()).unwrap_or_default();
        let heights = rows.iter().filter_map(|row| row.height);
        let heights = heights.filter(|own| usize::from(own.plane) == index);
        // Nominal heights of the blocks, to a tenth of a millimetre.
        let mut heights: Vec<_> = heights
            .map(|own| (10.0 * own.height).round() / 10.0 + 0.0)
            .collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup_by(|one, other| (*one - *other).abs() < SAME);
        plane.blocks = match (stated.is_empty(), heights.len()) {
            (true, 1..=BLOCKS) => heights,
            (true, _) => vec![0.0],
            (false, _) => blocks_or_usual(stated),
        };
    }
    let lengths = |from: &dyn Fn(&DistanceFrom<f64>) -> bool| {
        let distances = rows.iter().filter_map(|row| row.distance);
        let own = distances
            .filter(|own| from(&own.from))
            .map(|own| own.distance);
        let (shortest, longest) = own.fold((f64::INFINITY, 0.0), |(low, high), own| {
            (f64::min(low, own), f64::max(high, own))
        });
        if longest - shortest < SAME && longest > 0.0 {
            return (
                f64::midpoint(shortest, longest),
                f64::midpoint(shortest, longest),
            );
        }
        (shortest.min(longest), f64::INFINITY)
    };
    let between = lengths(&|from| matches!(from, DistanceFrom::Pose(_)));
    setup.lengths = facts.lengths.unwrap_or(between);
    for (index, point) in setup.points.iter_mut().enumerate() {
        let stated = facts.points.iter().find(|own| own.name == point.name);
        let own = |from: &DistanceFrom<f64>| matches!(from, DistanceFrom::Point(own) if usize::from(*own) == index);
        point.lengths = stated
            .and_then(|own| own.lengths)
            .unwrap_or_else(|| lengths(&own));
    }
}

/// The kinds that can be added: those that the rows measure.
fn kinds(setup: &Setup, rows: &[Observation<f64>]) -> Wishes {
    let level = setup.planes.iter().all(|plane| plane.normal.z > STEEP);
    let measured = |kind: &Kind| match kind {
        Kind::Plane => level && !setup.planes.is_empty(),
        Kind::Point => !setup.points.is_empty(),
        Kind::Distance => rows.iter().any(|row| row.other_joints().is_some()),
        Kind::Position(read) => rows
            .iter()
            .any(|row| row.position.map(|own| own.is_some()) == *read),
    };
    let kinds = Kind::ALL.into_iter().filter(measured);
    Wishes(kinds.map(|kind| Wish { kind, most: None }).collect())
}
