//! `delta-cal device`: against the firmware's controller in this process, behind a TCP port, and
//! against wrong input.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use delta_cal_firmware_example::{Controller, Handover, ParameterFlash, Timer, nominal};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;
use std::time::Duration;
use support::{
    Folder, HEADER, NOMINAL, Run, TOLERANCE, arms_of, csv, distance, exact, noisy, nominal_arms,
    platform, true_arms,
};

struct Still;

impl Timer for Still {
    const TICKS_A_SECOND: u32 = 1_000_000;
    const MASK: u32 = 0x00ff_ffff;
    fn now(&self) -> u32 {
        0
    }
}

/// A controller at a TCP port that serves one command after the other; it keeps its state.
fn controller() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let flash = ParameterFlash::new();
        let mut controller = Controller::new(nominal::<f32>().unwrap(), flash, 0x410f_c241);
        let mut handover = Handover::new();
        let (mut background, mut foreground) = handover.split(&controller.current());
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            stream
                .set_read_timeout(Some(Duration::from_millis(1)))
                .unwrap();
            let mut buffer = [0; 64];
            loop {
                let count = match stream.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => count,
                    Err(error) if error.kind() == ErrorKind::WouldBlock => 0,
                    Err(_) => break,
                };
                for byte in &buffer[..count] {
                    if let Some(answer) = controller.receive(*byte)
                        && stream.write_all(&answer).is_err()
                    {
                        break;
                    }
                }
                for _ in 0..100 {
                    foreground.turn(&Still, |_| {});
                    if let Some(state) = background.state() {
                        controller.set_control(state);
                    }
                    if background.ready()
                        && let Some(parameters) = controller.take_switch()
                    {
                        background.hand_over(parameters).unwrap();
                    }
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

/// A folder with the controller's robot and good samples of another one.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot());
    folder.write("samples.csv", csv(&noisy(&true_arms(), 40, 0.02)));
    folder
}

fn run(folder: &Folder, port: &str, arguments: &str) -> Run {
    folder.run(&format!("device --port {port} {arguments}"))
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

/// rms distance between the samples and where Newton's method puts the platform.
fn rms(arms: &[support::Arm; 3], samples: &[(support::Point, support::Point)]) -> f64 {
    let squares: f64 = samples
        .iter()
        .map(|(q, x)| distance(*x, platform(arms, *q)).powi(2))
        .sum();
    (squares / f64::from(u32::try_from(samples.len()).unwrap())).sqrt()
}

#[test]
fn calibrates_applies_and_reverts() {
    let folder = folder();
    let port = controller();
    let samples = noisy(&true_arms(), 40, 0.02);

    let looked_at = run(&folder, &port, "calibrate robot.toml samples.csv").ok();
    assert!(
        looked_at.stdout.contains("Not applied"),
        "{}",
        looked_at.stdout
    );
    assert!(
        looked_at.stdout.contains("Cortex-M4 r0p1"),
        "{}",
        looked_at.stdout
    );
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "nominal");
    assert_eq!(status["phase"], "solved, from 40 samples");

    let command = "calibrate robot.toml samples.csv --apply --output out.toml --json report.json";
    let applied = run(&folder, &port, command).ok();
    assert!(applied.stdout.contains("Applied"), "{}", applied.stdout);
    let report = json(&folder.read("report.json"));
    assert_eq!(report["applied"], true);
    // Single precision, and printed with all digits.
    let errors = &report["calibration"]["position_error_mm"];
    let before = errors["before"]["rms"].as_f64().unwrap();
    let after = errors["after"]["rms"].as_f64().unwrap();
    assert!(
        (before - rms(&nominal_arms(), &samples)).abs() < 1e-4,
        "{before}"
    );
    assert!(
        (after - rms(&arms_of(&folder.read("out.toml")), &samples)).abs() < 1e-9,
        "{after}"
    );
    assert!(after < 0.05 && before > 0.5, "{before} {after}");

    // The controller's parameters are those that were written, to the bit.
    run(&folder, &port, "parameters robot.toml --output now.toml").ok();
    let (out, now) = (folder.read("out.toml"), folder.read("now.toml"));
    assert_eq!(arms_of(&out), arms_of(&now));
    let below = |text: &str| text[text.find("[[arm]]").unwrap()..].to_owned();
    assert_eq!(below(&out), below(&now));
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "calibrated");
    assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
    assert_eq!(status["control_loop"]["switches"], 1);

    // Seen from the calibrated robot there is nothing left to gain.
    let again = run(&folder, &port, "calibrate robot.toml samples.csv --json -").ok();
    let again = json(&again.stdout);
    assert_eq!(again["fingerprint"], report["fingerprint"]);
    let errors = &again["calibration"]["position_error_mm"];
    assert_eq!(errors["before"], errors["after"]);

    let reverted = run(&folder, &port, "revert").ok();
    assert!(
        reverted.stdout.contains("in use: nominal"),
        "{}",
        reverted.stdout
    );
    let parameters = json(&run(&folder, &port, "parameters --json -").ok().stdout);
    assert_eq!(
        parameters["fingerprint"],
        parameters["device"]["nominal_fingerprint"]
    );
    let unchanged = run(&folder, &port, "revert --nominal").ok();
    assert!(
        unchanged.stdout.contains("as before"),
        "{}",
        unchanged.stdout
    );
}

#[test]
fn works_without_files_and_with_the_controllers_own_robot_file() {
    let folder = folder();
    let port = controller();
    let example = run(&folder, &port, "calibrate").ok();
    assert!(
        example.stdout.starts_with("The built-in example"),
        "{}",
        example.stdout
    );
    run(&folder, &port, "parameters --nominal --output nominal.toml").ok();
    run(&folder, &port, "calibrate nominal.toml samples.csv").ok();
    let printed = run(&folder, &port, "parameters --nominal").ok().stdout;
    assert_eq!(printed, folder.read("nominal.toml"));
}

#[test]
fn verifies_calibrations_and_refusals() {
    let folder = folder();
    let port = controller();
    folder.write("few.csv", csv(&exact(&true_arms(), 5)));
    folder.write("bare.toml", NOMINAL);
    let good = run(&folder, &port, "verify robot.toml samples.csv").ok();
    assert!(
        good.stdout.contains("264 of 264 figures are equal"),
        "{}",
        good.stdout
    );
    let refused = run(&folder, &port, "verify bare.toml few.csv").ok();
    assert!(
        refused.stdout.contains("both refused"),
        "{}",
        refused.stdout
    );
    let report = json(&run(&folder, &port, "verify --json -").ok().stdout);
    assert_eq!(report["differences"], serde_json::json!([]));
    assert_eq!(report["calibrated"], true);
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "nominal");
}

/// One error and one help, with a diagnosis between them where one is expected; nothing written, nothing applied.
fn assert_fails(folder: &Folder, port: &str, arguments: &str, code: i32, expected: &[&str]) {
    let names = folder.names();
    let failed = run(folder, port, arguments);
    assert_eq!(failed.code, code, "{arguments}: {}", failed.stderr);
    for part in expected {
        assert!(failed.stderr.contains(part), "{part:?}: {}", failed.stderr);
    }
    let diagnosis = expected.iter().any(|part| part.contains("diagnosis: "));
    let lines = 2 + usize::from(diagnosis);
    assert_eq!(failed.stderr.lines().count(), lines, "{}", failed.stderr);
    assert_eq!(failed.stdout, "");
    assert_eq!(folder.names(), names);
}

#[test]
fn refusals_change_nothing_and_say_why() {
    let folder = folder();
    let port = controller();
    folder.write("few.csv", csv(&exact(&true_arms(), 5)));
    folder.write("bare.toml", NOMINAL);
    let swapped = csv(&exact(&true_arms(), 40)).replace("x_mm,y_mm", "y_mm,x_mm");
    folder.write("swapped.csv", swapped);
    // What was exchanged stands in the file, however it is refused.
    let exchanged = "diagnosis: it looks as if the robot's x, y, z are y, x, z of the positions";
    for (files, expected) in [
        (
            "bare.toml few.csv",
            &["few.csv:6: the file ends after 5 samples", "help: "][..],
        ),
        (
            "robot.toml swapped.csv",
            &["refused: swapped.csv: ", exchanged, "help: "],
        ),
        // Refused by this computer's judgement.
        (
            "bare.toml swapped.csv",
            &[
                "is not credible without a stated [tolerance]",
                exchanged,
                "help: ",
            ],
        ),
    ] {
        let command = format!("calibrate {files} --apply --output out.toml --json report.json");
        assert_fails(&folder, &port, &command, 1, expected);
    }
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "nominal");
    assert_eq!(status["control_loop"]["switches"], 0);
}

#[test]
fn another_robots_file_is_refused_before_anything_is_sent() {
    let folder = folder();
    let port = controller();
    folder.write(
        "robot.toml",
        robot().replace("upper_arm_mm = 260", "upper_arm_mm = 260.01"),
    );
    for command in ["calibrate", "verify"] {
        assert_fails(
            &folder,
            &port,
            &format!("{command} robot.toml samples.csv"),
            3,
            &[
                "robot.toml: is not the robot that the controller was built for",
                "La_x of arm 1 is 260.010 mm in the file and 260.000 mm in the controller",
                "parameters --nominal --output",
            ],
        );
    }
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["phase"], "no calibration since the start");
}

#[test]
fn wrong_ports_are_explained() {
    let folder = folder();
    for (port, code, expected) in [
        (
            "/dev/ttyNONE",
            5,
            ["/dev/ttyNONE: cannot be opened", "emulate:m4"],
        ),
        (
            "tcp:127.0.0.1:1",
            5,
            ["tcp:127.0.0.1:1: cannot be opened", "serial server"],
        ),
        (
            "emulate:m4",
            5,
            ["not in delta-cal's workspace", "--firmware ELF"],
        ),
        (
            "emulate:m7 --firmware robot.toml",
            5,
            ["robot.toml: is not a program for a Cortex-M", "--firmware"],
        ),
        (
            "emulate:m4 --firmware none.elf",
            5,
            ["none.elf: cannot be read", "--firmware"],
        ),
        (
            "emulate:m4 --baud 9600",
            2,
            ["--baud has no meaning", "serial port"],
        ),
        (
            "/dev/ttyNONE --flash x",
            2,
            ["--flash has no meaning", "emulate:"],
        ),
    ] {
        assert_fails(&folder, port, "status", code, &expected);
    }
    let missing = folder.run("device status");
    assert_eq!(missing.code, 2);
    assert!(
        missing.stderr.contains("--port is missing"),
        "{}",
        missing.stderr
    );
    for port in ["emulate:m5", "tcp:host", "tcp:host:99999"] {
        let wrong = run(&folder, port, "status");
        assert_eq!(wrong.code, 2, "{}", wrong.stderr);
        assert!(wrong.stderr.contains("invalid value"), "{}", wrong.stderr);
    }
}

#[test]
fn wrong_files_are_found_before_the_port_is_opened() {
    let folder = folder();
    folder.write("bad.csv", format!("{HEADER}1,2,3,4,5\n"));
    let nobody = "tcp:127.0.0.1:1";
    for (arguments, code, expected) in [
        (
            "calibrate none.toml samples.csv",
            3,
            "none.toml: cannot be read",
        ),
        ("calibrate robot.toml bad.csv", 3, "bad.csv:2: column z_mm"),
        (
            "calibrate robot.toml samples.csv --output robot.toml",
            2,
            "is the same file as",
        ),
        (
            "calibrate robot.toml samples.csv --json samples.csv",
            2,
            "is the same file as",
        ),
        (
            "calibrate robot.toml samples.csv --apply --output no/out.toml",
            4,
            "no/out.toml: cannot",
        ),
        (
            "verify robot.toml samples.csv --json robot.toml",
            2,
            "is the same file as",
        ),
        (
            "parameters robot.toml --output robot.toml",
            2,
            "is the same file as",
        ),
    ] {
        assert_fails(&folder, nobody, arguments, code, &[expected]);
    }
}

#[test]
fn a_peer_that_is_no_controller_is_reported() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        // One that sends back what it gets, and one that closes.
        let (mut echo, _) = listener.accept().unwrap();
        let mut buffer = [0; 64];
        while let Ok(count @ 1..) = echo.read(&mut buffer) {
            echo.write_all(&buffer[..count]).unwrap();
        }
        drop(listener.accept());
    });
    assert_fails(
        &folder,
        &port,
        "status",
        5,
        &["no answer, asked 8 times", "--baud"],
    );
    assert_fails(&folder, &port, "status", 5, &["the link", "cable"]);
}
