//! `delta-cal simulate` and `delta-cal simulate merge`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use support::{Folder, NOMINAL};

/// Two scenarios, eight ways of calibrating, refused robots among them.
const CAMPAIGN: &str = "\
robots = 37
seed = 5
poses = [8, 20]
start_errors = [{ length_mm = 1, angle_deg = 1 }]
noise_levels = [{ position_mm = 0.02, joint_deg = 0.01 }]
methods = [\"ikm\", \"fkm\"]
solvers = [\"lm\", \"gn\"]
prior = [true, false]
";

/// What must be the same to the byte.
const FILES: [&str; 4] = ["robots.csv", "summary.csv", "plan.toml", "plan-robot.toml"];

fn with_campaign(text: &str) -> Folder {
    let folder = Folder::new();
    folder.write("campaign.toml", text);
    folder
}

fn assert_same(folder: &Folder, a: &str, b: &str) {
    for name in FILES {
        let [a, b] = [a, b].map(|part| folder.read(&format!("{part}/{name}")));
        assert!(a == b, "{name} differs");
        assert!(!a.is_empty());
    }
}

/// The rows of a CSV file by column.
fn table(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
    let names: Vec<_> = lines.next().unwrap().collect();
    lines
        .map(|cells| {
            let cells: Vec<_> = cells.collect();
            assert_eq!(cells.len(), names.len());
            names.iter().cloned().zip(cells).collect()
        })
        .collect()
}

#[test]
fn the_built_in_campaign_runs_without_files_and_leaves_none() {
    let folder = Folder::new();
    let run = folder.run("simulate").ok();
    for part in ["built-in", "robots/s", "gain", "bound"] {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
    assert!(run.stdout.lines().all(|line| line.chars().count() <= 100));
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    assert!(folder.names().is_empty());
}

#[test]
fn the_printed_example_is_the_built_in_campaign() {
    let folder = Folder::new();
    let example = folder.run("simulate --example").ok().stdout;
    folder.write("campaign.toml", &example);
    folder.run("simulate campaign.toml --output a").ok();
    folder.run("simulate --output b").ok();
    assert_same(&folder, "a", "b");
}

#[test]
fn one_thread_and_several_give_the_same_bytes() {
    let folder = with_campaign(CAMPAIGN);
    folder
        .run("simulate campaign.toml --output one --threads 1")
        .ok();
    folder
        .run("simulate campaign.toml --output two --threads 2")
        .ok();
    folder
        .run("simulate campaign.toml --output many --threads 7")
        .ok();
    assert_same(&folder, "one", "two");
    assert_same(&folder, "one", "many");
    let rows = table(&folder.read("one/robots.csv"));
    assert_eq!(rows.len(), 37 * 2 * 8);
}

#[test]
fn another_seed_gives_other_robots_and_a_longer_list_the_same() {
    let folder = with_campaign(CAMPAIGN);
    folder.write("seed.toml", CAMPAIGN.replace("seed = 5", "seed = 6"));
    folder.write("longer.toml", CAMPAIGN.replace("[8, 20]", "[9, 20, 8]"));
    for name in ["campaign", "seed", "longer"] {
        folder
            .run(&format!("simulate {name}.toml --output {name}"))
            .ok();
    }
    let gains = |name: &str, poses: &str| -> Vec<String> {
        table(&folder.read(&format!("{name}/robots.csv")))
            .into_iter()
            .filter(|row| row["poses"] == poses)
            .map(|row| row["gain_percent"].clone())
            .collect()
    };
    assert_eq!(gains("campaign", "20"), gains("longer", "20"));
    assert_eq!(gains("campaign", "8"), gains("longer", "8"));
    assert_ne!(gains("campaign", "20"), gains("seed", "20"));
}

#[test]
fn all_variants_of_a_scenario_see_the_same_robots_and_measurements() {
    let folder = with_campaign(CAMPAIGN);
    folder.run("simulate campaign.toml --output out").ok();
    let mut seen: BTreeMap<(String, String), (String, String)> = BTreeMap::new();
    for row in table(&folder.read("out/robots.csv")) {
        let robot = (row["poses"].clone(), row["robot"].clone());
        let of_robot = (row["seed"].clone(), row["error_before_mm"].clone());
        assert_eq!(
            seen.entry(robot).or_insert_with(|| of_robot.clone()),
            &of_robot
        );
    }
    assert_eq!(seen.len(), 2 * 37);
}

#[test]
fn shards_joined_in_any_order_are_the_whole_campaign_to_the_byte() {
    let folder = with_campaign(CAMPAIGN);
    folder.run("simulate campaign.toml --output whole").ok();
    for shard in 1..=3 {
        folder
            .run(&format!(
                "simulate campaign.toml --output s{shard} --shard {shard}/3"
            ))
            .ok();
    }
    let merged = folder.run("simulate merge s2 s3 s1 --output merged").ok();
    assert!(
        merged.stdout.contains("37 robots a case"),
        "{}",
        merged.stdout
    );
    assert_same(&folder, "whole", "merged");

    // Every row of the whole campaign is in exactly one shard.
    let mut rows: Vec<String> = Vec::new();
    for shard in 1..=3 {
        let text = folder.read(&format!("s{shard}/robots.csv"));
        rows.extend(text.lines().skip(1).map(str::to_owned));
    }
    let whole = folder.read("whole/robots.csv");
    let mut expected: Vec<_> = whole.lines().skip(1).map(str::to_owned).collect();
    rows.sort();
    expected.sort();
    assert_eq!(rows, expected);
}

#[test]
fn more_shards_than_robots_leave_some_empty_and_join_all_the_same() {
    let folder = with_campaign(&CAMPAIGN.replace("robots = 37", "robots = 2"));
    folder.run("simulate campaign.toml --output whole").ok();
    for shard in 1..=3 {
        folder
            .run(&format!(
                "simulate campaign.toml --output s{shard} --shard {shard}/3"
            ))
            .ok();
    }
    folder.run("simulate merge s1 s2 s3 --output merged").ok();
    assert_same(&folder, "whole", "merged");
}

#[test]
fn only_all_finished_shards_of_one_campaign_are_joined() {
    let folder = with_campaign(CAMPAIGN);
    folder.write("other.toml", CAMPAIGN.replace("seed = 5", "seed = 6"));
    for (file, shard) in [("campaign", 1), ("campaign", 2), ("other", 2)] {
        folder
            .run(&format!(
                "simulate {file}.toml --output {file}{shard} --shard {shard}/2"
            ))
            .ok();
    }
    folder.run("simulate campaign.toml --output whole").ok();
    std::fs::create_dir(folder.path("empty")).unwrap();
    let refused = |folders: &str, part: &str| {
        let run = folder.run(&format!("simulate merge {folders} --output merged"));
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
        assert!(!folder.path("merged").exists());
    };
    refused("campaign1", "shard 2/2 is missing");
    refused("campaign1 campaign1", "named twice");
    refused("campaign1 other2", "another campaign");
    refused("campaign1 whole", "another number of shards");
    refused("campaign1 empty", "not the folder of a finished shard");
    refused("campaign1 nowhere", "not the folder of a finished shard");

    let damaged = folder
        .read("campaign2/robots.csv")
        .replacen("accepted", "acceptet", 1);
    folder.write("campaign2/robots.csv", damaged);
    refused("campaign1 campaign2", "checksum");
}

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
    let long = CAMPAIGN.replace("robots = 37", "robots = 1500");
    let folder = with_campaign(&long);
    folder.run("simulate campaign.toml --output whole").ok();
    let (mut last, mut kept) = (0, 0);
    for round in 0..60 {
        let wait = Duration::from_millis(300 + 137 * (round % 10));
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
fn a_robot_file_gives_the_nominal_robot() {
    let folder = with_campaign(&format!("robot = \"sub/robot.toml\"\n{CAMPAIGN}"));
    std::fs::create_dir(folder.path("sub")).unwrap();
    folder.write("sub/robot.toml", NOMINAL);
    folder.write("paper.toml", CAMPAIGN);
    folder.run("simulate campaign.toml --output out").ok();
    folder.run("simulate paper.toml --output paper").ok();
    // The built-in robot is the same one.
    assert_eq!(
        folder.read("out/robots.csv"),
        folder.read("paper/robots.csv")
    );
    folder.write("sub/robot.toml", NOMINAL.replace("480", "481"));
    let run = folder.run("simulate campaign.toml --output out");
    assert_eq!(run.code, 2);
    assert!(
        run.stderr
            .contains("plan-robot.toml there differs (`lb_mm = 480.0`)"),
        "{}",
        run.stderr
    );
    folder.write("sub/robot.toml", NOMINAL.replace("480", "-480"));
    let run = folder.run("simulate campaign.toml --output other");
    assert_eq!(run.code, 3);
    assert!(
        run.stderr.contains("robot.toml:5: [nominal] forearm_mm"),
        "{}",
        run.stderr
    );
}

#[test]
fn the_summary_follows_from_the_rows() {
    let folder = with_campaign(CAMPAIGN);
    folder
        .run("simulate campaign.toml --output out --json out.json")
        .ok();
    let rows = table(&folder.read("out/robots.csv"));
    let summary = table(&folder.read("out/summary.csv"));
    let json: Value = serde_json::from_str(&folder.read("out.json")).unwrap();
    assert_eq!(summary.len(), 16);
    let mut refused = 0;
    for (line, json) in summary.iter().zip(json.as_array().unwrap()) {
        let of_case: Vec<_> = rows
            .iter()
            .filter(|row| row["case"] == line["case"])
            .collect();
        assert_eq!(of_case.len(), 37);
        let accepted: Vec<_> = of_case
            .iter()
            .filter(|row| row["status"] == "accepted")
            .collect();
        refused += 37 - accepted.len();
        assert_eq!(line["accepted"], accepted.len().to_string());
        for (column, median) in [
            ("gain_percent", "gain_median_percent"),
            ("error_before_mm", "error_before_median_mm"),
            ("error_after_mm", "error_after_median_mm"),
            ("parameter_error_mm", "parameter_error_median_mm"),
            ("bound_ratio", "bound_ratio_median"),
        ] {
            let mut values: Vec<f64> = accepted
                .iter()
                .map(|row| row[column].parse().unwrap())
                .collect();
            values.sort_by(f64::total_cmp);
            if values.is_empty() {
                assert_eq!(line[median], "");
                continue;
            }
            let expected = f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2]);
            let found: f64 = line[median].parse().unwrap();
            assert!(
                (found - expected).abs() <= 1e-12 * expected.abs(),
                "{median}"
            );
            assert!(
                (json[column]["median"].as_f64().unwrap() - found).abs() <= 1e-15 * found.abs()
            );
        }
        for row in of_case {
            for column in ["gain_percent", "error_after_mm", "iterations", "condition"] {
                assert_eq!(
                    row[column].is_empty(),
                    row["status"] != "accepted",
                    "{row:?}"
                );
            }
        }
    }
    assert!(refused > 0, "the campaign is meant to have refused robots");
}

#[test]
fn exact_measurements_have_no_bound_and_return_every_robot() {
    let folder = with_campaign(
        "robots = 20\nposes = [20]\nstart_errors = [{ length_mm = 10, angle_deg = 1 }]\n\
         noise_levels = [{ position_mm = 0, joint_deg = 0 }]\nprior = [false]\n\
         methods = [\"ikm\", \"fkm\", \"ikm-f32\"]\n",
    );
    folder.run("simulate campaign.toml --output out").ok();
    for row in table(&folder.read("out/robots.csv")) {
        assert_eq!(row["status"], "accepted");
        assert_eq!(row["bound_mm"], "");
        let error: f64 = row["parameter_error_mm"].parse().unwrap();
        // The README's largest errors of one parameter, 1e-6 mm and 0.61 um; this is the norm of 24.
        let largest = if row["method"] == "ikm-f32" {
            0.61e-3
        } else {
            1e-6
        };
        let bound = largest * 24f64.sqrt();
        assert!(error < bound, "{row:?}");
    }
}

/// The campaign with one thing in it replaced.
fn but(from: &str, to: &str) -> String {
    assert!(CAMPAIGN.contains(from), "{from}");
    CAMPAIGN.replace(from, to)
}

/// Each is refused at its place for its cause, and leaves nothing behind.
fn assert_refused(cases: &[(String, &str, &str)]) {
    for (text, place, cause) in cases {
        let folder = with_campaign(text);
        let run = folder.run("simulate campaign.toml --output out --json out.json");
        assert_eq!(run.code, 3, "{text}: {}", run.stderr);
        let begin = format!("error: campaign.toml:{place}");
        assert!(run.stderr.starts_with(&begin), "{begin}: {}", run.stderr);
        assert!(run.stderr.contains(cause), "{cause}: {}", run.stderr);
        let lines = run.stderr.lines().count();
        assert_eq!(lines, 2, "error and help: {}", run.stderr);
        assert_eq!(folder.names(), ["campaign.toml"]);
        assert_eq!(run.stdout, "");
    }
}

#[test]
fn numbers_that_are_not_possible_are_refused_with_place_and_cause() {
    let length = "length_mm = 1";
    let both = "length_mm = 1, angle_deg = 1";
    let position = "position_mm = 0.02";
    assert_refused(&[
        (
            but("robots = 37", "robots = 0"),
            "1: robots:",
            "0 is not a whole number from 1",
        ),
        (but("robots = 37", "robots = -3"), "1: robots:", "-3 is not"),
        (
            but("robots = 37", "robots = 3.5"),
            "1:",
            "expected a whole number",
        ),
        (but("seed = 5", "seed = -5"), "2: seed:", "-5 is not"),
        (but("[8, 20]", "[8, 0]"), "3: poses:", "0 is not"),
        (but(length, "length_mm = -1"), "4: length_mm:", "-1 is not"),
        (
            but(length, "length_mm = nan"),
            "4: length_mm:",
            "NaN is not",
        ),
        (
            but(both, "length_mm = 0, angle_deg = 0"),
            "4:",
            "nothing to calibrate",
        ),
        (but("angle_deg = 1", "angle_deg = 0"), "4:", "a prior needs"),
        (but(position, "position_mm = 0"), "5:", "position_mm is 0"),
        (
            but(position, "position_mm = inf"),
            "5: position_mm:",
            "inf is not",
        ),
        (but(position, "position_mm = 0,02"), "5:", ""),
    ]);
}

#[test]
fn keys_and_lists_that_are_wrong_are_refused_with_place_and_cause() {
    let last = "prior = [true, false]";
    assert_refused(&[
        (but("robots = 37\n", ""), "1:", "missing key `robots`"),
        (but("seed = 5", "sead = 5"), "2:", "unknown key `sead`"),
        (but("[8, 20]", "[]"), "3: poses:", "the list is empty"),
        (but("[8, 20]", "[8, 8]"), "3: poses:", "twice"),
        (but("[8, 20]", "20"), "3:", "list in brackets"),
        (
            but("angle_deg = 1", "angle = 1"),
            "4:",
            "unknown key `angle`",
        ),
        (but(", angle_deg = 1", ""), "4:", "missing key `angle_deg`"),
        (but("\"fkm\"", "\"fmk\""), "6:", "unknown variant `fmk`"),
        (
            but(last, "planned = [true]"),
            "8: planned:",
            "not available yet",
        ),
        (
            but(last, "robot = \"no.toml\""),
            "8: robot:",
            "cannot be read",
        ),
        (but(last, "prior = [true"), "8:", ""),
        (but(last, "prior = []"), "8: prior:", "the list is empty"),
        (String::new(), "1:", "missing key"),
    ]);
}

#[test]
fn wrong_command_lines_are_refused() {
    for (arguments, part) in [
        (
            "simulate campaign.toml --output out --shard 0/4",
            "counted from 1",
        ),
        (
            "simulate campaign.toml --output out --shard 5/4",
            "counted from 1",
        ),
        ("simulate campaign.toml --output out --shard 5", "K/N"),
        ("simulate campaign.toml --shard 1/4", "--output"),
        ("simulate campaign.toml --threads 0", "0 is not in 1"),
        ("simulate merge a b", "--output"),
        ("simulate campaign.toml --json campaign.toml", "same file"),
    ] {
        let folder = with_campaign(CAMPAIGN);
        let run = folder.run(arguments);
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
        assert_eq!(folder.names(), ["campaign.toml"]);
    }
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
