//! A table of named columns with units and any separator: header, rows and numbers.

use super::{Label, Row};
use crate::files::columns::{ColumnName, Quantity, Unit};
use crate::files::convention::Convention;
use crate::files::input::{Cells, InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::halt;
use crate::text::{count, decimal_comma, list};
use csv::{ReaderBuilder, StringRecord};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::f64::consts::TAU;

const KNOWN: &str = "the columns are q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm (or _rad, and _cm, _m, \
                     _um, _in), or in place of the last three height_mm,plane or \
                     distance_mm,point or distance_mm,to_q1_deg,to_q2_deg,to_q3_deg, in any \
                     order, rx_deg,ry_deg,rz_deg beside a position, and sigma_mm or u_k2_mm (k = 2), the uncertainty of the row; with a linear drive s1_mm… and to_s1_mm… instead of q1_deg… and \
                     to_q1_deg…; the program ignores columns whose name begins with _";

/// Columns that say something of a row beside its numbers.
const NAME: &str = "name";
const REPEAT: &str = "repeat";
const APPROACH: &str = "approach";
const USE: &str = "use";
const LABELS: [&str; 4] = [NAME, REPEAT, APPROACH, USE];
/// Columns whose name starts with this are ignored.
const IGNORED: char = '_';
/// A cell that was not measured.
const NOT_MEASURED: &str = "-";
/// Possible field separators; several spaces count as one.
const SEPARATORS: [(char, &str); 4] = [
    (',', "commas"),
    (';', "semicolons"),
    ('\t', "tabs"),
    (' ', "spaces"),
];
/// A header has at least this many known columns.
const LEAST_COLUMNS: usize = 3;
/// Lines above the header that are searched.
const MOST_ABOVE: usize = 100;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Column {
    /// Index of the column, from 0.
    place: usize,
    quantity: Quantity,
    unit: Unit,
    /// Whether the unit is stated in its name, on the command line or in `[convention]`.
    stated: bool,
}

/// A table with a parsed header.
pub(super) struct Table<'a> {
    pub(super) input: &'a InputText,
    convention: &'a Convention,
    /// The header's line.
    line: u64,
    separator: char,
    names: Vec<String>,
    /// The columns to read.
    columns: Vec<Column>,
    /// Whether unknown columns are allowed: `--columns` names those to read, or they belong to another file.
    others: bool,
}

pub(super) struct TableRow<'a> {
    table: &'a Table<'a>,
    numbers: &'a RefCell<Numbers>,
    pub(super) line: u64,
    record: Record<'a>,
}

/// The cells of a row.
#[derive(Clone, Copy)]
enum Record<'a> {
    /// Of a line of text.
    Fields(&'a [Cow<'a, str>]),
    /// Of columns, at an index.
    Cells(&'a [Cells], usize),
}

impl Record<'_> {
    /// The text of a cell.
    fn get(&self, place: usize) -> Option<Cow<'_, str>> {
        match self {
            Self::Fields(fields) => fields.get(place).map(|own| Cow::Borrowed(own.as_ref())),
            Self::Cells(columns, row) => columns.get(place)?.text(*row),
        }
    }

    /// A cell that holds a number and no text; NaN if it was not measured.
    fn number(&self, place: usize) -> Option<f64> {
        match self {
            Self::Cells(columns, row) => match columns.get(place)? {
                Cells::Numbers(all) => all.get(*row).copied(),
                Cells::Words(_) => None,
            },
            Self::Fields(_) => None,
        }
    }

    /// Whether a cell says that it was not measured.
    fn is_unmeasured(&self, place: usize) -> bool {
        match self.number(place) {
            Some(number) => number.is_nan(),
            None => self.get(place).is_some_and(|own| own == NOT_MEASURED),
        }
    }

    /// Whether a cell holds something.
    fn is_filled(&self, place: usize) -> bool {
        if let Some(number) = self.number(place) {
            return !number.is_nan();
        }
        let cell = self.get(place);
        cell.is_some_and(|own| !(own.is_empty() || own == NOT_MEASURED))
    }
}

impl<'a> Table<'a> {
    /// `lenient`: unknown columns are allowed because they belong to another file or do not matter.
    pub(super) fn parse(
        input: &'a InputText,
        convention: &'a Convention,
        lenient: bool,
    ) -> Result<Self, InputError> {
        let (line, header) = header(input).ok_or_else(|| {
            InputError::new(input.name(), "the file is empty: it has no header")
                .at_line(1)
                .with_remedy(KNOWN)
        })?;
        let (separator, _) = separated(input, header);
        let mut table = Self {
            input,
            convention,
            line,
            separator,
            names: names(header, separator),
            columns: Vec::new(),
            others: lenient || !input.columns().0.is_empty(),
        };
        if !lenient {
            table.check()?;
        }
        for (place, name) in table.names.iter().enumerate() {
            let Some(own) = table.recognise(place, name)? else {
                continue;
            };
            if let Some(other) = table.column(own.quantity) {
                let other = &table.names[other.place];
                let cause = format!("the column repeats column {other} before it");
                return Err(table.fault(cause).at_column(name));
            }
            let stated = own.unit.or(convention.stated_unit(own.quantity));
            table.columns.push(Column {
                place,
                quantity: own.quantity,
                unit: stated.unwrap_or(own.quantity.usual_unit()),
                stated: stated.is_some(),
            });
        }
        // Without distances, a column `point` names the poses.
        if table.column(Quantity::Distance).is_none() {
            table.columns.retain(|own| own.quantity != Quantity::Point);
        }
        Ok(table)
    }

    /// Motive's export contains no joints.
    fn check_motive(&self) -> Result<(), InputError> {
        let joint = |name: &String| {
            ColumnName::recognise(name).is_some_and(|own| own.quantity.joint().is_some())
        };
        if !self.input.text().starts_with("Format Version") || self.names.iter().any(joint) {
            return Ok(());
        }
        let cause = format!(
            "this is a Motive export: its header is line {}, and it has no joint angles",
            self.line
        );
        Err(self.fault(cause).with_remedy(
            "give the joints in a file of their own before it, or paste them beside; --columns x_m=7,y_m=8,z_m=9 says \
             by number which X, Y and Z are the position",
        ))
    }

    /// What a file that stands alone must be.
    pub(super) fn check(&self) -> Result<(), InputError> {
        self.check_motive()?;
        self.check_mapping()
    }

    /// Every column in `--columns` must occur exactly once.
    fn check_mapping(&self) -> Result<(), InputError> {
        for mapped in &self.input.columns().0 {
            let named = self.names.iter().filter(|name| **name == mapped.column);
            let number = mapped.column.parse::<usize>();
            let cause = match named.count() {
                1 => continue,
                0 if number.is_ok_and(|number| (1..=self.names.len()).contains(&number)) => {
                    continue;
                }
                0 => "the header has no such column, which --columns names",
                _ => "the header has more than one such column, and --columns names it",
            };
            let names = (1..).zip(&self.names);
            let names = names.map(|(number, name)| format!("{number} {name}"));
            let remedy = format!(
                "the columns of the file are {}; a number chooses one, as in --columns x_m=7",
                list(&names.collect::<Vec<_>>())
            );
            let fault = self.fault(cause).at_column(&mapped.column);
            return Err(fault.with_remedy(remedy));
        }
        Ok(())
    }

    /// What the column of this name contains; `None` if it is not read.
    fn recognise(&self, place: usize, name: &str) -> Result<Option<ColumnName>, InputError> {
        let mapping = self.input.columns();
        let numbered = mapping.of_place(place, &self.names);
        if let Some(mapped) = mapping.of_column(name).or(numbered) {
            return Ok(Some(mapped));
        }
        if name.is_empty() || name.starts_with(IGNORED) || LABELS.contains(&name) {
            return Ok(None);
        }
        let (cause, remedy) = match ColumnName::recognise(name) {
            Some(own) if !mapping.has(own.quantity) => return Ok(Some(own)),
            _ if name.replace(',', ".").parse::<f64>().is_ok() => {
                return Err(self.without_header());
            }
            _ if is_uncertainty(name)
                && !(mapping.has(Quantity::Sigma) || mapping.has(Quantity::Expanded)) =>
            {
                (
                    "an uncertainty whose unit and meaning the name does not say",
                    "say what it is, as --columns sigma_mm=NAME (standard uncertainty of a coordinate) or u_k2_mm=NAME (k = \
                 2), or write _ before its name",
                )
            }
            _ if self.others => return Ok(None),
            _ if name.starts_with('[') => (
                "this looks like a robot file, but a table of samples is needed here",
                "give the robot file first and the table after it",
            ),
            _ => (
                "unknown column",
                "to ignore it, begin its name with _; to use it, name its contents with --columns",
            ),
        };
        let fault = self.fault(cause).at_column(name);
        Err(fault.with_remedy(format!("{remedy}; {KNOWN}")))
    }

    /// The error for a first line that holds numbers instead of names.
    fn without_header(&self) -> InputError {
        let between = self.separator.to_string();
        let joints = self.convention.joint_columns().join(&between);
        let position = self.convention.position_columns().join(&between);
        let remedy = match self.names.len() {
            6 => format!(
                "write a header above the numbers: {joints}{between}{position} if that is what they are"
            ),
            3 => format!(
                "three columns are the joints or the positions alone: write {joints} or {position} above the numbers and give \
                 both files, joints first, or paste them side by side"
            ),
            _ => format!("write a header above the numbers; {KNOWN}"),
        };
        let columns = count(self.names.len(), "column");
        let cause = format!(
            "the first line must name the columns, but this is a number: no header, {columns}"
        );
        self.fault(cause).with_remedy(remedy)
    }

    fn column(&self, quantity: Quantity) -> Option<Column> {
        let mut columns = self.columns.iter();
        columns.find(|own| own.quantity == quantity).copied()
    }

    pub(super) fn has_any(&self, quantities: &[Quantity]) -> bool {
        let mut quantities = quantities.iter();
        quantities.any(|quantity| self.column(*quantity).is_some())
    }

    /// Whether the header has this name.
    pub(super) fn has_name(&self, name: &str) -> bool {
        self.names.iter().any(|own| own == name)
    }

    /// The actual or expected column name of a quantity.
    pub(super) fn name_of(&self, quantity: Quantity) -> String {
        match self.column(quantity) {
            Some(column) => self.names[column.place].clone(),
            None => self.convention.column(quantity),
        }
    }

    /// The places and names of columns that are not read.
    pub(super) fn unread(&self) -> impl Iterator<Item = (usize, &String)> {
        let read = |place| self.columns.iter().any(|own| own.place == place);
        let names = self.names.iter().enumerate();
        names.filter(move |(place, name)| !read(*place) && is_named(name))
    }

    /// The common unit of these quantities.
    pub(super) fn unit_of(&self, quantities: &[Quantity]) -> Option<Unit> {
        let unit = |quantity: &Quantity| Some(self.column(*quantity)?.unit);
        let first = unit(quantities.first()?)?;
        let mut others = quantities.iter();
        others.all(|own| unit(own) == Some(first)).then_some(first)
    }

    /// Requires a column for each of these quantities, and a unit for lengths.
    pub(super) fn require(&self, quantities: &[Quantity]) -> Result<(), InputError> {
        for quantity in quantities {
            let Some(column) = self.column(*quantity) else {
                return Err(self.missing(*quantity));
            };
            if !(column.stated || quantity.is_angle()) {
                return Err(self.without_unit(column, "its unit is not stated"));
            }
        }
        Ok(())
    }

    /// Requires a column for at least one measurable quantity, and a unit for lengths.
    pub(super) fn require_readings(&self) -> Result<(), InputError> {
        if !self.has_any(&Quantity::READINGS) {
            let readings = self.require(&Quantity::COORDINATES);
            readings.map_err(|fault| elsewhere(fault, "readings"))?;
        }
        self.require_units()
    }

    /// Requires the joints; all of them may be in another table.
    pub(super) fn require_joints(&self, joints: [Quantity; 3]) -> Result<(), InputError> {
        match self.require(&joints) {
            Err(fault) if !self.has_any(&joints) => Err(elsewhere(fault, "joints")),
            found => found,
        }
    }

    /// Requires a unit for every length.
    pub(super) fn require_units(&self) -> Result<(), InputError> {
        let lengths = [Quantity::Sigma, Quantity::Expanded];
        let lengths = Quantity::READINGS.into_iter().chain(lengths);
        let there: Vec<_> = lengths.filter(|own| self.has_any(&[*own])).collect();
        self.require(&there)
    }

    fn missing(&self, quantity: Quantity) -> InputError {
        let usual = self.convention.column(quantity);
        let other = if quantity.is_angle() {
            quantity.column(Unit::Radian)
        } else {
            quantity.column(Unit::Metre)
        };
        self.fault("the column is missing")
            .at_column(format!("{usual} (or {other})"))
    }

    fn without_unit(&self, column: Column, cause: &str) -> InputError {
        let with_unit = |own: &Column| own.quantity.column(own.unit);
        let mut wanted = self.names.clone();
        for own in &self.columns {
            wanted[own.place] = with_unit(own);
        }
        let wanted = wanted.join(&self.separator.to_string());
        let (name, usual) = (&self.names[column.place], with_unit(&column));
        self.fault(cause).at_column(name).with_remedy(format!(
            "write the units into the header, {wanted} if these are the units, or state them with \
             --columns, as --columns {usual}={name}"
        ))
    }

    fn fault(&self, cause: impl Into<String>) -> InputError {
        InputError::new(self.input.name(), cause)
            .at_line(self.line)
            .with_remedy(KNOWN)
    }

    /// Reads all rows; there must be at least one.
    pub(super) fn rows<T>(
        &self,
        mut read: impl FnMut(&TableRow<'_>) -> Result<T, InputError>,
    ) -> Result<Vec<Row<T>>, InputError> {
        let mut rows = Vec::new();
        let numbers = RefCell::new(Numbers::default());
        self.each(|line, record| {
            if let Record::Fields(fields) = record {
                self.check_length(line, fields)?;
            }
            let value = read(&TableRow {
                table: self,
                numbers: &numbers,
                line,
                record,
            })?;
            rows.push(Row { line, value });
            Ok(())
        })?;
        if rows.is_empty() {
            return Err(self
                .fault("the file has a header and no rows")
                .with_remedy("add one row for each measured pose below the header"));
        }
        let numbers = numbers.into_inner();
        if let Some((line, column, cause)) = numbers.doubtful_comma(self.separator) {
            return Err(InputError::new(self.input.name(), cause)
                .at_line(line)
                .at_column(&self.names[column])
                .with_remedy(PLAIN));
        }
        let mut columns = self.columns.iter();
        let unstated = |own: &&Column| own.quantity.joint().is_some() && !own.stated;
        match columns.find(|own| own.quantity.is_angle() && unstated(own)) {
            Some(column) if numbers.angle <= TAU => Err(self.without_unit(
                *column,
                "its unit is not stated, and no angle is so large that it must be in degrees",
            )),
            _ => Ok(rows),
        }
    }

    /// The columns that are not read: name and cells, row by row.
    pub(super) fn unread_cells(&self) -> Result<Vec<(String, Vec<String>)>, InputError> {
        let (places, names): (Vec<_>, Vec<_>) = self.unread().unzip();
        let columns = names.into_iter().map(|own| (own.clone(), Vec::new()));
        let mut columns: Vec<_> = columns.collect();
        self.each(|_, record| {
            for ((_, cells), place) in columns.iter_mut().zip(&places) {
                cells.push(record.get(*place).unwrap_or_default().into_owned());
            }
            Ok(())
        })?;
        Ok(columns)
    }

    /// What rows say beside their numbers, and the lines of rows that are not to be used.
    pub(super) fn labels(&self) -> Result<(BTreeMap<u64, Label>, BTreeSet<u64>), InputError> {
        let (mut labels, mut left_out) = (BTreeMap::new(), BTreeSet::new());
        let place = |name: &str| self.names.iter().position(|own| own == name);
        let named = place(NAME).or_else(|| {
            let distances = self.column(Quantity::Distance).is_some();
            let is_point = |own: &String| own.eq_ignore_ascii_case("point");
            let point = self.names.iter().position(is_point);
            point.filter(|_| !distances)
        });
        let [repeat, approach, used] = [REPEAT, APPROACH, USE].map(place);
        let columns = [named, repeat, approach, used];
        if columns.iter().all(Option::is_none) && self.input.lines().is_none() {
            return Ok((labels, left_out));
        }
        self.each(|line, record| {
            let cell = |place: Option<usize>| {
                let text = record.get(place?)?.trim().to_owned();
                Some(text).filter(|own| !own.is_empty())
            };
            let label = Label {
                name: cell(named),
                repeat: cell(repeat),
                approach: cell(approach),
            };
            if label != Label::default() {
                labels.insert(line, label);
            }
            let outside = self.input.lines().is_some_and(|own| !own.contains(&line));
            let unused = match cell(used).map(|own| own.to_ascii_lowercase()).as_deref() {
                None | Some("1" | "yes" | "true") => false,
                Some("0" | "no" | "false" | "-") => true,
                Some(other) => {
                    let cause = format!("{other} is neither 1 (use the row) nor 0");
                    return Err(InputError::new(self.input.name(), cause)
                        .at_line(line)
                        .at_column(USE));
                }
            };
            if outside || unused {
                left_out.insert(line);
            }
            Ok(())
        })?;
        Ok((labels, left_out))
    }

    /// The lines in which the cell of a quantity says that it was not measured.
    pub(super) fn unmeasured(&self, quantity: Quantity) -> Result<HashSet<u64>, InputError> {
        let place = self.column(quantity).map_or(usize::MAX, |own| own.place);
        let mut lines = HashSet::new();
        self.each(|line, record| {
            if record.is_unmeasured(place) {
                lines.insert(line);
            }
            Ok(())
        })?;
        Ok(lines)
    }

    /// Calls back for each record below the header, with its line; skips comments and empty lines.
    fn each(
        &self,
        mut take: impl FnMut(u64, Record<'_>) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        if let Some(columns) = self.input.cells() {
            let rows = columns.first().map_or(0, Cells::count);
            return (2..).zip(0..rows).try_for_each(|(line, row)| {
                halt::check();
                take(line, Record::Cells(columns, row))
            });
        }
        let nothing = |own: char| own == self.separator || own == '"' || own.is_whitespace();
        let lines = (1..).zip(self.input.text().split('\n'));
        for (line, text) in lines.skip_while(|(line, _)| *line <= self.line) {
            halt::check();
            let comment = text.trim_start_matches(['"', ' ', '\t']).starts_with('#');
            if comment || text.chars().all(nothing) {
                continue;
            }
            let Some(record) = fields(text, self.separator) else {
                let cause = "this line opens a quote \" and does not close it";
                return Err(InputError::new(self.input.name(), cause)
                    .at_line(line)
                    .with_remedy("delete the quotes: numbers need none"));
            };
            take(line, Record::Fields(&record))?;
        }
        Ok(())
    }

    /// A row must have as many fields as the header; fields without a name may be empty or absent.
    fn check_length(&self, line: u64, record: &[Cow<'_, str>]) -> Result<(), InputError> {
        let (found, expected) = (record.len(), self.names.len());
        let named = |place: usize| {
            let name = self.names.get(place);
            name.is_some_and(|name| self.others || !name.is_empty())
        };
        let fault = |cause: String| InputError::new(self.input.name(), cause).at_line(line);
        let other_length = || {
            let fields = count(found, "field");
            fault(format!("the row has {fields} and the header {expected}"))
        };
        if let Some(place) = (found..expected).find(|place| named(*place)) {
            if let Some(cause) = self.separated_otherwise(record) {
                return Err(fault(cause).with_remedy("separate all fields in the same way"));
            }
            return Err(other_length()
                .at_column(&self.names[place])
                .with_remedy("this is the first column that is missing"));
        }
        let mut fields = record.iter().enumerate();
        let too_many = fields.find(|(place, field)| !(named(*place) || field.is_empty()));
        let Some((place, field)) = too_many else {
            return Ok(());
        };
        if place < expected {
            let number = place + 1;
            let cause = format!("\"{field}\" is in column {number}, which has no name");
            return Err(fault(cause).with_remedy(KNOWN));
        }
        let remedy = if self.separator == ',' && found == 2 * expected {
            "this looks like decimal commas: separate the fields by semicolons, or write decimal points"
        } else {
            "delete what follows this column; if commas are decimal, separate the fields by semicolons"
        };
        let last = &self.names[expected - 1];
        Err(other_length().at_column(last).with_remedy(remedy))
    }

    /// The separator that a row seems to use instead of the header's, if it is obvious.
    fn separated_otherwise(&self, record: &[Cow<'_, str>]) -> Option<String> {
        let [line] = record else { return None };
        let named = |is: &dyn Fn(char) -> bool| SEPARATORS.iter().find(|(own, _)| is(*own));
        let (_, header) = named(&|own| own == self.separator)?;
        let (_, row) = named(&|own| own != self.separator && line.contains(own))?;
        Some(format!(
            "the fields of this row are separated by {row}, those of the header by {header}"
        ))
    }
}

/// Whether a column has a name and is not to be ignored.
fn is_named(name: &str) -> bool {
    !(name.is_empty() || name.starts_with(IGNORED))
}

/// Whether a name looks as if it were an uncertainty: U95, Ux, Uncertainty, sigma X.
fn is_uncertainty(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let word = name
        .split(|own: char| !own.is_alphanumeric())
        .next()
        .unwrap_or_default();
    let of_u = ["ux", "uy", "uz", "uxyz", "u95", "u99", "uk2", "uc"].contains(&word);
    of_u || ["sigma", "uncert", "unsicher", "std"]
        .iter()
        .any(|own| word.starts_with(own))
}

/// The line of column names and its number; `None` if the file holds only comments. Lines that an instrument writes
/// above it are skipped: then the first line is no header, and exactly one of the following lines is.
fn header(input: &InputText) -> Option<(u64, &str)> {
    let written = |line: &str| !(line.trim().is_empty() || line.trim_start().starts_with('#'));
    let lines = (1..).zip(input.text().split('\n'));
    let mut lines = lines.filter(|(_, line)| written(line));
    let is_header = |(_, line): &(u64, &str)| separated(input, line).1 >= LEAST_COLUMNS;
    let first = lines.next()?;
    if is_header(&first) {
        return Some(first);
    }
    let mut others = lines.take(MOST_ABOVE).filter(is_header);
    match (others.next(), others.next()) {
        (Some(only), None) => Some(only),
        _ => Some(first),
    }
}

/// The separator of a header's names, and the number of known names with it: the separator that gives most known names,
/// or else one that separates anything.
fn separated(input: &InputText, header: &str) -> (char, usize) {
    let known = |name: &&String| {
        input.columns().of_column(name).is_some() || ColumnName::recognise(name).is_some()
    };
    let mut best = (',', 0);
    for (separator, _) in SEPARATORS {
        let found = names(header, separator).iter().filter(known).count();
        if found > best.1 {
            best = (separator, found);
        }
    }
    if best.1 == 0 {
        let separates = |own: &char| names(header, *own).len() > 1;
        best.0 = [';', '\t', ',', ' ']
            .into_iter()
            .find(separates)
            .unwrap_or(',');
    }
    best
}

/// The names of a header; `q1 [deg]` is one name with any separator.
fn names(header: &str, separator: char) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let whole = || vec![header.trim().into()];
    for field in fields(header, separator).unwrap_or_else(whole) {
        match names.last_mut() {
            Some(last) if separator == ' ' && field.starts_with(['[', '(']) => {
                last.push(' ');
                last.push_str(&field);
            }
            _ => names.push(field.into_owned()),
        }
    }
    names
}

/// The fields of a line; `None` for an unclosed quote.
fn fields(line: &str, separator: char) -> Option<Vec<Cow<'_, str>>> {
    if !line.contains('"') {
        return Some(match separator {
            ' ' => line.split_whitespace().map(Cow::Borrowed).collect(),
            _ => line.split(separator).map(|own| own.trim().into()).collect(),
        });
    }
    // A number never spans lines, so a field that does starts with an unclosed quote.
    let line = match separator {
        ' ' => line.split_whitespace().collect::<Vec<_>>().join(" ") + "\n-",
        _ => format!("{line}\n-"),
    };
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(u8::try_from(separator).unwrap_or(b','))
        .from_reader(line.as_bytes());
    let mut record = StringRecord::new();
    reader.read_record(&mut record).ok()?;
    let fields = record.iter().map(|own| own.trim().to_owned().into());
    (!record.as_slice().contains('\n')).then(|| fields.collect())
}

impl TableRow<'_> {
    /// Three required numbers, in radians or millimetres.
    pub(super) fn numbers(&self, quantities: [Quantity; 3]) -> Result<[f64; 3], InputError> {
        let [first, second, third] = quantities.map(|quantity| self.number(quantity));
        Ok([first?, second?, third?])
    }

    /// A number in radians or millimetres; `None` if the column is missing or the cell is empty.
    pub(super) fn optional(&self, quantity: Quantity) -> Result<Option<f64>, InputError> {
        let there = self.holds(quantity);
        there.then(|| self.number(quantity)).transpose()
    }

    /// Whether the cell holds something.
    pub(super) fn holds(&self, quantity: Quantity) -> bool {
        let column = self.table.column(quantity);
        column.is_some_and(|own| self.record.is_filled(own.place))
    }

    /// The text of a non-empty cell.
    pub(super) fn text(&self, quantity: Quantity) -> Option<Cow<'_, str>> {
        let column = self.table.column(quantity)?;
        let filled = self.record.is_filled(column.place);
        filled.then(|| self.record.get(column.place)).flatten()
    }

    /// Whether a cell says that it was not measured.
    pub(super) fn is_unmeasured(&self) -> bool {
        let cells = match self.record {
            Record::Fields(fields) => fields.len(),
            Record::Cells(columns, _) => columns.len(),
        };
        (0..cells).any(|place| self.record.is_unmeasured(place))
    }

    /// The rotation vector in radians, if the row has one. Its unit matters where the robot's rods are known.
    pub(super) fn turn(&self, robot: &RobotFile) -> Result<Option<Vector3<f64>>, InputError> {
        if !Quantity::TURNS.iter().any(|own| self.holds(*own)) {
            return Ok(None);
        }
        if !Quantity::COORDINATES.iter().all(|own| self.holds(*own)) {
            let cause = "the row has a rotation and not all of x, y and z";
            return Err(self.fault_of(Quantity::TURNS[0], cause));
        }
        for column in Quantity::TURNS.map(|own| self.table.column(own)) {
            if let Some(own) = column.filter(|own| !own.stated && robot.parallelograms.is_some()) {
                return Err(self.table.without_unit(own, "its unit is not stated"));
            }
        }
        Ok(Some(self.numbers(Quantity::TURNS)?.into()))
    }

    /// Joint angles in radians or travels in mm, within the limits plus a margin.
    pub(super) fn joints(&self, robot: &RobotFile) -> Result<[f64; 3], InputError> {
        self.joints_in(Quantity::joints(robot.limits.drive()), robot)
    }

    /// The same for other columns.
    pub(super) fn joints_in(
        &self,
        quantities: [Quantity; 3],
        robot: &RobotFile,
    ) -> Result<[f64; 3], InputError> {
        let joints = self.numbers(quantities)?;
        for (joint, quantity) in joints.into_iter().zip(quantities) {
            if quantity.is_angle() && joint.abs() > MOST_TURNS * TAU {
                let cause = "the number is no angle of an arm";
                return Err(self.fault_of(quantity, cause).with_remedy(
                    "if these are encoder counts, name the columns q1_counts,q2_counts,q3_counts and state counts_per_deg in \
                     [convention]",
                ));
            }
            if let Some(cause) = robot.outside_limits(joint) {
                return Err(self.fault_of(quantity, cause).with_remedy(
                    "check the number, its sign, its unit in the header (_deg or _rad, of a travel _mm or _m) and \
                     [joints] in the robot file",
                ));
            }
        }
        Ok(joints)
    }

    fn number(&self, quantity: Quantity) -> Result<f64, InputError> {
        let Some(column) = self.table.column(quantity) else {
            return Err(self.fault_of(quantity, "the column is missing"));
        };
        let field = || self.record.get(column.place).unwrap_or_default();
        let mut numbers = self.numbers.borrow_mut();
        let read = match self.record.number(column.place) {
            Some(number) => Ok(number),
            None => numbers.read(self.line, column.place, &field()),
        };
        let read = read.and_then(|value| {
            if quantity.joint().is_some() && quantity.is_angle() && !column.stated {
                numbers.angle = numbers.angle.max(value.abs());
            }
            let value = self.table.convention.inwards(quantity, column.unit, value);
            possible(field, value)
        });
        read.map_err(|(cause, remedy)| self.fault_of(quantity, cause).with_remedy(remedy))
    }

    /// A fault in this row, in the actual or expected column of a quantity.
    pub(super) fn fault_of(&self, quantity: Quantity, cause: impl Into<String>) -> InputError {
        self.fault_of_row(cause)
            .at_column(self.table.name_of(quantity))
    }

    pub(super) fn fault_of_row(&self, cause: impl Into<String>) -> InputError {
        InputError::new(self.table.input.name(), cause).at_line(self.line)
    }
}

fn elsewhere(fault: InputError, what: &str) -> InputError {
    fault.with_remedy(format!(
        "if another table has the {what}, give it as well; {KNOWN}"
    ))
}

/// No arm's angle is more turns.
const MOST_TURNS: f64 = 10.0;
/// Larger numbers, in mm or rad, indicate a wrong unit or exponent.
const LARGEST: f64 = 1e9;

/// The notation of a table's numbers so far.
#[derive(Debug, Default)]
struct Numbers {
    /// The line of the first decimal point, or 0.
    point: u64,
    /// The first decimal comma: line, column and field.
    comma: Option<(u64, usize, String)>,
    /// Whether some comma cannot be a thousands separator.
    no_thousands: bool,
    /// The largest angle without a stated unit.
    angle: f64,
}

/// Cause and remedy.
type Fault = (String, &'static str);

const PLAIN: &str = "write all numbers with a decimal point and without a separator of thousands";

impl Numbers {
    fn read(&mut self, line: u64, column: usize, field: &str) -> Result<f64, Fault> {
        if let Ok(number) = field.parse() {
            if self.point == 0 && field.contains('.') {
                self.point = line;
                self.check_marks(field)?;
            }
            return Ok(number);
        }
        if let Some(number) = decimal_comma(field) {
            self.comma.get_or_insert((line, column, field.to_owned()));
            self.check_marks(field)?;
            self.no_thousands |= !thousands(field);
            return Ok(number);
        }
        let cause = match field {
            "" => "the field is empty".to_owned(),
            field => format!("\"{field}\" is not a number"),
        };
        Err((
            cause,
            "write numbers like -12.5 or 3e-2, with a decimal point",
        ))
    }

    /// Decimal points and decimal commas must not be mixed in a file.
    fn check_marks(&self, field: &str) -> Result<(), Fault> {
        let (Some((comma, ..)), point @ 1..) = (&self.comma, self.point) else {
            return Ok(());
        };
        let cause = if field.contains('.') {
            format!("\"{field}\" has a decimal point, and line {comma} has a decimal comma")
        } else {
            format!("\"{field}\" has a decimal comma, and line {point} has a decimal point")
        };
        Err((cause, PLAIN))
    }

    /// A comma that could be a thousands separator: line, column and cause. Programs that separate fields by semicolons
    /// do so because the comma is their decimal mark.
    fn doubtful_comma(&self, separator: char) -> Option<(u64, usize, String)> {
        let (line, column, field) = self.comma.as_ref()?;
        let (point, none) = (field.replace(',', "."), field.replace(',', ""));
        let cause = format!("\"{field}\" may be {point} or {none}");
        (separator != ';' && !self.no_thousands).then_some((*line, *column, cause))
    }
}

/// Whether the comma of `-12,345` could be a thousands separator.
fn thousands(field: &str) -> bool {
    let digits = field.trim_start_matches(['-', '+']);
    let (before, after) = digits.split_once(',').unwrap_or_default();
    before.len() <= 3 && !before.starts_with('0') && after.len() == 3
}

/// Accepts a number in radians or millimetres if it is plausible; `None` is a number of counts of unknown size.
fn possible<'a>(field: impl FnOnce() -> Cow<'a, str>, value: Option<f64>) -> Result<f64, Fault> {
    let (cause, remedy) = match value {
        None => (
            "the joint is in counts, and the robot file states no counts_per_deg".to_owned(),
            "state counts_per_deg in [convention]",
        ),
        Some(value) if !value.is_finite() => (
            format!("\"{}\" is not a finite number", field()),
            "leave out a row that was not measured, or measure it again",
        ),
        Some(value) if value.abs() > LARGEST => (
            format!("\"{}\" is too large", field()),
            "check the number and the unit in the header (_mm or _m)",
        ),
        Some(value) => return Ok(value),
    };
    Err((cause, remedy))
}
