//! `delta-cal reproduce`.

use crate::support::{Folder, Run};
use delta_cal_tests::size;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

type Row = BTreeMap<String, String>;

fn rows(text: &str) -> Vec<Row> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

/// The campaign that a reproduction computes first.
const FIRST: &str = "exact";

/// What most tests look at: planning the poses takes a minute or two however few the robots are.
struct Shared {
    folder: Folder,
    /// `results.csv` of the first run, and after a second one.
    results: [String; 2],
    /// The same folder for another number of robots; and `results.csv` after that.
    another: (Run, String),
}

/// A reproduction in place of another campaign, the same again, and another one. Nothing in it is changed
/// by a test.
fn shared() -> &'static Shared {
    static SHARED: OnceLock<Shared> = OnceLock::new();
    SHARED.get_or_init(|| {
        let folder = Folder::new();
        let campaign = std::fs::read_to_string(format!("examples/paper/{FIRST}.toml")).unwrap();
        folder.write(
            "campaign.toml",
            campaign
                .replace("robots = 200", "robots = 5")
                .replace("planned = [false, true]", "planned = [false]"),
        );
        let other = format!("simulate campaign.toml --output out/campaigns/{FIRST}");
        folder.run(&other).ok();
        let refused = folder.run("reproduce --output out --robots 9");
        assert_eq!(refused.code, 2, "{}", refused.stderr);
        folder.run("reproduce --output out --robots 9 --force").ok();
        let first = folder.read("out/results.csv");
        folder.run("reproduce --output out --robots 9").ok();
        let second = folder.read("out/results.csv");
        let another = folder.run("reproduce --output out --robots 6");
        let after = folder.read("out/results.csv");
        Shared {
            folder,
            results: [first, second],
            another: (another, after),
        }
    })
}

/// (case, method, start error, poses) and the paper's gain, as printed there.
const PAPER: [(&str, &str, &str, &str, f64); 14] = [
    ("exact", "fkm", "1.0", "8", 100.0),
    ("exact", "ikm", "1.0", "8", 100.0),
    ("exact", "ikm", "10.0", "8", 100.0),
    ("fkm-noise", "fkm", "0.1", "8", -38.54),
    ("fkm-noise", "fkm", "0.1", "20", 20.0),
    ("fkm-noise", "fkm", "0.1", "40", 38.0),
    ("fkm-noise", "fkm", "0.1", "60", 45.38),
    ("fkm-start-error", "fkm", "1.0", "60", -260.0),
    ("ikm-small-noise", "ikm", "10.0", "60", 99.9),
    ("ikm-start-error", "ikm", "1.0", "8", -6.17),
    ("ikm-start-error", "ikm", "1.0", "20", 62.54),
    ("ikm-start-error", "ikm", "1.0", "40", 87.58),
    ("ikm-start-error", "ikm", "1.0", "60", 86.5),
    ("ikm-noise", "ikm", "10.0", "60", 86.5),
];

#[test]
fn results_are_those_of_the_campaigns_beside_the_papers() {
    let folder = &shared().folder;
    let text = folder.read("out/results.csv");
    let wanted = [
        "case",
        "method",
        "solver",
        "poses",
        "start_error_mm",
        "noise_position_mm",
        "noise_joint_deg",
        "prior",
        "planned",
        "robots",
        "gain_median_percent",
        "gain_p05_percent",
        "gain_p95_percent",
        "error_before_mm",
        "error_after_mm",
        "bound_ratio",
        "converged_percent",
        "seconds_per_calibration",
        "paper_gain_percent",
        "paper_seconds",
    ];
    let header: Vec<_> = text.lines().next().unwrap().split(',').collect();
    let places: Vec<_> = wanted
        .iter()
        .map(|name| header.iter().position(|column| column == name))
        .collect();
    assert!(places.iter().all(Option::is_some), "{header:?}");
    assert!(places.is_sorted());

    let results = rows(&text);
    let names: BTreeSet<_> = results.iter().map(|row| row["case"].clone()).collect();
    let mut cases = 0;
    for name in &names {
        let summary = rows(&folder.read(&format!("out/campaigns/{name}/summary.csv")));
        let own: Vec<_> = results.iter().filter(|row| row["case"] == *name).collect();
        assert_eq!(own.len(), summary.len());
        cases += summary.len();
        for (row, summary) in own.iter().zip(&summary) {
            for (ours, theirs) in [
                ("poses", "poses"),
                ("gain_median_percent", "gain_median_percent"),
                ("gain_p05_percent", "gain_p05_percent"),
                ("error_after_mm", "error_after_median_mm"),
                ("bound_ratio", "bound_ratio_rms"),
                ("converged_percent", "converged_percent"),
            ] {
                assert_eq!(row[ours], summary[theirs], "{name} {ours}");
            }
        }
    }
    assert_eq!(cases, results.len());

    for (case, method, start, poses, gain) in PAPER {
        let of = results.iter().filter(|row| {
            row["case"] == case
                && row["method"] == method
                && row["start_error_mm"] == start
                && row["poses"] == poses
        });
        let stated: Vec<f64> = of
            .map(|row| row["paper_gain_percent"].parse().unwrap())
            .collect();
        assert!(!stated.is_empty(), "{case} {poses}");
        assert!(stated.iter().all(|stated| (stated - gain).abs() < 1e-12));
    }
    let diverges = results
        .iter()
        .filter(|row| row["paper_remark"] == "diverges");
    assert!(diverges.clone().count() > 0);
    for row in diverges {
        assert_eq!(
            (row["method"].as_str(), row["start_error_mm"].as_str()),
            ("fkm", "10.0")
        );
    }
}

#[test]
fn the_report_stands_alone_and_the_figures_are_pictures() {
    let folder = &shared().folder;
    let report = folder.read("out/report.html");
    for from_elsewhere in ["<script", "<link", "src=", "@import", "url("] {
        assert!(!report.contains(from_elsewhere), "{from_elsewhere}");
    }
    for words in [
        "Figs. 2a and 2b",
        "Figs. 3a and 3b",
        "Fig. 4",
        "The boundary of the workspace",
        "Misprints",
        "diverges",
        "−38.54",
    ] {
        let words = words.replace("−38.54", "−39");
        assert!(report.contains(&words), "{words}");
    }
    for name in [
        "fig2a",
        "fig2b",
        "fig3a",
        "fig3b",
        "fig4",
        "basins-20",
        "boundary",
        "boundary-influence",
    ] {
        let svg = folder.read(&format!("out/figures/{name}.svg"));
        let document = roxmltree::Document::parse(&svg).unwrap();
        assert_eq!(document.root_element().tag_name().name(), "svg");
        // A figure without data has axes and no more.
        let drawn = document
            .descendants()
            .filter(|node| ["circle", "polyline", "polygon"].contains(&node.tag_name().name()));
        assert!(drawn.count() > 20, "{name}");
    }
}

#[test]
fn every_campaign_can_be_run_again_by_itself() {
    let folder = &shared().folder;
    let plan = "out/campaigns/fkm-noise/plan.toml";
    let run = folder.run(&format!("simulate {plan} --output again"));
    assert_eq!(run.code, 0, "{}", run.stderr);
    for name in ["robots.csv", "summary.csv", "parameters.csv"] {
        let [a, b] =
            ["out/campaigns/fkm-noise", "again"].map(|part| folder.read(&format!("{part}/{name}")));
        assert!(a == b, "{name}");
    }
}

#[test]
fn each_parameters_gain_is_its_quantile_over_the_robots() {
    let folder = &shared().folder;
    let campaign = "out/campaigns/fkm-noise";
    let robots = rows(&folder.read(&format!("{campaign}/robots.csv")));
    let parameters = rows(&folder.read(&format!("{campaign}/parameters.csv")));
    assert_eq!(parameters.len() % 24, 0);
    for row in &parameters {
        let column = format!("gain_{}_{}_percent", row["arm"], row["parameter"]);
        let mut gains: Vec<f64> = robots
            .iter()
            .filter(|robot| robot["case"] == row["case"] && robot["status"] == "accepted")
            .map(|robot| robot[&column].parse().unwrap())
            .collect();
        gains.sort_by(f64::total_cmp);
        let (low, high) = (gains[(gains.len() - 1) / 2], gains[gains.len() / 2]);
        let median: f64 = row["gain_median_percent"].parse().unwrap();
        // Rounding of a mean of two.
        let middle = f64::midpoint(low, high);
        assert!((median - middle).abs() <= 1e-12 * middle.abs(), "{column}");
    }
}

#[test]
fn a_second_run_computes_nothing_anew_and_another_is_refused() {
    let shared = shared();
    let [before, second] = &shared.results;
    // The times, too: they are those of the first run.
    assert!(before == second);

    let (run, after) = &shared.another;
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("another campaign"), "{}", run.stderr);
    assert!(run.stderr.contains("--force"), "{}", run.stderr);
    assert!(before == after);

    // The campaign of five robots, which `--force` had to replace, is gone.
    assert!(rows(before).iter().all(|row| row["robots"] == "9"));
}

#[test]
fn a_file_in_the_way_is_refused() {
    let folder = Folder::new();
    folder.write("out", "mine");
    let run = folder.run("reproduce --output out --robots 5");
    assert_eq!(run.code, 4);
    assert_eq!(folder.read("out"), "mine");
}

/// The paper's noisy series with all its robots: the shorter one, and in long campaigns both.
#[test]
fn the_document_shows_what_the_command_prints() {
    let page = include_str!("../../../docs/reproduction.md");
    let folder = Folder::new();
    let series = ["fkm-noise", "ikm-start-error"];
    for name in &series[..size(1, 2)] {
        let method = &name[..3];
        let campaign = std::fs::read_to_string(format!("examples/paper/{name}.toml")).unwrap();
        folder.write("campaign.toml", campaign);
        let run = folder.run(&format!("simulate campaign.toml --output {name}"));
        assert_eq!(run.code, 0, "{}", run.stderr);
        let summary = rows(&folder.read(&format!("{name}/summary.csv")));
        for poses in ["8", "20", "40", "60"] {
            let gain = |known: &str, planned: &str| {
                let case = summary.iter().find(|row| {
                    row["method"] == method
                        && row["solver"] == "lm"
                        && row["poses"] == poses
                        && row["planned"] == planned
                        && row["weights"] == known
                        && row["prior"] == known
                });
                let gain: f64 = case.unwrap()["gain_median_percent"].parse().unwrap();
                if gain > 99.0 {
                    format!("{gain:.2}")
                } else {
                    format!("{gain:.0}").replace('-', "−")
                }
            };
            let cells = |line: &str| {
                line.split_whitespace()
                    .map(str::to_owned)
                    .collect::<Vec<_>>()
            };
            let shown = page
                .lines()
                .map(cells)
                .find(|cells| cells.len() > 7 && cells[0] == *name && cells[1] == poses)
                .unwrap();
            let ours = [
                gain("false", "false"),
                gain("true", "false"),
                gain("true", "true"),
            ];
            assert_eq!(shown[5..8], ours, "{name} {poses}");
        }
    }
}
