//! What all reports for programs have in common.

use serde_json::{Value, json};

/// A report: its `contents`, an object, after what says how to read it.
pub(crate) fn report(schema_version: u32, contents: Value) -> Value {
    let mut report = json!({
        "schema_version": schema_version,
        "program_version": env!("CARGO_PKG_VERSION"),
    });
    if let (Some(report), Value::Object(contents)) = (report.as_object_mut(), contents) {
        report.extend(contents);
    }
    report
}

/// As text, indented, ending in a new line.
pub fn text(report: &Value) -> String {
    format!("{report:#}\n")
}
