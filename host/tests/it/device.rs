//! `delta-cal device` with the firmware's controller in this process, behind a TCP port, and with invalid input.

use crate::support::{
    Folder, NOMINAL, Run, TO_MEASURE, TOLERANCE, TOWERS, arms_of, assert_refused, csv, exact,
    noisy, number, robot_toml, true_arms,
};
use delta_cal_controller::{Controller, Handover, Number, ParameterFlash, StreamFlash, Timer};
use delta_cal_firmware_example::{Circle, limits, machine};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;
use std::time::Duration;

/// Every turn is punctual.
struct Turns(u32);

impl Timer for Turns {
    const TICKS_A_SECOND: u32 = 1_000_000;
    const MASK: u32 = u32::MAX;
    fn now(&self) -> u32 {
        self.0.wrapping_mul(1000)
    }
}

/// A controller at a TCP port that serves one command after another and keeps its state. With `hangs_up` it closes the
/// link once, instead of answering, after it has changed its parameters.
pub(crate) fn controller<T: Number>(mut hangs_up: bool) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let machine = machine::<T>(0x410f_c241).unwrap();
        let flash = ParameterFlash::new();
        let mut controller = Controller::new(machine, flash, StreamFlash::new());
        let mut handover = Handover::default();
        let (mut background, mut foreground) = handover.split(
            &controller.current(),
            Circle::default(),
            &limits(),
            [T::ZERO; 3],
        );
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let timeout = Some(Duration::from_millis(1));
            stream.set_read_timeout(timeout).unwrap();
            let mut buffer = [0; 64];
            'link: loop {
                let count = match stream.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => count,
                    Err(error) if error.kind() == ErrorKind::WouldBlock => 0,
                    Err(_) => break,
                };
                for byte in &buffer[..count] {
                    let before = controller.current();
                    let Some(answer) = controller.receive(*byte) else {
                        continue;
                    };
                    if hangs_up && controller.current() != before {
                        hangs_up = false;
                        break 'link;
                    }
                    if stream.write_all(&answer).is_err() {
                        break;
                    }
                }
                for _ in 0..100 {
                    let now = Turns(foreground.control_loop.state.turns);
                    foreground.turn(&now, |_| {});
                    background.exchange(&mut controller);
                    controller.idle();
                }
            }
        }
    });
    port
}

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";

fn robot() -> String {
    format!("{NOMINAL}{TOLERANCE}{NOISE}")
}

/// A folder with the controller's robot and good samples of a different robot.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot());
    folder.write("samples.csv", csv(&noisy(&true_arms(), 40, 0.02)));
    folder
}

pub(crate) fn run(folder: &Folder, port: &str, arguments: &str) -> Run {
    folder.run(&format!("device --port {port} {arguments}"))
}

/// The JSON report on standard output.
pub(crate) fn json(folder: &Folder, port: &str, arguments: &str) -> serde_json::Value {
    let run = run(folder, port, &format!("{arguments} --json -"));
    run.ok().json()
}

#[test]
fn calibrates_applies_and_reverts() {
    let folder = folder();
    let port = controller::<f32>(false);
    run(&folder, &port, "calibrate robot.toml samples.csv")
        .ends(0, "Not applied | Cortex-M4 r0p1 | mm rms from those of");
    let status = json(&folder, &port, "status");
    assert_eq!(status["origin"], "nominal");
    assert_eq!(status["phase"], "solved from 40 samples");
    assert_eq!(status["result_in_use"], false);

    let report = json(&folder, &port, "calibrate robot.toml samples.csv --apply");
    assert_eq!(report["applied"], true);
    // This computer's report on the same files, which differs only by single-precision rounding.
    let here = folder.run("calibrate robot.toml samples.csv --output out.toml --json -");
    assert_eq!(report["calibration"]["arms"], here.ok().json()["arms"]);
    let difference = report["difference_mm"].as_f64().unwrap();
    assert!((1e-7..1e-3).contains(&difference), "{difference}");

    // The controller uses what it reported, which is close to the calibration done here.
    run(&folder, &port, "parameters robot.toml --output now.toml").ok();
    let [now, out] = ["now.toml", "out.toml"].map(|name| arms_of(&folder.read(name)));
    for (now, out) in now.iter().flatten().zip(out.iter().flatten()) {
        assert!((now - out).abs() < 2e-3, "{now} {out}");
    }
    let status = json(&folder, &port, "status");
    assert_eq!(status["origin"], "calibrated");
    assert_eq!(status["result_in_use"], true);
    assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
    assert_eq!(status["control_loop"]["switches"], 1);

    run(&folder, &port, "revert").ends(0, "in use: nominal");
    let parameters = json(&folder, &port, "parameters");
    assert_eq!(
        parameters["fingerprint"],
        parameters["device"]["nominal_fingerprint"]
    );
    // Repeating the command changes nothing: rejected parameters do not return.
    for again in ["revert", "revert --nominal"] {
        run(&folder, &port, again).ends(0, "in use: nominal | unchanged");
    }
}

#[test]
fn applies_a_robot_that_was_calibrated_here_and_works_with_its_own_robot_file() {
    let folder = folder();
    let port = controller::<f32>(false);
    folder
        .run("calibrate robot.toml samples.csv --output calibrated.toml")
        .ok();
    run(&folder, &port, "apply calibrated.toml").ends(0, "Parameters in use: calibrated");
    let calibrated = arms_of(&folder.read("calibrated.toml"));
    let now = arms_of(&run(&folder, &port, "parameters").ok().stdout);
    for (now, calibrated) in now.iter().flatten().zip(calibrated.iter().flatten()) {
        assert!((now - calibrated).abs() < 1e-4, "{now} {calibrated}");
    }

    // Inexact gears.
    let gears = "transmission_gain = 0.0008\ntransmission_sin2_deg = -0.02\n";
    let with_gears = robot_toml(&true_arms()).replace("[[arm]]\n", &format!("[[arm]]\n{gears}"));
    folder.write("gears.toml", with_gears);
    run(&folder, &port, "apply gears.toml").ok();
    let now = json(&folder, &port, "parameters");
    for joint in 0..3 {
        for (key, expected) in [("gain", 8e-4), ("cos_deg", 0.0), ("sin2_deg", -0.02)] {
            let found = number(&now, &format!("transmissions/{joint}/{key}"));
            assert!((found - expected).abs() < 1e-8, "{key} {found}");
        }
    }

    for command in [
        "calibrate",
        "parameters --nominal --output nominal.toml",
        "calibrate nominal.toml samples.csv --method ikm",
    ] {
        run(&folder, &port, command).ok();
    }
    let printed = run(&folder, &port, "parameters --nominal").ok().stdout;
    assert_eq!(printed, folder.read("nominal.toml"));

    // In the axes of a robot file whose z points downwards, about x.
    let down = robot_toml(&true_arms()) + "\n[convention]\nz_axis = \"down\"\n";
    folder.write("down.toml", down);
    let [up, down] =
        ["", "down.toml "].map(|own| json(&folder, &port, &format!("parameters {own}--nominal")));
    let turned = ["Dy", "Dz", "theta", "La_y"].map(|key| (key, -1.0));
    for (key, sign) in turned
        .into_iter()
        .chain(["Dx", "alpha", "La_x", "Lb"].map(|key| (key, 1.0)))
    {
        for arm in 0..3 {
            let [up, down] = [&up, &down].map(|own| number(own, &format!("arms/{arm}/{key}")));
            assert!((sign * up - down).abs() < 1e-9, "{key} {up} {down}");
        }
    }
}

/// The result is in use although the interrupted command did not learn it, and the next command does no harm.
#[test]
fn a_link_that_breaks_leaves_open_whether_the_result_is_in_use() {
    const APPLY: &str = "calibrate robot.toml samples.csv --apply";
    let folder = folder();
    let port = controller::<f32>(true);
    run(&folder, &port, APPLY).ends(5, "may use the new parameters | help: | status");
    let says = |part: &str| run(&folder, &port, "status").ends(0, part);
    says("solved from 40 samples; the result is in use");
    let applied = json(&folder, &port, APPLY);
    let status = json(&folder, &port, "status");
    assert_eq!(status["result_in_use"], true);
    let control = &status["control_loop"];
    assert_eq!(control["switches"], 1, "applied twice");
    assert_eq!(control["fingerprint"], applied["fingerprint"]);
    run(&folder, &port, "revert").ok();
    says("the result is not in use");
}

#[test]
fn refusals_change_nothing_and_say_why() {
    let folder = folder();
    let port = controller::<f32>(false);
    folder.write("bare.toml", NOMINAL);
    folder.write("few.csv", csv(&exact(&true_arms(), 5)));
    let swapped = csv(&exact(&true_arms(), 40)).replace("x_mm,y_mm", "y_mm,x_mm");
    folder.write("swapped.csv", swapped);
    folder.write("touched.toml", TO_MEASURE);
    let touches = "q1_deg,q2_deg,q3_deg,height_mm\n10,20,30,0\n12,20,30,0\n";
    folder.write("touches.csv", touches);
    let gears = TOLERANCE.replace("[tolerance]", "[tolerance]\ntransmission_deg = 0.05");
    folder.write("gears.toml", format!("{NOMINAL}{gears}{NOISE}"));
    let rods = TOLERANCE.replace("[tolerance]", "[tolerance]\nlb_mm = 0.02");
    folder.write("single.toml", format!("{NOMINAL}{rods}{NOISE}"));
    let longer = robot().replace("upper_arm_mm = 260", "upper_arm_mm = 260.01");
    folder.write("longer.toml", longer);
    let other = NOMINAL.replace("forearm_mm = 480", "forearm_mm = 800");
    folder.write("other.toml", other);
    folder.write("towers.toml", TOWERS);
    let rods = "\n[parallelogram]\nspacing_mm = 60\n";
    folder.write("rods.toml", format!("{NOMINAL}{rods}"));
    let table = include_str!("../files/refused-by-device.txt");
    let command = format!("device --port {port} --json report.json");
    assert_refused(&folder, &command, table);
    let status = json(&folder, &port, "status");
    assert_eq!(status["origin"], "nominal");
    // Nothing that this computer refuses was sent.
    assert_eq!(status["phase"], "none since the start");
    assert_eq!(status["control_loop"]["switches"], 0);
}

#[test]
fn a_peer_that_is_no_controller_is_reported() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        // One peer that echoes, and one that closes the connection.
        let (mut echo, _) = listener.accept().unwrap();
        let mut buffer = [0; 64];
        while let Ok(count @ 1..) = echo.read(&mut buffer) {
            echo.write_all(&buffer[..count]).unwrap();
        }
        drop(listener.accept());
    });
    let table = "
        status ⇒ 5 ⇒ no answer to 8 requests | --baud
        status ⇒ 5 ⇒ the link | cable
        ";
    assert_refused(&folder, &format!("device --port {port}"), table);
}

/// A driver that was written from docs/protocol.md alone, in another language.
#[test]
fn the_page_is_enough_for_another_driver() {
    if !delta_cal_verify::have(&["python3"]) {
        return;
    }
    for port in [controller::<f32>(false), controller::<f64>(false)] {
        let address = port.strip_prefix("tcp:").unwrap();
        let run = std::process::Command::new("python3")
            .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            .args(["-B", "tests/driver/driver.py", address])
            .arg("protocol/src/golden.txt")
            .arg("host/examples/paper-robot/samples.csv")
            .output()
            .unwrap();
        assert!(
            run.status.success(),
            "{}",
            String::from_utf8_lossy(&run.stderr)
        );
    }
}

/// Two programs would each take bytes from the other.
#[cfg(target_os = "linux")]
#[test]
fn a_serial_port_is_open_once() {
    let port: delta_cal_host::device::Port = "/dev/ptmx".parse().unwrap();
    let first = port.open(115_200).unwrap();
    let again = port.open(115_200).unwrap_err();
    assert_eq!(again.kind(), ErrorKind::ResourceBusy);
    drop(first);
    assert!(port.open(115_200).is_ok());
}
