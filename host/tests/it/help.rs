//! What a new user meets: the help of every command, the template of a robot file, completions.

use crate::support::{Folder, NOMINAL, TOLERANCE};
use delta_cal_host::{InputText, RobotFile};
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

const ROTARY_NOISE: &str = "[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";
const LINEAR: &str = "[nominal]\nkind = \"linear\"\ntower_radius_mm = 140\nforearm_mm = 330\n\
                      [joints]\nmin_mm = 100\nmax_mm = 600\n\
                      [tolerance]\nlength_mm = 0.5\nangle_deg = 0.17\nscale = 0.001\nzero_mm = 5\n\
                      [noise]\nposition_mm = 0.02\njoint_mm = 0.01\n";

fn read(text: &str) -> RobotFile {
    RobotFile::read(&InputText::new("robot.toml", text)).unwrap()
}

/// The template with the keys in its comments; `arms` has three arms in place of `[nominal]`.
fn whole(template: &str, arms: bool) -> String {
    let (head, rest) = template.split_once("[nominal]").unwrap();
    let (nominal, rest) = rest.split_once("# In place of").unwrap();
    let (arm, rest) = rest.split_once("\n\n").unwrap();
    let uncommented = |text: &str| text.replace("\n# ", "\n");
    if arms {
        let (_, arm) = arm.split_once('\n').unwrap();
        let arm = uncommented(&format!("\n{arm}\n"));
        head.to_owned() + &arm.repeat(3) + &uncommented(&format!("\n\n{rest}"))
    } else {
        format!(
            "{head}[nominal]{}{}",
            uncommented(nominal),
            uncommented(&format!("\n\n{rest}"))
        )
    }
}

#[test]
fn the_template_is_a_robot_file_with_every_key() {
    let rotary = format!("{NOMINAL}{TOLERANCE}{ROTARY_NOISE}");
    for (kind, same) in [("rotary", rotary.as_str()), ("linear", LINEAR)] {
        let folder = Folder::new();
        let run = folder.run(&format!("init --kind {kind}")).ok();
        assert!(run.stdout.contains("Written: robot.toml"), "{}", run.stdout);
        let text = folder.read("robot.toml");
        assert_eq!(read(&text), read(same));
        assert!(text.lines().all(|line| line.chars().count() <= 120));

        let full = read(&whole(&text, false));
        assert_eq!(full.instruments.planes.len(), 1);
        assert_eq!(full.instruments.points.len(), 1);
        assert!(full.instruments.target.is_some() && full.record.date.is_some());
        // Arms that are all alike have no common centre, but are read: nothing is unknown.
        let arms = RobotFile::read(&InputText::new("robot.toml", &whole(&text, true)));
        let text = arms.map_or_else(|error| error.to_string(), |_| String::new());
        assert!(
            text.is_empty() || text.contains("geometry is impossible"),
            "{text}"
        );

        // What the help names as the next step works.
        folder
            .run("plan robot.toml --count 12 --output poses.csv")
            .ok();
    }
}

#[test]
fn an_existing_file_is_not_replaced() {
    let folder = Folder::new();
    folder.write("robot.toml", "mine");
    let run = folder.run("init");
    assert_eq!(run.code, 4, "{}", run.stderr);
    assert_eq!(folder.read("robot.toml"), "mine");
    let printed = folder.run("init --output -").ok().stdout;
    assert!(printed.contains("[nominal]"), "{printed}");
    assert_eq!(folder.names(), ["robot.toml"]);
}

#[test]
fn shells_know_every_command() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = folder.run(&format!("completions {shell}")).ok().stdout;
        for word in ["calibrate", "device", "columns"] {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
}
