//! A robot file and a samples file, calibrated as the command does.

use crate::files::{alike, refused, text};
use crate::numbers::Source;
use crate::promises::{finite_outcome, finite_robot};
use delta_cal::calibration::Solver;
use delta_cal::robust::Loss;
use delta_cal_host::accuracy::coverage::Acceptance;
use delta_cal_host::render::json;
use delta_cal_host::report::calibration::{self, html, observations, table};
use delta_cal_host::report::document::{About, Document, Source as Origin};
use delta_cal_host::{
    CalibrateError, CalibrationMethod, Frame, InputText, Measurements, Options, Reason, RobotFile,
    Streaming, calibrate, calibrate_observations, read_samples,
};
use serde_json::Value;
use std::fmt::Debug;
use std::num::NonZeroU32;

const ROBOT: &str = "robot.toml";
const SAMPLES: &str = "samples.csv";
/// The line between the two files.
const BETWEEN: &[u8] = b"\n---\n";
/// Longer samples files take longer and lead nowhere else.
const MOST_ROWS: usize = 64;
/// mm; nothing is refused because of it.
const LIMIT: f64 = 0.1;

/// Four bytes of options, as digits in the seeds, then both files.
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
    };
    let report = match read_samples(&samples_text, &file, options) {
        Err(error) => Err(error),
        Ok(Measurements::Positions(samples)) => calibrate(&file, &samples, options).map(|report| {
            finite_outcome(&report.outcome.fit);
            finite(&report);
            let lines = report.sample_errors.iter().map(|sample| sample.line);
            assert!(lines.eq(samples.rows.iter().map(|row| row.line)));
            let acceptance = report.acceptance(LIMIT);
            let about = about(&document, &acceptance);
            if page {
                html::render(&report, &about).expect("every figure can be drawn");
            }
            shown(&table::render(&report, &about), data);
            parsed(&calibration::json::report(&report, &about));
            report.after
        }),
        Ok(Measurements::Observations(samples)) => calibrate_observations(&file, &samples, options)
            .map(|report| {
                finite_outcome(&report.fit.outcome.fit);
                finite(&report);
                assert_eq!(report.fit.residuals.len(), samples.rows.len());
                let acceptance = report.acceptance(LIMIT);
                let about = about(&document, &acceptance);
                if page {
                    let _ = observations::html(&report, &about);
                }
                shown(&observations::text(&report, &about), data);
                parsed(&observations::json(&report, &about));
                report.after
            }),
    };
    match report {
        Err(error) => explained(&error, [(ROBOT, robot), (SAMPLES, samples)]),
        Ok(after) => {
            finite_robot(&after.robot);
            let written = after.to_toml(&document.comment());
            match RobotFile::read(&InputText::new(ROBOT, &written)) {
                Ok(again) => assert!(alike(&again, &after), "{written}"),
                Err(error) => panic!("{error}:\n{written}"),
            }
        }
    }
}

/// As the command's options can be.
fn options(source: &mut Source<'_>) -> Options {
    let (fit, case, stream) = (source.byte(), source.byte(), source.byte() & 0xf);
    Options {
        method: match fit & 3 {
            1 => CalibrationMethod::Ikm,
            2 => CalibrationMethod::Fkm,
            _ => CalibrationMethod::Joint,
        },
        loss: match fit >> 2 & 3 {
            1 => Some(Loss::Huber),
            2 => Some(Loss::Tukey),
            _ => None,
        },
        solver: if case & 1 == 0 {
            Solver::LevenbergMarquardt
        } else {
            Solver::GaussNewton
        },
        frame: if case & 2 == 0 {
            Frame::Base
        } else {
            Frame::Sensor
        },
        no_guess: case & 4 != 0,
        streaming: Streaming {
            gate: case & 8 != 0,
            held_out: NonZeroU32::new(u32::from(stream & 7)).filter(|_| stream < 8),
            forget: NonZeroU32::new(u32::from(stream & 7) * 8).filter(|_| stream >= 8),
        },
    }
}

fn about<'a>(document: &'a Document, acceptance: &'a Acceptance) -> About<'a> {
    About {
        origin: None,
        document: Some(document),
        acceptance: Some(acceptance),
    }
}

/// No number of a report is infinite or none: all of it, as `Debug` shows it, but for what is quoted.
fn finite(report: &impl Debug) {
    let text = format!("{report:?}")
        .replace("\\\\", "")
        .replace("\\\"", "");
    let unquoted = text.split('"').step_by(2);
    for part in unquoted {
        let mut words = part.split(|c: char| !c.is_alphanumeric());
        assert!(!words.any(|word| matches!(word, "NaN" | "inf")), "{text}");
    }
}

/// Nor does the terminal show one, unless the input itself says so.
fn shown(table: &str, data: &[u8]) {
    let own = String::from_utf8_lossy(data).to_lowercase();
    if !own.contains("nan") && !own.contains("inf") {
        let mut words = table.split(|c: char| !c.is_alphanumeric());
        assert!(!words.any(|word| matches!(word, "NaN" | "inf")), "{table}");
    }
}

/// What programs are told.
fn parsed(report: &Value) {
    let again: Value = serde_json::from_str(&json::text(report)).expect("JSON");
    assert!(again["schema_version"].is_u64(), "{again}");
}

/// A refusal names a file and a line that it has, or says what to do next; programs are told the same.
fn explained(error: &CalibrateError, files: [(&str, &[u8]); 2]) {
    let message = error.to_string();
    if let Reason::Input(error) = &error.reason {
        let named = files.iter().find(|(name, _)| message.starts_with(name));
        let (name, data) = named.expect("a file is named");
        return refused(name, data, error);
    }
    assert!(!message.trim().is_empty() && !message.contains(['\n', '\r']));
    let remedy = error.remedy().unwrap_or_default();
    assert!(!remedy.trim().is_empty(), "{message}");
    if error.refused() {
        parsed(&calibration::json::refusal(error));
    }
}
