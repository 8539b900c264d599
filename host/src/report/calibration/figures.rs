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
    let one = [(-1.0, top), (1.0, top), (1.0, bottom), (-1.0, bottom)];
    let mut figure = Figure::new(
        Axis::linear("change, tolerances", -extent, extent),
        Axis::named("", names.collect()),
    )
    .sized(800, 560)
    .with("one tolerance", Colour::Grey, Shape::Region(one.into()))
    .with(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(0.0, top), (0.0, bottom)]),
    );
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

fn line_number(line: u64) -> f64 {
    line as f64
}

/// The axis of line numbers.
fn lines(report: &Report) -> Option<(f64, f64)> {
    let first = line_number(report.samples.first()?.line);
    let last = line_number(report.samples.last()?.line);
    let margin = 0.03 * (last - first) + 0.5;
    Some((first - margin, last + margin))
}

type Value = fn(&SampleReport) -> Option<f64>;

/// A value over the line number, for each sample that has one.
fn over_lines<'a>(
    samples: impl Iterator<Item = &'a SampleReport>,
    value: Value,
) -> Vec<(f64, f64)> {
    samples
        .filter_map(|sample| Some((line_number(sample.line), value(sample)?)))
        .collect()
}

/// Rings the suspected samples, and labels some with their line.
fn with_suspected(figure: Figure, report: &Report, value: Value) -> Figure {
    let suspected = report.samples.iter().filter(|sample| sample.suspected);
    let rings = over_lines(suspected, value);
    let labels = rings.iter().take(LABELLED);
    let labels = labels.map(|at| (*at, format!("line {:.0}", at.0)));
    let labels = Shape::Labels(labels.collect());
    let named = if rings.is_empty() { "" } else { "left out" };
    figure
        .with(named, Colour::Ink, Shape::Rings(rings))
        .with("", Colour::Ink, labels)
}

/// Errors of all samples before and after; `None` if there is nothing to show.
pub(super) fn residuals(report: &Report) -> Option<Figure> {
    let samples = || report.samples.iter();
    let all = samples().flat_map(|sample| [sample.error_before_mm, sample.error_after_mm]);
    let (low, high) = decades(all.flatten())?;
    let (left, right) = lines(report)?;
    let points = |value: Value| Shape::Points(over_lines(samples(), value));
    let figure = Figure::new(
        Axis::linear("line in the samples file", left, right),
        Axis::logarithmic("error, mm", low, high),
    )
    .sized(800, 380)
    .with("before", Colour::Vermilion, points(|s| s.error_before_mm))
    .with("after", Colour::Blue, points(|s| s.error_after_mm));
    Some(with_suspected(figure, report, |s| s.error_after_mm))
}
