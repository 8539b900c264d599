//! The figures for programs. Millimetres, degrees, litres.

use super::LITRE;
use crate::render::json;
use crate::text::units::degrees;
use crate::workspace::{
    Analysis, Comparison, ConditionedPosition, Cylinder, Mesh, ParameterInfluence, PathRow,
    PathSummary, Volume,
};
use delta_cal::robot::ParameterKind;
use serde_json::{Value, json};

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole of it.
pub fn report(analysis: &Analysis) -> Value {
    let [x, y, z] = analysis.extent().map(|(from, to)| [from, to]);
    let limits = analysis.limits().into_iter();
    let limits = limits.map(|(limit, share)| json!({ "kind": limit.name(), "share": share }));
    let cylinders = analysis.cylinders.iter().skip(1).map(cylinder);
    let clear = analysis
        .conditioning
        .iter()
        .filter(|at| at.conditioning.is_clear());
    let least = |value: fn(&ConditionedPosition) -> f64| {
        analysis.conditioning.iter().map(value).fold(1.0, f64::min)
    };
    let contents = json!({
        "robot_file": analysis.name,
        "tolerance_mm": analysis.workspace.tolerance,
        "spacing_mm": analysis.workspace.grid.spacing,
        "boundary_points": analysis.workspace.points.len(),
        "volume": volume(&analysis.volume),
        "mesh": mesh(&analysis.mesh),
        "extent_mm": { "x": x, "y": y, "z": z },
        "limits": limits.collect::<Vec<_>>(),
        "largest_cylinder": analysis.cylinders.first().map(cylinder),
        "cylinders": cylinders.collect::<Vec<_>>(),
        "influence": analysis.influence.iter().map(influence).collect::<Vec<_>>(),
        "tolerance_band": analysis.band.as_ref().map(|band| json!({
            "robots": band.options.robots,
            "seed": band.options.seed,
            "points": band.points.len(),
            "sigma_mm": band.sigma,
            "largest_sigma_mm": band.largest_sigma,
            "p05_rms_mm": band.low_rms(),
            "p95_rms_mm": band.high_rms(),
            "volume_sigma_litres": band.volume_sigma / LITRE,
        })),
        "comparison": analysis.comparison.as_ref().map(|(name, other)| comparison(name, other)),
        "conditioning": {
            "positions": analysis.conditioning.len(),
            "least_serial": least(ConditionedPosition::serial),
            "least_parallel": least(|at| at.conditioning.parallel),
            "clear": clear.count(),
        },
        "path": analysis.path.as_ref().map(path),
    });
    json::report(SCHEMA_VERSION, contents)
}

fn mesh(mesh: &Mesh) -> Value {
    let left_out = mesh.left_out.iter().map(|piece| {
        let [x, y, z]: [f64; 3] = piece.centre.into();
        json!({ "litres": piece.volume / LITRE, "about_mm": { "x": x, "y": y, "z": z } })
    });
    json!({
        "vertices": mesh.vertices.len(),
        "triangles": mesh.triangles.len(),
        "litres": mesh.volume() / LITRE,
        "left_out": left_out.collect::<Vec<_>>(),
    })
}

fn volume(volume: &Volume) -> Value {
    json!({
        "litres": volume.volume / LITRE,
        "uncertainty_litres": volume.uncertainty / LITRE,
        "boundary_m2": volume.area * 1e-6,
    })
}

fn cylinder(cylinder: &Cylinder) -> Value {
    json!({
        "diameter_mm": cylinder.diameter,
        "height_mm": cylinder.height(),
        "bottom_mm": cylinder.bottom,
        "top_mm": cylinder.top,
        "litres": cylinder.volume() / LITRE,
    })
}

fn influence(of: &ParameterInfluence) -> Value {
    json!({
        "arm": of.arm.index() + 1,
        "parameter": of.parameter.symbol(),
        "per": match of.parameter.kind() {
            ParameterKind::Length => "mm",
            ParameterKind::Ratio => "1",
            ParameterKind::Angle => "degree",
        },
        "rms_mm": of.rms,
        "outwards_mm": of.outwards,
        "inwards_mm": of.inwards,
        "volume_litres": of.volume / LITRE,
    })
}

fn comparison(name: &str, comparison: &Comparison) -> Value {
    let moved = comparison.displacements.iter();
    json!({
        "robot_file": name,
        "volume": volume(&comparison.after),
        "volume_change_litres": (comparison.after.volume - comparison.before.volume) / LITRE,
        "rms_mm": comparison.rms,
        "outwards_mm": comparison.outwards.map(|(moved, _)| moved),
        "inwards_mm": comparison.inwards.map(|(moved, _)| moved),
        "points_not_found": moved.filter(|moved| moved.is_none()).count(),
    })
}

fn path(path: &PathSummary) -> Value {
    let row = |row: &PathRow| {
        let point = row.point.ok()?;
        Some(json!({
            "line": row.line,
            "position_mm": point.position.data.0[0],
            "joints_deg": point.q.map(degrees),
            "singularity": point.nearest.kind.name(),
            "singularity_mm": point.nearest.distance,
            "singularity_at_mm": point.nearest.position.data.0[0],
            "serial": point.serial(),
            "parallel": point.conditioning.parallel,
        }))
    };
    let beyond = path.beyond_reach();
    let beyond = beyond.map(|(line, limit)| json!({ "line": line, "limit": limit.name() }));
    json!({
        "file": path.name,
        "rows": path.rows.iter().filter_map(row).collect::<Vec<_>>(),
        "beyond_reach": beyond.collect::<Vec<_>>(),
    })
}
