//! The check for people at a terminal.

use crate::files::kinematics::to_fill_in;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::CalibrationMethod;
use crate::planning::observability::{Block, Leverage, Observability};
use crate::planning::poses::{Expectation, NextPoses};
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::terminal;
use crate::report::plan::table::with_assumptions;
use crate::text::joint;
use crate::text::numbers::{significant, small};
use crate::text::words::{count, in_file_units, in_lines};
use delta_cal::robot::Drive;

/// Samples listed; of more, those with the most leverage.
const LISTED: usize = 30;
/// A sample beyond this leverage is hardly checked by any other.
const UNCHECKED: f64 = 0.9;

/// The whole report.
pub fn render(
    robot: &RobotFile,
    samples: &SamplesFile,
    unmeasured: &[u64],
    method: CalibrationMethod,
    observability: &Observability,
    next: &NextPoses,
) -> String {
    let summary = Section::new("").text(format!(
        "{} of {} for {}, {} method",
        count(samples.rows.len(), "sample"),
        samples.name,
        robot.name,
        method.title(),
    ));
    terminal::text([
        with_assumptions(summary, robot.robot.drive(), &observability.assumptions),
        not_measured(
            Section::new("").text(verdict(observability, samples, unmeasured)),
            unmeasured,
        ),
        singular_values(&observability.blocks),
        indices(&observability.blocks),
        weakest(observability),
        leverages(
            robot.robot.drive(),
            &observability.leverages,
            "parameters a sample decides",
        ),
        additions(robot.robot.drive(), next),
    ])
}

/// In one sentence.
pub fn verdict(observability: &Observability, samples: &SamplesFile, unmeasured: &[u64]) -> String {
    let what = match unmeasured.len() {
        0 => "These samples",
        lines if lines == samples.rows.len() => "Once measured, these poses",
        _ => "Once all are measured, these samples",
    };
    let Some(block) = observability.blocks.iter().find(|block| !block.determined) else {
        return format!("{what} determine every parameter.");
    };
    let (arm, parameter, sigma) = block.worst;
    let rank = block.singular_values.len();
    if block.rank < rank {
        format!(
            "{what} do not determine {}: they leave {} of {rank} combinations of its \
             parameters open",
            name(block),
            rank - block.rank
        )
    } else {
        format!(
            "{what} do not determine {}: {parameter} of {arm} is known only to {} (one \
             sigma)",
            name(block),
            in_file_units(parameter, sigma)
        )
    }
}

/// Which rows hold nothing that was measured.
pub(super) fn not_measured(section: Section, unmeasured: &[u64]) -> Section {
    if unmeasured.is_empty() {
        return section;
    }
    let rows = count(unmeasured.len(), "row");
    section.text(format!(
        "Not measured yet: {rows}, in {}.",
        in_lines(unmeasured)
    ))
}

fn name(block: &Block) -> String {
    block
        .arm
        .map_or_else(|| "the robot".to_owned(), |arm| arm.to_string())
}

/// A title, and a column for each block.
fn of_blocks(title: &str, blocks: &[Block]) -> Table {
    let names = blocks.iter().map(name);
    Table::new([title.to_owned()].into_iter().chain(names))
}

fn singular_values(blocks: &[Block]) -> Section {
    let most = blocks.iter().map(|block| block.singular_values.len()).max();
    let table = of_blocks("Singular values, 1/mm", blocks);
    let table = (0..most.unwrap_or(0)).fold(table, |table, index| {
        let values = blocks.iter().map(|block| {
            let value = block.singular_values.get(index).copied();
            significant(value.unwrap_or(0.0), 4)
        });
        table.row((index + 1).to_string(), values)
    });
    Section::new("").table(table).note(
        "These are of the Jacobian with rows in sigmas of the noise and columns in mm, angles times \
         the upper arm; one over a singular value is one sigma of that combination of parameters.",
    )
}

/// What a line of the table shows of a block.
type Figure = fn(&Block) -> f64;

fn indices(blocks: &[Block]) -> Section {
    let figures: [(_, Figure); 5] = [
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
    let table = of_blocks("Observability (larger is better)", blocks);
    Section::new("").table(figures.into_iter().fold(table, |table, (title, of)| {
        table.row(title, blocks.iter().map(|block| significant(of(block), 4)))
    }))
}

fn weakest(observability: &Observability) -> Section {
    let section = Section::new("Determined least, by these samples alone");
    observability.blocks.iter().fold(section, |section, block| {
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
        let of = match block.arm {
            Some(arm) => format!("{arm}: "),
            None => String::new(),
        };
        section.text(format!("{of}{together}{}; {known}", weakest.in_words()))
    })
}

/// `what`: that the totals count.
pub(super) fn leverages(drive: Drive, leverages: &[Leverage], what: &str) -> Section {
    let mut listed: Vec<_> = leverages.iter().collect();
    let title = if listed.len() > LISTED {
        listed.sort_by(|a, b| b.total.total_cmp(&a.total));
        listed.truncate(LISTED);
        format!("Leverage: the {LISTED} rows with the largest")
    } else {
        "Leverage of each row".to_owned()
    };
    let of_joint = |joint: usize| {
        move |leverage: &&Leverage| format!("{:.3}", joint::in_file(drive, leverage.joints[joint]))
    };
    let [q1, q2, q3] = joint::names(drive);
    let table = Table::of(listed)
        .column("line", |leverage| leverage.line)
        .column(q1, of_joint(0))
        .column(q2, of_joint(1))
        .column(q3, of_joint(2))
        .column("total", |leverage| format!("{:.2}", leverage.total))
        .column("largest", |leverage| format!("{:.2}", leverage.largest))
        .column("", |leverage| {
            if leverage.largest > UNCHECKED {
                "hardly checked by the others"
            } else {
                ""
            }
        })
        .table();
    let total: f64 = leverages.iter().map(|leverage| leverage.total).sum();
    Section::new(title).table(table).note(format!(
        "total: how many of the {total:.0} {what}; largest: the same of one of its residuals"
    ))
}

fn additions(drive: Drive, next: &NextPoses) -> Section {
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
        let section = Section::new("").text(format!("{now}."));
        return match &next.obstacle {
            Some(obstacle) => section.text(format!(
                "No pose can be proposed in addition: {obstacle}. To have some proposed, {}.",
                obstacle.remedy()
            )),
            None => section,
        };
    }
    let csv = to_fill_in(drive, &next.poses);
    let section = Section::new("Poses that would help most, in this order");
    let section = csv.lines().fold(section, Section::text);
    section.text(format!("{now}, {} with them.", known(&next.after)))
}
