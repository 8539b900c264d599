//! The check for people: plain lines of at most 100 columns.

use crate::observability::{Block, Observability};
use crate::poses::{Expectation, NextPoses};
use crate::report::plan::table::assumptions;
use crate::report::table::{heading, small};
use crate::units::degrees;
use crate::words::{count, in_file_units};
use crate::{CalibrationMethod, RobotFile, SamplesFile};
use std::fmt::Write;

/// Samples listed; of more, those with the most leverage.
const LISTED: usize = 30;
/// A sample beyond this leverage is hardly checked by any other.
const UNCHECKED: f64 = 0.9;

/// What a line of the table shows of a block.
type Figure = fn(&Block) -> f64;

/// The whole report.
pub fn render(
    robot: &RobotFile,
    samples: &SamplesFile,
    method: CalibrationMethod,
    observability: &Observability,
    next: &NextPoses,
) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{} of {} for {}, {} method\n{}\n",
        count(samples.rows.len(), "sample"),
        samples.name,
        robot.name,
        method.name().to_uppercase(),
        assumptions(&observability.assumptions),
    );
    text.push_str(&verdict(observability));
    text.push_str("\n\n");
    singular_values(&mut text, observability);
    weakest(&mut text, observability);
    leverages(&mut text, observability);
    additions(&mut text, next);
    text
}

/// In one sentence.
pub fn verdict(observability: &Observability) -> String {
    let Some(block) = observability.blocks.iter().find(|block| !block.determined) else {
        return "These samples determine every parameter.".to_owned();
    };
    let (arm, parameter, sigma) = block.worst;
    let rank = block.singular_values.len();
    if block.rank < rank {
        format!(
            "These samples do not determine {}: they leave {} of {rank} combinations of its \
             parameters open",
            name(block),
            rank - block.rank
        )
    } else {
        format!(
            "These samples do not determine {}: {parameter} of {arm} is known only to {} (one \
             sigma)",
            name(block),
            in_file_units(parameter, sigma)
        )
    }
}

fn name(block: &Block) -> String {
    block
        .arm
        .map_or_else(|| "the robot".to_owned(), |arm| arm.to_string())
}

fn singular_values(text: &mut String, observability: &Observability) {
    let blocks = &observability.blocks;
    let names = blocks.iter().fold(String::new(), |mut names, block| {
        let _ = write!(names, "{:>14}", name(block));
        names
    });
    heading(text, &format!("{:<44}{names}", "Singular values, 1/mm"));
    let most = blocks.iter().map(|block| block.singular_values.len()).max();
    for index in 0..most.unwrap_or(0) {
        let _ = write!(text, "  {:<42}", index + 1);
        for block in blocks {
            let value = block.singular_values.get(index).copied().unwrap_or(0.0);
            let _ = write!(text, "{:>14}", significant(value));
        }
        text.push('\n');
    }
    text.push_str(
        "These are of the Jacobian with rows in sigmas of the noise and columns in mm, angles times the\n\
         upper arm; one over a singular value is one sigma of that combination of parameters.\n\n",
    );
    heading(
        text,
        &format!("{:<44}{names}", "Observability (larger is better)"),
    );
    let figures: [(&str, Figure); 5] = [
        ("O1  geometric mean / root of the poses", |block| {
            block.indices.o1
        }),
        ("O2  smallest / largest: 1 / condition", |block| {
            block.indices.o2
        }),
        ("O3  smallest", |block| block.indices.o3),
        ("O4  smallest squared / largest", |block| block.indices.o4),
        ("O5  1 / sum of the inverses", |block| block.indices.o5),
    ];
    for (title, of) in figures {
        let _ = write!(text, "  {title:<42}");
        for block in blocks {
            let _ = write!(text, "{:>14}", significant(of(block)));
        }
        text.push('\n');
    }
    text.push('\n');
}

fn weakest(text: &mut String, observability: &Observability) {
    heading(text, "Determined least, by these samples alone");
    for block in &observability.blocks {
        let weakest = &block.weakest;
        let together = if weakest.is_several() {
            "a change together of "
        } else {
            ""
        };
        let known = if weakest.sigma.is_finite() {
            format!("one sigma is {} mm", small(weakest.sigma))
        } else {
            "nothing is known of it".to_owned()
        };
        let of = if block.arm.is_some() {
            format!("{}: ", name(block))
        } else {
            String::new()
        };
        let _ = writeln!(text, "  {of}{together}{}; {known}", weakest.in_words());
    }
    text.push('\n');
}

fn leverages(text: &mut String, observability: &Observability) {
    let leverages = &observability.leverages;
    let mut listed: Vec<_> = leverages.iter().collect();
    let title = if listed.len() > LISTED {
        listed.sort_by(|a, b| b.total.total_cmp(&a.total));
        listed.truncate(LISTED);
        format!("Leverage: the {LISTED} samples with the largest")
    } else {
        "Leverage of each sample".to_owned()
    };
    heading(
        text,
        &format!("{title:<44}{:>8}{:>10}{:>10}", "line", "total", "largest"),
    );
    for leverage in listed {
        let [q1, q2, q3] = leverage.joints.map(degrees);
        let unchecked = if leverage.largest > UNCHECKED {
            "  hardly checked by the others"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "  {:<42}{:>8}{:>10.2}{:>10.2}{unchecked}",
            format!("{q1:.3}, {q2:.3}, {q3:.3} deg"),
            leverage.line,
            leverage.total,
            leverage.largest
        );
    }
    let total: f64 = leverages.iter().map(|leverage| leverage.total).sum();
    let _ = writeln!(
        text,
        "total: how many of the {total:.0} parameters a sample decides; largest: the same of one \
         of its residuals\n"
    );
}

fn additions(text: &mut String, next: &NextPoses) {
    let known = |expectation: &Option<Expectation>| {
        expectation.as_ref().map_or_else(
            || "unknown".to_owned(),
            |expectation| format!("{} mm", small(expectation.workspace.rms)),
        )
    };
    let now = format!(
        "Position over the workspace, one sigma: {} rms now",
        known(&next.before)
    );
    if next.poses.is_empty() {
        let _ = writeln!(text, "{now}.");
        return;
    }
    heading(text, "Poses that would help most, in this order");
    text.push_str("  q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm\n");
    for line in crate::kinematics::to_csv(&next.poses).lines().skip(1) {
        let _ = writeln!(text, "  {line}");
    }
    let _ = writeln!(text, "{now}, {} with them.", known(&next.after));
}

/// Four significant digits.
fn significant(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value) {
        let digits = if value > 0.0 {
            #[allow(clippy::cast_possible_truncation)] // −3 to 6
            let magnitude = value.log10().floor() as i32;
            usize::try_from(3 - magnitude).unwrap_or(0)
        } else {
            0
        };
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}
