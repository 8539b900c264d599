//! The plan for people: plain lines of at most 100 columns.

use crate::poses::{
    Assumptions, Criterion, Expectation, MANY, PlanRequest, PosePlan, PosesNeeded, RANDOM_SETS,
};
use crate::position_uncertainty::PositionSigma;
use crate::report::table::{heading, small};
use crate::units::degrees;
use delta_cal::{Parameter, ParameterKind};
use std::fmt::Write;

/// The whole report, without the poses themselves.
pub fn render(request: &PlanRequest<'_>, plan: &PosePlan, needed: Option<&PosesNeeded>) -> String {
    let mut text = String::new();
    summary(&mut text, request, plan);
    positions(&mut text, plan);
    parameters(&mut text, &plan.planned, &plan.random);
    if let Some(needed) = needed {
        accuracy(&mut text, request, needed);
    }
    text
}

/// What was planned for, in a line or two.
pub(in crate::report) fn assumptions(assumptions: &Assumptions) -> String {
    let noise = &assumptions.noise;
    let stated = if assumptions.noise_stated {
        "stated"
    } else {
        "assumed: the robot file states no [noise]"
    };
    let tolerance = assumptions.tolerance.as_ref().map_or_else(
        || "none stated".to_owned(),
        |tolerance| {
            format!(
                "{} mm, {}° (stated)",
                tolerance.of(Parameter::Lb),
                degrees(tolerance.of(Parameter::Theta))
            )
        },
    );
    format!(
        "Noise: {} mm, {}° ({stated})\nTolerance: {tolerance}",
        noise.position(),
        degrees(noise.joint()),
    )
}

fn summary(text: &mut String, request: &PlanRequest<'_>, plan: &PosePlan) {
    let criterion = match request.criterion {
        Criterion::A => "A-optimal: least mean square of the parameter error",
        Criterion::D => "D-optimal: least volume of the confidence region",
    };
    let _ = writeln!(
        text,
        "{} poses for {}, {} method\n{criterion}",
        plan.poses.len(),
        request.robot.name,
        request.method.name().to_uppercase(),
    );
    let _ = writeln!(text, "{}", assumptions(&plan.assumptions));
    if let Some(region) = &request.region {
        let _ = writeln!(text, "Within: {region} mm");
    }
    let margin = &plan.margin;
    let forearms = match request.robot.forearm_limit {
        Some(_) => format!(
            " {:.1}° from the forearms' limit,",
            degrees(margin.forearms)
        ),
        None => String::new(),
    };
    let _ = writeln!(
        text,
        "Margin, because the real robot differs from the nominal one: {:.1}° from the joints' limits,{forearms}\n\
         forearms {:.1}° from their upper arms' lines",
        degrees(margin.joints),
        degrees(margin.serial)
    );
    let _ = writeln!(
        text,
        "Travel: {:.0}°, of the joint that moves furthest in each step ({:.0}° before the poses \
         were sorted)\n",
        degrees(plan.travel),
        degrees(plan.travel_unordered)
    );
}

fn positions(text: &mut String, plan: &PosePlan) {
    let columns = format!("{:>12}{:>12}", "planned", "random");
    heading(
        text,
        &format!(
            "{:<52}{columns}",
            "Expected, one sigma after a calibration, mm"
        ),
    );
    let mut line = |name: &str, planned: f64, random: f64| {
        let _ = writeln!(
            text,
            "{name:<52}{:>12}{:>12}",
            small(planned),
            small(random)
        );
    };
    let mut position = |place: &str, planned: &PositionSigma, random: &PositionSigma| {
        line(
            &format!("Position over the {place}, rms"),
            planned.rms,
            random.rms,
        );
        // Not −0.
        let at = planned.max_at.map(|coordinate| coordinate.round() + 0.0);
        line(
            &format!("  worst (at {}, {}, {})", at.x, at.y, at.z),
            planned.max,
            random.max,
        );
    };
    position("workspace", &plan.planned.workspace, &plan.random.workspace);
    if let (Some(planned), Some(random)) = (&plan.planned.region, &plan.random.region) {
        position("region", planned, random);
    }
    line(
        "All parameters, angles times the upper arm",
        plan.planned.bound,
        plan.random.bound,
    );
    let _ = writeln!(
        text,
        "random: the median of {RANDOM_SETS} sets of {} random poses",
        plan.poses.len()
    );
    if !plan.determined_alone {
        text.push_str(
            "These poses do not determine every parameter by themselves; the [tolerance] decides \
             what they\nleave open. Allow a larger region, wider limits or more poses.\n",
        );
    }
    text.push('\n');
}

fn parameters(text: &mut String, planned: &Expectation, random: &Expectation) {
    heading(
        text,
        &format!(
            "{:<14}{:>33}   {:>33}",
            "", "planned: arm 1      arm 2      arm 3", "random: arm 1      arm 2      arm 3"
        ),
    );
    for parameter in Parameter::ALL {
        let (unit, factor) = match parameter.kind() {
            ParameterKind::Length => ("mm", 1.0),
            ParameterKind::Angle => ("deg", 1f64.to_degrees()),
        };
        let _ = write!(text, "{:<8}{unit:<6}", parameter.symbol());
        for (gap, expectation) in [("   ", planned), ("   ", random)] {
            for arm in &expectation.parameters {
                let _ = write!(text, "{:>11}", small(factor * arm[parameter.index()]));
            }
            text.push_str(gap);
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
}

fn accuracy(text: &mut String, request: &PlanRequest<'_>, needed: &PosesNeeded) {
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
    let _ = writeln!(
        text,
        "\nA position known to {} mm (one sigma) takes {} as the rms over the {place},\n{} everywhere \
         in it.",
        needed.accuracy,
        poses(needed.rms),
        poses(needed.everywhere),
    );
}
