//! A printer assessed.

use super::area::{Area, Off};
use super::error::AssessError;
use super::next::{Next, next};
use crate::calibration::judge::prior;
use crate::calibration::{CalibrateError, calibrate, read_samples};
use crate::export::case::Case;
use crate::export::choose::{CHOICES, Choice};
use crate::export::exported::Export;
use crate::export::linear::level::of_heights;
use crate::export::settings::Settings;
use crate::export::wanted::Wanted;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::samples_file::Readings;
use crate::fit::options::Options;
use crate::import::imported::Imported;
use crate::report::calibration::Report;
use delta_cal::robot::Drive;

/// The calibrated robot explains nothing if the residuals are more than so many times what noise and tolerance
/// allow.
const UNEXPLAINED: f64 = 3.0;
/// The printed area of a robot that states none, as a part of the upper arm's or tower's radius.
const USUAL_AREA: f64 = 0.7;

/// What is fitted on the bed counts so many times, for the first layer depends on it.
const FIRST_LAYER: usize = 5;
/// Lower than this above the bed a position is on it, mm.
const ON_THE_BED: f64 = 0.5;

/// What is known of a printer.
#[derive(Debug, Clone)]
pub struct Assessment {
    /// Its configuration.
    pub imported: Imported,
    /// What was measured.
    pub readings: Readings,
    /// The calibration.
    pub report: Report,
    /// Where it prints.
    pub area: Area,
    /// What its configuration is off; `None` if it does not reach its bed.
    pub before: Option<Off>,
    /// What the lines to paste are off.
    pub after: Option<Off>,
    /// The expected error before any measurement, one σ, rms over the printed area, mm.
    pub sigma_before: Option<f64>,
    /// What to measure next; `None` if it cannot be told.
    pub next: Option<Next>,
    /// The lines to paste.
    pub export: Export,
}

impl Assessment {
    /// Of an imported configuration with measurements.
    ///
    /// # Errors
    /// The measurements calibrate no robot within the tolerance.
    pub fn of(imported: Imported) -> Result<Self, AssessError> {
        let samples = samples(&imported)?;
        let report = calibrate(&imported.robot, &samples, &Options::default())
            .map_err(|error| named(error, &imported))?;
        if lack_of_fit(&report) > UNEXPLAINED {
            return Err(unexplained(&imported, &report));
        }
        let robot = &report.before;
        let radius = imported.bed_radius.unwrap_or_else(|| {
            let arms = robot.robot.arms().iter();
            USUAL_AREA
                * arms
                    .map(|arm| arm.d().xy().norm())
                    .fold(f64::INFINITY, f64::min)
        });
        let area = Area::of(&report.after, radius);
        let level = of_heights(&report.after.robot, &samples);
        let choice = CHOICES.into_iter().find(|(name, _)| *name == "klipper");
        let (_, choice) = choice.unwrap_or(("klipper", Choice::CorrectionTable));
        let positions = area.positions();
        let bed = positions.iter().filter(|at| at.z.abs() < ON_THE_BED);
        let bed: Vec<_> = bed.copied().collect();
        let mut fitted = positions.clone();
        for _ in 1..FIRST_LAYER {
            fitted.extend_from_slice(&bed);
        }
        let wanted = Wanted {
            within: Some(radius),
            fitted,
            evaluated: positions,
        };
        let export = Case {
            robot: &report.after,
            nominal: Some(robot),
            wanted: &wanted,
            settings: Settings {
                home: Some(imported.home),
                level: Some(level.unwrap_or_default()),
                height: Some(0.0),
                ..Settings::default()
            },
        }
        .export(choice)?;
        let frame = level.unwrap_or_default().transform();
        let calibrated = &report.after.robot;
        let before = Off::of(calibrated, &robot.robot, &frame, radius);
        let fitted = export.frame.map(|frame| frame.transform());
        let after = export
            .controller
            .zip(fitted)
            .and_then(|(controller, frame)| Off::of(calibrated, &controller, &frame, radius));
        let sigma_before =
            prior(robot).and_then(|covariance| area.expected(&report.after, &covariance));
        let next = next(&report.after, &samples, &area);
        Ok(Self {
            imported,
            readings: samples,
            report,
            area,
            before,
            after,
            sigma_before,
            next,
            export,
        })
    }

    /// Whether carriages drive it.
    pub fn has_towers(&self) -> bool {
        self.report.before.robot.drive() == Drive::Linear
    }

    /// How many numbers were measured.
    pub fn readings(&self) -> usize {
        self.readings.readings()
    }
}

fn samples(imported: &Imported) -> Result<Readings, AssessError> {
    let text = imported.samples_text.as_deref().unwrap_or_default();
    let input = InputText::new(&imported.source, text);
    let readings = read_samples(&input, &imported.robot, &Options::default())?;
    if !readings.is_complete() {
        return Ok(readings);
    }
    let cause = "the configuration holds no saved measurements";
    Err(CalibrateError::from(InputError::new(&imported.source, cause)).into())
}

/// What the configuration calls the measurement in a line of the samples.
fn name_of(imported: &Imported, line: u64) -> Option<&str> {
    // Below the header.
    let index = usize::try_from(line).ok()?.checked_sub(2)?;
    imported.saved.names.get(index).map(String::as_str)
}

/// With the configuration's names in place of lines of the samples.
fn named(error: CalibrateError, imported: &Imported) -> AssessError {
    if !error.refused() {
        return error.into();
    }
    let refusal = error.to_string();
    let mut cause = refusal.clone();
    for line in (2..).take(imported.saved.names.len()) {
        if let Some(name) = name_of(imported, line) {
            cause = cause.replace(&format!("line {line} "), &format!("{name} "));
        }
    }
    let what = if cause == refusal { "" } else { " it" };
    for (arm, stepper) in (1..).zip(["stepper_a", "stepper_b", "stepper_c"]) {
        cause = cause.replace(&format!("arm {arm}"), stepper);
    }
    AssessError::Unexplained {
        cause,
        remedy: format!("measure{what} again, {REMEDY}"),
    }
}

const REMEDY: &str = "and see whether arm_length is the length between the joints of a rod (--rods), whether the belts' \
                      rotation_distance is right, and whether something was loose";

/// How many times what noise and tolerance allow the residuals are: 1 is expected.
pub(crate) fn lack_of_fit(report: &Report) -> f64 {
    let noise = &report.solution.noise;
    let squares: f64 = noise.iter().map(|own| own.squares).sum();
    let freedom = report.solution.degrees_of_freedom();
    (squares / freedom.max(1.0)).sqrt()
}

/// The place of the sample that is furthest off.
pub(crate) fn worst(report: &Report) -> Option<usize> {
    let size = |index: &usize| report.samples[*index].error_after_sigma;
    (0..report.samples.len()).max_by(|one, other| size(one).total_cmp(&size(other)))
}

fn unexplained(imported: &Imported, report: &Report) -> AssessError {
    let worst = worst(report).and_then(|index| imported.saved.names.get(index));
    let worst = worst.map_or_else(String::new, |name| format!("; {name} is furthest off"));
    AssessError::Unexplained {
        cause: format!(
            "{}: the measurements are {:.1} times further from every robot within the tolerance than they may be{worst}",
            imported.source,
            lack_of_fit(report)
        ),
        remedy: format!("measure again, {REMEDY}"),
    }
}

impl Assessment {
    /// What Klipper is told, what it would be told, and the unit: end stops, angles, rods, radius.
    pub fn changes(&self) -> Vec<(String, f64, f64, &'static str)> {
        let Some(printer) = &self.imported.printer else {
            return Vec::new();
        };
        let before = |name: &str| {
            let tower = ["stepper_a ", "stepper_b ", "stepper_c "]
                .iter()
                .position(|stepper| name.starts_with(stepper));
            match (tower, name.rsplit(' ').next()) {
                (Some(tower), Some("angle")) => Some(printer.azimuths[tower].rem_euclid(360.0)),
                (Some(tower), Some("arm_length")) => Some(printer.rods[tower]),
                (Some(tower), Some("position_endstop")) => Some(printer.endstops[tower]),
                (None, Some("delta_radius")) => Some(printer.radius),
                _ => None,
            }
        };
        let entries = self.export.written.entries.iter();
        entries
            .filter_map(|entry| {
                Some((
                    entry.name.clone(),
                    before(&entry.name)?,
                    entry.value,
                    entry.unit,
                ))
            })
            .collect()
    }
}
