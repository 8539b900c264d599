//! The mesh for the view that can be turned: numbers for its script.

use super::figures::{colour, kind};
use crate::accuracy::information::sigma_of_sum;
use crate::geometry::range::range;
use crate::render::plot::STEPS;
use crate::workspace::Analysis;
use crate::workspace::{Mesh, Workspace, displacements, displacements_to};
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::BTreeMap;

#[derive(Debug, Serialize)]
struct Scene {
    /// x, y, z of each corner, mm.
    vertices: Vec<f64>,
    /// Three corners each.
    triangles: Vec<usize>,
    /// x, y, z of both ends of each line.
    lines: Vec<f64>,
    modes: Vec<Mode>,
}

/// One way of colouring.
#[derive(Debug, Serialize)]
struct Mode {
    name: &'static str,
    classes: Vec<Class>,
    /// The class of each corner, or of each triangle.
    values: Vec<usize>,
    of_triangles: bool,
}

#[derive(Debug, Serialize)]
struct Class {
    name: String,
    colour: String,
}

/// The scene of a coarser workspace of the same robot, and its mesh, as JSON.
///
/// # Errors
/// What the writer says; nothing is known to fail.
pub(super) fn scene(
    analysis: &Analysis,
    coarse: &Workspace,
    mesh: &Mesh,
) -> Result<String, serde_json::Error> {
    let mut modes = vec![kinds(mesh)];
    let conditioning: Vec<_> = mesh
        .vertices
        .iter()
        .map(|point| coarse.robot.singularity_distance(&point.position, &point.q))
        .collect();
    let serial = conditioning
        .iter()
        .map(|c| c.serial.into_iter().fold(1.0, f64::min));
    let parallel = conditioning.iter().map(|c| c.parallel);
    modes.push(graded(
        "distance from type 1",
        &serial.collect::<Vec<_>>(),
        "",
    ));
    modes.push(graded(
        "distance from type 2",
        &parallel.collect::<Vec<_>>(),
        "",
    ));
    if let Some(tolerance) = &analysis.tolerance {
        let sigma = |moved: Option<[f64; 24]>| {
            let robot = &analysis.workspace.robot;
            moved.map_or(f64::NAN, |moved| sigma_of_sum(robot, tolerance, &moved))
        };
        let sigmas: Vec<_> = displacements(coarse, &mesh.vertices)
            .into_iter()
            .map(sigma)
            .collect();
        modes.push(graded(
            "sigma of the boundary for the tolerance",
            &sigmas,
            " mm",
        ));
    }
    if let Some(other) = &analysis.other {
        let (moved, _) = displacements_to(coarse, &mesh.vertices, other);
        let moved: Vec<_> = moved
            .into_iter()
            .map(|moved| moved.unwrap_or(f64::NAN))
            .collect();
        modes.push(graded("displacement to the other robot", &moved, " mm"));
    }
    let rounded = |value: f64| (value * 10.0).round() / 10.0;
    let scene = Scene {
        vertices: mesh
            .vertices
            .iter()
            .flat_map(|v| v.position.data.0[0])
            .map(rounded)
            .collect(),
        triangles: mesh.triangles.iter().flatten().copied().collect(),
        lines: robot_lines(analysis)
            .into_iter()
            .flatten()
            .flat_map(|end| end.data.0[0])
            .map(rounded)
            .collect(),
        modes,
    };
    serde_json::to_string(&scene)
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn kinds(mesh: &Mesh) -> Mode {
    let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
    let mut classes = Vec::new();
    let values = mesh.limits.iter().map(|limit| {
        *numbers.entry(kind(*limit)).or_insert_with(|| {
            classes.push(Class {
                name: kind(*limit).to_owned(),
                colour: hex(colour(*limit).channels()),
            });
            classes.len() - 1
        })
    });
    let values = values.collect();
    Mode {
        name: "what limits it",
        classes,
        values,
        of_triangles: true,
    }
}

/// Six equal steps from the least to the greatest.
fn graded(name: &'static str, values: &[f64], unit: &str) -> Mode {
    let (low, high) = range(values.iter().copied().filter(|value| value.is_finite()));
    let step = (high - low) / 6.0;
    let mut classes = Vec::new();
    let mut end = low;
    for fill in STEPS {
        classes.push(Class {
            name: format!("{end:.3} to {:.3}{unit}", end + step),
            colour: hex(fill),
        });
        end += step;
    }
    classes.push(Class {
        name: "unknown".to_owned(),
        colour: "#808080".to_owned(),
    });
    let class = |value: &f64| {
        let passed = (1..6)
            .filter(|number| *value > low + step * f64::from(*number))
            .count();
        if value.is_finite() { passed } else { 6 }
    };
    let values: Vec<usize> = values.iter().map(class).collect();
    if !values.contains(&6) {
        classes.pop();
    }
    Mode {
        name,
        classes,
        values,
        of_triangles: false,
    }
}

/// The base and the arms, in the middle of the largest cylinder or at any boundary point.
fn robot_lines(analysis: &Analysis) -> Vec<[Vector3<f64>; 2]> {
    let workspace = &analysis.workspace;
    let middle = analysis
        .cylinders
        .first()
        .map(|cylinder| Vector3::new(0.0, 0.0, f64::midpoint(cylinder.bottom, cylinder.top)));
    let any = workspace.points.first().map(|point| point.position);
    let Some(x) = middle.or(any) else {
        return Vec::new();
    };
    let Ok(q) = workspace.reach.any_joints(&workspace.robot, &x) else {
        return Vec::new();
    };
    let arms = workspace.robot.arms();
    let mut lines = Vec::new();
    for (index, (arm, q)) in arms.iter().zip(q).enumerate() {
        let next = &arms[(index + 1) % arms.len()];
        lines.push([arm.d(), next.d()]);
        lines.push([arm.d(), arm.elbow(q)]);
        lines.push([arm.elbow(q), x]);
    }
    lines
}
