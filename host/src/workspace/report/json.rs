//! The figures for programs. Millimetres, degrees, litres.

use super::Analysis;
use crate::units::degrees;
use crate::workspace::{Cylinder, Volume};
use delta_cal::robot::ParameterKind;
use nalgebra::Vector3;
use serde::Serialize;

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole of it.
#[derive(Debug, Serialize)]
struct Report {
    schema_version: u32,
    program_version: &'static str,
    robot_file: String,
    tolerance_mm: f64,
    spacing_mm: f64,
    boundary_points: usize,
    volume: JsonVolume,
    extent_mm: Extent,
    limits: Vec<Share>,
    largest_cylinder: Option<JsonCylinder>,
    cylinders: Vec<JsonCylinder>,
    influence: Vec<Influence>,
    tolerance_band: Option<Band>,
    comparison: Option<Comparison>,
    conditioning: SingularityDistances,
    path: Option<Path>,
}

#[derive(Debug, Serialize)]
struct JsonVolume {
    litres: f64,
    uncertainty_litres: f64,
    boundary_m2: f64,
}

#[derive(Debug, Serialize)]
struct Extent {
    x: [f64; 2],
    y: [f64; 2],
    z: [f64; 2],
}

#[derive(Debug, Serialize)]
struct Share {
    kind: String,
    share: f64,
}

#[derive(Debug, Serialize)]
struct JsonCylinder {
    diameter_mm: f64,
    height_mm: f64,
    bottom_mm: f64,
    top_mm: f64,
    litres: f64,
}

#[derive(Debug, Serialize)]
struct Influence {
    arm: usize,
    parameter: &'static str,
    per: &'static str,
    rms_mm: f64,
    outwards_mm: f64,
    inwards_mm: f64,
    volume_litres: f64,
}

#[derive(Debug, Serialize)]
struct Band {
    robots: u32,
    seed: u64,
    points: usize,
    sigma_mm: f64,
    largest_sigma_mm: f64,
    p05_rms_mm: f64,
    p95_rms_mm: f64,
    volume_sigma_litres: f64,
}

#[derive(Debug, Serialize)]
struct Comparison {
    robot_file: String,
    volume: JsonVolume,
    volume_change_litres: f64,
    rms_mm: f64,
    outwards_mm: Option<f64>,
    inwards_mm: Option<f64>,
    points_not_found: usize,
}

#[derive(Debug, Serialize)]
struct SingularityDistances {
    positions: usize,
    least_serial: f64,
    least_parallel: f64,
    clear: usize,
}

#[derive(Debug, Serialize)]
struct Path {
    file: String,
    rows: Vec<Row>,
    beyond_reach: Vec<Beyond>,
}

#[derive(Debug, Serialize)]
struct Row {
    line: u64,
    position_mm: [f64; 3],
    joints_deg: [f64; 3],
    singularity: String,
    singularity_mm: f64,
    singularity_at_mm: [f64; 3],
    serial: f64,
    parallel: f64,
}

#[derive(Debug, Serialize)]
struct Beyond {
    line: u64,
    limit: String,
}

/// mm³ in a litre.
const LITRE: f64 = 1e6;

fn volume(volume: &Volume) -> JsonVolume {
    JsonVolume {
        litres: volume.volume / LITRE,
        uncertainty_litres: volume.uncertainty / LITRE,
        boundary_m2: volume.area * 1e-6,
    }
}

fn cylinder(cylinder: &Cylinder) -> JsonCylinder {
    JsonCylinder {
        diameter_mm: cylinder.diameter,
        height_mm: cylinder.height(),
        bottom_mm: cylinder.bottom,
        top_mm: cylinder.top,
        litres: cylinder.volume() / LITRE,
    }
}

fn array(vector: &Vector3<f64>) -> [f64; 3] {
    vector.data.0[0]
}

/// As text.
///
/// # Errors
/// What the writer says; nothing is known to fail.
pub fn to_text(analysis: &Analysis) -> Result<String, serde_json::Error> {
    let [x, y, z] = analysis.extent().map(|(from, to)| [from, to]);
    let report = Report {
        schema_version: SCHEMA_VERSION,
        program_version: env!("CARGO_PKG_VERSION"),
        robot_file: analysis.name.clone(),
        tolerance_mm: analysis.workspace.tolerance,
        spacing_mm: analysis.workspace.grid.spacing,
        boundary_points: analysis.workspace.points.len(),
        volume: volume(&analysis.volume),
        extent_mm: Extent { x, y, z },
        limits: analysis
            .limits()
            .into_iter()
            .map(|(limit, share)| Share {
                kind: limit.name(),
                share,
            })
            .collect(),
        largest_cylinder: analysis.cylinders.first().map(cylinder),
        cylinders: analysis.cylinders.iter().skip(1).map(cylinder).collect(),
        influence: influences(analysis),
        tolerance_band: band(analysis),
        comparison: comparison(analysis),
        conditioning: SingularityDistances {
            positions: analysis.conditioning.len(),
            least_serial: least(analysis, crate::workspace::ConditionedPosition::serial),
            least_parallel: least(analysis, |at| at.conditioning.parallel),
            clear: analysis
                .conditioning
                .iter()
                .filter(|at| at.conditioning.is_clear())
                .count(),
        },
        path: path(analysis),
    };
    serde_json::to_string_pretty(&report).map(|text| text + "\n")
}

fn least(analysis: &Analysis, value: fn(&crate::workspace::ConditionedPosition) -> f64) -> f64 {
    analysis.conditioning.iter().map(value).fold(1.0, f64::min)
}

fn influences(analysis: &Analysis) -> Vec<Influence> {
    let influence = |of: &crate::workspace::ParameterInfluence| Influence {
        arm: of.arm.index() + 1,
        parameter: of.parameter.symbol(),
        per: match of.parameter.kind() {
            ParameterKind::Length => "mm",
            ParameterKind::Angle => "degree",
        },
        rms_mm: of.rms,
        outwards_mm: of.outwards,
        inwards_mm: of.inwards,
        volume_litres: of.volume / LITRE,
    };
    analysis.influence.iter().map(influence).collect()
}

fn band(analysis: &Analysis) -> Option<Band> {
    let band = analysis.band.as_ref()?;
    Some(Band {
        robots: band.options.robots,
        seed: band.options.seed,
        points: band.points.len(),
        sigma_mm: band.sigma,
        largest_sigma_mm: band.largest_sigma,
        p05_rms_mm: band.low_rms(),
        p95_rms_mm: band.high_rms(),
        volume_sigma_litres: band.volume_sigma / LITRE,
    })
}

fn comparison(analysis: &Analysis) -> Option<Comparison> {
    let (name, comparison) = analysis.comparison.as_ref()?;
    let not_found = comparison
        .displacements
        .iter()
        .filter(|moved| moved.is_none());
    Some(Comparison {
        robot_file: name.clone(),
        volume: volume(&comparison.after),
        volume_change_litres: (comparison.after.volume - comparison.before.volume) / LITRE,
        rms_mm: comparison.rms,
        outwards_mm: comparison.outwards.map(|(moved, _)| moved),
        inwards_mm: comparison.inwards.map(|(moved, _)| moved),
        points_not_found: not_found.count(),
    })
}

fn path(analysis: &Analysis) -> Option<Path> {
    let path = analysis.path.as_ref()?;
    let row = |row: &crate::workspace::PathRow| {
        let point = row.point.ok()?;
        Some(Row {
            line: row.line,
            position_mm: array(&point.position),
            joints_deg: point.q.map(degrees),
            singularity: point.nearest.kind.name(),
            singularity_mm: point.nearest.distance,
            singularity_at_mm: array(&point.nearest.position),
            serial: point.conditioning.serial.into_iter().fold(1.0, f64::min),
            parallel: point.conditioning.parallel,
        })
    };
    Some(Path {
        file: path.name.clone(),
        rows: path.rows.iter().filter_map(row).collect(),
        beyond_reach: path
            .beyond_reach()
            .map(|(line, limit)| Beyond {
                line,
                limit: limit.name(),
            })
            .collect(),
    })
}
