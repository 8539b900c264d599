//! The paper's figures, and those that it lacks.

use super::Reproduction;
use crate::campaign::{CaseColumns, CaseSummary, Quantiles};
use crate::plot::{Axis, Colour, Figure, Series, Shape};

/// A figure, the name of its files, and what is to be seen in it.
#[derive(Debug, Clone)]
pub struct NamedFigure {
    /// Such as `fig2a`.
    pub name: &'static str,
    /// What is drawn.
    pub figure: Figure,
    /// One or two sentences.
    pub caption: String,
}

/// How a case is calibrated, and how it is drawn.
struct Way {
    name: &'static str,
    weights: bool,
    prior: bool,
    colour: Colour,
}

const WAYS: [Way; 3] = [
    Way {
        name: "least squares",
        weights: false,
        prior: false,
        colour: Colour::Vermilion,
    },
    Way {
        name: "noise stated",
        weights: true,
        prior: false,
        colour: Colour::Green,
    },
    Way {
        name: "noise and tolerance stated",
        weights: true,
        prior: true,
        colour: Colour::Blue,
    },
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
    vec![
        NamedFigure {
            name: "fig2a",
            figure: parameter_gains(fkm, "fkm"),
            caption: format!(
                "FKM method, 60 poses, start error 0.1 mm/0.1°, noise 1 µm and 0.01°: the gain of each \
                 parameter by itself. {of_case}"
            ),
        },
        NamedFigure {
            name: "fig2b",
            figure: position_errors(fkm, "fkm"),
            caption: format!("FKM method, start error 0.1 mm/0.1°, noise 1 µm and 0.01°. {errors}"),
        },
        NamedFigure {
            name: "fig3a",
            figure: parameter_gains(ikm, "ikm"),
            caption: format!(
                "IKM method, 60 poses, start error 1 mm/1°, noise 1 µm and 0.01°: the gain of each \
                 parameter by itself. {of_case}"
            ),
        },
        NamedFigure {
            name: "fig3b",
            figure: position_errors(ikm, "ikm"),
            caption: format!("IKM method, start error 1 mm/1°, noise 1 µm and 0.01°. {errors}"),
        },
        NamedFigure {
            name: "fig4",
            figure: number_of_poses(fig4, 0.01),
            caption: "IKM method, start error 0.1 mm/0.1°, noise 1 µm and 0.01°: the gain goes on \
                      growing past 50 poses (dashed). Lines: the median robot; bands: 5 % to 95 %."
                .into(),
        },
        NamedFigure {
            name: "fig4-exact-joints",
            figure: number_of_poses(fig4, 0.0),
            caption: "The same with exact joint angles.".into(),
        },
        NamedFigure {
            name: "gain-fkm",
            figure: gains(reproduction, "fkm-noise", "fkm"),
            caption: "FKM method, start error 0.1 mm/0.1°, noise 1 µm and 0.01°, beside the paper."
                .into(),
        },
        NamedFigure {
            name: "gain-ikm",
            figure: gains(reproduction, "ikm-start-error", "ikm"),
            caption:
                "IKM method, start error 1 mm/1°, noise 1 µm and 0.01°, beside the paper's row \
                      \"1 mm and 0.01°\"."
                    .into(),
        },
        NamedFigure {
            name: "basins-8",
            figure: basin(basins, 8),
            caption:
                "8 random poses: eight equations in eight unknowns have several solutions, and \
                      from far away another one than the true robot may be nearer. Bands: 95 % \
                      confidence of the share."
                    .into(),
        },
        NamedFigure {
            name: "basins-20",
            figure: basin(basins, 20),
            caption: "20 random poses, all starts that the program tries. Lines that coincide cover each \
                      other."
                .into(),
        },
        NamedFigure {
            name: "basins-20-one-start",
            figure: one_start(basins, 20),
            caption:
                "20 random poses, the iteration from the nominal robot alone: what one start is \
                      worth, with Levenberg–Marquardt and with full Gauss–Newton steps."
                    .into(),
        },
    ]
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
        && !case.planned
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
    .sized(800, 620)
    .with(Series::new(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(0.0, -0.5), (0.0, 23.5)]),
    ));
    for (way, offset) in [&WAYS[0], &WAYS[2]].into_iter().zip([-0.18, 0.18]) {
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
            .with(Series::new("", way.colour, Shape::Segments(bars.collect())))
            .with(Series::new(
                way.name,
                way.colour,
                Shape::Points(dots.collect()),
            ));
    }
    figure
}

type Points = Vec<(f64, f64)>;
type Band = Vec<(f64, f64, f64)>;

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

fn with_band(figure: Figure, name: &str, colour: Colour, (line, band): (Points, Band)) -> Figure {
    figure
        .with(Series::new("", colour, Shape::Band(band)))
        .with(Series::new("", colour, Shape::Points(line.clone())))
        .with(Series::new(name, colour, Shape::Line(line)))
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
    let (low, high) = ends.fold((f64::INFINITY, 0_f64), |(low, high), &(_, from, to)| {
        (low.min(from), high.max(to))
    });
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
    .with(Series::new(
        "50 poses: the paper sees no improvement beyond",
        Colour::Ink,
        Shape::Dashed(vec![(50.0, low), (50.0, 100.0)]),
    ));
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
    .with(Series::new(
        "",
        Colour::Ink,
        Shape::Dashed(vec![(5.0, 0.0), (63.0, 0.0)]),
    ));
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
    figure.with(Series::new(
        "the paper",
        Colour::Ink,
        Shape::Diamonds(paper.collect()),
    ))
}

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
        case.poses == poses && case.method == method && case.solver == solver
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

fn basin(cases: &[CaseSummary], poses: usize) -> Figure {
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

fn one_start(cases: &[CaseSummary], poses: usize) -> Figure {
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
