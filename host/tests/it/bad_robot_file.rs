//! Bad robot files: one clear error with file and line, the line itself with the place marked, an exit code, and no
//! output file.

use crate::support::{Folder, NOMINAL, TOWERS, assert_fails, cases, good_samples};

/// What is replaced (nothing: at the end), by what, and what the error holds.
fn check(robot: &str, table: &str) {
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
    check("", "⇒ ⇒ robot.toml:1: missing field `joints`");
    check(
        NOMINAL,
        r#"
        [joints] ⇒ [joints ⇒ robot.toml:7:
        = 480 ⇒ = 480\nforearm_inch = 3 ⇒ robot.toml:6: unknown field `forearm_inch` | `forearm_mm`
        forearm_mm = 480\n ⇒ ⇒ robot.toml:1: missing field `forearm_mm`
        max_deg = 90 ⇒ max_mm = 90 ⇒ robot.toml:9: unknown field `max_mm` | `max_deg`
        [nominal] ⇒ [nominal]\nkind = "delta" ⇒ robot.toml:2: unknown variant `delta` | `linear`
        ⇒ [colour] ⇒ robot.toml:10: unknown field `colour`
        ⇒ [planes.table]\nz_mm = -560 ⇒ robot.toml:10: missing field `sigma_mm`
        ⇒ [noise]\nposition_mm = 1 ⇒ robot.toml:10: missing field `joint_deg`
        ⇒ [noise]\njoint_deg = 1 ⇒ robot.toml:10: one of position_mm, height_mm and
        ⇒ [points.a]\nx_mm = 1 ⇒ robot.toml:10: a known place needs all of | sigma_mm
        ⇒ [points.a]\noffset = "known" ⇒ robot.toml:11: unknown variant `known` | `unknown`
        ⇒ [robot]\nname = "" ⇒ robot.toml:11: expected one line of text
        "#,
    );
    check(
        TOWERS,
        r"
        forearm_mm ⇒ upper_arm_mm = 3\nforearm_mm ⇒ robot.toml:4: unknown field `upper_arm_mm`
        scale = 0.001\n ⇒ ⇒ robot.toml:10: missing field `scale`
        ",
    );
}

#[test]
fn numbers_that_are_wrong_are_shown_in_their_line() {
    check(
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
    check(
        joints,
        "⇒ ⇒ robot.toml:1: the file has neither [nominal] nor [[arm]]",
    );
    check(
        &both,
        "⇒ ⇒ robot.toml:1: the file has both [nominal] and [[arm]]",
    );
    check(
        &one,
        "⇒ ⇒ robot.toml:4: the file has 1 section [[arm]], not 3",
    );
    check(
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

/// Comments and names may have letters of any language, in any encoding of text.
#[test]
fn a_robot_file_may_be_latin1_or_utf16() {
    let robot = format!("# Länge\n{NOMINAL}");
    let latin1 = robot.chars().map(|c| u8::try_from(u32::from(c)).unwrap());
    let utf16 = robot.encode_utf16().flat_map(u16::to_le_bytes);
    for robot in [latin1.collect::<Vec<u8>>(), utf16.collect()] {
        let folder = Folder::new();
        folder.write("robot.toml", robot);
        folder.write("samples.csv", good_samples());
        folder.run("calibrate robot.toml samples.csv").ok();
    }
}
