//! Constants of the geometry in Marlin's `Configuration.h`, in the lines that the compiler keeps.

use std::collections::BTreeMap;

/// Constants, with the command and the words that state the same.
const CONSTANTS: [(&str, &str, &str); 13] = [
    ("DELTA_DIAGONAL_ROD", "M665", "L"),
    ("DELTA_RADIUS", "M665", "R"),
    ("DELTA_HEIGHT", "M665", "H"),
    ("DELTA_TOWER_ANGLE_TRIM", "M665", "XYZ"),
    ("DELTA_DIAGONAL_ROD_TRIM_TOWER", "M665", "ABC"),
    ("DELTA_ENDSTOP_ADJ", "M666", "XYZ"),
    ("PRINTABLE_RADIUS", "M665", "P"),
    ("DELTA_PRINTABLE_RADIUS", "M665", "P"),
    ("PROBING_MARGIN", "M665", "Q"),
    (RADIUS_TRIMS, "M665", "U"),
    ("NOZZLE_TO_PROBE_OFFSET", "M851", "XYZ"),
    ("X_PROBE_OFFSET_FROM_EXTRUDER", "M851", "X"),
    ("Y_PROBE_OFFSET_FROM_EXTRUDER", "M851", "Y"),
];
/// A constant that M665 cannot state.
pub(super) const RADIUS_TRIMS: &str = "DELTA_RADIUS_TRIM_TOWER";
/// Binary operators, the loosest first; of those that begin alike, the longer first.
const OPERATORS: [&[&str]; 6] = [
    &["||"],
    &["&&"],
    &["==", "!="],
    &["<=", ">=", "<", ">"],
    &["+", "-"],
    &["*", "/"],
];
/// Parentheses and signs within one another, at most.
const DEEPEST: usize = 64;

/// Command, letter, and the numbers with colons between them; `None` if they cannot be read.
pub(super) type Word = (&'static str, char, Option<String>);

/// What has been read of the file.
#[derive(Debug, Default)]
pub(super) struct Header {
    /// Constants, with their values: NaN if it is no number, `None` if there is none.
    defined: BTreeMap<String, Option<f64>>,
    /// For each `#if` that is open: whether its lines are kept, and whether a branch of it was.
    branches: Vec<(bool, bool)>,
    in_comment: bool,
    /// What a backslash continues in the next line.
    continued: String,
}

impl Header {
    /// The constant that a line states, if the compiler keeps it, and its words.
    pub(super) fn line(&mut self, line: &str) -> Option<(&'static str, Vec<Word>)> {
        let own = self.without_comments(line);
        let code = std::mem::take(&mut self.continued) + &own;
        if let Some(begun) = code.trim_end().strip_suffix('\\') {
            begun.clone_into(&mut self.continued);
            return None;
        }
        let directive = code.trim_start().strip_prefix('#')?.trim_start();
        let (name, rest) = directive
            .split_once(char::is_whitespace)
            .unwrap_or((directive, ""));
        let rest = rest.trim();
        let is_kept = |branches: &[(bool, bool)]| branches.iter().all(|(kept, _)| *kept);
        match name {
            "if" | "ifdef" | "ifndef" => {
                let holds = match name {
                    "if" => self.holds(rest),
                    _ => self.defined.contains_key(rest) == (name == "ifdef"),
                };
                self.branches.push((holds, holds));
            }
            "elif" | "else" => {
                let holds = name == "else" || self.holds(rest);
                let (kept, any) = self.branches.last_mut()?;
                *kept = holds && !*any;
                *any |= holds;
            }
            "endif" => {
                self.branches.pop();
            }
            "define" if is_kept(&self.branches) => return self.define(rest),
            _ => {}
        }
        None
    }

    fn without_comments(&mut self, line: &str) -> String {
        let mut code = String::new();
        let mut rest = line;
        loop {
            let (mark, end) = if self.in_comment {
                ("*/", 2)
            } else {
                ("/*", 2)
            };
            let own = rest.split_once(mark);
            let before = own.map_or(rest, |(before, _)| before);
            if !self.in_comment {
                if let Some((kept, _)) = before.split_once("//") {
                    return code + kept;
                }
                code.push_str(before);
            }
            if own.is_none() {
                return code;
            }
            rest = &rest[before.len() + end..];
            self.in_comment = !self.in_comment;
        }
    }

    fn define(&mut self, rest: &str) -> Option<(&'static str, Vec<Word>)> {
        let (name, value) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let number = (!value.trim().is_empty()).then(|| self.value(value).unwrap_or(f64::NAN));
        self.defined.insert(name.to_owned(), number);
        let (name, command, letters) = CONSTANTS.into_iter().find(|(own, ..)| *own == name)?;
        let listed = value.trim_matches([' ', '\t', '{', '}']).split(',');
        let finite = |own: &f64| own.is_finite();
        let numbers = listed.map(|own| Some(self.value(own).filter(finite)?.to_string()));
        let numbers: Vec<_> = numbers.collect();
        let words = letters.chars().enumerate().map(|(index, letter)| {
            let own = match letters.len() {
                1 => numbers
                    .iter()
                    .cloned()
                    .collect::<Option<Vec<_>>>()
                    .map(|own| own.join(":")),
                _ => numbers.get(index).cloned().flatten(),
            };
            (command, letter, own)
        });
        Some((name, words.collect()))
    }

    /// The value of an expression; `None` if it is none. An unknown name is NaN, which is not true.
    fn value(&self, text: &str) -> Option<f64> {
        let mut rest = text;
        let value = self.binary(&mut rest, 0, 0)?;
        rest.trim().is_empty().then_some(value)
    }

    fn holds(&self, text: &str) -> bool {
        self.value(text).is_some_and(is_true)
    }

    #[expect(clippy::float_cmp, reason = "as the preprocessor compares")]
    fn binary(&self, rest: &mut &str, level: usize, depth: usize) -> Option<f64> {
        let Some(operators) = OPERATORS.get(level) else {
            return self.unary(rest, depth);
        };
        let mut left = self.binary(rest, level + 1, depth)?;
        loop {
            *rest = rest.trim_start();
            let Some(own) = operators.iter().find(|own| rest.starts_with(**own)) else {
                return Some(left);
            };
            *rest = &rest[own.len()..];
            let right = self.binary(rest, level + 1, depth)?;
            left = match *own {
                "||" => truth(is_true(left) || is_true(right)),
                "&&" => truth(is_true(left) && is_true(right)),
                "==" => truth(left == right),
                "!=" => truth(left != right),
                "<=" => truth(left <= right),
                ">=" => truth(left >= right),
                "<" => truth(left < right),
                ">" => truth(left > right),
                "+" => left + right,
                "-" => left - right,
                "*" => left * right,
                _ => left / right,
            };
        }
    }

    fn unary(&self, rest: &mut &str, depth: usize) -> Option<f64> {
        let own = rest.trim_start();
        let first = own.chars().next().filter(|_| depth < DEEPEST)?;
        if let '!' | '-' | '+' = first {
            *rest = &own[1..];
            let value = self.unary(rest, depth + 1)?;
            return Some(match first {
                '!' => truth(!is_true(value)),
                '-' => -value,
                _ => value,
            });
        }
        if first == '(' {
            *rest = &own[1..];
            let value = self.binary(rest, 0, depth + 1)?;
            *rest = rest.trim_start().strip_prefix(')')?;
            return Some(value);
        }
        let part = |own: char| own.is_ascii_alphanumeric() || own == '_' || own == '.';
        let (word, after) = own.split_at(own.find(|own| !part(own)).unwrap_or(own.len()));
        *rest = after;
        if first.is_ascii_digit() || first == '.' {
            let number = word.trim_end_matches(['f', 'F', 'u', 'U', 'l', 'L']);
            return number.parse().ok();
        }
        let Some(call) = after.trim_start().strip_prefix('(') else {
            return Some(match word {
                "true" => 1.0,
                "false" => 0.0,
                _ => self
                    .defined
                    .get(word)
                    .copied()
                    .flatten()
                    .unwrap_or(f64::NAN),
            });
        };
        let (names, after) = call.split_once(')')?;
        *rest = after;
        let mut on = names.split(',').map(|name| {
            let own = self.defined.get(name.trim());
            own.is_some_and(|value| word == "defined" || value.is_none_or(is_true))
        });
        let holds = match word {
            "defined" | "ENABLED" | "ALL" | "BOTH" => on.all(|own| own),
            "ANY" | "EITHER" => on.any(|own| own),
            "DISABLED" | "NONE" => !on.any(|own| own),
            _ => return None,
        };
        Some(truth(holds))
    }
}

fn truth(own: bool) -> f64 {
    f64::from(u8::from(own))
}

fn is_true(own: f64) -> bool {
    own != 0.0 && !own.is_nan()
}
