//! The vertex of a sheet: on all surfaces that limit the workspace in its cell.

use crate::geometry::reach::Limit;
use crate::workspace::boundary::{BoundaryPoint, bisect, what_stops};
use crate::workspace::face::{Face, branch};
use crate::workspace::reachable::Workspace;
use delta_cal::ArmIndex;
use nalgebra::{DMatrix, DVector, Vector3};

/// Steps of the iteration that moves a vertex onto the surfaces; it converges in three or four.
const STEPS: usize = 8;
/// Surfaces whose normals are nearer to one plane or line than this (a singular value) do not fix an edge or a
/// corner.
const LEAST_ANGLE: f64 = 0.02;
/// A vertex stays within so many spacings of its sheet's crossings.
const LARGEST_STEP: f64 = 2.0;
/// A vertex is tested at this part of the tolerance from it; the rest remains for moving equal vertices apart.
const PART: f64 = 0.5;

/// A surface and joint angles nearby.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    limit: Limit,
    q: [f64; 3],
}

/// A vertex and the surfaces that it lies on.
#[derive(Debug, Clone)]
pub(super) struct Vertex {
    pub(super) position: Vector3<f64>,
    pub(super) surfaces: Vec<Surface>,
    outward: Vector3<f64>,
}

/// One name for one surface: the forearms lie in one plane whichever of them is said to.
pub(super) const fn surface_of(limit: Limit) -> Limit {
    match limit {
        Limit::Parallel(_) => Limit::Parallel(ArmIndex::First),
        Limit::Unreachable(arm) => Limit::Serial(arm),
        limit => limit,
    }
}

impl Surface {
    fn face<'a>(&self, workspace: &'a Workspace) -> Face<'a> {
        Face {
            robot: &workspace.robot,
            reach: &workspace.reach,
            limit: self.limit,
            q: self.q,
        }
    }
}

impl Vertex {
    /// The vertex of the sheet with these crossings, on so many surfaces at most.
    pub(super) fn of(workspace: &Workspace, points: &[&BoundaryPoint], most: usize) -> Self {
        let count = points.iter().fold(0.0, |count, _| count + 1.0);
        let mean = points.iter().map(|p| p.position).sum::<Vector3<f64>>() / count;
        let mut surfaces: Vec<Surface> = Vec::new();
        for point in points {
            add(&mut surfaces, point.limit, point.q);
        }
        let single = surfaces.iter().map(|surface| vec![*surface]);
        let choices = std::iter::once(surfaces.clone()).chain(single);
        let mut found = choices
            .filter(|surfaces| surfaces.len() <= most)
            .filter_map(|surfaces| Self::with_missing(workspace, surfaces, &mean, most));
        found
            .next()
            .unwrap_or_else(|| Self::beside(workspace, points, &mean))
    }

    /// The same, moved along its surfaces towards `to`; `None` if the boundary is not there.
    pub(super) fn moved(&self, workspace: &Workspace, to: &Vector3<f64>) -> Option<Self> {
        Self::on(workspace, &self.surfaces, to).and_then(Result::ok)
    }

    /// As a point that stands for no area.
    pub(super) fn point(&self, workspace: &Workspace) -> BoundaryPoint {
        let Surface { limit, q } = self.surfaces[0];
        BoundaryPoint {
            position: self.position,
            limit,
            outward: self.outward,
            area: 0.0,
            q: branch(&workspace.robot, &self.position, &q).unwrap_or(q),
        }
    }

    /// On these surfaces, and on those besides that keep the platform from the inside of them.
    fn with_missing(
        workspace: &Workspace,
        mut surfaces: Vec<Surface>,
        from: &Vector3<f64>,
        most: usize,
    ) -> Option<Self> {
        loop {
            match Self::on(workspace, &surfaces, from)? {
                Ok(vertex) => return Some(vertex),
                Err(limit) => {
                    let q = surfaces[0].q;
                    if surfaces.len() >= most || !add(&mut surfaces, limit, q) {
                        return None;
                    }
                }
            }
        }
    }

    /// On all of these surfaces, near `from`; an error if something else keeps the platform from there.
    fn on(
        workspace: &Workspace,
        surfaces: &[Surface],
        from: &Vector3<f64>,
    ) -> Option<Result<Self, Limit>> {
        let mut position = *from;
        for _ in 0..STEPS {
            let (step, _) = step_onto(workspace, surfaces, &position)?;
            position += step;
            if !((position - from).norm() <= LARGEST_STEP * workspace.grid.spacing) {
                return None;
            }
            if step.norm() <= workspace.tolerance * 1e-3 {
                break;
            }
        }
        let (_, inwards) = step_onto(workspace, surfaces, &position)?;
        let normals = surfaces
            .iter()
            .map(|surface| Some(surface.face(workspace).distance(&position)?.1));
        let normals: Vec<Vector3<f64>> = normals.collect::<Option<_>>()?;
        let step = workspace.tolerance * PART;
        let inside = position + inwards * step;
        let reached = workspace.contains(&inside);
        let around = |direction: &Vector3<f64>| {
            [
                workspace.contains(&(position + direction * step)),
                workspace.contains(&(position - direction * step)),
            ]
        };
        let (mut any, mut all) = (reached, reached);
        for normal in &normals {
            for inside in around(normal) {
                any |= inside;
                all &= inside;
            }
        }
        if any && !all {
            return Some(Ok(Self {
                position,
                surfaces: surfaces.to_vec(),
                outward: normals[0],
            }));
        }
        if any {
            return None;
        }
        let q = branch(&workspace.robot, &inside, &surfaces[0].q).unwrap_or(surfaces[0].q);
        Some(Err(what_stops(
            &workspace.robot,
            &workspace.reach,
            &q,
            &inside,
        )))
    }

    /// On the boundary at the crossing next to the mean, away from it as far as the tolerance allows: the sheets
    /// about a crossing have a vertex each.
    fn beside(workspace: &Workspace, points: &[&BoundaryPoint], mean: &Vector3<f64>) -> Self {
        let nearest = points.iter().copied().min_by(|a, b| {
            let off = |point: &BoundaryPoint| (point.position - mean).norm();
            off(a).total_cmp(&off(b))
        });
        let point = nearest.unwrap_or(points[0]);
        let reach = workspace.grid.spacing;
        let outwards = points.iter().map(|p| p.outward).sum::<Vector3<f64>>();
        let outwards = outwards.try_normalize(1e-6).unwrap_or(point.outward);
        let ends = (mean - outwards * reach, mean + outwards * reach);
        let is_inside = |x: &Vector3<f64>| workspace.contains(x);
        let position = if is_inside(&ends.0) && !is_inside(&ends.1) {
            bisect(is_inside, ends, workspace.tolerance / 16.0).0
        } else {
            let towards = (mean - point.position).try_normalize(0.0);
            point.position + towards.unwrap_or_default() * (workspace.tolerance * PART * 0.5)
        };
        Self {
            position,
            surfaces: vec![Surface {
                limit: point.limit,
                q: point.q,
            }],
            outward: point.outward,
        }
    }

    /// Whether it lies on all surfaces of another.
    pub(super) fn shares(&self, limit: Limit) -> bool {
        let surface = surface_of(limit);
        self.limits().any(|own| own == surface)
    }

    /// The surfaces that it lies on.
    pub(super) fn limits(&self) -> impl Iterator<Item = Limit> + '_ {
        self.surfaces.iter().map(|own| surface_of(own.limit))
    }
}

/// Adds a surface if it is a new one.
fn add(surfaces: &mut Vec<Surface>, limit: Limit, q: [f64; 3]) -> bool {
    let surface = surface_of(limit);
    let is_new = surfaces
        .iter()
        .all(|known| surface_of(known.limit) != surface);
    if is_new {
        surfaces.push(Surface { limit, q });
    }
    is_new
}

/// The shortest step onto all surfaces at once, −N⁺ d with the normals' matrix N and distances d, and the direction
/// that leads inwards of all of them.
fn step_onto(
    workspace: &Workspace,
    surfaces: &[Surface],
    position: &Vector3<f64>,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mut normals = DMatrix::zeros(surfaces.len(), 3);
    let mut distances = DVector::zeros(surfaces.len());
    for (row, surface) in surfaces.iter().enumerate() {
        let (distance, normal) = surface.face(workspace).distance(position)?;
        if surfaces.len() == 1 {
            return Some((normal * -distance, -normal));
        }
        normals.set_row(row, &normal.transpose());
        distances[row] = distance;
    }
    let inverse = normals.pseudo_inverse(LEAST_ANGLE).ok()?;
    let step = &inverse * distances;
    let inwards = inverse.column_sum();
    let inwards = Vector3::new(inwards[0], inwards[1], inwards[2]);
    Some((
        -Vector3::new(step[0], step[1], step[2]),
        -inwards.try_normalize(0.0)?,
    ))
}
