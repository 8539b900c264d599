//! The long tables.

use crate::CalibrationReport;
use crate::report::comparisons;
use crate::report::table::small;
use crate::units::degrees;
use crate::warnings::{MOSTLY, stands_out};
use maud::{Markup, html};

/// So many samples or fewer are shown without being asked for.
const SHOWN: usize = 40;

pub(super) fn parameters(report: &CalibrationReport) -> Markup {
    let prior = report.before.tolerance.is_some();
    let arms = report
        .before
        .robot
        .arms()
        .iter()
        .zip(&report.outcome.robot.arms);
    html! {
        table.arms {
            thead { tr {
                th { "arm" } th { "parameter" } th { "before" } th { "after" } th { "change" }
                th { "σ" } th { "unit" }
                @if prior { th { "by tolerance" } }
            } }
            @for ((before, outcome), arm) in arms.zip(1..) {
                tbody {
                    @for c in comparisons(before, outcome) {
                        tr {
                            td { (arm) }
                            th scope="row" { (c.symbol) }
                            td { (format!("{:.4}", c.before)) }
                            td { (format!("{:.4}", c.after)) }
                            td { (format!("{:+.4}", c.change)) }
                            td { (c.sigma.map_or_else(|| "unknown".into(), small)) }
                            td { (c.unit) }
                            @if prior {
                                td.much[c.prior_share > MOSTLY] {
                                    (format!("{:.0} %", 100.0 * c.prior_share))
                                }
                            }
                        }
                    }
                }
            }
        }
        @if prior {
            p.note { "By tolerance: at 0 % only the samples decided the parameter, at 100 % only \
                      the tolerance did." }
        }
    }
}

pub(super) fn samples(report: &CalibrationReport) -> Markup {
    let in_sigmas = report.noise.is_some();
    let distance = |value: Option<f64>| value.map_or_else(|| "out of reach".to_owned(), small);
    html! {
        details open[report.samples <= SHOWN] {
            summary { "All " (report.samples) " samples" }
            table {
                thead { tr {
                    th { "line" }
                    th { "q1, °" } th { "q2, °" } th { "q3, °" }
                    th { "x, mm" } th { "y, mm" } th { "z, mm" }
                    th { "before, mm" } th { "after, mm" }
                    @if in_sigmas { th { "after, σ" } }
                    th {}
                } }
                tbody {
                    @for sample in &report.sample_errors {
                        @let outlying = stands_out(report, sample);
                        tr.outlying[outlying] {
                            th scope="row" { (sample.line) }
                            @for angle in sample.measured.joints {
                                td { (format!("{:.3}", degrees(angle))) }
                            }
                            @for coordinate in sample.measured.position.iter() {
                                td { (format!("{coordinate:.3}")) }
                            }
                            td { (distance(sample.before)) }
                            td { (distance(sample.after)) }
                            @if in_sigmas {
                                td { @if let Some(sigmas) = sample.after_in_sigmas {
                                    (format!("{sigmas:.2}"))
                                } }
                            }
                            td { @if sample.weight.suspected { "suspected" } @else if outlying { "stands out" } }
                        }
                    }
                }
            }
        }
    }
}
