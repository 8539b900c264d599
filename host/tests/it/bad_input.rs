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

const SAMPLES: &str = include_str!("../refused/samples.txt");

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

const SETS: &str = include_str!("../refused/calibrations.txt");

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

const COMMANDS: &str = include_str!("../refused/commands.txt");

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

const RADII: &str = include_str!("../refused/robots.txt");

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
