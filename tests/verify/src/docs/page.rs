//! What a page of Markdown links to, and its code blocks.

use std::collections::{BTreeMap, BTreeSet};

/// What a code block may hold.
const KINDS: [&str; 12] = [
    "c", "cmake", "console", "cpp", "csv", "json", "python", "rust", "sh", "text", "toml", "yaml",
];

#[derive(Debug, Default)]
pub(super) struct Page {
    /// Line and target; none of those on other sites.
    pub(super) links: Vec<(usize, String)>,
    /// What a link to a place in this page can name.
    pub(super) anchors: BTreeSet<String>,
    /// Line and what is wrong with the code block there.
    pub(super) faults: Vec<(usize, String)>,
}

/// An open code block.
struct Block {
    line: usize,
    sign: char,
    length: usize,
}

impl Page {
    pub(super) fn read(text: &str) -> Self {
        let mut page = Self::default();
        let mut block: Option<Block> = None;
        let mut headings: BTreeMap<String, usize> = BTreeMap::new();
        for (line, text) in (1..).zip(text.lines()) {
            let fence = fence(text);
            match (&block, fence) {
                (None, Some((sign, length, kind))) => {
                    if !KINDS.contains(&kind.split(',').next().unwrap_or_default()) {
                        let what = format!("{kind:?} is no known kind of code block");
                        page.faults.push((line, what));
                    }
                    block = Some(Block { line, sign, length });
                }
                (Some(open), Some((sign, length, kind))) if open.sign == sign => {
                    if kind.is_empty() && length >= open.length {
                        block = None;
                    } else if !kind.is_empty() && length >= open.length {
                        let what = format!("the code block is not closed before line {line}");
                        page.faults.push((open.line, what));
                        block = Some(Block { line, sign, length });
                    }
                }
                (Some(_), _) => {}
                (None, None) => page.line(line, text, &mut headings),
            }
        }
        if let Some(open) = block {
            let what = "the code block is not closed".to_owned();
            page.faults.push((open.line, what));
        }
        page
    }

    /// A line outside of code blocks.
    fn line(&mut self, line: usize, text: &str, headings: &mut BTreeMap<String, usize>) {
        if let Some(heading) = heading(text) {
            let name = anchor(heading);
            let before = headings.entry(name.clone()).or_insert(0);
            let number = *before;
            *before += 1;
            self.anchors.insert(match number {
                0 => name,
                number => format!("{name}-{number}"),
            });
        }
        let text = &*without_code(text);
        let after = |start: &'static str, end: char| {
            text.match_indices(start).filter_map(move |(at, _)| {
                let rest = &text[at + start.len()..];
                rest.find(end).map(|end| rest[..end].to_owned())
            })
        };
        // `[text](target "title")`
        let inline = after("](", ')').map(|link| {
            let target = link.split_whitespace().next();
            target.unwrap_or_default().to_owned()
        });
        let of_html = after("src=\"", '"').chain(after("href=\"", '"'));
        // `[text]: target`
        let defined = text.split_once("]: ").filter(|_| text.starts_with('['));
        let defined = defined.map(|(_, target)| target.trim().to_owned());
        let links = inline.chain(of_html).chain(defined);
        let here = links.filter(|target| !target.contains("://") && !target.contains("mailto:"));
        self.links.extend(here.map(|target| (line, target)));
        for start in ["id=\"", "name=\""] {
            self.anchors.extend(after(start, '"'));
        }
    }
}

/// A line of three or more backticks or tildes: which, how many, and what stands after them.
fn fence(line: &str) -> Option<(char, usize, &str)> {
    let text = line.trim_start();
    let sign = text.chars().next().filter(|c| matches!(c, '`' | '~'))?;
    let rest = text.trim_start_matches(sign);
    let length = text.len() - rest.len();
    (length >= 3 && !rest.contains('`')).then_some((sign, length, rest.trim()))
}

fn heading(line: &str) -> Option<&str> {
    let text = line.trim_start_matches('#');
    let level = line.len() - text.len();
    ((1..=6).contains(&level) && text.starts_with(' ')).then_some(text.trim())
}

/// What GitHub makes of a heading.
fn anchor(heading: &str) -> String {
    let mut text = String::new();
    let mut rest = heading;
    // Of a link only its text shows.
    while let Some((before, after)) = rest.split_once("](") {
        text.push_str(before);
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    text.push_str(rest);
    text.to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// A line without what stands in backticks.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join("``")
}
