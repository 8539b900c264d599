//! `delta-cal device` with the firmware on an emulated Cortex-M4F and Cortex-M7: QEMU and the bare
//! Rust target are needed.

mod on_target {
    use crate::support::{Arm, Point, arms_of, distance, nominal_arms, platform, rows_of};
    use delta_cal_tests::observed::{OBSERVED_ROBOT, observed_rows};
    use object::{Object, ObjectSegment, ObjectSymbol};
    use std::path::PathBuf;
    use std::process::{Command, Stdio};
    use tempfile::TempDir;

    const WORKSPACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    const SAMPLES: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/paper-robot/samples.csv"
    );

    fn can_run() -> bool {
        delta_cal_verify::have(&["qemu-system-arm", delta_cal_verify::TARGET])
    }

    /// Runs in the workspace, where the firmware is found and built.
    fn device(arguments: &[&str]) -> (i32, String, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
            .arg("device")
            .args(arguments)
            .current_dir(WORKSPACE)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        (
            output.status.code().unwrap(),
            String::from_utf8(output.stdout).unwrap(),
            String::from_utf8(output.stderr).unwrap(),
        )
    }

    fn ok(arguments: &[&str]) -> String {
        let (code, stdout, stderr) = device(arguments);
        assert_eq!(code, 0, "{arguments:?}: {stderr}");
        stdout
    }

    fn json(arguments: &[&str]) -> serde_json::Value {
        serde_json::from_str(&ok(&[arguments, &["--json", "-"]].concat())).unwrap()
    }

    fn path(folder: &TempDir, name: &str) -> String {
        folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// The example's samples.
    fn samples() -> Vec<(Point, Point)> {
        let text = std::fs::read_to_string(SAMPLES).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        rows_of(&rows.collect::<Vec<_>>().join("\n"))
            .into_iter()
            .map(|row| ([row[0], row[1], row[2]], [row[3], row[4], row[5]]))
            .collect()
    }

    /// rms distance between the samples and where Newton's method puts the platform.
    fn rms(arms: &[Arm; 3]) -> f64 {
        let samples = samples();
        let squares: f64 = samples
            .iter()
            .map(|(q, x)| distance(*x, platform(arms, *q)).powi(2))
            .sum();
        (squares / f64::from(u32::try_from(samples.len()).unwrap())).sqrt()
    }

    /// The loop turned all the time while the controller calibrated. A turn is one inverse, at most 1,200 instructions
    /// by the budget, and a point of the path; the change to new parameters, which takes two, comes afterwards.
    fn turned_in_time(report: &serde_json::Value) {
        let control = &report["control_loop"];
        assert!(control["turns"].as_u64().unwrap() > 100, "{control}");
        assert_eq!(control["late"], 0);
        let longest = &control["longest_turn_calibrating_instructions"];
        println!("longest turn while calibrating: {longest} instructions");
        assert!(
            (100..1500).contains(&longest.as_u64().unwrap()),
            "{longest}"
        );
    }

    #[test]
    fn calibrates_while_its_loop_runs_and_keeps_the_result() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let (flash, out) = (path(&folder, "flash.bin"), path(&folder, "out.toml"));
        let link = ["--port", "emulate:m4", "--flash", &flash];
        let calibrate = ["calibrate", "--apply", "--output", &out];
        let report = json(&[&link[..], &calibrate].concat());
        assert_eq!(report["applied"], true);
        assert_eq!(report["device"]["scalar"], "f32");
        let errors = &report["calibration"]["position_error_mm"];
        let [before, after] =
            ["before", "after"].map(|which| errors[which]["rms"].as_f64().unwrap());
        println!("position error before {before:.4} mm, after {after:.4} mm");
        // Single precision moves a point by less than a tenth of a micrometre.
        assert!((before - rms(&nominal_arms())).abs() < 1e-4, "{before}");
        let calibrated = arms_of(&std::fs::read_to_string(&out).unwrap());
        assert!((after - rms(&calibrated)).abs() < 1e-9, "{after}");
        assert!(before > 2.0 && after < 0.05, "{before} {after}");
        turned_in_time(&report);

        // Power off and on.
        let status = json(&[&link[..], &["status"]].concat());
        assert_eq!(status["origin"], "calibrated");
        assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
        let now = ok(&[&link[..], &["parameters"]].concat());
        assert_eq!(arms_of(&now), calibrated);
        // The flash is the board's, and any firmware of the same scalar reads it.
        let other = ["--port", "emulate:m7", "--flash", &flash];
        ok(&[&other[..], &["revert"]].concat());
        let status = json(&[&link[..], &["status"]].concat());
        assert_eq!(status["origin"], "nominal");
    }

    /// A robot that was calibrated on this computer: its gears are in the controller's file again, to the rounding of
    /// single precision, and the control loop turns with them.
    #[test]
    fn a_robot_with_gears_is_applied_and_used() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let (flash, file) = (path(&folder, "flash.bin"), path(&folder, "robot.toml"));
        let gears = "transmission_gain = 0.0008\ntransmission_cos_deg = 0.04\ntransmission_sin2_deg = -0.02\n";
        let arm = |dx: f64, dy: f64, theta: f64| {
            format!(
                "[[arm]]\ndx_mm = {dx}\ndy_mm = {dy}\ndz_mm = 0.2\ntheta_deg = {theta}\nalpha_deg = 0.1\n\
                 la_x_mm = 260.3\nla_y_mm = 0.4\nlb_mm = 479.5\n{gears}"
            )
        };
        let arms = [
            arm(164.0, 0.2, 0.1),
            arm(-82.0, 142.1, 120.0),
            arm(-82.2, -142.0, 240.0),
        ];
        let text = format!("{}[joints]\nmin_deg = -60\nmax_deg = 90\n", arms.concat());
        std::fs::write(&file, text).unwrap();
        let link = ["--port", "emulate:m4", "--flash", &flash];
        let shown = ok(&[&link[..], &["apply", &file]].concat());
        assert!(shown.contains("Applied and stored"), "{shown}");

        let now = json(&[&link[..], &["parameters"]].concat());
        for joint in 0..3 {
            let own = &now["transmissions"][joint];
            for (key, expected) in [
                ("gain", 8e-4),
                ("cos_deg", 0.04),
                ("sin_deg", 0.0),
                ("sin2_deg", -0.02),
            ] {
                let found = own[key].as_f64().unwrap();
                assert!((found - expected).abs() < 1e-8, "{key} {found}");
            }
        }
        // The loop turns with the gears while the controller calibrates, within the same limit as without.
        let report = json(&[&link[..], &["calibrate"]].concat());
        assert_eq!(report["control_loop"]["fingerprint"], now["fingerprint"]);
        turned_in_time(&report);

        // Another robot's file is refused, and nothing changes.
        let other = path(&folder, "other.toml");
        let text = "[nominal]\nbase_radius_mm = 200\nplatform_radius_mm = 45\nupper_arm_mm = 235\nforearm_mm = 800\n\
                    [joints]\nmin_deg = -60\nmax_deg = 90\n";
        std::fs::write(&other, text).unwrap();
        let (code, _, stderr) = device(&[&link[..], &["apply", &other]].concat());
        assert_eq!(code, 3, "{stderr}");
        assert!(
            stderr.contains("is not a robot that the controller was built for"),
            "{stderr}"
        );
        ok(&[&link[..], &["revert"]].concat());
        let status = json(&[&link[..], &["status"]].concat());
        assert_eq!(status["origin"], "nominal");
    }

    /// A robot file and forty heights, distances and single coordinates.
    fn observed(folder: &TempDir) -> [String; 2] {
        let files = [path(folder, "robot.toml"), path(folder, "rows.csv")];
        std::fs::write(&files[0], OBSERVED_ROBOT).unwrap();
        std::fs::write(&files[1], observed_rows(5, 40)).unwrap();
        files
    }

    #[test]
    fn calibrates_from_observations_while_its_loop_runs() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let [robot, rows] = observed(&folder);
        let (flash, out) = (path(&folder, "flash.bin"), path(&folder, "out.toml"));
        let link = ["--port", "emulate:m4", "--flash", &flash];
        let calibrate = ["calibrate", &robot, &rows, "--apply", "--output", &out];
        let report = json(&[&link[..], &calibrate].concat());
        assert_eq!(report["applied"], true);
        turned_in_time(&report);
        let status = json(&[&link[..], &["status"]].concat());
        assert_eq!(status["origin"], "calibrated");
        assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);

        // As this computer calibrates in double precision, but for the controller's rounding.
        let here = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
            .args(["calibrate", &robot, &rows, "--json", "-"])
            .output()
            .unwrap();
        let here: serde_json::Value = serde_json::from_slice(&here.stdout).unwrap();
        let calibrated = arms_of(&std::fs::read_to_string(&out).unwrap());
        let mut largest = 0.0_f64;
        for (arm, values) in here["arms"].as_array().unwrap().iter().zip(&calibrated) {
            let parameters = arm["parameters"].as_array().unwrap();
            assert_eq!(parameters.len(), 8);
            for (parameter, value) in parameters.iter().zip(values) {
                let after = parameter["after"].as_f64().unwrap();
                let sigma = parameter["sigma"].as_f64().unwrap();
                largest = largest.max((after - value).abs() / sigma);
            }
        }
        println!("farthest from double precision: {largest:.4} sigma");
        assert!(largest < 0.05, "{largest}");
        let device = &report["calibration"];
        for table in ["planes", "points"] {
            assert!(device[table].is_object(), "{device}");
            let names = |value: &serde_json::Value| {
                let names = value[table].as_object().unwrap().keys();
                names.cloned().collect::<Vec<_>>()
            };
            assert_eq!(names(device), names(&here));
        }
    }

    #[test]
    fn observations_have_the_same_bits_on_each_core() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let [robot, rows] = observed(&folder);
        for port in ["emulate:m4", "emulate:m7"] {
            for double in [&[][..], &["--double"]] {
                let link = ["--port", port, "verify", &robot, &rows];
                let report = json(&[&link[..], double].concat());
                assert_eq!(report["calibrated"], true);
                assert_eq!(report["sample_count"], 40);
                // 24 parameters, three transmissions and 24 shares, their covariance of which three blocks count as one figure each, the
                // other figures of three arms, four planes and four points.
                assert_eq!(report["figures"], 3 * (8 + 1 + 64 + 8 + 8) + 3 + 8);
                assert_eq!(report["differences"], serde_json::json!([]), "{port}");
            }
        }
    }

    #[test]
    fn a_damaged_flash_is_noticed_and_nominal_is_used() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let flash = path(&folder, "flash.bin");
        let link = ["--port", "emulate:m4", "--flash", &flash];
        ok(&[&link[..], &["calibrate", "--apply"]].concat());
        let mut content = std::fs::read(&flash).unwrap();
        // In the middle of the record, which begins with the first page.
        content[64] ^= 0x55;
        std::fs::write(&flash, &content).unwrap();
        let status = json(&[&link[..], &["status"]].concat());
        assert_eq!(
            status["origin"],
            "nominal, because what was stored is damaged"
        );
        content.pop();
        std::fs::write(&flash, &content).unwrap();
        let (code, _, stderr) = device(&[&link[..], &["status"]].concat());
        assert_eq!(code, 5);
        assert!(
            stderr.contains("is not the flash of this firmware"),
            "{stderr}"
        );
        assert_eq!(std::fs::read(&flash).unwrap(), content);
    }

    fn assert_same_bits(link: &[&str], scalar: &str) {
        let folder = TempDir::new().unwrap();
        let (bare, few) = (path(&folder, "bare.toml"), path(&folder, "few.csv"));
        let text = std::fs::read_to_string(SAMPLES).unwrap();
        let lines: Vec<_> = text.lines().filter(|l| !l.starts_with('#')).collect();
        std::fs::write(&few, lines[..7].join("\n")).unwrap();
        std::fs::write(&bare, crate::support::NOMINAL).unwrap();
        // 89 figures an arm; three covariances between arms; what became of 40 samples, or of the ten that are
        // held out, and how well these agree with each arm.
        for (options, figures) in [
            (&[][..], 3 * 89 + 3),
            (&["--gate"], 3 * 89 + 3 + 40),
            (&["--held-out", "4"], 3 * 89 + 3 + 10 + 3),
            (&["--method", "ikm"], 3 * 89),
            (
                &["--method", "ikm", "--gate", "--forget", "30"],
                3 * 89 + 40,
            ),
        ] {
            let report = json(&[link, &["verify"], options].concat());
            let what = format!("{link:?} {options:?}");
            assert_eq!(report["differences"], serde_json::json!([]), "{what}");
            assert_eq!(report["figures"], figures, "{what}");
            assert_eq!(report["calibrated"], true, "{what}");
            assert_eq!(report["device"]["scalar"], scalar);
            println!("{what}: {figures} figures equal to the bit");
        }
        let refused = json(&[link, &["verify", &bare, &few]].concat());
        assert_eq!(refused["differences"], serde_json::json!([]), "{link:?}");
        assert_eq!(refused["calibrated"], false);
    }

    #[test]
    fn same_bits_on_controller_and_host() {
        if !can_run() {
            return;
        }
        assert_same_bits(&["--port", "emulate:m4"], "f32");
        assert_same_bits(&["--port", "emulate:m7"], "f32");
    }

    #[test]
    fn same_bits_on_controller_and_host_in_double_precision() {
        if !can_run() {
            return;
        }
        let firmware = firmware(true);
        let firmware = firmware.to_str().unwrap();
        for port in ["emulate:m4", "emulate:m7"] {
            assert_same_bits(&["--port", port, "--double", "--firmware", firmware], "f64");
        }
    }

    /// An instruction that is none, where the control loop begins.
    #[test]
    fn a_fault_ends_the_run_and_is_reported() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let mut program = std::fs::read(firmware(false)).unwrap();
        let at = {
            let elf = object::File::parse(&*program).unwrap();
            let mut symbols = elf.symbols();
            let loop_begins = symbols
                .find(|symbol| symbol.name() == Ok("TIMER0"))
                .unwrap();
            // The lowest bit says Thumb.
            let address = loop_begins.address() & !1;
            let segment = elf
                .segments()
                .find(|segment| {
                    (segment.address()..segment.address() + segment.size()).contains(&address)
                })
                .unwrap();
            usize::try_from(segment.file_range().0 + address - segment.address()).unwrap()
        };
        program[at..at + 2].copy_from_slice(&0xde00_u16.to_le_bytes());
        let faulty = path(&folder, "faulty.elf");
        std::fs::write(&faulty, program).unwrap();
        for port in ["emulate:m4", "emulate:m7"] {
            let (code, _, stderr) = device(&["--port", port, "--firmware", &faulty, "status"]);
            assert_eq!(code, 5, "{stderr}");
            assert!(stderr.contains("FAILED hard fault"), "{stderr}");
        }
    }

    /// The firmware, where the command builds it, so that nothing is built twice.
    fn firmware(double: bool) -> PathBuf {
        delta_cal_host::device::build(double, || ()).unwrap()
    }
}
