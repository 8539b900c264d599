//! A table of a TOML file: its values by key, with faults located in the file.

use crate::files::input::{InputError, InputText};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const REMEDY: &str = "`delta-cal init --output -` prints a robot file with every key (with towers, \
                      add --kind linear); numbers have a decimal point, text stands in quotation marks";

/// Most characters in a text entry, so that a certificate fits on one page.
const LONGEST: usize = 60;

/// No length, angle or count is larger.
const LARGEST: f64 = 1e9;

/// Parses the tables of a file, or returns the TOML parser's error.
pub(super) fn parse(input: &InputText) -> Result<Spanned<DeTable<'_>>, InputError> {
    DeTable::parse(input.text()).map_err(|error| {
        let place = error.span().unwrap_or_default();
        fault_at(input, place, &error.message().trim().replace('\n', "; "))
    })
}

fn fault_at(input: &InputText, place: Range<usize>, cause: &str) -> InputError {
    input.fault_at(place, cause).with_remedy(REMEDY)
}

/// One TOML table.
pub(super) struct Section<'a> {
    input: &'a InputText,
    place: Range<usize>,
    table: &'a DeTable<'a>,
}

impl<'a> Section<'a> {
    /// The whole file, with the sections it may have.
    pub(super) fn whole(
        input: &'a InputText,
        table: &'a DeTable<'a>,
        keys: &str,
    ) -> Result<Self, InputError> {
        let place = 0..0;
        let own = Self {
            input,
            place,
            table,
        };
        own.only(keys)?;
        Ok(own)
    }

    fn of(&self, value: &'a Spanned<DeValue<'a>>) -> Result<Self, InputError> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(Self {
                input: self.input,
                place: value.span(),
                table,
            }),
            other => {
                let cause = format!("invalid type: {}, expected a section", other.type_str());
                Err(fault_at(self.input, value.span(), &cause))
            }
        }
    }

    pub(super) fn place(&self) -> Range<usize> {
        self.place.clone()
    }

    pub(super) fn line(&self) -> u64 {
        self.input.line_at(self.place.start)
    }

    pub(super) fn fault(&self, cause: impl AsRef<str>) -> InputError {
        fault_at(self.input, self.place(), cause.as_ref())
    }

    /// Refuses keys other than these, which are separated by spaces.
    pub(super) fn only(&self, keys: &str) -> Result<(), InputError> {
        let known = |own: &&Spanned<_>| keys.split_whitespace().any(|key| key == own.get_ref());
        let Some(unknown) = self.table.keys().find(|own| !known(own)) else {
            return Ok(());
        };
        let cause = format!(
            "unknown field `{}`, expected one of `{}`",
            unknown.get_ref(),
            keys.trim().replace(' ', "`, `")
        );
        Err(fault_at(self.input, unknown.span(), &cause))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// The section of this name, with the keys it may have.
    pub(super) fn section(&self, key: &str, keys: &str) -> Result<Option<Self>, InputError> {
        let section = self.any_section(key)?;
        if let Some(section) = &section {
            section.only(keys)?;
        }
        Ok(section)
    }

    /// The section of this name, with any keys.
    pub(super) fn any_section(&self, key: &str) -> Result<Option<Self>, InputError> {
        self.table.get(key).map(|value| self.of(value)).transpose()
    }

    /// The named subsections of a section, with the keys they may have.
    pub(super) fn named(&self, key: &str, keys: &str) -> Result<Vec<(String, Self)>, InputError> {
        let Some(all) = self.any_section(key)? else {
            return Ok(Vec::new());
        };
        let sections = all.table.iter().map(|(name, value)| {
            let own = self.of(value)?;
            own.only(keys)?;
            Ok((name.get_ref().to_string(), own))
        });
        sections.collect()
    }

    /// The sections of a TOML array of tables.
    pub(super) fn repeated(&self, key: &str) -> Result<Vec<Self>, InputError> {
        match self.table.get(key) {
            None => Ok(Vec::new()),
            Some(value) => match value.get_ref() {
                DeValue::Array(all) => all.iter().map(|value| self.of(value)).collect(),
                _ => Ok(vec![self.of(value)?]),
            },
        }
    }

    pub(super) fn optional<T: Value>(&self, key: &str) -> Result<Option<T>, InputError> {
        let value = self.table.get(key).map(T::of).transpose();
        value.map_err(|(place, cause)| fault_at(self.input, place, &cause))
    }

    pub(super) fn get<T: Value>(&self, key: &str) -> Result<T, InputError> {
        self.optional(key)?.ok_or_else(|| self.missing(key))
    }

    pub(super) fn missing(&self, key: &str) -> InputError {
        self.fault(format!("missing field `{key}`"))
    }

    pub(super) fn number(&self, key: &str) -> Result<f64, InputError> {
        self.get(key)
    }

    /// A required number above 0.
    pub(super) fn positive(&self, key: &str) -> Result<f64, InputError> {
        self.get(key).map(|Positive(own)| own)
    }

    /// An optional number above 0.
    pub(super) fn optional_positive(&self, key: &str) -> Result<Option<f64>, InputError> {
        Ok(self.optional(key)?.map(|Positive(own)| own))
    }

    /// An optional key whose value is one of these words.
    pub(super) fn choice<T: Copy>(
        &self,
        key: &str,
        choices: &[(&str, T)],
    ) -> Result<Option<T>, InputError> {
        let Some(word) = self.optional::<String>(key)? else {
            return Ok(None);
        };
        let chosen = choices.iter().find(|(own, _)| *own == word);
        let Some((_, value)) = chosen else {
            let words: Vec<_> = choices.iter().map(|(own, _)| *own).collect();
            let cause = format!(
                "unknown variant `{word}`, expected one of `{}`",
                words.join("`, `")
            );
            let place = self.table.get(key).map_or(self.place(), Spanned::span);
            return Err(fault_at(self.input, place, &cause));
        };
        Ok(Some(*value))
    }
}

/// The bytes at fault and the cause.
type Fault = (Range<usize>, String);

/// A type that a key's value may have.
pub(super) trait Value: Sized {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault>;
}

/// A number above 0.
#[derive(Clone, Copy)]
pub(super) struct Positive(pub(super) f64);

/// One number for all three, or one for each.
pub(super) struct OneOrThree<T>(pub(super) [T; 3]);

fn no_value(value: &Spanned<DeValue<'_>>, expected: &str) -> Fault {
    let found = match value.get_ref() {
        DeValue::String(text) => format!("string {text:?}"),
        other => other.type_str().to_owned(),
    };
    let cause = format!("invalid type: {found}, expected {expected}");
    (value.span(), cause)
}

fn number(
    value: &Spanned<DeValue<'_>>,
    expected: &str,
    allowed: fn(f64) -> bool,
) -> Result<f64, Fault> {
    let number = match value.get_ref() {
        DeValue::Integer(own) => i64::from_str_radix(own.as_str(), own.radix())
            .map(|own| own as f64)
            .or_else(|_| own.as_str().parse())
            .ok(),
        DeValue::Float(own) => own.as_str().parse().ok(),
        _ => return Err(no_value(value, expected)),
    };
    match number {
        Some(number) if number.is_finite() && number.abs() > LARGEST => {
            let cause = format!("{number:e} is too large: lengths are in mm, angles in degrees");
            Err((value.span(), cause))
        }
        Some(number) if number.is_finite() && allowed(number) => Ok(number),
        number => {
            let number = number.unwrap_or(f64::INFINITY);
            let cause = format!("invalid value: {number}, expected {expected}");
            Err((value.span(), cause))
        }
    }
}

impl Value for f64 {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault> {
        number(value, "a number", |_| true)
    }
}

impl Value for Positive {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault> {
        number(value, "a number above 0", |own| own > 0.0).map(Self)
    }
}

impl<T: Value> Value for Vec<T> {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault> {
        match value.get_ref() {
            DeValue::Array(all) => all.iter().map(T::of).collect(),
            _ => Err(no_value(value, "numbers in brackets")),
        }
    }
}

impl<T: Value, const N: usize> Value for [T; N] {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault> {
        let values: Vec<T> = Vec::of(value)?;
        let cause = || format!("expected {N} of them in brackets");
        values.try_into().map_err(|_| (value.span(), cause()))
    }
}

impl<T: Value + Copy> Value for OneOrThree<T> {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault> {
        match value.get_ref() {
            DeValue::Array(all) if all.len() != 3 => {
                let cause = "expected one number, or three of them in brackets";
                Err((value.span(), cause.to_owned()))
            }
            DeValue::Array(_) => Value::of(value).map(Self),
            _ => T::of(value).map(|own| Self([own; 3])),
        }
    }
}

/// One short line; an unquoted number or date is accepted too.
impl Value for String {
    fn of(value: &Spanned<DeValue<'_>>) -> Result<Self, Fault> {
        let text = match value.get_ref() {
            DeValue::String(text) => text.trim().to_owned(),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.as_str().to_owned(),
            DeValue::Datetime(date) => date.to_string(),
            _ => return Err(no_value(value, "text in quotation marks")),
        };
        let cause = if text.is_empty() || text.contains(char::is_control) {
            "expected one line of text".to_owned()
        } else if text.chars().count() > LONGEST {
            format!("the text has more than {LONGEST} letters")
        } else {
            return Ok(text);
        };
        Err((value.span(), cause))
    }
}
