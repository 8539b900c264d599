//! A new user's first contact: the help of every command, the robot file template, completions.

use crate::support::{Folder, KEYS, NOMINAL, TOLERANCE, TOWERS, csv, exact, true_arms};
use delta_cal_host::{InputText, RobotFile};
use std::fmt::Write as _;

fn help(command: &str, columns: usize) -> String {
    let variables = [("COLUMNS", columns.to_string())];
    let variables = variables
        .each_ref()
        .map(|(name, value)| (*name, value.as_str()));
    let run = Folder::new().run_where(&format!("{command} --help"), "", &variables);
    run.ok().stdout
}

/// The commands listed in the help of `above`, with their full names.
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

/// Examples and exit codes keep their lines in a narrow terminal; prose is wrapped at its width.
#[test]
fn every_command_has_examples_and_a_short_help_that_fits_the_terminal() {
    let mut commands = listed("");
    assert!(commands.contains(&"calibrate".to_owned()));
    commands.extend(listed("device"));
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
        let is_below = command.starts_with("device ");
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

/// With files of the names that the examples have; those for towers and for campaigns of thousands are left out.
#[test]
fn examples_of_the_help_work() {
    let folder = Folder::new();
    let noise = "[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}{noise}"));
    let all = exact(&true_arms(), 40);
    let (samples, check) = all.split_at(24);
    folder.write("samples.csv", csv(samples));
    folder.write("tracker.csv", csv(check));
    folder.write("check.csv", csv(check));
    let (mut angles, mut positions) = (
        "q1_deg,q2_deg,q3_deg\n".to_owned(),
        "x_mm,y_mm,z_mm\n".to_owned(),
    );
    for ([q1, q2, q3], [x, y, z]) in &all {
        writeln!(angles, "{q1},{q2},{q3}").unwrap();
        writeln!(positions, "{x},{y},{z}").unwrap();
    }
    folder.write("angles.csv", angles);
    folder.write("positions.csv", &positions);
    folder.write("work.csv", positions);
    folder.write(
        "printer.cfg",
        include_str!("../../examples/printer/printer.cfg"),
    );
    for command in [
        "calibrate",
        "validate",
        "inverse",
        "forward",
        "plan",
        "import",
        "export",
        "workspace",
    ] {
        let text = help(command, 100).replace("\\\n", "");
        let examples = text
            .lines()
            .filter_map(|line| line.strip_prefix("  delta-cal "));
        for example in examples {
            let (example, _) = example.split_once("   (").unwrap_or((example, ""));
            let left_out = [
                "heights.csv",
                "touches.csv",
                "marlin",
                "config.g",
                "init ",
                " | ",
                "--limit 0.05mm",
            ];
            if left_out.iter().any(|part| example.contains(part)) {
                continue;
            }
            let run = folder.run(example);
            assert!([0, 6].contains(&run.code), "{example}: {}", run.stderr);
        }
    }
    // And the command that a report names for the next measurements.
    let report = folder.run("calibrate robot.toml tracker.csv --frame sensor");
    let report = report.ok().stdout;
    let mut lines = report.lines();
    let next = lines.find_map(|line| line.strip_prefix("delta-cal "));
    folder.run(next.unwrap()).ok();
}

fn read(text: &str) -> RobotFile {
    RobotFile::read(&InputText::new("robot.toml", text)).unwrap()
}

/// The template with all commented-out keys enabled, except the arms, which would replace `[nominal]`.
fn whole(template: &str) -> String {
    let (_, rest) = template.split_once("[nominal]").unwrap();
    let (nominal, rest) = rest.split_once("# In place of").unwrap();
    let (_, rest) = rest.split_once("\n\n").unwrap();
    format!("[nominal]{nominal}\n\n{rest}").replace("\n# ", "\n")
}

#[test]
fn the_template_is_a_robot_file_with_every_key() {
    let rotary = format!("{NOMINAL}{TOLERANCE}[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n");
    let (towers, _) = TOWERS.split_once("[noise]").unwrap();
    let linear = format!("{towers}[noise]\nposition_mm = 0.02\njoint_mm = 0.01\n");
    for (kind, same) in [("rotary", rotary), ("linear", linear)] {
        let folder = Folder::new();
        folder
            .run(&format!("init --kind {kind}"))
            .ends(0, "Written: robot.toml");
        let text = folder.read("robot.toml");
        assert_eq!(read(&text), read(&same));
        let arms = kind == "linear" || KEYS.iter().all(|key| text.contains(&format!("# {key} = ")));
        assert!(arms, "{text}");
        let full = read(&whole(&text));
        assert_eq!(full.instruments.planes.len(), 1);
        assert_eq!(full.instruments.points.len(), 1);
        assert!(!full.instruments.targets.is_empty() && full.record.stated("date").is_some());
        // What a plan asks for.
        let lengths = [full.instruments.points[0].lengths, full.instruments.lengths];
        assert!(
            lengths.iter().all(Option::is_some) && !full.instruments.planes[0].blocks.is_empty()
        );
        assert!(full.instruments.distance_scale.is_some());

        // The next step that the help names works.
        folder
            .run("plan robot.toml --count 12 --output poses.csv")
            .ok();
    }
}
