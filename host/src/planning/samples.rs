//! What the rows of a samples file determine, whether already measured or only planned, and which measurements to add
//! with the same instruments.

use super::PlanError;
use super::judge::{Information, weights};
use super::plan::unknown_parameter;
use super::request::{Kind, PlanRequest, Wish, Wishes};
use super::search::Search;
use super::selection::Selection;
use super::setup::{Planned, Setup};
use crate::accuracy::information::prior;
use crate::accuracy::uncertainty::ExpectedError;
use crate::files::{Reading, ReadingFrom, Readings, RobotFile};
use crate::fit::Frame;
use crate::fit::datum::Datum;
use crate::fit::jointly::of_platform_point;
use crate::fit::solution::{RobotCovariance, of_parameters};
use crate::judge::known::Known;
use crate::text::in_file_units;
use delta_cal::{ArmIndex, Parameter, Robot};
use nalgebra::DMatrix;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use serde::{Serialize, Serializer};

/// A calibration is worthwhile if it leaves at most this fraction of the error.
const WORTHWHILE: f64 = 0.5;
/// With at least this leverage, a row is hardly checked by any other.
const UNCHECKED: f64 = 0.9;
/// A plane steeper than about 60° is not touched from above.
const STEEP: f64 = 0.5;

/// What the rows of a file determine, in the units and axes of the robot file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Determined {
    /// Name of the robot file.
    pub robot_file: String,
    /// Name of the samples file.
    pub samples_file: String,
    /// Whether no relative position depends on the tolerance; without a tolerance, whether every parameter is
    /// determined.
    pub determined: bool,
    /// Whether a calibration is expected to halve the relative error or, without a tolerance, to be accepted.
    pub worthwhile: bool,
    /// What the rows determine, in one sentence.
    pub verdict: String,
    /// Lines that are only planned.
    pub unmeasured_lines: Vec<u64>,
    /// Lines that do not count, because the nominal robot does not reach their joint angles.
    pub not_reached_lines: Vec<u64>,
    /// Lines hardly checked by any other: an error in them goes into the parameters unnoticed.
    pub unchecked_lines: Vec<u64>,
    /// Noise and tolerance, in words.
    pub assumptions: String,
    /// The expected position error within the tolerance; `None` without a tolerance.
    pub expected_error_before: Option<ExpectedError>,
    /// The expected error after these rows; `None` if they cannot be measured.
    pub expected_error: Option<ExpectedError>,
    /// The expected error after these rows and the proposed ones.
    pub expected_error_with_next: Option<ExpectedError>,
    /// The measurements best added, the best first.
    pub next: Vec<Planned>,
    /// Why there is none; `None` if there are some or none was requested.
    #[serde(serialize_with = "in_words")]
    pub no_next: Option<PlanError>,
    /// The number of rows.
    #[serde(skip)]
    pub row_count: usize,
    /// Where the instruments are, and the robot with the noise assumed.
    #[serde(skip)]
    pub setup: Setup,
}

#[allow(clippy::ref_option)] // as serde calls it
fn in_words<S: Serializer>(why: &Option<PlanError>, serializer: S) -> Result<S::Ok, S::Error> {
    let why = why.map(|error| error.to_string());
    why.serialize(serializer)
}

impl Determined {
    /// Evaluates the rows of a file, of which those in the lines `unmeasured` are only planned, and looks for measurements to
    /// add: the request's count, of the kinds that the rows measure.
    ///
    /// # Errors
    /// More instruments than a calibration has room for, or rows that determine nothing.
    pub fn by(
        request: &PlanRequest<'_>,
        file: &Readings,
        unmeasured: &[u64],
    ) -> Result<Self, PlanError> {
        request.place()?;
        let weighted = file.noise_into(request.robot);
        // An invalid datum was refused earlier.
        let known = Datum::known_frame(request.robot, request.frame).unwrap_or_default();
        let mut setup = Setup::of_rows(&weighted, file, unmeasured, request.frame);
        let file = &of_platform_point(request.robot, file, known);
        let robot = setup.robot.robot.clone();
        let rows = file.rows.iter();
        let rows: Vec<_> = rows.map(|row| setup.read(&robot, &row.value)).collect();
        setup.as_used(&rows);
        let kinds = kinds(&setup, &rows);
        let selection = Selection::new(request.robot, request.region);
        let weights = weights(request.robot, request.absolute);
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let search = match &weights {
            Some(weights) => Search::new(&setup, &kinds, &selection, &rows, weights, &mut rng),
            None => Err(PlanError::NoPose),
        };
        let found = Information::of(&robot, &setup, &rows, &[]).or_else(|_| match &search {
            // An instrument with fewer readings than unknowns cannot be located by the rows alone.
            Ok(search) => search.information(&rows),
            Err(error) => Err(*error),
        })?;
        let covariance = found.covariance().ok_or(PlanError::Singular)?;
        let of_robot = found.of_robot(&covariance);
        let error = |of: &RobotCovariance| ExpectedError::of_robot(&setup.robot, &robot, of);
        let before = prior(&setup.robot).and_then(|own| error(&own));
        let now = error(&of_robot);
        let (mut next, mut with_next, mut no_next) = (Vec::new(), None, None);
        if request.count > 0 {
            match search.and_then(|own| additions(&own, &rows, request.count, &mut rng)) {
                Ok((added, of_robot)) => (next, with_next) = (added, error(&of_robot)),
                Err(error) => no_next = Some(error),
            }
        }
        let unchecked = |rows: &DMatrix<f64>| {
            let own = (rows.transpose() * &covariance * rows).diagonal();
            own.max() > UNCHECKED
        };
        let lines = |which: &dyn Fn(usize) -> bool| -> Vec<u64> {
            let all = file.rows.iter().enumerate();
            let those = all.filter(|(index, _)| which(*index));
            those.map(|(_, row)| row.line).collect()
        };
        let known = Known::of(
            &robot,
            setup.robot.tolerance.as_ref(),
            &of_parameters(&of_robot),
            before.as_ref(),
            now.as_ref(),
        );
        let unknown = unknown_parameter(&robot, &of_robot);
        let rms = [&before, &now].map(|own| own.as_ref().map(|own| own.relative_rms_mm));
        let worthwhile = match rms {
            [Some(before), Some(now)] => now <= WORTHWHILE * before,
            [None, Some(_)] => true,
            [_, None] => false,
        };
        let convention = &setup.robot.convention;
        let report = |own: Option<ExpectedError>| own.map(|own| own.in_axes_of(convention));
        Ok(Self {
            robot_file: setup.robot.name.clone(),
            samples_file: file.name.clone(),
            determined: unknown.is_none() && known.relative_positions(),
            worthwhile: unknown.is_none() && worthwhile,
            verdict: verdict(&known, unknown, before.is_some()),
            unmeasured_lines: unmeasured.to_vec(),
            not_reached_lines: lines(&|index| !reached(&robot, &rows[index])),
            unchecked_lines: lines(&|index| unchecked(&found.rows[index])),
            assumptions: setup.assumptions(&next),
            expected_error_before: report(before),
            expected_error: report(now),
            expected_error_with_next: report(with_next),
            next,
            no_next,
            row_count: rows.len(),
            setup,
        })
    }
}

/// The measurements best added to rows, and what is then known of the robot.
fn additions(
    search: &Search<'_>,
    rows: &[Reading],
    count: usize,
    rng: &mut Pcg32,
) -> Result<(Vec<Planned>, RobotCovariance), PlanError> {
    let next = search.added(count, rng)?;
    let mut all = rows.to_vec();
    all.extend(next.iter().map(|own| own.reading));
    let covariance = search.information(&all)?.robot_covariance();
    Ok((next, covariance.ok_or(PlanError::Singular)?))
}

/// What the rows determine, in one sentence. `unknown`: a parameter whose σ would make a calibration refuse.
fn verdict(
    known: &Known,
    unknown: Option<(ArmIndex, Parameter, f64)>,
    has_tolerance: bool,
) -> String {
    if let Some((arm, parameter, sigma)) = unknown {
        let sigma = in_file_units(parameter, sigma);
        return format!(
            "These rows do not determine the robot: {parameter} of {arm} is known only to {sigma} (σ)."
        );
    }
    if !has_tolerance {
        return "These rows determine every parameter.".to_owned();
    }
    if known.relative_positions() {
        return "These rows determine relative positions better than the tolerance does."
            .to_owned();
    }
    let scale = if known.scale {
        ""
    } else {
        ", and not the scale of the robot"
    };
    format!(
        "These rows improve {} of the {} parameter combinations of relative positions{scale}.",
        known.combinations.min(known.of),
        known.of
    )
}

/// The covariance of a robot's parameters (mm, radians) after these measurements; `None` if they cannot be taken.
pub(crate) fn covariance_after(
    robot: &RobotFile,
    file: &Readings,
    frame: Frame,
) -> Option<RobotCovariance> {
    let setup = Setup {
        robot: robot.clone(),
        ..Setup::unplaced(robot, file, frame, |kind| file.holds(kind))
    };
    let rows: Vec<_> = file.rows.iter().map(|row| row.value).collect();
    let found = Information::of(&robot.robot, &setup, &rows, &[]).ok()?;
    found.robot_covariance()
}

fn reached(robot: &Robot<f64>, row: &Reading) -> bool {
    let other = match row.distance {
        Some((ReadingFrom::Pose(joints), _)) => Some(joints),
        _ => None,
    };
    let mut poses = std::iter::once(row.joints).chain(other);
    poses.all(|joints| robot.forward(&joints).is_ok())
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
