//! The check for programs.

use crate::accuracy::sampled::{MANY, shown};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::CalibrationMethod;
use crate::planning::observability::{Block, Leverage, Observability};
use crate::planning::poses::{Expectation, NextPoses};
use crate::render::json;
use crate::report::plan::json::{assumptions, pose};
use crate::text::joint;
use delta_cal::robot::Drive;
use serde_json::{Value, json};

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole check. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
pub fn report(
    robot: &RobotFile,
    samples: &SamplesFile,
    unmeasured: &[u64],
    method: CalibrationMethod,
    observability: &Observability,
    next: &NextPoses,
) -> Value {
    let (leverages, sampled) = leverages(robot.robot.drive(), &observability.leverages);
    let sigma = |expectation: &Option<Expectation>| {
        let expectation = expectation.as_ref();
        expectation.map(|expectation| expectation.workspace.rms)
    };
    let contents = json!({
        "robot_file": robot.name,
        "samples_file": samples.name,
        // `joint`, `ikm` or `fkm`.
        "method": method.name(),
        // What the samples were judged for.
        "assumptions": assumptions(robot.robot.drive(), &observability.assumptions),
        // Whether they determine every parameter.
        "determined": observability.determined(),
        // In one sentence.
        "verdict": super::table::verdict(observability, samples, unmeasured),
        // The lines of the rows that hold no measured position.
        "unmeasured_lines": unmeasured,
        // The three arms with `ikm`, otherwise the whole robot.
        "blocks": observability.blocks.iter().map(block).collect::<Vec<_>>(),
        // Each sample's, in the file's order; of more than 10,000 the largest, and others spread evenly.
        "leverages": leverages,
        // How many of how many samples `leverages` holds; `null` if all.
        "sampled": sampled,
        // The poses that are best added, one after the other.
        "next": next.poses.iter().map(|own| pose(robot.robot.drive(), own)).collect::<Vec<_>>(),
        // Why there is none; `null` where some are proposed or none was asked for.
        "no_next": next.obstacle.map(|obstacle| obstacle.to_string()),
        // σ of the position over the workspace, rms.
        "position_sigma_mm": sigma(&next.before),
        // The same with the poses that are best added.
        "position_sigma_with_next_mm": sigma(&next.after),
    });
    json::report(SCHEMA_VERSION, contents)
}

/// Those that are shown, and how many of how many they are; `null` if all.
pub(super) fn leverages(drive: Drive, leverages: &[Leverage]) -> (Vec<Value>, Option<Value>) {
    let some = shown(leverages.len(), MANY, |index| leverages[index].total);
    let sampled = some
        .as_ref()
        .map(|some| json!({ "shown": some.len(), "of": leverages.len() }));
    let some = some.unwrap_or_else(|| (0..leverages.len()).collect());
    let listed = some.into_iter().map(|index| {
        let leverage = &leverages[index];
        json!({
            "line": leverage.line,
            joint::key("joints", drive): leverage.joints.map(|q| joint::in_file(drive, q)),
            // Trace of its block of the hat matrix.
            "total": leverage.total,
            // The largest of its residuals.
            "largest": leverage.largest,
        })
    });
    (listed.collect(), sampled)
}

/// Parameters that are estimated together.
fn block(block: &Block) -> Value {
    let indices = &block.indices;
    json!({
        // 1, 2 or 3; `null` for the whole robot.
        "arm": block.arm.map(|arm| arm.index() + 1),
        // The largest first, 1/mm.
        "singular_values": block.singular_values,
        // How many are not zero.
        "rank": block.rank,
        // O1 to O5.
        "observability": [indices.o1, indices.o2, indices.o3, indices.o4, indices.o5],
        // The combination of parameters known worst.
        "weakest": {
            "words": block.weakest.in_words(),
            // One σ of the combination as a unit vector; `null` if it is not determined.
            "sigma_mm": block.weakest.sigma,
        },
        // Whether every parameter of it is determined.
        "determined": block.determined,
    })
}
