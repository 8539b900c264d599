//! `delta-cal device` with the firmware on an emulated Cortex-M4F and Cortex-M7: QEMU and the bare
//! Rust target are needed.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

mod on_target {
    use crate::support::{Arm, Point, arms_of, distance, nominal_arms, platform, rows_of};
    use object::{Object, ObjectSegment, ObjectSymbol};
    use std::path::PathBuf;
    use std::process::{Command, Stdio};
    use tempfile::TempDir;

    const WORKSPACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    const SAMPLES: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/paper-robot/samples.csv"
    );

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

    #[test]
    fn calibrates_while_its_loop_runs_and_keeps_the_result() {
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
        // The loop turned all the time.
        let control = &report["control_loop"];
        assert!(control["turns"].as_u64().unwrap() > 100, "{control}");
        assert_eq!(control["late"], 0);
        // A turn is one inverse, at most 1,200 instructions by the budget, and a point of the path;
        // the change to the new parameters, which takes two, comes after the calibration.
        let longest = &control["longest_turn_calibrating_instructions"];
        println!("longest turn while calibrating: {longest} instructions");
        assert!(
            (100..1500).contains(&longest.as_u64().unwrap()),
            "{longest}"
        );

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

    #[test]
    fn a_damaged_flash_is_noticed_and_nominal_is_used() {
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
        // 88 figures an arm; three covariances between arms; what became of 40 samples, or of the ten that are
        // held out, and how well these agree with each arm.
        for (options, figures) in [
            (&[][..], 3 * 88 + 3),
            (&["--gate"], 3 * 88 + 3 + 40),
            (&["--held-out", "4"], 3 * 88 + 3 + 10 + 3),
            (&["--method", "ikm"], 3 * 88),
            (
                &["--method", "ikm", "--gate", "--forget", "30"],
                3 * 88 + 40,
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
        assert_same_bits(&["--port", "emulate:m4"], "f32");
        assert_same_bits(&["--port", "emulate:m7"], "f32");
    }

    #[test]
    fn same_bits_on_controller_and_host_in_double_precision() {
        let firmware = firmware(true);
        let firmware = firmware.to_str().unwrap();
        for port in ["emulate:m4", "emulate:m7"] {
            assert_same_bits(&["--port", port, "--double", "--firmware", firmware], "f64");
        }
    }

    /// An instruction that is none, where the control loop begins.
    #[test]
    fn a_fault_ends_the_run_and_is_reported() {
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
