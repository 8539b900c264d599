//! The certificate: one HTML file that prints on one page.

use super::words::{CONTENTS, doubts, figures, headline, measured, reason, region, title};
use crate::accuracy::sampled::{MANY_ON_A_PAGE, shown};
use crate::render::page::{self, figure};
use crate::render::plot::{Axis, Colour, Figure, PlotError, Shape};
use crate::report::document::Document;
use crate::text::words::capitalised;
use crate::validation::{Validation, Verdict};
use maud::{Markup, html};

/// The whole certificate.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub fn render(found: &Validation, document: &Document) -> Result<String, PlotError> {
    let whose = document
        .record
        .name
        .as_deref()
        .unwrap_or(found.robot.name.as_str());
    let heading = format!("Validation of {whose}");
    let class = match found.verdict {
        Verdict::Pass => "verdict good",
        Verdict::Undecided | Verdict::Fail => "verdict doubtful",
    };
    let body = html! {
        article.certificate {
            h1 { (heading) }
            p { (headline(found)) "." }
            div class=(class) {
                div.value { (title(found.verdict)) }
                p { (capitalised(&reason(found))) }
            }
            (document.page())
            div.scroll { (figures(found)) }
            p { (measured(found)) " " (region(found)) }
            (deviations(found)?)
            @if let Some(doubts) = doubts(found) { (doubts) }
            p.note { (CONTENTS) }
            div.signature { span { "Date" } span { "Signature" } }
        }
    };
    Ok(page::render(&heading, &body))
}

/// Every row's deviation, over its line.
fn deviations(found: &Validation) -> Result<Markup, PlotError> {
    let rows = found.rows.len();
    let largest_of = |index: usize| found.rows[index].distance;
    let indices = shown(rows, MANY_ON_A_PAGE, largest_of).unwrap_or_else(|| (0..rows).collect());
    #[allow(clippy::cast_precision_loss)] // lines of a file
    let points: Vec<_> = indices
        .into_iter()
        .filter_map(|index| found.rows.get(index))
        .map(|row| (row.line as f64, row.distance))
        .collect();
    let (left, right) = crate::geometry::range::range(points.iter().map(|point| point.0));
    let margin = 0.03 * (right - left) + 0.5;
    let (left, right) = (left - margin, right + margin);
    let top = 1.1
        * points
            .iter()
            .map(|point| point.1)
            .fold(found.request.limit, f64::max);
    let level = |at: f64| Shape::Dashed(vec![(left, at), (right, at)]);
    let drawn = Figure::new(
        Axis::linear("line in the samples file", left, right),
        Axis::linear("deviation, mm", 0.0, top),
    )
    .sized(800, 210)
    .with(
        "measured deviation of a row",
        Colour::Blue,
        Shape::Points(points),
    )
    .with(
        "limit of the rms",
        Colour::Vermilion,
        level(found.request.limit),
    )
    .with(
        "rms of the deviations",
        Colour::Ink,
        level(found.deviation.rms),
    );
    figure(
        &drawn,
        "Distance between the measured position and the one computed from the joint angles, with the instrument's \
         noise in it.",
    )
}
