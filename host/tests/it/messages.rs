//! The index of messages in the documentation is what the sources say.

use std::fmt::Write;
use std::path::Path;

/// What stands in a source file, in its order.
#[derive(Debug, Clone, PartialEq)]
enum Token {
    /// The literal of a string; its arguments are `…`.
    Text(String),
    /// Where a warning, a note or a refusal is made.
    Site(&'static str),
    /// An arm of a match.
    Arm,
    Function(String),
}

const SITES: [&str; 3] = ["warning(", "note(", "Refused::new("];
/// Files whose messages have a kind.
const FINDINGS: [&str; 3] = [
    "calibration/findings.rs",
    "calibration/tilt.rs",
    "explain/rows.rs",
];
/// Headings, files and functions of the messages that have none.
const OF_FUNCTIONS: [(&str, &str, &str); 6] = [
    ("", "calibration.rs", "check"),
    (
        "Refusals of a printer's configuration",
        "report/printer.rs",
        "of",
    ),
    (
        "",
        "printer/contradiction.rs",
        "bad_touch contradicted_length",
    ),
    (
        "Refusals of a validation",
        "validation.rs",
        "too_few where_else",
    ),
    ("", "validation/readings.rs", "unknown_frame"),
    ("Warnings of a validation", "validation.rs", "warnings"),
];
/// Files of errors, each with its remedy.
const OF_ERRORS: [(&str, &str); 3] = [
    ("Refusals of a plan", "planning.rs"),
    ("Refusals of an export", "export/error.rs"),
    ("Refusals of a workspace", "workspace/grid.rs"),
];
/// The file of arms, and those that pass on what others say.
const OTHERS: [&str; 4] = [
    "calibration/refusal.rs",
    "finding.rs",
    "printer.rs",
    "cli/plan.rs",
];

fn source(path: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let text = std::fs::read_to_string(root.join(path)).expect(path);
    let own = text.split("#[cfg(test)]").next().expect("a part");
    own.to_owned()
}

/// A literal's text on one line, with `…` for its arguments.
fn shown(literal: &str) -> String {
    let mut text = String::new();
    let mut depth = 0;
    let mut characters = literal.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '\\' if characters.peek() == Some(&'\n') => {
                while characters.next_if(|own| own.is_whitespace()).is_some() {}
            }
            '\\' => text.extend(characters.next()),
            '{' => {
                depth += 1;
                if depth == 1 {
                    text.push('…');
                }
            }
            '}' => depth -= 1,
            own if depth == 0 => text.push(own),
            _ => {}
        }
    }
    text
}

/// A source with the constants in its messages written out.
fn with_constants(source: &str) -> String {
    let mut text = source.to_owned();
    for part in source.split("\nconst ").skip(1) {
        if let Some((name, rest)) = part.split_once(": &str =")
            && let Some(value) = rest.split('"').nth(1)
        {
            text = text.replace(&format!("{{{name}}}"), value);
            text = text.replace(&format!("{name}.to_owned()"), &format!("\"{value}\""));
        }
    }
    text
}

/// Whether what stands before makes it a definition or a part of another name.
fn is_other(before: &str) -> bool {
    before.ends_with("fn ")
        || before.ends_with(|own: char| own.is_alphanumeric() || "_.".contains(own))
}

fn tokens(path: &str) -> Vec<Token> {
    let text = with_constants(&source(path));
    let mut found = Vec::new();
    let mut rest = text.as_str();
    while let Some(first) = rest.chars().next() {
        let before = &text[..text.len() - rest.len()];
        let function = rest.strip_prefix("fn ").filter(|_| !is_other(before));
        let site = SITES.iter().find(|site| rest.starts_with(**site));
        if rest.starts_with("//") {
            rest = rest.split_once('\n').map_or("", |(_, after)| after);
        } else if let Some(after) = rest.strip_prefix('"') {
            let mut escaped = false;
            let end = after.find(|own| {
                let ends = own == '"' && !escaped;
                escaped = own == '\\' && !escaped;
                ends
            });
            let end = end.expect("the end of a literal");
            found.push(Token::Text(shown(&after[..end])));
            rest = &after[end + 1..];
        } else if let Some(after) = function {
            let name = after.split(['(', '<']).next().expect("a name");
            found.push(Token::Function(name.to_owned()));
            rest = after;
        } else if let Some(site) = site.filter(|_| !is_other(before)) {
            found.push(Token::Site(site));
            rest = &rest[site.len()..];
        } else if let Some(after) = rest.strip_prefix("=>") {
            // Not an arm of a match within a message.
            let line = before.lines().next_back().unwrap_or_default();
            if !line.trim_start().starts_with(['(', '_']) {
                found.push(Token::Arm);
            }
            rest = after;
        } else {
            rest = &rest[first.len_utf8()..];
        }
    }
    found
}

/// Whether a literal is a message, rather than a key or an insertion.
fn is_message(text: &str) -> bool {
    let words = text.split(' ').filter(|word| word.chars().count() > 1);
    words.count() >= 3 && !text.starts_with(' ') && text.trim_end().ends_with(['.', '…'])
}

/// The messages among tokens, without repetitions.
fn messages(tokens: &[Token]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for token in tokens {
        if let Token::Text(text) = token
            && is_message(text)
            && !found.contains(text)
        {
            found.push(text.clone());
        }
    }
    found
}

/// The tokens of the functions with this name.
fn function(tokens: &[Token], name: &str) -> Vec<Token> {
    let mut found = Vec::new();
    let mut within = false;
    for token in tokens {
        match token {
            Token::Function(own) => within = own == name,
            own if within => found.push(own.clone()),
            _ => {}
        }
    }
    assert!(!found.is_empty(), "{name}");
    found
}

/// The first literal of a source.
fn literal(source: &str) -> String {
    let text = source.split('"').nth(1).expect("a literal");
    shown(text)
}

/// What each error of a file says, and its remedy.
fn errors(path: &str) -> Vec<[String; 2]> {
    let text = source(path);
    let (kinds, remedies) = text.split_once("fn remedy").expect("remedies");
    let of = |error: &str| {
        let declared = error
            .lines()
            .skip_while(|line| !line.ends_with(")]"))
            .nth(1)?;
        let declared = declared.trim_start_matches(|own: char| !own.is_uppercase());
        let name = declared.split(|own: char| !own.is_alphanumeric()).next()?;
        let (_, remedy) = remedies.split_once(&format!("Self::{name}"))?;
        Some([literal(error), literal(remedy)])
    };
    kinds
        .split("#[error(")
        .skip(1)
        .map(|own| of(own).expect("a remedy"))
        .collect()
}

/// Kind, level and text.
fn findings() -> Vec<[String; 3]> {
    let mut found: Vec<[String; 3]> = Vec::new();
    for path in FINDINGS {
        let mut texts = Vec::new();
        let mut site = None;
        for token in tokens(path) {
            match (&token, site) {
                (Token::Function(_), _) => texts.clear(),
                (Token::Text(kind), Some(own)) => {
                    let level = str::trim_end_matches(own, '(').to_owned();
                    found.push([kind.clone(), level, messages(&texts).join(" ")]);
                    texts.clear();
                    site = None;
                }
                (Token::Site(own), _) => site = Some(*own),
                _ => texts.push(token),
            }
        }
    }
    found
}

fn index() -> String {
    let mut text = String::from("\n");
    for (level, heading) in [("warning", "Warnings"), ("note", "Notes")] {
        write!(
            text,
            "\n## {heading} of a calibration\n\n| kind | says |\n| --- | --- |\n"
        )
        .unwrap();
        for [kind, _, says] in findings().iter().filter(|own| own[1] == level) {
            let whole = "a fault of the whole file, or a wrong number of the robot file: [diagnosis.md](diagnosis.md)";
            let says = if says.is_empty() { whole } else { says };
            writeln!(text, "| `{kind}` | {says} |").unwrap();
        }
    }
    text.push_str("\n## Causes\n\n| cause | says | what to do |\n| --- | --- | --- |\n");
    let words = tokens("effects/words.rs");
    for arm in function(&words, "words").split(|own| *own == Token::Arm) {
        if let [Token::Text(name), Token::Text(noun), Token::Text(remedy)] = arm
            && noun.contains(' ')
            && !name.contains(' ')
        {
            writeln!(text, "| `{name}` | {noun} | {remedy} |").unwrap();
        }
    }
    text.push_str("\n## Refusals of a calibration\n\n| says and what to do |\n| --- |\n");
    let refusal = tokens("calibration/refusal.rs");
    for name in ["explained", "no_redundancy", "unsolved", "undetermined"] {
        let own = function(&refusal, name);
        let arms = own.split(|own| *own == Token::Arm);
        let arms = arms.map(messages).filter(|own| own.len() > 1);
        for says in arms.filter(|own| !own[0].starts_with("… Otherwise")) {
            writeln!(text, "| {} |", says.join(" ")).unwrap();
        }
    }
    for (heading, path, functions) in OF_FUNCTIONS {
        if !heading.is_empty() {
            write!(text, "\n## {heading}\n\n| says and what to do |\n| --- |\n").unwrap();
        }
        let all = tokens(path);
        for name in functions.split(' ') {
            let own = function(&all, name);
            let sites = own.iter().filter(|own| matches!(own, Token::Site(_)));
            let parts: Vec<_> = match sites.count() {
                // One message a literal.
                0 => own.chunks(1).collect(),
                1 => vec![&own[..]],
                _ => own.split(|own| matches!(own, Token::Site(_))).collect(),
            };
            for says in parts.into_iter().map(messages) {
                if !says.is_empty() {
                    writeln!(text, "| {} |", says.join(" ")).unwrap();
                }
            }
        }
    }
    for (heading, path) in OF_ERRORS {
        write!(
            text,
            "\n## {heading}\n\n| says | what to do |\n| --- | --- |\n"
        )
        .unwrap();
        for [says, remedy] in errors(path) {
            writeln!(text, "| {says} | {remedy} |").unwrap();
        }
    }
    text
}

/// Files in which a message is made.
fn with_sites(folder: &Path, root: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            with_sites(&path, root, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            let name = path.strip_prefix(root).unwrap().to_str().unwrap();
            let text = source(name);
            let makes = |site: &&str| {
                let mut places = text.match_indices(*site);
                places.any(|(at, _)| !is_other(&text[..at]))
            };
            if SITES.iter().any(makes) {
                found.push(name.to_owned());
            }
        }
    }
}

/// `DELTA_CAL_MESSAGES=write` writes the index anew.
#[test]
fn the_index_of_messages_is_complete() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = root.join("../docs/messages.md");
    let text = std::fs::read_to_string(&page).unwrap();
    let (head, rest) = text.split_once("<!-- generated -->").unwrap();
    let written = index();
    if std::env::var("DELTA_CAL_MESSAGES").is_ok_and(|own| own == "write") {
        std::fs::write(&page, format!("{head}<!-- generated -->{written}")).unwrap();
        return;
    }
    let hint = "DELTA_CAL_MESSAGES=write writes docs/messages.md";
    assert_eq!(rest, written, "{hint}");
    let mut found = Vec::new();
    with_sites(&root.join("src"), &root.join("src"), &mut found);
    let listed = |own: &String| {
        let paths = OF_FUNCTIONS.map(|(_, path, _)| path);
        let all = [&paths[..], &FINDINGS, &OTHERS].concat();
        all.contains(&own.as_str())
    };
    found.retain(|own| !listed(own));
    assert!(found.is_empty(), "these make messages too: {found:?}");
}
