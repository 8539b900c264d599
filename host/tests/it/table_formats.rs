//! Tables in the forms that users have: the same numbers give the same calibration in any format.

use crate::support::{Folder, HEADER, NOMINAL, TOLERANCE, assert_refused, cases, good_samples};
use delta_cal_host::{InputText, Readings, RobotFile};
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

/// The joints of each measured row, or the cause and the remedy of the refusal.
fn joined(joints: &[String], measured: &[String]) -> Result<Vec<f64>, String> {
    let robot = RobotFile::read(&InputText::new("robot.toml", NOMINAL)).unwrap();
    let plc = InputText::new("plc.csv", &(joints.join("\n") + "\n"));
    let tracker = InputText::new("tracker.csv", &(measured.join("\n") + "\n"));
    let found = Readings::read(&plc.joined(Some(tracker)), &robot);
    let found = found
        .map_err(|error| format!("{error} | {}", error.remedy.as_deref().unwrap_or_default()))?;
    let rows = found.rows.iter();
    Ok(rows
        .map(|row| row.value.joints[0].to_degrees().round())
        .collect())
}

/// Names match whatever the header; what would make them match is said, and so is every name that does not. Header and cells
/// of a controller, those of an instrument, and the joints of its rows or the refusal.
#[test]
fn two_files_are_joined_by_names_or_the_difference_is_named() {
    let table = "
        Name P01 P02 P03 ⇒ Point P03 P01 P02 ⇒ [3.0, 1.0, 2.0]
        time 2026-03-02T10:00:00Z 2026-03-02T10:00:20Z 2026-03-02T10:00:55Z ⇒ Time 2026-03-02T10:00:55Z 2026-03-02T10:00:00Z ⇒ [3.0, 1.0]
        Name P01 P02 P03 ⇒ Name P01 P31 P02 Q7 ⇒ tracker.csv:3: plc.csv has no Name P31, Q7
        Name P01 P02 P03 ⇒ Name p03 p01 ⇒ has no Name p03, p01 | same capital letters
        Name Packer3::P01 Packer3::P02 Packer3::P03 ⇒ Name P01 P02 P03 ⇒ delete Packer3::
        Time 10:00:00 10:00:20 10:00:55 ⇒ Time 10:00:30 10:00:50 10:01:25 ⇒ if -30.000 s are added to Time
        n 1 2 3 ⇒ U95,n 1,1 1,2 ⇒ column U95: an uncertainty | u_k2_mm=NAME
        ";
    for [joints, measured, expected] in cases(table) {
        let file = |first: &str, names: &str, numbers: fn(u32) -> String| -> Vec<String> {
            let (header, cells) = first.split_once(' ').unwrap();
            let rows = (1..).zip(cells.split(' '));
            let rows = rows.map(|(row, cell)| format!("{cell},{}", numbers(row)));
            let header = format!("{header},{names}");
            std::iter::once(header).chain(rows).collect()
        };
        let joints = file(&joints, "q1_deg,q2_deg,q3_deg", |q| {
            format!("{q},20,{}", 7 * q)
        });
        let measured = file(&measured, "x_mm,y_mm,z_mm", |x| format!("{x},2,-400"));
        let found = match joined(&joints, &measured) {
            Ok(found) => format!("{found:?}"),
            Err(error) => error,
        };
        for part in expected.split(" | ") {
            assert!(found.contains(part), "{part}: {found}");
        }
    }
}

/// A cell with - was not measured, in any row; a blank is a mistake unless others share it.
#[test]
fn a_dash_says_that_a_cell_was_not_measured() {
    let robot = RobotFile::read(&InputText::new("robot.toml", NOMINAL)).unwrap();
    let rows = |changed: &str| {
        let rows = (0..40).map(|row| match row {
            7 => format!("{changed}\n"),
            row => format!("{row},20,30,{row},1,-400\n"),
        });
        let text = HEADER.to_owned() + &rows.collect::<String>();
        let read = Readings::read(&InputText::new("samples.csv", &text), &robot);
        read.map(|own| (own.rows.len(), own.readings()))
            .map_err(|error| error.to_string())
    };
    assert_eq!(rows("7,20,30,7,1,-"), Ok((40, 119)));
    assert_eq!(rows("7,20,30,-,-,-"), Ok((39, 117)));
    let table = "
        7,20,30,7,1, ⇒ z_mm ⇒ the cell is blank in 1 of 40 rows
        -,20,30,7,1,2 ⇒ q1_deg ⇒ \"-\" is not a number
        338603,20,30,7,1,2 ⇒ q1_deg ⇒ the number is no angle of an arm
        ";
    for [changed, column, cause] in cases(table) {
        let error = rows(&changed).unwrap_err();
        let expected = format!("samples.csv:9: column {column}: {cause}");
        assert!(error.contains(&expected), "{changed}: {error}");
    }
    let nothing = rows("7,20,30,,,").unwrap_err();
    assert!(nothing.contains("nothing was measured in this row"));
    let endless = rows(&format!("7,20,30,{},1,2", "1x".repeat(100_000))).unwrap_err();
    assert!(
        endless.len() < 3000 && endless.contains("samples.csv:9: column x_mm"),
        "{}",
        endless.len()
    );
    // Many columns are read once.
    let wide = format!("q1_deg{}\n", ",_".repeat(200_000));
    assert!(Readings::read(&InputText::new("wide.csv", &wide), &robot).is_err());
}

#[test]
fn a_robot_file_of_more_than_a_megabyte_is_none() {
    let folder = folder();
    folder.write("robot.toml", vec![b'#'; (1 << 20) + 1]);
    let table = "⇒ 3 ⇒ robot.toml: the file is larger than 1 MB";
    assert_refused(&folder, "calibrate robot.toml samples.csv", table);
}
