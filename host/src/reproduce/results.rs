//! `results.csv`: one row a case of every experiment.

use super::Reproduction;
use crate::campaign::CaseSummary;
use csv::WriterBuilder;
use serde::Serialize;

#[derive(Serialize)]
struct Row {
    case: &'static str,
    method: &'static str,
    solver: &'static str,
    poses: usize,
    start_error_mm: f64,
    start_error_deg: f64,
    noise_position_mm: f64,
    noise_joint_deg: f64,
    weights: bool,
    prior: bool,
    planned: bool,
    robots: u64,
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
    paper_remark: &'static str,
}

/// The table. Errors are those of the median robot over held-out poses; the bound ratio is
/// √(Σ error²/Σ bound²) of the parameters over the calibrated robots.
///
/// # Errors
/// None is known: the table is written to memory.
pub fn results_csv(reproduction: &Reproduction) -> Result<String, csv::Error> {
    let mut writer = WriterBuilder::new().from_writer(Vec::new());
    for results in &reproduction.experiments {
        for summary in &results.cases {
            let CaseSummary {
                case,
                gain_percent: gain,
                ..
            } = summary;
            let paper = results.experiment.paper_value(case);
            writer.serialize(Row {
                case: results.experiment.name,
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
                bound_ratio: summary.bound_ratio_rms,
                converged_percent: summary.converged_percent(),
                returned_percent: summary.returned_percent(),
                returned_from_nominal_percent: summary.returned_from_nominal_percent(),
                seconds_per_calibration: summary.seconds_per_calibration,
                paper_gain_percent: paper.and_then(|paper| paper.gain_percent),
                paper_seconds: paper.and_then(|paper| paper.seconds),
                paper_remark: paper.map_or("", |paper| paper.remark),
            })?;
        }
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))?;
    String::from_utf8(bytes).map_err(|error| csv::Error::from(std::io::Error::other(error)))
}
