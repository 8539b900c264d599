//! What a robust fit made of the samples: which rows are suspected, and how far off they are.

use super::table::small;
use crate::words::count;
use crate::{CalibrationReport, SampleErrors};
use delta_cal::Loss;
use maud::{Markup, html};
use std::fmt::Write;

/// Rows that the report for people names; the JSON report has all.
const NAMED: usize = 20;
/// A weight below it is noteworthy.
const LITTLE: f64 = 0.5;

/// As it is written: `squared`, `huber` or `tukey`.
pub(super) const fn loss_name(loss: Option<Loss>) -> &'static str {
    match loss {
        None => "squared",
        Some(Loss::Huber) => "huber",
        Some(Loss::Tukey) => "tukey",
    }
}

/// Whether it counts less than half of what the others do, but counts.
fn counts_little(sample: &SampleErrors) -> bool {
    !sample.weight.suspected && sample.weight.weight < LITTLE
}

/// The suspected rows and those that count little: the suspected first, the farthest off first.
pub(super) fn rows(report: &CalibrationReport) -> Vec<&SampleErrors> {
    let samples = report.sample_errors.iter();
    let mut rows: Vec<_> = samples
        .filter(|sample| sample.weight.suspected || counts_little(sample))
        .collect();
    let size = |sample: &SampleErrors| sample.after_in_sigmas.unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| {
        let suspected = b.weight.suspected.cmp(&a.weight.suspected);
        suspected.then(size(b).total_cmp(&size(a)))
    });
    rows
}

/// How many samples count, count little and do not count.
fn counts(report: &CalibrationReport) -> String {
    let suspected = report.suspected().count();
    let samples = report.sample_errors.iter();
    let (no_row, little) = (suspected == 0, samples.filter(|s| counts_little(s)).count());
    let of = if no_row {
        "no row is suspected".to_owned()
    } else {
        format!(
            "{suspected} of {} suspected and left out",
            count(report.samples, "sample")
        )
    };
    match little {
        0 => of,
        little => format!("{of}, {little} with a weight below one half"),
    }
}

fn residual(sample: &SampleErrors) -> String {
    let in_sigmas = |sigmas: f64| format!("{sigmas:.1}");
    sample
        .after_in_sigmas
        .map_or_else(|| "unknown".into(), in_sigmas)
}

fn distance(sample: &SampleErrors) -> String {
    sample.after.map_or_else(|| "out of reach".into(), small)
}

/// Lines for a terminal; nothing of a plain fit.
pub(super) fn text(report: &CalibrationReport) -> Option<(String, String)> {
    report.options.loss?;
    let title = format!(
        "Samples, loss {}: {}",
        loss_name(report.options.loss),
        counts(report)
    );
    let rows = rows(report);
    let mut lines = String::new();
    if !rows.is_empty() {
        let _ = writeln!(
            lines,
            "  {:>8}{:>18}{:>14}{:>10}",
            "line", "residual, sigma", "mm", "weight"
        );
    }
    for sample in rows.iter().take(NAMED) {
        let _ = writeln!(
            lines,
            "  {:>8}{:>18}{:>14}{:>10.2}",
            sample.line,
            residual(sample),
            distance(sample),
            sample.weight.weight
        );
    }
    if rows.len() > NAMED {
        let others = rows.len() - NAMED;
        let _ = writeln!(lines, "  and {others} more; --json and --report name all");
    }
    lines.push('\n');
    Some((title, lines))
}

/// The same for a page.
pub(super) fn markup(report: &CalibrationReport) -> Markup {
    let rows = rows(report);
    html! {
        @if report.options.loss.is_some() {
            section {
                h2 { "Suspected samples" }
                p { "Loss " (loss_name(report.options.loss)) ": " (counts(report)) "." }
                @if !rows.is_empty() {
                    table {
                        thead { tr { th { "line" } th { "residual, σ" } th { "mm" } th { "weight" } } }
                        tbody {
                            @for sample in rows {
                                tr {
                                    th scope="row" { (sample.line) }
                                    td { (residual(sample)) }
                                    td { (distance(sample)) }
                                    td { (format!("{:.2}", sample.weight.weight)) }
                                }
                            }
                        }
                    }
                    p.note {
                        "No robot fits both the samples of weight 0 and the other samples. All \
                         errors and figures of the calibrated robot leave them out. Measure them \
                         again, or find out what happened."
                    }
                }
            }
        }
    }
}
