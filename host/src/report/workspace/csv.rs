//! Tables for other programs. Millimetres, degrees.

use crate::accuracy::information::parameters;
use crate::text::units::degrees;
use crate::workspace::{
    BoundaryPoint, Comparison, ConditionedPosition, Cylinder, PathSummary, PointBand, Workspace,
};
use nalgebra::Vector3;
use std::fmt::Write;

/// `x_mm,y_mm,z_mm,kind`: every point of the boundary and what limits it.
pub fn boundary(workspace: &Workspace) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm,kind\n");
    for point in &workspace.points {
        let _ = writeln!(csv, "{},{}", place(&point.position), point.limit.name());
    }
    csv
}

/// The same points, the outward normal, and its displacement for each of the 24 parameters, in mm
/// per mm and mm per degree; with `comparison` the displacement to the other robot.
pub fn influence(workspace: &Workspace, comparison: Option<&Comparison>) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm,kind,normal_x,normal_y,normal_z");
    for (arm, parameter) in parameters(&workspace.robot) {
        let _ = write!(csv, ",{}_{}", parameter.symbol(), arm.index() + 1);
    }
    csv.push_str(if comparison.is_some() {
        ",displacement_mm\n"
    } else {
        "\n"
    });
    for (index, point) in workspace.points.iter().enumerate() {
        let moved = point.displacement(&workspace.robot, &workspace.reach);
        let [x, y, z] = point.outward.data.0[0];
        let _ = write!(
            csv,
            "{},{},{x:.6},{y:.6},{z:.6}",
            place(&point.position),
            point.limit.name()
        );
        for (arm, parameter) in parameters(&workspace.robot) {
            let unit = crate::workspace::unit(parameter);
            match &moved {
                Some(moved) => {
                    let value = moved[arm.index()][parameter.index()] * unit;
                    let _ = write!(csv, ",{}", short(value));
                }
                None => csv.push(','),
            }
        }
        if let Some(comparison) = comparison {
            csv.push(',');
            if let Some(moved) = comparison.displacements[index] {
                let _ = write!(csv, "{moved:.4}");
            }
        }
        csv.push('\n');
    }
    csv
}

/// Where the boundary lies for the stated tolerance: σ to first order, and the quantiles of the
/// Monte-Carlo, along the outward normal.
pub fn band(points: &[PointBand]) -> String {
    let mut csv = String::from(
        "x_mm,y_mm,z_mm,kind,normal_x,normal_y,normal_z,sigma_mm,p05_mm,p95_mm,robots\n",
    );
    for band in points {
        let BoundaryPoint {
            position,
            limit,
            outward,
            ..
        } = &band.point;
        let [x, y, z] = outward.data.0[0];
        let _ = writeln!(
            csv,
            "{},{},{x:.6},{y:.6},{z:.6},{:.4},{:.4},{:.4},{}",
            place(position),
            limit.name(),
            band.sigma,
            band.low,
            band.high,
            band.robots,
        );
    }
    csv
}

/// Conditioning at positions inside: 0 at a singularity, 1 at best.
pub fn conditioning(positions: &[ConditionedPosition]) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm,serial_1,serial_2,serial_3,parallel\n");
    for at in positions {
        let [a, b, c] = at.conditioning.serial;
        let parallel = at.conditioning.parallel;
        let _ = writeln!(
            csv,
            "{},{a:.4},{b:.4},{c:.4},{parallel:.4}",
            place(&at.position)
        );
    }
    csv
}

/// Each row of a path: its pose, its distance from the nearest singularity and which that is; a
/// row beyond reach has `beyond_reach` only, with what keeps the robot from it.
pub fn path(path: &PathSummary) -> String {
    let mut csv = String::from(
        "_line,q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,_singularity_mm,_singularity,_serial,_parallel,_beyond_reach\n",
    );
    for row in &path.rows {
        let _ = match &row.point {
            Ok(point) => {
                let [q1, q2, q3] = point.q.map(degrees);
                writeln!(
                    csv,
                    "{},{q1:.6},{q2:.6},{q3:.6},{},{:.4},{},{:.4},{:.4},",
                    row.line,
                    place(&point.position),
                    point.nearest.distance,
                    point.nearest.kind.name(),
                    point.serial(),
                    point.conditioning.parallel,
                )
            }
            Err(limit) => writeln!(csv, "{},,,,,,,,,,,{}", row.line, limit.name()),
        };
    }
    csv
}

fn place(at: &Vector3<f64>) -> String {
    // To a nanometre: far below any tolerance.
    let [x, y, z] = at.data.0[0].map(|value| format!("{value:.6}"));
    format!("{x},{y},{z}")
}

/// Six decimals, and plain 0 for what is 0.
fn short(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

/// The highest cylinder of each diameter, narrow to wide.
pub fn cylinders(cylinders: &[Cylinder]) -> String {
    let mut csv = String::from("diameter_mm,height_mm,bottom_mm,top_mm,volume_l\n");
    for cylinder in cylinders.iter().skip(1) {
        let _ = writeln!(
            csv,
            "{:.3},{:.3},{:.3},{:.3},{:.4}",
            cylinder.diameter,
            cylinder.height(),
            cylinder.bottom,
            cylinder.top,
            cylinder.volume() * 1e-6,
        );
    }
    csv
}
