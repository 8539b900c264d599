//! Bad robot files: one clear error with file and line, the line itself with the place marked, an exit code, and no
//! output file.

use crate::support::{Folder, NOMINAL, TOWERS, assert_fails, good_samples};

/// A change of a robot file, and what the error must hold.
type Case<'a> = (String, &'a [&'a str]);

fn check(cases: &[Case<'_>]) {
    for (robot, expected) in cases {
        assert_fails(robot.as_bytes(), good_samples().as_bytes(), 3, expected);
    }
}

#[test]
fn keys_that_are_wrong_are_named_with_their_line() {
    let nominal = |from: &str, to: &str| NOMINAL.replace(from, to);
    let with = |text: &str| format!("{NOMINAL}{text}");
    check(&[
        (String::new(), &["robot.toml:1: missing field `joints`"]),
        (nominal("[joints]", "[joints"), &["robot.toml:7: "]),
        (
            nominal("forearm_mm = 480", "forearm_mm = 480\nforearm_inch = 3"),
            &[
                "robot.toml:6: unknown field `forearm_inch`",
                "`forearm_mm`",
                "6 | forearm_inch = 3",
                "  | ^^^^^^^^^^^^",
            ],
        ),
        (
            with("[colour]\n"),
            &["robot.toml:10: unknown field `colour`"],
        ),
        (
            nominal("forearm_mm = 480\n", ""),
            &["robot.toml:1: missing field `forearm_mm`", "1 | [nominal]"],
        ),
        (
            with("[planes.table]\nz_mm = -560\n"),
            &[
                "robot.toml:10: missing field `sigma_mm`",
                "10 | [planes.table]",
            ],
        ),
        (
            with("[noise]\nposition_mm = 1\n"),
            &["robot.toml:10: missing field `joint_deg`", "10 | [noise]"],
        ),
        (
            with("[points.a]\nx_mm = 1\n"),
            &["robot.toml:10: a known place needs all of", "sigma_mm"],
        ),
        (
            with("[points.a]\noffset = \"known\"\n"),
            &["robot.toml:11: unknown variant `known`", "`unknown`"],
        ),
        (
            nominal("[nominal]", "[nominal]\nkind = \"delta\""),
            &["robot.toml:2: unknown variant `delta`", "`linear`"],
        ),
        // Keys of the other kind of robot.
        (
            TOWERS.replace("forearm_mm", "upper_arm_mm = 3\nforearm_mm"),
            &[
                "robot.toml:4: unknown field `upper_arm_mm`",
                "`tower_radius_mm`",
            ],
        ),
        (
            TOWERS.replace("scale = 0.001\n", ""),
            &["missing field `scale`", "| [tolerance]"],
        ),
        (
            nominal("max_deg = 90", "max_mm = 90"),
            &["robot.toml:9: unknown field `max_mm`", "`max_deg`"],
        ),
        (
            with("[robot]\nname = \"\"\n"),
            &["robot.toml:11: expected one line of text"],
        ),
    ]);
}

#[test]
fn numbers_that_are_wrong_are_shown_in_their_line() {
    let nominal = |from: &str, to: &str| NOMINAL.replace(from, to);
    let with = |text: &str| format!("{NOMINAL}{text}");
    check(&[
        (
            nominal("= 480", "= \"480\""),
            &[
                "robot.toml:5: invalid type: string \"480\", expected a number",
                "  |              ^^^^^",
            ],
        ),
        (
            nominal("= 480", "= 480,5"),
            &[
                "robot.toml:5: ",
                "5 | forearm_mm = 480,5",
                "numbers have a decimal point",
            ],
        ),
        (nominal("= 480", "= 4 8"), &["robot.toml:5: "]),
        (
            nominal("= 480", "= nan"),
            &["robot.toml:5: invalid value: NaN"],
        ),
        (
            nominal("= 194", "= inf"),
            &["robot.toml:2: invalid value: inf"],
        ),
        (
            nominal("= 480", "= -480"),
            &["robot.toml:5: invalid value: -480, expected a number above 0"],
        ),
        (
            nominal("= 260", "= 0"),
            &["robot.toml:4: invalid value: 0, expected a number above 0"],
        ),
        (
            nominal("= 480", "= 1e300"),
            &["robot.toml:1: the geometry is impossible"],
        ),
        (
            nominal("= 30", "= -30"),
            &["robot.toml:1: the geometry is impossible: the base and platform radii"],
        ),
        (
            nominal("= 480", "= 48"),
            &["robot.toml:1: the geometry is impossible: the forearms do not meet"],
        ),
        (
            nominal("= 90", "= -60"),
            &["robot.toml:7: the largest joint angle, -60, is not above the smallest, -60"],
        ),
        (
            nominal("= 90", "= 900"),
            &["robot.toml:7: ", "more than one turn"],
        ),
        (
            with("forearm_max_deg = 91\n"),
            &["robot.toml:7: forearm_max_deg = 91 is above 90 degrees"],
        ),
        (
            with("[tolerance]\nlength_mm = 0\nangle_deg = 1\n"),
            &["robot.toml:11: invalid value: 0, expected a number above 0"],
        ),
        (
            with("[tolerance]\nlength_mm = 1\nangle_deg = 1\ntransmission_deg = 6\n"),
            &["robot.toml:10: transmission_deg = 6 is not below 5.7 degrees"],
        ),
        (
            with("[noise]\nposition_mm = [1, 2]\njoint_deg = 0\n"),
            &[
                "robot.toml:11: ",
                "a number above 0, or three of them in brackets",
            ],
        ),
        (
            with("[noise]\nposition_mm = 1\njoint_deg = -1\n"),
            &["robot.toml:10: the joint noise must be a finite number, 0 or greater"],
        ),
        (
            with(
                "[sensor_frame]\nrotation = [[1,0,0],[0,1,0],[0,0,-1]]\ntranslation_mm = [0,0,0]\n",
            ),
            &["robot.toml:10: rotation is not a rotation matrix"],
        ),
    ]);
}

#[test]
fn three_arms_or_a_nominal_robot_are_needed() {
    let arm = "[[arm]]\ndx_mm = 164.0\ndy_mm = 0.0\ndz_mm = 0.0\ntheta_deg = 0.0\n\
               alpha_deg = 0.0\nla_x_mm = 260.0\nla_y_mm = 0.0\nlb_mm = 480.0\n";
    let joints = "[joints]\nmin_deg = -60\nmax_deg = 90\n";
    let arms = |from: &str, to: &str| format!("{joints}{arm}{arm}{}", arm.replace(from, to));
    check(&[
        (
            joints.into(),
            &["robot.toml:1: the file has neither [nominal] nor [[arm]]"],
        ),
        (
            format!("{NOMINAL}{arm}"),
            &["robot.toml:1: the file has both [nominal] and [[arm]]"],
        ),
        (
            format!("{joints}{arm}"),
            &["robot.toml:4: the file has 1 section [[arm]], not 3"],
        ),
        (
            arms("la_x_mm = 260.0", "la_x_mm = 0"),
            &["robot.toml:22: ", "la_x_mm must be above 0"],
        ),
        (
            arms("lb_mm = 480.0", "lb_mm = 0"),
            &["robot.toml:22: ", "lb_mm must be above 0"],
        ),
        (
            arms("alpha_deg = 0.0", "alpha_deg = 90"),
            &["robot.toml:22: ", "alpha"],
        ),
        (
            arms("theta_deg = 0.0", "theta_deg = 361"),
            &["robot.toml:22: ", "theta"],
        ),
        (
            arms("dx_mm", "dx_m"),
            &["robot.toml:23: unknown field `dx_m`", "`dx_mm`"],
        ),
    ]);
}

#[test]
fn a_robot_file_that_is_no_text_or_a_table_is_told_as_such() {
    let cut = b"\xff\xfe#\0\n\0\x00\xd8]\0".to_vec();
    let nul = [NOMINAL.as_bytes(), b"\0"].concat();
    for (robot, expected) in [
        (cut, "robot.toml:2: the UTF-16 text has half a character"),
        (nul, "robot.toml: is not a text file"),
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
