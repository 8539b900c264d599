//! The measured poses from above, from two sides, and as seen in space.

use crate::calibration::report::CalibrationReport;
use crate::geometry::range::range;
use crate::render::plot::{Axis, Colour, Figure, Shape};
use nalgebra::Vector3;

/// Joint angles of the grid on which the reachable region is found, an axis.
const GRID: u32 = 9;
/// The eye of the view in space: turned about z and raised, radians.
const TURN: f64 = 0.35;
const RISE: f64 = 0.4;
/// More samples than this have no lines to the floor: they would hide each other.
const WITH_LINES: usize = 60;

/// One view.
pub(super) struct View {
    pub(super) figure: Figure,
    pub(super) caption: &'static str,
}

type Projection = fn(&Vector3<f64>) -> (f64, f64);
type Points = Vec<(f64, f64)>;

/// All four.
pub(super) fn views(report: &CalibrationReport) -> [View; 4] {
    let flat = |x: &str, y: &str, project: Projection, caption| View {
        figure: projected(report, (x, y), project),
        caption,
    };
    [
        flat("x, mm", "y, mm", |p| (p.x, p.y), "From above."),
        flat("x, mm", "z, mm", |p| (p.x, p.z), "From the side, along y."),
        flat("y, mm", "z, mm", |p| (p.y, p.z), "From the side, along x."),
        View {
            figure: in_space(report),
            caption: "In space, with the calibrated robot at the sample nearest to their mean.",
        },
    ]
}

fn positions(report: &CalibrationReport) -> impl Iterator<Item = &Vector3<f64>> + Clone {
    report
        .sample_errors
        .iter()
        .map(|sample| &sample.measured.position)
}

/// Where the calibrated robot gets within the joint limits.
fn reachable(report: &CalibrationReport) -> Vec<Vector3<f64>> {
    let angle = |part: u32| {
        let fraction = f64::from(part) / f64::from(GRID - 1);
        report.before.limits.at(fraction)
    };
    let (robot, limits) = (&report.after.robot, 0..GRID.pow(3));
    limits
        .map(|cell| [cell / GRID / GRID, cell / GRID % GRID, cell % GRID].map(angle))
        .filter_map(|joints| robot.forward(&joints).ok())
        .collect()
}

fn projected(report: &CalibrationReport, (x, y): (&str, &str), project: Projection) -> Figure {
    let region = hull(reachable(report).iter().map(project).collect());
    let (horizontal, vertical) = extents(positions(report).map(project).chain(region.clone()));
    let figure = Figure::new(
        Axis::linear(x, horizontal.0, horizontal.1),
        Axis::linear(y, vertical.0, vertical.1),
    );
    let figure = figure.sized(420, 400).with_equal_scales().with(
        "reachable",
        Colour::Grey,
        Shape::Region(region),
    );
    with_samples(figure, report, project)
}

fn with_samples(figure: Figure, report: &CalibrationReport, project: Projection) -> Figure {
    let outlying = report
        .sample_errors
        .iter()
        .filter(|sample| report.stands_out(sample));
    let outlying: Vec<_> = outlying
        .map(|sample| {
            (
                project(&sample.measured.position),
                format!("line {}", sample.line),
            )
        })
        .collect();
    let rings: Points = outlying.iter().map(|(at, _)| *at).collect();
    let named = if rings.is_empty() { "" } else { "stands out" };
    let points = positions(report).map(project).collect();
    figure
        .with("samples", Colour::Blue, Shape::Points(points))
        .with(named, Colour::Ink, Shape::Rings(rings))
        .with("", Colour::Ink, Shape::Labels(outlying))
}

fn from_the_eye(point: &Vector3<f64>) -> (f64, f64) {
    let (sin, cos) = TURN.sin_cos();
    let depth = sin * point.x + cos * point.y;
    (
        cos * point.x - sin * point.y,
        point.z * RISE.cos() + depth * RISE.sin(),
    )
}

fn in_space(report: &CalibrationReport) -> Figure {
    let robot = robot(report);
    let floor = positions(report).map(|p| p.z).fold(f64::INFINITY, f64::min) - 20.0;
    let on_floor = |p: &Vector3<f64>| Vector3::new(p.x, p.y, floor);
    let lines: Vec<_> = if report.samples <= WITH_LINES {
        let lines = positions(report).map(|p| [from_the_eye(p), from_the_eye(&on_floor(p))]);
        lines.collect()
    } else {
        Vec::new()
    };
    let shadow = hull(
        positions(report)
            .map(|p| from_the_eye(&on_floor(p)))
            .collect(),
    );
    let base = robot.first().cloned().unwrap_or_default();
    let drawn = robot.iter().flatten().copied();
    let (horizontal, vertical) = extents(
        positions(report)
            .map(from_the_eye)
            .chain(shadow.clone())
            .chain(drawn),
    );
    let figure = Figure::new(
        Axis::linear("", horizontal.0, horizontal.1),
        Axis::linear("", vertical.0, vertical.1),
    )
    .sized(420, 400)
    .with_equal_scales()
    .without_axes()
    .with("below the samples", Colour::Grey, Shape::Region(shadow))
    .with("", Colour::Grey, Shape::Hairlines(lines))
    .with("", Colour::Grey, Shape::Region(base));
    let figure = robot
        .into_iter()
        .zip(["robot", "", "", ""])
        .fold(figure, |figure, (line, name)| {
            figure.with(name, Colour::Vermilion, Shape::Line(line))
        });
    with_samples(figure, report, from_the_eye)
}

/// The base, and each arm from its motor by its elbow to the platform point.
fn robot(report: &CalibrationReport) -> Vec<Points> {
    let number = positions(report).fold(0.0, |count, _| count + 1.0);
    let mean = positions(report).sum::<Vector3<f64>>() / number;
    let distance = |sample: &&crate::accuracy::position_error::SampleErrors| {
        (sample.measured.position - mean).norm()
    };
    let Some(sample) = report
        .sample_errors
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    else {
        return Vec::new();
    };
    let arms = report.after.robot.arms();
    let mut base: Points = arms.iter().map(|arm| from_the_eye(&arm.d())).collect();
    base.extend(base.first().copied());
    let limbs = arms.iter().zip(sample.measured.joints).map(|(arm, q)| {
        let joints = [arm.d(), arm.elbow(q), sample.measured.position];
        joints.iter().map(from_the_eye).collect()
    });
    std::iter::once(base).chain(limbs).collect()
}

/// The ranges of both coordinates and a little more.
fn extents(points: impl Iterator<Item = (f64, f64)> + Clone) -> ((f64, f64), (f64, f64)) {
    let extent = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = range(values);
        let margin = 0.04 * (high - low) + 1.0;
        (low - margin, high + margin)
    };
    (
        extent(&mut points.clone().map(|point| point.0)),
        extent(&mut points.map(|point| point.1)),
    )
}

/// The convex hull, by Andrew's monotone chain.
fn hull(mut points: Points) -> Points {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let backwards: Points = points.iter().rev().copied().collect();
    let mut outline = chain(&points);
    outline.pop();
    outline.extend(chain(&backwards));
    outline
}

fn chain(points: &[(f64, f64)]) -> Points {
    let mut chain: Points = Vec::new();
    for &point in points {
        while let [.., a, b] = chain.as_slice()
            && (b.0 - a.0) * (point.1 - a.1) - (b.1 - a.1) * (point.0 - a.0) <= 0.0
        {
            chain.pop();
        }
        chain.push(point);
    }
    chain
}
