//! What a robust fit made of the samples: which rows are suspected, and how far off they are.

use crate::accuracy::position_error::SampleErrors;
use crate::calibration::report::CalibrationReport;
use crate::render::section::Section;
use crate::render::table::Table;
use crate::text::numbers::small_or;
use crate::text::words::count;
use delta_cal::robust::Loss;
use maud::html;

/// Rows that a terminal names; the other reports have all.
const NAMED: usize = 20;

/// As it is written: `squared`, `huber` or `tukey`.
pub(super) const fn loss_name(loss: Option<Loss>) -> &'static str {
    match loss {
        None => "squared",
        Some(Loss::Huber) => "huber",
        Some(Loss::Tukey) => "tukey",
    }
}

/// The suspected rows and those that count little: the suspected first, the farthest off first.
pub(super) fn rows(report: &CalibrationReport) -> Vec<&SampleErrors> {
    let samples = report.sample_errors.iter();
    let mut rows: Vec<_> = samples
        .filter(|sample| sample.weight.suspected || sample.counts_little())
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
    let suspected = report.suspected_count();
    let samples = report.sample_errors.iter();
    let little = match &report.sampled {
        Some(all) => all.counting_little,
        None => samples.filter(|sample| sample.counts_little()).count(),
    };
    let of = if suspected == 0 {
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

/// Nothing of a plain fit.
pub(super) fn section(report: &CalibrationReport) -> Option<Section> {
    report.options.loss?;
    let loss = loss_name(report.options.loss);
    let section =
        Section::new("Suspected samples").lead(format!("loss {loss}, {}", counts(report)));
    let rows = rows(report);
    if rows.is_empty() {
        return Some(section);
    }
    let where_else = report.others_in();
    let table = Table::of(rows)
        .column("line", |sample| sample.line)
        .column("residual, sigma", |sample| {
            let sigmas = sample.after_in_sigmas;
            sigmas.map_or_else(|| "unknown".to_owned(), |sigmas| format!("{sigmas:.1}"))
        })
        .column("mm", |sample| small_or("out of reach", sample.after))
        .column("weight", |sample| format!("{:.2}", sample.weight.weight))
        .table()
        .at_most(NAMED, where_else);
    Some(section.table(table).in_page(html! {
        p.note {
            "No robot fits both the samples of weight 0 and the other samples. All \
                         errors and figures of the calibrated robot leave them out. Measure them \
                         again, or find out what happened."
        }
    }))
}
