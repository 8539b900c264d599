//! Slices, maps and a view in space.

use crate::geometry::range::range;
use crate::geometry::reach::Limit;
use crate::render::named_figure::NamedFigure;
use crate::render::plot::{Axis, Colour, Figure, Patch, STEPS, Shape};
use crate::workspace::Analysis;
use crate::workspace::{ConditionedPosition, Mesh, ParameterInfluence};
use delta_cal::ArmIndex;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::collections::BTreeMap;

/// The names of the figures' files, without ending.
pub const NAMES: [&str; 10] = [
    "horizontal",
    "vertical_xz",
    "vertical_yz",
    "serial",
    "parallel",
    "serial_horizontal",
    "parallel_horizontal",
    "cylinders",
    "influence",
    "view",
];

/// Two coordinates of a plane, and the third that is held.
#[derive(Debug, Clone, Copy)]
struct Plane {
    across: usize,
    up: usize,
    held: usize,
    at: f64,
}

const AXES: [&str; 3] = ["x, mm", "y, mm", "z, mm"];
/// Cells of a map across its width.
const CELLS: u32 = 180;
/// The eye of the view in space: turned about z and raised, radians.
const TURN: f64 = 0.6;
const RISE: f64 = 0.3;
/// By how much the faces of the view overlap, in parts of the spacing of its lines.
const OVERLAP: f64 = 0.1;
/// Upper ends of the classes of a map; the last one is open.
const CLASSES: [f64; 5] = [0.05, 0.1, 0.25, 0.5, 0.75];

/// The colour of what limits a point.
pub(super) const fn colour(limit: Limit) -> Colour {
    match limit {
        Limit::JointMaximum(_) => Colour::Blue,
        Limit::JointMinimum(_) => Colour::Orange,
        Limit::Forearm(_) => Colour::Green,
        Limit::Serial(_) | Limit::Unreachable(_) => Colour::Vermilion,
        Limit::Parallel(_) => Colour::Purple,
        Limit::Assembly(_) | Limit::NonFinite(_) => Colour::Grey,
    }
}

/// What limits a point, without its arm, in words.
pub(super) const fn kind(limit: Limit) -> &'static str {
    match limit {
        Limit::JointMaximum(_) => "joint at its largest",
        Limit::JointMinimum(_) => "joint at its smallest",
        Limit::Forearm(_) => "ball joint",
        Limit::Serial(_) | Limit::Unreachable(_) => "singularity, type 1",
        Limit::Parallel(_) => "singularity, type 2",
        Limit::Assembly(_) => "elbows' plane upright",
        Limit::NonFinite(_) => "not finite",
    }
}

/// All of them, in the order of [`NAMES`]. `coarse` is a mesh with fewer triangles, for the view in
/// space.
pub fn figures(analysis: &Analysis, coarse: &Mesh) -> Vec<NamedFigure> {
    let vertical = |across, held| Plane {
        across,
        up: 2,
        held,
        at: 0.0,
    };
    let top = analysis.cylinders.first().map_or_else(
        || f64::midpoint(analysis.extent()[2].0, analysis.extent()[2].1),
        |cylinder| cylinder.top,
    );
    let horizontal = Plane {
        across: 0,
        up: 1,
        held: 2,
        at: top,
    };
    let serial = ConditionedPosition::serial;
    let parallel = |at: &ConditionedPosition| at.conditioning.parallel;
    let view = view(coarse, OVERLAP * analysis.workspace.grid.spacing);
    let figures = [
        (heights(analysis), "Outlines at five heights, from above."),
        (section(analysis, vertical(0, 1)), "Section y = 0."),
        (section(analysis, vertical(1, 0)), "Section x = 0."),
        (
            map(analysis, vertical(0, 1), serial),
            &caption("Type 1 (an arm stretched or folded), section y = 0"),
        ),
        (
            map(analysis, vertical(0, 1), parallel),
            &caption("Type 2 (forearms in one plane), section y = 0"),
        ),
        (
            map(analysis, horizontal, serial),
            "Type 1, horizontal section at the top of the largest cylinder.",
        ),
        (
            map(analysis, horizontal, parallel),
            "Type 2, the same section.",
        ),
        (
            cylinders(analysis),
            "The highest cylinder of each diameter that is all inside the workspace.",
        ),
        (
            influence(&analysis.influence),
            "Displacement of the boundary along its outward normal for 1 mm or 1° of each parameter: the \
             line is the range over the boundary, the dot its rms.",
        ),
        (
            view,
            "The boundary in space, coloured by what limits it: blue a joint at its largest angle, \
             orange at its smallest, vermilion a singularity of type 1.",
        ),
    ];
    let named = NAMES.into_iter().zip(figures);
    named
        .map(|(name, (figure, caption))| NamedFigure::new(name, figure, caption))
        .collect()
}

fn axis(analysis: &Analysis, axis: usize) -> Axis {
    let (from, to) = analysis.extent()[axis];
    let margin = 0.04 * (to - from);
    Axis::linear(AXES[axis], from - margin, to + margin)
}

fn plain(analysis: &Analysis, plane: Plane) -> Figure {
    Figure::new(axis(analysis, plane.across), axis(analysis, plane.up))
        .sized(460, 460)
        .with_equal_scales()
}

type Segment = [(f64, f64); 2];

/// Where the mesh meets a plane, by what limits it there.
fn outline(mesh: &Mesh, plane: Plane) -> BTreeMap<Limit, Vec<Segment>> {
    let mut outline: BTreeMap<Limit, Vec<Segment>> = BTreeMap::new();
    for (corners, limit) in mesh.corners().zip(&mesh.limits) {
        let mut crossings = Vec::with_capacity(2);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let [from, to] = [corners[a], corners[b]].map(|c| c[plane.held] - plane.at);
            if (from > 0.0) != (to > 0.0) {
                let x = corners[a] + (corners[b] - corners[a]) * (from / (from - to));
                crossings.push((x[plane.across], x[plane.up]));
            }
        }
        if let [from, to] = crossings[..] {
            outline.entry(*limit).or_default().push([from, to]);
        }
    }
    outline
}

fn section(analysis: &Analysis, plane: Plane) -> Figure {
    let mut kinds: BTreeMap<&str, (Colour, Vec<Segment>)> = BTreeMap::new();
    for (limit, segments) in outline(&analysis.mesh, plane) {
        let of_kind = kinds
            .entry(kind(limit))
            .or_insert((colour(limit), Vec::new()));
        of_kind.1.extend(segments);
    }
    let mut figure = plain(analysis, plane);
    if let Some(cylinder) = analysis.cylinders.first() {
        let (r, low, high) = (cylinder.diameter / 2.0, cylinder.bottom, cylinder.top);
        let corners = vec![(-r, low), (r, low), (r, high), (-r, high)];
        figure = figure.with("largest cylinder", Colour::Grey, Shape::Region(corners));
    }
    for (name, (colour, segments)) in kinds {
        figure = figure.with(name, colour, Shape::Segments(segments));
    }
    figure
}

fn heights(analysis: &Analysis) -> Figure {
    let (low, high) = analysis.extent()[2];
    let colours = [
        Colour::Blue,
        Colour::Vermilion,
        Colour::Green,
        Colour::Purple,
        Colour::Orange,
    ];
    let plane = |at| Plane {
        across: 0,
        up: 1,
        held: 2,
        at,
    };
    let mut figure = plain(analysis, plane(0.0));
    for (colour, part) in colours.into_iter().zip([0.1, 0.3, 0.5, 0.7, 0.9]) {
        let at = (low + part * (high - low)).round();
        let segments = outline(&analysis.mesh, plane(at))
            .into_values()
            .flatten()
            .collect();
        figure = figure.with(format!("z = {at}"), colour, Shape::Segments(segments));
    }
    figure
}

fn class(value: f64) -> usize {
    CLASSES
        .iter()
        .position(|end| value < *end)
        .unwrap_or(CLASSES.len())
}

fn map(analysis: &Analysis, plane: Plane, value: fn(&ConditionedPosition) -> f64) -> Figure {
    let (across, up) = (analysis.extent()[plane.across], analysis.extent()[plane.up]);
    let side = (across.1 - across.0).max(up.1 - up.0) / f64::from(CELLS);
    // Runs of cells of one class become one rectangle.
    let row = |row: u32| {
        let from = |column: u32| across.0 + side * f64::from(column);
        let low = up.0 + side * f64::from(row);
        let class_at = |column: u32| {
            let mut position = Vector3::repeat(plane.at);
            position[plane.across] = from(column) + 0.5 * side;
            position[plane.up] = low + 0.5 * side;
            let at = ConditionedPosition::at(&analysis.workspace, position)?;
            Some(class(value(&at)))
        };
        let mut runs: Vec<(usize, u32, u32)> = Vec::new();
        for column in 0..CELLS {
            let Some(class) = class_at(column) else {
                continue;
            };
            match runs.last_mut() {
                Some((of, _, end)) if *of == class && *end == column => *end += 1,
                _ => runs.push((class, column, column + 1)),
            }
        }
        let rectangle = |(class, begin, end): (usize, u32, u32)| {
            // Rows overlap a little, or the paper shines through between them.
            let (left, right, high) = (from(begin), from(end), low + 1.1 * side);
            (
                class,
                vec![(left, low), (right, low), (right, high), (left, high)],
            )
        };
        runs.into_iter().map(rectangle).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<_>> = (0..CELLS).into_par_iter().map(row).collect();
    let mut classes = vec![Vec::new(); STEPS.len()];
    for (class, outline) in rows.into_iter().flatten() {
        classes[class].push((outline, STEPS[class]));
    }
    let mut figure = plain(analysis, plane);
    for (class, patches) in classes.into_iter().enumerate() {
        if patches.is_empty() {
            continue;
        }
        let name = match (
            class.checked_sub(1).map(|below| CLASSES[below]),
            CLASSES.get(class),
        ) {
            (None, Some(to)) => format!("below {to}"),
            (Some(from), Some(to)) => format!("{from} to {to}"),
            (Some(from), None) => format!("above {from}"),
            (None, None) => String::new(),
        };
        figure = figure.with(name, Colour::Ink, Shape::Patches(patches));
    }
    figure
}

fn cylinders(analysis: &Analysis) -> Figure {
    let points: Vec<(f64, f64)> = analysis
        .cylinders
        .iter()
        .skip(1)
        .map(|cylinder| (cylinder.diameter, cylinder.height()))
        .collect();
    let most = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).fold(1e-9, f64::max) * 1.05;
    let largest = analysis.cylinders.first().map(|c| (c.diameter, c.height()));
    Figure::new(
        Axis::linear("diameter, mm", 0.0, most(|p| p.0)),
        Axis::linear("height, mm", 0.0, most(|p| p.1)),
    )
    .sized(560, 300)
    .with("highest cylinder", Colour::Blue, Shape::Line(points))
    .with(
        "largest volume",
        Colour::Vermilion,
        Shape::Points(largest.into_iter().collect()),
    )
}

fn influence(influences: &[ParameterInfluence]) -> Figure {
    let names = influences
        .iter()
        .map(|of| format!("{} {}", of.arm.index() + 1, of.parameter.symbol()))
        .collect();
    let most = influences
        .iter()
        .flat_map(|of| [of.rms, of.outwards, -of.inwards])
        .fold(1e-9, f64::max)
        * 1.05;
    let mut figure = Figure::new(
        Axis::linear(
            "displacement outwards, mm per mm or per degree",
            -most,
            most,
        ),
        Axis::named("", names),
    )
    .sized(800, 560);
    let rows = || (0..).map(f64::from).zip(influences);
    let colours = [Colour::Blue, Colour::Vermilion, Colour::Green];
    for (arm, colour) in ArmIndex::ALL.into_iter().zip(colours) {
        let of_arm = || rows().filter(move |(_, of)| of.arm == arm);
        let ranges = of_arm().map(|(row, of)| [(of.inwards, row), (of.outwards, row)]);
        let rms = of_arm().map(|(row, of)| (of.rms, row));
        figure = figure
            .with(arm.to_string(), colour, Shape::Segments(ranges.collect()))
            .with("", colour, Shape::Points(rms.collect()));
    }
    figure
}

/// Shades of each face, the farthest first.
fn view(mesh: &Mesh, overlap: f64) -> Figure {
    let (sin_turn, cos_turn) = TURN.sin_cos();
    let (sin_rise, cos_rise) = RISE.sin_cos();
    let right = Vector3::new(cos_turn, -sin_turn, 0.0);
    let into = Vector3::new(sin_turn * cos_rise, cos_turn * cos_rise, -sin_rise);
    let up = right.cross(&into);
    let light = (up * 0.5 - into + right * -0.4).normalize();
    let mut faces: Vec<(f64, Patch)> = Vec::new();
    for (corners, limit) in mesh.corners().zip(&mesh.limits) {
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a));
        if normal.dot(&into) >= 0.0 || normal.norm() <= 0.0 {
            continue;
        }
        let shade = 0.45 + 0.55 * normal.normalize().dot(&light).max(0.0);
        // A little larger than they are, or the paper shines through between them.
        let centre = (a + b + c) / 3.0;
        let grown = |corner: Vector3<f64>| corner + (corner - centre).normalize() * overlap;
        let outline = corners
            .map(grown)
            .map(|corner| (corner.dot(&right), corner.dot(&up)));
        let base = colour(*limit).channels();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 255
        let fill = base.map(|channel| (f64::from(channel) * shade).round() as u8);
        faces.push(((a + b + c).dot(&into), (outline.to_vec(), fill)));
    }
    faces.sort_by(|a, b| b.0.total_cmp(&a.0));
    let corners = || faces.iter().flat_map(|(_, (outline, _))| outline);
    let (x, y) = (
        range(corners().map(|at| at.0)),
        range(corners().map(|at| at.1)),
    );
    let mut kinds: BTreeMap<&str, Colour> = BTreeMap::new();
    for limit in &mesh.limits {
        kinds.insert(kind(*limit), colour(*limit));
    }
    let mut figure = Figure::new(Axis::linear("", x.0, x.1), Axis::linear("", y.0, y.1))
        .sized(640, 560)
        .with_equal_scales()
        .without_axes();
    for (name, colour) in kinds {
        let key = Shape::Patches(vec![(Vec::new(), colour.channels())]);
        figure = figure.with(name, colour, key);
    }
    let patches = faces.into_iter().map(|(_, patch)| patch);
    figure.with("", Colour::Ink, Shape::Patches(patches.collect()))
}

/// Where a map's classes end, for its caption.
fn caption(kind: &str) -> String {
    format!(
        "{kind}: 0 at a singularity, 1 at best. A pose counts as clear above {} (type 1) and {} \
         (type 2).",
        SingularityDistance::<f64>::LEAST_SERIAL,
        SingularityDistance::<f64>::LEAST_PARALLEL,
    )
}
