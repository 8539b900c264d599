//! What the reports on a terminal have in common.

use anstyle::Style;
use std::fmt::Write;

pub(crate) const HEADING: Style = Style::new().bold();

pub(crate) fn heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "{HEADING}{title}{HEADING:#}");
}
