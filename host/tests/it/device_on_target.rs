//! `delta-cal device` with the firmware on an emulated Cortex-M4F and Cortex-M7. Needs QEMU and the bare-metal Rust
//! target.

use crate::device::controller;
use crate::support::arms_of;
use object::elf::{FileHeader32, PT_LOAD, ProgramHeader32};
use object::read::elf::FileHeader;
use object::{LittleEndian, Object, ObjectSection};
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

/// Whether the test can run here; if not, prints in one line that it was skipped.
fn can_run() -> bool {
    delta_cal_verify::have(&["qemu-system-arm", TARGET])
}

/// The firmware as `firmware-example/README.md` builds it, in `f64` if `double`. Built only once: Cargo rewrites even
/// an up-to-date program, and an emulator that starts at that moment would not find it.
fn firmware(double: bool) -> PathBuf {
    static BUILT: [OnceLock<PathBuf>; 2] = [const { OnceLock::new() }; 2];
    let built = || {
        let target = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../target"));
        // A separate folder: another test may be about to load the other program.
        let (folder, features) = if double {
            (target.join("double"), "double")
        } else {
            (target.to_owned(), "board")
        };
        let build = ["build", "--profile", "firmware", "--target", TARGET];
        let of = ["--package", PACKAGE, "--features", features];
        delta_cal_verify::cargo(&folder, &[&build[..], &of].concat()).unwrap();
        folder.join(TARGET).join("firmware").join(PACKAGE)
    };
    BUILT[usize::from(double)].get_or_init(built).clone()
}

fn free_port() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().to_string()
}

/// A running board, switched off when dropped.
struct Board {
    qemu: Child,
    serial: String,
    monitor: String,
    /// Duration of an instruction, ns.
    instruction: f64,
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

impl Board {
    /// In `f64`, which the M4 computes in software, the loop needs faster instructions to keep pace.
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
        // The monitor port opens before the serial port and answers as soon as the board runs.
        let mut monitor = connected(&board.monitor);
        monitor.read_exact(&mut [0]).unwrap();
        board
    }

    fn ok(&self, arguments: &[&str]) -> String {
        device(&format!("tcp:{}", self.serial), arguments)
    }

    fn json(&self, arguments: &[&str]) -> Value {
        json(&format!("tcp:{}", self.serial), arguments)
    }

    /// The loop kept running while the controller calibrated. A turn is one inverse, with a budget of 1,200
    /// instructions, and a point of the path; switching to new parameters, which takes two inverses, comes afterwards.
    fn turned_in_time(&self, report: &Value) {
        let control = &report["control_loop"];
        assert!(control["turns"].as_u64().unwrap() > 100, "{control}");
        assert_eq!(control["late"], 0);
        let longest = control["longest_turn_calibrating_us"].as_f64().unwrap();
        let instructions = longest * 1000.0 / self.instruction;
        println!("longest turn while calibrating: {instructions:.0} instructions");
        assert!((100.0..1500.0).contains(&instructions), "{instructions}");
    }

    /// Switches the board off and returns its flash, which is the emulator's memory.
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

/// The output of the command.
fn device(port: &str, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
        .args(["device", "--port", port])
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    stdout
}

fn json(port: &str, arguments: &[&str]) -> Value {
    let text = device(port, &[arguments, &["--json", "-"]].concat());
    serde_json::from_str(&text).unwrap()
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

/// Address and size of the memory that a reset preserves.
fn flash_of(program: &[u8]) -> (u64, u64) {
    let elf = object::File::parse(program).unwrap();
    let section = elf.section_by_name(".uninit").unwrap();
    (section.address(), section.size())
}

/// A copy of a firmware with this flash content, as when a board is programmed with both.
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
    // Memory before the flash is cleared at startup, so it has no bytes in the file.
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

    // Power off and on.
    let on = programmed(&firmware, &flash);
    let board = Board::start(M4, on.path(), false);
    let status = board.json(&["status"]);
    assert_eq!(status["origin"], "calibrated");
    assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
    assert_eq!(arms_of(&board.ok(&["parameters"])), calibrated);
    board.ok(&["revert"]);
    assert_eq!(board.json(&["status"])["origin"], "nominal");
}

/// Single and double precision, with a control loop running.
#[test]
fn the_controllers_parameters_have_the_bits_of_this_computers() {
    if !can_run() {
        return;
    }
    for (double, machine, here) in [
        (false, M4, controller::<f32>(false)),
        (false, M7, controller::<f32>(false)),
        (true, M7, controller::<f64>(false)),
    ] {
        let board = Board::start(machine, &firmware(double), double);
        for method in ["joint", "ikm"] {
            let arguments = ["calibrate", "--method", method];
            let there = board.json(&arguments);
            let here = json(&here, &arguments);
            assert_eq!(there["device"]["scalar"], here["device"]["scalar"]);
            assert_eq!(
                there["fingerprint"], here["fingerprint"],
                "{machine} {method}"
            );
        }
    }
}
