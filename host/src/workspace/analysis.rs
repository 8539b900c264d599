//! Everything that is known of a robot's workspace, computed at once.

use super::{
    Cylinder, Influence, Mesh, Options, ParameterInfluence, ToleranceBand, Volume, Workspace,
    WorkspaceError, cylinders,
};
use crate::files::convention::Convention;
use crate::files::robot_file::RobotFile;
use crate::geometry::Limit;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Positions at which the distance from singularities is computed, at most.
const POSITIONS: usize = 20_000;

/// What is reported of a workspace, in the convention of the robot file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorkspaceReport {
    /// The robot file's name.
    pub robot_file: String,
    /// Every boundary point is within this distance of the boundary.
    pub tolerance_mm: f64,
    /// Between neighbouring lines.
    pub spacing_mm: f64,
    /// How many points there are.
    pub boundary_points: usize,
    /// How large it is.
    pub volume: Volume,
    /// The box that holds it.
    pub extent_mm: Extent,
    /// The share of the boundary that each limit makes, largest first.
    pub limits: Vec<LimitShare>,
    /// The upright cylinder of the largest volume, if the z axis is inside.
    pub largest_cylinder: Option<Cylinder>,
    /// The highest cylinder of each diameter, narrow to wide.
    pub cylinders: Vec<Cylinder>,
    /// What each parameter does to the boundary.
    pub influence: Vec<ParameterInfluence>,
    /// One σ of the boundary for the stated tolerance.
    pub tolerance_band: Option<ToleranceBand>,
    /// Distance from singularities inside.
    pub conditioning: Singularities,
}

/// From and to along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Extent {
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub z: (f64, f64),
}

/// A limit and its share of the boundary's area.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LimitShare {
    /// Such as `joint_maximum_1`.
    #[serde(serialize_with = "name")]
    pub kind: Limit,
    /// 0 to 1.
    pub share: f64,
}

fn name<S: Serializer>(limit: &Limit, serializer: S) -> Result<S::Ok, S::Error> {
    limit.name().serialize(serializer)
}

/// How far from singularities the robot is at evenly spaced positions inside: 0 at a singularity, 1 at best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Singularities {
    /// How many positions.
    pub positions: usize,
    /// The least of any arm, type 1.
    pub least_serial: f64,
    /// The least, type 2.
    pub least_parallel: f64,
    /// At how many positions the robot is clear of both.
    pub clear: usize,
    /// The volume in which it is.
    pub clear_litres: f64,
}

impl Singularities {
    /// The share of the workspace that is clear of both, 0 to 1.
    pub fn clear_share(&self) -> f64 {
        self.clear as f64 / self.positions.max(1) as f64
    }
}

/// A workspace, and what is reported of it.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// The convention of the robot file; only the report is in it.
    pub convention: Convention,
    /// The boundary.
    pub workspace: Workspace,
    /// The boundary as a mesh.
    pub mesh: Mesh,
    /// How it moves with the parameters.
    pub influence: Influence,
    /// What is reported.
    pub report: WorkspaceReport,
}

impl Analysis {
    /// Computes all of it. `progress` is told what is being computed.
    ///
    /// # Errors
    /// A robot without a workspace.
    pub fn compute(
        robot: &RobotFile,
        options: &Options,
        progress: &mut dyn FnMut(&'static str),
    ) -> Result<Self, WorkspaceError> {
        progress("boundary");
        let workspace = Workspace::compute(&robot.robot, &robot.reach(), options)?;
        progress("mesh");
        let mesh = Mesh::of(&workspace);
        progress("cylinders");
        let convention = robot.convention;
        let mut cylinders = cylinders(&workspace).into_iter().map(|own| {
            let [.., (bottom_mm, top_mm)] =
                convention.ranges([(0.0, 0.0), (0.0, 0.0), (own.bottom_mm, own.top_mm)]);
            Cylinder {
                bottom_mm,
                top_mm,
                ..own
            }
        });
        let largest_cylinder = cylinders.next();
        progress("influence of the parameters");
        let influence = Influence::of(&workspace);
        let tolerance = robot.tolerance.as_ref();
        let volume = workspace.volume();
        progress("singularities");
        let conditioning = singularities(&workspace, volume.litres);
        let axis = |axis| {
            (
                furthest(&workspace, axis, -1.0),
                furthest(&workspace, axis, 1.0),
            )
        };
        let [x, y, z] = convention.ranges([axis(0), axis(1), axis(2)]);
        let report = WorkspaceReport {
            robot_file: robot.name.clone(),
            tolerance_mm: workspace.tolerance,
            spacing_mm: workspace.grid.spacing,
            boundary_points: workspace.points.len(),
            volume,
            extent_mm: Extent { x, y, z },
            limits: limits(&workspace, &convention),
            largest_cylinder,
            cylinders: cylinders.collect(),
            influence: influence.of_parameters(&workspace),
            tolerance_band: tolerance.map(|tolerance| influence.within(&workspace, tolerance)),
            conditioning,
        };
        Ok(Self {
            convention,
            workspace,
            mesh,
            influence,
            report,
        })
    }
}

/// The largest coordinate along an axis, or with sign −1 the least. It lies between the lines: from the
/// outermost boundary point on, lines nearby are tried for one that leads further.
fn furthest(workspace: &Workspace, axis: usize, sign: f64) -> f64 {
    let positions = workspace.points.iter().map(|point| point.position);
    let outermost = positions.max_by(|a, b| (sign * a[axis]).total_cmp(&(sign * b[axis])));
    let Some(mut best) = outermost else {
        return f64::NAN;
    };
    let (direction, mut step) = (Vector3::ith(axis, sign), workspace.grid.spacing / 2.0);
    let [b, c] = [1, 2].map(|turn| Vector3::ith((axis + turn) % 3, 1.0));
    while step > workspace.tolerance / 16.0 {
        // Many directions: at a ridge, few lead further.
        let further = (0..32_u8).find_map(|part| {
            let (sin, cos) = (TAU * f64::from(part) / 32.0).sin_cos();
            let origin = best + (b * cos + c * sin) * step;
            let pieces = workspace.pieces(&origin, &direction, workspace.grid.spacing);
            let (_, end) = pieces.last()?;
            (*end > 0.0).then(|| origin + direction * *end)
        });
        match further {
            Some(further) => best = further,
            None => step /= 2.0,
        }
    }
    best[axis]
}

fn limits(workspace: &Workspace, convention: &Convention) -> Vec<LimitShare> {
    let mut areas: BTreeMap<Limit, f64> = BTreeMap::new();
    for point in &workspace.points {
        *areas.entry(convention.limit(point.limit)).or_default() += point.area;
    }
    let all: f64 = areas.values().sum();
    let share = |(kind, area)| LimitShare {
        kind,
        share: area / all,
    };
    let mut shares: Vec<_> = areas.into_iter().map(share).collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    shares
}

impl Workspace {
    /// How far a position is from singularities, 0 at one; `None` where it is not reachable.
    pub fn conditioning(&self, x: &Vector3<f64>) -> Option<SingularityDistance<f64>> {
        let q = self.reach.any_joints(&self.robot, x).ok()?;
        Some(self.robot.singularity_distance(x, &q))
    }
}

/// At nodes of the grid, every second or third if there are too many.
fn singularities(workspace: &Workspace, litres: f64) -> Singularities {
    let inside = |stride: usize| {
        let places = workspace.grid.places(stride);
        places
            .filter(|place| workspace.has_node(*place, 2))
            .collect::<Vec<_>>()
    };
    let strided = (1..=workspace.grid.counts.into_iter().max().unwrap_or(1))
        .map(inside)
        .find(|places| places.len() <= POSITIONS);
    let places = strided.unwrap_or_default().into_par_iter();
    let found: Vec<SingularityDistance<f64>> = places
        .filter_map(|place| workspace.conditioning(&workspace.grid.node(place)))
        .collect();
    let least_serial = found.iter().flat_map(|at| at.serial).fold(1.0, f64::min);
    let least_parallel = found.iter().map(|at| at.parallel).fold(1.0, f64::min);
    let mut singularities = Singularities {
        positions: found.len(),
        least_serial,
        least_parallel,
        clear: found.iter().filter(|at| at.is_clear()).count(),
        clear_litres: 0.0,
    };
    singularities.clear_litres = litres * singularities.clear_share();
    singularities
}
