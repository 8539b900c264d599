//! Bad robot files: one clear error with file, line and key, an exit code, and no output file.

use crate::support::{Folder, NOMINAL, assert_fails, good_samples};

#[test]
#[allow(clippy::too_many_lines)] // a table
fn robot_files_that_are_wrong_are_named_by_line_and_key() {
    let arm = "[[arm]]\ndx_mm = 164.0\ndy_mm = 0.0\ndz_mm = 0.0\ntheta_deg = 0.0\n\
               alpha_deg = 0.0\nla_x_mm = 260.0\nla_y_mm = 0.0\nlb_mm = 480.0\n";
    let joints = "[joints]\nmin_deg = -60\nmax_deg = 90\n";
    let nominal = |from: &str, to: &str| NOMINAL.replace(from, to);
    let arms = |from: &str, to: &str| format!("{joints}{arm}{arm}{}", arm.replace(from, to));
    let with = |text: &str| format!("{NOMINAL}{text}");
    let cases: &[(String, &[&str])] = &[
        (
            String::new(),
            &["robot.toml:1: section [joints] is missing"],
        ),
        (nominal("[joints]", "[joints"), &["robot.toml:7: "]),
        (
            joints.into(),
            &["robot.toml:1: the file has neither [nominal] nor [[arm]]"],
        ),
        (
            with(arm),
            &["robot.toml:1: [nominal]: the file has both [nominal] and [[arm]]"],
        ),
        (
            format!("{joints}{arm}"),
            &["robot.toml:4: [[arm]]: 1 section [[arm]] where there must be three"],
        ),
        (
            format!("{joints}{arm}{arm}"),
            &["robot.toml:13: [[arm]]: 2 sections [[arm]] where there must be three"],
        ),
        (
            nominal("forearm_mm = 480", "forearm_mm = 480\nforearm_inch = 3"),
            &[
                "robot.toml:6: [nominal] forearm_inch: unknown key",
                "forearm_mm",
            ],
        ),
        (
            with("[colour]\n"),
            &["robot.toml:10: [colour]: unknown section"],
        ),
        (
            nominal("forearm_mm = 480\n", ""),
            &["robot.toml:1: [nominal] forearm_mm: the key is missing"],
        ),
        (
            nominal("= 480", "= \"480\""),
            &["robot.toml:5: [nominal] forearm_mm: ", "expected a number"],
        ),
        (
            nominal("= 480", "= 480,5"),
            &[
                "robot.toml:5: [nominal] forearm_mm: 480,5 is not a number",
                "write 480.5, with a decimal point",
            ],
        ),
        (
            nominal("= 480", "= 4 8"),
            &["robot.toml:5: [nominal] forearm_mm: 4 8 is not a number"],
        ),
        (
            nominal("= 480", "= nan"),
            &["robot.toml:5: [nominal] forearm_mm: NaN is not a finite number"],
        ),
        (
            nominal("= 480", "= inf"),
            &["robot.toml:5: [nominal] forearm_mm: inf is not a finite number"],
        ),
        (
            nominal("= 480", "= -480"),
            &["robot.toml:5: [nominal] forearm_mm: the geometry is impossible"],
        ),
        (
            nominal("= 480", "= 1e300"),
            &["robot.toml:5: [nominal] forearm_mm: the geometry is impossible"],
        ),
        (
            nominal("= 260", "= 0"),
            &["robot.toml:4: [nominal] upper_arm_mm: the geometry is impossible"],
        ),
        (
            nominal("= 30", "= -30"),
            &["robot.toml:3: [nominal] platform_radius_mm: the geometry is impossible"],
        ),
        (
            nominal("= 194", "= -1"),
            &["robot.toml:2: [nominal] base_radius_mm: the geometry is impossible"],
        ),
        (
            nominal("= 480", "= 48"),
            &["robot.toml:1: the geometry is impossible: the forearms do not meet"],
        ),
        (
            arms("la_x_mm = 260.0", "la_x_mm = 0"),
            &["robot.toml:28: [[arm]] la_x_mm: the geometry is impossible"],
        ),
        (
            arms("lb_mm = 480.0", "lb_mm = 0"),
            &["robot.toml:30: [[arm]] lb_mm: the geometry is impossible"],
        ),
        (
            arms("alpha_deg = 0.0", "alpha_deg = 90"),
            &["robot.toml:27: [[arm]] alpha_deg: the geometry is impossible"],
        ),
        (
            arms("theta_deg = 0.0", "theta_deg = 361"),
            &["robot.toml:26: [[arm]] theta_deg: the geometry is impossible"],
        ),
        (
            arms("dx_mm", "dx_m"),
            &["robot.toml:23: [[arm]] dx_m: unknown key", "dx_mm"],
        ),
        (
            nominal("= 90", "= -60"),
            &["robot.toml:9: [joints] max_deg: the largest joint angle, -60, is not above"],
        ),
        (
            nominal("= 90", "= 900"),
            &["robot.toml:9: [joints] max_deg: ", "more than one turn"],
        ),
        (
            with("[tolerance]\nlength_mm = 0\nangle_deg = 1\n"),
            &["robot.toml:11: [tolerance] length_mm: ", "greater than 0"],
        ),
        (
            with("[tolerance]\nlength_mm = 1\nangle_deg = -1\n"),
            &["robot.toml:12: [tolerance] angle_deg: ", "greater than 0"],
        ),
        (
            with("[noise]\nposition_mm = 0\njoint_deg = 0\n"),
            &["robot.toml:11: [noise] position_mm: ", "greater than 0"],
        ),
        (
            with("[noise]\nposition_mm = 1\njoint_deg = -1\n"),
            &["robot.toml:12: [noise] joint_deg: "],
        ),
        (
            with("[noise]\nposition_mm = 1\n"),
            &["robot.toml:10: [noise] joint_deg: the key is missing"],
        ),
        (
            with(
                "[sensor_frame]\nrotation = [[1,0,0],[0,1,0],[0,0,-1]]\ntranslation_mm = [0,0,0]\n",
            ),
            &["robot.toml:11: [sensor_frame] rotation: the matrix is not a rotation"],
        ),
        (
            with("[sensor_frame]\nrotation = [[1,0,0],[0,1,0]]\ntranslation_mm = [0,0,0]\n"),
            &["robot.toml:11: [sensor_frame] rotation: "],
        ),
    ];
    for (robot, expected) in cases {
        assert_fails(robot.as_bytes(), good_samples().as_bytes(), 3, expected);
        let windows = format!("\u{feff}{}", robot.replace('\n', "\r\n"));
        assert_fails(windows.as_bytes(), good_samples().as_bytes(), 3, expected);
    }
}

#[test]
fn a_robot_file_that_is_no_text_is_told_as_such() {
    let cut = b"\xff\xfe#\0\n\0\x00\xd8]\0".to_vec();
    let nul = [NOMINAL.as_bytes(), b"\0"].concat();
    for (robot, expected) in [
        (cut, "robot.toml:2: the UTF-16 text has half a character"),
        (nul, "robot.toml: is not a text file"),
        (
            vec![b'#'; (1 << 20) + 1],
            "robot.toml: the file is larger than 1 MB",
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
