//! Parts of a campaign, and joining them.

use crate::simulate::{CAMPAIGN, assert_same, with_campaign};

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
