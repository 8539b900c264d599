//! The boundary as a triangle mesh, by marching cubes over the grid nodes.
//!
//! Marching cubes puts each corner in the middle of a grid edge between a node inside and one outside. It is moved to
//! the boundary point on that edge, so every corner is within the tolerance of the boundary. Sharp edges are cut off
//! within a cell.

use super::{BoundaryPoint, Workspace};
use crate::files::Convention;
use mcubes::{MarchingCubes, MeshSide};
use std::collections::HashMap;

/// Triangles as indices into [`Workspace::points`], counter-clockwise as seen from outside.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mesh(pub Vec<[usize; 3]>);

impl Mesh {
    /// The mesh of a workspace's boundary.
    #[expect(
        clippy::default_trait_access,
        reason = "mcubes does not export the type of its offset"
    )]
    pub fn of(workspace: &Workspace) -> Self {
        let grid = &workspace.grid;
        let [nx, ny, nz] = grid.counts;
        let nodes = grid.places(1);
        let values = nodes.map(|place| if workspace.has_node(place) { 1.0 } else { -1.0 });
        let one = (1.0, 1.0, 1.0);
        let cubes = MarchingCubes::new(
            (nx, ny, nz),
            one,
            one,
            Default::default(),
            values.collect(),
            0.0,
        );
        let Ok(cubes) = cubes else {
            return Self::default();
        };
        let mut at_edges = HashMap::new();
        for (index, point) in workspace.points.iter().enumerate() {
            at_edges.entry(point.edge).or_insert(index);
        }
        let corners = cubes.generate(MeshSide::InsideOnly).vertices;
        // In half spacings: the middle of an edge has one odd coordinate.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // some hundreds
        let corner = |corner: &mcubes::Vertex| {
            let at = &corner.posit;
            let edge = [at.x, at.y, at.z].map(|at| (2.0 * at) as usize);
            at_edges.get(&edge).copied()
        };
        let triangles = corners.chunks_exact(3).filter_map(|corners| {
            let [a, b, c] = [&corners[0], &corners[1], &corners[2]].map(corner);
            let triangle = [a?, b?, c?];
            let [a, b, c] = triangle;
            (a != b && b != c && c != a).then_some(triangle)
        });
        Self(triangles.collect())
    }

    /// The corners of each triangle.
    pub fn corners<'a>(
        &'a self,
        workspace: &'a Workspace,
    ) -> impl Iterator<Item = [&'a BoundaryPoint; 3]> + 'a {
        let corners = self.0.iter();
        corners.map(|triangle| triangle.map(|corner| &workspace.points[corner]))
    }

    /// The mesh as binary STL, in mm.
    #[allow(clippy::cast_possible_truncation)] // the format's numbers are single precision
    pub fn to_stl(&self, workspace: &Workspace, convention: &Convention) -> Vec<u8> {
        let mut stl = Vec::with_capacity(84 + 50 * self.0.len());
        let title = b"delta-cal: boundary of the reachable workspace, millimetres";
        stl.extend_from_slice(title);
        stl.resize(80, b' ');
        let count = u32::try_from(self.0.len()).unwrap_or(u32::MAX);
        stl.extend_from_slice(&count.to_le_bytes());
        for corners in self.corners(workspace) {
            let [a, b, c] = corners.map(|corner| convention.vector(&corner.position));
            let normal = (b - a)
                .cross(&(c - a))
                .try_normalize(0.0)
                .unwrap_or_default();
            for number in [normal, a, b, c].iter().flat_map(|vector| vector.iter()) {
                stl.extend_from_slice(&(*number as f32).to_le_bytes());
            }
            stl.extend_from_slice(&[0, 0]);
        }
        stl
    }
}
