//! The boundary as one closed mesh of triangles.
//!
//! Dual contouring: a vertex for each sheet of the boundary in each cell of the lattice, and around each of its
//! crossings two triangles between the four sheets that meet there. Each vertex lies on all surfaces that limit
//! the workspace in its cell ([`Face::distance`](super::Face::distance)), so that edges and corners stay sharp.
//!
//! ```text
//! Workspace ─→ Lattice ─→ Crossing ─→ Sheets ─→ Vertex, evened ─→ triangles ─→ the largest piece
//! ```

mod collapse;
mod lattice;
mod piece;
mod sheets;
mod vertex;

use super::{BoundaryPoint, Workspace};
use crate::geometry::reach::Limit;
use lattice::{Crossing, Lattice};
use nalgebra::Vector3;
pub use piece::Piece;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use sheets::Sheets;
use std::collections::BTreeSet;
use vertex::Vertex;

/// Surfaces of a vertex at most.
const MOST: usize = 4;
/// Corners nearer than this part of the spacing are one.
const NEAR: f64 = 0.01;
/// Edges shorter than this part of the spacing are taken out.
const SHORTEST: f64 = 0.1;
/// Vertices at one place are moved by this part of the tolerance.
const APART: f64 = 0.25;
/// Times that vertices are moved towards the mean of their neighbours.
const EVENED: usize = 4;

/// A closed surface; seen from outside, the corners of a triangle run counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Corners; the area of each is a third of that of its triangles.
    pub vertices: Vec<BoundaryPoint>,
    /// The corners of each triangle.
    pub triangles: Vec<[usize; 3]>,
    /// What limits the workspace at each triangle.
    pub limits: Vec<Limit>,
    /// What the mesh leaves out: pieces that are not connected with it, largest first.
    pub left_out: Vec<Piece>,
}

impl Mesh {
    /// The mesh of a workspace's boundary.
    pub fn of(workspace: &Workspace) -> Self {
        let lattice = Lattice::of(workspace);
        let crossings = lattice.crossings();
        let sheets = Sheets::of(&lattice, &crossings);
        let vertices = evened(workspace, vertices(workspace, &crossings, &sheets), &sheets);
        let positions: Vec<Vector3<f64>> = vertices.iter().map(|vertex| vertex.position).collect();
        let mut triangles = Vec::with_capacity(2 * crossings.len());
        let mut limits = Vec::with_capacity(2 * crossings.len());
        for (crossing, around) in crossings.iter().zip(&sheets.around) {
            for triangle in halves(&vertices, *around) {
                let [i, j, k] = triangle;
                triangles.push(if crossing.leaves {
                    [i, j, k]
                } else {
                    [i, k, j]
                });
                limits.push(limit_of(&vertices, triangle, crossing));
            }
        }
        let ranks: Vec<usize> = vertices
            .iter()
            .map(|vertex| vertex.surfaces.len())
            .collect();
        let least = SHORTEST * workspace.grid.spacing;
        let (numbers, triangles): (Vec<usize>, Vec<[usize; 3]>) =
            collapse::collapsed(&positions, &ranks, &triangles, least)
                .into_iter()
                .unzip();
        let (kept, left_out) = piece::apart(&positions, &triangles);
        let mut kept_numbers = vec![None; vertices.len()];
        let mut mesh = Self {
            vertices: Vec::new(),
            triangles: Vec::with_capacity(kept.len()),
            limits: kept.iter().map(|number| limits[numbers[*number]]).collect(),
            left_out,
        };
        for number in kept {
            let triangle = triangles[number].map(|corner| {
                *kept_numbers[corner].get_or_insert_with(|| {
                    mesh.vertices.push(vertices[corner].point(workspace));
                    mesh.vertices.len() - 1
                })
            });
            mesh.triangles.push(triangle);
        }
        mesh.tell_apart(workspace.tolerance * APART);
        mesh.weigh();
        mesh
    }

    /// Moves vertices apart that would be the same point in single precision, as STL files have it.
    #[allow(clippy::cast_possible_truncation)] // that is what is compared
    fn tell_apart(&mut self, step: f64) {
        let mut seen = BTreeSet::new();
        for vertex in &mut self.vertices {
            let bits =
                |at: &Vector3<f64>| -> [u32; 3] { at.map(|at| (at as f32).to_bits()).into() };
            let positions = [0.0, -1.0, 1.0, -0.5, 0.5];
            let mut positions =
                positions.map(|way| vertex.position + vertex.outward * (way * step));
            if let Some(free) = positions.iter_mut().find(|at| seen.insert(bits(at))) {
                vertex.position = *free;
            }
        }
    }

    /// Gives each vertex a third of its triangles' areas.
    fn weigh(&mut self) {
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| self.vertices[corner].position);
            for corner in triangle {
                self.vertices[*corner].area += (b - a).cross(&(c - a)).norm() / 6.0;
            }
        }
    }

    /// The corners of each triangle, mm.
    pub fn corners(&self) -> impl Iterator<Item = [Vector3<f64>; 3]> + '_ {
        self.triangles
            .iter()
            .map(|triangle| triangle.map(|corner| self.vertices[corner].position))
    }

    /// The volume inside, mm³.
    pub fn volume(&self) -> f64 {
        piece::volume(self.corners())
    }

    /// As binary STL, in mm.
    #[allow(clippy::cast_possible_truncation)] // the format's numbers are single precision
    pub fn to_stl(&self) -> Vec<u8> {
        let mut stl = Vec::with_capacity(84 + 50 * self.triangles.len());
        let mut header = [b' '; 80];
        let title = b"delta-cal: boundary of the reachable workspace, millimetres";
        header[..title.len()].copy_from_slice(title);
        stl.extend_from_slice(&header);
        let count = u32::try_from(self.triangles.len()).unwrap_or(u32::MAX);
        stl.extend_from_slice(&count.to_le_bytes());
        for [a, b, c] in self.corners() {
            let normal = (b - a).cross(&(c - a));
            let length = normal.norm();
            let normal = if length > 0.0 {
                normal / length
            } else {
                normal
            };
            for number in [normal, a, b, c].iter().flat_map(|vector| vector.iter()) {
                stl.extend_from_slice(&(*number as f32).to_le_bytes());
            }
            stl.extend_from_slice(&[0, 0]);
        }
        stl
    }
}

/// The vertex of each sheet. A corner of the workspace belongs to one sheet; the vertices of other sheets near it are
/// moved onto an edge.
fn vertices(workspace: &Workspace, crossings: &[Crossing], sheets: &Sheets) -> Vec<Vertex> {
    let vertex = |sheet: &Vec<usize>, most: usize| {
        let points: Vec<&BoundaryPoint> = sheet.iter().map(|at| &crossings[*at].point).collect();
        Vertex::of(workspace, &points, most)
    };
    let of_sheets = sheets.crossings.par_iter();
    let mut vertices: Vec<Vertex> = of_sheets.map(|sheet| vertex(sheet, MOST)).collect();
    let (mut corners, same) = (BTreeSet::new(), NEAR * workspace.grid.spacing);
    let at_corners = vertices.iter_mut().zip(&sheets.crossings);
    for (at_corner, sheet) in at_corners.filter(|(vertex, _)| vertex.surfaces.len() > 2) {
        #[allow(clippy::cast_possible_truncation)] // some millions
        let place: [i64; 3] = at_corner
            .position
            .map(|at| (at / same).round() as i64)
            .into();
        if !corners.insert(place) {
            *at_corner = vertex(sheet, 2);
        }
    }
    vertices
}

/// The vertices, each moved several times towards the mean of its neighbours: vertices at an edge of the workspace move
/// along it, and those at a corner do not move. So the vertices along a sharp rim are in the right order.
fn evened(workspace: &Workspace, mut vertices: Vec<Vertex>, sheets: &Sheets) -> Vec<Vertex> {
    let mut neighbours = vec![Vec::new(); vertices.len()];
    for around in &sheets.around {
        for at in 0..4 {
            let (one, other) = (around[at], around[(at + 1) % 4]);
            neighbours[one].push(other);
            neighbours[other].push(one);
        }
    }
    let at_edge = |number: &usize| vertices[*number].surfaces.len() > 1;
    let near_edges: Vec<bool> = (0..vertices.len())
        .map(|number| at_edge(&number) || neighbours[number].iter().any(at_edge))
        .collect();
    for _ in 0..EVENED {
        vertices = (0..vertices.len())
            .into_par_iter()
            .map(|number| {
                let vertex = &vertices[number];
                if !near_edges[number] {
                    return vertex.clone();
                }
                let along = neighbours[number].iter().map(|other| &vertices[*other]);
                let along = along.filter(|other| vertex.limits().all(|limit| other.shares(limit)));
                let (mut sum, mut count) = (Vector3::zeros(), 0.0);
                for other in along {
                    sum += other.position;
                    count += 1.0;
                }
                if vertex.surfaces.len() > 2 || count < 2.0 {
                    return vertex.clone();
                }
                let to = (vertex.position + sum / count) * 0.5;
                vertex
                    .moved(workspace, &to)
                    .unwrap_or_else(|| vertex.clone())
            })
            .collect();
    }
    vertices
}

/// The two triangles about a crossing: divided along an edge of the workspace if there is one, and otherwise along the
/// shorter diagonal.
fn halves(vertices: &[Vertex], [a, b, c, d]: [usize; 4]) -> [[usize; 3]; 2] {
    let ways = [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
    let flat = ways.map(|way| {
        way.iter()
            .filter(|half| shared(vertices, **half).is_some())
            .count()
    });
    let length = |i: usize, j: usize| (vertices[i].position - vertices[j].position).norm_squared();
    if flat[0] > flat[1] || flat[0] == flat[1] && length(a, c) <= length(b, d) {
        ways[0]
    } else {
        ways[1]
    }
}

/// The surface on which all corners of a triangle lie.
fn shared(vertices: &[Vertex], [i, j, k]: [usize; 3]) -> Option<Limit> {
    let mut limits = vertices[i].limits();
    limits.find(|limit| vertices[j].shares(*limit) && vertices[k].shares(*limit))
}

/// What limits the workspace at a triangle about a crossing.
fn limit_of(vertices: &[Vertex], triangle: [usize; 3], crossing: &Crossing) -> Limit {
    let limit = crossing.point.limit;
    if triangle
        .iter()
        .all(|corner| vertices[*corner].shares(limit))
    {
        return limit;
    }
    shared(vertices, triangle).unwrap_or(limit)
}
