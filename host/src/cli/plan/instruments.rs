//! Options for instruments other than a tracker.

use crate::cli::choices::FrameArgument;
use crate::planning::measurements::{Instrument, Wishes};
use clap::Args;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(Debug, Args)]
pub(super) struct InstrumentArguments {
    /// Plan measurements of these kinds in place of positions: plane (heights above a plate), distance
    /// (between two poses), point (from fixed points), xy, z, xyz; several with commas, and
    /// distance=12 for twelve at most
    #[arg(long, value_name = "KINDS", conflicts_with_all = ["criterion", "method", "accuracy"])]
    pub(super) measure: Option<Wishes>,
    /// Say what 12, 20, 40 and 60 planned measurements with each of many instruments would bring
    #[arg(long, conflicts_with_all = ["measure", "criterion", "method", "output", "blocks", "points", "length", "frame"])]
    pub(super) compare: bool,
    /// With --compare: one sigma of the readings of an instrument, as bar300=0.02, in mm
    #[arg(long, value_name = "NAME=MM", requires = "compare")]
    pub(super) sigma: Vec<InstrumentSigma>,
    /// Heights of the gauge blocks that the platform is measured on, in mm; 0 is the bare plate
    #[arg(long, value_name = "MM,...", value_delimiter = ',', allow_hyphen_values = true, value_parser = block, default_values_t = [0.0, 60.0, 120.0], requires = "measure")]
    pub(super) blocks: Vec<f64>,
    /// Where the plate crosses the robot's z axis, in mm; without it where the workspace is broadest
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    pub(super) plane: Option<f64>,
    /// How many fixed points the distances are measured from
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=4), default_value_t = 3, requires = "measure")]
    pub(super) points: u8,
    /// The distances that can be measured, in mm: 300 for a bar, 100..600 for a wire sensor or a
    /// calliper
    #[arg(long, value_name = "MM|MIN..MAX", requires = "measure")]
    pub(super) length: Option<Lengths>,
    /// The frame in which x, y and z will be measured
    #[arg(long, value_enum, default_value_t = FrameArgument::Base, requires = "measure")]
    pub(super) frame: FrameArgument,
    /// With --compare: write the comparison as one HTML file with a figure
    #[arg(long, value_name = "REPORT.html", requires = "compare")]
    pub(super) report: Option<PathBuf>,
}

fn block(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(height) if height >= 0.0 && height.is_finite() => Ok(height),
        _ => Err("heights of gauge blocks in mm are needed, as 0,60,120".to_owned()),
    }
}

/// The shortest and the longest distance, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lengths(pub(super) f64, pub(super) f64);

impl FromStr for Lengths {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (low, high) = text.split_once("..").unwrap_or((text, text));
        match (low.trim().parse::<f64>(), high.trim().parse::<f64>()) {
            (Ok(low), Ok(high)) if low > 0.0 && low <= high && high.is_finite() => {
                Ok(Self(low, high))
            }
            _ => Err(
                "a length in mm is needed, as 300 for a bar, or a range, as 100..600".to_owned(),
            ),
        }
    }
}

/// One σ of an instrument, mm.
#[derive(Debug, Clone)]
pub(super) struct InstrumentSigma(pub(super) String, pub(super) f64);

impl FromStr for InstrumentSigma {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = Instrument::ALL.map(|own| own.name).join(", ");
        let wanted = || format!("write NAME=MM, as bar300=0.02; the instruments are {names}");
        let (name, sigma) = text.split_once('=').ok_or_else(wanted)?;
        let known = Instrument::ALL.iter().any(|own| own.name == name.trim());
        match sigma.trim().parse::<f64>() {
            Ok(sigma) if known && sigma > 0.0 && sigma.is_finite() => {
                Ok(Self(name.trim().to_owned(), sigma))
            }
            _ => Err(wanted()),
        }
    }
}
