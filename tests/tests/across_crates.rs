//! The core together with the other crates, and campaigns over many robots.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // in tests a panic is the failure

mod accuracy;
mod campaigns;
mod controller;
mod evaluation;
mod fkm;
mod fkm_refusals;
mod link_faults;
mod robust;
mod target;
mod validation;
