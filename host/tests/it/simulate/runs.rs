//! What a campaign computes and writes.

use crate::simulate::{CAMPAIGN, assert_same, table, with_campaign};
use crate::support::{Folder, NOMINAL};
use serde_json::Value;
use std::collections::BTreeMap;

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
    assert!(run.stderr.contains("robot.toml:5: "), "{}", run.stderr);
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

/// Towers that are off together, and travels with noise.
#[test]
fn towers_have_a_radius_in_common_and_travels_a_noise() {
    let robot = "[nominal]\nkind = \"linear\"\ntower_radius_mm = 140\nforearm_mm = 330\n\n\
                 [joints]\nmin_mm = 100\nmax_mm = 600\n";
    let campaign = "robot = \"robot.toml\"\nrobots = 100\nspread = \"normal\"\nposes = [3, 20]\n\
                    start_errors = [{ length_mm = 0.5, angle_deg = 0.1, radius_mm = 3 }]\n\
                    noise_levels = [{ position_mm = 0.02, joint_mm = 0.02 }]\nmethods = [\"joint\"]\n";
    let folder = with_campaign(campaign);
    folder.write("robot.toml", robot);
    folder.run("simulate campaign.toml --output out").ok();
    let rows = table(&folder.read("out/robots.csv"));
    assert_eq!(rows.len(), 200);
    for poses in ["3", "20"] {
        let ratios = rows.iter().filter(|row| row["poses"] == poses).map(|row| {
            assert_eq!(row["noise_joint_mm"], "0.02");
            assert_eq!(row["start_error_radius_mm"], "3.0");
            row["bound_ratio"].parse::<f64>().unwrap()
        });
        let mean_square = ratios.map(|ratio| ratio * ratio).sum::<f64>() / 100.0;
        assert!((mean_square.sqrt() - 1.0).abs() < 0.15, "{mean_square}");
    }
    let again = folder.read("out/plan.toml");
    assert!(again.contains("radius_mm = 3.0") && again.contains("joint_mm = 0.02"));

    for (wrong, cause) in [
        (
            campaign.replace("joint_mm", "joint_deg"),
            "which are travels, is joint_mm",
        ),
        (
            campaign.replace("robot = \"robot.toml\"\n", ""),
            "no towers",
        ),
    ] {
        folder.write("wrong.toml", wrong);
        let run = folder.run("simulate wrong.toml --output wrong");
        assert!(run.code != 0);
        let words: Vec<_> = run.stderr.split_whitespace().collect();
        assert!(words.join(" ").contains(cause), "{}", run.stderr);
    }
}
