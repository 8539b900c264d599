//! Files as users and instruments wrote them, each with what is right to say of it: `tests/cases`.

use crate::support::Folder;
use std::path::{Path, PathBuf};

/// Folder, arguments, exit code, what is said, and what is not.
struct Case {
    folder: &'static str,
    command: &'static str,
    code: i32,
    says: &'static [&'static str],
    not: &'static [&'static str],
}

const fn case(
    folder: &'static str,
    command: &'static str,
    code: i32,
    says: &'static [&'static str],
    not: &'static [&'static str],
) -> Case {
    Case {
        folder,
        command,
        code,
        says,
        not,
    }
}

const SENSOR: &str = "calibrate robot.toml samples.csv --frame sensor";

const CASES: [Case; 17] = [
    case(
        "../../examples/circle-sheet",
        SENSOR,
        1,
        &[
            "the joint zeros are off: arm 1 -9.9°",
            "the arms hang lower",
            "zero_deg",
            "Home the robot again",
        ],
        &[],
    ),
    // Ten rows, each five times: the error of ten rows.
    case(
        "tracker-byte-identical-rows",
        SENSOR,
        0,
        &["to the last digit"],
        &[],
    ),
    case(
        "tracker-clockwise-arms-called-mirrored",
        SENSOR,
        3,
        &[
            "Probably q2_deg and q3_deg, or arm 2 and arm 3, are exchanged, as where the arms are numbered clockwise",
            "azimuth_deg = [0, 240, 120]",
            "[joints]",
        ],
        &["Probably the sensor's frame is mirrored"],
    ),
    case(
        "tracker-sign-with-limits-in-same-sign",
        SENSOR,
        1,
        &[
            "all joints count upwards in samples.csv and in [joints]",
            "joint_positive = \"up\"",
        ],
        &[],
    ),
    case(
        "tracker-encoder-slip-called-drift",
        SENSOR,
        1,
        &["joint zero of arm 3 jumped by", "0.5", "at line 17"],
        &["drift"],
    ),
    case(
        "tracker-same-drift-random-order",
        SENSOR,
        0,
        &["drift by 0.1"],
        &[],
    ),
    case(
        "tracker-noise-in-um",
        SENSOR,
        1,
        &["position_mm = 30", "another unit", "0.029"],
        &["as accurate as they can show", "0.48"],
    ),
    case(
        "tracker-recipe5-target-with-frame-sensor",
        SENSOR,
        0,
        &["Sensor frame"],
        &["[target]:"],
    ),
    case(
        "tracker-sensor-sigma-and-expected-error",
        "calibrate robot.toml samples.csv --frame sensor --limit 0.1mm",
        0,
        &[
            "relative, after the best rigid motion               0.036",
            "absolute, in the frame of the base                    1.0",
            "Pass: expanded uncertainty (relative)",
        ],
        &[],
    ),
    case(
        "instrument-files",
        "calibrate robot.toml motive/take.csv --frame sensor",
        3,
        &["Motive export", "line 7", "no joint angles"],
        &[],
    ),
    case(
        "instrument-files",
        "calibrate robot.toml motive/merged.csv --frame sensor --columns x_m=X,y_m=Y,z_m=Z",
        3,
        &["more than one such column", "7 X", "x_m=7"],
        &[],
    ),
    case(
        "instrument-files",
        "calibrate robot.toml motive/merged.csv --frame sensor --columns x_m=7,y_m=8,z_m=9",
        1,
        &["Nothing to improve"],
        &[],
    ),
    case(
        "instrument-files",
        "calibrate robot.toml tracker/position_SMR_1.txt --frame sensor",
        3,
        &["no header, 3 columns", "joints"],
        &[],
    ),
    case(
        "instrument-files",
        "calibrate robot.toml tracker/pasted.txt --frame sensor",
        3,
        &[
            "no header, 6 columns",
            "q1_deg q2_deg q3_deg x_mm y_mm z_mm",
        ],
        &[],
    ),
    case(
        "instrument-files",
        "calibrate robot.toml tracker/semicolons_decimal_commas.csv --frame sensor --columns x_mm=X,y_mm=Y,z_mm=Z",
        0,
        &["0.018 mm"],
        &[],
    ),
    case(
        "b-and-r-mechanical-system",
        "export robot.toml --for b-and-r",
        0,
        &[
            "BasePlatform.Arm1LinkPoint.Radius = 250.0000",
            "BasePlatform.Arm3LinkPoint.Z = 0.0000",
            "Arms.Arm1.UpperArmLength = 600.0000",
            "EndEffectorPlatform.Arm1LinkPoint.Radius = 50.0000",
            "EndEffectorPlatform.TranslationToFlange.Z = -150.0000",
            "Offsets.JointAxis[1] = 0.0000",
            "CountDirections.JointAxis[1] = Standard",
        ],
        &[],
    ),
    case(
        "b-and-r-mechanical-system",
        "forward robot.toml angles.csv",
        0,
        &["0,0,0,0,0,-412.31056"],
        &[],
    ),
];

fn copy(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (own, other): (PathBuf, PathBuf) = (entry.path(), to.join(entry.file_name()));
        if own.is_dir() {
            std::fs::create_dir(&other).unwrap();
            copy(&own, &other);
        } else {
            std::fs::copy(&own, &other).unwrap();
        }
    }
}

#[test]
fn each_case_is_told_what_is_right() {
    for Case {
        folder: name,
        command,
        code,
        says,
        not,
    } in CASES
    {
        let folder = Folder::new();
        copy(
            &Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("tests/cases")
                .join(name),
            &folder.path("."),
        );
        let run = folder.run(command);
        // In one line, however it was wrapped.
        let all = format!("{} {}", run.stdout, run.stderr);
        let text = all.split('\n').map(str::trim).collect::<Vec<_>>().join(" ");
        assert_eq!(run.code, code, "{name}: {command}\n{all}");
        for word in says {
            assert!(text.contains(word), "{name}: {word}\n{all}");
        }
        for word in not {
            assert!(!text.contains(word), "{name}: {word}\n{all}");
        }
    }
}
