//! Bad input: one clear error with file, line and column, an exit code, and no output file.

use crate::support::{
    Folder, HEADER, NOISE, NOMINAL, Point, TOLERANCE, TOWERS, assert_fails, assert_refused, cases,
    csv, exact, good_samples, noisy, nominal_arms, platform, true_arms,
};
use std::fmt::Write as _;

/// The samples with a line replaced, with a text replaced throughout, or replaced as a whole.
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
    all ⇒ HEADER,\n1,2,3,4,5,6,\n1,2,3,4,5,6,7\n ⇒ samples.csv:3: "7" is in column 7, which has no name
    9 ⇒ 1 ⇒ samples.csv:9: column q2_deg: the row has 1 field and the header 6
    21 ⇒ 1,2,3,4,5,6,7 ⇒ samples.csv:21: column z_mm: the row has 7 fields and the header 6
    4 ⇒ 1,2,3,4,5,"6 ⇒ samples.csv:4: this line opens a quote " and does not close it
    4 ⇒ # "\n\n1,"2,3,4,5,6\n1,2,3,4,5,"6" ⇒ samples.csv:6: this line opens a quote " and does not close it
    1 ⇒ 1,2,3,4,5,6 ⇒ samples.csv:1: | the first line must name the columns
    all ⇒ # c\nq1_deg,q3_deg,x_mm,y_mm,z_mm\n1,2,3,4,5\n ⇒ samples.csv:2: column q2_deg (or q2_rad): the column is missing
    all ⇒ q1_deg,q2_deg,q3_deg\n1,2,3\n ⇒ samples.csv:1: column x_mm (or x_m): the column is missing | another table has the readings
    all ⇒ x_mm,y_mm,z_mm\n1,2,3\n ⇒ samples.csv:1: column q1_deg (or q1_rad): the column is missing | another table has the joints
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
        assert_fails(NOMINAL, &samples, &expected);
        // Windows line ends and a byte order mark make no difference.
        let windows = format!("\u{feff}{}", samples.replace('\n', "\r\n"));
        assert_fails(NOMINAL, windows, &expected);
    }
    let thousands = "q1_deg\tq2_deg\tq3_deg\tx_mm\ty_mm\tz_mm\n1\t2\t3\t4\t5\t-1,234\n";
    let expected = "samples.csv:2: column z_mm: \"-1,234\" may be -1.234 or -1234";
    assert_fails(NOMINAL, thousands, expected);
}

#[test]
fn a_file_that_is_no_text_or_of_another_kind_is_told_as_such() {
    let half = b"\xff\xfea\0\n\0\x00\xd8b\0".to_vec();
    let nul = [HEADER.as_bytes(), b"\0"].concat();
    for (bytes, expected) in [
        (half, ":2: the UTF-16 text is damaged here"),
        (nul, ": is not a text file"),
    ] {
        assert_fails(NOMINAL, &bytes, &format!("samples.csv{expected}"));
        assert_fails(&bytes, good_samples(), &format!("robot.toml{expected}"));
    }
    for (robot, expected) in [
        (
            vec![b'#'; (1 << 20) + 1],
            "robot.toml: the file is larger than 1 MB",
        ),
        (
            good_samples().into_bytes(),
            "robot.toml:1: this looks like a table of samples",
        ),
        (
            b"# mine\n[printer]\nkinematics: delta\n".to_vec(),
            "robot.toml: this looks like a printer's configuration",
        ),
    ] {
        assert_fails(robot, good_samples(), expected);
    }
}

const SETS: &str = "
    bare.toml seven.csv ⇒ 1 ⇒ seven.csv: 7 samples are too few: 8 are needed | [tolerance]
    bare.toml straight.csv ⇒ 1 ⇒ straight.csv: | the poses do not determine
    bare.toml stiff.csv ⇒ 1 ⇒ stiff.csv: arm 2: the poses do not determine
    bare.toml already.csv ⇒ 1 ⇒ chance of making the robot worse | [tolerance]
    precise.toml rough.csv ⇒ 1 ⇒ rough.csv: residuals are | --robust
    precise.toml rough.csv --robust ⇒ 1 ⇒ rough.csv: residuals are | Look for a sensor
    precise.toml one_wrong.csv ⇒ 1 ⇒ one_wrong.csv: | line 12 disagrees with all others
    tolerant.toml longer.csv ⇒ 1 ⇒ longer.csv: The robot is | the forearms are | set length_mm
    stated.toml planes.csv ⇒ 3 ⇒ planes.csv: the rows name more planes and points | at most 14 points or 16 planes
    stated.toml gap.csv ⇒ 3 ⇒ gap.csv:6: column z_mm: the cell is blank in 1 of 20 rows
    stated.toml copies.csv ⇒ 3 ⇒ equal to the last digit
    stated.toml two.csv --frame sensor ⇒ 1 ⇒ do not determine where the sensor frame is
    stated.toml spot.csv --frame sensor ⇒ 1 ⇒ in one spot
    stated.toml two.csv --robust ⇒ 1 ⇒ too few
    stated.toml good.csv --frame sensor --method joint ⇒ 3 ⇒ --method fkm
    tight.toml near.csv ⇒ 1 ⇒ farther from nominal than the [tolerance] allows | set length_mm
    --columns q1_deg=A1 ⇒ 2 ⇒ --columns needs a samples file
    ";

#[test]
fn measurements_that_cannot_calibrate_are_refused_with_a_remedy() {
    let folder = Folder::new();
    let noise = "\n[noise]\nposition_mm = 0.001\njoint_deg = 0.0\n";
    folder.write("bare.toml", NOMINAL);
    folder.write("precise.toml", format!("{NOMINAL}{noise}"));
    folder.write("tolerant.toml", format!("{NOMINAL}{TOLERANCE}"));
    folder.write("stated.toml", format!("{NOMINAL}{TOLERANCE}{NOISE}"));
    let tight = "\n[tolerance]\nlength_mm = 0.02\nangle_deg = 0.01\n";
    folder.write("tight.toml", format!("{NOMINAL}{tight}{NOISE}"));

    let arms = true_arms();
    let good = exact(&arms, 20);
    let posed = |pose: fn(Point) -> Point| -> Vec<_> {
        let poses = good.iter().map(|(q, _)| pose(*q));
        poses.map(|q| (q, platform(&arms, q))).collect()
    };
    let mut one_wrong = exact(&arms, 30);
    one_wrong[10].1 = [100.0, 0.0, -700.0];
    let mut longer = arms;
    longer[1][7] += 12.0;
    // A tenth of the way from the nominal robot, 2.3 times the tolerance.
    let mut near = nominal_arms();
    for (near, arm) in near.iter_mut().flatten().zip(arms.iter().flatten()) {
        *near += 0.1 * (arm - *near);
    }
    for (name, samples) in [
        ("seven", exact(&arms, 7)),
        ("two", exact(&arms, 2)),
        // The platform stays on a line near the robot's axis, or one joint does not turn.
        ("straight", posed(|q| [q[0]; 3])),
        ("stiff", posed(|q| [q[0], 20.0, q[2]])),
        // The robot is nominal already: any change is due to noise.
        ("already", noisy(&nominal_arms(), 12, 0.5)),
        ("rough", noisy(&arms, 30, 0.1)),
        ("one_wrong", one_wrong),
        ("longer", exact(&longer, 30)),
        (
            "spot",
            good.iter().map(|(q, _)| (*q, [1.0, 2.0, -400.0])).collect(),
        ),
        ("good", good.clone()),
        ("near", noisy(&near, 10, 0.01)),
    ] {
        folder.write(&format!("{name}.csv"), csv(&samples));
    }
    let gap = good_samples().replacen(&format!("{}\n", good[4].1[2]), "\n", 1);
    folder.write("gap.csv", gap);
    let mut touches = "q1_deg,q2_deg,q3_deg,height_mm,plane\n".to_owned();
    for (index, ([q1, q2, q3], x)) in exact(&arms, 85).into_iter().enumerate() {
        let _ = writeln!(touches, "{q1},{q2},{q3},{},p{}", x[2] + 700.0, index % 17);
    }
    folder.write("planes.csv", touches);
    folder.write("copies.csv", format!("{HEADER}1,2,3,4,5,6\n1,2,3,4,5,6\n"));
    assert_refused(
        &folder,
        "calibrate --output out.toml --json report.json",
        SETS,
    );
}

const COMMANDS: &str = "
    ⇒ 2 ⇒ Usage
    reverse ⇒ 2 ⇒ reverse
    forward ⇒ 2 ⇒ required
    calibrate robot.toml ⇒ 2 ⇒ robot.toml is given without its samples
    calibrate --solver simplex ⇒ 2 ⇒ --solver
    calibrate --frame world ⇒ 2 ⇒ world
    calibrate --output - --json - ⇒ 2 ⇒ standard output
    calibrate --output same --json ./same ⇒ 2 ⇒ is the same file
    calibrate - ⇒ 2 ⇒ cannot come from standard input
    calibrate - samples.csv ⇒ 2 ⇒ cannot come from standard input
    forward - ⇒ 2 ⇒ cannot come from standard input
    forward robot.toml in.csv --output in.csv ⇒ 2 ⇒ is the same file
    forward robot.toml in.csv --output robot.toml ⇒ 2 ⇒ is the same file
    calibrate nothing.toml samples.csv ⇒ 3 ⇒ nothing.toml: cannot be read
    calibrate robot.toml nothing.csv ⇒ 3 ⇒ nothing.csv: cannot be read
    forward robot.toml nothing.csv ⇒ 3 ⇒ nothing.csv: cannot be read
    calibrate --output out.toml --json nowhere/report.json ⇒ 4 ⇒ nowhere
    calibrate --output nowhere/out.toml --json report.json ⇒ 4 ⇒ nowhere
    calibrate --json report.json --output . ⇒ 4 ⇒ is a folder
    calibrate --json report.json --output locked.toml ⇒ 4 ⇒ locked.toml: | write-protected
    ";

#[test]
fn wrong_command_lines_and_files_that_cannot_be_read_or_written_change_nothing() {
    let folder = Folder::new();
    folder.write("robot.toml", NOMINAL);
    folder.write("in.csv", "q1_deg,q2_deg,q3_deg\n0,0,0\n");
    folder.write("locked.toml", "of yesterday");
    let path = folder.path("locked.toml");
    let mut permissions = std::fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&path, permissions).unwrap();
    assert_refused(&folder, "", COMMANDS);
    assert_eq!(folder.read("locked.toml"), "of yesterday");
    assert_eq!(folder.read("robot.toml"), NOMINAL);
    assert_eq!(folder.read("in.csv"), "q1_deg,q2_deg,q3_deg\n0,0,0\n");
}

/// Each row: the text to replace (empty: append), its replacement, and the expected error.
fn check_robot(robot: &str, table: &str) {
    for [from, to, expected] in cases(table) {
        let robot = match from.as_str() {
            "" => format!("{robot}{to}\n"),
            from => robot.replace(from, &to),
        };
        assert_fails(robot, good_samples(), &expected);
    }
}

const RADII: &str = r#"
    [joints] ⇒ [joints ⇒ robot.toml:7:
    = 480 ⇒ = 480\nforearm_inch = 3 ⇒ robot.toml:6: unknown field `forearm_inch` | `forearm_mm`
    forearm_mm = 480\n ⇒ ⇒ robot.toml:1: missing field `forearm_mm`
    max_deg = 90 ⇒ max_mm = 90 ⇒ robot.toml:9: unknown field `max_mm` | `max_deg`
    [nominal] ⇒ [nominal]\nkind = "delta" ⇒ robot.toml:2: unknown variant `delta` | `linear`
    ⇒ [colour] ⇒ robot.toml:10: unknown field `colour`
    ⇒ [planes.table]\nz_mm = -560 ⇒ robot.toml:10: missing field `sigma_mm`
    ⇒ [noise]\nposition_mm = 1 ⇒ robot.toml:10: missing field `joint_deg`
    ⇒ [points.a]\nx_mm = 1 ⇒ robot.toml:10: missing field `y_mm`
    ⇒ [points.a]\noffset = "known" ⇒ robot.toml:11: unknown variant `known` | `unknown`
    ⇒ [robot]\nname = "" ⇒ robot.toml:11: expected one line of text
    = 480 ⇒ = "480" ⇒ robot.toml:5: invalid type: string "480", expected a number
    = 480 ⇒ = 480,5 ⇒ robot.toml:5: | numbers have a decimal point
    = 480 ⇒ = 4 8 ⇒ robot.toml:5:
    = 480 ⇒ = nan ⇒ robot.toml:5: invalid value: NaN
    = 194 ⇒ = inf ⇒ robot.toml:2: invalid value: inf
    = 480 ⇒ = -480 ⇒ robot.toml:5: invalid value: -480, expected a number above 0
    = 260 ⇒ = 0 ⇒ robot.toml:4: invalid value: 0, expected a number above 0
    = 480 ⇒ = 1e300 ⇒ robot.toml:5: 1e300 is too large | in mm
    = 480 ⇒ = 99999999999999999999 ⇒ robot.toml:5: 1e20 is too large
    ⇒ [tolerance]\nlength_mm = 1e155\nangle_deg = 1 ⇒ robot.toml:11: 1e155 is too large
    ⇒ [tolerance]\nlength_mm = 1\nangle_deg = 1\nlb_mm = 0 ⇒ robot.toml:13: invalid value: 0, expected a number above 0
    ⇒ [tolerance]\nlength_mm = 1\nangle_deg = 1\nla_mm = -0.1 ⇒ robot.toml:13: invalid value: -0.1
    ⇒ [tolerance]\nlength_mm = 1\nangle_deg = 1\nalpha_deg = nan ⇒ robot.toml:13: invalid value: NaN
    ⇒ [tolerance]\nlength_mm = 1\nangle_deg = 1\nla_x_mm = 1 ⇒ robot.toml:13: unknown field `la_x_mm` | `la_mm`
    ⇒ [tolerance]\nlb_mm = 1\nangle_deg = 1 ⇒ robot.toml:10: missing field `length_mm`
    = 480 ⇒ = 480\nazimuth_deg = [0, 120, 120] ⇒ robot.toml:1: two arms coincide
    = 30 ⇒ = -30 ⇒ robot.toml:1: the geometry is impossible: the base and platform radii
    = 480 ⇒ = 48 ⇒ robot.toml:1: the geometry is impossible: the forearms do not meet
    = 90 ⇒ = -60 ⇒ robot.toml:7: the largest joint angle, -60, is not above the smallest, -60
    = 90 ⇒ = 900 ⇒ robot.toml:7: | more than one turn
    ⇒ forearm_max_deg = 91 ⇒ robot.toml:7: forearm_max_deg = 91 is above 90 degrees
    ⇒ [tolerance]\nlength_mm = 0\nangle_deg = 1 ⇒ robot.toml:11: invalid value: 0
    ⇒ [noise]\nposition_mm = [1, 2]\njoint_deg = 0 ⇒ robot.toml:11: | three of them in brackets
    ⇒ [noise]\nposition_mm = 1\njoint_deg = -1 ⇒ robot.toml:10: the joint noise must be
    ⇒ [sensor_frame]\nrotation = [[1,0,0],[0,1,0],[0,0,-1]]\ntranslation_mm = [0,0,0] ⇒ robot.toml:10: rotation is not a rotation matrix
    "#;

const LINEAR: &str = r"
    forearm_mm ⇒ upper_arm_mm = 3\nforearm_mm ⇒ robot.toml:4: unknown field `upper_arm_mm`
    scale = 0.001\n ⇒ ⇒ robot.toml:10: missing field `scale`
    ";

const ARMS: &str = r"
    la_x_mm = 260.0 ⇒ la_x_mm = 0 ⇒ robot.toml:4: | la_x_mm must be above 0
    lb_mm = 480.0 ⇒ lb_mm = 0 ⇒ robot.toml:4: | lb_mm must be above 0
    alpha_deg = 0.0 ⇒ alpha_deg = 90 ⇒ robot.toml:4: | alpha
    theta_deg = 0.0 ⇒ theta_deg = 361 ⇒ robot.toml:4: | theta
    dx_mm ⇒ dx_m ⇒ robot.toml:5: unknown field `dx_m` | `dx_mm`
    ";

#[test]
fn what_is_wrong_in_a_robot_file_is_named_with_its_line() {
    check_robot(NOMINAL, RADII);
    check_robot(TOWERS, LINEAR);
    let arm = "[[arm]]\ndx_mm = 164.0\ndy_mm = 0.0\ndz_mm = 0.0\ntheta_deg = 0.0\n\
               alpha_deg = 0.0\nla_x_mm = 260.0\nla_y_mm = 0.0\nlb_mm = 480.0\n";
    let joints = "[joints]\nmin_deg = -60\nmax_deg = 90\n";
    check_robot(&format!("{joints}{}", arm.repeat(3)), ARMS);
    let table = "
        ⇒ 1 ⇒ missing field `joints`
        JOINTS ⇒ 1 ⇒ the file has neither [nominal] nor [[arm]]
        NOMINAL ARM ⇒ 1 ⇒ the file has both [nominal] and [[arm]]
        JOINTS ARM ⇒ 4 ⇒ the file has 1 section [[arm]], not 3
        ";
    for [robot, line, cause] in cases(table) {
        let robot = robot.replace(" ARM", arm).replace("NOMINAL", NOMINAL);
        let expected = format!("⇒ ⇒ robot.toml:{line}: {cause}");
        check_robot(&robot.replace("JOINTS", joints), &expected);
    }
}
