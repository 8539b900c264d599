//! Terminal output: plain lines of at most 100 columns, with colours as ANSI codes that the printer strips where they
//! are unwanted.

use super::{Column, Part, Section, Table};
use anstyle::{AnsiColor, Style};
use std::fmt::{self, Display, Formatter};

const HEADING: Style = Style::new().bold();
pub(crate) const GOOD: Style = AnsiColor::Green.on_default();
pub(crate) const DOUBTFUL: Style = AnsiColor::Yellow.on_default().bold();
const WIDTH: usize = 100;

/// Renders sections in order.
pub(crate) fn text(sections: impl IntoIterator<Item = Section>) -> String {
    let shown: Vec<_> = sections
        .into_iter()
        .map(|section| section.to_string())
        .collect();
    shown.join("\n")
}

impl Display for Section {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        if !self.title.is_empty() {
            writeln!(
                formatter,
                "{HEADING}{}{HEADING:#}",
                wrapped(&self.title, "")
            )?;
        }
        self.parts.iter().try_for_each(|part| part.fmt(formatter))
    }
}

impl Display for Part {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) | Self::Note(text) => writeln!(formatter, "{}", wrapped(text, "")),
            Self::Good(text) => writeln!(formatter, "{GOOD}{}{GOOD:#}", wrapped(text, "")),
            Self::Doubts(text, doubts) => {
                writeln!(formatter, "{DOUBTFUL}{}{DOUBTFUL:#}", wrapped(text, ""))?;
                list(formatter, doubts)
            }
            Self::List(items) => list(formatter, items),
            Self::Table(table) => table.fmt(formatter),
            Self::Page(_) => Ok(()),
        }
    }
}

fn list(formatter: &mut Formatter<'_>, items: &[String]) -> fmt::Result {
    items
        .iter()
        .try_for_each(|item| writeln!(formatter, "  - {}", wrapped(item, "    ")))
}

/// Wraps text to [`WIDTH`] columns. All lines but the first begin with `indent`; the caller has indented the first.
pub(crate) fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = String::new();
    let mut column = indent.len();
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if column > indent.len() {
            if column + 1 + length > WIDTH {
                lines.push('\n');
                lines.push_str(indent);
                column = indent.len();
            } else {
                lines.push(' ');
                column += 1;
            }
        }
        lines.push_str(word);
        column += length;
    }
    lines
}

impl Display for Table {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let shown: Vec<_> = self
            .columns
            .iter()
            .map(|column| (column, width(column), column.is_words()))
            .collect();
        let line = |cell: &dyn Fn(&Column) -> String| {
            let cells: Vec<_> = shown
                .iter()
                .map(|&(column, width, words)| {
                    let cell = cell(column);
                    if words {
                        format!("{cell:<width$}")
                    } else {
                        format!("{cell:>width$}")
                    }
                })
                .collect();
            cells.join("  ").trim_end().to_owned()
        };
        let heads = self.columns.iter().map(|c| c.heading.lines().count()).max();
        for above in (0..heads.unwrap_or(0)).rev() {
            let heading = line(&|column| {
                let mut from_below = column.heading.lines().rev();
                from_below.nth(above).unwrap_or_default().to_owned()
            });
            writeln!(formatter, "{HEADING}{heading}{HEADING:#}")?;
        }
        for row in 0..self.rows() {
            if row > 0 && self.group.is_some_and(|rows| row.is_multiple_of(rows)) {
                writeln!(formatter)?;
            }
            writeln!(formatter, "{}", line(&|column| column.cells[row].clone()))?;
        }
        Ok(())
    }
}

fn width(column: &Column) -> usize {
    let cells = column.cells.iter().map(String::as_str);
    let texts = cells.chain(column.heading.lines());
    texts.map(|text| text.chars().count()).max().unwrap_or(0)
}
