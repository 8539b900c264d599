//! Figures, pages, and what is written to a terminal. What a report says is described once, as
//! sections and tables, and shown in both.

pub(crate) mod page;
pub mod plot;
pub(crate) mod terminal;

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

/// A heading, and a cell for each row.
#[derive(Debug)]
pub(crate) struct Column {
    /// May have several lines.
    pub(super) heading: String,
    pub(super) cells: Vec<String>,
}

/// Columns of cells that are formatted already. The first column names the rows.
#[derive(Debug, Default)]
pub(crate) struct Table {
    pub(super) columns: Vec<Column>,
    /// The rows that stand out.
    pub(super) standing_out: Vec<usize>,
    /// So many rows belong together.
    pub(super) group: Option<usize>,
    /// What a page shows in place of the table until it is asked for, and whether it is.
    pub(super) folded: Option<(String, bool)>,
}

impl Table {
    /// One row an item; the columns follow.
    pub(crate) fn of<T>(items: impl IntoIterator<Item = T>) -> Rows<T> {
        Rows {
            items: items.into_iter().collect(),
            table: Self::default(),
        }
    }

    /// Headings only; the rows follow.
    pub(crate) fn new<H: Into<String>>(headings: impl IntoIterator<Item = H>) -> Self {
        let columns = headings
            .into_iter()
            .map(|heading| Column::new(heading, vec![]));
        Self {
            columns: columns.collect(),
            ..Self::default()
        }
    }

    /// Values with their names, without headings.
    pub(crate) fn facts<N: Into<String>>(facts: impl IntoIterator<Item = (N, String)>) -> Self {
        let facts = facts.into_iter().map(|(name, value)| (name.into(), value));
        let (names, values) = facts.unzip();
        Self {
            columns: vec![Column::new("", names), Column::new("", values)],
            ..Self::default()
        }
    }

    /// One more row; cells that are missing are empty.
    pub(crate) fn row<C: ToString>(
        mut self,
        name: impl Into<String>,
        cells: impl IntoIterator<Item = C>,
    ) -> Self {
        let mut cells = cells.into_iter();
        let mut name = Some(name.into());
        for column in &mut self.columns {
            let cell = name.take().or_else(|| Some(cells.next()?.to_string()));
            column.cells.push(cell.unwrap_or_default());
        }
        self
    }

    /// With a gap after every so many rows.
    pub(crate) fn in_groups_of(mut self, rows: usize) -> Self {
        self.group = Some(rows);
        self
    }

    /// Under a line of a page that opens it.
    pub(crate) fn folded(mut self, line: impl Into<String>, open: bool) -> Self {
        self.folded = Some((line.into(), open));
        self
    }

    pub(super) fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    pub(super) fn has_headings(&self) -> bool {
        self.columns.iter().any(|column| !column.heading.is_empty())
    }
}

impl Column {
    fn new(heading: impl Into<String>, cells: Vec<String>) -> Self {
        Self {
            heading: heading.into(),
            cells,
        }
    }

    /// Whether most cells are words, which begin on the left; numbers end on the right.
    pub(super) fn is_words(&self) -> bool {
        let begin = |with: fn(char) -> bool| {
            let cells = self.cells.iter().filter(|cell| cell.starts_with(with));
            cells.count()
        };
        begin(char::is_alphabetic) > begin(|c| c.is_ascii_digit() || "+-−".contains(c))
    }
}

/// A table whose columns are described by what they show of an item.
#[derive(Debug)]
pub(crate) struct Rows<T> {
    items: Vec<T>,
    table: Table,
}

impl<T> Rows<T> {
    /// One more column.
    pub(crate) fn column<C: ToString>(
        mut self,
        heading: impl Into<String>,
        cell: impl Fn(&T) -> C,
    ) -> Self {
        let cells = self.items.iter().map(|item| cell(item).to_string());
        self.table
            .columns
            .push(Column::new(heading, cells.collect()));
        self
    }

    /// One more column if there is something to show in it.
    pub(crate) fn column_if<C: ToString>(
        self,
        shown: bool,
        heading: impl Into<String>,
        cell: impl Fn(&T) -> C,
    ) -> Self {
        if shown {
            self.column(heading, cell)
        } else {
            self
        }
    }

    /// The rows that stand out in a page.
    pub(crate) fn rows_standing_out(mut self, stands_out: impl Fn(&T) -> bool) -> Self {
        let numbered = self.items.iter().enumerate();
        let those = numbered.filter(|(_, item)| stands_out(item));
        self.table.standing_out = those.map(|(row, _)| row).collect();
        self
    }

    /// The table.
    pub(crate) fn table(self) -> Table {
        self.table
    }
}
