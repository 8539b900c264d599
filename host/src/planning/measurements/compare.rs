//! What each instrument would bring.

use super::instrument::Instrument;
use super::plan::Bench;
use super::precision::Precision;
use super::request::MeasurementRequest;
use crate::planning::design::Effort;
use crate::planning::poses::PlanError;

/// How many measurements are compared.
pub const COUNTS: [usize; 4] = [12, 20, 40, 60];

/// Random sets that each search begins with: fewer of more measurements, for they differ less.
fn starts(count: usize) -> usize {
    (100 / count.max(1)).max(2)
}

/// What an instrument would bring.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The instrument.
    pub instrument: Instrument,
    /// Before any measurement; `None` without a tolerance.
    pub before: Option<Precision>,
    /// After so many planned measurements ([`COUNTS`]), or why there is no plan.
    pub after: Vec<Result<Precision, PlanError>>,
}

/// Plans measurements with each of these instruments. Kinds, number and noise of the request do not matter.
/// `progress` is told of each plan that is made.
///
/// # Errors
/// Limits or a region that leave no pose.
pub fn compare(
    request: &MeasurementRequest<'_>,
    instruments: &[Instrument],
    mut progress: impl FnMut(&Instrument, usize),
) -> Result<Vec<Comparison>, PlanError> {
    let bench = Bench::new(request)?;
    let mut comparisons = Vec::with_capacity(instruments.len());
    for instrument in instruments {
        let mut comparison = Comparison {
            instrument: *instrument,
            before: None,
            after: Vec::with_capacity(COUNTS.len()),
        };
        let mut smaller = Vec::new();
        for count in COUNTS {
            progress(instrument, count);
            let request = instrument.request(request, count);
            let plan = bench.plan(&request, &smaller, &Effort::quick(starts(count)));
            comparison.after.push(plan.map(|plan| {
                comparison.before = plan.before;
                smaller = plan.measurements;
                plan.after
            }));
        }
        comparisons.push(comparison);
    }
    Ok(comparisons)
}
