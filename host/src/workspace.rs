//! Where the platform gets: the boundary of the reachable workspace, what limits it, how large it
//! is, and how it moves with the 24 parameters.
//!
//! ```text
//! Robot, Reach ─→ Grid (forward sweep, then which nodes are reachable) ─→ BoundaryPoint ─→ volume
//!                                         │                                   ├→ Face ─→ influence ─→ band
//!                                         └→ Mesh ─→ STL                      └→ displacement to another robot
//! Robot, Reach ─→ largest cylinders
//! Robot, pose ─→ distance from the nearest singularity
//! ```
//!
//! A position is reachable if the forward model leads to it from joint angles within the limits:
//! [`Reach::any_joints`](crate::geometry::reach::Reach::any_joints). The forward model swept over the joints' range finds the box that holds
//! the workspace; lines through it, parallel to the axes, are then bisected where they enter and
//! leave. Nothing is assumed of the workspace's shape: it may be hollow, or in several parts.

mod analysis;
mod band;
mod boundary;
mod comparison;
mod conditioning;
mod cylinder;
mod error;
mod face;
mod grid;
mod influence;
mod line;
mod mesh;
mod options;
mod path;
mod reachable;
mod singularities;
mod volume;

pub use analysis::Analysis;
pub use band::{Band, BandOptions, PointBand, TAIL, band};
pub use boundary::BoundaryPoint;
pub use comparison::displacements_to;
pub use comparison::{Comparison, compare};
pub use conditioning::{ConditionedPosition, conditioning_map};
pub use cylinder::{Cylinder, cylinders};
pub use error::WorkspaceError;
pub use face::{ByParameters, Face};
pub use grid::Grid;
pub use influence::{ParameterInfluence, influence};
pub use influence::{displacements, unit};
pub use mesh::{Mesh, Piece};
pub use options::Options;
pub use path::{PathPoint, PathRow, PathSummary, distances_of_path};
pub use reachable::Workspace;
pub use singularities::{NearestSingularity, nearest_singularity};
pub use volume::Volume;
