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

const PRINTERS: &str = "printers-cfg";
const MARLIN_HOME: &str = "--home 531.376151,530.926151,531.826151";
const SENSOR: &str = "calibrate robot.toml samples.csv --frame sensor";

const CASES: &[Case] = &[
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

/// Configurations of printers.
const OF_PRINTERS: &[Case] = &[
    case(
        PRINTERS,
        "calibrate zero-off.cfg",
        0,
        &["Bed error now: 0.04 mm rms", "Nothing to change"],
        &["[printer]"],
    ),
    // The configuration as it stands is 0.049 mm off, not the one with other rods.
    case(
        PRINTERS,
        "calibrate rods-267.cfg --rods 267mm",
        0,
        &["Bed error now: 0.06 mm rms (0.15 mm worst)"],
        &[],
    ),
    case(
        PRINTERS,
        "calibrate pasted-at-the-end.cfg",
        3,
        &[
            "Klipper ignores the block of SAVE_CONFIG",
            "move such lines above the block",
        ],
        &["7 heights"],
    ),
    case(
        PRINTERS,
        "calibrate stale-after-new-rods.cfg",
        3,
        &[
            "not the fit of the saved heights",
            "mm off (rms)",
            "run DELTA_CALIBRATE and SAVE_CONFIG again",
        ],
        &[],
    ),
    case(
        PRINTERS,
        "calibrate paper-and-probe.cfg",
        0,
        &[
            "11 heights",
            "Heights by hand and by the probe differ by 0.1",
            "z_offset",
        ],
        &[],
    ),
    case(
        PRINTERS,
        "import marlin marlin-octoprint.txt --output x",
        0,
        &["Written: x/robot.toml"],
        &[],
    ),
    case(
        PRINTERS,
        "calibrate marlin-octoprint.txt",
        3,
        &["G33 does not say at which radius it probed"],
        &["reprapfirmware"],
    ),
    case(
        PRINTERS,
        "import reprapfirmware rrf-config.g --output x",
        3,
        &["M501 loads config-override.g", "copy config-override.g"],
        &["SuperSecret"],
    ),
    // 0.41 and 1.0 mm as it stands; the end stops move by up to 2.6 mm.
    case(
        "klipper-41-touches",
        "calibrate printer_7_of_41.cfg",
        0,
        &[
            "Bed error now: 0.4",
            "position_endstop -2.6",
            "lower the nozzle onto the bed by hand",
        ],
        &[],
    ),
    case(
        "klipper1610-rotary-endstop",
        "calibrate printer.cfg",
        1,
        &[
            "3 readings leave the height of the bed uncertain",
            "9.3°: position_endstop 230.",
            "shoulder_height 383.9",
        ],
        &["height0", "rods"],
    ),
    case(
        "klipper5455-distance-below-bed",
        "calibrate printer.cfg",
        3,
        &[
            "distance0: its two poses are 192 and 198 mm below the bed",
            "other end stops",
        ],
        &["height0"],
    ),
    case(
        "klipper5455-distance-below-bed",
        "calibrate printer_heights_only.cfg",
        0,
        &["7 heights"],
        &[],
    ),
    case(
        "marlin-m665-b",
        "import marlin m503_old.txt --output x",
        0,
        &[MARLIN_HOME],
        &[],
    ),
    case(
        "marlin-m665-b",
        "import marlin m503_new.txt --output x",
        0,
        &[MARLIN_HOME],
        &[],
    ),
    case(
        "marlin-m665-b",
        "import marlin m503_typed.txt --output x",
        3,
        &[
            "M665 B: since Marlin 2.0 B lengthens",
            "if you meant the printable radius: send M665 B0",
        ],
        &["reprapfirmware"],
    ),
    case(
        "marlin-m665-b",
        "import marlin config.g --output x",
        3,
        &["this is a file of RepRapFirmware"],
        &[],
    ),
    case(
        "rrf335-shrinking-rods",
        "import reprapfirmware config-override.g --output x",
        0,
        &[
            "The rods of 269.551, 269.551, 269.541 mm are the result of an earlier calibration",
            "--rods",
        ],
        &[],
    ),
    case(
        "rrf335-shrinking-rods",
        "import reprapfirmware config-override.g --rods 288.14±0.1mm --output x",
        0,
        &["The rods are 288.14, 288.14, 288.14 mm as --rods states"],
        &[],
    ),
    case(
        "rrf335-shrinking-rods",
        "calibrate robot_rods_known.toml touches_reconstructed.csv",
        0,
        &["The scale comes from the tolerance", "288.1400   288.13"],
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
    check(CASES);
}

#[test]
fn each_printer_is_told_what_is_right() {
    check(OF_PRINTERS);
}

fn check(cases: &[Case]) {
    for Case {
        folder: name,
        command,
        code,
        says,
        not,
    } in cases
    {
        let (name, command, code) = (*name, *command, *code);
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
        for word in *says {
            assert!(text.contains(word), "{name}: {word}\n{all}");
        }
        for word in *not {
            assert!(!text.contains(word), "{name}: {word}\n{all}");
        }
    }
}
