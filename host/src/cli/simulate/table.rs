//! The summary for people: one line a case. What is the same in all cases stands above.

use anstyle::Style;
use delta_cal_host::campaign::{CaseColumns, CaseSummary, HELD_OUT_POSES};
use std::fmt::Write;

const HEADING: Style = Style::new().bold();

/// Where a line of words ends.
const WIDTH: usize = 99;
/// Cases of which the reasons are named.
const REFUSALS_SHOWN: usize = 12;

/// A column: two lines of heading, and a cell a case.
struct Column {
    heading: [&'static str; 2],
    cells: Vec<String>,
}

/// One line a case, what all have in common, and what the columns mean.
pub(super) fn render(summaries: &[CaseSummary]) -> String {
    let (common, mut columns): (Vec<_>, Vec<_>) = settings(summaries)
        .into_iter()
        .partition(|column| all_equal(&column.cells));
    columns.extend(results(summaries));
    let mut text = String::new();
    let common = common.iter().filter_map(description);
    if let Some(first) = summaries.first() {
        let mut line = format!("{} robots a case", first.robots);
        for words in common {
            line.push_str(", ");
            if line.chars().count() + words.chars().count() > WIDTH {
                let _ = writeln!(text, "{}", line.trim_end());
                line.clear();
            }
            line.push_str(&words);
        }
        let _ = writeln!(text, "{line}\n");
    }
    for line in 0..2 {
        let headings: Vec<_> = columns
            .iter()
            .map(|column| (column.heading[line], width(column)))
            .collect();
        let _ = writeln!(text, "{HEADING}{}{HEADING:#}", joined(&headings));
    }
    for index in 0..summaries.len() {
        let cells: Vec<_> = columns
            .iter()
            .map(|column| (column.cells[index].as_str(), width(column)))
            .collect();
        let _ = writeln!(text, "{}", joined(&cells));
    }
    let _ = writeln!(
        text,
        "\nok: share of the robots that were calibrated and not refused; the other figures are of \
         these.\ngain: (4.1), with the values below which 5 % and 95 % of the robots lie. error: \
         rms over {HELD_OUT_POSES}\nposes that were not measured, of the median robot. bound: \
         parameter error over the Cramér–Rao\nbound, rms; it is below 1 where a prior assumes more \
         spread than the robots have.\nsummary.csv holds everything else."
    );
    refusals(&mut text, summaries);
    text
}

/// The axes of the campaign.
fn settings(summaries: &[CaseSummary]) -> Vec<Column> {
    let of = |heading, cell: &dyn Fn(&CaseColumns) -> String| Column {
        heading,
        cells: summaries
            .iter()
            .map(|summary| cell(&summary.case))
            .collect(),
    };
    let yes_no = |yes: bool| if yes { "yes" } else { "no" }.to_owned();
    vec![
        of(["", "case"], &|case| case.case.to_string()),
        of(["", "poses"], &|case| case.poses.to_string()),
        of(["start error", "mm/°"], &|case| {
            format!("{}/{}", case.start_error_mm, case.start_error_deg)
        }),
        of(["noise", "mm/°"], &|case| {
            format!("{}/{}", case.noise_position_mm, case.noise_joint_deg)
        }),
        of(["", "method"], &|case| case.method.to_owned()),
        of(["", "solver"], &|case| case.solver.to_owned()),
        of(["", "weights"], &|case| yes_no(case.weights)),
        of(["", "prior"], &|case| yes_no(case.prior)),
        of(["", "planned"], &|case| yes_no(case.planned)),
    ]
}

/// What came of them.
fn results(summaries: &[CaseSummary]) -> Vec<Column> {
    let of = |heading, cell: &dyn Fn(&CaseSummary) -> Option<f64>, format: fn(f64) -> String| {
        let cell = |summary| cell(summary).map_or_else(|| "–".to_owned(), format);
        Column {
            heading,
            cells: summaries.iter().map(cell).collect(),
        }
    };
    let gain =
        |index: usize| move |summary: &CaseSummary| Some(summary.gain_percent?.values()[index]);
    vec![
        of(["ok", "%"], &|s| Some(s.converged_percent()), share),
        of(["", "5 %"], &gain(0), percent),
        of(["gain, %", "median"], &gain(2), percent),
        of(["", "95 %"], &gain(4), percent),
        of(
            ["error, mm", "before"],
            &|s| Some(s.error_before_mm?.median),
            short,
        ),
        of(["", "after"], &|s| Some(s.error_after_mm?.median), short),
        of(["", "bound"], &|s| s.bound_ratio_rms, |ratio| {
            format!("{ratio:.2}")
        }),
        of(
            ["", "µs each"],
            &|s| Some(s.seconds_per_calibration? * 1e6),
            |us| format!("{us:.0}"),
        ),
    ]
}

fn all_equal(cells: &[String]) -> bool {
    cells.windows(2).all(|pair| pair[0] == pair[1])
}

/// A column that is the same everywhere, in words.
fn description(column: &Column) -> Option<String> {
    let cell = column.cells.first()?;
    Some(match (column.heading, cell.as_str()) {
        ([_, "case"], _) | ([_, "planned"], "no") => return None,
        ([_, "poses"], _) => format!("{cell} poses"),
        ([_, "method" | "solver"], _) => cell.clone(),
        ([_, name @ ("weights" | "prior")], "yes") => format!("with {name}"),
        ([_, name @ ("weights" | "prior")], _) => format!("without {name}"),
        ([_, "planned"], _) => "poses planned".to_owned(),
        ([name, unit], _) => format!("{name} {cell} {unit}"),
    })
}

fn width(column: &Column) -> usize {
    let texts = column.cells.iter().map(String::as_str);
    texts
        .chain(column.heading)
        .map(|text| text.chars().count())
        .max()
        .unwrap_or(0)
}

fn joined(cells: &[(&str, usize)]) -> String {
    let padded: Vec<_> = cells
        .iter()
        .map(|(cell, width)| format!("{cell:>width$}"))
        .collect();
    padded.join("  ").trim_end().to_owned()
}

fn refusals(text: &mut String, summaries: &[CaseSummary]) {
    let refused: Vec<_> = summaries
        .iter()
        .filter(|summary| !summary.refusals.is_empty())
        .collect();
    for summary in refused.iter().take(REFUSALS_SHOWN) {
        let reasons: Vec<_> = summary
            .refusals
            .iter()
            .map(|(reason, count)| format!("{} {count}", reason.replace('_', " ")))
            .collect();
        let reasons = reasons.join(", ");
        let _ = writeln!(text, "Refused in case {}: {reasons}", summary.case.case);
    }
    if refused.len() > REFUSALS_SHOWN {
        let others = refused.len() - REFUSALS_SHOWN;
        let _ = writeln!(text, "and in {others} other cases: see summary.csv");
    }
}

/// Two decimals near 100, where they matter.
fn percent(value: f64) -> String {
    if (99.0..100.0).contains(&value) {
        format!("{value:.2}")
    } else {
        format!("{:.0}", value.round() + 0.0) // −0 is 0
    }
}

/// The same, never rounded up to all of them.
fn share(value: f64) -> String {
    percent(if value < 100.0 {
        value.min(99.99)
    } else {
        value
    })
}

/// Three significant digits.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 {
        format!("{value:.1e}")
    } else if value.abs() < 10.0 {
        format!("{value:.4}")
    } else {
        format!("{value:.1}")
    }
}
