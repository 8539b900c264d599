//! The function block for PLCs, translated term by term and run: it is the robot, in the convention of its file.

use crate::conventions::twelve;
use crate::support::{Folder, distance, platform, poses, true_arms};
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

/// Structured text in Python: one statement a line, arrays from 1.
fn in_python(text: &str) -> String {
    let mut code = String::from(
        "import math, sys\nSIN, COS, ATAN, ACOS, SQRT, ABS = math.sin, math.cos, math.atan, math.acos, math.sqrt, abs\n\
         TRUE, FALSE = True, False\n",
    );
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap().trim());
    let lines: Vec<_> = lines.filter(|line| !line.is_empty()).collect();
    let body = lines
        .iter()
        .position(|line| *line == "OK := TRUE;")
        .unwrap();
    for line in &lines[..body] {
        let Some((names, kind)) = line.split_once(" : ") else {
            continue;
        };
        let (kind, value) = kind
            .trim_end_matches(';')
            .split_once(" := ")
            .unwrap_or((kind, ""));
        for name in names.split(", ") {
            let value = match (kind.starts_with("ARRAY"), value) {
                (true, "") => "[0.0] * 4".to_owned(),
                (true, own) => format!("[0.0] + {own}"),
                (false, "") => "0.0".to_owned(),
                (false, own) => own.to_owned(),
            };
            if !name.starts_with("TYPE") {
                writeln!(code, "{name} = {value}").unwrap();
            }
        }
    }
    code += "def block():\n    global OK, X, Q\n    globals().update(run())\ndef run():\n    Q, X = list(globals()['Q']), list(globals()['X'])\n";
    code += "    UX, UY, UZ, VX, VY, VZ, BX, BY, BZ, ANGLE = ([0.0] * 4 for _ in range(10))\n";
    let mut depth = 1;
    for line in lines[body..]
        .iter()
        .take_while(|line| **line != "END_FUNCTION_BLOCK")
    {
        let line = line.trim_end_matches(';');
        if line.starts_with("END_") || line == "ELSE" {
            depth -= 1;
        }
        let indent = "    ".repeat(depth);
        let python = if let Some(condition) = line.strip_prefix("IF ") {
            format!("if {}:", condition.strip_suffix(" THEN").unwrap())
        } else if let Some(range) = line.strip_prefix("FOR ") {
            let (name, range) = range
                .strip_suffix(" DO")
                .unwrap()
                .split_once(" := ")
                .unwrap();
            let (from, to) = range.split_once(" TO ").unwrap();
            format!("for {name} in range({from}, {to} + 1):")
        } else if line == "ELSE" {
            "else:".to_owned()
        } else if line.starts_with("END_") {
            continue;
        } else {
            let (to, value) = line.split_once(" := ").unwrap();
            format!("{to} = {value}")
        };
        writeln!(code, "{indent}{python}").unwrap();
        depth += usize::from(python.ends_with(':'));
    }
    code + "    return {'OK': OK, 'X': X, 'Q': Q}\n\
            for line in sys.stdin:\n    Q[1:] = map(float, line.split())\n    asked = Q[1:]\n    INVERSE = FALSE\n    block()\n    \
            at = X[1:]\n    INVERSE = TRUE\n    Q[1:] = [0.0] * 3\n    block()\n    \
            print(*at, *Q[1:], int(OK))\n"
}

#[test]
fn the_function_block_is_the_robot_forwards_and_backwards() {
    if !delta_cal_verify::have(&["python3"]) {
        return;
    }
    let arms = true_arms();
    // All directions, in degrees.
    for own in twelve().take(4) {
        let folder = Folder::new();
        folder.write("robot.toml", own.robot(&arms, &[]));
        let text = folder
            .run("export robot.toml --for structured-text")
            .ok()
            .stdout;
        let (_, block) = text.split_once("TYPE DELTA_REAL").unwrap();
        folder.write("block.py", in_python(block));
        let asked = poses(20);
        let mut child = Command::new("python3")
            .arg(folder.path("block.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut input = child.stdin.take().unwrap();
        for q in &asked {
            let [a, b, c] = q.map(|q| own.sense() * q);
            writeln!(input, "{a} {b} {c}").unwrap();
        }
        drop(input);
        let output = child.wait_with_output().unwrap();
        let rows = String::from_utf8(output.stdout).unwrap();
        assert_eq!(rows.lines().count(), asked.len());
        for (row, q) in rows.lines().zip(&asked) {
            let found: Vec<f64> = row.split(' ').map(|cell| cell.parse().unwrap()).collect();
            let at = own.place(platform(&arms, *q));
            // Parameters are written to 9 decimals.
            assert!(
                distance([found[0], found[1], found[2]], at) < 1e-6,
                "{row}: {at:?}"
            );
            let back = [found[3], found[4], found[5]].map(|joint| own.sense() * joint);
            assert!(found[6] > 0.0 && distance(back, *q) < 1e-6, "{row}: {q:?}");
        }
    }
}
