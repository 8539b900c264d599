//! The help of every command.

use std::process::Command;

fn help(command: &str, columns: usize) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
        .args(command.split_whitespace())
        .arg("--help")
        .env("COLUMNS", columns.to_string())
        .output()
        .unwrap();
    String::from_utf8(run.stdout).unwrap()
}

/// The commands that a help lists, each with what it is below.
fn listed(above: &str) -> Vec<String> {
    let text = help(above, 100);
    let (_, list) = text.split_once("Commands:\n").unwrap_or_default();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
    names
        .filter(|name| *name != "help")
        .map(|name| format!("{above} {name}").trim_start().to_owned())
        .collect()
}

/// Examples and exit codes keep their lines in a narrow terminal; prose is wrapped where it ends.
#[test]
fn every_command_has_examples_and_a_short_help_that_fits_the_terminal() {
    let mut commands = listed("");
    for name in [
        "init",
        "calibrate",
        "validate",
        "forward",
        "inverse",
        "plan",
        "simulate",
        "device",
    ] {
        assert!(
            commands.iter().any(|own| own == name),
            "{name} is not listed"
        );
    }
    let below: Vec<_> = commands.iter().flat_map(|own| listed(own)).collect();
    let groups = ["device"];
    commands.extend(below);
    commands.push(String::new());
    for command in commands {
        let (narrow, wide) = (help(&command, 80), help(&command, 100));
        let words = narrow.split_whitespace().count();
        assert!(words <= 400, "{command}: {words} words");
        assert!(words > 20, "{command}: {narrow}");
        for (text, columns) in [(&narrow, 80), (&wide, 100)] {
            let too_long = text.lines().find(|line| line.chars().count() > columns);
            assert_eq!(too_long, None, "{command}");
        }
        let is_below = groups
            .iter()
            .any(|group| command.starts_with(&format!("{group} ")));
        let (_, below) = narrow.split_once("Examples:\n").unwrap_or_default();
        let example = format!("  delta-cal {command}");
        assert!(
            is_below || below.contains(example.trim_end()),
            "{command} has no example"
        );
        let examples = wide.lines().filter(|line| line.starts_with("  delta-cal "));
        for line in examples {
            assert!(narrow.contains(line), "{command}: {line}");
        }
    }
}
