//! The kinematics component of LinuxCNC, compiled by LinuxCNC's compiler and asked by LinuxCNC's motion controller.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod in_linuxcnc;
mod program;
