//! The summary of a campaign for people at a terminal: one line a case. What is the same in all
//! cases stands above.

use crate::campaign::{CaseColumns, CaseSummary, HELD_OUT_POSES};
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::terminal;
use crate::text::numbers::{percent, share, small};

/// Cases of which the reasons are named.
const REFUSALS_SHOWN: usize = 12;

/// A heading, and what a case has under it.
type Setting = (&'static str, fn(&CaseColumns) -> String);

/// The axes of a campaign.
const SETTINGS: [Setting; 10] = [
    ("case", |case| case.case.to_string()),
    ("measure", |case| case.measure.to_owned()),
    ("poses", |case| case.poses.to_string()),
    START_ERROR,
    NOISE,
    ("method", |case| case.method.to_owned()),
    ("solver", |case| case.solver.to_owned()),
    ("weights", |case| yes_no(case.weights).to_owned()),
    ("prior", |case| yes_no(case.prior).to_owned()),
    ("planned", |case| yes_no(case.planned).to_owned()),
];

pub(crate) const START_ERROR: Setting = ("start error\nmm/°", |case| {
    let own = format!("{}/{}", case.start_error_mm, case.start_error_deg);
    match case.start_error_radius_mm {
        radius if radius > 0.0 => format!("{own} and {radius} mm"),
        _ => own,
    }
});

pub(crate) const NOISE: Setting = ("noise\nmm/°", |case| match case.noise_joint_mm {
    travel if travel > 0.0 => format!("{}/{travel} mm", case.noise_position_mm),
    _ => format!("{}/{}", case.noise_position_mm, case.noise_joint_deg),
});

pub(crate) const fn yes_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// A value that there may be none of.
pub(crate) fn or_dash(value: Option<f64>, format: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), format)
}

/// One line a case, what all have in common, and what the columns mean.
pub fn render(summaries: &[CaseSummary]) -> String {
    let (common, different): (Vec<_>, Vec<_>) = SETTINGS.into_iter().partition(|(_, of)| {
        let cells: Vec<_> = summaries.iter().map(|summary| of(&summary.case)).collect();
        cells.windows(2).all(|pair| pair[0] == pair[1])
    });
    let mut parts = Vec::new();
    if let Some(first) = summaries.first() {
        let robots = format!("{} robots a case", first.robots);
        let common = common
            .into_iter()
            .filter_map(|setting| description(setting, &first.case));
        let words: Vec<_> = [robots].into_iter().chain(common).collect();
        parts.push(Section::new("").text(words.join(", ")));
    }
    parts.push(Section::new("").table(table(&different, summaries)));
    let relative = if is_relative(summaries) {
        "of relative positions (after the best rigid motion), "
    } else {
        ""
    };
    let notes = Section::new("").note(format!(
        "ok: share of the robots that were calibrated and not refused; the other figures are of \
         these. gain: (4.1), with the values below which 5 % and 95 % of the robots lie. error: {relative}rms \
         over {HELD_OUT_POSES} poses that were not measured, of the median robot. bound: parameter \
         error over the Cramér–Rao bound, rms; it is below 1 where a prior assumes more spread than \
         the robots have. summary.csv holds everything else."
    ));
    parts.push(refusals(summaries).into_iter().fold(notes, Section::text));
    terminal::text(parts)
}

/// Whether something was measured that does not say where the robot stands.
fn is_relative(summaries: &[CaseSummary]) -> bool {
    summaries
        .iter()
        .any(|summary| summary.case.measure != "xyz")
}

fn table(settings: &[Setting], summaries: &[CaseSummary]) -> Table {
    let relative = is_relative(summaries);
    let gain = |quantile: usize| {
        move |summary: &&CaseSummary| {
            let gain = summary.gain_percent;
            or_dash(gain.map(|gain| gain.values()[quantile]), percent)
        }
    };
    let rows = Table::of(summaries);
    let rows = settings.iter().fold(rows, |rows, (heading, of)| {
        rows.column(*heading, |summary| of(&summary.case))
    });
    rows.column("ok\n%", |summary| share(summary.converged_percent()))
        .column("5 %", gain(0))
        .column("gain, %\nmedian", gain(2))
        .column("95 %", gain(4))
        .column("error, mm\nbefore", |summary| {
            let error = if relative {
                summary.relative_before_mm
            } else {
                summary.error_before_mm
            };
            or_dash(error.map(|error| error.median), small)
        })
        .column("after", |summary| {
            let error = if relative {
                summary.relative_after_mm
            } else {
                summary.error_after_mm
            };
            or_dash(error.map(|error| error.median), small)
        })
        .column("bound", |summary| {
            or_dash(summary.bound_ratio_rms, |ratio| format!("{ratio:.2}"))
        })
        .column("µs each", |summary| {
            or_dash(summary.seconds_per_calibration, |seconds| {
                format!("{:.0}", seconds * 1e6)
            })
        })
        .table()
}

/// A setting that is the same everywhere, in words.
fn description((heading, of): Setting, case: &CaseColumns) -> Option<String> {
    let cell = of(case);
    Some(match (heading, cell.as_str()) {
        ("case", _) | ("planned", "no") | ("measure", "xyz") => return None,
        ("measure", _) => format!("measured with {cell}"),
        ("poses", _) => format!("{cell} poses"),
        ("method" | "solver", _) => cell,
        ("weights" | "prior", "yes") => format!("with {heading}"),
        ("weights" | "prior", _) => format!("without {heading}"),
        ("planned", _) => "poses planned".to_owned(),
        (heading, _) => {
            let (name, unit) = heading.split_once('\n').unwrap_or((heading, ""));
            format!("{name} {cell} {unit}")
        }
    })
}

/// Why robots were refused, a line a case.
fn refusals(summaries: &[CaseSummary]) -> Vec<String> {
    let refused = summaries
        .iter()
        .filter(|summary| !summary.refusals.is_empty());
    let mut lines: Vec<_> = refused
        .map(|summary| {
            let reasons = summary.refusals.iter();
            let reasons =
                reasons.map(|(reason, count)| format!("{} {count}", reason.replace('_', " ")));
            let reasons: Vec<_> = reasons.collect();
            format!(
                "Refused in case {}: {}",
                summary.case.case,
                reasons.join(", ")
            )
        })
        .collect();
    if let Some(others) = lines
        .len()
        .checked_sub(REFUSALS_SHOWN)
        .filter(|others| *others > 0)
    {
        lines.truncate(REFUSALS_SHOWN);
        lines.push(format!("and in {others} other cases: see summary.csv"));
    }
    lines
}
