//! `delta-cal device` with the firmware on an emulated Cortex-M4F and Cortex-M7. Needs QEMU and the bare-metal Rust
//! target.

use crate::device::{controller, json, run};
use crate::support::Folder;
use serde_json::Value;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

const PACKAGE: &str = "delta-cal-firmware-example";
const TARGET: &str = "thumbv7em-none-eabihf";
const M4: &str = "mps2-an386";
const M7: &str = "mps2-an500";

/// Whether the test can run here; if not, prints in one line that it was skipped.
fn can_run() -> bool {
    delta_cal_verify::have(&["qemu-system-arm", TARGET])
}

/// The firmware as `firmware-example/README.md` builds it, in `f64` if `double`. Both programs are built in the folder
/// of the other Cortex-M programs, under one name, and copied from there.
fn firmware(double: bool) -> PathBuf {
    static BUILT: [OnceLock<PathBuf>; 2] = [const { OnceLock::new() }; 2];
    static BUILDING: Mutex<()> = Mutex::new(());
    let built = || {
        let _alone = BUILDING.lock();
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../target/firmware"));
        let features = if double { "double" } else { "board" };
        let build = ["build", "--profile", "firmware", "--target", TARGET];
        let of = ["--package", PACKAGE, "--features", features];
        delta_cal_verify::cargo(folder, &[&build[..], &of].concat()).unwrap();
        let copy = folder.join(format!("{PACKAGE}-{features}"));
        let program = folder.join(TARGET).join("firmware").join(PACKAGE);
        std::fs::copy(program, &copy).unwrap();
        copy
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
    port: String,
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
            port: format!("tcp:{serial}"),
            instruction: f64::from(1 << shift),
        };
        // The monitor port opens before the serial port and answers as soon as the board runs.
        connected(&monitor).read_exact(&mut [0]).unwrap();
        board
    }

    fn json(&self, arguments: &str) -> Value {
        json(&Folder::new(), &self.port, arguments)
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

/// The loop keeps running while the controller calibrates. A turn is one inverse, with a budget of 1,200 instructions,
/// and a point of the path; switching to new parameters, which takes two inverses, comes afterwards.
#[test]
fn calibrates_while_its_loop_runs() {
    if !can_run() {
        return;
    }
    let board = Board::start(M4, &firmware(false), false);
    let report = board.json("calibrate --apply");
    assert_eq!(report["applied"], true);
    let difference = report["difference_mm"].as_f64().unwrap();
    assert!(difference < 1e-3, "{difference}");
    let control = &report["control_loop"];
    assert!(control["turns"].as_u64().unwrap() > 100, "{control}");
    assert_eq!(control["late"], 0);
    let longest = control["longest_turn_calibrating_us"].as_f64().unwrap();
    let instructions = longest * 1000.0 / board.instruction;
    println!("longest turn while calibrating: {instructions:.0} instructions");
    assert!((100.0..1500.0).contains(&instructions), "{instructions}");
    let status = board.json("status");
    assert_eq!(status["origin"], "calibrated");
    assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
    run(&Folder::new(), &board.port, "revert").ok();
    assert_eq!(board.json("status")["origin"], "nominal");
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
            let arguments = format!("calibrate --method {method}");
            let there = board.json(&arguments);
            let here = json(&Folder::new(), &here, &arguments);
            assert_eq!(there["device"]["scalar"], here["device"]["scalar"]);
            assert_eq!(
                there["fingerprint"], here["fingerprint"],
                "{machine} {method}"
            );
        }
    }
}
