//! What the TOML reader finds wrong, by section and key.

use super::schema::{Number, arm_key};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::text::words::decimal_comma;
use delta_cal::Parameter;
use delta_cal::robot::Drive;
use toml::Spanned;

pub(super) const SECTIONS: &str = "a robot file has [nominal] or three [[arm]], then [joints], and may have \
                        [tolerance], [noise], [sensor_frame], [planes.NAME], [points.NAME], \
                        [target], [robot] and [measurement]; `delta-cal calibrate --help` \
                        shows one";

/// That a file which is no TOML is a table.
pub(super) fn table_instead(input: &InputText) -> Option<InputError> {
    let mut lines = (1..).zip(input.text().lines());
    let (line, first) = lines.find(|(_, line)| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with('#')
    })?;
    let is_table = !first.contains(['=', '[']) && first.contains([',', ';', '\t']);
    is_table.then(|| {
        let cause = "this looks like a table of samples, and a robot file is needed here";
        InputError::new(input.name(), cause).at_line(line).with_remedy(
            "give the robot file (TOML) first and the table after it; delta-cal init writes a robot file",
        )
    })
}

/// What is wrong with a key.
pub(super) fn fault(
    input: &InputText,
    line: u64,
    key: &str,
    cause: impl Into<String>,
) -> InputError {
    InputError::new(input.name(), cause)
        .at_line(line)
        .at_key(with_section(input, line, key))
        .with_remedy(SECTIONS)
}

/// The same of what stands in the text.
pub(super) fn fault_at<T>(
    input: &InputText,
    number: &Spanned<T>,
    key: &str,
    cause: impl Into<String>,
) -> InputError {
    let line = input.line_at(number.span().start);
    input
        .fault_at(number.span(), cause)
        .at_key(with_section(input, line, key))
        .with_remedy(SECTIONS)
}

/// A key that the robot's drive needs; `section` begins in `line`.
pub(super) fn required<'a>(
    input: &InputText,
    line: u64,
    section: &str,
    key: &str,
    number: Option<&'a Number>,
) -> Result<&'a Number, InputError> {
    number.ok_or_else(|| {
        InputError::new(input.name(), "the key is missing")
            .at_line(line)
            .at_key(format!("{section} {key}"))
            .with_remedy(SECTIONS)
    })
}

/// A key that belongs to the other drive.
pub(super) fn foreign<T>(
    input: &InputText,
    drive: Drive,
    key: &str,
    stated: Option<&Spanned<T>>,
) -> Result<(), InputError> {
    let Some(stated) = stated else {
        return Ok(());
    };
    let cause = match drive {
        Drive::Rotary => "a robot whose motors turn its arms has no such key",
        Drive::Linear => "a robot with kind = \"linear\" has no such key",
    };
    Err(fault_at(input, stated, key, cause))
}

pub(super) fn finite(input: &InputText, key: &str, number: &Number) -> Result<f64, InputError> {
    let value = *number.as_ref();
    if value.is_finite() {
        Ok(value)
    } else {
        let cause = format!("{value} is not a finite number");
        Err(fault_at(input, number, key, cause))
    }
}

/// The TOML reader's error, with the section and the key at fault.
pub(super) fn syntax(input: &InputText, error: &toml::de::Error) -> InputError {
    let offset = error.span().map_or(0, |span| span.start);
    let line = input.line_at(offset);
    let message = error.message().trim().replace('\n', "; ");
    let fault = |cause: &str| {
        InputError::new(input.name(), cause)
            .at_line(line)
            .with_remedy(SECTIONS)
    };
    let text = line_text(input, line);
    let assignment = text.split_once('=').map(|(key, value)| (key.trim(), value));
    if let Some(key) = quoted_after(&message, "missing field ") {
        return match section_of(key) {
            Some(section) => fault("the key is missing").at_key(format!("{section} {key}")),
            None => fault(&format!("section [{key}] is missing")),
        };
    }
    if let Some(key) = quoted_after(&message, "unknown field ") {
        let expected = message.split_once(", ").map_or("", |(_, rest)| rest);
        return if text.trim_start().starts_with('[') && section_of(key).is_none() {
            fault(&format!("unknown section; {expected}")).at_key(format!("[{key}]"))
        } else {
            fault(&format!("unknown key; {expected}")).at_key(with_section(input, line, key))
        };
    }
    let Some((key, value)) = assignment else {
        return fault(&message);
    };
    let key = with_section(input, line, key);
    let value = value.split('#').next().unwrap_or_default().trim();
    if let Some(number) = decimal_comma(value.trim_matches('"')) {
        return fault(&format!("{value} is not a number"))
            .at_key(key)
            .with_remedy(format!("write {number}, with a decimal point"));
    }
    let cause = if message.starts_with("string values must be quoted") {
        format!("{value} is not a number")
    } else {
        message.replace("expected f64", "expected a number")
    };
    fault(&cause).at_key(key)
}

/// A key with its section before it, `[nominal] forearm_mm`, if that stands in a line above.
pub(super) fn with_section(input: &InputText, line: u64, key: &str) -> String {
    let above = usize::try_from(line).unwrap_or(usize::MAX);
    let headers = input.text().lines().take(above).filter_map(|line| {
        let line = line.trim_start();
        let end = line.rfind(']')?;
        let header = line.get(..=end)?;
        let name = header.trim_matches(['[', ']']);
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        (header.starts_with('[') && !name.is_empty() && name.chars().all(plain)).then_some(header)
    });
    match headers.last() {
        Some(header) if !key.starts_with('[') => format!("{header} {key}"),
        _ => key.to_owned(),
    }
}

fn line_text(input: &InputText, line: u64) -> &str {
    let index = usize::try_from(line).unwrap_or(usize::MAX);
    input.text().lines().nth(index - 1).unwrap_or_default()
}

/// The text in backticks after `before`.
fn quoted_after<'a>(message: &'a str, before: &str) -> Option<&'a str> {
    let rest = message.strip_prefix(before)?.strip_prefix('`')?;
    rest.split('`').next()
}

/// The section in which a key belongs.
fn section_of(key: &str) -> Option<&'static str> {
    match key {
        "base_radius_mm" | "platform_radius_mm" | "upper_arm_mm" | "forearm_mm"
        | "tower_radius_mm" | "tower_deg" | "kind" => Some("[nominal]"),
        "min_deg" | "max_deg" | "min_mm" | "max_mm" => Some("[joints]"),
        "length_mm" | "angle_deg" | "zero_mm" | "radius_mm" => Some("[tolerance]"),
        "position_mm" | "joint_deg" | "joint_mm" => Some("[noise]"),
        "rotation" | "translation_mm" => Some("[sensor_frame]"),
        key if arm_keys().any(|own| own == key) => Some("[[arm]]"),
        _ => None,
    }
}

fn arm_keys() -> impl Iterator<Item = &'static str> {
    let parameters = Parameter::ROTARY.into_iter().chain(Parameter::LINEAR);
    parameters.map(arm_key)
}
