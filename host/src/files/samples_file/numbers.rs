//! The numbers of a table, with decimal points or decimal commas.

use crate::text::decimal_comma;
use std::cell::{Cell, RefCell};
use std::f64::consts::TAU;

/// Larger numbers, in mm or rad, indicate a wrong unit or exponent.
const LARGEST: f64 = 1e9;

/// What has been learnt about the numbers of a table so far.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    /// The line of the first decimal point, or 0.
    point: Cell<u64>,
    /// The first decimal comma: line, column and field.
    comma: RefCell<Option<(u64, usize, String)>>,
    /// Whether some comma cannot be a thousands separator.
    no_thousands: Cell<bool>,
    /// The largest angle without a stated unit.
    angle: Cell<f64>,
}

/// Cause and remedy.
pub(super) type Fault = (String, &'static str);

impl Numbers {
    pub(super) fn read(&self, line: u64, column: usize, field: &str) -> Result<f64, Fault> {
        if let Ok(number) = field.parse() {
            if self.point.get() == 0 && field.contains('.') {
                self.point.set(line);
                self.check_marks(field)?;
            }
            return Ok(number);
        }
        if let Some(number) = decimal_comma(field) {
            if self.comma.borrow().is_none() {
                *self.comma.borrow_mut() = Some((line, column, field.to_owned()));
            }
            self.check_marks(field)?;
            self.no_thousands
                .set(self.no_thousands.get() || !thousands(field));
            return Ok(number);
        }
        let cause = if field.is_empty() {
            "the field is empty".to_owned()
        } else {
            format!("\"{field}\" is not a number")
        };
        Err((
            cause,
            "write numbers like -12.5 or 3e-2, with a decimal point",
        ))
    }

    /// Decimal points and decimal commas must not be mixed in a file.
    fn check_marks(&self, field: &str) -> Result<(), Fault> {
        let comma = self.comma.borrow();
        let (Some((with_comma, ..)), with_point @ 1..) = (comma.as_ref(), self.point.get()) else {
            return Ok(());
        };
        let cause = if field.contains('.') {
            format!("\"{field}\" has a decimal point, and line {with_comma} has a decimal comma")
        } else {
            format!("\"{field}\" has a decimal comma, and line {with_point} has a decimal point")
        };
        Err((
            cause,
            "write all numbers with a decimal point and without a separator of thousands",
        ))
    }

    /// A comma that could be a thousands separator: line, column and cause. Programs that separate fields by semicolons
    /// do so because the comma is their decimal mark.
    pub(super) fn doubtful_comma(&self, separator: char) -> Option<(u64, usize, String)> {
        if separator == ';' || self.no_thousands.get() {
            return None;
        }
        let (line, column, field) = self.comma.take()?;
        let (point, none) = (field.replace(',', "."), field.replace(',', ""));
        Some((
            line,
            column,
            format!("\"{field}\" may be {point} or {none}"),
        ))
    }

    pub(super) fn angle_without_unit(&self, value: f64) {
        self.angle.set(self.angle.get().max(value.abs()));
    }

    /// Whether some angle without a stated unit would exceed a full turn in radians.
    pub(super) fn must_be_degrees(&self) -> bool {
        self.angle.get() > TAU
    }
}

/// Whether the comma of `-12,345` could be a thousands separator.
fn thousands(field: &str) -> bool {
    let digits = field.trim_start_matches(['-', '+']);
    let (before, after) = digits.split_once(',').unwrap_or_default();
    before.len() <= 3 && !before.starts_with('0') && after.len() == 3
}

/// Accepts a number in radians or millimetres if it is plausible.
pub(super) fn possible(field: &str, value: f64) -> Result<f64, Fault> {
    if !value.is_finite() {
        return Err((
            format!("\"{field}\" is not a finite number"),
            "leave out a row that was not measured, or measure it again",
        ));
    }
    if value.abs() > LARGEST {
        return Err((
            format!("\"{field}\" is too large"),
            "check the number and the unit in the header (_mm or _m)",
        ));
    }
    Ok(value)
}
