//! Campaign files and command lines that are wrong.

use crate::simulate::{CAMPAIGN, with_campaign};

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
fn instruments_are_calibrated_by_the_joint_method_and_with_the_noise() {
    let plate = "poses = [8, 20]\nmeasure = [\"plate\"]";
    let joint = but("poses = [8, 20]", plate).replace("[\"ikm\", \"fkm\"]", "[\"joint\"]");
    assert_refused(&[
        (
            but("poses = [8, 20]", plate),
            "7: methods:",
            "only be calibrated by the method \"joint\"",
        ),
        (
            format!("{joint}weights = [true, false]\n"),
            "10: weights:",
            "without the noise",
        ),
        (
            joint.replace("plate", "plait"),
            "4: measure:",
            "there is no instrument \"plait\"",
        ),
    ]);
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
            but("[8, 20]", "[8, 7]\nplanned = [true]"),
            "3: poses:",
            "7 poses cannot be planned",
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
