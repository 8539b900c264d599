//! A [`Validation`] for the terminal, as a one-page certificate, and as JSON.

use super::{Versioned, repeatability};
use crate::explain::Step;
use crate::files::{Document, Kind};
use crate::fit::Frame;
use crate::order::{MANY, shown};
use crate::render::page::{self, figure};
use crate::render::plot::{Axis, Colour, Figure, Shape};
use crate::render::{Part, Section, Table, terminal};
use crate::text::{capitalised, confidence, count, mean_rms_worst, significant};
use crate::validation::{Bounded, Comparison, Deviation, RmsError, Validation, Verdict};
use maud::{Markup, html};
use serde::Serialize;

/// Incremented whenever a field of the JSON is renamed, removed or changes its meaning.
pub const SCHEMA_VERSION: u32 = 3;
/// The same of a comparison's.
const COMPARISON_VERSION: u32 = 1;
/// The page's figure shows a selection if there are more rows than this.
const MANY_ON_A_PAGE: usize = 2_500;

/// The validation for the terminal.
pub fn text(found: &Validation) -> String {
    let figures = Section::new("").table(figures(found)).text(measured(found));
    let verdict = Part::verdict(found.verdict == Verdict::Pass, verdict(found));
    let mut sections = vec![Section::new("").text(headline(found)), figures];
    sections.extend(found.repeatability.as_ref().map(repeatability));
    sections.extend(warnings(found).map(|part| Section::new("").part(part)));
    sections.push(Section::new("").part(verdict));
    terminal::text(sections)
}

/// The certificate as one HTML file.
pub fn certificate(found: &Validation, document: &Document) -> String {
    let robot = document.record.name.as_deref();
    let heading = format!("Validation of {}", robot.unwrap_or(&found.robot_file));
    let class = match found.verdict {
        Verdict::Pass => "verdict good",
        _ => "verdict doubtful",
    };
    let body = html! {
        article.certificate {
            h1 { (heading) }
            p { (headline(found)) "." }
            div class=(class) {
                div.value { (title(found.verdict)) }
                p { (reason(found)) }
            }
            (document.page())
            div.scroll { (figures(found)) }
            p { (measured(found)) }
            @if !found.axes_mm.is_empty() { div.scroll { (axes(found)) } }
            p { (rule(found)) }
            (deviations(found))
            @if let Some(own) = &found.repeatability { (repeatability(own)) }
            @if !found.names.is_empty() { (named(found)) }
            @if let Some(warnings) = warnings(found) { (warnings) }
            p.note { (CONTENTS) }
            (page::signature())
        }
    };
    page::render(&heading, &body)
}

/// Explanation of the figures.
const CONTENTS: &str = "The rms position error is the root mean square distance between the robot's position and \
    that of its file, over the measured region. Its interval takes the poses as a random sample of the region \
    (chi-square distribution with effective degrees of freedom). The interval of the largest error holds at the \
    measured poses. Other temperatures, loads and speeds are not included; nor, without a guard band, are systematic errors of \
    the instrument, such as of its scale.";

/// "calibrated.toml against 24 rows of check.csv".
fn headline(found: &Validation) -> String {
    let rows = count(found.rows.len(), "row");
    let frame = match found.frame {
        Frame::Base => "",
        Frame::Sensor => ", in the sensor frame: the rigid motion that fits best is removed",
    };
    format!(
        "{} against {rows} of {}{frame}",
        found.robot_file, found.samples_file
    )
}

fn verdict(found: &Validation) -> String {
    format!("{}: {}", title(found.verdict), reason(found))
}

const fn title(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "Pass",
        Verdict::Undecided => "Undecided",
        Verdict::Fail => "Fail",
        Verdict::NotJudged => "Not judged",
    }
}

fn reason(found: &Validation) -> String {
    if let Some(Step { text, line, .. }) = &found.step {
        let rows = count(found.row_count, "row");
        return format!(
            "{text}. The figures are of the {rows} before. Validate the rows from there on by themselves (--rows {line}..), or measure again."
        );
    }
    let RmsError {
        limit_mm: limit,
        confidence_below_limit: below,
        poses_to_decide,
        ..
    } = found.rms_error;
    let (side, sure) = match found.verdict {
        Verdict::Pass => ("below", below),
        Verdict::Fail => ("above", 1.0 - below),
        Verdict::Undecided | Verdict::NotJudged => {
            let what_decides = match poses_to_decide {
                Some(poses) => {
                    let more = count(poses.saturating_sub(found.pose_count), "more pose");
                    format!(". Measure {more}, {poses} in all.")
                }
                None if found.noise_mm.is_none() => {
                    ". State the [noise] of the instrument, which is part of the figures."
                        .to_owned()
                }
                None => ", too close to the error for more poses to decide.".to_owned(),
            };
            if let Some(band) = found.guard_band_mm {
                let band = significant(band, 2);
                return format!(
                    "the interval reaches within the guard band of {band} mm of {limit} mm{what_decides}"
                );
            }
            return format!("{limit} mm lies within the interval{what_decides}");
        }
    };
    let (of, sure) = (error_of(found), confidence(sure));
    let guarded = found.guard_band_mm.map_or_else(String::new, |band| {
        format!(
            " by more than the guard band of {} mm",
            significant(band, 2)
        )
    });
    format!("rms {of} {side} the limit of {limit} mm{guarded} (confidence {sure}).")
}

fn rule(found: &Validation) -> String {
    match found.guard_band_mm {
        None => "Decision rule: simple acceptance. Pass if the 95 % interval of the rms error ends below the limit.".to_owned(),
        Some(band) => format!(
            "Decision rule: ISO 14253-1 with a guard band of {} mm, the expanded uncertainty (k = 2) of the instrument's scale, \
             target and datum. Pass if the 95 % interval of the rms error ends below the limit less the guard band, fail if it begins \
             above the limit plus the guard band.",
            significant(band, 2)
        ),
    }
}

/// Deviations along each axis.
fn axes(found: &Validation) -> Table {
    let rows = ["x", "y", "z", "distance"].into_iter().zip(&found.axes_mm);
    Table::of(rows)
        .column("deviation as measured, mm", |(axis, _)| *axis)
        .vector(["mean", "rms", "worst"], |(_, own)| mean_rms_worst(**own))
        .table()
}

/// The deviation of each named point.
fn named(found: &Validation) -> Table {
    let rows = found.rows.iter().take(MANY_ON_A_PAGE);
    Table::of(rows)
        .column("line", |own| own.line)
        .column("point", |own| {
            found.names.get(&own.line).cloned().unwrap_or_default()
        })
        .column("deviation, mm", |own| significant(own.deviation_mm, 3))
        .table()
}

/// The kind of error, within a sentence.
const fn error_of(found: &Validation) -> &'static str {
    match found.kind {
        Some(Kind::Position) => "position error",
        Some(Kind::Height) => "height error",
        Some(Kind::Distance) => "distance error",
        None => "error of the readings",
    }
}

fn figures(found: &Validation) -> Table {
    let cells = |figure: &Bounded, limit: String| {
        let estimate = format!("{:.*}", decimals(figure), figure.value);
        [estimate, interval(figure), limit]
    };
    let (rms, largest) = (&found.rms_error, &found.largest_error);
    let heading = format!("{}, mm", capitalised(error_of(found)));
    Table::new([&heading, "estimate", "95 % interval", "limit"])
        .row(
            "rms over the region",
            cells(&rms.error, rms.limit_mm.to_string()),
        )
        .row("largest at the poses", cells(largest, String::new()))
}

/// "0.019 to 0.052", "below 0.052".
fn interval(figure: &Bounded) -> String {
    let decimals = decimals(figure);
    match (figure.interval.0, figure.interval.1) {
        (0.0, None) => "unknown".to_owned(),
        (lower, None) => format!("above {lower:.decimals$}"),
        // A lower limit that would be printed as 0.
        (lower, Some(upper)) if lower < 0.5 * f64::powf(0.1, decimals as f64) => {
            format!("below {upper:.decimals$}")
        }
        (lower, Some(upper)) => format!("{lower:.decimals$} to {upper:.decimals$}"),
    }
}

/// Number of decimals that shows two digits of the interval's half width.
fn decimals(figure: &Bounded) -> usize {
    let half = figure
        .interval
        .1
        .map_or(figure.value, |upper| upper - figure.interval.0)
        / 2.0;
    let digits = (1.0 - half.log10().floor()).clamp(0.0, 9.0);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 9
    let digits = digits as usize;
    digits
}

/// What was measured, where, and the noise that was removed.
fn measured(found: &Validation) -> String {
    let deviation = &found.deviation_mm;
    let line = deviation.max_at_line;
    let line = line.map_or_else(String::new, |line| format!(" (line {line})"));
    let noise = match found.noise_mm {
        Some(noise) => format!(
            "The stated noise of {} mm rms is removed above",
            significant(noise, 2)
        ),
        None => "They include the instrument's noise".to_owned(),
    };
    let ranges = found.region_mm.map(|(low, high)| {
        format!("{:.0} to {:.0}", low.round() + 0.0, high.round() + 0.0).replace('-', "−")
    });
    let [x, y, z] = ranges;
    let rotations = found.rotation_deg.map_or_else(String::new, |[rms, most]| {
        let [rms, most] = [rms, most].map(|own| significant(own, 2));
        format!(" Rotations deviate by {rms}° rms, {most}° at most.")
    });
    format!(
        "Deviations as measured: {} mm rms, {} mm at most{line}. {noise}. {} within x {x}, y {y}, z {z} mm.{rotations}",
        significant(deviation.rms, 3),
        significant(deviation.max, 3),
        count(found.pose_count, "pose"),
    )
}

fn warnings(found: &Validation) -> Option<Part> {
    let number = count(found.warnings.len(), "warning");
    (!found.warnings.is_empty()).then(|| Part::Doubts(format!("{number}:"), found.warnings.clone()))
}

/// Plot of every row's deviation over its line.
fn deviations(found: &Validation) -> Markup {
    let points: Vec<_> = indices(found, MANY_ON_A_PAGE)
        .into_iter()
        .map(|index| {
            (
                found.rows[index].line as f64,
                found.rows[index].deviation_mm,
            )
        })
        .collect();
    let (left, right) = crate::geometry::range(points.iter().map(|point| point.0));
    let margin = 0.03 * (right - left) + 0.5;
    let (left, right) = (left - margin, right + margin);
    let limit = found.rms_error.limit_mm;
    let highest = points.iter().map(|point| point.1).fold(limit, f64::max);
    let level = |at: f64| Shape::Dashed([(left, at), (right, at)]);
    let drawn = Figure::new(
        Axis::linear("line in the samples file", left, right),
        Axis::linear("deviation, mm", 0.0, 1.1 * highest),
    )
    .sized(800, 210)
    .with("deviation of a row", Colour::Blue, Shape::Points(points))
    .with("limit of the rms", Colour::Vermilion, level(limit))
    .with(
        "rms of the deviations",
        Colour::Ink,
        level(found.deviation_mm.rms),
    );
    figure(
        &drawn,
        "Distance between measured and computed position, including the instrument's noise.",
    )
}

/// All rows, or if there are very many, the largest deviations and an even selection of the others.
fn indices(found: &Validation, most: usize) -> Vec<usize> {
    let rows = found.rows.len();
    shown(rows, most, |index| found.rows[index].deviation_mm)
}

/// The validation as JSON: lengths in millimetres, `null` if unknown.
pub fn json(found: &Validation, document: &Document) -> String {
    let some = indices(found, MANY);
    let contents = Contents {
        found,
        passed: found.verdict == Verdict::Pass,
        text: verdict(found),
        sampled: (some.len() < found.row_count).then_some(Sampled {
            shown: some.len(),
            of: found.row_count,
        }),
        rows: some.into_iter().map(|index| found.rows[index]).collect(),
        document,
    };
    super::json(&Versioned::new(SCHEMA_VERSION, contents))
}

#[derive(Serialize)]
struct Contents<'a> {
    #[serde(flatten)]
    found: &'a Validation,
    passed: bool,
    text: String,
    /// With more than 10,000 rows, the number in `rows`.
    sampled: Option<Sampled>,
    rows: Vec<Deviation>,
    document: &'a Document,
}

#[derive(Serialize)]
struct Sampled {
    shown: usize,
    of: usize,
}

/// How a robot has changed from one file to another, for the terminal.
pub fn changes(found: &Comparison) -> String {
    let mut sections = vec![Section::new("").text(format!(
        "{} compared with {} at {} over the workspace",
        found.to,
        found.from,
        count(found.poses, "pose")
    ))];
    let kinds = [
        ("absolute", "in the frame of the base", &found.absolute_mm),
        (
            "relative",
            "after the best rigid motion",
            &found.relative_mm,
        ),
    ];
    for (index, (kind, frame, moved)) in kinds.into_iter().enumerate() {
        let table = Table::of(["x", "y", "z", "distance"].into_iter().zip(moved))
            .column("change, mm", |(axis, _)| *axis)
            .vector(["mean", "rms", "worst"], |(_, own)| mean_rms_worst(**own));
        let said = match (found.sigma_mm, found.changed) {
            (Some(sigma), Some(changed)) => format!(
                "{} than 2 σ of it ({} mm, from the expected errors of both files).",
                if changed[index] { "More" } else { "Not more" },
                significant(2.0 * sigma[index], 2)
            ),
            _ => {
                "Its σ is unknown: only files that delta-cal calibrated state their expected error."
                    .to_owned()
            }
        };
        let title = format!("{}, {frame}", capitalised(kind));
        sections.push(Section::new(title).table(table).text(said));
    }
    terminal::text(sections)
}

/// The same for programs.
pub fn changes_json(found: &Comparison) -> String {
    super::json(&Versioned::new(COMPARISON_VERSION, found))
}
