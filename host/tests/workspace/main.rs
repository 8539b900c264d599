//! The reachable workspace: every claim against the forward model, closed forms, or a count.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod boundary;
mod command;
mod cylinder;
mod influence;
mod mesh;
mod robots;
mod singularities;
mod volume;
