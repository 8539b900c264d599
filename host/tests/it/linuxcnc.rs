//! The kinematics component of LinuxCNC, compiled by LinuxCNC's compiler and asked by LinuxCNC's motion controller.

#![cfg(target_os = "linux")]

mod in_linuxcnc;
mod program;
