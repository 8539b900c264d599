//! Campaigns that are killed, interrupted, repeated, or in each other's way.

use crate::simulate::{CAMPAIGN, FILES, assert_same, with_campaign};
use crate::support::Folder;
use serde_json::Value;
use std::fs::OpenOptions;
use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn start(folder: &Folder, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_delta-cal"))
        .args(arguments.split_whitespace())
        .current_dir(folder.path(""))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn finished_robots(folder: &Folder) -> Option<(u64, bool)> {
    let record = std::fs::read_to_string(folder.path("out/run.json")).ok()?;
    let record: Value = serde_json::from_str(&record).expect("a record is whole or not there");
    Some((record["robots"].as_u64()?, record["complete"].as_bool()?))
}

/// Killed again and again at moments that have nothing to do with what it does; every run begins
/// where the last record says, and the result is that of one run.
#[test]
fn a_campaign_that_is_killed_again_and_again_ends_with_the_same_bytes() {
    let long = CAMPAIGN.replace("robots = 37", "robots = 1000");
    let folder = with_campaign(&long);
    folder.run("simulate campaign.toml --output whole").ok();
    let (mut last, mut kept) = (0, 0);
    for round in 0..60 {
        let wait = Duration::from_millis(900 + 137 * (round % 8));
        let mut child = start(&folder, "simulate campaign.toml --output out --threads 2");
        std::thread::sleep(wait);
        let _ = child.kill();
        child.wait().unwrap();
        if let Some((robots, complete)) = finished_robots(&folder) {
            assert!(
                robots >= last,
                "a later run lost what an earlier one had kept"
            );
            kept += u32::from(robots > last && !complete);
            last = robots;
            if complete {
                break;
            }
        }
        // A row that was half written when the power failed.
        if let Ok(mut partial) = OpenOptions::new()
            .append(true)
            .open(folder.path("out/robots.csv.partial"))
        {
            partial.write_all(b"1,ikm,lm,8,1.0,1.0,0.02,0.0").unwrap();
        }
    }
    let run = folder.run("simulate campaign.toml --output out").ok();
    assert_same(&folder, "whole", "out");
    println!("{kept} runs ended with something kept; {}", run.stdout);
}

/// Runs a campaign that would take hours, sends SIGINT as soon as something is recorded, and returns
/// the rows that are kept.
#[cfg(unix)]
fn interrupted_rows(folder: &Folder, output: &str, more_than: usize) -> String {
    let file = format!("{output}/robots.csv.partial");
    let mut child = start(folder, &format!("simulate campaign.toml --output {output}"));
    loop {
        std::thread::sleep(Duration::from_millis(20));
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        let length = std::fs::metadata(folder.path(&file)).map_or(0, |file| file.len());
        if length > more_than as u64 {
            break;
        }
    }
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let run = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("are kept in"), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");
    folder.read(&file)
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_whole_robots_and_the_same_command_goes_on() {
    let folder = with_campaign(&CAMPAIGN.replace("robots = 37", "robots = 10000000"));
    let first = interrupted_rows(&folder, "out", 1000);
    assert!(first.ends_with('\n'));
    assert_eq!((first.lines().count() - 1) % 8, 0, "eight rows a robot");
    let second = interrupted_rows(&folder, "out", first.len());
    assert!(second.len() > first.len() && second.starts_with(&first));
    let at_once = interrupted_rows(&folder, "another", second.len());
    assert!(at_once.starts_with(&second));
    for name in ["robots.csv", "summary.csv"] {
        assert!(!folder.path("out").join(name).exists(), "{name}");
    }
}

#[test]
fn a_finished_campaign_is_not_computed_again() {
    let folder = with_campaign(CAMPAIGN);
    folder.run("simulate campaign.toml --output out").ok();
    let before = folder.read("out/timing.csv");
    let run = folder.run("simulate campaign.toml --output out").ok();
    assert!(
        run.stdout.contains("Nothing was left to compute"),
        "{}",
        run.stdout
    );
    assert_eq!(folder.read("out/timing.csv"), before);
    // What was computed is itself a campaign file.
    folder.run("simulate out/plan.toml --output again").ok();
    assert_same(&folder, "out", "again");
    // A finished file that somebody has changed is no longer the campaign's.
    let changed = folder
        .read("out/robots.csv")
        .replacen("accepted", "acceptet", 1);
    folder.write("out/robots.csv", &changed);
    let run = folder.run("simulate campaign.toml --output out");
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("checksum"), "{}", run.stderr);
    assert_eq!(folder.read("out/robots.csv"), changed);
}

#[test]
fn another_campaigns_folder_is_refused_and_left_alone_unless_forced() {
    let folder = with_campaign(CAMPAIGN);
    folder.write("other.toml", CAMPAIGN.replace("[8, 20]", "[8]"));
    folder.run("simulate campaign.toml --output out").ok();
    let before: Vec<_> = FILES.map(|name| folder.read(&format!("out/{name}"))).into();
    for (arguments, part) in [
        (
            "simulate other.toml --output out",
            "another campaign: plan.toml there differs (`poses = [8, 20]`)",
        ),
        (
            "simulate campaign.toml --output out --shard 1/2",
            "shard 1/1 of this campaign",
        ),
    ] {
        let run = folder.run(arguments);
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains(part), "{}", run.stderr);
        assert!(run.stderr.contains("--force"), "{}", run.stderr);
    }
    let after: Vec<_> = FILES.map(|name| folder.read(&format!("out/{name}"))).into();
    assert_eq!(before, after);

    folder.run("simulate other.toml --output out --force").ok();
    folder.run("simulate other.toml --output fresh").ok();
    assert_same(&folder, "out", "fresh");

    // Files of somebody else.
    std::fs::create_dir(folder.path("mine")).unwrap();
    folder.write("mine/robots.csv", "precious");
    let run = folder.run("simulate campaign.toml --output mine");
    assert_eq!(run.code, 2);
    assert!(
        run.stderr
            .contains("robots.csv that is not of this campaign"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.read("mine/robots.csv"), "precious");
}

#[test]
fn the_campaign_file_is_never_replaced_by_its_own_output() {
    let folder = Folder::new();
    folder.write("plan.toml", CAMPAIGN);
    for arguments in [
        "simulate plan.toml --output .",
        "simulate plan.toml --output . --force",
    ] {
        let run = folder.run(arguments);
        assert_eq!(run.code, 2, "{}", run.stderr);
    }
    assert_eq!(folder.read("plan.toml"), CAMPAIGN);
}

#[test]
fn two_at_once_do_not_write_into_the_same_folder() {
    let folder = with_campaign(&CAMPAIGN.replace("robots = 37", "robots = 10000000"));
    let mut first = start(&folder, "simulate campaign.toml --output out");
    while !folder.path("out/robots.csv.partial").exists() {
        assert!(first.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(10));
    }
    let run = folder.run("simulate campaign.toml --output out");
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(run.code, 2, "{}", run.stderr);
    assert!(run.stderr.contains("another delta-cal"), "{}", run.stderr);
}
