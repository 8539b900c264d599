//! Campaigns of plates, wires, bars, callipers and cameras.

use crate::simulate::{assert_same, table, with_campaign};
use std::collections::BTreeMap;

const CAMPAIGN: &str = "\
robots = 100
seed = 3
spread = \"normal\"
measure = [\"xyz\", \"plate\", \"blocks\", \"wire\", \"bar300\", \"distances\", \"camera\", \"tracker\"]
poses = [24]
start_errors = [{ length_mm = 0.5, angle_deg = 0.2 }]
noise_levels = [{ position_mm = 0.02, joint_deg = 0.002 }]
methods = [\"joint\"]
planned = [false, true]
";

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

#[test]
fn every_instrument_is_at_its_bound_and_better_where_it_is_planned() {
    let folder = with_campaign(CAMPAIGN);
    folder.run("simulate campaign.toml --output out").ok();
    let summary = table(&folder.read("out/summary.csv"));
    assert_eq!(summary.len(), 16);
    for pair in summary.chunks(2) {
        let [random, planned] = pair else { panic!() };
        let name = &random["measure"];
        assert_eq!(name, &planned["measure"]);
        for row in pair {
            // 100 robots, whose errors have some six directions that count: one σ of the ratio is 0.03.
            let ratio = number(row, "bound_ratio_rms");
            assert!((0.9..1.1).contains(&ratio), "{name}: {ratio}");
        }
        assert_eq!(planned["accepted"], "100", "{name}");
        let [random, planned] =
            [random, planned].map(|row| number(row, "relative_after_median_mm"));
        assert!(planned < random, "{name}: {planned} {random}");
    }
}

#[test]
fn a_longer_list_leaves_the_robots_of_the_others_as_they_were() {
    let shorter = CAMPAIGN
        .replace("robots = 100", "robots = 12")
        .replace("planned = [false, true]\n", "");
    let start = shorter.find("measure").unwrap();
    let end = start + shorter[start..].find('\n').unwrap();
    let shorter = shorter.replace(&shorter[start..end], "measure = [\"xyz\", \"wire\"]");
    let one = shorter.replace("[\"xyz\", \"wire\"]", "[\"wire\"]");
    let folder = with_campaign(&shorter);
    folder.write("one.toml", one);
    folder
        .run("simulate campaign.toml --output both --threads 1")
        .ok();
    folder
        .run("simulate campaign.toml --output again --threads 3")
        .ok();
    assert_same(&folder, "both", "again");
    folder.run("simulate one.toml --output one").ok();
    let errors = |folder_name: &str| -> Vec<String> {
        table(&folder.read(&format!("{folder_name}/robots.csv")))
            .into_iter()
            .filter(|row| row["measure"] == "wire")
            .map(|row| row["relative_after_mm"].clone())
            .collect()
    };
    assert_eq!(errors("both"), errors("one"));
    assert_eq!(errors("one").len(), 12);
}
