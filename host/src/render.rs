//! Figures, HTML pages and terminal output. A report is described once, as sections and tables, and rendered as either.

pub(crate) mod page;
pub mod plot;
pub(crate) mod terminal;

use maud::Markup;

#[derive(Debug)]
pub(crate) enum Part {
    /// A paragraph.
    Text(String),
    /// A paragraph explaining its neighbours.
    Note(String),
    /// A paragraph with a good result.
    Good(String),
    /// A paragraph with a doubtful result, and a list of warnings.
    Doubts(String, Vec<String>),
    /// An unordered list of paragraphs.
    List(Vec<String>),
    Table(Table),
    /// Content for pages only.
    Page(Markup),
}

impl Part {
    /// A verdict in a sentence.
    pub(crate) fn verdict(passed: bool, text: String) -> Self {
        if passed {
            Self::Good(text)
        } else {
            Self::Doubts(text, Vec::new())
        }
    }
}

/// The part of a report under one heading.
#[derive(Debug, Default)]
pub(crate) struct Section {
    pub(super) title: String,
    pub(super) parts: Vec<Part>,
}

impl Section {
    /// An empty section, without a heading if the title is empty.
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    pub(crate) fn part(mut self, part: Part) -> Self {
        self.parts.push(part);
        self
    }

    /// Adds a paragraph.
    pub(crate) fn text(self, text: impl Into<String>) -> Self {
        self.part(Part::Text(text.into()))
    }

    /// Adds paragraphs, of which there may be none.
    pub(crate) fn texts<T: Into<String>>(self, texts: impl IntoIterator<Item = T>) -> Self {
        texts.into_iter().fold(self, Self::text)
    }

    pub(crate) fn note(self, note: impl Into<String>) -> Self {
        self.part(Part::Note(note.into()))
    }

    pub(crate) fn table(self, table: impl Into<Table>) -> Self {
        self.part(Part::Table(table.into()))
    }

    /// Adds content for pages only.
    pub(crate) fn in_page(self, markup: Markup) -> Self {
        self.part(Part::Page(markup))
    }

    /// Inserts content for pages only before all other parts.
    pub(crate) fn after(mut self, markup: Markup) -> Self {
        self.parts.insert(0, Part::Page(markup));
        self
    }
}

/// A heading and a cell for each row.
#[derive(Debug)]
pub(crate) struct Column {
    /// May contain line breaks.
    pub(super) heading: String,
    pub(super) cells: Vec<String>,
}

/// Columns of formatted cells. The first column names the rows.
#[derive(Debug, Default)]
pub(crate) struct Table {
    pub(super) columns: Vec<Column>,
    /// Highlighted rows.
    pub(super) standing_out: Vec<usize>,
    /// Number of rows in a group.
    pub(super) group: Option<usize>,
    /// Title of a collapsible table in a page, and whether it is open.
    pub(super) folded: Option<(String, bool)>,
}

impl Table {
    /// A table with one row per item; the columns follow.
    pub(crate) fn of<T>(items: impl IntoIterator<Item = T>) -> Rows<T> {
        Rows {
            items: items.into_iter().collect(),
            table: Self::default(),
        }
    }

    /// A table with headings only; the rows follow.
    pub(crate) fn new<H: Into<String>>(headings: impl IntoIterator<Item = H>) -> Self {
        let columns = headings
            .into_iter()
            .map(|heading| Column::new(heading, vec![]));
        Self {
            columns: columns.collect(),
            ..Self::default()
        }
    }

    /// A table of names and values, without headings.
    pub(crate) fn facts<N: Into<String>>(facts: impl IntoIterator<Item = (N, String)>) -> Self {
        let facts = facts.into_iter().map(|(name, value)| (name.into(), value));
        let (names, values) = facts.unzip();
        Self {
            columns: vec![Column::new("", names), Column::new("", values)],
            ..Self::default()
        }
    }

    /// Adds a row; missing cells are empty.
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

    /// Adds a gap after each group of this many rows.
    pub(crate) fn in_groups_of(mut self, rows: usize) -> Self {
        self.group = Some(rows);
        self
    }

    /// Makes the table collapsible in a page, under a title.
    pub(crate) fn folded(mut self, line: impl Into<String>, open: bool) -> Self {
        self.folded = Some((line.into(), open));
        self
    }

    /// A section with the table, unless it has no rows.
    pub(crate) fn under(self, title: &str) -> Option<Section> {
        (self.rows() > 0).then(|| Section::new(title).table(self))
    }

    pub(super) fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }
}

impl Column {
    fn new(heading: impl Into<String>, cells: Vec<String>) -> Self {
        Self {
            heading: heading.into(),
            cells,
        }
    }

    /// Whether most cells are words, which are left-aligned; numbers are right-aligned.
    pub(super) fn is_words(&self) -> bool {
        let begin = |with: fn(char) -> bool| {
            let cells = self.cells.iter().filter(|cell| cell.starts_with(with));
            cells.count()
        };
        begin(char::is_alphabetic) > begin(|c| c.is_ascii_digit() || "+-−".contains(c))
    }
}

/// A table whose columns are functions of an item.
#[derive(Debug)]
pub(crate) struct Rows<T> {
    items: Vec<T>,
    table: Table,
}

impl<T> Rows<T> {
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

    /// Adds a column if `shown`.
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

    /// Highlights rows in a page.
    pub(crate) fn rows_standing_out(mut self, stands_out: impl Fn(&T) -> bool) -> Self {
        let numbered = self.items.iter().enumerate();
        let those = numbered.filter(|(_, item)| stands_out(item));
        self.table.standing_out = those.map(|(row, _)| row).collect();
        self
    }

    /// Columns of a vector, each with its heading.
    pub(crate) fn vector<const N: usize, C: ToString>(
        self,
        headings: [&str; N],
        cells: impl Fn(&T) -> [C; N],
    ) -> Self {
        let columns = headings.into_iter().enumerate();
        columns.fold(self, |rows, (place, heading)| {
            rows.column(heading, |item| cells(item)[place].to_string())
        })
    }

    pub(crate) fn table(self) -> Table {
        self.table
    }

    /// A section with the table, unless it has no rows.
    pub(crate) fn under(self, title: &str) -> Option<Section> {
        self.table.under(title)
    }
}

impl<T> From<Rows<T>> for Table {
    fn from(rows: Rows<T>) -> Self {
        rows.table
    }
}
