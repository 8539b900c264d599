//! Names of included files with `*`, `?` and `[…]`, as Python's `glob` reads them.

/// Whether a name has any of them.
pub(super) fn is_pattern(name: &str) -> bool {
    name.contains(['*', '?', '['])
}

/// Whether a file's name fits.
pub(super) fn fits(pattern: &str, name: &str) -> bool {
    let pattern: Vec<char> = pattern.chars().collect();
    let name: Vec<char> = name.chars().collect();
    // A hidden file is only named by a pattern that begins with a dot too.
    if name.first() == Some(&'.') && pattern.first() != Some(&'.') {
        return false;
    }
    matches(&pattern, &name)
}

fn matches(pattern: &[char], name: &[char]) -> bool {
    match pattern {
        [] => name.is_empty(),
        ['*', rest @ ..] => (0..=name.len()).any(|skipped| matches(rest, &name[skipped..])),
        ['?', rest @ ..] => matches!(name, [_, others @ ..] if matches(rest, others)),
        ['[', rest @ ..] => match (rest.iter().skip(1).position(|c| *c == ']'), name) {
            (Some(end), [letter, others @ ..]) => {
                let (class, after) = rest.split_at(end + 1);
                let inverted = class.first() == Some(&'!');
                let class = if inverted { &class[1..] } else { class };
                in_class(class, *letter) != inverted && matches(&after[1..], others)
            }
            _ => false,
        },
        [letter, rest @ ..] => {
            matches!(name, [own, others @ ..] if own == letter && matches(rest, others))
        }
    }
}

fn in_class(class: &[char], letter: char) -> bool {
    match class {
        [] => false,
        [low, '-', high, rest @ ..] => (*low..=*high).contains(&letter) || in_class(rest, letter),
        [one, rest @ ..] => *one == letter || in_class(rest, letter),
    }
}
