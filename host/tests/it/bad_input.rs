//! Bad input: one clear error with file, line and column, an exit code, and no output file.

use crate::support::{
    Folder, HEADER, NOMINAL, Point, TOLERANCE, TOWERS, assert_fails, cases, csv, exact,
    good_samples, noisy, nominal_arms, platform, true_arms,
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
    1 ⇒ 1,2,3,4,5,6 ⇒ samples.csv:1: | the first line must name the columns
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

/// What is replaced (nothing: at the end), by what, and what the error holds.
fn check_robot(robot: &str, table: &str) {
    for [from, to, expected] in cases(table) {
        let robot = match from.as_str() {
            "" => format!("{robot}{to}\n"),
            from => robot.replace(from, &to),
        };
        let expected: Vec<_> = expected.split(" | ").collect();
        assert_fails(robot.as_bytes(), good_samples().as_bytes(), 3, &expected);
    }
}

#[test]
fn keys_that_are_wrong_are_named_with_their_line() {
    check_robot("", "⇒ ⇒ robot.toml:1: missing field `joints`");
    check_robot(
        NOMINAL,
        r#"
        [joints] ⇒ [joints ⇒ robot.toml:7:
        = 480 ⇒ = 480\nforearm_inch = 3 ⇒ robot.toml:6: unknown field `forearm_inch` | `forearm_mm`
        forearm_mm = 480\n ⇒ ⇒ robot.toml:1: missing field `forearm_mm`
        max_deg = 90 ⇒ max_mm = 90 ⇒ robot.toml:9: unknown field `max_mm` | `max_deg`
        [nominal] ⇒ [nominal]\nkind = "delta" ⇒ robot.toml:2: unknown variant `delta` | `linear`
        ⇒ [colour] ⇒ robot.toml:10: unknown field `colour`
        ⇒ [planes.table]\nz_mm = -560 ⇒ robot.toml:10: missing field `sigma_mm`
        ⇒ [noise]\nposition_mm = 1 ⇒ robot.toml:10: this robot's joint noise is joint_deg
        ⇒ [points.a]\nx_mm = 1 ⇒ robot.toml:10: a known place needs all of | sigma_mm
        ⇒ [points.a]\noffset = "known" ⇒ robot.toml:11: unknown variant `known` | `unknown`
        ⇒ [robot]\nname = "" ⇒ robot.toml:11: expected one line of text
        "#,
    );
    check_robot(
        TOWERS,
        r"
        forearm_mm ⇒ upper_arm_mm = 3\nforearm_mm ⇒ robot.toml:4: unknown field `upper_arm_mm`
        scale = 0.001\n ⇒ ⇒ robot.toml:10: missing field `scale`
        ",
    );
}

#[test]
fn numbers_that_are_wrong_are_shown_in_their_line() {
    check_robot(
        NOMINAL,
        r#"
        = 480 ⇒ = "480" ⇒ robot.toml:5: invalid type: string "480", expected a number
        = 480 ⇒ = 480,5 ⇒ robot.toml:5: | numbers have a decimal point
        = 480 ⇒ = 4 8 ⇒ robot.toml:5:
        = 480 ⇒ = nan ⇒ robot.toml:5: invalid value: NaN
        = 194 ⇒ = inf ⇒ robot.toml:2: invalid value: inf
        = 480 ⇒ = -480 ⇒ robot.toml:5: invalid value: -480, expected a number above 0
        = 260 ⇒ = 0 ⇒ robot.toml:4: invalid value: 0, expected a number above 0
        = 480 ⇒ = 1e300 ⇒ robot.toml:1: the geometry is impossible
        = 30 ⇒ = -30 ⇒ robot.toml:1: the geometry is impossible: the base and platform radii
        = 480 ⇒ = 48 ⇒ robot.toml:1: the geometry is impossible: the forearms do not meet
        = 90 ⇒ = -60 ⇒ robot.toml:7: the largest joint angle, -60, is not above the smallest, -60
        = 90 ⇒ = 900 ⇒ robot.toml:7: | more than one turn
        ⇒ forearm_max_deg = 91 ⇒ robot.toml:7: forearm_max_deg = 91 is above 90 degrees
        ⇒ [tolerance]\nlength_mm = 0\nangle_deg = 1 ⇒ robot.toml:11: invalid value: 0
        ⇒ [noise]\nposition_mm = [1, 2]\njoint_deg = 0 ⇒ robot.toml:11: | three of them in brackets
        ⇒ [noise]\nposition_mm = 1\njoint_deg = -1 ⇒ robot.toml:10: the joint noise must be
        ⇒ [sensor_frame]\nrotation = [[1,0,0],[0,1,0],[0,0,-1]]\ntranslation_mm = [0,0,0] ⇒ robot.toml:10: rotation is not a rotation matrix
        "#,
    );
}

#[test]
fn three_arms_or_a_nominal_robot_are_needed() {
    let arm = "[[arm]]\ndx_mm = 164.0\ndy_mm = 0.0\ndz_mm = 0.0\ntheta_deg = 0.0\n\
               alpha_deg = 0.0\nla_x_mm = 260.0\nla_y_mm = 0.0\nlb_mm = 480.0\n";
    let joints = "[joints]\nmin_deg = -60\nmax_deg = 90\n";
    let both = format!("{NOMINAL}{arm}");
    let one = format!("{joints}{arm}");
    check_robot(
        joints,
        "⇒ ⇒ robot.toml:1: the file has neither [nominal] nor [[arm]]",
    );
    check_robot(
        &both,
        "⇒ ⇒ robot.toml:1: the file has both [nominal] and [[arm]]",
    );
    check_robot(
        &one,
        "⇒ ⇒ robot.toml:4: the file has 1 section [[arm]], not 3",
    );
    check_robot(
        &format!("{joints}{}", arm.repeat(3)),
        r"
        la_x_mm = 260.0 ⇒ la_x_mm = 0 ⇒ robot.toml:4: | la_x_mm must be above 0
        lb_mm = 480.0 ⇒ lb_mm = 0 ⇒ robot.toml:4: | lb_mm must be above 0
        alpha_deg = 0.0 ⇒ alpha_deg = 90 ⇒ robot.toml:4: | alpha
        theta_deg = 0.0 ⇒ theta_deg = 361 ⇒ robot.toml:4: | theta
        dx_mm ⇒ dx_m ⇒ robot.toml:5: unknown field `dx_m` | `dx_mm`
        ",
    );
}

#[test]
fn the_line_at_fault_is_shown() {
    let folder = Folder::new();
    folder.write(
        "robot.toml",
        NOMINAL.replace("= 480", "= 480\nforearm_inch = 3"),
    );
    let run = folder.run("forward robot.toml");
    let shown = "  |\n6 | forearm_inch = 3\n  | ^^^^^^^^^^^^\n";
    assert!(run.stderr.contains(shown), "{}", run.stderr);
}

#[test]
fn a_robot_file_that_is_no_text_or_a_table_is_told_as_such() {
    for (robot, expected) in [
        (
            b"\xff\xfe#\0\n\0\x00\xd8]\0".to_vec(),
            "robot.toml:2: the UTF-16 text has half a character",
        ),
        (
            [NOMINAL.as_bytes(), b"\0"].concat(),
            "robot.toml: is not a text file",
        ),
        (
            vec![b'#'; (1 << 20) + 1],
            "robot.toml: the file is larger than 1 MB",
        ),
        (
            good_samples().into_bytes(),
            "robot.toml:1: this looks like a table of samples",
        ),
    ] {
        assert_fails(&robot, good_samples().as_bytes(), 3, &[expected]);
    }
}
