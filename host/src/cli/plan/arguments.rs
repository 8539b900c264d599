//! The options of `delta-cal plan`.

use super::instruments::InstrumentArguments;
use crate::cli::choices::MethodArgument;
use crate::cli::length::Length;
use crate::cli::paths::robot_path;
use crate::planning::poses::{LEAST_POSES, MOST_POSES, Region};
use clap::{ArgGroup, Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("poses").args(["count", "accuracy", "compare"]).required(true).multiple(true))]
#[command(
    override_usage = "delta-cal plan [OPTIONS] --count <N> <ROBOT.toml>\n       delta-cal plan [OPTIONS] --accuracy <LENGTH> <ROBOT.toml>\n       delta-cal plan [OPTIONS] --compare <ROBOT.toml>"
)]
pub(crate) struct PlanArguments {
    /// The robot as it is known before the measurement
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    pub(super) robot: PathBuf,
    /// The number of poses to measure, 8 to 500; without it the program takes as many as --accuracy
    /// needs
    #[arg(long, value_name = "N", value_parser = whole_number, allow_negative_numbers = true)]
    pub(super) count: Option<usize>,
    /// Choose only poses within this box or cylinder, such as x=-100..100,y=-100..100,z=-500..-400
    /// or r=200,z=-500..-400
    #[arg(long, value_name = "BOX|CYLINDER")]
    pub(super) within: Option<Region>,
    /// Also say how many poses reduce one sigma of the position over the workspace (or over the box
    /// or cylinder) to this length: a number with nm, um, mm, cm or m; without a unit it is in mm
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub(super) accuracy: Option<Length>,
    /// What the chosen poses minimise
    #[arg(long, value_enum, default_value_t = CriterionArgument::A)]
    pub(super) criterion: CriterionArgument,
    /// The method with which the robot will be calibrated
    #[arg(long, value_enum, default_value_t = MethodArgument::Joint)]
    pub(super) method: MethodArgument,
    /// The seed of the random numbers; the same seed gives the same poses
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Write the poses to this file, or with - to standard output in place of the report
    #[arg(long, value_name = "POSES.csv")]
    pub(super) output: Option<PathBuf>,
    /// Write the plan as JSON to this file, or with - to standard output in place of the report
    #[arg(long, value_name = "PLAN.json")]
    pub(super) json: Option<PathBuf>,
    /// Replace POSES.csv even if it holds measurements
    #[arg(long)]
    pub(super) force: bool,
    #[command(flatten)]
    pub(super) instruments: InstrumentArguments,
}

fn whole_number(text: &str) -> Result<usize, String> {
    text.parse()
        .map_err(|_| format!("a whole number is needed, {LEAST_POSES} to {MOST_POSES}"))
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum CriterionArgument {
    /// The mean square of the parameter error, angles times the upper arm's length
    A,
    /// The volume of the parameters' confidence region
    D,
}
