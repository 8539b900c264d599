//! The figures as tables: against their limits, beside other solvers, and as in the document.

use super::figures::{Budget, Figure, Figures, Peer};
use crate::check::Check;
use std::path::Path;

/// Every budget beside what it was measured at, then and now.
pub(super) fn budgets(check: &mut Check, budgets: &[Budget], figures: &Figures) {
    println!("\non the Cortex-M4F under QEMU (instructions, not cycles):");
    println!(
        "{:<26} {:>9} {:>9} {:>9}  {:<6}",
        "item", "measured", "recorded", "limit", ""
    );
    for budget in budgets {
        let Budget {
            item,
            limit,
            measured: recorded,
        } = budget;
        let Some(Figure { value, unit, words }) = figures.get(item) else {
            check.fail(format!("{item} has a budget and was not measured"));
            continue;
        };
        let within = value <= limit;
        println!(
            "{item:<26} {:>9} {:>9} {:>9}  {:<6} {unit}, {words}",
            grouped(*value),
            grouped(*recorded),
            grouped(*limit),
            if within { "ok" } else { "FAILED" },
        );
        if !within {
            check.fail(format!(
                "{item}: {} of at most {} {unit}",
                grouped(*value),
                grouped(*limit)
            ));
        }
    }
}

/// What is measured without a limit.
pub(super) fn rest(budgets: &[Budget], figures: &Figures) {
    println!("\nmeasured, without a limit:");
    for (item, Figure { value, unit, words }) in figures {
        if !budgets.iter().any(|budget| budget.item == *item) {
            println!("{item:<36} {:>10} {unit}, {words}", grouped(*value));
        }
    }
}

/// Rows of the document's table: words, and items without their scalar, of the arms apart in single and
/// double precision and of the joint calibration in both.
const ROWS: [(&str, [&str; 4]); 10] = [
    (
        "take in one sample, mean",
        ["add-mean", "add-mean", "joint-add-mean", "joint-add-mean"],
    ),
    (
        "take in one sample, the longest",
        [
            "add-longest",
            "add-longest",
            "joint-add-longest",
            "joint-add-longest",
        ],
    ),
    (
        "take in one of many at once",
        ["add-many", "add-many", "joint-add-many", "joint-add-many"],
    ),
    (
        "test one sample against those before it and take it in, mean",
        ["gate-mean", "gate-mean", "", ""],
    ),
    (
        "test one sample and take it in, the longest",
        ["gate-longest", "gate-longest", "", ""],
    ),
    (
        "from the last sample to parameters and covariance, mean",
        [
            "outcome-20-mean",
            "outcome-20-mean",
            "joint-outcome-20-mean",
            "joint-outcome-40-mean",
        ],
    ),
    (
        "from the last sample to parameters and covariance, the longest (f32: of many robots)",
        [
            "outcome-20",
            "outcome-20",
            "joint-outcome-20",
            "joint-outcome-40",
        ],
    ),
    (
        "the longest step of a solve",
        [
            "outcome-20-step",
            "outcome-20-step",
            "joint-outcome-20-step",
            "joint-outcome-40-step",
        ],
    ),
    (
        "forward kinematics, the longest",
        ["forward", "forward", "", ""],
    ),
    (
        "inverse kinematics, the longest",
        ["inverse", "inverse", "", ""],
    ),
];

/// The document with both tables.
const PAGE: &str = "docs/benchmarks.md";
/// What a figure of the document may be off: the compiler decides the last instructions.
const STALE: f64 = 0.01;

pub(super) fn document(check: &mut Check, figures: &Figures) {
    println!("\nfor {PAGE}:\n");
    println!(
        "| Cortex-M4F under QEMU, a robot, instructions (not cycles) | arms apart, f32 | f64 in \
         software | joint, f32 | f64 in software |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for (words, [single, double, joint_single, joint_double]) in ROWS {
        let cells = [
            format!("f32/{single}"),
            format!("f64/{double}"),
            format!("f32/{joint_single}"),
            format!("f64/{joint_double}"),
        ];
        row(check, words, &cells.map(|item| of(figures, &item)));
    }
}

/// Prints a row of the document, and compares the document's with it.
pub(super) fn row(check: &mut Check, words: &str, cells: &[String]) {
    let row = format!("| {words} | {} |", cells.join(" | "));
    println!("{row}");
    let folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let page = folders
        .map(|folder| folder.join(PAGE))
        .find(|path| path.is_file());
    let page = page
        .and_then(|path| std::fs::read_to_string(path).ok())
        .unwrap_or_default();
    let stated = page.lines().find_map(|line| {
        let cells = line.strip_prefix(&format!("| {words} | "))?;
        Some(
            cells
                .trim_end_matches(" |")
                .split(" | ")
                .collect::<Vec<_>>(),
        )
    });
    let number = |text: &str| text.replace(',', "").parse::<f64>().ok();
    let same = stated.is_some_and(|stated| {
        stated.len() == cells.len()
            && stated.iter().zip(cells).all(|(stated, found)| {
                match (number(stated), number(found)) {
                    (Some(stated), Some(found)) => (stated / found - 1.0).abs() <= STALE,
                    _ => *stated == found.as_str(),
                }
            })
    });
    if !same {
        check.fail(format!("{PAGE} is stale, the row is now: {row}"));
    }
}

pub(super) fn peers(check: &mut Check, peers: &[Peer], figures: &Figures) {
    println!();
    println!("| Cortex-M4F, f32, one arm, exact data, instructions | 20 samples | 60 | 1000 |");
    println!("| --- | --- | --- | --- |");
    let mut measured = |words: &str, item: &str| {
        let cells = [20, 60, 1000].map(|samples| of(figures, &format!("peer/{item}-{samples}")));
        row(check, words, &cells);
    };
    measured(
        "this solver, from the last sample to the result",
        "delta-cal-last",
    );
    measured(
        "this solver, in total: sines, factor, solve, covariance",
        "delta-cal-total",
    );
    measured(
        "`levenberg-marquardt` 0.15 in the same run, the whole solve, no covariance",
        "levenberg-marquardt",
    );
    for Peer {
        name,
        at_20,
        at_60,
        at_1000,
    } in peers
    {
        let cells = [at_20, at_60, at_1000].map(Clone::clone);
        row(check, &format!("{name}, measured elsewhere"), &cells);
    }
}

pub(super) fn of(figures: &Figures, item: &str) -> String {
    figures
        .get(item)
        .map_or_else(|| "–".to_owned(), |figure| grouped(figure.value))
}

/// Thousands separated by commas.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_separated() {
        for (value, text) in [
            (0, "0"),
            (999, "999"),
            (1000, "1,000"),
            (123_456, "123,456"),
            (1_234_567, "1,234,567"),
        ] {
            assert_eq!(grouped(value), text);
        }
    }

    #[test]
    fn more_than_the_limit_fails() {
        let budget = Budget {
            item: "f32/x".to_owned(),
            limit: 10,
            measured: 1,
        };
        let measured = |value| {
            let figure = Figure {
                value,
                unit: "bytes".to_owned(),
                words: String::new(),
            };
            Figures::from([("f32/x".to_owned(), figure)])
        };
        for (figures, failures) in [(measured(10), 0), (measured(11), 1), (Figures::new(), 1)] {
            let mut check = Check::default();
            budgets(&mut check, std::slice::from_ref(&budget), &figures);
            assert_eq!(check.into_failures().len(), failures);
        }
    }
}
