//! The check for programs.

use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::CalibrationMethod;
use crate::planning::observability::{Block, Observability};
use crate::planning::poses::{Expectation, NextPoses};
use crate::report::plan::json::{JsonAssumptions, JsonPose};
use crate::text::units::degrees;
use serde::Serialize;

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole check. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonCheck {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The program's version.
    pub program_version: &'static str,
    /// Name of the robot file.
    pub robot_file: String,
    /// Name of the samples file.
    pub samples_file: String,
    /// `ikm` or `fkm`.
    pub method: &'static str,
    /// What the samples were judged for.
    pub assumptions: JsonAssumptions,
    /// Whether they determine every parameter.
    pub determined: bool,
    /// In one sentence.
    pub verdict: String,
    /// The three arms, or the whole robot with `fkm`.
    pub blocks: Vec<JsonBlock>,
    /// Each sample's, in the file's order.
    pub leverages: Vec<JsonLeverage>,
    /// The poses that are best added, one after the other.
    pub next: Vec<JsonPose>,
    /// σ of the position over the workspace, rms.
    pub position_sigma_mm: Option<f64>,
    /// The same with the poses that are best added.
    pub position_sigma_with_next_mm: Option<f64>,
}

/// Parameters that are estimated together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonBlock {
    /// 1, 2 or 3; `null` for the whole robot.
    pub arm: Option<usize>,
    /// The largest first, 1/mm.
    pub singular_values: Vec<f64>,
    /// How many are not zero.
    pub rank: usize,
    /// O1 to O5.
    pub observability: [f64; 5],
    /// The combination known worst.
    pub weakest: JsonCombination,
    /// Whether every parameter of it is determined.
    pub determined: bool,
}

/// Parameters that change together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonCombination {
    /// In words.
    pub words: String,
    /// One σ, mm, of the combination as a unit vector; `null` if it is not determined.
    pub sigma_mm: Option<f64>,
}

/// How much a sample decides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonLeverage {
    /// Its line.
    pub line: u64,
    /// Its joint angles.
    pub joints_deg: [f64; 3],
    /// Trace of its block of the hat matrix.
    pub total: f64,
    /// The largest of its residuals.
    pub largest: f64,
}

impl JsonCheck {
    /// Of a check.
    pub fn new(
        robot: &RobotFile,
        samples: &SamplesFile,
        method: CalibrationMethod,
        observability: &Observability,
        next: &NextPoses,
    ) -> Self {
        let sigma = |expectation: &Option<Expectation>| {
            expectation
                .as_ref()
                .map(|expectation| expectation.workspace.rms)
        };
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION"),
            robot_file: robot.name.clone(),
            samples_file: samples.name.clone(),
            method: method.name(),
            assumptions: JsonAssumptions::of(&observability.assumptions),
            determined: observability.determined(),
            verdict: super::table::verdict(observability),
            blocks: observability.blocks.iter().map(JsonBlock::of).collect(),
            leverages: observability
                .leverages
                .iter()
                .map(|leverage| JsonLeverage {
                    line: leverage.line,
                    joints_deg: leverage.joints.map(degrees),
                    total: leverage.total,
                    largest: leverage.largest,
                })
                .collect(),
            next: next.poses.iter().map(JsonPose::of).collect(),
            position_sigma_mm: sigma(&next.before),
            position_sigma_with_next_mm: sigma(&next.after),
        }
    }

    /// As text, indented, ending in a new line.
    ///
    /// # Errors
    /// None is known; the serialiser's, if it had one.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}

impl JsonBlock {
    fn of(block: &Block) -> Self {
        let indices = &block.indices;
        Self {
            arm: block.arm.map(|arm| arm.index() + 1),
            singular_values: block.singular_values.clone(),
            rank: block.rank,
            observability: [indices.o1, indices.o2, indices.o3, indices.o4, indices.o5],
            weakest: JsonCombination {
                words: block.weakest.in_words(),
                sigma_mm: Some(block.weakest.sigma).filter(|sigma| sigma.is_finite()),
            },
            determined: block.determined,
        }
    }
}
