//! For people at a terminal.

use super::words::{doubts, headline, section, verdict_part};
use crate::render::section::Section;
use crate::render::terminal;
use crate::validation::Validation;

pub use super::words::verdict;

/// The whole report.
pub fn render(found: &Validation) -> String {
    let mut parts = vec![Section::new("").text(headline(found)), section(found)];
    parts.extend(doubts(found).map(|doubts| Section::new("").part(doubts)));
    parts.push(Section::new("").part(verdict_part(found)));
    terminal::text(parts)
}
