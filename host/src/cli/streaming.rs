//! The options of samples that come one after the other.

use crate::Streaming;
use clap::builder::TypedValueParser;
use clap::{Args, value_parser};
use std::num::NonZeroU32;

#[derive(Debug, Args)]
pub(crate) struct StreamingArguments {
    /// Compare each sample with those before it in the file, and leave it out if it disagrees
    #[arg(long)]
    gate: bool,
    /// Fit the robot without every K-th sample, and refuse the fit if those samples contradict it
    #[arg(long, value_name = "K", value_parser = at_least(2), conflicts_with_all = ["gate", "forget"])]
    held_out: Option<NonZeroU32>,
    /// Let older samples count less, so that their mean age is N samples, to find the robot as it is
    /// at the end of the file
    #[arg(long, value_name = "N", value_parser = at_least(1))]
    forget: Option<NonZeroU32>,
}

fn at_least(least: i64) -> impl TypedValueParser<Value = NonZeroU32> {
    value_parser!(u32)
        .range(least..)
        .try_map(NonZeroU32::try_from)
}

impl StreamingArguments {
    pub(crate) fn streaming(&self) -> Streaming {
        Streaming {
            gate: self.gate,
            held_out: self.held_out,
            forget: self.forget,
        }
    }
}
