//! Figures of the HTML page.

use super::{Report, SampleReport};
use crate::render::plot::{Axis, Colour, Figure, Shape};
use crate::text::in_unit;

const ARMS: [Colour; 3] = [Colour::Blue, Colour::Vermilion, Colour::Green];
/// Most suspected samples labelled with their line.
const LABELLED: usize = 12;
/// Smaller values are left off the logarithmic axis, which cannot show 0; far below any rounding.
const LEAST: f64 = 1e-15;

/// Change ± σ of every parameter in tolerances; `None` without a tolerance.
pub(super) fn parameters(report: &Report) -> Option<(Figure, &'static str)> {
    let tolerance = report.before.tolerance.as_ref()?;
    let robot = &report.before.robot;
    let arms = report.arms.iter().zip(robot.arms()).enumerate();
    let scaled = arms.flat_map(|(arm, (own, geometry))| {
        let parameters = robot.drive().parameters().iter().zip(&own.parameters);
        parameters.map(move |(parameter, own)| {
            let unit = in_unit(*parameter, tolerance.of_arm(geometry, *parameter));
            let name = format!("{} {}", arm + 1, own.symbol);
            (arm, name, own.change / unit, own.sigma / unit)
        })
    });
    let scaled: Vec<_> = scaled.collect();
    let sizes = scaled
        .iter()
        .map(|(.., change, sigma)| change.abs() + sigma);
    let extent = sizes.fold(1.25, f64::max) * 1.05;
    let names = scaled.iter().map(|(_, name, ..)| name.clone());
    let (top, bottom) = (-0.5, scaled.len() as f64 - 0.5);
    let one = vec![[(-1.0, top), (1.0, bottom)]];
    let mut figure = Figure::new(
        Axis::linear("change, tolerances", -extent, extent),
        Axis::named("", names.collect()),
    )
    .sized(800, 560)
    .with("one tolerance", Colour::Grey, Shape::Tiles(one, 0.2))
    .with("", Colour::Ink, Shape::Dashed([(0.0, top), (0.0, bottom)]));
    for (arm, colour) in ARMS.into_iter().enumerate() {
        let rows = (0..).map(f64::from).zip(&scaled);
        let own = || rows.clone().filter(|(_, own)| own.0 == arm);
        let bars =
            own().map(|(row, (.., change, sigma))| [(change - sigma, row), (change + sigma, row)]);
        let dots = own().map(|(row, (.., change, _))| (*change, row));
        figure = figure
            .with("", colour, Shape::Segments(bars.collect()))
            .with(
                format!("arm {}", arm + 1),
                colour,
                Shape::Points(dots.collect()),
            );
    }
    Some((
        figure,
        "Change of each parameter in tolerances, with a bar of one σ to both sides. Shaded: one tolerance.",
    ))
}

/// The powers of ten that enclose the positive values.
fn decades(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let logarithms = values.filter(|value| *value > LEAST).map(f64::log10);
    let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), own| {
        (low.min(own), high.max(own))
    });
    let (low, high) = ((low - 0.05).floor(), (high + 0.05).ceil());
    (low < high && low.is_finite() && high.is_finite()).then(|| (10f64.powf(low), 10f64.powf(high)))
}

type Value = fn(&SampleReport) -> Option<f64>;

/// A value over the line number, for each sample that has one.
fn over_lines<'a>(
    samples: impl Iterator<Item = &'a SampleReport>,
    value: Value,
) -> Vec<(f64, f64)> {
    samples
        .filter_map(|sample| Some((sample.line as f64, value(sample)?)))
        .collect()
}

/// Errors of all samples before and after, with rings about the suspected ones, some of which have their line as a label;
/// `None` if there is nothing to show.
pub(super) fn residuals(report: &Report) -> Option<Figure> {
    let samples = || report.samples.iter();
    let all = samples().flat_map(|sample| [sample.error_before_mm, sample.error_after_mm]);
    let (low, high) = decades(all.flatten())?;
    let (first, last) = (samples().next()?.line as f64, samples().last()?.line as f64);
    let margin = 0.03 * (last - first) + 0.5;
    let (before, after): (Value, Value) = (|own| own.error_before_mm, |own| own.error_after_mm);
    let points = |value| Shape::Points(over_lines(samples(), value));
    let rings = over_lines(samples().filter(|sample| sample.suspected), after);
    let labels = rings.iter().take(LABELLED);
    let labels = labels.map(|at| (*at, format!("line {:.0}", at.0)));
    let labels = Shape::Labels(labels.collect());
    let named = if rings.is_empty() { "" } else { "left out" };
    let figure = Figure::new(
        Axis::linear("line in the samples file", first - margin, last + margin),
        Axis::logarithmic("error, mm", low, high),
    )
    .sized(800, 380)
    .with("before", Colour::Vermilion, points(before))
    .with("after", Colour::Blue, points(after))
    .with(named, Colour::Ink, Shape::Rings(rings))
    .with("", Colour::Ink, labels);
    Some(figure)
}
