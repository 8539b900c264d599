//! `delta-cal device` with the firmware on an emulated Cortex-M4F and Cortex-M7: QEMU and the bare
//! Rust target are needed.

mod on_target {
    use crate::support::arms_of;
    use delta_cal::Progress;
    use delta_cal::calibration::{self, Ikm, Joint};
    use delta_cal::stream::StreamCalibrator;
    use delta_cal_firmware_example::{Number, nominal};
    use delta_cal_host::device::{begin, samples};
    use delta_cal_host::files::example;
    use delta_cal_protocol::{Begin, Estimator, Geometry};
    use object::elf::{FileHeader32, PT_LOAD, ProgramHeader32};
    use object::read::elf::FileHeader;
    use object::{LittleEndian, Object, ObjectSection, ObjectSegment, ObjectSymbol};
    use serde_json::Value;
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};
    use std::path::{Path, PathBuf};
    use std::process::{Child, Command, Stdio};
    use std::sync::OnceLock;
    use std::time::{Duration, Instant};
    use tempfile::TempDir;

    const PACKAGE: &str = "delta-cal-firmware-example";
    const TARGET: &str = "thumbv7em-none-eabihf";
    const M4: &str = "mps2-an386";
    const M7: &str = "mps2-an500";

    /// Says in one line that a test was skipped, if it cannot run here.
    fn can_run() -> bool {
        delta_cal_verify::have(&["qemu-system-arm", TARGET])
    }

    /// The firmware as `firmware-example/README.md` builds it; in `f64` if `double`. Built once: Cargo puts a program that
    /// is up to date in its place anew, and an emulator that starts at that moment finds none.
    fn firmware(double: bool) -> PathBuf {
        static BUILT: [OnceLock<PathBuf>; 2] = [const { OnceLock::new() }; 2];
        BUILT[usize::from(double)]
            .get_or_init(|| built(double))
            .clone()
    }

    fn built(double: bool) -> PathBuf {
        let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        // A folder of its own: another test may be about to load the other program.
        let folder = workspace.join(if double { "target/double" } else { "target" });
        let features = if double { "double" } else { "board" };
        let status = Command::new(env!("CARGO"))
            .current_dir(workspace)
            .args([
                "build",
                "--quiet",
                "--profile",
                "firmware",
                "--target",
                TARGET,
            ])
            .args(["--package", PACKAGE, "--features", features, "--target-dir"])
            .arg(&folder)
            .status();
        assert!(status.unwrap().success(), "rustup target add {TARGET}");
        folder.join(TARGET).join("firmware").join(PACKAGE)
    }

    fn free_port() -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.local_addr().unwrap().to_string()
    }

    /// A board that is switched on; off when it is dropped.
    struct Board {
        qemu: Child,
        serial: String,
        monitor: String,
        /// Nanoseconds that an instruction takes.
        instruction: f64,
    }

    impl Drop for Board {
        fn drop(&mut self) {
            let _ = self.qemu.kill();
            let _ = self.qemu.wait();
        }
    }

    impl Board {
        /// In `f64`, which the M4 computes by software, the loop keeps its pace with faster instructions.
        fn start(machine: &str, firmware: &Path, double: bool) -> Self {
            let (serial, monitor) = (free_port(), free_port());
            let shift = if double { 3 } else { 6 };
            let qemu = Command::new("qemu-system-arm")
                .args(["-machine", machine, "-nographic"])
                .args(["-semihosting-config", "enable=on,target=native"])
                .args(["-icount", &format!("shift={shift}")])
                .args([
                    "-serial",
                    &format!("tcp:{serial},server=on,wait=off,nodelay=on"),
                ])
                .args(["-monitor", &format!("tcp:{monitor},server=on,wait=off")])
                .arg("-kernel")
                .arg(firmware)
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .expect("apt-get install qemu-system-arm");
            let board = Self {
                qemu,
                serial,
                monitor,
                instruction: f64::from(1 << shift),
            };
            // The monitor listens before the serial port does, and answers once the board runs.
            let mut monitor = connected(&board.monitor);
            monitor.read_exact(&mut [0]).unwrap();
            board
        }

        fn device(&self, arguments: &[&str]) -> (i32, String, String) {
            let output = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
                .args(["device", "--port", &format!("tcp:{}", self.serial)])
                .args(arguments)
                .stdin(Stdio::null())
                .output()
                .unwrap();
            let [stdout, stderr] =
                [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
            (output.status.code().unwrap(), stdout, stderr)
        }

        fn ok(&self, arguments: &[&str]) -> String {
            let (code, stdout, stderr) = self.device(arguments);
            assert_eq!(code, 0, "{arguments:?}: {stderr}");
            stdout
        }

        fn json(&self, arguments: &[&str]) -> Value {
            serde_json::from_str(&self.ok(&[arguments, &["--json", "-"]].concat())).unwrap()
        }

        /// The loop turned all the time while the controller calibrated. A turn is one inverse, at most 1,200 instructions
        /// by the budget, and a point of the path; the change to new parameters, which takes two, comes afterwards.
        fn turned_in_time(&self, report: &Value) {
            let control = &report["control_loop"];
            assert!(control["turns"].as_u64().unwrap() > 100, "{control}");
            assert_eq!(control["late"], 0);
            let longest = control["longest_turn_calibrating_us"].as_f64().unwrap();
            let instructions = longest * 1000.0 / self.instruction;
            println!("longest turn while calibrating: {instructions:.0} instructions");
            assert!((100.0..1500.0).contains(&instructions), "{instructions}");
        }

        /// Switched off: what is in its flash, which is memory of the emulator.
        fn flash(mut self, firmware: &Path) -> Vec<u8> {
            let folder = TempDir::new().unwrap();
            let file = folder.path().join("flash");
            let (address, size) = flash_of(&std::fs::read(firmware).unwrap());
            let mut monitor = connected(&self.monitor);
            let name = file.display();
            write!(
                monitor,
                "stop\npmemsave {address:#x} {size:#x} \"{name}\"\nquit\n"
            )
            .unwrap();
            self.qemu.wait().unwrap();
            std::fs::read(file).unwrap()
        }
    }

    fn connected(address: &str) -> TcpStream {
        let start = Instant::now();
        loop {
            match TcpStream::connect(address) {
                Ok(stream) => return stream,
                Err(error) => assert!(start.elapsed() < Duration::from_secs(20), "{error}"),
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Address and size of what a reset leaves as it is.
    fn flash_of(program: &[u8]) -> (u64, u64) {
        let elf = object::File::parse(program).unwrap();
        let section = elf.section_by_name(".uninit").unwrap();
        (section.address(), section.size())
    }

    /// A copy of a firmware with this in its flash, as a board is programmed with both.
    fn programmed(firmware: &Path, flash: &[u8]) -> tempfile::NamedTempFile {
        let mut program = std::fs::read(firmware).unwrap();
        let (address, _) = flash_of(&program);
        let header = FileHeader32::<LittleEndian>::parse(&*program).unwrap();
        let start = header.e_phoff(LittleEndian) as usize;
        let count = header.e_phnum(LittleEndian).into();
        let end = program.len();
        let (headers, _) = object::pod::slice_from_bytes_mut::<ProgramHeader32<LittleEndian>>(
            &mut program[start..],
            count,
        )
        .unwrap();
        let header = headers.iter_mut().find(|header| {
            let first = u64::from(header.p_vaddr.get(LittleEndian));
            let length = u64::from(header.p_memsz.get(LittleEndian));
            header.p_type.get(LittleEndian) == PT_LOAD && (first..first + length).contains(&address)
        });
        let header = header.unwrap();
        // Everything before the flash is cleared at the start anyway: it had nothing in the file.
        assert_eq!(header.p_filesz.get(LittleEndian), 0);
        let before = address - u64::from(header.p_vaddr.get(LittleEndian));
        let length = header.p_memsz.get(LittleEndian);
        header
            .p_offset
            .set(LittleEndian, u32::try_from(end).unwrap());
        header.p_filesz.set(LittleEndian, length);
        program.resize(end + usize::try_from(before).unwrap(), 0);
        program.extend_from_slice(flash);
        program.resize(end + length as usize, 0);
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&program).unwrap();
        file
    }

    #[test]
    fn calibrates_while_its_loop_runs_and_keeps_the_result() {
        if !can_run() {
            return;
        }
        let firmware = firmware(false);
        let board = Board::start(M4, &firmware, false);
        let report = board.json(&["calibrate", "--apply"]);
        assert_eq!(report["applied"], true);
        assert_eq!(report["device"]["scalar"], "f32");
        let difference = report["difference_mm"].as_f64().unwrap();
        assert!(difference < 1e-3, "{difference}");
        board.turned_in_time(&report);
        let calibrated = arms_of(&board.ok(&["parameters"]));
        let flash = board.flash(&firmware);

        // Off and on.
        let on = programmed(&firmware, &flash);
        let board = Board::start(M4, on.path(), false);
        let status = board.json(&["status"]);
        assert_eq!(status["origin"], "calibrated");
        assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
        assert_eq!(arms_of(&board.ok(&["parameters"])), calibrated);
        board.ok(&["revert"]);
        assert_eq!(board.json(&["status"])["origin"], "nominal");

        // Damaged in the middle of the record, which begins with the first page.
        let mut damaged = flash;
        damaged[64] ^= 0x55;
        let on = programmed(&firmware, &damaged);
        let status = Board::start(M7, on.path(), false).json(&["status"]);
        let origin = status["origin"].as_str().unwrap();
        assert_eq!(origin, "nominal: the stored parameters are damaged");
    }

    /// A robot that was calibrated on this computer: its gears are in the controller's parameters again, to the rounding of
    /// single precision, and the control loop turns with them.
    #[test]
    fn a_robot_with_gears_is_applied_and_used() {
        if !can_run() {
            return;
        }
        let folder = TempDir::new().unwrap();
        let file = folder.path().join("robot.toml");
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
        let board = Board::start(M4, &firmware(false), false);
        let shown = board.ok(&["apply", file.to_str().unwrap()]);
        assert!(shown.contains("Applied"), "{shown}");
        let now = board.json(&["parameters"]);
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
        let report = board.json(&["calibrate"]);
        assert_eq!(report["control_loop"]["fingerprint"], now["fingerprint"]);
        board.turned_in_time(&report);
    }

    /// Of the example's samples, calibrated here with the controller's numbers.
    fn fingerprint<T: Number>(estimator: Estimator) -> String {
        match estimator {
            Estimator::Arms => fingerprint_by::<T, Ikm>(estimator),
            Estimator::Joint => fingerprint_by::<T, Joint>(estimator),
        }
    }

    fn fingerprint_by<T: Number, E: calibration::Estimator>(estimator: Estimator) -> String {
        let (robot, file) = example::load().unwrap();
        let begin = Begin {
            session: 1,
            ..begin::<T>(&robot, estimator)
        };
        let (settings, selection) = begin.calibrator().unwrap();
        let nominal = nominal().unwrap();
        let mut stream = StreamCalibrator::<T, E>::new(&nominal, &settings, &selection);
        for sample in samples(&file) {
            stream.add(&sample).unwrap();
        }
        stream.solve().unwrap();
        while stream.step() == Progress::Working {}
        let outcome = stream.outcome().unwrap();
        format!("{:08x}", Geometry::of(E::robot(&outcome)).fingerprint())
    }

    #[test]
    fn the_controllers_parameters_have_the_bits_of_this_computers() {
        if !can_run() {
            return;
        }
        for double in [false, true] {
            let firmware = firmware(double);
            for machine in [M4, M7] {
                let board = Board::start(machine, &firmware, double);
                for (method, estimator) in [("joint", Estimator::Joint), ("ikm", Estimator::Arms)] {
                    let report = board.json(&["calibrate", "--method", method]);
                    let (scalar, here) = if double {
                        ("f64", fingerprint::<f64>(estimator))
                    } else {
                        ("f32", fingerprint::<f32>(estimator))
                    };
                    assert_eq!(report["device"]["scalar"], scalar);
                    assert_eq!(report["fingerprint"], here, "{machine} {scalar} {method}");
                }
            }
        }
    }

    /// An instruction that is none, where the control loop begins.
    #[test]
    fn a_fault_ends_the_run() {
        if !can_run() {
            return;
        }
        let mut program = std::fs::read(firmware(false)).unwrap();
        let at = {
            let elf = object::File::parse(&*program).unwrap();
            let mut symbols = elf.symbols();
            let loop_begins = symbols.find(|symbol| symbol.name() == Ok("TIMER0"));
            // The lowest bit says Thumb.
            let address = loop_begins.unwrap().address() & !1;
            let mut segments = elf.segments();
            let segment = segments.find(|segment| {
                (segment.address()..segment.address() + segment.size()).contains(&address)
            });
            let segment = segment.unwrap();
            usize::try_from(segment.file_range().0 + address - segment.address()).unwrap()
        };
        program[at..at + 2].copy_from_slice(&0xde00_u16.to_le_bytes());
        let mut faulty = tempfile::NamedTempFile::new().unwrap();
        faulty.write_all(&program).unwrap();
        for machine in [M4, M7] {
            let mut qemu = Command::new("qemu-system-arm")
                .args([
                    "-machine",
                    machine,
                    "-nographic",
                    "-monitor",
                    "none",
                    "-serial",
                    "none",
                ])
                .args(["-semihosting-config", "enable=on,target=native"])
                .args(["-icount", "shift=6", "-kernel"])
                .arg(faulty.path())
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let mut said = String::new();
            qemu.stderr
                .take()
                .unwrap()
                .read_to_string(&mut said)
                .unwrap();
            assert!(!qemu.wait().unwrap().success());
            assert!(said.contains("FAILED hard fault"), "{said}");
        }
    }
}
