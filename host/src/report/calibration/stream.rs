//! What came of the samples because they came one after the other.

use crate::calibration::report::CalibrationReport;
use crate::fit::options::Streaming;
use crate::fit::stream::GateReport;
use crate::render::section::Section;
use crate::render::table::Table;
use crate::text::words::count;
use delta_cal::stream::Validation;
use maud::html;
use serde_json::{Value, json};
use std::fmt::Write;
use std::num::NonZeroU32;

/// Rows that a terminal names; the other reports have all.
const NAMED: usize = 20;

/// The part of the report for programs; `null` without `--gate`, `--held-out` or `--forget`.
pub(super) fn json(report: &CalibrationReport) -> Value {
    let Some(stream) = &report.stream else {
        return Value::Null;
    };
    let gate = stream.gate.as_ref().map(|gate| {
        let rejected = gate.rejected.iter().map(|sample| {
            json!({
                "line": sample.line,
                // The arm whose sample is furthest off, 1 to 3.
                "arm": sample.innovation.arm.index() + 1,
                // The innovation over its σ.
                "sigma": sample.innovation.normalized,
                // The innovation along the forearm.
                "distance_mm": sample.innovation.distance,
            })
        });
        json!({
            "taken": gate.counts.taken,
            // Of them, those that could not be tested.
            "untested": gate.counts.untested,
            // Of rejected samples.
            "longest_run": gate.counts.longest_run,
            "tested_from_line": gate.tested_from,
            "rejected_by_arm": gate.counts.rejected_by_arm,
            "rejected": rejected.collect::<Vec<_>>(),
        })
    });
    let held_out = stream.held_out.map(|arms| {
        arms.map(|arm| {
            json!({
                "samples": arm.samples,
                // In σ of the stated noise, otherwise in millimetres.
                "residual_rms": arm.residual_rms,
                // The same of a calibration that is right.
                "expected_rms": arm.expected_rms,
                // χ² of the prediction, and up to where it passes.
                "chi_square": arm.statistic,
                "limit": arm.limit,
            })
        })
    });
    json!({
        "gate": gate,
        // Of each arm.
        "held_out": held_out,
        // The memory in samples.
        "forget": stream.asked.forget,
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

fn samples(number: u64) -> String {
    count(usize::try_from(number).unwrap_or(usize::MAX), "sample")
}

/// A section for each option.
pub(super) fn sections(report: &CalibrationReport) -> Vec<Section> {
    let Some(stream) = &report.stream else {
        return Vec::new();
    };
    let unit = match report.before.noise {
        Some(_) => "sigma",
        None => "mm",
    };
    let gate = stream.gate.as_ref();
    let gate = gate.map(|own| self::gate(own, report.others_in()));
    let held_out = stream.held_out.as_ref().map(|arms| held_out(arms, unit));
    let forgetting = stream.asked.forget.map(forgetting);
    [gate, held_out, forgetting].into_iter().flatten().collect()
}

fn gate(gate: &GateReport, where_else: &'static str) -> Section {
    let counts = &gate.counts;
    let tested = gate.tested_from.map_or_else(
        || "no sample could be tested: state [noise] and [tolerance]".to_owned(),
        |line| format!("tested from line {line} on"),
    );
    let (taken, rejected) = (samples(counts.taken), counts.rejected);
    let section =
        Section::new("Gate").lead(format!("{taken} accepted, {rejected} rejected, {tested}"));
    if gate.rejected.is_empty() {
        return section;
    }
    let table = Table::of(&gate.rejected)
        .column("line", |sample| sample.line)
        .column("arm", |sample| sample.innovation.arm.index() + 1)
        .column("sigma", |sample| {
            format!("{:.1}", sample.innovation.normalized)
        })
        .column("mm along the forearm", |sample| {
            format!("{:.3}", sample.innovation.distance)
        })
        .table()
        .at_most(NAMED, where_else);
    section.table(table).in_page(html! {
        p.note {
            "These samples disagree with what the samples before them predict, and \
                         were left out. Measure them again, or find out what happened."
        }
    })
}

fn held_out(arms: &[Validation<f64>; 3], unit: &str) -> Section {
    let [arm, ..] = arms;
    let lead = format!(
        "{:.0} samples that were not fitted, rms of their residuals in {unit}",
        arm.samples
    );
    let table = Table::of((1..).zip(arms))
        .column("arm", |(number, _): &(u32, _)| *number)
        .column("found", |(_, arm)| format!("{:.4}", arm.residual_rms))
        .column("expected", |(_, arm)| format!("{:.4}", arm.expected_rms))
        .table();
    Section::new("Held out")
        .lead(lead)
        .table(table)
        .text("They agree with the fit, so the result is computed from all samples.")
}

fn forgetting(memory: NonZeroU32) -> Section {
    Section::new("Forgetting").lead(format!(
        "a memory of {}; the result lags as many rows behind a slow change",
        samples(memory.get().into())
    ))
}
