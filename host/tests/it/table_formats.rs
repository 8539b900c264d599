//! Tables in the forms that users have: the same numbers give the same calibration in any format.

use crate::support::{Folder, HEADER, NOMINAL, TOLERANCE, assert_refused, good_samples};
use std::fmt::Write;

/// The report of a calibration from these samples, without the file's name.
fn report(folder: &Folder, samples: &[u8], options: &str) -> serde_json::Value {
    folder.write("samples.csv", samples);
    let command = format!("calibrate robot.toml samples.csv --json - {options}");
    let mut report = folder.run(&command).ok().json();
    // It contains the file's hash, which differs.
    assert!(report.as_object_mut().unwrap().remove("document").is_some());
    report
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder
}

/// The samples with another header line.
fn under(header: &str, samples: &str) -> String {
    samples.replace(HEADER, &format!("{header}\n"))
}

#[test]
fn the_same_numbers_give_the_same_report_however_they_are_written() {
    let folder = folder();
    let samples = good_samples();
    let expected = report(&folder, samples.as_bytes(), "");
    let mut quoted = HEADER.to_owned();
    for line in samples.lines().skip(1) {
        let fields: Vec<_> = line
            .split(',')
            .map(|field| field.replace('.', ","))
            .collect();
        writeln!(quoted, "\"{}\"", fields.join("\",\"")).unwrap();
    }
    let noted: String = samples
        .lines()
        .enumerate()
        .map(|(line, text)| match line {
            0 => format!("_timestamp,{text},_Comment\n"),
            line => format!("2026-11-22T10:{line:02},{text},\"good, or nearly so\"\n"),
        })
        .collect();
    let written = [
        samples.replace(',', ";"),
        samples.replace(',', ";").replace('.', ","),
        samples.replace(',', "\t"),
        samples.replace(',', "\t").replace('.', ","),
        samples.replace(',', "   ").replace("\nq", "\n  q"),
        under(
            "q1 [deg]  q2 [deg]  q3 [deg]  x [mm]  y [mm]  z [mm]",
            &samples.replace(',', " \t "),
        ),
        quoted,
        noted,
        under("Q1,Q2,Q3,X [mm],Y (mm),z/mm", &samples),
        under("q1 [°],q2 [°],q3 [°],x_mm,y_mm,z_mm", &samples),
        samples.replace('\n', ",\n"),
        under("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,,", &samples),
        samples.replace('\n', ",,\n").replacen(",,\n", "\n", 1),
        format!("{samples},,,,,\n;\n").replace(";\n", ""),
    ];
    for text in &written {
        assert_eq!(report(&folder, text.as_bytes(), ""), expected, "{text}");
    }
}

#[test]
fn columns_of_any_name_are_read_as_the_command_line_says() {
    let folder = folder();
    let samples = good_samples();
    let expected = report(&folder, samples.as_bytes(), "");
    let foreign = under("A1,A2,A3,X,Y,Z", &samples);
    for mapping in [
        "q1_deg=A1,q2_deg=A2,q3_deg=A3,x_mm=X,y_mm=Y,z_mm=Z",
        // These angles exceed a full turn in radians.
        "q1=A1,q2=A2,q3=A3,x_mm=X,y_mm=Y,z_mm=Z",
    ] {
        let options = format!("--columns {mapping}");
        assert_eq!(report(&folder, foreign.as_bytes(), &options), expected);
    }
    // The unit is the column's own; of two columns that could be x, the mapped one counts; others are ignored.
    let two = samples
        .replace('\n', ",1,2\n")
        .replacen("z_mm,1,2", "z_mm,Force,x_mm", 1);
    let two = two.replace("q3_deg,x_mm", "q3_deg,T_mm");
    assert_eq!(
        report(&folder, two.as_bytes(), "--columns x=T_mm"),
        expected
    );

    folder.write("samples.csv", foreign);
    let table = "
        q1_deg=B1 ⇒ 3 ⇒ samples.csv:1: column B1: the header has no such column
        q1=A1,q2=A2,q3=A3,x=X,y=Y,z=Z ⇒ 3 ⇒ samples.csv:1: column X: its unit is not stated
        q1_deg ⇒ 2 ⇒ has no =
        x_mm=X_m ⇒ 2 ⇒ another unit
        ";
    assert_refused(&folder, "calibrate robot.toml samples.csv --columns", table);
}

/// Every command reads tables in the same way.
#[test]
fn every_command_takes_tables_in_any_form() {
    let folder = folder();
    let table = under("A1 A2 A3 X Y Z", &good_samples()).replace(',', " ");
    let plain = good_samples();
    folder.write("plain.csv", &plain);
    let utf16 = table.encode_utf16().flat_map(u16::to_le_bytes);
    folder.write("table.csv", utf16.collect::<Vec<_>>());
    let names = "--columns q1_deg=A1,q2_deg=A2,q3_deg=A3,x_mm=X,y_mm=Y,z_mm=Z";
    for command in [
        "plan robot.toml --samples",
        "forward robot.toml",
        "inverse robot.toml",
    ] {
        let expected = folder.run(&format!("{command} plain.csv")).ok().stdout;
        let found = folder
            .run(&format!("{command} table.csv {names}"))
            .ok()
            .stdout;
        assert_eq!(
            found.replace("table.csv", "plain.csv"),
            expected,
            "{command}"
        );
    }
}
