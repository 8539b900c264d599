//! `delta-cal simulate`.

use crate::support::{Cells, Folder, NOMINAL, TOWERS, cells_of};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Two scenarios, eight calibration settings; some robots are refused.
const CAMPAIGN: &str = include_str!("../files/campaign.toml");

fn with_campaign(text: &str) -> Folder {
    let folder = Folder::new();
    folder.write("campaign.toml", text);
    folder
}

/// The rows that a command writes to standard output.
fn rows(folder: &Folder, command: &str) -> Vec<Cells> {
    let run = folder.run(&format!("simulate {command} --output -"));
    cells_of(&run.ok().stdout)
}

fn number(row: &Cells, column: &str) -> f64 {
    let cell = &row[column];
    cell.parse().unwrap_or_else(|_| panic!("{column}: {cell}"))
}

/// The rows of a campaign, and the summary made from the file with these rows.
fn run_and_summarize(folder: &Folder) -> (Vec<Cells>, Vec<Value>) {
    folder.run("simulate campaign.toml --output rows.csv").ok();
    let summary = folder
        .run("simulate --summary rows.csv --json -")
        .ok()
        .json();
    let summary = summary.as_array().unwrap().clone();
    (cells_of(&folder.read("rows.csv")), summary)
}

/// Whether a row belongs to a case of the summary.
fn is_of(row: &Cells, case: &Value) -> bool {
    ["poses", "method", "solver", "prior", "planned"]
        .iter()
        .all(|column| row[*column] == case[column].to_string().replace('"', ""))
}

#[test]
fn the_built_in_campaign_is_the_example_and_leaves_no_file() {
    let folder = Folder::new();
    let parts = "built-in | calibrations in | gain | bound | stated | worse";
    folder.run("simulate --robots 0..20").ends(0, parts);
    assert!(folder.names().is_empty());

    let example = folder.run("simulate --example").ok().stdout;
    folder.write("campaign.toml", &example);
    let built_in = rows(&folder, "--robots 0..5");
    assert_eq!(built_in, rows(&folder, "campaign.toml --robots 0..5"));
    assert_eq!(built_in.len(), 5 * 8);
}

/// Neither the split into ranges nor the number of threads matters.
#[test]
fn ranges_and_threads_change_no_byte_of_the_rows_and_of_the_summary() {
    let folder = with_campaign(CAMPAIGN);
    let run = |options: &str, threads: &str| {
        let command = format!("simulate campaign.toml {options}");
        folder
            .run_where(&command, "", &[("RAYON_NUM_THREADS", threads)])
            .ok();
    };
    run("--output whole.csv --json whole.json", "1");
    run("--output same.csv", "3");
    assert_eq!(folder.read("whole.csv"), folder.read("same.csv"));
    run("--robots 0..10 --output first.csv", "2");
    run("--robots 10..37 --output rest.csv", "2");
    let sorted = |names: &[&str]| {
        let texts: Vec<_> = names.iter().map(|name| folder.read(name)).collect();
        let lines = texts.iter().flat_map(|text| text.lines().skip(1));
        let lines: BTreeSet<_> = lines.map(str::to_owned).collect();
        lines
    };
    let whole = sorted(&["whole.csv"]);
    assert_eq!(whole.len(), 37 * 2 * 8);
    assert_eq!(whole, sorted(&["first.csv", "rest.csv"]));

    let summary = |files: &str| {
        let command = format!("simulate --summary {files} --json -");
        folder.run(&command).ok().json()
    };
    assert_eq!(summary("whole.csv"), summary("first.csv rest.csv"));
    // The run printed the same, apart from times, which rows do not contain.
    let mut run = folder.json("whole.json");
    for case in run.as_array_mut().unwrap() {
        assert!(case["seconds_per_calibration"].take().as_f64().unwrap() > 0.0);
    }
    assert_eq!(run, summary("whole.csv"));
}

#[test]
fn robots_depend_on_the_seed_and_the_geometry_and_not_on_the_other_cases() {
    let folder = with_campaign(CAMPAIGN);
    folder.write("robot.toml", NOMINAL.replace("480", "481"));
    folder.write("paper.toml", NOMINAL);
    let rows = |text: String| {
        folder.write("own.toml", text);
        self::rows(&folder, "own.toml --robots 0..9")
    };
    let gains = |rows: &[Cells], poses: &str| -> Vec<String> {
        let rows = rows.iter().filter(|row| row["poses"] == poses);
        rows.map(|row| row["gain_percent"].clone()).collect()
    };
    let own = rows(CAMPAIGN.to_owned());
    let longer = rows(CAMPAIGN.replace("[8, 20]", "[9, 20, 8]"));
    for poses in ["8", "20"] {
        assert_eq!(gains(&own, poses), gains(&longer, poses));
    }
    // The built-in robot, from a file.
    assert_eq!(own, rows(format!("robot = \"paper.toml\"\n{CAMPAIGN}")));
    let seeds = |rows: &[Cells]| -> BTreeSet<String> {
        rows.iter().map(|row| row["seed"].clone()).collect()
    };
    for other in [
        CAMPAIGN.replace("seed = 5", "seed = 6"),
        format!("robot = \"robot.toml\"\n{CAMPAIGN}"),
    ] {
        assert!(seeds(&own).is_disjoint(&seeds(&rows(other))));
    }

    // All calibration settings see the same robots and measurements.
    let mut seen: BTreeMap<(&str, &str), [&str; 2]> = BTreeMap::new();
    for row in &own {
        let robot = (row["poses"].as_str(), row["robot"].as_str());
        let found = [row["seed"].as_str(), row["error_before_mm"].as_str()];
        assert_eq!(*seen.entry(robot).or_insert(found), found);
    }
    assert_eq!(seen.len(), 2 * 9);
}

/// Recomputed from rows and definitions over all robots; a refused robot keeps its error.
#[test]
fn the_summary_follows_from_the_rows() {
    let folder = with_campaign(CAMPAIGN);
    let (rows, summary) = run_and_summarize(&folder);
    assert_eq!(summary.len(), 16);
    let (mut refused, mut worse) = (0, 0);
    for case in &summary {
        let own: Vec<_> = rows.iter().filter(|row| is_of(row, case)).collect();
        assert_eq!(own.len(), 37);
        let is_accepted = |row: &Cells| row["status"] == "accepted";
        let accepted: Vec<_> = own.iter().filter(|row| is_accepted(row)).collect();
        let is_worse = |row: &Cells| number(row, "error_after_mm") > number(row, "error_before_mm");
        let grown = accepted.iter().filter(|row| is_worse(row)).count();
        refused += 37 - accepted.len();
        worse += grown;
        assert_eq!(
            (&case["accepted"], &case["worse"]),
            (&accepted.len().into(), &grown.into())
        );
        for (before, after) in [("", "gain_percent"), ("error_before_mm", "error_after_mm")] {
            let of_robot = |row: &&Cells| match before {
                _ if is_accepted(row) => number(row, after),
                "" => 0.0,
                _ => number(row, before),
            };
            let mut values: Vec<f64> = own.iter().map(of_robot).collect();
            values.sort_by(f64::total_cmp);
            let mean = values.iter().sum::<f64>() / 37.0;
            for (part, expected) in [("mean", mean), ("median", values[18])] {
                let found = case[after][part].as_f64().unwrap();
                // Rounding of a sum of 37 terms.
                let off = (found - expected).abs();
                assert!(off <= 1e-12 * expected.abs(), "{after} {part}");
            }
        }
        let squares = |column: &str| -> f64 {
            let known = accepted
                .iter()
                .filter(|row| !row["parameter_bound_mm"].is_empty());
            known.map(|row| number(row, column).powi(2)).sum()
        };
        if let Some(ratio) = case["ratios"]["error_to_bound"].as_f64() {
            let expected = squares("parameter_after_mm") / squares("parameter_bound_mm");
            assert!((ratio.powi(2) / expected - 1.0).abs() < 1e-12);
        }
    }
    assert!(
        refused > 0 && worse > 0,
        "meant to have both: {refused} {worse}"
    );
    let shown = folder.run("simulate --summary rows.csv").ok().stdout;
    assert!(shown.contains("Refused in row"), "{shown}");
}

/// Campaigns of normally distributed robots, for which the prior is correct, and how far a ratio of their errors may be
/// off 1: with 200 robots and some six directions in which they err, σ is 0.02. Joint zeros are off by ten degrees;
/// towers have an error of their radius in common, and noisy travels.
const SOUND: [(&str, f64); 3] = [
    (
        "robots = 200\nposes = [20]\nstart_errors = [{ length_mm = 0.5, angle_deg = 0.2 }]\n\
         noise_levels = [{ position_mm = 0.02, joint_deg = 0.005 }]\nmethods = [\"ikm\", \"joint\", \"fkm\"]\n",
        0.1,
    ),
    (
        "robots = 40\nposes = [20]\nstart_errors = [{ length_mm = 0.5, angle_deg = 0.2, zero_deg = 10 }]\n\
         noise_levels = [{ position_mm = 0.02, joint_deg = 0.002 }]\nmethods = [\"ikm\", \"joint\"]\n",
        0.2,
    ),
    (
        "robots = 100\nposes = [3, 20]\nrobot = \"towers.toml\"\n\
         start_errors = [{ length_mm = 0.5, angle_deg = 0.1, radius_mm = 3 }]\n\
         noise_levels = [{ position_mm = 0.02, joint_mm = 0.02 }]\nmethods = [\"joint\"]\n",
        0.15,
    ),
];

#[test]
fn errors_are_those_of_the_bound_and_of_the_stated_sigma() {
    for (campaign, off) in SOUND {
        let folder = with_campaign(&format!("spread = \"normal\"\n{campaign}"));
        folder.write("towers.toml", TOWERS);
        let (rows, summary) = run_and_summarize(&folder);
        for row in rows {
            assert_eq!(row["status"], "accepted", "{row:?}");
            // Without calibration, wrong joint zeros move the platform by centimetres.
            let zeros = number(&row, "start_error_zero_deg") > 0.0;
            let [before, after] =
                ["error_before_mm", "error_after_mm"].map(|own| number(&row, own));
            assert!(!zeros || before > 3.0 && after < 0.3, "{row:?}");
        }
        for case in summary {
            let mut ratios = vec!["error_to_bound", "parameters_to_stated"];
            if case["method"] == "ikm" {
                assert_eq!(case["ratios"]["error_to_stated"], Value::Null);
            } else {
                ratios.extend(["error_to_stated", "relative_to_stated"]);
            }
            for ratio in ratios {
                let found = case["ratios"][ratio].as_f64().unwrap();
                assert!((found - 1.0).abs() < off, "{case} {ratio}: {found}");
            }
        }
    }
}

#[test]
fn exact_measurements_have_no_bound_and_return_every_robot() {
    let folder = with_campaign(
        "robots = 20\nposes = [20]\nstart_errors = [{ length_mm = 10, angle_deg = 1 }]\n\
         noise_levels = [{ position_mm = 0, joint_deg = 0 }]\nprior = [false]\n\
         methods = [\"ikm\", \"fkm\", \"joint\"]\nsolvers = [\"lm\", \"gn\"]\n",
    );
    for row in rows(&folder, "campaign.toml") {
        assert_eq!(row["status"], "accepted", "{row:?}");
        assert_eq!(
            (row["parameter_bound_mm"].as_str(), row["returned"].as_str()),
            ("", "true")
        );
        // The README's limit on the largest parameter error is 1e-6 mm; this is the norm of 24 errors.
        let error = number(&row, "parameter_after_mm");
        assert!(error < 1e-6 * 24f64.sqrt(), "{row:?}");
    }
}

const RESULTS: &str = "case,method,solver,poses,start_error_mm,start_error_deg,noise_position_mm,\
    noise_joint_deg,weights,prior,planned,robots,gain_median_percent,gain_p05_percent,gain_p95_percent,\
    error_before_mm,error_after_mm,bound_ratio,converged_percent,returned_percent,\
    returned_from_nominal_percent,seconds_per_calibration,paper_gain_percent,paper_seconds,paper_remark";

#[test]
fn the_papers_rows_stand_beside_what_is_found_here() {
    let folder = Folder::new();
    folder
        .run("simulate --paper --robots 0..1 --output results.csv")
        .ok();
    let text = folder.read("results.csv");
    assert_eq!(text.lines().next(), Some(RESULTS));
    let results = cells_of(&text);
    let has = |column: &str, value: &str| results.iter().any(|row| row[column] == value);
    assert!(has("solver", "gn") && has("solver", "lm") && has("case", "number-of-poses"));
    let same = |one: &str, other: &str| {
        one == other || one.parse::<f64>().is_ok_and(|one| other.parse() == Ok(one))
    };
    for figure in cells_of(include_str!("../../examples/paper/figures.csv")) {
        let stated = ["case", "method", "poses", "start_error_mm"];
        let stated = stated.map(|column| (column, &figure[column]));
        let is_of = |row: &&Cells| {
            let mut stated = stated.iter().filter(|(_, cell)| !cell.is_empty());
            stated.all(|(column, cell)| same(cell, &row[*column]))
        };
        let own: Vec<_> = results.iter().filter(is_of).collect();
        assert!(!own.is_empty(), "{figure:?}");
        for (row, column) in own
            .iter()
            .flat_map(|row| ["gain_percent", "seconds", "remark"].map(|column| (row, column)))
        {
            assert!(
                same(&figure[column], &row[&format!("paper_{column}")]),
                "{row:?}"
            );
        }
    }
}
