//! What terminal and certificate have in common.

use crate::fit::options::Frame;
use crate::render::section::{Part, Section};
use crate::render::table::Table;
use crate::text::numbers::{confidence, small};
use crate::text::words::count;
use crate::validation::{Bounded, Validation, Verdict};

/// "calibrated.toml against 24 rows of check.csv, measured in the robot's frame".
pub(super) fn headline(found: &Validation) -> String {
    let frame = match found.request.frame {
        Frame::Base => "measured in the robot's frame",
        Frame::Sensor => {
            "measured in the sensor's frame, with the rigid motion that fits best removed"
        }
    };
    format!(
        "{} against {} of {}, {frame}",
        found.robot.name,
        count(found.rows.len(), "row"),
        found.samples_file
    )
}

/// The verdict with its confidence, in one sentence.
pub fn verdict(found: &Validation) -> String {
    format!("{}: {}", title(found.verdict), reason(found))
}

/// What the verdict follows from.
pub(super) fn reason(found: &Validation) -> String {
    let limit = found.request.limit;
    let below = found.confidence();
    let rms = match found.rms_verdict {
        Verdict::Pass => format!(
            "the rms position error is below the limit of {limit} mm with a confidence of {}",
            confidence(below)
        ),
        Verdict::Fail => format!(
            "the rms position error is above the limit of {limit} mm with a confidence of {}",
            confidence(1.0 - below)
        ),
        Verdict::Undecided => {
            let remedy = match (found.poses_to_decide, found.noise) {
                (Some(poses), _) => format!(
                    "measure {} in addition, {poses} in all, if they scatter as these do",
                    count(poses.saturating_sub(found.poses), "pose")
                ),
                (None, None) => {
                    "state the [noise] of the instrument, which is part of this figure".to_owned()
                }
                (None, Some(_)) => {
                    "the error is too near to the limit to be decided by measuring more".to_owned()
                }
            };
            format!(
                "the limit of {limit} mm lies within the confidence interval of the rms position error: {remedy}"
            )
        }
    };
    let largest = match (found.largest_verdict, found.request.largest_limit) {
        (Some(verdict), Some(limit)) => match verdict {
            Verdict::Pass => format!("; the largest error is below its limit of {limit} mm"),
            Verdict::Fail => format!("; the largest error is above its limit of {limit} mm"),
            Verdict::Undecided if found.noise.is_none() => {
                format!(
                    "; whether the largest error is below {limit} mm is unknown without the [noise]"
                )
            }
            Verdict::Undecided => format!(
                "; the limit of {limit} mm lies within the confidence interval of the largest error: measure its \
                 row again, with less noise"
            ),
        },
        _ => String::new(),
    };
    format!("{rms}{largest}.")
}

/// In a word or two.
pub(super) fn title(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "Pass",
        Verdict::Undecided => "Not passed, cannot decide",
        Verdict::Fail => "Fail",
    }
}

/// The figures with their limits.
pub(super) fn figures(found: &Validation) -> Table {
    let rows: [(_, &Bounded, _, _); 2] = [
        (
            "rms over the region",
            &found.rms,
            Some(found.request.limit),
            Some(found.rms_verdict),
        ),
        (
            "largest at the poses",
            &found.largest,
            found.request.largest_limit,
            found.largest_verdict,
        ),
    ];
    Table::of(rows)
        .column("Position error, mm", |(name, ..)| *name)
        .column("estimate", |(_, figure, ..)| fixed(figure.value))
        .column("95 % from", |(_, figure, ..)| fixed(figure.lower))
        .column("to", |(_, figure, ..)| {
            figure.upper.map_or_else(|| "unknown".to_owned(), fixed)
        })
        .column("limit", |(.., limit, _)| {
            limit.map_or_else(|| "none".to_owned(), |limit| limit.to_string())
        })
        .column("", |(.., verdict)| verdict.map_or("", Verdict::name))
        .table()
}

/// What was measured, before the noise is removed.
pub(super) fn measured(found: &Validation) -> String {
    let deviation = &found.deviation;
    let line = deviation
        .max_at_line
        .map_or_else(String::new, |line| format!(" (line {line})"));
    let noise = match found.noise {
        Some(noise) => format!(
            "The noise of the instrument and of the joints, {} mm rms as the robot file states it, is removed from \
             the figures",
            small(noise)
        ),
        None => "They contain the noise of the instrument".to_owned(),
    };
    format!(
        "Measured deviations: {} mm rms, {} mm at most{line}. {noise}. {} at {:.1} effective degrees of freedom.",
        small(deviation.rms),
        small(deviation.max),
        count(found.poses, "different pose"),
        found.error.degrees_of_freedom()
    )
}

/// Where the statement holds.
pub(super) fn region(found: &Validation) -> String {
    let [x, y, z] = found
        .region
        .map(|(low, high)| format!("{low:.0} to {high:.0}").replace('-', "−"));
    format!("Region that was measured, in the robot's frame: x {x}, y {y}, z {z} mm.")
}

/// What the figures contain.
pub(super) const CONTENTS: &str = "The rms position error is the root mean square distance between where the robot \
    is and where its file says it is, over the region that was measured. Its interval has a confidence of 95 %: it \
    takes the poses as a random sample of the region, and comes from the chi-square distribution with the effective \
    degrees of freedom. The interval of the largest error holds at the measured poses. The figures contain the \
    robot's geometry, its bearings and its joints as they were during the measurement. They do not contain errors \
    that the instrument has in all readings, such as that of its scale, nor other temperatures, loads and speeds.";

/// Anything doubtful, if there is anything.
pub(super) fn doubts(found: &Validation) -> Option<Part> {
    let number = count(found.warnings.len(), "doubt");
    (!found.warnings.is_empty())
        .then(|| Part::Doubts(format!("Validated, with {number}:"), found.warnings.clone()))
}

/// The verdict as it stands out.
pub(super) fn verdict_part(found: &Validation) -> Part {
    match found.verdict {
        Verdict::Pass => Part::Good(verdict(found)),
        Verdict::Undecided | Verdict::Fail => Part::Doubts(verdict(found), Vec::new()),
    }
}

/// Figures and what they are.
pub(super) fn section(found: &Validation) -> Section {
    Section::new("")
        .table(figures(found))
        .text(measured(found))
        .text(region(found))
}

/// The figures of a column have the same decimals.
fn fixed(value: f64) -> String {
    format!("{value:.4}")
}
