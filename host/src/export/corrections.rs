//! A grid of corrections for a controller whose kinematics is the nominal robot's.
//!
//! ```text
//! Grid ─→ Table: a correction at each node ─→ Between: what interpolation leaves ─→ Finished
//! ```

pub mod between;
pub mod choice;
pub mod extrapolation;
pub mod grid;
pub mod kind;
pub mod table;
