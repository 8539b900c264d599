//! What each instrument would bring, for people and for programs.

use super::json::SCHEMA_VERSION;
use super::measurements::{over, precision};
use crate::planning::measurements::{COUNTS, Comparison, Precision};
use crate::planning::poses::Region;
use crate::render::named_figure::{NamedFigure, shown};
use crate::render::page;
use crate::render::plot::{Axis, Colour, Figure, PlotError, Shape};
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::{json, terminal};
use crate::text::numbers::{rounded, small, small_or};
use maud::html;
use serde_json::{Value, json};

/// Of the instruments; those beyond are dashed.
const COLOURS: [Colour; 6] = [
    Colour::Blue,
    Colour::Vermilion,
    Colour::Green,
    Colour::Purple,
    Colour::Orange,
    Colour::SkyBlue,
];

/// For people at a terminal.
pub fn text(robot: &str, region: Option<&Region>, comparisons: &[Comparison]) -> String {
    let first = Section::new("").text(headline(robot));
    terminal::text([first, table(region, comparisons)])
}

fn headline(robot: &str) -> String {
    format!("What planned measurements with each instrument would bring for {robot}")
}

fn table(region: Option<&Region>, comparisons: &[Comparison]) -> Section {
    let mut headings = vec![
        "Expected error, mm".to_owned(),
        "noise, mm".to_owned(),
        "before".to_owned(),
    ];
    headings.extend(COUNTS.map(|count| count.to_string()));
    let mut table = Table::new(headings);
    for comparison in comparisons {
        let instrument = &comparison.instrument;
        let before = small_or("unknown", comparison.before.map(|before| before.intrinsic));
        let mut cells = vec![rounded(instrument.sigma), before];
        cells.extend(comparison.after.iter().map(|after| match after {
            Ok(after) => small(after.intrinsic),
            Err(_) => "–".to_owned(),
        }));
        table = table.row(format!("{}: {}", instrument.name, instrument.title), cells);
    }
    let section = Section::new("").table(table).note(format!(
        "Before, and after 12 to 60 planned measurements: error of relative positions, rms {}, one sigma. Relative: \
         after the best rigid motion, which is what counts where positions are taught.",
        over(region)
    ));
    let mut reasons: Vec<_> = comparisons
        .iter()
        .flat_map(|own| own.after.iter().filter_map(|after| after.as_ref().err()))
        .map(ToString::to_string)
        .collect();
    reasons.sort();
    reasons.dedup();
    reasons.into_iter().fold(section, |section, reason| {
        section.note(format!("–: {reason}."))
    })
}

/// For programs: lengths in millimetres; `null` where a figure is unknown.
pub fn json(robot: &str, region: Option<&Region>, comparisons: &[Comparison]) -> Value {
    let instruments = comparisons.iter().map(|comparison| {
        let after = COUNTS.iter().zip(&comparison.after).map(|(count, after)| {
            json!({
                "measurements": count,
                "expected": after.as_ref().ok().map(precision),
                // Why there is no plan.
                "obstacle": after.as_ref().err().map(ToString::to_string),
            })
        });
        json!({
            "name": comparison.instrument.name,
            "title": comparison.instrument.title,
            "measure": comparison.instrument.kind.name(),
            "sigma_mm": comparison.instrument.sigma,
            "before": comparison.before.as_ref().map(precision),
            "after": after.collect::<Vec<_>>(),
        })
    });
    let contents = json!({
        "robot_file": robot,
        // The positions that the errors are of; `null` for the workspace.
        "within": region.map(ToString::to_string),
        "instruments": instruments.collect::<Vec<_>>(),
    });
    json::report(SCHEMA_VERSION, contents)
}

/// One HTML file that opens from disk.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn html(
    robot: &str,
    region: Option<&Region>,
    comparisons: &[Comparison],
) -> Result<String, PlotError> {
    let figures: Vec<_> = figure(region, comparisons).into_iter().collect();
    let title = headline(robot);
    let body = html! {
        h1 { (title) }
        (shown(&figures, &["instruments"])?)
        (table(region, comparisons))
    };
    Ok(page::render(&title, &body))
}

/// The expected error over the number of measurements; `None` where no instrument has a plan.
fn figure(region: Option<&Region>, comparisons: &[Comparison]) -> Option<NamedFigure> {
    let points = |comparison: &Comparison| -> Vec<(f64, f64)> {
        let own = COUNTS.iter().zip(&comparison.after);
        own.filter_map(|(count, after)| {
            #[allow(clippy::cast_precision_loss)] // 60 at most
            let count = *count as f64;
            Some((count, after.as_ref().ok()?.intrinsic))
        })
        .collect()
    };
    let before = |own: &Comparison| own.before.map(|before: Precision| before.intrinsic);
    let all = comparisons.iter().flat_map(|own| {
        let after = points(own).into_iter().map(|(_, error)| error);
        after.chain(before(own))
    });
    let (least, most) = all.fold((f64::INFINITY, 0.0_f64), |(least, most), error| {
        (least.min(error), most.max(error))
    });
    if !(most > 0.0 && least.is_finite()) {
        return None;
    }
    let first = COUNTS.first().copied().unwrap_or_default();
    let last = COUNTS.last().copied().unwrap_or_default();
    #[allow(clippy::cast_precision_loss)] // 60 at most
    let (first, last) = (first as f64, last as f64);
    let mut figure = Figure::new(
        Axis::linear("planned measurements", first - 4.0, last + 4.0),
        Axis::logarithmic(
            "expected error of relative positions, mm",
            0.7 * least,
            1.4 * most,
        ),
    )
    .sized(720, 440);
    if let Some(before) = comparisons.iter().find_map(before) {
        let line = vec![(first - 4.0, before), (last + 4.0, before)];
        figure = figure.with("before", Colour::Grey, Shape::Dashed(line));
    }
    for (index, comparison) in comparisons.iter().enumerate() {
        let (own, colour) = (points(comparison), COLOURS[index % COLOURS.len()]);
        let line = if index < COLOURS.len() {
            Shape::Line(own.clone())
        } else {
            Shape::Dashed(own.clone())
        };
        figure = figure.with(comparison.instrument.name, colour, line).with(
            "",
            colour,
            Shape::Points(own),
        );
    }
    let caption = format!(
        "Rms {}, one sigma, after the best rigid motion, by the number of planned measurements; each instrument with \
         its typical noise.",
        over(region)
    );
    Some(NamedFigure::new("instruments", figure, &caption))
}
