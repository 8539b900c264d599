//! The figures of numbers.

use crate::accuracy::position_error::SampleErrors;
use crate::calibration::report::CalibrationReport;
use crate::calibration::thresholds::GOOD_CONDITION;
use crate::geometry::range::range;
use crate::render::plot::{Axis, Colour, Figure, Shape};
use crate::report::calibration::comparison::{Comparison, comparisons};
use crate::text::joint;
use crate::text::units::in_unit;
use delta_cal::Tolerance;
use delta_cal::calibration::limits::chi_square_quantile;

const ARMS: [Colour; 3] = [Colour::Blue, Colour::Vermilion, Colour::Green];
/// Outlying samples that get their line written beside them.
const LABELLED: usize = 12;
/// A distance that is 0 has no place on a logarithmic axis; this is far below any rounding.
const LEAST: f64 = 1e-15;

fn arm_name(arm: usize) -> String {
    format!("arm {}", arm + 1)
}

/// Change ± σ of every parameter, in tolerances or, without, in σ; `None` if neither is known.
pub(super) fn parameters(report: &CalibrationReport) -> Option<(Figure, &'static str)> {
    let rows = comparisons(report);
    match &report.before.tolerance {
        Some(tolerance) => Some((
            in_tolerances(&rows, tolerance),
            if rows.iter().all(|c| c.sigma.is_none()) {
                "Change of each parameter in units of its stated tolerance; its σ is not known. \
                 Shaded: one tolerance."
            } else {
                "Change of each parameter in units of its stated tolerance, with a bar of one σ to \
                 both sides. Shaded: one tolerance."
            },
        )),
        None => in_sigmas(&rows).map(|figure| {
            (
                figure,
                "Change of each parameter in units of its own σ, whatever its sign. Left of the \
                 dashed line the change is smaller than its uncertainty.",
            )
        }),
    }
}

/// The parameters of an arm, each with its row.
fn of_arm(rows: &[Comparison], arm: usize) -> impl Iterator<Item = (f64, &Comparison)> {
    (0..)
        .map(f64::from)
        .zip(rows)
        .filter(move |(_, c)| c.arm == arm)
}

fn names(rows: &[Comparison]) -> Axis {
    let names = rows
        .iter()
        .map(|c| format!("{} {}", c.arm + 1, c.parameter.symbol()));
    Axis::named("", names.collect())
}

fn in_tolerances(rows: &[Comparison], tolerance: &Tolerance<f64>) -> Figure {
    let scaled = |c: &Comparison| {
        let unit = in_unit(c.parameter, tolerance.of(c.parameter));
        (c.change / unit, c.sigma.map(|s| s / unit))
    };
    let extent = rows
        .iter()
        .map(scaled)
        .map(|(change, sigma)| change.abs() + sigma.unwrap_or(0.0))
        .fold(1.25, f64::max)
        * 1.05;
    let ends = (-0.5, 23.5);
    let mut figure = Figure::new(
        Axis::linear("change, tolerances", -extent, extent),
        names(rows),
    )
    .sized(800, 560)
    .with(
        "",
        Colour::Grey,
        Shape::Region(vec![
            (-1.0, ends.0),
            (1.0, ends.0),
            (1.0, ends.1),
            (-1.0, ends.1),
        ]),
    )
    .with(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(0.0, ends.0), (0.0, ends.1)]),
    );
    for (arm, colour) in ARMS.into_iter().enumerate() {
        let bars = of_arm(rows, arm).filter_map(|(row, c)| {
            let (change, sigma) = scaled(c);
            Some([(change - sigma?, row), (change + sigma?, row)])
        });
        let dots = of_arm(rows, arm).map(|(row, c)| (scaled(c).0, row));
        figure = figure
            .with("", colour, Shape::Segments(bars.collect()))
            .with(arm_name(arm), colour, Shape::Points(dots.collect()));
    }
    figure
}

fn in_sigmas(rows: &[Comparison]) -> Option<Figure> {
    let scaled = |c: &Comparison| {
        let ratio = (c.change / c.sigma?).abs();
        (ratio.is_finite() && ratio > LEAST).then_some(ratio)
    };
    let (low, high) = decades(rows.iter().filter_map(scaled))?;
    let (low, high) = (low.min(0.1), high.max(10.0));
    let mut figure = Figure::new(
        Axis::logarithmic("size of the change, σ", low, high),
        names(rows),
    )
    .sized(800, 560)
    .with(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(1.0, -0.5), (1.0, 23.5)]),
    );
    for (arm, colour) in ARMS.into_iter().enumerate() {
        let dots = of_arm(rows, arm).filter_map(|(row, c)| Some((scaled(c)?, row)));
        figure = figure.with(arm_name(arm), colour, Shape::Points(dots.collect()));
    }
    Some(figure)
}

/// The powers of ten around positive values.
fn decades(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = range(values.filter(|value| *value > LEAST).map(f64::log10));
    let (low, high) = ((low - 0.05).floor(), (high + 0.05).ceil());
    (low < high).then(|| (10f64.powf(low), 10f64.powf(high)))
}

#[allow(clippy::cast_precision_loss)] // lines of a file
fn line_number(line: u64) -> f64 {
    line as f64
}

/// The axis of the samples' lines.
fn lines(report: &CalibrationReport) -> Option<(f64, f64)> {
    let samples = &report.sample_errors;
    let first = line_number(samples.first()?.line);
    let last = line_number(samples.last()?.line);
    let margin = 0.03 * (last - first) + 0.5;
    Some((first - margin, last + margin))
}

type Value = fn(&SampleErrors) -> Option<f64>;

/// A value of every sample that has one, over its line.
fn over_lines<'a>(
    samples: impl Iterator<Item = &'a SampleErrors>,
    value: Value,
) -> Vec<(f64, f64)> {
    samples
        .filter_map(|sample| Some((line_number(sample.line), value(sample)?)))
        .collect()
}

/// The samples that stand out ringed, and some of them with their line.
fn with_outlying(figure: Figure, report: &CalibrationReport, value: Value) -> Figure {
    let samples = report.sample_errors.iter();
    let rings = over_lines(samples.filter(|s| report.stands_out(s)), value);
    let labels = rings.iter().take(LABELLED);
    let labels = labels.map(|at| (*at, format!("line {:.0}", at.0)));
    let labels = Shape::Labels(labels.collect());
    let named = if rings.is_empty() { "" } else { "stands out" };
    figure
        .with(named, Colour::Ink, Shape::Rings(rings))
        .with("", Colour::Ink, labels)
}

/// Every sample before and after; `None` if there is nothing to show.
pub(super) fn residuals(report: &CalibrationReport) -> Option<Figure> {
    let samples = || report.sample_errors.iter();
    let all = samples().flat_map(|sample| [sample.before, sample.after]);
    let (low, high) = decades(all.flatten())?;
    let (left, right) = lines(report)?;
    let points = |value: Value| Shape::Points(over_lines(samples(), value));
    let rms = |value: f64| Shape::Dashed(vec![(left, value), (right, value)]);
    let figure = Figure::new(
        Axis::linear("line in the samples file", left, right),
        Axis::logarithmic("position error, mm", low, high),
    )
    .sized(800, 380)
    .with("before", Colour::Vermilion, points(|s| s.before))
    .with("after", Colour::Blue, points(|s| s.after))
    .with("rms", Colour::Ink, rms(report.error_before.rms))
    .with("", Colour::Ink, rms(report.error_after.rms));
    Some(with_outlying(figure, report, |s| s.after))
}

/// Every sample after the calibration, in σ of the noise; `None` if no noise is known.
pub(super) fn residuals_in_sigmas(report: &CalibrationReport) -> Option<Figure> {
    let samples = || report.sample_errors.iter();
    let value: Value = |s| s.after_in_sigmas;
    let (low, high) = decades(samples().filter_map(value))?;
    let (low, high) = (low.min(0.1), high.max(10.0));
    let (left, right) = lines(report)?;
    let level = |at: f64| Shape::Dashed(vec![(left, at), (right, at)]);
    let figure = Figure::new(
        Axis::linear("line in the samples file", left, right),
        Axis::logarithmic("position error after, σ", low, high),
    )
    .sized(800, 300)
    .with(
        "after",
        Colour::Blue,
        Shape::Points(over_lines(samples(), value)),
    )
    .with("expected", Colour::Ink, level(1.0))
    .with(
        "hardly by chance",
        Colour::Vermilion,
        level((chi_square_quantile(3.0_f64) / 3.0).sqrt()),
    );
    Some(with_outlying(figure, report, value))
}

/// The closure errors of each arm over its joint angle, with the curves of what was found; none where
/// nothing is left over.
pub(super) fn closures(report: &CalibrationReport) -> Vec<(Figure, String)> {
    let arms = &report.causes.arms;
    let sizes = arms.iter().flat_map(|arm| {
        let curves = arm.curves.iter().flatten();
        arm.points.iter().chain(curves).map(|point| point.1.abs())
    });
    let extent = 1.1 * sizes.fold(0.0, f64::max);
    let limits = &report.before.limits;
    let drive = limits.drive();
    let in_file = |q: f64| joint::in_file(drive, q);
    let (low, high) = (in_file(limits.minimum()), in_file(limits.maximum()));
    let names = joint::names(drive).map(|name| name.replace("deg", "°"));
    if !(extent > LEAST) {
        return Vec::new();
    }
    let in_degrees = |points: &[(f64, f64)]| -> Vec<_> {
        points
            .iter()
            .map(|(q, value)| (in_file(*q), *value))
            .collect()
    };
    let panels = arms
        .iter()
        .zip(ARMS)
        .enumerate()
        .map(|(arm, (residuals, colour))| {
            let mut figure = Figure::new(
                Axis::linear(names[arm].clone(), low, high),
                Axis::linear("closure error, mm", -extent, extent),
            )
            .sized(420, 300)
            .with(
                "",
                Colour::Ink,
                Shape::Dashed(vec![(low, 0.0), (high, 0.0)]),
            )
            .with("", colour, Shape::Points(in_degrees(&residuals.points)));
            for curve in &residuals.curves {
                figure = figure.with("", Colour::Ink, Shape::Line(in_degrees(curve)));
            }
            (figure, format!("Arm {}", arm + 1))
        });
    panels.collect()
}

/// The condition of each arm against what is good.
pub(super) fn conditions(report: &CalibrationReport) -> Figure {
    let conditions = || report.outcome.fit.arms.iter().map(|arm| arm.condition);
    let (_, high) = decades(conditions()).unwrap_or((1.0, 1e3));
    let high = high.max(1e3);
    let rows = [0.0, 1.0, 2.0];
    let stems = conditions()
        .zip(rows)
        .map(|(condition, row)| [(1.0, row), (condition, row)]);
    Figure::new(
        Axis::logarithmic("condition", 1.0, high),
        Axis::named("", (0..3).map(arm_name).collect()),
    )
    .sized(800, 170)
    .with(
        "limit of a good condition",
        Colour::Ink,
        Shape::Dashed(vec![(GOOD_CONDITION, -0.5), (GOOD_CONDITION, 2.5)]),
    )
    .with("", Colour::Blue, Shape::Segments(stems.collect()))
    .with(
        "condition",
        Colour::Blue,
        Shape::Points(conditions().zip(rows).collect()),
    )
}

/// Where in their range the samples have each joint.
pub(super) fn joints(report: &CalibrationReport) -> Figure {
    let limits = &report.before.limits;
    let drive = limits.drive();
    let in_file = |q: f64| joint::in_file(drive, q);
    let (low, high) = (in_file(limits.minimum()), in_file(limits.maximum()));
    let margin = 0.04 * (high - low);
    let limit = |at: f64| [(at, -0.4), (at, 2.4)];
    let points = report.sample_errors.iter().flat_map(|sample| {
        let joints = sample.measured.joints.map(in_file);
        joints.into_iter().zip([0.0, 1.0, 2.0])
    });
    let letter = joint::letter(drive);
    let names = [1, 2, 3].map(|joint| format!("{letter}{joint}"));
    Figure::new(
        Axis::linear(
            format!("{}, {}", joint::name(drive), joint::mark(drive).trim()),
            low - margin,
            high + margin,
        ),
        Axis::named("", names.to_vec()),
    )
    .sized(800, 170)
    .with(
        "joint limits",
        Colour::Ink,
        Shape::Segments(vec![limit(low), limit(high)]),
    )
    .with("samples", Colour::Blue, Shape::Points(points.collect()))
}
