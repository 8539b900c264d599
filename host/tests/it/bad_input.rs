//! Bad input: one clear error with file, line and column, an exit code, and no output file.

use crate::support::{
    Folder, HEADER, NOMINAL, Point, TOLERANCE, assert_fails, cases, csv, exact, good_samples,
    noisy, nominal_arms, platform, true_arms,
};

/// The samples with one line replaced, with a text replaced wherever it stands, or as a whole.
fn changed(from: &str, to: &str) -> String {
    let samples = good_samples();
    match (from, from.parse::<usize>()) {
        ("all", _) => to.replace("HEADER", HEADER.trim()),
        (_, Ok(number)) => {
            let mut lines: Vec<_> = samples.lines().collect();
            lines[number - 1] = to;
            lines.join("\n")
        }
        _ => samples.replace(from, to),
    }
}

const SAMPLES: &str = r#"
    all ⇒ ⇒ samples.csv:1: the file is empty
    all ⇒ # only this\n\n ⇒ samples.csv:1: the file is empty
    all ⇒ HEADER\n ⇒ samples.csv:1: the file has a header and no rows
    ,z_mm ⇒ ,w_mm ⇒ samples.csv:1: column w_mm: unknown column | z_mm
    x_mm,y_mm,z_mm ⇒ x_mm,y_mm,y_m ⇒ samples.csv:1: column y_m: the column repeats column y_mm
    q3_deg,x_mm ⇒ Q1,x_mm ⇒ samples.csv:1: column Q1: the column repeats column q1_deg before it
    q1_deg ⇒ A1 ⇒ samples.csv:1: column A1: unknown column | q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm | --columns
    7 ⇒ 1;2;3;4;5;6 ⇒ samples.csv:7: the fields of this row are separated by semicolons, those of the header by commas
    3 ⇒ 1,5,2,5,3,5,4,5,5,5,6,5 ⇒ samples.csv:3: column z_mm: the row has 12 fields | looks like decimal commas
    3 ⇒ 1,"2,5",3,4,5,6 ⇒ samples.csv:3: column q2_deg: "2,5" has a decimal comma, and line 2 has a decimal point
    all ⇒ q1_deg;q2_deg;q3_deg;x_mm;y_mm;z_mm\n1;2;3;4;5;6;7\n ⇒ samples.csv:2: column z_mm: the row has 7 fields
    x_mm ⇒ X ⇒ samples.csv:1: column X: its unit is not stated | --columns x_mm=X
    all ⇒ Q1;Q2;Q3;x [mm];y [mm];z [mm]\n0,1;0,2;-0,3;1;2;-300\n ⇒ samples.csv:1: column Q1: its unit is not stated
    all ⇒ HEADER,\n1,2,3,4,5,6,\n1,2,3,4,5,6,7\n ⇒ samples.csv:3: "7" stands in column 7, which has no name
    9 ⇒ 1 ⇒ samples.csv:9: column q2_deg: the row has 1 field and the header 6
    21 ⇒ 1,2,3,4,5,6,7 ⇒ samples.csv:21: column z_mm: the row has 7 fields and the header 6
    4 ⇒ 1,2,3,4,5,"6 ⇒ samples.csv:4: this line opens a quote " and does not close it
    4 ⇒ # "\n\n1,"2,3,4,5,6\n1,2,3,4,5,"6" ⇒ samples.csv:6: this line opens a quote " and does not close it
    1 ⇒ 1,2,3,4,5,6 ⇒ samples.csv:1: column | the first line must name the columns
    all ⇒ # c\nq1_deg,q3_deg,x_mm,y_mm,z_mm\n1,2,3,4,5\n ⇒ samples.csv:2: column q2_deg (or q2_rad): the column is missing
    3 ⇒ 1,2,3,4,5.6.7,8 ⇒ samples.csv:3: column y_mm: "5.6.7" is not a number
    3 ⇒ 1,,3,4,5,6 ⇒ samples.csv:3: column q2_deg: the field is empty
    5 ⇒ 1,2,3,NaN,5,6 ⇒ samples.csv:5: column x_mm: "NaN" is not a finite number
    5 ⇒ 1,2,inf,4,5,6 ⇒ samples.csv:5: column q3_deg: "inf" is not a finite number
    5 ⇒ 1,2,3,4,5,1e999 ⇒ samples.csv:5: column z_mm: "1e999" is not a finite number
    5 ⇒ 1,2,3,4,5,1e300 ⇒ samples.csv:5: column z_mm: "1e300" is too large
    6 ⇒ 1,91.5,3,4,5,6 ⇒ samples.csv:6: column q2_deg: 91.500° is more than 1° outside | -60° to 90°
    q3_deg ⇒ q3_rad ⇒ samples.csv:2: column q3_rad: | _deg or _rad
    all ⇒ HEADER\n# c\n\n \n# "c\n1,2,3,4,5,x\n ⇒ samples.csv:6: column z_mm: "x" is not a number
"#;

#[test]
fn samples_that_are_wrong_are_named_by_line_and_column() {
    for [from, to, expected] in cases(SAMPLES) {
        let samples = changed(&from, &to);
        let expected: Vec<_> = expected.split(" | ").collect();
        assert_fails(NOMINAL.as_bytes(), samples.as_bytes(), 3, &expected);
        // Other line ends and a byte order mark change nothing.
        let windows = format!("\u{feff}{}", samples.replace('\n', "\r\n"));
        assert_fails(NOMINAL.as_bytes(), windows.as_bytes(), 3, &expected);
    }
    let thousands = "q1_deg\tq2_deg\tq3_deg\tx_mm\ty_mm\tz_mm\n1\t2\t3\t4\t5\t-1,234\n";
    let half = b"\xff\xfea\0\n\0\x00\xd8b\0";
    let nul = [HEADER.as_bytes(), b"\0"].concat();
    for (samples, expected) in [
        (
            thousands.as_bytes(),
            "samples.csv:2: column z_mm: \"-1,234\" may be -1.234 or -1234",
        ),
        (half, "samples.csv:2: the UTF-16 text has half a character"),
        (&nul, "samples.csv: is not a text file"),
    ] {
        assert_fails(NOMINAL.as_bytes(), samples, 3, &[expected]);
    }
}

#[test]
fn measurements_that_cannot_calibrate_are_refused_with_a_remedy() {
    let arms = true_arms();
    let noise = "\n[noise]\nposition_mm = 0.001\njoint_deg = 0.0\n";
    let posed = |pose: fn(Point) -> Point| -> String {
        let poses = exact(&arms, 20).into_iter().map(|(q, _)| pose(q));
        let samples: Vec<_> = poses.map(|q| (q, platform(&arms, q))).collect();
        csv(&samples)
    };
    // The platform stays on a line near the robot's axis, or one joint does not turn.
    let straight = posed(|q| [q[0]; 3]);
    let stiff = posed(|q| [q[0], 20.0, q[2]]);
    let mut one_wrong = exact(&arms, 30);
    one_wrong[10].1 = [100.0, 0.0, -700.0];
    let mut other_arms = arms;
    other_arms[1][7] += 12.0;
    let cases: &[(String, String, &[&str])] = &[
        (
            NOMINAL.into(),
            csv(&exact(&arms, 7)),
            &[
                "samples.csv: 7 samples are too few: 8 are needed",
                "[tolerance]",
            ],
        ),
        (
            NOMINAL.into(),
            straight,
            &["samples.csv: ", "the poses do not determine", "help: "],
        ),
        (
            NOMINAL.into(),
            stiff,
            &["samples.csv: arm 2: the poses do not determine", "help: "],
        ),
        (
            format!("{NOMINAL}{noise}"),
            csv(&noisy(&arms, 30, 0.1)),
            &["samples.csv: residuals are ", "--robust"],
        ),
        (
            format!("{NOMINAL}{noise}"),
            csv(&one_wrong),
            &["samples.csv: ", "Line 12 disagrees with all others"],
        ),
        (
            format!("{NOMINAL}{TOLERANCE}"),
            csv(&exact(&other_arms, 30)),
            &["samples.csv: Residuals (", "state a larger [tolerance]"],
        ),
        (
            // The robot is nominal already: every change is the noise's.
            NOMINAL.into(),
            csv(&noisy(&nominal_arms(), 12, 0.5)),
            &["chance of making the robot worse", "[tolerance]"],
        ),
    ];
    for (robot, samples, expected) in cases {
        assert_fails(robot.as_bytes(), samples.as_bytes(), 1, expected);
    }
}

#[test]
fn a_sensor_frame_that_cannot_be_found_is_refused() {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("samples.csv", csv(&exact(&true_arms(), 2)));
    let run = folder.run("calibrate robot.toml samples.csv --frame sensor --output out.toml");
    assert_eq!(run.code, 1);
    assert!(
        run.stderr
            .contains("do not determine where the sensor's frame is"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.names(), ["robot.toml", "samples.csv"]);
}

#[test]
fn files_that_are_not_there_are_named() {
    let folder = Folder::new();
    folder.write("robot.toml", NOMINAL);
    for (command, name) in [
        (
            "calibrate nothing.toml samples.csv",
            "nothing.toml: cannot be read",
        ),
        (
            "calibrate robot.toml nothing.csv",
            "nothing.csv: cannot be read",
        ),
        (
            "forward robot.toml nothing.csv",
            "nothing.csv: cannot be read",
        ),
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, 3);
        assert!(run.stderr.contains(name), "{}", run.stderr);
    }
}

#[test]
fn if_one_output_cannot_be_written_neither_is() {
    let folder = Folder::new();
    for command in [
        "calibrate --output out.toml --json nowhere/report.json",
        "calibrate --output nowhere/out.toml --json report.json",
        "calibrate --json report.json --output .",
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, 4, "{}", run.stderr);
        assert!(folder.names().is_empty(), "{:?}", folder.names());
    }
    let run = folder.run("calibrate --output .");
    assert!(run.stderr.contains("is a folder"), "{}", run.stderr);
}

#[test]
fn a_write_protected_file_is_not_replaced() {
    let folder = Folder::new();
    folder.write("out.toml", "of yesterday");
    let path = folder.path("out.toml");
    let mut permissions = std::fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&path, permissions).unwrap();
    let run = folder.run("calibrate --output out.toml --json report.json");
    assert_eq!(run.code, 4, "{}", run.stdout);
    assert!(run.stderr.contains("out.toml: "), "{}", run.stderr);
    assert!(run.stderr.contains("write-protected"), "{}", run.stderr);
    assert_eq!(folder.read("out.toml"), "of yesterday");
    assert_eq!(folder.names(), ["out.toml"]);
}

#[test]
fn the_robot_file_cannot_come_from_standard_input() {
    let folder = Folder::new();
    for command in ["calibrate -", "calibrate - samples.csv", "forward -"] {
        let run = folder.run(command);
        assert_eq!(run.code, 2, "{command}");
        let expected = "cannot come from standard input";
        assert!(run.stderr.contains(expected), "{}", run.stderr);
    }
}

#[test]
fn a_wrong_command_line_is_refused_before_anything_is_read() {
    let folder = Folder::new();
    for command in [
        "",
        "calibrate robot.toml",
        "calibrate --solver simplex",
        "calibrate --frame world",
        "calibrate --output - --json -",
        "calibrate --output same --json ./same",
        "forward",
        "reverse",
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, 2, "{command}: {}", run.stderr);
        assert!(!run.stderr.is_empty());
    }
    assert!(folder.names().is_empty());
}
