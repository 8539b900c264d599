//! What came of the samples because they came one after the other.

use crate::stream::{GateReport, StreamReport};
use crate::words::count;
use crate::{CalibrationReport, Streaming};
use delta_cal::Validation;
use maud::{Markup, html};
use serde::Serialize;
use std::fmt::Write;

/// Rows that the report for people names; the others have all.
const NAMED: usize = 20;

/// The part of the JSON report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonStream {
    /// What the gate made of the samples; `null` without one.
    pub gate: Option<JsonGate>,
    /// Of each arm, what the held-out samples say; `null` if none are.
    pub held_out: Option<[JsonHeldOut; 3]>,
    /// The memory in samples; `null` without forgetting.
    pub forget: Option<u32>,
}

/// What the gate made of the samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonGate {
    /// Samples taken in.
    pub taken: u64,
    /// Of them, those that could not be tested.
    pub untested: u64,
    /// The longest run of rejected ones.
    pub longest_run: u64,
    /// The line of the first that could be tested.
    pub tested_from_line: Option<u64>,
    /// Samples rejected by each arm.
    pub rejected_by_arm: [u64; 3],
    /// The rejected ones, in the file's order.
    pub rejected: Vec<JsonRejected>,
}

/// A sample that was not taken in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonRejected {
    /// Its line in the samples file.
    pub line: u64,
    /// The arm whose sample is furthest off, 1 to 3.
    pub arm: usize,
    /// The innovation over its σ.
    pub sigma: f64,
    /// The innovation along the forearm.
    pub distance_mm: f64,
}

/// What the held-out samples say of an arm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonHeldOut {
    /// How many.
    pub samples: f64,
    /// rms of their residuals: in σ of the stated noise, otherwise in millimetres.
    pub residual_rms: f64,
    /// The same of a calibration that is right.
    pub expected_rms: f64,
    /// χ² of the prediction, and up to where it passes.
    pub chi_square: f64,
    /// Up to where it passes.
    pub limit: f64,
}

pub(super) fn json(report: &CalibrationReport) -> Option<JsonStream> {
    let stream = report.stream.as_ref()?;
    Some(JsonStream {
        gate: stream.gate.as_ref().map(|gate| JsonGate {
            taken: gate.counts.taken,
            untested: gate.counts.untested,
            longest_run: gate.counts.longest_run,
            tested_from_line: gate.tested_from,
            rejected_by_arm: gate.counts.rejected_by_arm,
            rejected: gate
                .rejected
                .iter()
                .map(|sample| JsonRejected {
                    line: sample.line,
                    arm: sample.innovation.arm.index() + 1,
                    sigma: sample.innovation.normalized,
                    distance_mm: sample.innovation.distance,
                })
                .collect(),
        }),
        held_out: stream.held_out.map(|arms| {
            arms.map(|arm| JsonHeldOut {
                samples: arm.samples,
                residual_rms: arm.residual_rms,
                expected_rms: arm.expected_rms,
                chi_square: arm.statistic,
                limit: arm.limit,
            })
        }),
        forget: stream.asked.forget.map(std::num::NonZeroU32::get),
    })
}

/// The options as they would be typed.
pub fn options(asked: Streaming) -> String {
    let mut text = String::new();
    if asked.gate {
        text.push_str(" --gate");
    }
    if let Some(every) = asked.held_out {
        let _ = write!(text, " --held-out {every}");
    }
    if let Some(memory) = asked.forget {
        let _ = write!(text, " --forget {memory}");
    }
    text
}

fn gate_title(gate: &GateReport) -> String {
    let counts = &gate.counts;
    let tested = gate.tested_from.map_or_else(
        || "no sample could be tested: state [noise] and [tolerance]".to_owned(),
        |line| format!("tested from line {line} on"),
    );
    format!(
        "Gate: {} accepted, {} rejected, {tested}",
        count(
            usize::try_from(counts.taken).unwrap_or(usize::MAX),
            "sample"
        ),
        counts.rejected
    )
}

fn memory(stream: &StreamReport) -> Option<String> {
    let samples = stream.asked.forget?.get();
    Some(format!(
        "Forgetting: a memory of {}; the result lags as many rows behind a slow change",
        count(usize::try_from(samples).unwrap_or(usize::MAX), "sample")
    ))
}

fn unit(report: &CalibrationReport) -> &'static str {
    if report.before.noise.is_some() {
        "sigma"
    } else {
        "mm"
    }
}

fn held_out_title(report: &CalibrationReport, arms: &[Validation<f64>; 3]) -> String {
    let [arm, ..] = arms;
    format!(
        "Held out: {:.0} samples that were not fitted, rms of their residuals in {}",
        arm.samples,
        unit(report)
    )
}

/// Headings and lines for a terminal.
pub(super) fn text(report: &CalibrationReport) -> Vec<(String, String)> {
    let mut parts = Vec::new();
    let Some(stream) = &report.stream else {
        return parts;
    };
    if let Some(gate) = &stream.gate {
        let mut lines = String::new();
        if !gate.rejected.is_empty() {
            let _ = writeln!(
                lines,
                "  {:>8}{:>6}{:>12}{:>18}",
                "line", "arm", "sigma", "mm"
            );
        }
        for sample in gate.rejected.iter().take(NAMED) {
            let _ = writeln!(
                lines,
                "  {:>8}{:>6}{:>12.1}{:>18.3}",
                sample.line,
                sample.innovation.arm.index() + 1,
                sample.innovation.normalized,
                sample.innovation.distance
            );
        }
        if gate.rejected.len() > NAMED {
            let others = gate.rejected.len() - NAMED;
            let _ = writeln!(lines, "  and {others} more; --json and --report name all");
        }
        lines.push('\n');
        parts.push((gate_title(gate), lines));
    }
    if let Some(arms) = &stream.held_out {
        let mut lines = format!("  {:<8}{:>12}{:>12}\n", "", "found", "expected");
        for (number, arm) in (1..).zip(arms) {
            let _ = writeln!(
                lines,
                "  arm {number:<4}{:>12.4}{:>12.4}",
                arm.residual_rms, arm.expected_rms
            );
        }
        lines
            .push_str("  They agree with the fit, so the result is computed from all samples.\n\n");
        parts.push((held_out_title(report, arms), lines));
    }
    if let Some(title) = memory(stream) {
        parts.push((title, "\n".to_owned()));
    }
    parts
}

/// The same for a page.
pub(super) fn markup(report: &CalibrationReport) -> Markup {
    let stream = report.stream.as_ref();
    html! {
        @if let Some(gate) = stream.and_then(|stream| stream.gate.as_ref()) {
            section {
                h2 { "Gate" }
                p { (gate_title(gate)) "." }
                @if !gate.rejected.is_empty() {
                    table {
                        thead { tr { th { "line" } th { "arm" } th { "innovation, σ" } th { "mm along the forearm" } } }
                        tbody {
                            @for sample in &gate.rejected {
                                tr {
                                    th scope="row" { (sample.line) }
                                    td { (sample.innovation.arm.index() + 1) }
                                    td { (format!("{:.1}", sample.innovation.normalized)) }
                                    td { (format!("{:.3}", sample.innovation.distance)) }
                                }
                            }
                        }
                    }
                    p.note {
                        "These samples disagree with what the samples before them predict, and \
                         were left out. Measure them again, or find out what happened."
                    }
                }
            }
        }
        @if let Some(arms) = stream.and_then(|stream| stream.held_out.as_ref()) {
            section {
                h2 { "Held-out samples" }
                p { (held_out_title(report, arms)) ". They agree with the fit, so the result is \
                                                    computed from all samples." }
                table {
                    thead { tr { th { "arm" } th { "found" } th { "expected" } } }
                    tbody {
                        @for (number, arm) in (1..).zip(arms) {
                            tr {
                                th scope="row" { (number) }
                                td { (format!("{:.4}", arm.residual_rms)) }
                                td { (format!("{:.4}", arm.expected_rms)) }
                            }
                        }
                    }
                }
            }
        }
        @if let Some(memory) = stream.and_then(memory) {
            section {
                h2 { "Forgetting" }
                p { (memory) "." }
            }
        }
    }
}
