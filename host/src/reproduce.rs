//! Section 4 of the paper, run again: its simulations as campaigns, its figures, and its numbers
//! beside those found here.
//!
//! ```text
//! EXPERIMENTS ─→ campaign::run ─┬→ Reproduction ─→ results.csv
//! robot ─→ workspace::Analysis ─┘       ├→ figures ─→ SVG
//!                                       └→ report.html
//! ```
//!
//! The paper: T. Bentaleb, J. Iqbal, "On the improvement of calibration accuracy of parallel robots –
//! modeling and optimization", JTAM 58(1), 2020, doi 10.15632/jtam-pl/115863.

pub use crate::render::named_figure::NamedFigure;

mod boundary;
mod comparison;
mod experiment;
mod figures;
mod report;
mod reproduction;
mod results;
mod run;

pub use comparison::{Comparison, comparisons};
pub use experiment::{EXPERIMENTS, Experiment, PaperValue};
pub use figures::figures;
pub use report::{render, table};
pub use reproduction::{Reproduction, Results};
pub use results::results_csv;
pub use run::{CAMPAIGNS, run};
