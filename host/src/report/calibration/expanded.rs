//! The expanded uncertainty, what it contains, and whether it is within a limit.

use crate::accuracy::coverage::{Acceptance, CoverageFactor, ExpandedUncertainty};
use crate::render::page;
use crate::render::section::{Part, Section};
use crate::text::numbers::small;
use delta_cal::Robot;
use maud::{Markup, html};
use serde_json::{Value, json};

/// What is meant by the figure of a robot with so many parameters, and what is not in it.
fn contents(parameters: usize) -> String {
    format!("{CONTAINED}{parameters} parameters cannot hold and no residual shows.")
}

const CONTAINED: &str = "The expanded uncertainty is the standard uncertainty (one standard deviation) times the \
    coverage factor k, for a coverage of 95 % or more (GUM, ISO/IEC Guide 98-3). It contains the noise of the \
    measurements, what the samples leave undetermined within the stated [tolerance], and the size of the errors \
    that were found in the residuals. It does not contain errors of the instrument that are the same in all \
    readings, as that of its scale, nor the effect of temperature, load and speed, nor errors that ";

/// "k = 2", or where another factor is from.
pub(super) fn factor(coverage: &CoverageFactor) -> String {
    match coverage.degrees_of_freedom {
        None => format!("k = {:.0}", coverage.factor),
        Some(freedom) => format!(
            "k = {:.2}, from Student's distribution with {freedom:.0} degrees of freedom, because the noise was \
             estimated",
            coverage.factor
        ),
    }
}

/// The expanded uncertainty in one sentence; `of` is "the position" or "relative positions".
pub(super) fn sentence(expanded: Option<&ExpandedUncertainty>, of: &str) -> String {
    match expanded {
        None => format!("Expanded uncertainty of {of}: unknown, too few samples are left over"),
        Some(expanded) => format!(
            "Expanded uncertainty of {of}: {} mm rms over the workspace, {} mm at the worst place ({})",
            small(expanded.rms),
            small(expanded.worst),
            factor(&expanded.coverage)
        ),
    }
}

/// For a page.
pub(super) fn section(
    expanded: Option<&ExpandedUncertainty>,
    of: &str,
    robot: &Robot<f64>,
) -> Section {
    let parameters = 3 * robot.drive().parameters().len();
    Section::new("Expanded uncertainty")
        .text(format!("{}.", sentence(expanded, of)))
        .note(contents(parameters))
}

/// Whether a limit is met, in one sentence.
pub(super) fn verdict(acceptance: &Acceptance) -> Part {
    let of = if acceptance.relative {
        "expanded uncertainty of relative positions"
    } else {
        "expanded uncertainty of the position"
    };
    let limit = acceptance.limit;
    let Some(expanded) = acceptance.expanded else {
        let text = format!(
            "Fail: the {of} is not known, so that it cannot be within the limit of {limit} mm. Measure more \
             poses, or state the [noise]."
        );
        return Part::Doubts(text, Vec::new());
    };
    let expanded = small(expanded);
    if acceptance.passed() {
        Part::Good(format!(
            "Pass: the {of}, {expanded} mm rms over the workspace, is within the limit of {limit} mm."
        ))
    } else {
        let text = format!(
            "Fail: the {of}, {expanded} mm rms over the workspace, is above the limit of {limit} mm."
        );
        Part::Doubts(text, Vec::new())
    }
}

/// The same for a page, if a limit was asked for.
pub(super) fn page_verdict(acceptance: Option<&Acceptance>) -> Markup {
    html! { @if let Some(acceptance) = acceptance { (verdict(acceptance)) } }
}

/// For a terminal, if a limit was asked for.
pub(super) fn limit(acceptance: Option<&Acceptance>) -> Option<Section> {
    acceptance.map(|acceptance| Section::new("").part(verdict(acceptance)))
}

/// For programs; `null` if it is not known.
pub(super) fn json(expanded: Option<&ExpandedUncertainty>, relative: bool) -> Value {
    let Some(expanded) = expanded else {
        return Value::Null;
    };
    json!({
        // `absolute`, in the frame of the measurement, or `intrinsic`, of relative positions.
        "of": if relative { "intrinsic" } else { "absolute" },
        "coverage_factor": expanded.coverage.factor,
        // Of the estimated noise; `null` if the noise is stated.
        "degrees_of_freedom": expanded.coverage.degrees_of_freedom,
        // Of `expected_error` times the coverage factor.
        "rms_mm": expanded.rms,
        "worst_mm": expanded.worst,
    })
}

/// For programs; `null` if no limit was asked for.
pub(super) fn acceptance_json(acceptance: Option<&Acceptance>) -> Value {
    let Some(acceptance) = acceptance else {
        return Value::Null;
    };
    json!({
        "limit_mm": acceptance.limit,
        // What was compared: `rms_mm` of `expanded_uncertainty`; `null` if it is not known.
        "expanded_mm": acceptance.expanded,
        "passed": acceptance.passed(),
    })
}

/// What the parameters are, with the drawing of an arm.
pub(super) fn glossary() -> Section {
    let terms = [
        (
            "Dx, Dy, Dz",
            "a point on the motor's axis, in the robot's frame; mm",
        ),
        (
            "θ (theta)",
            "the azimuth of the arm's plane, seen from above; degrees",
        ),
        (
            "α (alpha)",
            "the tilt of the motor's axis out of the base plane; degrees",
        ),
        (
            "La_x, La_y",
            "the upper arm at joint angle 0, along the arm and across it: its length, and the zero of the joint; mm",
        ),
        ("Lb", "the length of the forearm; mm"),
        (
            "X",
            "the platform point, which is measured; q is the joint angle, 0 with the upper arm level, positive \
             downwards",
        ),
        (
            "sigma, σ",
            "one standard deviation: the standard uncertainty",
        ),
        ("rms", "the root of the mean of the squares"),
    ];
    Section::new("What the parameters mean").in_page(html! {
        (page::drawing())
        dl.terms { @for (name, meaning) in terms { dt { (name) } dd { (meaning) } } }
    })
}
