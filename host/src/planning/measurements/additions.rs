//! Which measurements to add to those of a file: with its instruments, where they are.

use super::candidates::Candidates;
use super::kind::{Kind, Wish, Wishes};
use super::places::Places;
use super::planned::Planned;
use super::precision::{Judge, PARAMETERS, information_of_prior};
use super::request::{CheckRequest, MeasurementRequest};
use super::setup::{SHORTEST, Setup, workspace};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, Reading, ReadingFrom, Row};
use crate::fit::observations::{READINGS, linearized};
use crate::fit::options::Frame;
use crate::planning::design::{Criterion, Rows, Source, added};
use crate::planning::poses::{PlanError, Selection};
use delta_cal::Robot;
use nalgebra::SMatrix;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// The random numbers' seed: the same files give the same proposals.
const SEED: u64 = 1;
/// Heights that differ by less are of the same gauge block, mm.
const SAME_BLOCK: f64 = 1.0;
/// A file that was measured on more blocks than these was not measured on blocks.
const BLOCKS: usize = 8;
/// Lengths that differ by less are of the same bar, mm.
const SAME_BAR: f64 = 1.0;
/// A plane that is steeper is not added to: a plan's planes are level.
const LEVEL: f64 = 0.1;

/// Where the instruments are, what is added, and the file with it.
type Added = (Setup, Vec<Planned>, ObservationsFile);

/// Where the instruments are, the measurements that are best added, the best first, and the file with them. `None`
/// if the file has nothing that more could be taken with. `read`: the file as it was measured, as far as it was.
pub(super) fn additions(
    robot: &RobotFile,
    file: &ObservationsFile,
    read: &ObservationsFile,
    places: &Places,
    request: CheckRequest,
) -> Result<Option<Added>, PlanError> {
    let plane = busiest_level_plane(file, places);
    let kinds = kinds(file, plane);
    if kinds.is_empty() {
        return Ok(None);
    }
    let planning = MeasurementRequest {
        frame: request.frame,
        region: request.region,
        ..MeasurementRequest::new(robot, Wishes(kinds), request.add)
    };
    let setup = setup(robot, read, places, (plane, request.frame));
    let mut rng = Pcg32::seed_from_u64(SEED);
    let selection = Selection::new(robot, request.region.as_ref());
    let judge = Judge::new(robot, &workspace(robot), &mut rng)?;
    let candidates = Candidates::<READINGS>::new(&planning, &setup, &selection, &judge, &mut rng)?;
    let found = linearized(robot, file, request.frame).map_err(|_| PlanError::Singular)?;
    if found.parameters > PARAMETERS {
        return Err(PlanError::TooManyInstruments);
    }
    let source = Additions {
        robot: &robot.robot,
        file,
        places,
        plane,
        candidates: &candidates,
        prior: information_of_prior(&found, &robot.robot),
        noise: robot,
        frame: request.frame,
    };
    let given: Vec<_> = (0..file.rows.len()).map(Member::Given).collect();
    let chosen = added(&source, &given, request.add, &mut rng)?.ok_or(PlanError::Singular)?;
    let planned: Vec<_> = chosen
        .into_iter()
        .filter_map(|member| match member {
            Member::Given(_) => None,
            Member::New(planned) => Some(planned),
        })
        .collect();
    let all = source.with(planned.iter());
    Ok(Some((setup, planned, all)))
}

fn busiest_level_plane(file: &ObservationsFile, places: &Places) -> Option<usize> {
    let touches = |index: usize| {
        let rows = file.rows.iter().filter_map(|row| row.value.height);
        rows.filter(|(plane, _)| *plane == index).count()
    };
    let level = |index: &usize| places.planes[*index].normal.xy().norm() < LEVEL;
    (0..places.planes.len())
        .filter(level)
        .max_by_key(|index| touches(*index))
}

/// What the file measures and a plan can.
fn kinds(file: &ObservationsFile, plane: Option<usize>) -> Vec<Wish> {
    let rows = || file.rows.iter().map(|row| &row.value);
    let measures = |kind: Kind| match kind {
        Kind::Plane => plane.is_some(),
        Kind::Point => rows().any(|row| matches!(row.distance, Some((ReadingFrom::Point(_), _)))),
        Kind::Distance => rows().any(|row| matches!(row.distance, Some((ReadingFrom::Pose(_), _)))),
        Kind::Xy | Kind::Z | Kind::Xyz => {
            rows().any(|row| row.position.map(|own| own.is_some()) == kind.coordinates())
        }
    };
    let kinds = Kind::ALL.into_iter().filter(|kind| measures(*kind));
    kinds.map(|kind| Wish { kind, most: None }).collect()
}

fn setup(
    robot: &RobotFile,
    file: &ObservationsFile,
    places: &Places,
    (plane, frame): (Option<usize>, Frame),
) -> Setup {
    let names = file.points.iter().cloned();
    let height = plane.map_or(0.0, |index| {
        let plane = &places.planes[index];
        plane.offset / plane.normal.z
    });
    Setup {
        robot: robot.clone(),
        plane: height,
        blocks: blocks(file, plane),
        points: names.zip(places.points.iter().copied()).collect(),
        on_table: robot
            .instruments
            .points
            .iter()
            .all(|point| point.place.is_none()),
        lengths: lengths(file),
        frame,
        noise_stated: true,
    }
}

/// The heights of the gauge blocks that a plane was measured on, mm.
fn blocks(file: &ObservationsFile, plane: Option<usize>) -> Vec<f64> {
    let heights = file.rows.iter().filter_map(|row| row.value.height);
    let mut heights: Vec<_> = heights
        .filter(|(own, _)| Some(*own) == plane)
        .map(|(_, height)| height)
        .collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|one, other| (*one - *other).abs() < SAME_BLOCK);
    if heights.is_empty() || heights.len() > BLOCKS {
        return vec![0.0];
    }
    // To a tenth of a millimetre: the blocks' names.
    heights
        .iter()
        .map(|height| (10.0 * height).round() / 10.0 + 0.0)
        .collect()
}

/// The shortest and the longest distance.
fn lengths(file: &ObservationsFile) -> (f64, f64) {
    let distances = || file.rows.iter().filter_map(|row| row.value.distance);
    let shortest = distances().fold(f64::INFINITY, |least, (_, own)| least.min(own));
    let longest = distances().fold(0.0, |most, (_, own)| f64::max(most, own));
    if longest - shortest < SAME_BAR && longest > 0.0 {
        let length = 0.5 * (shortest + longest);
        return (length, length);
    }
    (SHORTEST.min(shortest), f64::INFINITY)
}

/// A row of the file, or a measurement that may be added.
#[derive(Debug, Clone)]
enum Member {
    Given(usize),
    New(Planned),
}

/// The rows of a file, and measurements that may be added to them.
struct Additions<'a> {
    robot: &'a Robot<f64>,
    file: &'a ObservationsFile,
    places: &'a Places,
    plane: Option<usize>,
    candidates: &'a Candidates<'a, READINGS>,
    prior: SMatrix<f64, PARAMETERS, PARAMETERS>,
    noise: &'a RobotFile,
    frame: Frame,
}

impl Additions<'_> {
    /// The file with these measurements at its end.
    fn with<'p>(&self, planned: impl Iterator<Item = &'p Planned>) -> ObservationsFile {
        let mut file = self.file.clone();
        file.rows.extend(planned.map(|planned| Row {
            line: 0,
            value: self.reading(planned),
        }));
        self.places.nominal(self.robot, &file)
    }

    /// What is read, without its values.
    fn reading(&self, planned: &Planned) -> Reading {
        let distance = match (&planned.other, planned.point) {
            (Some(other), _) => Some((ReadingFrom::Pose(other.joints), 1.0)),
            (None, Some(point)) => Some((ReadingFrom::Point(point), 1.0)),
            (None, None) => None,
        };
        Reading {
            joints: planned.pose.joints,
            position: planned.kind.coordinates().map(|read| read.then_some(0.0)),
            height: self
                .plane
                .filter(|_| planned.kind == Kind::Plane)
                .map(|plane| (plane, 0.0)),
            distance,
        }
    }
}

impl Source<1, PARAMETERS, READINGS> for Additions<'_> {
    type Candidate = Member;
    type Error = PlanError;

    fn draw_many(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Member>, PlanError> {
        let drawn = self.candidates.draw_many(count, rng)?;
        Ok(drawn.into_iter().map(Member::New).collect())
    }

    fn near(&self, member: &Member, spread: f64, rng: &mut Pcg32) -> Option<Member> {
        match member {
            Member::Given(_) => None,
            Member::New(planned) => self.candidates.near(planned, spread, rng).map(Member::New),
        }
    }

    fn rows(&self, members: &[Member]) -> Vec<Option<Rows<1, PARAMETERS, READINGS>>> {
        let new = members.iter().filter_map(|member| match member {
            Member::Given(_) => None,
            Member::New(planned) => Some(planned),
        });
        let Ok(found) = linearized(self.noise, &self.with(new), self.frame) else {
            return vec![None; members.len()];
        };
        let mut next = self.file.rows.len();
        let row = members.iter().map(|member| {
            let index = match member {
                Member::Given(index) => *index,
                Member::New(_) => {
                    next += 1;
                    next - 1
                }
            };
            let rows = found.rows.get(index)?;
            Some(Rows {
                blocks: [rows.fixed_rows::<PARAMETERS>(0).into_owned()],
                kind: 0,
            })
        });
        row.collect()
    }

    fn prior(&self) -> Vec<SMatrix<f64, PARAMETERS, PARAMETERS>> {
        vec![self.prior]
    }

    fn criterion(&self) -> Criterion {
        Criterion::A
    }

    fn weights(&self) -> Vec<SMatrix<f64, PARAMETERS, PARAMETERS>> {
        self.candidates.weights()
    }

    fn most(&self) -> &[usize] {
        &[usize::MAX]
    }
}
