//! Help texts are wrapped where the terminal ends, and nowhere else.

use std::process::Command;

const COMMANDS: [&str; 20] = [
    "",
    "init",
    "calibrate",
    "validate",
    "forward",
    "inverse",
    "plan",
    "simulate",
    "workspace",
    "export",
    "import",
    "klipper",
    "device",
    "device calibrate",
    "device status",
    "device parameters",
    "device revert",
    "device apply",
    "completions",
    "man",
];

fn help(command: &str, columns: usize) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_delta-cal"))
        .args(command.split_whitespace())
        .arg("--help")
        .env("COLUMNS", columns.to_string())
        .output()
        .unwrap();
    String::from_utf8(run.stdout).unwrap()
}

/// The spaces that a line begins with; prose begins with none.
fn indentation(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// No line is longer than the terminal is wide, and in prose none ends before the next word would not
/// fit: a text with line ends of its own would leave lines of a few words.
#[test]
fn help_is_wrapped_at_the_terminals_width() {
    for columns in [80, 100] {
        for command in COMMANDS {
            let text = help(command, columns);
            let lines: Vec<_> = text.lines().collect();
            assert!(lines.len() > 5, "{command}: {text}");
            for line in &lines {
                let width = line.chars().count();
                assert!(width <= columns, "{command} at {columns}: {line}");
            }
            for pair in lines.windows(2) {
                let &[line, next] = pair else { unreachable!() };
                let prose = indentation(line) == 0 && indentation(next) == 0;
                if !prose || line.is_empty() || next.is_empty() || line.ends_with(':') {
                    continue;
                }
                let word = next.split_whitespace().next().unwrap();
                let width = line.chars().count() + 1 + word.chars().count();
                assert!(width > columns, "{command} at {columns}: {line}\n{next}");
            }
        }
    }
}

/// Examples, file formats and exit codes stand below the options, and their lines are never broken.
#[test]
fn examples_and_formats_keep_their_lines() {
    for command in COMMANDS {
        let below = |columns| {
            let text = help(command, columns);
            let (_, below) = text.split_once("Print help").unwrap();
            // A group of options of its own may follow.
            let parts = below
                .split("\n\n")
                .filter(|part| !part.contains("\n      --"));
            parts.collect::<Vec<_>>().join("\n\n")
        };
        let (wide, narrow) = (below(100), below(80));
        for line in wide.lines().filter(|line| indentation(line) > 0) {
            assert!(
                narrow.lines().any(|other| other == line),
                "{command}: {line}"
            );
        }
    }
}
