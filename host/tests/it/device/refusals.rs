//! Commands that refuse or fail, and change nothing.

use crate::device::{controller, folder, json, robot, run};
use crate::support::{Folder, HEADER, NOMINAL, csv, exact, true_arms};
use delta_cal_tests::observed::{OBSERVED_ROBOT, observed_rows};
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::TcpListener;

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
fn observations_that_a_controller_cannot_hold_are_refused() {
    let folder = Folder::new();
    let port = controller();
    folder.write("robot.toml", OBSERVED_ROBOT);
    folder.write("many.csv", observed_rows(3, 101));
    let right = observed_rows(3, 40);
    // Eight touches on each of five plates.
    let mut plates = String::from("q1_deg,q2_deg,q3_deg,height_mm,plane\n");
    for (row, line) in right.lines().skip(1).enumerate() {
        let joints: Vec<_> = line.split(',').take(3).collect();
        writeln!(plates, "{},{row},plate {}", joints.join(","), row % 5).unwrap();
    }
    folder.write("plates.csv", plates);
    folder.write("bare.toml", OBSERVED_ROBOT.split("[planes").next().unwrap());
    folder.write("right.csv", &right);
    for command in ["calibrate", "verify"] {
        for (files, code, expected) in [
            (
                "robot.toml many.csv",
                3,
                &[
                    "many.csv: 101 rows, and the controller has memory for 100",
                    "help: leave out rows of poses that are close to others, or use delta-cal calibrate",
                ][..],
            ),
            (
                "bare.toml plates.csv",
                3,
                &[
                    "plates.csv: the planes and points have more than the 12 unknowns",
                    "help: use fewer planes and points, or delta-cal calibrate",
                ],
            ),
            (
                "robot.toml right.csv --gate",
                3,
                &[
                    "--gate, --held-out and --forget can only be used with",
                    "help: ",
                ],
            ),
            (
                "robot.toml right.csv --method ikm",
                3,
                &["--method can only be used with", "help: "],
            ),
        ] {
            assert_fails(
                &folder,
                &port,
                &format!("{command} {files}"),
                code,
                expected,
            );
        }
    }
    // One touch on a table and nothing of the rest.
    folder.write(
        "few.csv",
        right.lines().take(6).collect::<Vec<_>>().join("\n"),
    );
    assert_fails(
        &folder,
        &port,
        "calibrate robot.toml few.csv --apply --output out.toml",
        1,
        &["few.csv", "help: "],
    );
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "nominal");
    assert_eq!(status["control_loop"]["switches"], 0);
    // After all that the controller calibrates, and what it applies is what it reports.
    let command = "calibrate robot.toml right.csv --apply --json -";
    let report = json(&run(&folder, &port, command).ok().stdout);
    let status = json(&run(&folder, &port, "status --json -").ok().stdout);
    assert_eq!(status["origin"], "calibrated");
    assert_eq!(status["control_loop"]["fingerprint"], report["fingerprint"]);
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
