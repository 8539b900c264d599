//! The boundary as a closed mesh of triangles.
//!
//! Surface nets: a vertex for each sheet of the boundary in each cell of the grid, and around each
//! point of the boundary the two triangles between the four cells that share its line. The mesh is
//! closed by construction. Which of a cell's points belong to one sheet is told by its faces: two
//! points on a face are joined, and of four those beside the same reachable corner. Each vertex is then moved onto the surfaces that limit its
//! cell ([`Face::distance`](super::Face::distance)), all at once, so that edges and corners of the
//! workspace stay sharp.

use super::{BoundaryPoint, Workspace};
use crate::geometry::reach::Limit;
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::collections::BTreeMap;

/// Steps of the iteration that moves a vertex onto the surfaces; it converges in three or four.
const STEPS: usize = 8;
/// Surfaces whose normals differ by less than this are one: they do not fix a corner.
const LEAST_ANGLE: f64 = 0.05;
/// A vertex stays within so many spacings of where its cell's points are on the mean.
const LARGEST_STEP: f64 = 1.0;

/// A closed surface; seen from outside, the corners of a triangle run counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Corners, mm.
    pub vertices: Vec<Vector3<f64>>,
    /// The boundary points near each corner, as indices: those on the edges of its cell.
    pub points: Vec<Vec<usize>>,
    /// The corners of each triangle.
    pub triangles: Vec<[usize; 3]>,
    /// What limits the workspace at each triangle.
    pub limits: Vec<Limit>,
}

impl Mesh {
    /// The mesh of a workspace's boundary.
    pub fn of(workspace: &Workspace) -> Self {
        let sheets = sheets(workspace);
        let mut numbers: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (number, (cell, points)) in sheets.iter().enumerate() {
            numbers.extend(points.iter().map(|point| ((*cell, *point), number)));
        }
        let vertices: Vec<Vector3<f64>> = sheets
            .par_iter()
            .map(|(_, points)| vertex(workspace, points))
            .collect();
        let mut triangles = Vec::with_capacity(2 * workspace.points.len());
        let mut limits = Vec::with_capacity(2 * workspace.points.len());
        for (index, point) in workspace.points.iter().enumerate() {
            let around = cells_around(workspace, point);
            let [a, b, c, d] = around.map(|cell| numbers[&(cell, index)]);
            // The shorter diagonal.
            let length = |i: usize, j: usize| (vertices[i] - vertices[j]).norm_squared();
            let pair = if length(a, c) <= length(b, d) {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            };
            let turned = |[i, j, k]: [usize; 3]| if point.leaves { [i, j, k] } else { [i, k, j] };
            triangles.extend(pair.map(turned));
            limits.extend([point.limit; 2]);
        }
        Self {
            vertices,
            points: sheets.into_iter().map(|(_, points)| points).collect(),
            triangles,
            limits,
        }
    }

    /// The corners of each triangle, mm.
    pub fn corners(&self) -> impl Iterator<Item = [Vector3<f64>; 3]> + '_ {
        self.triangles
            .iter()
            .map(|triangle| triangle.map(|corner| self.vertices[corner]))
    }

    /// The mean at each corner of what is known at the boundary points; what is not known of any is
    /// NaN.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let mean = |points: &Vec<usize>| {
            let known = points
                .iter()
                .map(|point| values[*point])
                .filter(|v| v.is_finite());
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
            sum / count
        };
        self.points.iter().map(mean).collect()
    }

    /// The volume inside, by the divergence theorem: Σ a·(b × c)/6, mm³.
    pub fn volume(&self) -> f64 {
        // About a point nearby, so that less is cancelled.
        let centre = self.vertices.first().copied().unwrap_or_default();
        self.corners()
            .map(|corners| corners.map(|corner| corner - centre))
            .map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0)
            .sum()
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

/// The four cells that share a point's line, counter-clockwise seen from the line's far end.
fn cells_around(workspace: &Workspace, point: &BoundaryPoint) -> [usize; 4] {
    let (b, c) = ((point.axis + 1) % 3, (point.axis + 2) % 3);
    // The outermost nodes are not reachable, so that there is a cell on each side.
    let place = workspace.grid.place(point.node);
    [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(back_b, back_c)| {
        let mut cell = place;
        cell[b] -= back_b;
        cell[c] -= back_c;
        workspace.grid.index(cell)
    })
}

/// The sheets of the boundary in each cell, in order: the cell and the points on its edges.
fn sheets(workspace: &Workspace) -> Vec<(usize, Vec<usize>)> {
    let mut cells: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, point) in workspace.points.iter().enumerate() {
        for cell in cells_around(workspace, point) {
            cells.entry(cell).or_default().push(number);
        }
    }
    let sheets = cells.into_iter().flat_map(|(cell, points)| {
        let sheets = apart(workspace, cell, &points);
        sheets.into_iter().map(move |sheet| (cell, sheet))
    });
    sheets.collect()
}

/// The points of a cell, by sheets.
fn apart(workspace: &Workspace, cell: usize, points: &[usize]) -> Vec<Vec<usize>> {
    // Four edges of a cell at most are cut by one sheet alone: nothing to tell apart.
    if points.len() < 6 {
        return vec![points.to_vec()];
    }
    let origin = workspace.grid.place(cell);
    let at = |number: usize| {
        let point = &workspace.points[number];
        let place = workspace.grid.place(point.node);
        let back = [0, 1, 2].map(|axis| place[axis] - origin[axis]);
        // On its own axis a point lies between the faces.
        (point, back)
    };
    let mut sheets: Vec<Vec<usize>> = points.iter().map(|point| vec![*point]).collect();
    for axis in 0..3 {
        for side in 0..2 {
            let on_face = |number: &usize| {
                let (point, back) = at(*number);
                point.axis != axis && back[axis] == side
            };
            let face: Vec<usize> = points.iter().copied().filter(on_face).collect();
            if let [a, b] = face[..] {
                join(&mut sheets, a, b);
            }
            for (index, a) in face.iter().enumerate().filter(|_| face.len() == 4) {
                for b in &face[index + 1..] {
                    if reachable_end(workspace, *a) == reachable_end(workspace, *b) {
                        join(&mut sheets, *a, *b);
                    }
                }
            }
        }
    }
    sheets
}

/// The reachable node beside a point.
fn reachable_end(workspace: &Workspace, number: usize) -> [usize; 3] {
    let point = &workspace.points[number];
    let mut place = workspace.grid.place(point.node);
    place[point.axis] += usize::from(!point.leaves);
    place
}

fn join(sheets: &mut Vec<Vec<usize>>, a: usize, b: usize) {
    let of = |sheets: &[Vec<usize>], point| sheets.iter().position(|sheet| sheet.contains(point));
    if let (Some(first), Some(second)) = (of(sheets, &a), of(sheets, &b))
        && first != second
    {
        let moved = sheets.remove(first.max(second));
        sheets[first.min(second)].extend(moved);
    }
}

/// A sheet's vertex.
fn vertex(workspace: &Workspace, points: &[usize]) -> Vector3<f64> {
    let points: Vec<&BoundaryPoint> = points.iter().map(|p| &workspace.points[*p]).collect();
    let number = points.iter().fold(0.0, |count, _| count + 1.0);
    let mean = points.iter().map(|p| p.position).sum::<Vector3<f64>>() / number;
    let mut surfaces: Vec<&BoundaryPoint> = Vec::new();
    for point in points {
        if !surfaces.iter().any(|surface| surface.limit == point.limit) {
            surfaces.push(point);
        }
    }
    let mut place = mean;
    for _ in 0..STEPS {
        let Some(step) = step_onto(workspace, &surfaces, &place) else {
            return mean;
        };
        place += step;
        if !((place - mean).norm() <= LARGEST_STEP * workspace.grid.spacing) {
            return mean;
        }
        if step.norm() <= workspace.tolerance * 1e-3 {
            break;
        }
    }
    place
}

/// The shortest step onto all surfaces at once: −N⁺ d, with the normals' matrix N and distances d.
fn step_onto(
    workspace: &Workspace,
    surfaces: &[&BoundaryPoint],
    place: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut normals = DMatrix::zeros(surfaces.len(), 3);
    let mut distances = DVector::zeros(surfaces.len());
    for (row, surface) in surfaces.iter().enumerate() {
        let face = surface.face(&workspace.robot, &workspace.reach);
        let (distance, normal) = face.distance(place)?;
        normals.set_row(row, &normal.transpose());
        distances[row] = distance;
    }
    let inverse = normals.pseudo_inverse(LEAST_ANGLE).ok()?;
    let step = inverse * distances;
    Some(-Vector3::new(step[0], step[1], step[2]))
}
