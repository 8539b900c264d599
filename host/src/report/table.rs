//! The report for people: plain lines of at most 100 columns, with colour as ANSI codes that the
//! printer strips where they are not wanted.

use super::{comparisons, solver_name, start_name, termination_name};
use crate::words::count;
use crate::{CalibrationReport, Frame, PositionError};
use anstyle::{AnsiColor, Style};
use delta_cal::ArmOutcome;
use std::fmt::Write;

const HEADING: Style = Style::new().bold();
const GOOD: Style = AnsiColor::Green.on_default();
const DOUBTFUL: Style = AnsiColor::Yellow.on_default().bold();
const WIDTH: usize = 100;

/// The whole report.
pub fn render(report: &CalibrationReport) -> String {
    let mut text = String::new();
    summary(&mut text, report);
    parameters(&mut text, report);
    suspected(&mut text, report);
    positions(&mut text, report);
    solution(&mut text, report);
    frame(&mut text, report);
    doubts(&mut text, report);
    if report.before.noise.is_none() {
        if let Some(test) = &report.noise_test {
            let _ = writeln!(
                text,
                "The residuals show a noise of {};\nthe sigmas are computed from it.",
                test.estimate()
            );
        }
        text.push_str(
            "Tip: state the [noise] in the robot file, to learn whether the residuals are credible.\n",
        );
    }
    text
}

pub(super) fn heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "{HEADING}{title}{HEADING:#}");
}

fn summary(text: &mut String, report: &CalibrationReport) {
    let _ = writeln!(
        text,
        "{} calibrated from {}",
        report.before.name, report.samples_file
    );
    let _ = writeln!(
        text,
        "{} in the {} frame; {} method, {}; {}{}\n",
        count(report.samples, "sample"),
        match report.options.frame {
            Frame::Base => "robot's",
            Frame::Sensor => "sensor's",
        },
        report.options.method.name().to_uppercase(),
        solver_name(report.options.solver),
        match (&report.before.tolerance, &report.before.noise) {
            (Some(_), Some(_)) => "tolerance and noise stated",
            (Some(_), None) => "tolerance stated, no noise",
            (None, Some(_)) => "noise stated, no tolerance",
            (None, None) => "no tolerance, no noise",
        },
        if report.options.no_guess {
            "; no guess"
        } else {
            ""
        },
    );
}

fn parameters(text: &mut String, report: &CalibrationReport) {
    let prior = report.before.tolerance.is_some();
    let last = if prior { "  by tolerance" } else { "" };
    heading(
        text,
        &format!(
            "{:<14}{:>14}{:>14}{:>12}{:>11}{last}",
            "Parameter", "before", "after", "change", "sigma"
        ),
    );
    let arms = report
        .before
        .robot
        .arms()
        .iter()
        .zip(&report.outcome.robot.arms);
    for ((before, outcome), arm) in arms.zip(1..) {
        for comparison in comparisons(before, outcome) {
            let _ = write!(
                text,
                "{arm} {:<6}{:<6}{:>14.4}{:>14.4}{:>+12.4}{:>11}",
                comparison.symbol,
                comparison.unit,
                comparison.before,
                comparison.after,
                comparison.change,
                comparison.sigma.map_or_else(|| "unknown".into(), small),
            );
            if prior {
                let _ = write!(text, "{:>12.0} %", 100.0 * comparison.prior_share);
            }
            text.push('\n');
        }
        text.push('\n');
    }
    if prior {
        text.push_str(
            "by tolerance: 0 % - only the samples decided the parameter, 100 % - only the \
             tolerance did\n\n",
        );
    }
}

/// Three digits of a number that may be tiny.
pub(super) fn small(value: f64) -> String {
    if value == 0.0 || value >= 1e-3 {
        format!("{value:.4}")
    } else {
        format!("{value:.1e}")
    }
}

fn suspected(text: &mut String, report: &CalibrationReport) {
    if let Some((title, lines)) = super::suspected::text(report) {
        heading(text, &title);
        text.push_str(&lines);
    }
    for (title, lines) in super::stream::text(report) {
        heading(text, &title);
        text.push_str(&lines);
    }
}

fn positions(text: &mut String, report: &CalibrationReport) {
    heading(
        text,
        &format!(
            "{:<36}{:>12}{:>12}",
            match report.suspected().count() {
                0 => "Position error over the samples, mm",
                _ => "Position error over the others, mm",
            },
            "rms",
            "max"
        ),
    );
    let mut line = |label: &str, error: &PositionError| {
        let _ = match error.max_at_line {
            Some(line) => writeln!(
                text,
                "  {label:<34}{:>12}{:>12}  in line {line}",
                small(error.rms),
                small(error.max)
            ),
            None => writeln!(text, "  {label:<34}{:>12}{:>12}", "none", "none"),
        };
    };
    line(
        match report.options.frame {
            Frame::Base => "before",
            Frame::Sensor => "before, in the best sensor frame",
        },
        &report.error_before,
    );
    line("after", &report.error_after);
    let _ = match &report.workspace {
        Some(comparison) => {
            let worst = report.uncertainty.as_ref().map_or_else(String::new, |map| {
                let at = map.sigma.max_at;
                format!(
                    "  at worst {} mm, at x {:.0}, y {:.0}, z {:.0} mm\n",
                    small(map.sigma.max),
                    at.x,
                    at.y,
                    at.z
                )
            });
            writeln!(
                text,
                "Expected position error of the calibrated robot: {} mm (one sigma, rms over the \
                 workspace)\n{worst}",
                small(comparison.sigma),
            )
        }
        None => writeln!(
            text,
            "Expected position error of the calibrated robot: unknown\n"
        ),
    };
}

fn solution(text: &mut String, report: &CalibrationReport) {
    let title = ["arm 1", "arm 2", "arm 3"];
    heading(
        text,
        &format!("{:<44}{}", "Solution", cells(title.map(str::to_owned))),
    );
    let stated = report.before.noise.is_some();
    let mut line = |label: &str, of: &dyn Fn(&ArmOutcome<f64>) -> String| {
        let [first, second, third] = &report.outcome.robot.arms;
        let _ = writeln!(
            text,
            "  {label:<42}{}",
            cells([first, second, third].map(of))
        );
    };
    line("condition (below 100 is good)", &|arm| {
        format!("{:.1}", arm.condition)
    });
    if stated {
        line("residual / stated noise (about 1 is right)", &|arm| {
            format!("{:.3}", arm.residual_rms)
        });
    } else {
        line("residual, mm", &|arm| small(arm.residual_rms));
        line("estimated noise, mm", &|arm| {
            arm.estimated_noise.map_or_else(|| "unknown".into(), small)
        });
    }
    line("iterations", &|arm| arm.iterations.to_string());
    line("stopped because", &|arm| {
        termination_name(arm.termination).to_owned()
    });
    line("started from", &|arm| start_name(arm.start).to_owned());
    text.push('\n');
}

fn cells(values: [String; 3]) -> String {
    values.map(|value| format!("{value:>17}")).concat()
}

fn frame(text: &mut String, report: &CalibrationReport) {
    let Some(frame) = &report.after.sensor_frame else {
        return;
    };
    heading(
        text,
        "Sensor frame: X_sensor = rotation * X_robot + translation (mm)",
    );
    for (row, shift) in frame.rotation.row_iter().zip(frame.translation.iter()) {
        let _ = writeln!(
            text,
            "  {:>12.8}{:>14.8}{:>14.8}{shift:>18.4}",
            row[0], row[1], row[2]
        );
    }
    text.push_str(
        "The measured positions are in the frame of [sensor_frame]. Those that delta-cal forward \
         computes are\nin the robot's frame, which the program chose so that the robot file fits \
         the measured points best.\nA cyclic exchange of the joint columns cannot be detected, \
         because a Delta has threefold symmetry.\n\n",
    );
}

fn doubts(text: &mut String, report: &CalibrationReport) {
    if report.warnings.is_empty() {
        let _ = writeln!(text, "{GOOD}Nothing doubtful was found.{GOOD:#}");
        return;
    }
    let _ = writeln!(text, "{DOUBTFUL}Doubtful{DOUBTFUL:#}");
    for warning in &report.warnings {
        wrap(text, warning);
    }
}

/// A bulleted paragraph of at most [`WIDTH`] columns.
fn wrap(text: &mut String, paragraph: &str) {
    text.push_str("  -");
    let mut column = 3;
    for word in paragraph.split_whitespace() {
        let length = word.chars().count();
        if column + 1 + length > WIDTH {
            text.push_str("\n   ");
            column = 3;
        }
        text.push(' ');
        text.push_str(word);
        column += 1 + length;
    }
    text.push('\n');
}
