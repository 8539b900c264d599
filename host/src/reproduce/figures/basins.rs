//! From how far the methods converge.

use super::band::{Band, Points, with_band};
use crate::campaign::CaseSummary;
use crate::render::plot::{Axis, Colour, Figure};

fn basin_axes() -> Figure {
    Figure::new(
        Axis::logarithmic(
            "start error, mm (and the angle that moves the elbow as far)",
            0.09,
            110.0,
        ),
        Axis::linear("robots returned to 1e-6 mm, %", 0.0, 102.0),
    )
}

/// The share of returned robots, with its confidence.
fn returned<'a>(
    cases: &'a [CaseSummary],
    poses: usize,
    (method, solver): (&'a str, &'a str),
    count_of: impl Fn(&CaseSummary) -> u64 + 'a,
) -> (Points, Band) {
    let of = cases.iter().filter(move |summary| {
        let case = &summary.case;
        case.poses == poses && case.method == method && case.solver == solver && !case.planned
    });
    of.map(|summary| {
        let (share, low, high) = wilson(count_of(summary), summary.robots);
        let start = summary.case.start_error_mm;
        ((start, share), (start, low, high))
    })
    .unzip()
}

/// A share in percent and its 95 % confidence interval (Wilson 1927).
#[allow(clippy::cast_precision_loss)] // counts of robots
fn wilson(successes: u64, trials: u64) -> (f64, f64, f64) {
    let (n, z) = (trials as f64, 1.96);
    let share = successes as f64 / n;
    let centre = share + z * z / (2.0 * n);
    let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    let whole = 1.0 + z * z / n;
    (
        100.0 * share,
        100.0 * ((centre - half) / whole).max(0.0),
        100.0 * ((centre + half) / whole).min(1.0),
    )
}

/// All starts that the program tries.
pub(super) fn basin(cases: &[CaseSummary], poses: usize) -> Figure {
    let lines = [
        ("FKM", "fkm", Colour::Vermilion),
        ("IKM from the nominal robot", "ikm", Colour::Blue),
        (
            "IKM without a guess (12 poses or more)",
            "ikm-no-guess",
            Colour::Green,
        ),
    ];
    lines
        .into_iter()
        .filter(|(_, method, _)| poses >= 12 || *method != "ikm-no-guess")
        .fold(basin_axes(), |figure, (name, method, colour)| {
            let lines = returned(cases, poses, (method, "lm"), |summary| summary.returned);
            with_band(figure, name, colour, lines)
        })
}

/// The nominal start alone.
pub(super) fn one_start(cases: &[CaseSummary], poses: usize) -> Figure {
    let lines = [
        ("FKM, Levenberg–Marquardt", ("fkm", "lm"), Colour::Vermilion),
        ("FKM, Gauss–Newton", ("fkm", "gn"), Colour::Orange),
        ("IKM, Levenberg–Marquardt", ("ikm", "lm"), Colour::Blue),
        ("IKM, Gauss–Newton", ("ikm", "gn"), Colour::SkyBlue),
    ];
    lines
        .into_iter()
        .fold(basin_axes(), |figure, (name, way, colour)| {
            let lines = returned(cases, poses, way, |summary| summary.returned_from_nominal);
            with_band(figure, name, colour, lines)
        })
}
