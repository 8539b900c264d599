//! What the rows of a samples file determine, whether already measured or only planned, and which measurements to add
//! with the same instruments.

use super::PlanError;
use super::candidates::Candidates;
use super::judge::{Information, Judge};
use super::plan::unknown_parameter;
use super::request::{Kind, Region, Wish, Wishes};
use super::search::Search;
use super::selection::Selection;
use super::setup::{Planned, Setup};
use crate::accuracy::information::prior;
use crate::accuracy::uncertainty::{ExpectedError, inside};
use crate::calibration::known::Known;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind as ReadingKind, Reading, ReadingFrom, Readings};
use crate::fit::solution::{RobotCovariance, of_parameters};
use crate::fit::{Frame, Options, solve};
use crate::geometry::range;
use delta_cal::{ArmIndex, Parameter};
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
    /// Where the platform may be in the proposed measurements, in the axes of the robot file; anywhere if `None`.
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
        let mut setup = setup_of(robot, file, unmeasured, request.frame);
        let robot = setup.robot.robot;
        let rows = file.rows.iter();
        let rows: Vec<_> = rows.map(|row| setup.read(&robot, &row.value)).collect();
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
            match determined.additions(&rows, request) {
                Ok(next) => determined.next = next,
                Err(error) => determined.no_next = Some(error),
            }
        }
        Ok(determined)
    }

    fn additions(
        &mut self,
        rows: &[Reading],
        request: &SamplesRequest,
    ) -> Result<Vec<Planned>, PlanError> {
        let setup = &self.setup;
        let mut rng = Pcg32::seed_from_u64(SEED);
        let kinds = kinds(setup, rows);
        let selection = Selection::new(&setup.robot, request.region);
        let judge = Judge::new(&setup.robot, None, &mut rng)?;
        let weights = judge.weights(request.absolute);
        let search = Search::new(setup, &kinds, &selection, rows, weights, &mut rng)?;
        let next = search.added(request.add, &mut rng)?;
        let mut all = rows.to_vec();
        all.extend(next.iter().map(|own| setup.row(own)));
        let with_next = Information::of(&setup.robot, setup, &all, &search.anchors)?;
        let covariance = with_next.robot_covariance();
        let covariance = covariance.ok_or(PlanError::Singular)?;
        let robot = &setup.robot;
        self.with_next = ExpectedError::of_robot(robot, &robot.robot, &covariance);
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
    let rows: Vec<_> = file.rows.iter().map(|row| row.value).collect();
    let found = Information::of(robot, &setup, &rows, &[]).ok()?;
    found.robot_covariance()
}

fn reached(setup: &Setup, row: &Reading) -> bool {
    let robot = &setup.robot.robot;
    let other = match row.distance {
        Some((ReadingFrom::Pose(joints), _)) => Some(joints),
        _ => None,
    };
    let mut poses = std::iter::once(row.joints).chain(other);
    poses.all(|joints| robot.forward(&joints).is_ok())
}

fn anchors(
    setup: &Setup,
    rows: &[Reading],
    request: &SamplesRequest,
) -> Result<Vec<Reading>, PlanError> {
    let mut rng = Pcg32::seed_from_u64(SEED);
    let selection = Selection::new(&setup.robot, request.region);
    let candidates = Candidates::new(setup, &selection, &mut rng)?;
    candidates.anchors(&kinds(setup, rows), &mut rng)
}

/// The instruments named in a file, and what the robot file says about them.
fn unplaced(robot: &RobotFile, file: &Readings, frame: Frame) -> Setup {
    let measured = ReadingKind::ALL.map(|kind| file.holds(kind));
    Setup::unplaced(robot, file, frame, measured)
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
        setup.places = fit.places;
        return setup;
    }
    let robot = setup.robot.robot;
    let poses = inside(&robot, &setup.robot.reach());
    setup.place(|index| level(&robot, file, unmeasured, index), &poses);
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
fn instruments_as_used(setup: &mut Setup, rows: &[Reading]) {
    let facts = &setup.robot.instruments;
    for (index, plane) in setup.planes.iter_mut().enumerate() {
        let mut stated = facts.planes.iter().filter(|own| own.name == plane.name);
        if stated.any(|own| !own.blocks.is_empty()) {
            continue;
        }
        let heights = rows.iter().filter_map(|row| row.height);
        let heights = heights.filter(|(plane, _)| *plane == index);
        // Nominal heights of the blocks, to a tenth of a millimetre.
        let mut heights: Vec<_> = heights
            .map(|(_, height)| (10.0 * height).round() / 10.0 + 0.0)
            .collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup_by(|one, other| (*one - *other).abs() < SAME);
        plane.blocks = match heights.len() {
            1..=BLOCKS => heights,
            _ => vec![0.0],
        };
    }
    let lengths = |is_own: &dyn Fn(&ReadingFrom) -> bool| {
        let distances = rows.iter().filter_map(|row| row.distance);
        let own = distances.filter(|(from, _)| is_own(from));
        let (shortest, longest) = range(own.map(|(_, distance)| distance));
        if longest > 0.0 && longest - shortest < SAME {
            let middle = f64::midpoint(shortest, longest);
            return (middle, middle);
        }
        (shortest.min(longest.max(0.0)), f64::INFINITY)
    };
    if facts.lengths.is_none() {
        setup.lengths = lengths(&|from| matches!(from, ReadingFrom::Pose(_)));
    }
    for (index, point) in setup.points.iter_mut().enumerate() {
        let mut stated = facts.points.iter().filter(|own| own.name == point.name);
        if stated.all(|own| own.lengths.is_none()) {
            point.lengths = lengths(&|from| *from == ReadingFrom::Point(index));
        }
    }
}

/// The kinds that can be added: those that the rows measure.
fn kinds(setup: &Setup, rows: &[Reading]) -> Wishes {
    let mut planes = setup.places.planes.iter();
    let level = planes.all(|plane| plane.normal.z > STEEP);
    let measured = |kind: &Kind| match kind {
        Kind::Plane => level && !setup.planes.is_empty(),
        Kind::Point => !setup.points.is_empty(),
        Kind::Distance => {
            let mut distances = rows.iter().filter_map(|row| row.distance);
            distances.any(|(from, _)| matches!(from, ReadingFrom::Pose(_)))
        }
        Kind::Position(read) => rows
            .iter()
            .any(|row| row.position.map(|own| own.is_some()) == *read),
    };
    let kinds = Kind::ALL.into_iter().filter(measured);
    Wishes(kinds.map(|kind| Wish { kind, most: None }).collect())
}
