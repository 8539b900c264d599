//! Links that break, and Ctrl-C, when the controller has been asked for other parameters: it may use them
//! although the command failed. The command says so, and the next one finds out.

use crate::device::{Change, controller_with, folder, json, run};
use std::process::{Command, Stdio};
use std::sync::mpsc;

const APPLY: &str = "calibrate robot.toml samples.csv --apply --output out.toml";

/// The result is in use, unknown to the command that was cut off, and the next command does no harm.
fn find_out(folder: &crate::support::Folder, port: &str) {
    assert!(!folder.names().contains(&"out.toml".to_owned()));
    let status = run(folder, port, "status").ok().stdout;
    let solved = "solved, from 40 samples; the result is in use";
    assert!(status.contains(solved), "{status}");
    let applied = run(folder, port, &format!("{APPLY} --json -")).ok();
    let applied = json(&applied.stdout);
    let status = json(&run(folder, port, "status --json -").ok().stdout);
    assert_eq!(status["result_in_use"], true);
    assert_eq!(status["control_loop"]["switches"], 1, "applied twice");
    assert_eq!(
        status["control_loop"]["fingerprint"],
        applied["fingerprint"]
    );
    run(folder, port, "revert").ok();
    let status = run(folder, port, "status").ok().stdout;
    assert!(status.contains("the result is not in use"), "{status}");
}

#[test]
fn a_link_that_breaks_leaves_open_whether_the_result_is_in_use() {
    let folder = folder();
    let port = controller_with(vec![Change::HungUp]);
    let broken = run(&folder, &port, APPLY);
    assert_eq!(broken.code, 5, "{}", broken.stderr);
    for part in ["had been asked for other parameters", "help: ", "status"] {
        assert!(broken.stderr.contains(part), "{part}: {}", broken.stderr);
    }
    assert!(!broken.stderr.contains("nothing was lost"));
    find_out(&folder, &port);
}

#[test]
fn a_link_that_breaks_during_a_revert_is_no_reason_to_revert_twice() {
    let folder = folder();
    let port = controller_with(vec![Change::Answered, Change::HungUp]);
    run(&folder, &port, APPLY).ok();
    let broken = run(&folder, &port, "revert");
    assert_eq!(broken.code, 5, "{}", broken.stderr);
    assert!(!broken.stderr.contains("nothing was lost"));
    // As a user does who does not know whether the first one came through.
    for _ in 0..2 {
        let reverted = run(&folder, &port, "revert").ok().stdout;
        assert!(reverted.contains("in use: nominal"), "{reverted}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_open_whether_the_result_is_in_use() {
    let folder = folder();
    let (sender, receiver) = mpsc::channel();
    let port = controller_with(vec![Change::Silent(sender)]);
    let child = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
        .args(["device", "--port", &port])
        .args(APPLY.split(' '))
        .current_dir(folder.path(""))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It waits for the answer to its request, which will never come.
    receiver.recv().unwrap();
    let interrupt = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(interrupt.unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");
    assert!(stderr.contains("help: delta-cal device"), "{stderr}");
    find_out(&folder, &port);
}
