//! The simulations of the paper as campaigns, beside what it found.
//!
//! The paper: T. Bentaleb, J. Iqbal, "On the improvement of calibration accuracy of parallel robots –
//! modeling and optimization", JTAM 58(1), 2020, doi 10.15632/jtam-pl/115863.

use super::plan::{CampaignSolver, Case, Plan};
use super::row::{run, text};
use super::summary::{CaseSummary, summarize};
use crate::files::input::{InputError, InputText};
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

/// In the order of the paper. Each file says how an ambiguous sentence was read.
const EXPERIMENTS: [(&str, &str); 7] = [
    experiment!("exact"),
    experiment!("fkm-noise"),
    experiment!("fkm-start-error"),
    experiment!("ikm-small-noise"),
    experiment!("ikm-start-error"),
    experiment!("ikm-noise"),
    experiment!("number-of-poses"),
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The simulation.
    pub case: String,
    /// IKM or FKM.
    pub method: Method,
    /// Any if not stated.
    pub start_error_mm: Option<f64>,
    /// Any if not stated.
    pub poses: Option<usize>,
    /// (4.1).
    pub gain_percent: Option<f64>,
    /// Of one calibration.
    pub seconds: Option<f64>,
    /// What it says in words.
    pub remark: String,
}

/// Runs every simulation. `robots` replaces the robots of each case.
///
/// # Errors
/// None, as long as the built-in campaigns are in order, which a test assures.
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
        let cases = summarize(&rows);
        experiments.push(Experiment { name, cases });
    }
    Ok(experiments)
}

/// A row of the paper and the median gains (4.1) of the same case here, percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// What the paper found.
    pub paper: Figure,
    /// The case here.
    pub here: Case,
    /// Least squares as in the paper, by Levenberg–Marquardt.
    pub levenberg_marquardt_percent: Option<f64>,
    /// The same by Gauss–Newton.
    pub gauss_newton_percent: Option<f64>,
    /// With known noise and tolerance; `None` without noise.
    pub noise_and_tolerance_percent: Option<f64>,
    /// The same from planned poses.
    pub planned_percent: Option<f64>,
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
    for Experiment { name, cases } in experiments {
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

const COLUMNS: &str = "case,method,solver,poses,start_error_mm,start_error_deg,noise_position_mm,\
    noise_joint_deg,weights,prior,planned,robots,gain_median_percent,gain_p05_percent,\
    gain_p95_percent,error_before_mm,error_after_mm,bound_ratio,converged_percent,\
    returned_percent,returned_from_nominal_percent,seconds_per_calibration,paper_gain_percent,\
    paper_seconds,paper_remark";

/// `results.csv`: one row a case. Gains and errors are those of the median robot; the bound ratio is
/// √(Σ error²/Σ bound²) of the parameters over the calibrated robots.
///
/// # Errors
/// As [`comparisons`].
pub fn results_csv(experiments: &[Experiment]) -> Result<String, csv::Error> {
    let figures = figures()?;
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS.split(','))?;
    for Experiment { name, cases } in experiments {
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
