//! The plan for people at a terminal.

use crate::accuracy::position_uncertainty::PositionSigma;
use crate::planning::poses::{
    Assumptions, Criterion, MANY, PlanRequest, PosePlan, PosesNeeded, RANDOM_SETS,
};
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::terminal;
use crate::text::joint;
use crate::text::numbers::small;
use crate::text::tolerance::in_words;
use crate::text::units::{degrees, in_unit, unit};
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;

/// The whole report, without the poses themselves.
pub fn render(request: &PlanRequest<'_>, plan: &PosePlan, needed: Option<&PosesNeeded>) -> String {
    let mut parts = vec![
        summary(request, plan),
        positions(plan),
        parameters(request.robot.robot.drive(), plan),
    ];
    parts.extend(needed.map(|needed| accuracy(request, needed)));
    terminal::text(parts)
}

/// With what was planned for.
pub(in crate::report) fn with_assumptions(
    section: Section,
    drive: Drive,
    assumptions: &Assumptions,
) -> Section {
    let noise = &assumptions.noise;
    let stated = if assumptions.noise_stated {
        "stated"
    } else {
        "assumed: the robot file states no [noise]"
    };
    let tolerance = assumptions.tolerance.as_ref().map_or_else(
        || "none stated".to_owned(),
        |tolerance| format!("{} (stated)", in_words(drive, tolerance)),
    );
    let (position, joint) = (noise.position(), joint::in_file(drive, noise.joint()));
    let mark = joint::mark(drive);
    section
        .text(format!("Noise: {position} mm, {joint}{mark} ({stated})"))
        .text(format!("Tolerance: {tolerance}"))
}

fn summary(request: &PlanRequest<'_>, plan: &PosePlan) -> Section {
    let drive = request.robot.robot.drive();
    let section = Section::new("")
        .text(format!(
            "{} poses for {}, {} method",
            plan.poses.len(),
            request.robot.name,
            request.method.title(),
        ))
        .text(match request.criterion {
            Criterion::A => "A-optimal: least mean square of the parameter error",
            Criterion::D => "D-optimal: least volume of the confidence region",
        });
    let section = with_assumptions(section, drive, &plan.assumptions);
    let section = match &request.region {
        Some(region) => section.text(format!("Within: {region} mm")),
        None => section,
    };
    let margin = &plan.margin;
    let mark = joint::mark(drive);
    let lines = match drive {
        Drive::Rotary => "from their upper arms' lines",
        Drive::Linear => "from square to their towers",
    };
    let forearms = match request.robot.forearm_limit {
        Some(_) => format!(
            " {:.1}° from the forearms' limit,",
            degrees(margin.forearms)
        ),
        None => String::new(),
    };
    section
        .text(format!(
            "Margin, because the real robot differs from the nominal one, at least: {:.1}{mark} from the joints' \
             limits,{forearms} forearms {:.1}° {lines} and {:.1}° from one plane",
            joint::in_file(drive, margin.joints),
            degrees(margin.serial),
            degrees(margin.parallel)
        ))
        .text(format!(
            "Travel: {:.0}{mark}, of the joint that moves furthest in each step ({:.0}{mark} before the poses were sorted)",
            joint::in_file(drive, plan.travel),
            joint::in_file(drive, plan.travel_unordered)
        ))
}

fn positions(plan: &PosePlan) -> Section {
    let title = "Expected, one sigma after a calibration, mm";
    let table = Table::new([title, "planned", "random"]);
    let position = |table: Table, place: &str, planned: &PositionSigma, random: &PositionSigma| {
        // Not −0.
        let at = planned.max_at.map(|coordinate| coordinate.round() + 0.0);
        let worst = format!("  worst (at {}, {}, {})", at.x, at.y, at.z);
        table
            .row(
                format!("Position over the {place}, rms"),
                [planned.rms, random.rms].map(small),
            )
            .row(worst, [planned.max, random.max].map(small))
    };
    let (planned, random) = (&plan.planned, &plan.random);
    let table = position(table, "workspace", &planned.workspace, &random.workspace);
    let table = match (&planned.region, &random.region) {
        (Some(planned), Some(random)) => position(table, "region", planned, random),
        _ => table,
    };
    let table = table.row(
        "All parameters, angles times the upper arm",
        [planned.bound, random.bound].map(small),
    );
    let section = Section::new("").table(table).note(format!(
        "random: the median of {RANDOM_SETS} sets of {} random poses",
        plan.poses.len()
    ));
    if plan.determined_alone {
        return section;
    }
    section.text(
        "These poses do not determine every parameter by themselves: the [tolerance] decides what \
         they leave open. Allow a larger region, wider limits or more poses.",
    )
}

fn parameters(drive: Drive, plan: &PosePlan) -> Section {
    let mut rows = Table::of(drive.parameters().iter().copied())
        .column("", |parameter| parameter.symbol())
        .column("", |parameter| unit(*parameter));
    for (name, expectation) in [("planned", &plan.planned), ("random", &plan.random)] {
        for arm in ArmIndex::ALL {
            let sigmas = &expectation.parameters[arm.index()];
            rows = rows.column(format!("{name}\n{arm}"), |parameter| {
                small(in_unit(*parameter, sigmas[parameter.index()]))
            });
        }
    }
    Section::new("").table(rows.table())
}

fn accuracy(request: &PlanRequest<'_>, needed: &PosesNeeded) -> Section {
    let place = if request.region.is_some() {
        "region"
    } else {
        "workspace"
    };
    let poses = |count: usize| {
        if count > MANY {
            format!("about {count} poses")
        } else {
            format!("{count} poses")
        }
    };
    Section::new("").text(format!(
        "A position known to {} mm (one sigma) takes {} as the rms over the {place}, {} everywhere in \
         it.",
        needed.accuracy,
        poses(needed.rms),
        poses(needed.everywhere),
    ))
}
