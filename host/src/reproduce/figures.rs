//! The paper's figures, and those that it lacks.

mod band;
mod basins;

use super::{Reproduction, boundary};
use crate::campaign::{CaseColumns, CaseSummary, Quantiles};
use crate::geometry::range::range;
use crate::render::named_figure::NamedFigure;
use crate::render::plot::{Axis, Colour, Figure, Shape};
use band::{Band, Points, with_band};
use basins::{basin, one_start};

/// How a case is calibrated, and how it is drawn.
struct Way {
    name: &'static str,
    weights: bool,
    prior: bool,
    planned: bool,
    colour: Colour,
}

/// By which of weights, prior and planned poses are used.
const fn way(name: &'static str, [weights, prior, planned]: [bool; 3], colour: Colour) -> Way {
    Way {
        name,
        weights,
        prior,
        planned,
        colour,
    }
}

const WAYS: [Way; 4] = [
    way("least squares", [false; 3], Colour::Vermilion),
    way("noise stated", [true, false, false], Colour::Green),
    way(
        "noise and tolerance stated",
        [true, true, false],
        Colour::Blue,
    ),
    way("and planned poses", [true; 3], Colour::Purple),
];

/// All of them, in the order of the report.
pub fn figures(reproduction: &Reproduction) -> Vec<NamedFigure> {
    let fkm = reproduction.cases("fkm-noise");
    let ikm = reproduction.cases("ikm-start-error");
    let fig4 = reproduction.cases("number-of-poses");
    let basins = reproduction.cases("basins");
    let of_case = "Bars: from the 25 % to the 75 % quantile of the robots; dots: the median. 100 % is a \
                   parameter that was found exactly, 0 % one that is as wrong as before; bars that go \
                   further left are cut off.";
    let errors = "Position error over 100 poses that were not measured, rms of each robot. Lines: the \
                  median robot; bands: 5 % to 95 % of the robots.";
    let mut figures = vec![
        NamedFigure::new(
            "fig2a",
            parameter_gains(fkm, "fkm"),
            format!(
                "FKM method, 60 poses, start error 0.1 mm/0.1°, noise 1 µm and 0.01°: the gain of each \
                 parameter by itself. {of_case}"
            ),
        ),
        NamedFigure::new(
            "fig2b",
            position_errors(fkm, "fkm"),
            format!("FKM method, start error 0.1 mm/0.1°, noise 1 µm and 0.01°. {errors}"),
        ),
        NamedFigure::new(
            "fig3a",
            parameter_gains(ikm, "ikm"),
            format!(
                "IKM method, 60 poses, start error 1 mm/1°, noise 1 µm and 0.01°: the gain of each \
                 parameter by itself. {of_case}"
            ),
        ),
        NamedFigure::new(
            "fig3b",
            position_errors(ikm, "ikm"),
            format!("IKM method, start error 1 mm/1°, noise 1 µm and 0.01°. {errors}"),
        ),
        NamedFigure::new(
            "fig4",
            number_of_poses(fig4, 0.01),
            "IKM method, start error 0.1 mm/0.1°, noise 1 µm and 0.01°: the gain goes on growing past 50 \
             poses (dashed). Lines: the median robot; bands: 5 % to 95 %.",
        ),
        NamedFigure::new(
            "fig4-exact-joints",
            number_of_poses(fig4, 0.0),
            "The same with exact joint angles.",
        ),
        NamedFigure::new(
            "gain-fkm",
            gains(reproduction, "fkm-noise", "fkm"),
            "FKM method, start error 0.1 mm/0.1°, noise 1 µm and 0.01°, beside the paper.",
        ),
        NamedFigure::new(
            "gain-ikm",
            gains(reproduction, "ikm-start-error", "ikm"),
            "IKM method, start error 1 mm/1°, noise 1 µm and 0.01°, beside the paper's row \"1 mm and \
             0.01°\".",
        ),
        NamedFigure::new(
            "basins-8",
            basin(basins, 8),
            "8 random poses: eight equations in eight unknowns have several solutions, and from far away \
             another one than the true robot may be nearer. Bands: 95 % confidence of the share.",
        ),
        NamedFigure::new(
            "basins-20",
            basin(basins, 20),
            "20 random poses, all starts that the program tries. Lines that coincide cover each other.",
        ),
        NamedFigure::new(
            "basins-20-one-start",
            one_start(basins, 20),
            "20 random poses, the iteration from the nominal robot alone: what one start is worth, with \
             Levenberg–Marquardt and with full Gauss–Newton steps.",
        ),
    ];
    figures.extend(boundary::figures(&reproduction.boundary));
    figures
}

#[allow(clippy::cast_precision_loss)] // counts of poses
const fn count(poses: usize) -> f64 {
    poses as f64
}

fn is_way(case: &CaseColumns, method: &str, way: &Way) -> bool {
    case.method == method
        && case.solver == "lm"
        && case.weights == way.weights
        && case.prior == way.prior
        && case.planned == way.planned
}

/// Every parameter's gain with the most poses.
fn parameter_gains(cases: &[CaseSummary], method: &str) -> Figure {
    let most = cases.iter().map(|summary| summary.case.poses).max();
    let of = |way: &Way| {
        cases
            .iter()
            .find(|summary| is_way(&summary.case, method, way) && Some(summary.case.poses) == most)
            .map_or(&[][..], |summary| &summary.parameter_gains)
    };
    let lowest = WAYS
        .iter()
        .flat_map(of)
        .map(|gain| gain.gain_percent.p25)
        .fold(0.0, f64::min);
    // A round number below all bars, and not below −100.
    let low = ((lowest / 50.0).floor() * 50.0).max(-100.0);
    let names = of(&WAYS[0])
        .iter()
        .map(|gain| format!("{} {}", gain.arm, gain.parameter))
        .collect();
    let mut figure = Figure::new(
        Axis::linear("gain of the parameter, %", low, 100.0),
        Axis::named("", names),
    )
    .sized(800, 760)
    .with(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(0.0, -0.5), (0.0, 23.5)]),
    );
    for (way, offset) in [&WAYS[0], &WAYS[2], &WAYS[3]]
        .into_iter()
        .zip([-0.22, 0.0, 0.22])
    {
        let rows = || {
            of(way)
                .iter()
                .zip(0..)
                .map(move |(gain, row)| (gain, f64::from(row) + offset))
        };
        let cut = |gain: f64| gain.max(low);
        let bars = rows().map(|(gain, row)| {
            let Quantiles { p25, p75, .. } = gain.gain_percent;
            [(cut(p25), row), (cut(p75), row)]
        });
        let dots = rows().map(|(gain, row)| (gain.gain_percent.median, row));
        figure = figure
            .with("", way.colour, Shape::Segments(bars.collect()))
            .with(way.name, way.colour, Shape::Points(dots.collect()));
    }
    figure
}

/// Median and 5 % to 95 % of a quantity against the number of poses.
fn against_poses<'a>(
    cases: impl Iterator<Item = &'a CaseSummary>,
    quantity: impl Fn(&CaseSummary) -> Option<Quantiles>,
) -> (Points, Band) {
    cases
        .filter_map(|summary| {
            let of = quantity(summary)?;
            let poses = count(summary.case.poses);
            Some(((poses, of.median), (poses, of.p05, of.p95)))
        })
        .unzip()
}

fn position_errors(cases: &[CaseSummary], method: &str) -> Figure {
    let of = |way: &'static Way| {
        cases
            .iter()
            .filter(move |summary| is_way(&summary.case, method, way))
    };
    let before = against_poses(of(&WAYS[2]), |summary| summary.error_before_mm);
    let mut series = vec![("before", Colour::Grey, before)];
    for way in &WAYS {
        let after = against_poses(of(way), |summary| summary.error_after_mm);
        series.push((way.name, way.colour, after));
    }
    let ends = series.iter().flat_map(|(.., (_, band))| band);
    let (low, high) = range(ends.flat_map(|&(_, from, to)| [from, to]));
    let figure = Figure::new(
        Axis::linear("poses", 5.0, 63.0),
        Axis::logarithmic("position error, mm", low / 1.2, high * 1.2),
    );
    series
        .into_iter()
        .fold(figure, |figure, (name, colour, lines)| {
            with_band(figure, name, colour, lines)
        })
}

/// Fig. 4.
fn number_of_poses(cases: &[CaseSummary], noise_joint_deg: f64) -> Figure {
    let noise = |summary: &&CaseSummary| {
        summary
            .case
            .noise_joint_deg
            .total_cmp(&noise_joint_deg)
            .is_eq()
    };
    let low = if noise_joint_deg > 0.0 { -150.0 } else { 0.0 };
    let mut figure = Figure::new(
        Axis::linear("poses", 4.0, 104.0),
        Axis::linear("gain, %", low, 100.0),
    )
    .with(
        "50 poses: the paper sees no improvement beyond",
        Colour::Ink,
        Shape::Dashed(vec![(50.0, low), (50.0, 100.0)]),
    );
    for way in &WAYS {
        let of_way = cases
            .iter()
            .filter(noise)
            .filter(|summary| is_way(&summary.case, "ikm", way));
        let (line, band) = against_poses(of_way, |summary| summary.gain_percent);
        let inside = |value: f64| value.max(low);
        let line = line.into_iter().filter(|&(_, gain)| gain >= low).collect();
        let band = band
            .into_iter()
            .filter(|&(.., high)| high >= low)
            .map(|(poses, from, to)| (poses, inside(from), to));
        figure = with_band(figure, way.name, way.colour, (line, band.collect()));
    }
    figure
}

/// Gains beside the paper's.
fn gains(reproduction: &Reproduction, experiment: &str, method: &str) -> Figure {
    let cases = reproduction.cases(experiment);
    let low = -150.0;
    let mut figure = Figure::new(
        Axis::linear("poses", 5.0, 63.0),
        Axis::linear("gain, %", low, 100.0),
    )
    .with(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(5.0, 0.0), (63.0, 0.0)]),
    );
    for way in &WAYS {
        let of_way = cases
            .iter()
            .filter(|summary| is_way(&summary.case, method, way));
        let (line, band) = against_poses(of_way, |summary| summary.gain_percent);
        let line = line.into_iter().filter(|&(_, gain)| gain >= low).collect();
        let band = band
            .into_iter()
            .map(|(poses, from, to)| (poses, from.max(low), to.max(low)));
        figure = with_band(figure, way.name, way.colour, (line, band.collect()));
    }
    let paper = reproduction
        .experiments
        .iter()
        .filter(|results| results.experiment.name == experiment)
        .flat_map(|results| results.experiment.paper)
        .filter_map(|value| Some((count(value.poses?), value.gain_percent?)));
    figure.with("the paper", Colour::Ink, Shape::Diamonds(paper.collect()))
}
