//! The reachable workspace: every claim against the forward model, closed forms, or a count.

mod boundary;
mod command;
mod cylinder;
mod influence;
mod mesh;
mod robots;
mod singularities;
mod volume;
