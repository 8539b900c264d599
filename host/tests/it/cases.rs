//! Files as users and instruments wrote them and what is said of them, a folder each in `tests/cases`. `case.txt` gives, below each command, the
//! exit code, expected (`+`) and forbidden (`-`) output. A folder named after an example also has the example's files.

use crate::support::Folder;
use std::path::Path;

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

/// Runs a command of a case and checks its expectations.
fn check(folder: &Path, name: &str, command: &str, expected: &[&str]) {
    let own = Folder::new();
    let example = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name);
    if example.is_dir() {
        copy(&example, &own.path("."));
    }
    copy(folder, &own.path("."));
    let run = own.run(command);
    // Joined into one line, to undo wrapping.
    let all = format!("{} {}", run.stdout, run.stderr);
    let text = all.split('\n').map(str::trim).collect::<Vec<_>>().join(" ");
    for line in expected {
        let (kind, words) = line.split_once(' ').unwrap();
        let holds = match kind {
            "exit" => run.code.to_string() == words,
            "+" => text.contains(words),
            "-" => !text.contains(words),
            _ => panic!("{name}: {line}"),
        };
        assert!(holds, "{name}: {command}: {line}\n{}: {all}", run.code);
    }
}

#[test]
fn each_case_is_told_what_is_right() {
    let folders = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let mut commands = 0;
    for folder in std::fs::read_dir(folders).unwrap() {
        let folder = folder.unwrap().path();
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(folder.join("case.txt")).unwrap();
        for case in text.split("$ ").skip(1) {
            let mut lines = case
                .lines()
                .filter(|line| !line.is_empty() && !line.starts_with('#'));
            let command = lines.next().unwrap();
            check(&folder, &name, command, &lines.collect::<Vec<_>>());
            commands += 1;
        }
    }
    assert!(commands >= 110, "{commands}");
}
