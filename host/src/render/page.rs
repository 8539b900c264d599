//! The frame of every HTML report: one self-contained file that opens from disk.

use super::plot::Figure;
use super::{Column, Part, Section, Table};
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

const STYLE: &str = include_str!("page/style.css");
/// One arm with its parameters, and the arms from above.
const DRAWING: &str = include_str!("page/arm.svg");

/// The page around a report.
pub(crate) fn render(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={ "delta-cal " (env!("CARGO_PKG_VERSION")) };
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; style-src 'unsafe-inline'";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    (body)
                    footer { "delta-cal " (env!("CARGO_PKG_VERSION")) }
                }
            }
        }
    };
    page.into_string() + "\n"
}

pub(crate) fn figure(figure: &Figure, caption: &str) -> Markup {
    html! {
        figure {
            div.scroll { (PreEscaped(figure.to_svg())) }
            figcaption { (caption) }
        }
    }
}

/// The drawing of an arm and its parameters.
pub(crate) fn drawing() -> Markup {
    html! { figure.model { div.scroll { (PreEscaped(DRAWING)) } } }
}

pub(crate) fn signature() -> Markup {
    html! { div.signature { span { "Date" } span { "Name and signature" } } }
}

/// A key figure with a note.
pub(crate) fn tile(name: &str, value: &str, note: &str) -> Markup {
    html! {
        div.tile {
            div.name { (name) }
            div.value { (value) }
            div.was { (note) }
        }
    }
}

impl Render for Section {
    fn render(&self) -> Markup {
        html! {
            section {
                h2 { (self.title) }
                @for part in &self.parts { (part) }
            }
        }
    }
}

impl Render for Part {
    fn render(&self) -> Markup {
        html! {
            @match self {
                Self::Text(text) => p { (text) },
                Self::Note(text) => p.note { (text) },
                Self::Good(text) => p.good { (text) },
                Self::Doubts(text, doubts) => div.doubtful {
                    p { (text) }
                    @if !doubts.is_empty() { ul { @for doubt in doubts { li { (doubt) } } } }
                },
                Self::List(items) => ul { @for item in items { li { (item) } } },
                Self::Table(table) => (table),
                Self::Page(markup) => (markup),
            }
        }
    }
}

/// Tables with more columns are set in smaller type.
const WIDE: usize = 8;

impl Render for Table {
    fn render(&self) -> Markup {
        let rows: Vec<_> = (0..self.rows()).collect();
        let group = self.group.unwrap_or(usize::MAX);
        let table = html! {
            table.wide[self.columns.len() > WIDE].groups[self.group.is_some()] {
                @if self.columns.iter().any(|own| !own.heading.is_empty()) {
                    thead { tr { @for column in &self.columns { (heading(column)) } } }
                }
                @for rows in rows.chunks(group) {
                    tbody {
                        @for row in rows {
                            tr.outlying[self.standing_out.binary_search(row).is_ok()] {
                                @for (place, column) in self.columns.iter().enumerate() {
                                    (cell(column, *row, place == 0))
                                }
                            }
                        }
                    }
                }
            }
        };
        html! {
            @if let Some((line, open)) = &self.folded {
                details open[*open] { summary { (line) } div.scroll { (table) } }
            } @else {
                div.scroll { (table) }
            }
        }
    }
}

fn heading(column: &Column) -> Markup {
    html! {
        th.words[column.is_words()] {
            @for (index, line) in column.heading.lines().enumerate() {
                @if index > 0 { br; }
                (line)
            }
        }
    }
}

fn cell(column: &Column, row: usize, first: bool) -> Markup {
    let cell = &column.cells[row];
    html! {
        @if first {
            th scope="row" { (cell) }
        } @else {
            td.words[column.is_words()] { (cell) }
        }
    }
}
