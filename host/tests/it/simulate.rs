//! `delta-cal simulate` and `delta-cal simulate merge`.

mod instruments;
mod interruptions;
mod refusals;
mod runs;
mod shards;
use crate::support::Folder;
use std::collections::BTreeMap;

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
