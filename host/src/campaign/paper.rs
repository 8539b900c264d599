//! The paper's simulations as campaigns, and its results for comparison.
//!
//! The paper: T. Bentaleb, J. Iqbal, "On the improvement of calibration accuracy of parallel robots –
//! modeling and optimization", JTAM 58(1), 2020, doi 10.15632/jtam-pl/115863.

use super::plan::{CampaignSolver, Case, Plan};
use super::row::{run, text};
use super::summary::{CaseSummary, summarize};
use crate::files::{InputError, InputText};
use crate::fit::Method;
use serde::{Deserialize, Serialize};
use std::ops::Range;

macro_rules! experiment {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!("../../examples/paper/", $name, ".toml")),
        )
    };
}

/// The simulations in the paper's order. Each file documents how ambiguous passages were interpreted.
const EXPERIMENTS: [(&str, &str); 7] = [
    experiment!("exact"),
    experiment!("fkm-noise"),
    experiment!("fkm-start-error"),
    experiment!("ikm-small-noise"),
    experiment!("ikm-start-error"),
    experiment!("ikm-noise"),
    experiment!("number-of-poses"),
];

/// The paper's results.
const FIGURES: &str = include_str!("../../examples/paper/figures.csv");

/// The name of a simulation from the paper, as in `results.csv`, and the results of its cases here.
pub type Experiment = (&'static str, Vec<CaseSummary>);

/// A result reported in the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Name of the simulation.
    pub case: String,
    /// IKM or FKM.
    pub method: Method,
    /// Start error; `None` if the paper does not state it.
    pub start_error_mm: Option<f64>,
    /// Number of poses; `None` if the paper does not state it.
    pub poses: Option<usize>,
    /// Gain, equation (4.1).
    pub gain_percent: Option<f64>,
    /// Time for one calibration.
    pub seconds: Option<f64>,
    /// The paper's remark.
    pub remark: String,
}

/// Runs every simulation. `robots` overrides the range of robots in each case.
///
/// # Errors
/// None: a test checks the built-in campaigns.
pub fn simulate(
    robots: Option<&Range<u64>>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Experiment>, InputError> {
    let mut plans = Vec::with_capacity(EXPERIMENTS.len());
    for (name, text) in EXPERIMENTS {
        let input = InputText::new(format!("built-in {name}.toml"), text);
        let none = |name: &str| Err(InputError::new(name, "the paper's robot is built in"));
        let plan = Plan::read(&input, &none)?;
        let robots = robots.map_or(0..plan.robots, Range::clone);
        plans.push((name, plan, robots));
    }
    let of = |plan: &Plan, robots: &Range<u64>| {
        (robots.end - robots.start) * plan.scenarios.len() as u64
    };
    let total = plans.iter().map(|(_, plan, robots)| of(plan, robots)).sum();
    let mut before = 0;
    let mut experiments = Vec::with_capacity(plans.len());
    for (name, plan, robots) in &plans {
        let rows = run(plan, robots, &mut |finished, _| {
            progress(before + finished, total);
        })?;
        before += of(plan, robots);
        experiments.push((*name, summarize(&rows)));
    }
    Ok(experiments)
}

/// A result from the paper beside the median gains (4.1) of the same case here, percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The paper's result.
    pub paper: Figure,
    /// The corresponding case.
    pub here: Case,
    /// Least squares as in the paper, by Levenberg–Marquardt.
    pub levenberg_marquardt_percent: Option<f64>,
    /// The same, by Gauss–Newton.
    pub gauss_newton_percent: Option<f64>,
    /// With known noise and tolerance; `None` without noise.
    pub noise_and_tolerance_percent: Option<f64>,
    /// The same, from planned poses.
    pub planned_percent: Option<f64>,
    /// Time for one calibration by Levenberg–Marquardt.
    pub seconds: Option<f64>,
}

/// Each result of the paper with every matching case.
///
/// # Errors
/// None: a test checks the built-in figures.
pub fn comparisons(experiments: &[Experiment]) -> Result<Vec<Comparison>, csv::Error> {
    let figures = figures()?;
    let mut comparisons = Vec::new();
    for (name, cases) in experiments {
        for summary in cases {
            let case = &summary.case;
            let plain = !(case.weights || case.prior || case.planned);
            let figure = figure_of(&figures, name, case);
            let Some(paper) = figure.filter(|_| plain && case.solver == CampaignSolver::Lm) else {
                continue;
            };
            let gain = |solver, known, planned| {
                let wanted = Case {
                    solver,
                    weights: known,
                    prior: known,
                    planned,
                    ..case.clone()
                };
                let found = cases.iter().find(|own| own.case == wanted)?;
                Some(found.gain_percent?.median)
            };
            comparisons.push(Comparison {
                paper: paper.clone(),
                here: case.clone(),
                levenberg_marquardt_percent: gain(CampaignSolver::Lm, false, false),
                gauss_newton_percent: gain(CampaignSolver::Gn, false, false),
                noise_and_tolerance_percent: gain(CampaignSolver::Lm, true, false),
                planned_percent: gain(CampaignSolver::Lm, true, true),
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

/// The paper's result for a case, regardless of whether noise and tolerance are known.
fn figure_of<'a>(figures: &'a [Figure], name: &str, case: &Case) -> Option<&'a Figure> {
    figures.iter().find(|figure| {
        let start = figure.start_error_mm;
        figure.case == name
            && figure.method == case.method
            && figure.poses.is_none_or(|poses| poses == case.poses)
            && start.is_none_or(|error| error.total_cmp(&case.start_error_mm).is_eq())
    })
}

const COLUMNS: &str = "case,method,solver,poses,start_error_mm,start_error_deg,noise_position_mm,\
    noise_joint_deg,weights,prior,planned,robots,gain_median_percent,gain_p05_percent,\
    gain_p95_percent,error_before_mm,error_after_mm,bound_ratio,converged_percent,\
    returned_percent,returned_from_nominal_percent,seconds_per_calibration,paper_gain_percent,\
    paper_seconds,paper_remark";

/// `results.csv`: one row per case. Gains and errors are medians over robots; the bound ratio is √(Σ error²/Σ bound²)
/// of the parameters over the calibrated robots.
///
/// # Errors
/// Same as [`comparisons`].
pub fn results_csv(experiments: &[Experiment]) -> Result<String, csv::Error> {
    let figures = figures()?;
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS.split(','))?;
    for (name, cases) in experiments {
        for summary in cases {
            let case = &summary.case;
            let figure = figure_of(&figures, name, case);
            let gain = summary.gain_percent;
            let values = [
                gain.map(|gain| gain.median),
                gain.map(|gain| gain.p05),
                gain.map(|gain| gain.p95),
                summary.error_before_mm.map(|error| error.median),
                summary.error_after_mm.map(|error| error.median),
                summary.ratios.error_to_bound,
                Some(summary.percent(summary.accepted)),
                Some(summary.percent(summary.returned)),
                Some(summary.percent(summary.returned_from_nominal)),
                summary.seconds_per_calibration,
                figure.and_then(|figure| figure.gain_percent),
                figure.and_then(|figure| figure.seconds),
            ];
            let levels = [
                case.start_error_mm,
                case.start_error_deg,
                case.noise_position_mm,
                case.noise_joint_deg,
            ];
            let known = [case.weights, case.prior, case.planned];
            let remark = figure.map_or("", |figure| figure.remark.as_str());
            let method = (name, case.method, case.solver, case.poses);
            writer.serialize((method, levels, known, summary.robots, values, remark))?;
        }
    }
    text(writer)
}
