//! Files as users and instruments wrote them and what is said of them, a folder each in `tests/cases`. `case.txt` gives, below each command or several
//! that run one after the other, the exit code, expected (`+`) and forbidden (`-`) output, and numbers (`=`) of a JSON report, each with the largest
//! difference. `refused.txt` gives what is refused. A folder named after an example also has the example's files.

use crate::support::{Folder, cases, number, refused};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn copy(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (own, other) = (entry.path(), to.join(entry.file_name()));
        if own.is_dir() {
            std::fs::create_dir(&other).unwrap();
            copy(&own, &other);
        } else {
            std::fs::copy(&own, &other).unwrap();
        }
    }
}

/// The folders that have a file of this name, with its text.
fn with(file: &str) -> impl Iterator<Item = (PathBuf, String)> {
    let folders = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let folders = std::fs::read_dir(folders).unwrap();
    folders.filter_map(move |folder| {
        let folder = folder.unwrap().path();
        let text = std::fs::read_to_string(folder.join(file)).ok()?;
        Some((folder, text))
    })
}

/// A copy of a case's files.
fn copied(folder: &Path) -> Folder {
    let own = Folder::new();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let example = examples.join(folder.file_name().unwrap());
    if example.is_dir() {
        copy(&example, &own.path("."));
    }
    copy(folder, &own.path("."));
    own
}

/// Whether the number at a path of a report is as expected: `path number largest-difference`.
fn is_near(report: &Value, words: &str) -> bool {
    let words: Vec<_> = words.split(' ').collect();
    let [expected, within] = [1, 2].map(|index| words[index].parse::<f64>().unwrap());
    (number(report, words[0]) - expected).abs() <= within
}

/// Runs the command of a case after those before it, and checks its expectations.
fn check(folder: &Path, before: &[&str], command: &str, expected: &[&str]) {
    let (name, own) = (folder.display(), copied(folder));
    for command in before {
        own.run(command).ok();
    }
    let names = own.names();
    let run = own.run(command);
    assert!(run.code < 2 || run.code > 5 || own.names() == names);
    // Joined into one line, to undo wrapping.
    let all = format!("{} {}", run.stdout, run.stderr);
    let text = all.split('\n').map(str::trim).collect::<Vec<_>>().join(" ");
    for line in expected {
        let (kind, words) = line.split_once(' ').unwrap();
        let holds = match kind {
            "exit" => run.code.to_string() == words,
            "+" => text.contains(words),
            "-" => !text.contains(words),
            "=" => is_near(&run.json(), words),
            _ => panic!("{name}: {line}"),
        };
        assert!(holds, "{name}: {command}: {line}\n{}: {all}", run.code);
    }
}

#[test]
fn each_case_is_told_what_is_right() {
    let mut commands = 0;
    for (folder, text) in with("case.txt") {
        let mut before = Vec::new();
        for case in text.split("$ ").skip(1) {
            let mut lines = case
                .lines()
                .filter(|line| !line.is_empty() && !line.starts_with('#'));
            let command = lines.next().unwrap();
            let expected: Vec<_> = lines.collect();
            commands += 1;
            if expected.is_empty() {
                before.push(command);
            } else {
                check(&folder, &before, command, &expected);
                before.clear();
            }
        }
    }
    assert!(commands >= 110, "{commands}");
}

/// A file with a text replaced throughout; or with a line of this number or `all` of it replaced, or with a line more.
fn changed(good: &str, from: &str, to: &str) -> String {
    match (from, from.parse::<usize>()) {
        ("", _) => format!("{good}{to}\n"),
        ("all", _) => to.to_owned(),
        (_, Ok(number)) => {
            let mut lines: Vec<_> = good.lines().collect();
            lines[number - 1] = to;
            lines.join("\n")
        }
        _ => {
            assert!(good.contains(from), "{from}");
            good.replace(from, to)
        }
    }
}

/// Commands of a file of a case in which something is wrong: one error with its place and cause, and what to do.
fn check_changed(own: &Folder, (commands, file): (&[&str], &str), [from, to, said]: &[String; 3]) {
    let good = own.read(file);
    let text = changed(&good, from, to);
    // Windows line ends and a byte order mark make no difference.
    let windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
    for text in [text, windows] {
        own.write(file, text);
        for command in commands {
            let stderr = refused(own, command, "3", said);
            let (part, _) = said.split_once(" | ").unwrap_or((said, ""));
            assert!(stderr.lines().next().unwrap().contains(part), "{stderr}");
            // The line of the file, with the place marked, stands between two margins.
            let margin = |own: char| own == ' ' || own.is_ascii_digit();
            let lines = stderr.lines().filter(|line| {
                let own = line.trim_start_matches(margin);
                !own.starts_with('|') && !own.starts_with("diagnosis: ")
            });
            assert_eq!(lines.count(), 2, "error and help: {stderr}");
        }
    }
    own.write(file, good);
}

/// In a block of `refused.txt` each line below a command (`$`) has what is added to it, the exit code, and all parts of what is said; below
/// commands and a file (`~`), what is changed in it, and what is said. No file is changed.
#[test]
fn what_is_wrong_is_refused_with_place_and_cause() {
    let mut rows = 0;
    for (folder, text) in with("refused.txt") {
        let own = copied(&folder);
        for block in text.split("\n\n") {
            let marked = |mark| block.lines().filter_map(move |own| own.strip_prefix(mark));
            let commands: Vec<_> = marked('$').map(str::trim).collect();
            let table: Vec<_> = block.lines().filter(|own| own.contains('⇒')).collect();
            for row in cases(&table.join("\n")) {
                rows += 1;
                if let Some(file) = marked('~').next() {
                    check_changed(&own, (&commands, file.trim()), &row);
                } else {
                    let [more, code, said] = row;
                    refused(&own, &format!("{} {more}", commands[0]), &code, &said);
                }
            }
        }
        for name in own.names() {
            let bytes = |folder: &Path| std::fs::read(folder.join(&name)).unwrap();
            assert_eq!(bytes(&folder), bytes(&own.path(".")), "{name}");
        }
    }
    assert!(rows >= 250, "{rows}");
}
