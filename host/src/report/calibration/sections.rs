//! What the terminal and the page have in common.

use super::comparison::{Comparison, comparisons, of_an_arm};
use super::names::{start_name, termination_name};
use crate::accuracy::position_error::PositionError;
use crate::calibration::report::CalibrationReport;
use crate::calibration::thresholds::MOSTLY;
use crate::files::robot_file::RobotFile;
use crate::fit::options::Frame;
use crate::render::section::{Part, Section};
use crate::render::table::Table;
use crate::text::numbers::{small, small_or};
use crate::text::words::count;
use delta_cal::calibration::ArmOutcome;

/// Every parameter before and after.
pub(super) fn parameters(report: &CalibrationReport) -> Section {
    parameters_of(comparisons(report), report.before.tolerance.is_some())
}

/// The same of a calibration with or without a tolerance.
pub(super) fn parameters_of(comparisons: Vec<Comparison>, prior: bool) -> Section {
    let each = of_an_arm(&comparisons);
    let table = Table::of(comparisons)
        .column("arm", |c| c.arm + 1)
        .column("parameter", |c| c.parameter.symbol())
        .column("before", |c| format!("{:.*}", c.decimals(), c.before))
        .column("after", |c| format!("{:.*}", c.decimals(), c.after))
        .column("change", |c| format!("{:+.*}", c.decimals(), c.change))
        .column("sigma", |c| small_or("unknown", c.sigma))
        .column("unit", |c| c.unit)
        .column_if(prior, "by tolerance", |c| {
            format!("{:.0} %", 100.0 * c.prior_share)
        })
        .standing_out(|c| prior && c.prior_share > MOSTLY)
        .table()
        .in_groups_of(each);
    let section = Section::new("Parameters").table(table);
    if prior {
        section.note(
            "By tolerance: at 0 % only the samples decided the parameter, at 100 % only \
                      the tolerance did.",
        )
    } else {
        section
    }
}

/// The position error before and after.
pub(super) fn positions(report: &CalibrationReport) -> Table {
    let title = match (report.forgets(), report.suspected_count()) {
        (true, _) => "Position error over the samples as far as they are remembered, mm",
        (false, 0) => "Position error over the samples, mm",
        (false, _) => "Position error over the others, mm",
    };
    let before = match report.options.frame {
        Frame::Base => "before",
        Frame::Sensor => "before, in the best sensor frame",
    };
    let length = |error: &PositionError, value| {
        let known = error.max_at_line.map(|_| value);
        small_or("none", known)
    };
    Table::of([
        (before, &report.error_before),
        ("after", &report.error_after),
    ])
    .column(title, |(name, _)| *name)
    .column("rms", |(_, error)| length(error, error.rms))
    .column("max", |(_, error)| length(error, error.max))
    .column("in line", |(_, error)| {
        error
            .max_at_line
            .map_or_else(String::new, |line| line.to_string())
    })
    .column("out of reach", |(_, error)| error.unreachable)
    .table()
}

/// How each arm was solved.
pub(super) fn solution(report: &CalibrationReport) -> Section {
    type Cell = fn(&ArmOutcome<f64>) -> String;
    let table = Table::new(["", "arm 1", "arm 2", "arm 3"]);
    let condition: (_, Cell) = ("condition", |arm| format!("{:.1}", arm.condition));
    let stated: &[(_, Cell)] = &[("residual / stated noise", |arm| {
        format!("{:.3}", arm.residual_rms)
    })];
    let estimated: &[(_, Cell)] = &[
        ("residual, mm", |arm| small(arm.residual_rms)),
        ("estimated noise, mm", |arm| {
            small_or("unknown", arm.estimated_noise)
        }),
    ];
    let last: [(_, Cell); 4] = [
        ("degrees of freedom", |arm| {
            format!("{:.1}", arm.degrees_of_freedom)
        }),
        ("iterations", |arm| arm.iterations.to_string()),
        ("stopped because", |arm| {
            termination_name(arm.termination).to_owned()
        }),
        ("started from", |arm| start_name(arm.start).to_owned()),
    ];
    let (residual, right) = match report.before.noise {
        Some(_) => (stated, "; a residual of about 1 stated noise is right"),
        None => (estimated, ""),
    };
    let rows = [condition]
        .into_iter()
        .chain(residual.iter().copied())
        .chain(last);
    let table = rows.fold(table, |table, (name, cell)| {
        table.row(name, report.outcome.fit.arms.iter().map(cell))
    });
    Section::new("How well the samples determine each arm")
        .table(table)
        .note(format!("A condition below 100 is good{right}."))
}

/// From the robot's frame to the sensor's, if that was asked for.
pub(super) fn sensor_frame(report: &CalibrationReport) -> Option<Section> {
    sensor_frame_of(&report.after)
}

/// The same of a calibrated robot file.
pub(super) fn sensor_frame_of(after: &RobotFile) -> Option<Section> {
    let frame = after.sensor_frame.as_ref()?;
    let rows = frame.rotation.row_iter().zip(frame.translation.iter());
    let rotation = |column: usize| move |row: &[f64; 4]| format!("{:.8}", row[column]);
    let table = Table::of(rows.map(|(row, shift)| [row[0], row[1], row[2], *shift]))
        .column("rotation", rotation(0))
        .column("", rotation(1))
        .column("", rotation(2))
        .column("translation, mm", |row| format!("{:.4}", row[3]))
        .table();
    Some(
        Section::new("Sensor frame")
            .lead("X_sensor = rotation · X_robot + translation")
            .table(table)
            .text(
                "The measured positions are in the frame of [sensor_frame]; the poses of this report \
                 and those that delta-cal forward computes are in the robot's frame, which the \
                 program chose so that the robot file fits the measured points best. A cyclic \
                 exchange of the joint columns cannot be detected, because a Delta has threefold \
                 symmetry.",
            ),
    )
}

/// Whether anything is doubtful.
pub(super) fn doubts(report: &CalibrationReport) -> Part {
    doubts_of(&report.warnings)
}

/// The same of these warnings.
pub(super) fn doubts_of(warnings: &[String]) -> Part {
    if warnings.is_empty() {
        return Part::Good("Calibrated. Nothing doubtful was found.".to_owned());
    }
    let doubts = count(warnings.len(), "doubt");
    Part::Doubts(format!("Calibrated, with {doubts}:"), warnings.to_vec())
}
