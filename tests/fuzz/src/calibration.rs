//! Calibrates a robot file and a samples file as the command does.

use crate::files::{alike, refused, text};
use crate::numbers::{Source, finite_robot};
use delta_cal_host::report::calibration::comment;
use delta_cal_host::report::document::{Document, Source as Origin};
use delta_cal_host::{
    CalibrateError, Frame, InputText, Method, Options, RobotFile, calibrate, read_samples,
};
use serde_json::Value;

const ROBOT: &str = "robot.toml";
const SAMPLES: &str = "samples.csv";
/// Separator of the two files.
const BETWEEN: &[u8] = b"\n---\n";
/// Longer samples files are slower and reach no other code.
const MOST_ROWS: usize = 64;
/// The accuracy limit, mm; it causes no refusal.
const LIMIT: f64 = 0.1;

/// Input: four bytes of options (digits in the seeds), then both files.
pub fn calibration(data: &[u8]) {
    let (head, files) = data.split_at(data.len().min(4));
    let mut head = Source::new(head);
    let options = options(&mut head);
    let page = head.byte() == b'p';
    let between = files.windows(BETWEEN.len()).position(|at| at == BETWEEN);
    let Some((robot, samples)) = between.map(|at| (&files[..at], &files[at + BETWEEN.len()..]))
    else {
        return;
    };
    if samples.split(|byte| *byte == b'\n').count() > MOST_ROWS {
        return;
    }
    let (Some(robot_text), Some(samples_text)) = (text(ROBOT, robot), text(SAMPLES, samples))
    else {
        return;
    };
    let file = match RobotFile::read(&robot_text) {
        Err(error) => return refused(ROBOT, robot, &error),
        Ok(file) => file,
    };
    let document = Document {
        written: 0,
        record: file.record.clone(),
        robot: Origin::from(&robot_text),
        samples: Origin::from(&samples_text),
        beside: None,
        options: None,
    };
    let calibrated = read_samples(&samples_text, &file, &options)
        .and_then(|readings| Ok((calibrate(&file, &readings, &options)?, readings)));
    let (mut report, readings) = match calibrated {
        Err(error) => return explained(&error, [(ROBOT, robot), (SAMPLES, samples)]),
        Ok(both) => both,
    };
    finite_robot(&report.after.robot);
    assert!(
        report
            .solution
            .covariance
            .iter()
            .all(|entry| entry.is_finite())
    );
    let lines = report.samples.iter().map(|sample| sample.line);
    assert!(lines.eq(readings.rows.iter().map(|row| row.line)));
    report.document = Some(document);
    let report = report.with_limit(LIMIT);
    if page {
        let html = report.to_html();
        assert!(
            !html.contains("cannot be drawn"),
            "every figure can be drawn"
        );
    }
    shown(&report.to_text(), data);
    parsed(&report.to_json());
    let written = report.after.to_toml(&comment(&report, &readings));
    match RobotFile::read(&InputText::new(ROBOT, &written)) {
        Ok(again) => assert!(alike(&again, &report.after), "{written}"),
        Err(error) => panic!("{error}:\n{written}"),
    }
}

/// Any combination of the command's options.
fn options(source: &mut Source<'_>) -> Options {
    let (fit, case) = (source.byte(), source.byte());
    let _ = source.byte();
    Options {
        method: match fit & 3 {
            1 => Some(Method::Ikm),
            2 => Some(Method::Fkm),
            3 => Some(Method::Joint),
            _ => None,
        },
        robust: fit >> 2 & 1 == 1,
        frame: if case & 2 == 0 {
            Frame::Base
        } else {
            Frame::Sensor
        },
        of_printer: fit >> 4 & 1 == 1,
    }
}

/// The terminal shows neither NaN nor infinity unless the input contains them.
fn shown(table: &str, data: &[u8]) {
    let own = String::from_utf8_lossy(data).to_lowercase();
    if !own.contains("nan") && !own.contains("inf") {
        let mut words = table.split(|c: char| !c.is_alphanumeric());
        assert!(!words.any(|word| matches!(word, "NaN" | "inf")), "{table}");
    }
}

/// The report for programs is valid JSON with a schema version.
fn parsed(report: &str) {
    let again: Value = serde_json::from_str(report).expect("JSON");
    assert!(again["schema_version"].is_u64(), "{again}");
}

/// A refusal names a file and an existing line, or says what to do next; its JSON report is valid.
fn explained(error: &CalibrateError, files: [(&str, &[u8]); 2]) {
    let message = error.to_string();
    if let CalibrateError::Input(error) = error {
        let named = files.iter().find(|(name, _)| message.starts_with(name));
        let (name, data) = named.expect("a file is named");
        return refused(name, data, error);
    }
    assert!(!message.trim().is_empty() && !message.contains(['\n', '\r']));
    let remedy = error.remedy().unwrap_or_default();
    assert!(!remedy.trim().is_empty(), "{message}");
    parsed(&error.to_json());
}
