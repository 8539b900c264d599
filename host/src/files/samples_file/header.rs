//! The header of a table: which column holds what.

use super::records::{IGNORED, Records};
use crate::files::columns::{COUNT, ColumnName, Quantity, Unit};
use crate::files::convention::Convention;
use crate::files::input::InputError;
use crate::text::{count, list};
use csv::StringRecord;

pub(super) const KNOWN: &str = "the columns are q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm (or _rad, and _cm, _m, \
                                _um, _in), or in place of the last three height_mm,plane or \
                                distance_mm,point or distance_mm,to_q1_deg,to_q2_deg,to_q3_deg, in any \
                                order, and sigma_mm or u_k2_mm (k = 2), the uncertainty of the row; with a linear drive s1_mm… and to_s1_mm… instead of q1_deg… and \
                                to_q1_deg…; the program ignores columns whose name begins with _";

/// What is done with the cells of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Use {
    Read(Column),
    Ignored,
    /// It has no name, so its cells must be empty.
    Unnamed,
}

/// A column that is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Column {
    /// Counted from 0.
    pub(super) place: usize,
    pub(super) quantity: Quantity,
    pub(super) unit: Unit,
    /// Whether its name or the command line states the unit.
    pub(super) stated: bool,
}

/// A header that was understood.
pub(super) struct Header {
    /// The file's name.
    file: String,
    line: u64,
    separator: char,
    names: Vec<String>,
    uses: Vec<Use>,
    /// By the number of their quantity.
    columns: [Option<Column>; COUNT],
    convention: Convention,
    /// Whether columns that are not known are left to another file.
    lenient: bool,
}

impl Header {
    pub(super) fn new(
        records: &Records<'_>,
        convention: &Convention,
        lenient: bool,
    ) -> Result<Self, InputError> {
        let mut header = Self {
            file: records.input().name().to_owned(),
            line: records.header_line,
            separator: records.separator(),
            names: records.header.clone(),
            uses: Vec::new(),
            columns: [None; COUNT],
            convention: *convention,
            lenient,
        };
        let motive = records.input().text().starts_with("Format Version");
        if motive && !lenient && !header.has_joints() {
            return Err(header.motive());
        }
        if !lenient {
            header.check_mapping(records)?;
        }
        for place in 0..header.names.len() {
            let used = header.use_of(records, place)?;
            if let Use::Read(column) = used {
                let own = &mut header.columns[column.quantity as usize];
                if let Some(other) = own.replace(column) {
                    let name = header.name(other.place);
                    let cause = format!("the column repeats column {name} before it");
                    return Err(header.fault(cause).at_column(header.name(place)));
                }
            }
            header.uses.push(used);
        }
        header.leave_labels();
        Ok(header)
    }

    /// Without distances a column `point` names the poses.
    fn leave_labels(&mut self) {
        if self.columns[Quantity::Distance as usize].is_none()
            && let Some(column) = self.columns[Quantity::Point as usize].take()
        {
            self.uses[column.place] = Use::Ignored;
        }
    }

    /// Every column of `--columns` is there, once.
    fn check_mapping(&self, records: &Records<'_>) -> Result<(), InputError> {
        for mapped in records.input().columns().all() {
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
            let names: Vec<_> = (1..)
                .zip(&self.names)
                .map(|(number, name)| format!("{number} {name}"))
                .collect();
            return Err(self
                .fault(cause)
                .at_column(&mapped.column)
                .with_remedy(format!(
                    "the columns of the file are {}; a number chooses one, as in --columns x_m=7",
                    list(&names)
                )));
        }
        Ok(())
    }

    fn use_of(&self, records: &Records<'_>, place: usize) -> Result<Use, InputError> {
        let (name, mapping) = (self.name(place), records.input().columns());
        let read = |name: ColumnName| {
            Use::Read(Column {
                place,
                quantity: name.quantity,
                unit: name.unit.unwrap_or(self.convention.unit_of(name.quantity)),
                stated: name.unit.is_some() || self.convention.states_unit_of(name.quantity),
            })
        };
        let numbered = mapping.of_place(place, &self.names);
        if let Some(mapped) = mapping.of_column(name).or(numbered) {
            return Ok(read(mapped));
        }
        if name.is_empty() {
            let others = self.lenient || !mapping.is_empty();
            return Ok(if others { Use::Ignored } else { Use::Unnamed });
        }
        if name.starts_with(IGNORED) {
            return Ok(Use::Ignored);
        }
        match ColumnName::recognise(name) {
            Some(own) if !mapping.has(own.quantity) => Ok(read(own)),
            _ if name.replace(',', ".").parse::<f64>().is_ok() => Err(self.without_header()),
            _ if self.lenient || !mapping.is_empty() => Ok(Use::Ignored),
            _ => {
                let (cause, before) = if name.starts_with('[') {
                    let cause =
                        "this looks like a robot file, and a table of samples is needed here";
                    (cause, "give the robot file first and the table after it")
                } else {
                    let before = "if the program is to ignore the column, write _ before its name; if \
                                  not, --columns says what it holds";
                    ("unknown column", before)
                };
                Err(self
                    .fault(cause)
                    .at_column(name)
                    .with_remedy(format!("{before}; {KNOWN}")))
            }
        }
    }

    /// That the first line holds numbers.
    fn without_header(&self) -> InputError {
        let columns = count(self.names.len(), "column");
        let usual = self.convention.joint_columns().into_iter();
        let usual: Vec<_> = usual.chain(self.convention.position_columns()).collect();
        let separator = self.separator.to_string();
        let remedy = match self.names.len() {
            6 => format!(
                "write a header above the numbers: {} if that is what they are",
                usual.join(&separator)
            ),
            3 => format!(
                "three columns are the joints or the positions alone: write {} or {} above the numbers and give both files, \
                 joints first, or paste them side by side",
                usual[..3].join(&separator),
                usual[3..].join(&separator)
            ),
            _ => format!("write a header above the numbers; {KNOWN}"),
        };
        InputError::new(
            &self.file,
            format!(
                "the first line must name the columns, but this is a number: no header, {columns}"
            ),
        )
        .at_line(self.line)
        .with_remedy(remedy)
    }

    /// Whether a name is that of a joint, before any column is read.
    fn has_joints(&self) -> bool {
        let mut names = self.names.iter();
        names.any(|name| {
            ColumnName::recognise(name).is_some_and(|own| own.quantity.joint().is_some())
        })
    }

    /// That this is what Motive exports.
    fn motive(&self) -> InputError {
        let cause = format!(
            "this is a Motive export: its columns stand in line {}, and it has no joint angles",
            self.line
        );
        InputError::new(&self.file, cause)
            .at_line(self.line)
            .with_remedy(
                "give the joints in a file of their own before it, or paste them beside; --columns x_m=7,y_m=8,z_m=9 says \
                 by number which X, Y and Z are the position",
            )
    }

    pub(super) fn column(&self, quantity: Quantity) -> Option<&Column> {
        self.columns[quantity as usize].as_ref()
    }

    /// All of them, as the file has them.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Those of columns that are not read.
    pub(super) fn unread(&self) -> Vec<String> {
        let named = self.names.iter().zip(&self.uses);
        let unread = named
            .filter(|(_, used)| matches!(used, Use::Ignored))
            .filter(|(name, _)| !name.starts_with(IGNORED));
        unread.map(|(name, _)| name.clone()).collect()
    }

    /// As the file has it.
    pub(super) fn name(&self, place: usize) -> &str {
        self.names.get(place).map_or("", String::as_str)
    }

    /// Every one of these quantities must have a column, and lengths a unit.
    pub(super) fn require(&self, quantities: &[Quantity]) -> Result<(), InputError> {
        for quantity in quantities {
            let usual = self.convention.column(*quantity);
            let Some(column) = self.column(*quantity) else {
                let other = if quantity.is_angle() {
                    quantity.column(Unit::Radian)
                } else {
                    quantity.column(Unit::Metre)
                };
                let fault = self
                    .fault("the column is missing")
                    .at_column(format!("{usual} (or {other})"));
                return Err(match self.of_other_drive(*quantity) {
                    Some(remedy) => fault.with_remedy(remedy),
                    None => fault,
                });
            };
            if !(column.stated || quantity.is_angle()) {
                return Err(self.without_unit(column, "its unit is not stated"));
            }
        }
        Ok(())
    }

    /// That the file has the joints of a robot of the other kind.
    fn of_other_drive(&self, missing: Quantity) -> Option<&'static str> {
        match missing {
            Quantity::Travel1 if self.column(Quantity::Joint1).is_some() => Some(
                "this file holds joint angles, and carriages drive the robot of the robot file: give the robot file \
                 that belongs to these samples",
            ),
            Quantity::Joint1 if self.column(Quantity::Travel1).is_some() => Some(
                "this file holds the travels of carriages, and motors turn the arms of the robot file: give the robot \
                 file that belongs to these samples",
            ),
            _ => None,
        }
    }

    /// Angles without a unit that may be radians.
    pub(super) fn check_angles(&self) -> Result<(), InputError> {
        let mut columns = self.columns.iter().flatten();
        match columns.find(|column| column.quantity.is_angle() && !column.stated) {
            Some(column) => Err(self.without_unit(
                column,
                "its unit is not stated, and no angle is so large that it must be in degrees",
            )),
            None => Ok(()),
        }
    }

    fn without_unit(&self, column: &Column, cause: &str) -> InputError {
        let separator = self.separator.to_string();
        let wanted = self.uses_as_named().join(&separator);
        let name = self.name(column.place);
        let usual = column.quantity.column(column.unit);
        self.fault(cause).at_column(name).with_remedy(format!(
            "write the units into the header, {wanted} if these are the units, or state them with \
             --columns, as --columns {usual}={name}"
        ))
    }

    /// The header with a unit in every name.
    fn uses_as_named(&self) -> Vec<String> {
        let named = self.names.iter().zip(&self.uses);
        let named = named.map(|(name, used)| match used {
            Use::Read(column) => column.quantity.column(column.unit),
            Use::Ignored | Use::Unnamed => name.clone(),
        });
        named.collect()
    }

    /// A row must have as many fields as the header; those without a name are empty or not there.
    pub(super) fn check_length(
        &self,
        records: &Records<'_>,
        line: u64,
        record: &StringRecord,
    ) -> Result<(), InputError> {
        let (found, expected) = (record.len(), self.names.len());
        if found == expected && !self.uses.contains(&Use::Unnamed) {
            return Ok(());
        }
        let at_line = |cause: String| InputError::new(&self.file, cause).at_line(line);
        let missing = self.uses.iter().skip(found);
        if let Some(place) = missing
            .enumerate()
            .find(|(_, used)| **used != Use::Unnamed)
            .map(|(place, _)| found + place)
        {
            if let Some(cause) = records.separated_otherwise(record) {
                return Err(at_line(cause).with_remedy("separate all fields in the same way"));
            }
            let fields = count(found, "field");
            let cause = format!("the row has {fields} and the header {expected}");
            return Err(at_line(cause)
                .at_column(self.name(place))
                .with_remedy("this is the first column that is missing"));
        }
        let unnamed = |place: usize| {
            self.uses
                .get(place)
                .is_none_or(|used| *used == Use::Unnamed)
        };
        let mut fields = record.iter().enumerate();
        let Some((place, field)) =
            fields.find(|(place, field)| unnamed(*place) && !field.trim().is_empty())
        else {
            return Ok(());
        };
        if place < expected {
            let cause = format!(
                "\"{}\" stands in column {}, which has no name",
                field.trim(),
                place + 1
            );
            return Err(at_line(cause).with_remedy(KNOWN));
        }
        let cause = format!(
            "the row has {} and the header {expected}",
            count(found, "field")
        );
        let remedy = if self.separator == ',' && found == 2 * expected {
            "this looks like decimal commas: separate the fields by semicolons, or write decimal points"
        } else {
            "the row continues after this column; decimal commas have this effect as well"
        };
        Err(at_line(cause)
            .at_column(self.name(expected - 1))
            .with_remedy(remedy))
    }

    fn fault(&self, cause: impl Into<String>) -> InputError {
        InputError::new(&self.file, cause)
            .at_line(self.line)
            .with_remedy(KNOWN)
    }
}
