//! The complete analysis of a robot's workspace.

use super::grid::PART;
use super::{
    Cylinder, Influence, Mesh, Options, ParameterInfluence, ToleranceBand, Volume, Workspace,
    WorkspaceError, cylinders,
};
use crate::cores;
use crate::files::{Convention, RobotFile};
use crate::geometry::Limit;
use crate::order;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Most positions at which the distance from singularities is evaluated.
const POSITIONS: usize = 20_000;

/// A workspace with its analysis. What is serialised is in the robot file's convention.
#[derive(Debug, Clone, Serialize)]
pub struct Analysis {
    /// The robot file's name.
    pub robot_file: String,
    /// Every boundary point is within this distance of the boundary.
    pub tolerance_mm: f64,
    /// Distance between neighbouring lines.
    pub spacing_mm: f64,
    /// Number of boundary points.
    pub boundary_points: usize,
    /// Volume and area.
    pub volume: Volume,
    /// Bounding box.
    pub extent_mm: Extent,
    /// Share of the boundary due to each limit, largest first.
    pub limits: Vec<LimitShare>,
    /// The upright cylinder of largest volume; `None` if the z axis is outside.
    pub largest_cylinder: Option<Cylinder>,
    /// The tallest cylinder of each diameter, in ascending order.
    pub cylinders: Vec<Cylinder>,
    /// Influence of each parameter on the boundary.
    pub influence: Vec<ParameterInfluence>,
    /// Uncertainty (σ) of the boundary for the stated tolerance.
    pub tolerance_band: Option<ToleranceBand>,
    /// Distance from singularities inside the workspace.
    pub conditioning: Singularities,
    /// The robot file's convention; only `report` uses it.
    #[serde(skip)]
    pub convention: Convention,
    /// The boundary.
    #[serde(skip)]
    pub workspace: Workspace,
    /// The boundary as a mesh.
    #[serde(skip)]
    pub mesh: Mesh,
    /// How the boundary moves with the parameters.
    #[serde(skip)]
    pub displacements: Influence,
}

/// Range along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Extent {
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub z: (f64, f64),
}

/// A limit and its share of the boundary's area.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitShare {
    /// The limit, such as `joint_maximum_1`.
    pub kind: String,
    /// Share, 0 to 1.
    pub share: f64,
}

/// Distance from singularities over evenly spaced positions inside: 0 is singular, 1 is best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Singularities {
    /// Number of positions.
    pub positions: usize,
    /// Smallest value of any arm, type 1.
    pub least_serial: f64,
    /// Smallest value, type 2.
    pub least_parallel: f64,
    /// Number of positions clear of both types.
    pub clear: usize,
    /// Volume clear of both types.
    pub clear_litres: f64,
}

impl Singularities {
    /// Share of the workspace clear of both types, 0 to 1.
    pub fn clear_share(&self) -> f64 {
        self.clear as f64 / self.positions.max(1) as f64
    }
}

impl Analysis {
    /// Runs the analysis. `progress` receives the name of each step.
    ///
    /// # Errors
    /// The workspace is empty or cannot be resolved.
    pub fn compute(
        robot: &RobotFile,
        options: &Options,
        progress: &mut dyn FnMut(&'static str),
    ) -> Result<Self, WorkspaceError> {
        progress("boundary");
        let workspace = Workspace::compute(&robot.robot, &robot.reach(), options)?;
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
        let displacements = Influence::of(&workspace);
        let tolerance = robot.tolerance.as_ref();
        let volume = workspace.volume();
        progress("singularities");
        let conditioning = singularities(&workspace, volume.litres);
        progress("mesh");
        let mesh = Mesh::of(&workspace);
        let along = |axis| {
            let end = |sign| furthest(&workspace, axis, sign);
            (end(-1.0), end(1.0))
        };
        let [x, y, z] = convention.ranges([along(0), along(1), along(2)]);
        Ok(Self {
            robot_file: robot.name.clone(),
            tolerance_mm: workspace.tolerance,
            spacing_mm: workspace.grid.spacing,
            boundary_points: workspace.points.len(),
            volume,
            extent_mm: Extent { x, y, z },
            limits: limits(&workspace, &convention),
            largest_cylinder,
            cylinders: cylinders.collect(),
            influence: displacements.of_parameters(&workspace, &convention),
            tolerance_band: tolerance.map(|own| displacements.within(&workspace, own)),
            conditioning,
            convention,
            mesh,
            workspace,
            displacements,
        })
    }
}

/// The largest coordinate along an axis, or the smallest for sign −1. The extreme lies between grid lines: starting at
/// the outermost boundary point, nearby lines are searched for one that reaches further.
fn furthest(workspace: &Workspace, axis: usize, sign: f64) -> f64 {
    let positions = workspace.points.iter().map(|point| point.position);
    let outermost = positions.max_by(|a, b| (sign * a[axis]).total_cmp(&(sign * b[axis])));
    let Some(mut best) = outermost else {
        return f64::NAN;
    };
    let (direction, mut step) = (Vector3::ith(axis, sign), workspace.grid.spacing / 2.0);
    let [b, c] = [1, 2].map(|turn| Vector3::ith((axis + turn) % 3, 1.0));
    while step > workspace.tolerance / 16.0 {
        // Try many directions: at a ridge, few reach further.
        let further = (0..32_u8).find_map(|part| {
            let (sin, cos) = (TAU * f64::from(part) / 32.0).sin_cos();
            let origin = best + (b * cos + c * sin) * step;
            let pieces = workspace.pieces(&origin, &direction, workspace.grid.spacing);
            let (_, end) = pieces.last()?;
            (*end > workspace.tolerance * PART).then(|| origin + direction * *end)
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
    let share = |(kind, area): (Limit, f64)| LimitShare {
        kind: kind.name(),
        share: area / all,
    };
    let mut shares: Vec<_> = areas.into_iter().map(share).collect();
    order::sort_by(&mut shares, |own| -own.share);
    shares
}

/// Evaluated at grid nodes, with a stride if there are more than [`POSITIONS`].
fn singularities(workspace: &Workspace, litres: f64) -> Singularities {
    let Workspace {
        robot, reach, grid, ..
    } = workspace;
    let inside = |stride: usize| {
        let places = grid
            .places(stride)
            .filter(|place| workspace.has_node(*place));
        places.collect::<Vec<_>>()
    };
    let mut strided = (1..).map(inside);
    let places = strided.find(|places| places.len() <= POSITIONS);
    let found = cores::map(places.unwrap_or_default(), |place| {
        let x = grid.node(place);
        let q = reach.any_joints(robot, &x).ok()?;
        Some(robot.singularity_distance(&x, &q))
    });
    let found: Vec<SingularityDistance<f64>> = found.into_iter().flatten().collect();
    let mut singularities = Singularities {
        positions: found.len(),
        least_serial: found.iter().flat_map(|at| at.serial).fold(1.0, f64::min),
        least_parallel: found.iter().map(|at| at.parallel).fold(1.0, f64::min),
        clear: found.iter().filter(|at| at.is_clear()).count(),
        clear_litres: 0.0,
    };
    singularities.clear_litres = litres * singularities.clear_share();
    singularities
}
