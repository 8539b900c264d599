//! The summary of a campaign for the terminal: one line per case. Settings common to all cases are shown above.

use crate::campaign::paper::Comparison;
use crate::campaign::{Case, CaseSummary, Distribution, HELD_OUT_POSES};
use crate::render::{Section, Table, terminal};
use crate::text::{percent, small};
use serde::Serialize;
use std::fmt::Write;

/// Most cases whose refusals are listed.
const REFUSALS_SHOWN: usize = 12;

/// A heading, and the function that formats a case's setting.
type Setting = (&'static str, fn(&Case) -> String);

const SETTINGS: [Setting; 9] = [
    ("geometry", |case| case.geometry.chars().take(6).collect()),
    ("poses", |case| case.poses.to_string()),
    ("planned", |case| yes_no(case.planned)),
    ("start error\nmm/°", start_error),
    ("noise\nmm/°", noise),
    ("method", |case| word(case.method)),
    ("solver", |case| word(case.solver)),
    ("weights", |case| yes_no(case.weights)),
    ("prior", |case| yes_no(case.prior)),
];

fn start_error(case: &Case) -> String {
    let mut text = format!("{}/{}", case.start_error_mm, case.start_error_deg);
    if case.start_error_zero_deg > 0.0 {
        let _ = write!(text, ", zeros {}", case.start_error_zero_deg);
    }
    if case.start_error_radius_mm > 0.0 {
        let _ = write!(text, " and {} mm", case.start_error_radius_mm);
    }
    text
}

fn noise(case: &Case) -> String {
    match case.noise_joint_mm {
        travel if travel > 0.0 => format!("{}/{travel} mm", case.noise_position_mm),
        _ => format!("{}/{}", case.noise_position_mm, case.noise_joint_deg),
    }
}

fn yes_no(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_owned()
}

/// The word used in the campaign file.
fn word(value: impl Serialize) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

fn or_dash(value: Option<f64>, format: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), format)
}

/// A table with one line per case, the settings common to all, and an explanation of the columns.
pub fn render(summaries: &[CaseSummary]) -> String {
    let (common, different): (Vec<_>, Vec<_>) = SETTINGS.into_iter().partition(|(_, of)| {
        let cells: Vec<_> = summaries.iter().map(|summary| of(&summary.case)).collect();
        cells.windows(2).all(|pair| pair[0] == pair[1])
    });
    let word = |case: &Case, (heading, of): &Setting| {
        let heading = heading.replace("\nmm/°", " (mm/°)");
        format!("{heading} {}", of(case))
    };
    let mut parts = Vec::new();
    if let Some(CaseSummary { case, .. }) = summaries.first() {
        let words: Vec<_> = common.iter().map(|own| word(case, own)).collect();
        parts.push(Section::new("").text(format!("All cases: {}.", words.join(", "))));
    }
    parts.push(Section::new("").table(table(&different, summaries)));
    let notes = Section::new("").note(format!(
        "gain: of the parameters, (4.1); error: of positions, mm, rms over {HELD_OUT_POSES} poses that were not \
         measured. Gain and errors are over all robots; a refused robot keeps its error. \
         worse: accepted robots whose error grew. bound, stated: √(Σ error² / Σ σ²) of the accepted robots' \
         parameters with σ of the Cramér–Rao bound, and of their positions with the stated σ."
    ));
    parts.push(notes.texts(refusals(summaries)));
    terminal::text(parts)
}

fn table(settings: &[Setting], summaries: &[CaseSummary]) -> Table {
    let gain = |of: fn(&Distribution) -> f64| {
        move |summary: &&CaseSummary| or_dash(summary.gain_percent.as_ref().map(of), percent)
    };
    let error = |of: fn(&CaseSummary) -> Option<Distribution>| {
        move |summary: &&CaseSummary| or_dash(of(summary).map(|error| error.mean), small)
    };
    let ratio = |value: Option<f64>| or_dash(value, |ratio| format!("{ratio:.2}"));
    let rows = Table::of(summaries);
    let rows = settings.iter().fold(rows, |rows, (heading, of)| {
        rows.column(*heading, |summary| of(&summary.case))
    });
    rows.column("\nrobots", |summary| summary.robots)
        .column("\nrefused", |summary| summary.robots - summary.accepted)
        .column("\nworse", |summary| summary.worse)
        .column("gain\n5 %", gain(|own| own.p05))
        .column("gain, %\nmedian", gain(|own| own.median))
        .column("error\nbefore", error(|own| own.error_before_mm))
        .column("mean\nafter", error(|own| own.error_after_mm))
        .column("error/\nbound", |summary| {
            ratio(summary.ratios.error_to_bound)
        })
        .column("error/\nstated", |summary| {
            ratio(summary.ratios.error_to_stated)
        })
        .table()
}

/// Reasons for refusals, one line per case.
fn refusals(summaries: &[CaseSummary]) -> Vec<String> {
    let mut lines = Vec::new();
    for (row, summary) in (1..).zip(summaries) {
        let refused = summary.refused.iter();
        let refused =
            refused.map(|(reason, count)| format!("{} {count}", reason.replace('_', " ")));
        let none = match summary.no_robot {
            0 => None,
            count => Some(format!("not simulated (no usable robot) {count}")),
        };
        let reasons: Vec<_> = refused.chain(none).collect();
        if !reasons.is_empty() {
            lines.push(format!("Refused in row {row}: {}", reasons.join(", ")));
        }
    }
    let others = lines.len().saturating_sub(REFUSALS_SHOWN);
    if others > 0 {
        lines.truncate(REFUSALS_SHOWN);
        lines.push(format!("{others} more rows; --json lists all."));
    }
    lines
}

/// The paper's results beside this program's.
pub fn render_paper(comparisons: &[Comparison]) -> String {
    let gain =
        |of: fn(&Comparison) -> Option<f64>| move |row: &&Comparison| or_dash(of(row), percent);
    let table = Table::of(comparisons)
        .column("\ncase", |row| {
            let method = word(row.here.method);
            if row.paper.case.starts_with(&method) {
                row.paper.case.clone()
            } else {
                format!("{}, {method}", row.paper.case)
            }
        })
        .column("\nposes", |row| row.here.poses)
        .column("start\nmm/°", |row| start_error(&row.here))
        .column("noise\nmm/°", |row| noise(&row.here))
        .column("gain, %\npaper", |row| match row.paper.gain_percent {
            None => row.paper.remark.clone(),
            Some(gain) => percent(gain),
        })
        .column("here\nLM", gain(|row| row.levenberg_marquardt_percent))
        .column("\nGN", gain(|row| row.gauss_newton_percent))
        .column("\nprior", gain(|row| row.noise_and_tolerance_percent))
        .column("planned\nposes", gain(|row| row.planned_percent))
        .column("s\npaper", |row| {
            or_dash(row.paper.seconds, |seconds| format!("{seconds:.1}"))
        })
        .column("ms\nhere", |row| {
            or_dash(row.seconds, |seconds| format!("{:.2}", 1e3 * seconds))
        });
    let note = "gain: (4.1), median; a refused robot has gain 0. LM, GN: least squares by \
                Levenberg–Marquardt and Gauss–Newton, as in the paper. prior: with noise and tolerance known; planned poses: and with poses from plan.";
    terminal::text([Section::new("").table(table).note(note)])
}
