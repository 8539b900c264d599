//! Controllers of robots with towers. They all hold the same: one radius, and an azimuth, a rod and an end stop for
//! each tower.

pub mod case;
pub mod geometry;
pub mod level;
pub mod target;
pub mod targets;
