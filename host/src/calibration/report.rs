//! The report of a calibration, the source of the terminal, HTML and JSON output. Lengths in millimetres, angles in
//! degrees; docs/calibration.schema.json documents the keys.

use super::findings::findings;
use crate::accuracy::budget::{Contribution, budget};
use crate::accuracy::expanded::{COVERAGE, Spread, of_vectors};
use crate::accuracy::improvement::WorkspaceComparison;
pub use crate::accuracy::position_error::BeforeAfter;
use crate::accuracy::repeats::{Attained, Repeatability};
use crate::accuracy::rigid_motion::{RigidMotions, moved};
pub use crate::accuracy::tilt::{RodsReport, TiltReport, UnknownRods};
use crate::accuracy::tilt::{tilt, unknown_rods};
use crate::accuracy::uncertainty::ExpectedError;
use crate::effects::Places;
use crate::explain::{Causes, Diagnosis};
use crate::files::{Convention, Document, Kind, READINGS, RobotFile};
use crate::finding::{Finding, Level};
pub use crate::fit::instruments::{
    DatumReport, FrameReport, PlaneReport, PointReport, TargetReport, TransmissionReport,
};
use crate::fit::instruments::{datum, planes, points, targets, transmissions};
use crate::fit::{Case, Frame, Method, Solution};
use crate::judge::credibility::{NoiseTest, ToleranceTest};
use crate::judge::known::{Known, NextPose, next_poses};
use crate::judge::{Judged, distance};
use crate::order::{MANY, shown};
use crate::text::{degrees, in_unit, unit};
use delta_cal::robot::{Arm, Drive, ParameterKind};
use delta_cal::{Parameter, Robot};
use nalgebra::Vector2;
use serde::Serialize;

/// Incremented whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 3;

/// A calibration and everything known about it.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Of this format, which changes whenever a field changes its name or meaning or is removed.
    pub schema_version: u32,
    /// The robot file.
    pub robot_file: String,
    /// The samples file.
    pub samples_file: String,
    /// The estimator.
    pub method: Method,
    /// The frame of the coordinates.
    pub frame: Frame,
    /// How the controller counts, in words; `null` if as usual.
    pub convention: Option<String>,
    /// The loss function of a robust fit: `tukey`.
    pub loss: Option<&'static str>,
    /// Samples (rows).
    pub sample_count: usize,
    /// Readings (numbers) in them.
    pub reading_count: usize,
    /// Number of distinct poses.
    pub distinct_poses: usize,
    /// Parameters with their σ, arm by arm.
    pub arms: Vec<ArmReport>,
    /// Distances of the samples with x, y and z from where the robot is.
    pub position_error_mm: Option<BeforeAfter>,
    /// Residuals of each kind of reading.
    pub residuals: Vec<KindResiduals>,
    /// Every sample in the file's order; of more than 10,000 the farthest off, and others spread evenly.
    pub samples: Vec<SampleReport>,
    /// What the residuals say of the noise of each kind of reading.
    pub noise: Vec<NoiseTest>,
    /// Errors that the model cannot represent.
    #[serde(flatten)]
    pub causes: Causes,
    /// By what the readings' part of every σ was multiplied because of residuals and causes.
    pub sigma_widened_by: f64,
    /// The position error that the calibrated robot is expected to have.
    pub expected_error: Option<ExpectedError>,
    /// What each source contributes to it, the largest first.
    pub budget: Vec<Contribution>,
    /// What rods of which nothing is known add to it.
    pub unknown_rods: Option<UnknownRods>,
    /// Position errors as found and as left, over the samples and over the workspace.
    pub found_and_left: Vec<FoundAndLeft>,
    /// Pose accuracy and repeatability, if poses were repeated.
    pub repeatability: Option<Repeatability>,
    /// What the datum points leave unexplained.
    pub datum: Vec<DatumReport>,
    /// Where the targets are.
    pub targets: Vec<TargetReport>,
    /// The same as an expanded uncertainty of 95 %.
    pub expanded_uncertainty: Option<ExpandedReport>,
    /// Whether `--limit` is met.
    pub acceptance: Option<AcceptanceReport>,
    /// What the robot says of the stated tolerance.
    pub tolerance: Option<ToleranceTest>,
    /// What the calibration means over the workspace.
    pub workspace: Option<WorkspaceComparison>,
    /// What the readings determine.
    pub determined: Known,
    /// X_sensor = rotation · X_robot + translation.
    pub sensor_frame: Option<FrameReport>,
    /// Where the planes are.
    pub planes: Vec<PlaneReport>,
    /// Where the points are.
    pub points: Vec<PointReport>,
    /// The joints' transmissions, if they were to be found.
    pub transmissions: Vec<TransmissionReport>,
    /// How the platform tilts, if the spacing of its rods is stated.
    pub tilt: Option<TiltReport>,
    /// The lines that a robust fit left out.
    pub suspected_samples: Vec<u64>,
    /// The poses whose x, y and z would help most.
    pub next_poses: Vec<NextPose>,
    /// What would explain the samples better as a whole.
    pub diagnosis: Option<Diagnosis>,
    /// The warnings in words, the gravest first.
    pub warnings: Vec<String>,
    /// Everything that was found, warnings and notes, with figures.
    pub findings: Vec<Finding>,
    /// Robot, measurement, files and date.
    pub document: Option<Document>,
    /// A remark that the result itself cannot contain: that the samples are simulated, or where it was computed.
    #[serde(skip)]
    pub origin: Option<&'static str>,
    /// The robot file.
    #[serde(skip)]
    pub before: RobotFile,
    /// The calibrated robot, with everything else from the robot file.
    #[serde(skip)]
    pub after: RobotFile,
    /// The solution, σ widened.
    #[serde(skip)]
    pub solution: Solution,
}

/// One arm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArmReport {
    /// 1, 2 or 3.
    pub arm: usize,
    /// In the order of the file's keys.
    pub parameters: Vec<ParameterReport>,
    /// For a rotary arm, the length of the upper arm and the joint zero: its angle to level where the joint reads 0,
    /// positive towards z.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub upper_arm: Vec<ParameterReport>,
    /// Condition number of the scaled problem, 1 at best.
    pub condition: f64,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterReport {
    /// As the paper has it: `Dx`, …, `Lb`.
    pub symbol: &'static str,
    /// `mm`, `deg`, or nothing of a scale.
    pub unit: &'static str,
    /// In the robot file.
    pub before: f64,
    /// Calibrated.
    pub after: f64,
    /// The difference.
    pub change: f64,
    /// Standard uncertainty, marginal over everything that was estimated.
    pub sigma: f64,
    /// The part, 0 to 1, that the tolerance decided and not the samples.
    pub prior_share: f64,
}

/// Residuals of one kind of reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KindResiduals {
    /// Which.
    pub kind: Kind,
    /// How many.
    pub readings: usize,
    /// √ of the mean square, mm, with the robot file.
    pub before_rms_mm: f64,
    /// With the calibrated robot.
    pub after_rms_mm: f64,
    /// The largest after, mm.
    pub after_max_mm: f64,
    /// Its line.
    pub max_at_line: Option<u64>,
}

/// One sample.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SampleReport {
    /// Its line in the samples file.
    pub line: u64,
    /// Its name, if the file has names.
    pub name: Option<String>,
    /// The position less that of the calibrated robot, in the axes of the robot file.
    pub residual_mm: Option<[f64; 3]>,
    /// Distance of a position, or the largest residual of other readings, with the robot file; `null` where that does not
    /// reach the joint angles.
    pub error_before_mm: Option<f64>,
    /// With the calibrated robot.
    pub error_after_mm: Option<f64>,
    /// √ of the mean square residual of its readings in σ of their noise; 1 is expected.
    pub error_after_sigma: f64,
    /// What it counted: 1 in least squares, 0 if it was left out.
    pub weight: f64,
    #[serde(skip)]
    pub(crate) joints: [f64; 3],
    #[serde(skip)]
    pub(crate) suspected: bool,
}

/// An expanded uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExpandedReport {
    /// `absolute`, in the frame of the base, or `relative` where no reading tells its place.
    pub of: &'static str,
    /// The probability that the error in space of a position is within it.
    pub coverage: f64,
    /// k, by which the rms of the standard uncertainty is multiplied.
    pub coverage_factor: f64,
    /// Of an estimated noise.
    pub degrees_of_freedom: Option<f64>,
    /// Over the workspace.
    pub workspace_mm: f64,
    /// At the worst place.
    pub worst_mm: f64,
}

/// Position errors as found, with the robot file, and as left, with the calibrated robot, along one axis of the robot file
/// or in space. A position error is the position less the one that the controller computes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FoundAndLeft {
    /// `samples` or `workspace`.
    pub over: &'static str,
    /// `x`, `y`, `z` or `distance`.
    pub of: &'static str,
    /// Mean, rms and worst as found.
    pub found_mm: [f64; 3],
    /// The same as left; over the workspace the mean is 0, and rms and worst are standard uncertainties.
    pub left_mm: [f64; 3],
}

/// Whether a limit is met.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AcceptanceReport {
    /// As asked for.
    pub limit_mm: f64,
    /// What was compared.
    pub expanded_mm: Option<f64>,
    /// Whether it is within the limit.
    pub passed: bool,
}

impl Report {
    pub(crate) fn new(case: &Case<'_>, judged: Judged, diagnosis: Option<Diagnosis>) -> Self {
        let (before, readings) = (case.before, case.readings);
        let solution = &judged.solution;
        let frame = solution.places.frame;
        let mut after = RobotFile {
            robot: solution.robot.clone(),
            sensor_frame: frame.or(before.sensor_frame),
            parallelograms: before.parallelograms.map(|own| {
                solution
                    .tilt()
                    .map_or(own, |found| own.with_numbers(&found.by))
            }),
            ..before.clone()
        };
        let (found, known) = judged.expected();
        let (expected, spread) = found.unzip();
        after.instruments.expected = expected
            .as_ref()
            .map(|own| [own.absolute_rms_mm, own.relative_rms_mm]);
        let expected = expected.as_ref();
        let lines = readings.rows.iter().zip(&solution.rows);
        let suspected = lines
            .filter(|(_, fit)| fit.suspected)
            .map(|(row, _)| row.line)
            .collect();
        let findings = findings(case, &judged, &known, diagnosis.as_ref());
        let warnings = findings.iter().filter(|own| own.level == Level::Warning);
        Self {
            schema_version: SCHEMA_VERSION,
            robot_file: before.name.clone(),
            samples_file: readings.name.clone(),
            method: solution.method,
            frame: solution.frame,
            convention: (!before.convention.is_usual()).then(|| before.convention.to_string()),
            loss: case.options.robust.then_some("tukey"),
            sample_count: readings.rows.len(),
            reading_count: readings.readings(),
            distinct_poses: readings.distinct_poses(),
            arms: arms(before, solution),
            position_error_mm: judged.errors,
            residuals: residuals(case, solution),
            samples: samples(case, solution),
            noise: judged.noise,
            causes: judged.causes,
            sigma_widened_by: judged.widening,
            expected_error: expected.map(|own| own.in_axes_of(&before.convention)),
            budget: judged
                .weights
                .as_ref()
                .map_or_else(Vec::new, |own| budget(solution, before, own)),
            unknown_rods: unknown_rods(before, solution, &judged.poses.inside),
            // Those of a printer are its bed's.
            found_and_left: spread
                .as_ref()
                .filter(|_| !case.options.of_printer)
                .map_or_else(Vec::new, |spread| found_and_left(case, solution, spread)),
            repeatability: Repeatability::of(
                readings,
                &attained(case, solution, &solution.robot, &solution.places),
            ),
            datum: datum(before, frame.as_ref()),
            targets: targets(before, solution),
            expanded_uncertainty: expected
                .zip(spread.as_ref())
                .and_then(|(own, spread)| expanded(solution, own, spread)),
            acceptance: None,
            tolerance: judged.tolerance,
            workspace: judged.workspace,
            determined: known,
            sensor_frame: frame
                .as_ref()
                .map(|own| FrameReport::of(own, &before.convention)),
            planes: planes(readings, solution, before),
            points: points(readings, solution, before),
            transmissions: transmissions(solution, &before.convention),
            tilt: tilt(&after, solution, &judged.poses.inside),
            suspected_samples: suspected,
            next_poses: next_poses(before, solution, &judged.poses.inside),
            diagnosis,
            warnings: warnings.map(|own| own.text.clone()).collect(),
            findings,
            document: None,
            origin: None,
            before: before.clone(),
            after,
            solution: judged.solution,
        }
    }

    /// Sets a limit for the expanded uncertainty over the workspace, mm.
    #[must_use]
    pub fn with_limit(mut self, limit: f64) -> Self {
        let expanded = self.expanded_uncertainty.map(|own| own.workspace_mm);
        self.acceptance = Some(AcceptanceReport {
            limit_mm: limit,
            expanded_mm: expanded,
            passed: expanded.is_some_and(|expanded| expanded <= limit),
        });
        self
    }
}

fn arms(before: &RobotFile, solution: &Solution) -> Vec<ArmReport> {
    let (drive, convention) = (before.robot.drive(), &before.convention);
    let arms = before.robot.arms().iter().zip(solution.robot.arms());
    let arms = arms.enumerate().map(|(arm, (from, to))| {
        let of = |parameter: &Parameter| {
            let parameter = *parameter;
            let index = 8 * arm + parameter.index();
            let in_file = |value| match parameter.kind() {
                ParameterKind::Length | ParameterKind::Ratio => value,
                ParameterKind::Angle => degrees(value),
            };
            let [before, after] =
                [from, to].map(|arm| convention.parameter(parameter, arm.get(parameter)));
            ParameterReport {
                symbol: parameter.symbol(),
                unit: unit(parameter),
                before: in_file(before),
                after: in_file(after),
                change: in_unit(parameter, after - before),
                sigma: in_unit(parameter, solution.covariance[(index, index)].sqrt()),
                prior_share: solution.prior_share[index],
            }
        };
        ArmReport {
            arm: arm + 1,
            parameters: drive.parameters().iter().map(of).collect(),
            upper_arm: match drive {
                Drive::Rotary => upper_arm(arm, [from, to], solution, convention).into(),
                Drive::Linear => Vec::new(),
            },
            condition: solution.conditions[arm],
        }
    });
    arms.collect()
}

/// Length and direction, to first order in `La_x` and `La_y`.
fn upper_arm(
    arm: usize,
    [from, to]: [&Arm<f64>; 2],
    solution: &Solution,
    convention: &Convention,
) -> [ParameterReport; 2] {
    let place = 8 * arm + Parameter::LaX.index();
    let covariance = solution.covariance.fixed_view::<2, 2>(place, place);
    let lengths = [from, to].map(Arm::upper_arm_length);
    let zeros = [from, to].map(|arm| {
        let (x, y) = arm.la();
        degrees(convention.angle(y.atan2(x)))
    });
    let of =
        |symbol, unit, [before, after]: [f64; 2], by: Vector2<f64>, prior_share| ParameterReport {
            symbol,
            unit,
            before,
            after,
            change: after - before,
            sigma: by.dot(&(covariance * by)).sqrt(),
            prior_share,
        };
    let ((x, y), length) = (to.la(), to.upper_arm_length());
    let along = Vector2::new(x, y) / length;
    let across = Vector2::new(-y, x) * (degrees(1.0) / (length * length));
    let share = |index| solution.prior_share[index];
    [
        of("upper arm", "mm", lengths, along, share(place)),
        of("joint zero", "deg", zeros, across, share(place + 1)),
    ]
}

fn residuals(case: &Case<'_>, solution: &Solution) -> Vec<KindResiduals> {
    let (robot, places) = (&case.before.robot, &solution.places_before);
    let rows = || solution.readings.rows.iter().zip(&solution.rows);
    let of = |kind: Kind| {
        let counted = rows().filter(|(_, fit)| !fit.suspected && !fit.left_out);
        let errors = counted.flat_map(|(row, _)| {
            let read = row.value.read();
            let was = places.expected(robot, &row.value);
            let is = solution.places.expected(&solution.robot, &row.value);
            let of_kind = (0..READINGS).filter(move |place| Kind::of_place(*place) == kind);
            of_kind.filter_map(move |place| {
                let read = read[place]?;
                Some((read - was[place]?, read - is[place]?, row.line))
            })
        });
        let errors: Vec<_> = errors.collect();
        let rms = |squares: f64| f64::sqrt(squares / errors.len() as f64);
        let by_size = |a: &&(f64, f64, u64), b: &&(f64, f64, u64)| a.1.abs().total_cmp(&b.1.abs());
        let (_, worst, line) = errors.iter().rev().max_by(by_size)?;
        Some(KindResiduals {
            kind,
            readings: errors.len(),
            before_rms_mm: rms(errors.iter().map(|(was, ..)| was * was).sum()),
            after_rms_mm: rms(errors.iter().map(|(_, is, _)| is * is).sum()),
            after_max_mm: worst.abs(),
            max_at_line: Some(*line),
        })
    };
    Kind::ALL.into_iter().filter_map(of).collect()
}

fn samples(case: &Case<'_>, solution: &Solution) -> Vec<SampleReport> {
    let rows = &solution.readings.rows;
    let attained = attained(case, solution, &solution.robot, &solution.places);
    let of = |index: usize| {
        let (row, fit) = (&rows[index], &solution.rows[index]);
        let error = |robot, places: &Places| {
            if let Some(sample) = row.value.sample() {
                return distance(robot, places, &sample);
            }
            let pairs = row.value.read().into_iter();
            let pairs = pairs.zip(places.expected(robot, &row.value));
            let apart = pairs.filter_map(|(read, expected)| Some((read? - expected?).abs()));
            apart.reduce(f64::max)
        };
        let squares: f64 = fit.whitened.iter().map(|own| own * own).sum();
        let count = row.value.readings().max(1) as f64;
        SampleReport {
            line: row.line,
            name: case.readings.name_of(row.line).map(str::to_owned),
            residual_mm: attained[index].map(|(computed, is)| (is - computed).into()),
            error_before_mm: error(&case.before.robot, &solution.places_before),
            error_after_mm: error(&solution.robot, &solution.places),
            error_after_sigma: (squares / count).sqrt(),
            weight: if fit.left_out { 0.0 } else { fit.weight },
            joints: row.value.joints,
            suspected: fit.suspected,
        }
    };
    let size = |index: usize| {
        let whitened = solution.rows[index].whitened.iter();
        whitened.map(|own| own.abs()).fold(0.0, f64::max)
    };
    let shown = shown(rows.len(), MANY, size);
    shown.into_iter().map(of).collect()
}

fn expanded(
    solution: &Solution,
    expected: &ExpectedError,
    spread: &Spread,
) -> Option<ExpandedReport> {
    let (of, rms, worst) = if solution.is_absolute() {
        let worst = expected.absolute_worst_mm;
        ("absolute", expected.absolute_rms_mm, worst)
    } else {
        let worst = expected.relative_worst_mm;
        ("relative", expected.relative_rms_mm, worst)
    };
    let workspace_mm = spread.expanded()?;
    Some(ExpandedReport {
        of,
        coverage: COVERAGE,
        coverage_factor: workspace_mm / rms,
        degrees_of_freedom: solution.estimated_freedom(),
        workspace_mm,
        worst_mm: spread.factor_at_worst()? * worst,
    })
}

/// Each complete position as a robot computes it and as it was measured, in the axes of the robot file.
fn attained(
    case: &Case<'_>,
    solution: &Solution,
    robot: &Robot<f64>,
    places: &Places,
) -> Vec<Option<Attained>> {
    let convention = &case.before.convention;
    let rows = solution.readings.rows.iter();
    let of_row = rows.map(|row| {
        let (computed, is) = places.attained(robot, &row.value)?;
        Some((convention.vector(&computed), convention.vector(&is)))
    });
    of_row.collect()
}

fn found_and_left(case: &Case<'_>, solution: &Solution, spread: &Spread) -> Vec<FoundAndLeft> {
    const AXES: [&str; 4] = ["x", "y", "z", "distance"];
    let (before, convention) = (&case.before.robot, &case.before.convention);
    let counted =
        |index: &usize| !(solution.rows[*index].suspected || solution.rows[*index].left_out);
    let over_samples = |robot: &Robot<f64>, places: &Places| {
        let all = attained(case, solution, robot, places);
        let counted = (0..all.len()).filter(counted);
        let errors: Vec<_> = counted
            .filter_map(|index| all[index].map(|(computed, is)| is - computed))
            .collect();
        (!errors.is_empty()).then(|| of_vectors(&errors))
    };
    let rows = |over, found: [[f64; 3]; 4], left: [[f64; 3]; 4]| {
        [0, 1, 2, 3].map(|axis| FoundAndLeft {
            over,
            of: AXES[axis],
            found_mm: found[axis],
            left_mm: left[axis],
        })
    };
    let mut lines = Vec::new();
    let found = over_samples(before, &solution.places_before);
    let left = over_samples(&solution.robot, &solution.places);
    lines.extend(
        found
            .zip(left)
            .iter()
            .flat_map(|own| rows("samples", own.0, own.1)),
    );
    let moved = moved(before, &spread.poses);
    let errors = if solution.is_absolute() {
        Some(moved.iter().map(|(_, error)| *error).collect())
    } else {
        let motions = RigidMotions::of(moved.iter().map(|(at, _)| *at));
        motions.map(|own| own.removed(&moved))
    };
    let Some(errors) = errors else { return lines };
    let errors: Vec<_> = errors.iter().map(|own| convention.vector(own)).collect();
    let left = spread.sigmas().map(|(rms, worst)| [0.0, rms, worst]);
    lines.extend(rows("workspace", of_vectors(&errors), left));
    lines
}
