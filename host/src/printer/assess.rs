//! A printer assessed: what its configuration is off, what to paste instead, and what that leaves.

use super::area::{Better, ON_THE_BED, Off, Uncertain, poses, radius_of, too_few, touches};
use super::contradiction::{lack_of_fit, worst_reading};
use super::effector::Effector;
use super::next::{Next, next};
use super::notes::{Change, crash, notes};
use super::shape::Uneven;
use crate::accuracy::information::prior;
use crate::export::error::ExportError;
use crate::export::geometry::Frame;
use crate::export::positions::{Loss, Place, Wanted};
use crate::export::target::{Target, Written};
use crate::export::{Case, Settings, held, target};
use crate::files::robot_file::RobotFile;
use crate::fit::Solution;
use crate::import::{Firmware, Imported, SHRINKAGE, lowered};
use delta_cal::Robot;
use nalgebra::Vector3;
use serde::Serialize;

/// What is fitted on the bed counts so many times, for the first layer depends on it.
const FIRST_LAYER: f64 = 50.0;

/// What is known of a printer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Printer {
    /// Whose configuration it is.
    pub firmware: Firmware,
    /// `delta` or `rotary_delta`.
    pub kinematics: &'static str,
    /// What the import has to say.
    pub notes: Vec<String>,
    /// Whether the owner measured the rods.
    #[serde(skip)]
    pub rods_measured: bool,
    /// How many heights there are.
    pub heights: usize,
    /// How many distances.
    pub distances: usize,
    /// The radius of the printed area.
    pub bed_radius_mm: f64,
    /// The largest noise of the kinds of readings, in usual ones: 1 is expected.
    pub lack_of_fit: f64,
    /// What the configuration calls the reading that fits worst.
    pub fits_worst: Option<String>,
    /// What the configuration is off; `None` if its robot does not reach the bed.
    pub before: Option<Off>,
    /// What the lines to paste are off.
    pub after: Option<Off>,
    /// How uneven the bed itself is, if the touches show it.
    pub uneven: Option<Uneven>,
    /// How the effector tilts, if the probe is beside the nozzle.
    pub effector: Option<Effector>,
    /// The touches that agree with the configuration and are too few to improve it: their number, and how well, mm rms.
    #[serde(skip)]
    pub agreeing: Option<(usize, f64)>,
    /// The probabilities that the lines to paste print better.
    pub better_probability: Option<Better>,
    /// Where the bed was touched.
    #[serde(skip)]
    pub touches: Vec<[f64; 2]>,
    /// What the controller is told, and what it would be told.
    pub changes: Vec<Change>,
    /// The expected error before any measurement, one σ, rms over the printed area.
    pub sigma_before_mm: Option<f64>,
    /// What to measure next; `None` if it cannot be told.
    pub next: Option<Next>,
    /// What the lines lose, because the controller holds fewer parameters.
    pub loss: Loss,
    /// What not calibrating loses.
    pub not_calibrated: Loss,
    /// The lines to paste; `None` if the printer prints as well with its configuration.
    pub lines: Option<String>,
}

/// What the configuration states, and the lines.
fn changes(held: Written, pasted: &Written) -> Vec<Change> {
    let pairs = held.entries.into_iter().zip(&pasted.entries);
    let changes = pairs.map(|(before, after)| Change {
        name: before.name,
        before: before.value,
        after: after.value,
        unit: before.unit,
        is_endstop: before.is_endstop,
    });
    changes.collect()
}

/// The lines to paste, after a warning of a crash, and what was configured before any of them.
fn lines(
    imported: &Imported,
    target: &Target,
    changes: &[Change],
    (written, controller): (&Written, Option<&Robot<f64>>),
) -> String {
    let Target { comment, paste, .. } = target;
    let comments = crash(changes).into_iter().chain([paste.clone()]);
    let comments = comments.map(|own| format!("{comment} {own}\n"));
    let kept = controller.and_then(|own| imported.kept(own));
    let kept = kept.map(|own| format!("{comment} {own}\n"));
    comments
        .chain(kept)
        .chain([written.lines.clone()])
        .collect()
}

/// Where a printer prints, the first layer most of all, with the bed as it was found and the end stops as they are: for its own
/// lines, and for those of another controller.
pub fn as_printed(
    imported: &Imported,
    calibrated: &RobotFile,
    solution: &Solution,
) -> (Wanted, Settings) {
    let radius = radius_of(imported);
    let times = |at: &Vector3<f64>| {
        let on_the_bed = at.z.abs() < ON_THE_BED;
        if on_the_bed { FIRST_LAYER } else { 1.0 }
    };
    let poses = poses(calibrated, radius);
    let positions = || poses.iter().map(|pose| pose.position);
    let wanted = Wanted {
        place: Place::Within(radius),
        fitted: positions().map(|at| (at, times(&at))).collect(),
        evaluated: positions().collect(),
    };
    // The first plane is the bed.
    let plane = solution.places.planes.first();
    let level = plane.map_or_else(Frame::default, |own| {
        Frame::on_plane(&own.normal, own.offset)
    });
    // Where nothing was touched, no height changes.
    let [heights, _] = imported.counts();
    let origin = imported.towers.inverse(&Vector3::zeros()).ok();
    let kept = origin.map(|low| [0, 1, 2].map(|arm| imported.home[arm] - low[arm]));
    let settings = Settings {
        home: Some(imported.home),
        level: Some(level),
        height: Some(0.0),
        bed_radius: imported.bed_radius,
        endstops: kept.filter(|_| heights == 0),
        steps: imported.steps,
        ..Settings::default()
    };
    (wanted, settings)
}

impl Printer {
    /// Of a configuration and what was found from its readings.
    ///
    /// # Errors
    /// The controller cannot hold the calibrated robot.
    pub fn of(
        imported: &Imported,
        calibrated: &RobotFile,
        solution: &Solution,
    ) -> Result<Self, ExportError> {
        let robot = &imported.robot;
        let radius = radius_of(imported);
        let poses = poses(calibrated, radius);
        let (wanted, settings) = as_printed(imported, calibrated, solution);
        let level = settings.level.unwrap_or_default();
        let configured = robot.with_robot(&imported.configured);
        let [heights, distances] = imported.counts();
        let target = target(imported.target(), robot.robot.drive())?;
        let export = Case {
            robot: calibrated,
            nominal: Some(&configured),
            wanted: &wanted,
            settings,
        }
        .export(target)?;
        let towers = robot.with_robot(&imported.towers);
        let held = held(&towers, &settings, imported.home, target)?;
        let changes = changes(held, &export.written);
        let uncertain = Uncertain::of(calibrated, &poses).ok_or(ExportError::TooFewPositions(0))?;
        let covariance = solution.expected_of_robot();
        let sigmas = [&uncertain.height, &uncertain.across].map(|own| own.dot(&covariance).sqrt());
        let judged = [heights > 0, distances > 0];
        let look = |(controller, frame): (&Robot<f64>, Frame)| {
            Off::of(calibrated, (controller, frame), radius, sigmas)
        };
        let before = look((&configured.robot, level));
        let pasted = export.controller.clone().zip(export.frame);
        let pasted = pasted.map(|(controller, mut frame)| {
            if !imported.below_the_arms() {
                return (controller, frame);
            }
            let bed = std::mem::take(&mut frame.shift.z);
            (lowered(&controller, bed), frame)
        });
        let after = pasted.and_then(|(controller, frame)| look((&controller, frame)));
        let both = before.as_ref().zip(after.as_ref());
        // Klipper computes a configuration from the heights that it saves with it.
        let other = imported.readings.name != robot.name && imported.is_pasted();
        let better_probability =
            both.map(|(before, after)| uncertain.better(before, after, &covariance, other));
        let better_probability = better_probability.map(|own| own.of(judged));
        let agreeing = too_few(imported).filter(|_| distances == 0);
        let better_probability = better_probability.filter(|_| agreeing.is_none());
        let better = agreeing.is_none()
            && both.is_none_or(|(before, after)| after.is_better_than(before, judged))
            && better_probability.is_none_or(Better::is_likely);
        let [before, after] = [before, after].map(|own| own.map(|own| own.of_readings(judged)));
        let uneven = Uneven::of(robot, solution, radius);
        let effector = Effector::of(imported, calibrated, solution, radius);
        let spacing = robot.parallelograms.map_or(0.0, |own| own.spacing);
        Ok(Self {
            firmware: imported.firmware,
            kinematics: imported.kinematics(),
            rods_measured: imported.rods_measured(),
            notes: [
                imported.notes.clone(),
                uneven.iter().map(Uneven::note).collect(),
                effector
                    .as_ref()
                    .map_or_else(Vec::new, |own| own.notes(spacing)),
                notes(imported, solution),
            ]
            .concat(),
            uneven,
            effector,
            agreeing,
            heights,
            distances,
            bed_radius_mm: radius,
            lack_of_fit: lack_of_fit(solution),
            fits_worst: worst_reading(imported, solution),
            before,
            after,
            better_probability,
            touches: touches(imported, &calibrated.robot),
            lines: better.then(|| {
                let written = (&export.written, export.controller.as_ref());
                lines(imported, target, &changes, written)
            }),
            changes,
            sigma_before_mm: prior(robot).map(|own| uncertain.relative.dot(&own).sqrt()),
            next: next(
                &as_measured(calibrated, solution, distances),
                &imported.readings,
                (radius, &uncertain.relative),
                uncertain.relative.dot(&covariance).sqrt(),
            ),
            loss: export.loss,
            not_calibrated: export.not_calibrated,
        })
    }
}

/// The calibrated robot, of which more readings are as good as those that there are.
fn as_measured(calibrated: &RobotFile, solution: &Solution, distances: usize) -> RobotFile {
    let mut robot = calibrated.clone();
    robot.instruments.height_noise = Some(solution.levels.height);
    robot.instruments.distance_noise = Some(solution.levels.distance);
    if distances == 0 {
        robot.instruments.distance_scale = Some(SHRINKAGE);
    }
    robot
}
