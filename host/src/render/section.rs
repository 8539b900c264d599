//! What a report says under a heading, described once for a terminal and a page.

use super::table::Table;
use maud::Markup;

/// A part of a section.
#[derive(Debug)]
pub(crate) enum Part {
    /// A paragraph.
    Text(String),
    /// A paragraph about what is beside it.
    Note(String),
    /// A paragraph on what is as it should be.
    Good(String),
    /// A paragraph on what is not, and the doubts one by one.
    Doubts(String, Vec<String>),
    /// Paragraphs that are not in an order.
    List(Vec<String>),
    Table(Table),
    /// What a terminal cannot show.
    Page(Markup),
}

/// What a report says under a heading.
#[derive(Debug, Default)]
pub(crate) struct Section {
    pub(super) title: String,
    pub(super) lead: String,
    pub(super) parts: Vec<Part>,
}

impl Section {
    /// An empty section; without a heading if the title is empty.
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    /// With one more part.
    pub(crate) fn part(mut self, part: Part) -> Self {
        self.parts.push(part);
        self
    }

    /// With one more paragraph.
    pub(crate) fn text(self, text: impl Into<String>) -> Self {
        self.part(Part::Text(text.into()))
    }

    /// With one more note.
    pub(crate) fn note(self, note: impl Into<String>) -> Self {
        self.part(Part::Note(note.into()))
    }

    /// With one more table.
    pub(crate) fn table(self, table: Table) -> Self {
        self.part(Part::Table(table))
    }

    /// With what a terminal cannot show.
    pub(crate) fn in_page(self, markup: Markup) -> Self {
        self.part(Part::Page(markup))
    }

    /// With this, which a terminal cannot show, in front of all.
    pub(crate) fn after(mut self, markup: Markup) -> Self {
        self.parts.insert(0, Part::Page(markup));
        self
    }
}
