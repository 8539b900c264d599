//! The simulations of the paper as campaigns, beside what it found.
//!
//! The paper: T. Bentaleb, J. Iqbal, "On the improvement of calibration accuracy of parallel robots –
//! modeling and optimization", JTAM 58(1), 2020, doi 10.15632/jtam-pl/115863.

use super::plan::{CampaignSolver, Case, Method, Plan};
use super::row::{Row, run};
use super::summary::{CaseSummary, summarize};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// In the order of the paper. Each file says how an ambiguous sentence was read.
const EXPERIMENTS: [(&str, &str); 7] = [
    ("exact", include_str!("../../examples/paper/exact.toml")),
    (
        "fkm-noise",
        include_str!("../../examples/paper/fkm-noise.toml"),
    ),
    (
        "fkm-start-error",
        include_str!("../../examples/paper/fkm-start-error.toml"),
    ),
    (
        "ikm-small-noise",
        include_str!("../../examples/paper/ikm-small-noise.toml"),
    ),
    (
        "ikm-start-error",
        include_str!("../../examples/paper/ikm-start-error.toml"),
    ),
    (
        "ikm-noise",
        include_str!("../../examples/paper/ikm-noise.toml"),
    ),
    (
        "number-of-poses",
        include_str!("../../examples/paper/number-of-poses.toml"),
    ),
];

/// What the paper found.
const FIGURES: &str = include_str!("../../examples/paper/figures.csv");

/// A simulation of the paper and what came of it here.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// As in `results.csv`.
    pub name: &'static str,
    /// Its cases.
    pub cases: Vec<CaseSummary>,
}

/// What the paper found in some case.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Figure {
    case: String,
    method: Method,
    /// Any if not stated.
    start_error_mm: Option<f64>,
    /// Any if not stated.
    poses: Option<usize>,
    gain_percent: Option<f64>,
    seconds: Option<f64>,
    remark: String,
}

/// Runs every simulation. `robots` replaces the robots of each case.
///
/// # Errors
/// None, as long as the built-in campaigns are in order, which a test assures.
pub fn simulate(
    robots: Option<Range<u64>>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Experiment>, InputError> {
    let mut plans = Vec::with_capacity(EXPERIMENTS.len());
    for (name, text) in EXPERIMENTS {
        let input = InputText::new(format!("built-in {name}.toml"), text);
        let none = |name: &str| Err(InputError::new(name, "the paper's robot is built in"));
        let plan = Plan::read(&input, &none)?;
        let robots = robots.clone().unwrap_or(0..plan.robots);
        plans.push((name, plan, robots));
    }
    let of = |plan: &Plan, robots: &Range<u64>| {
        (robots.end - robots.start) * plan.scenarios.len() as u64
    };
    let total = plans.iter().map(|(_, plan, robots)| of(plan, robots)).sum();
    let mut before = 0;
    let mut experiments = Vec::with_capacity(plans.len());
    for (name, plan, robots) in &plans {
        let rows: Vec<Row> = run(plan, robots, &mut |finished, _| {
            progress(before + finished, total);
        })?;
        before += of(plan, robots);
        let cases = summarize(&rows);
        experiments.push(Experiment { name, cases });
    }
    Ok(experiments)
}

/// A row of the paper and the median gains (4.1) of the same case here, percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The simulation.
    pub case: &'static str,
    /// IKM or FKM.
    pub method: Method,
    /// Measured poses.
    pub poses: usize,
    /// Of every length.
    pub start_error_mm: f64,
    /// Of every angle.
    pub start_error_deg: f64,
    /// One σ of each coordinate.
    pub noise_position_mm: f64,
    /// One σ of each joint angle.
    pub noise_joint_deg: f64,
    /// What the paper found.
    pub paper_gain_percent: Option<f64>,
    /// What it says of it.
    pub paper_remark: String,
    /// Of one calibration.
    pub paper_seconds: Option<f64>,
    /// Least squares as in the paper, by Levenberg–Marquardt.
    pub levenberg_marquardt_percent: Option<f64>,
    /// The same by Gauss–Newton.
    pub gauss_newton_percent: Option<f64>,
    /// With known noise and tolerance; `None` without noise.
    pub noise_and_tolerance_percent: Option<f64>,
    /// The same from planned poses.
    pub planned_percent: Option<f64>,
    /// Robots of which none was refused, with Levenberg–Marquardt, percent.
    pub accepted_percent: f64,
    /// Of one calibration by Levenberg–Marquardt.
    pub seconds: Option<f64>,
}

/// Every row of the paper, for each case here that it concerns.
///
/// # Errors
/// None, as long as the built-in figures are in order, which a test assures.
pub fn comparisons(experiments: &[Experiment]) -> Result<Vec<Comparison>, csv::Error> {
    let figures = figures()?;
    let mut comparisons = Vec::new();
    for experiment in experiments {
        for summary in &experiment.cases {
            let case = &summary.case;
            let plain = !(case.weights || case.prior || case.planned);
            if case.solver != CampaignSolver::Lm || !plain {
                continue;
            }
            let Some(figure) = figure_of(&figures, experiment.name, case) else {
                continue;
            };
            let gain = |other: Case| {
                let found = experiment.cases.iter().find(|own| own.case == other);
                Some(found?.gain_percent?.median)
            };
            let with_prior = |planned| {
                gain(Case {
                    weights: true,
                    prior: true,
                    planned,
                    ..case.clone()
                })
            };
            comparisons.push(Comparison {
                case: experiment.name,
                method: case.method,
                poses: case.poses,
                start_error_mm: case.start_error_mm,
                start_error_deg: case.start_error_deg,
                noise_position_mm: case.noise_position_mm,
                noise_joint_deg: case.noise_joint_deg,
                paper_gain_percent: figure.gain_percent,
                paper_remark: figure.remark.clone(),
                paper_seconds: figure.seconds,
                levenberg_marquardt_percent: gain(case.clone()),
                gauss_newton_percent: gain(Case {
                    solver: CampaignSolver::Gn,
                    ..case.clone()
                }),
                noise_and_tolerance_percent: with_prior(false),
                planned_percent: with_prior(true),
                accepted_percent: summary.percent(summary.accepted),
                seconds: summary.seconds_per_calibration,
            });
        }
    }
    Ok(comparisons)
}

fn figures() -> Result<Vec<Figure>, csv::Error> {
    let mut reader = csv::Reader::from_reader(FIGURES.as_bytes());
    reader.deserialize().collect()
}

/// What the paper found in a case, whatever was known of noise and tolerance here.
fn figure_of<'a>(figures: &'a [Figure], name: &str, case: &Case) -> Option<&'a Figure> {
    figures.iter().find(|figure| {
        let start = figure.start_error_mm;
        figure.case == name
            && figure.method == case.method
            && figure.poses.is_none_or(|poses| poses == case.poses)
            && start.is_none_or(|error| error.total_cmp(&case.start_error_mm).is_eq())
    })
}

#[derive(Serialize)]
struct ResultRow {
    case: &'static str,
    method: Method,
    solver: CampaignSolver,
    poses: usize,
    start_error_mm: f64,
    start_error_deg: f64,
    noise_position_mm: f64,
    noise_joint_deg: f64,
    weights: bool,
    prior: bool,
    planned: bool,
    robots: usize,
    gain_median_percent: Option<f64>,
    gain_p05_percent: Option<f64>,
    gain_p95_percent: Option<f64>,
    error_before_mm: Option<f64>,
    error_after_mm: Option<f64>,
    bound_ratio: Option<f64>,
    converged_percent: f64,
    returned_percent: f64,
    returned_from_nominal_percent: f64,
    seconds_per_calibration: Option<f64>,
    paper_gain_percent: Option<f64>,
    paper_seconds: Option<f64>,
    paper_remark: String,
}

/// `results.csv`: one row a case. Gains and errors are those of the median robot; the bound ratio is
/// √(Σ error²/Σ bound²) of the parameters over the calibrated robots.
///
/// # Errors
/// As [`comparisons`].
pub fn results_csv(experiments: &[Experiment]) -> Result<String, csv::Error> {
    let figures = figures()?;
    let mut writer = csv::Writer::from_writer(Vec::new());
    for experiment in experiments {
        for summary in &experiment.cases {
            let CaseSummary {
                case,
                gain_percent: gain,
                ..
            } = summary;
            let figure = figure_of(&figures, experiment.name, case);
            writer.serialize(ResultRow {
                case: experiment.name,
                method: case.method,
                solver: case.solver,
                poses: case.poses,
                start_error_mm: case.start_error_mm,
                start_error_deg: case.start_error_deg,
                noise_position_mm: case.noise_position_mm,
                noise_joint_deg: case.noise_joint_deg,
                weights: case.weights,
                prior: case.prior,
                planned: case.planned,
                robots: summary.robots,
                gain_median_percent: gain.map(|gain| gain.median),
                gain_p05_percent: gain.map(|gain| gain.p05),
                gain_p95_percent: gain.map(|gain| gain.p95),
                error_before_mm: summary.error_before_mm.map(|error| error.median),
                error_after_mm: summary.error_after_mm.map(|error| error.median),
                bound_ratio: summary.ratios.error_to_bound,
                converged_percent: summary.percent(summary.accepted),
                returned_percent: summary.percent(summary.returned),
                returned_from_nominal_percent: summary.percent(summary.returned_from_nominal),
                seconds_per_calibration: summary.seconds_per_calibration,
                paper_gain_percent: figure.and_then(|figure| figure.gain_percent),
                paper_seconds: figure.and_then(|figure| figure.seconds),
                paper_remark: figure.map_or_else(String::new, |figure| figure.remark.clone()),
            })?;
        }
    }
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    String::from_utf8(bytes).map_err(|error| std::io::Error::other(error).into())
}
