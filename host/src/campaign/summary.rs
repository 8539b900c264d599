//! One row a case: how many robots were calibrated, and quantiles over them.

use super::CampaignError;
use super::folder::Record;
use super::plan::{Plan, Shard};
use super::quantiles::{QuantileFinder, Quantiles};
use super::row::{CASE_COLUMNS, CaseColumns, cases, columns, gain_column, parameters};
use super::status::Status;
use csv::{ByteRecord, Reader, ReaderBuilder, WriterBuilder};
use delta_cal::Parameter;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::Path;

/// The quantities of which quantiles are stated: the column of `robots.csv`, and how `summary.csv`
/// names its quantile.
const QUANTITIES: [(&str, &str); 7] = [
    ("gain_percent", "gain_{}_percent"),
    ("error_before_mm", "error_before_{}_mm"),
    ("error_after_mm", "error_after_{}_mm"),
    ("parameter_error_mm", "parameter_error_{}_mm"),
    ("bound_ratio", "bound_ratio_{}"),
    ("relative_before_mm", "relative_before_{}_mm"),
    ("relative_after_mm", "relative_after_{}_mm"),
];
const QUANTILES: [&str; 5] = ["p05", "p25", "median", "p75", "p95"];

/// What came of one case. Quantiles are over the calibrated robots.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Which case.
    #[serde(flatten)]
    pub case: CaseColumns,
    /// Simulated robots.
    pub robots: u64,
    /// Robots that were calibrated, not refused.
    pub accepted: u64,
    /// Robots whose true parameters were found: to the arithmetic's accuracy without noise, within
    /// five times the Cramér–Rao bound with it.
    pub returned: u64,
    /// Those of them for which no other start than the nominal robot was needed.
    pub returned_from_nominal: u64,
    /// Why the others were refused, and how many for each reason.
    pub refusals: BTreeMap<String, u64>,
    /// Gain (4.1), percent.
    pub gain_percent: Option<Quantiles>,
    /// rms position error over held-out points before, mm.
    pub error_before_mm: Option<Quantiles>,
    /// The same after.
    pub error_after_mm: Option<Quantiles>,
    /// ‖Pr − Pc‖, angles times the upper arm's length, mm.
    pub parameter_error_mm: Option<Quantiles>,
    /// The parameter error over the Cramér–Rao bound, robot by robot.
    pub bound_ratio: Option<Quantiles>,
    /// As `error_before_mm`, after the rigid motion that explains most of the errors.
    pub relative_before_mm: Option<Quantiles>,
    /// The same after.
    pub relative_after_mm: Option<Quantiles>,
    /// √(Σ parameter error² / Σ bound²) over all calibrated robots: 1 at the bound.
    pub bound_ratio_rms: Option<f64>,
    /// Wall-clock time of one calibration; not of the simulation around it.
    pub seconds_per_calibration: Option<f64>,
    /// Of every parameter, if the plan asks for it and any robot was calibrated.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parameter_gains: Vec<ParameterGain>,
}

/// The gain of one parameter by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ParameterGain {
    /// Counted from 1.
    pub arm: usize,
    /// As in the paper: `Dx`, `theta`, `La_x`.
    pub parameter: &'static str,
    /// Percent.
    pub gain_percent: Quantiles,
}

impl CaseSummary {
    /// Calibrated robots, percent.
    pub fn converged_percent(&self) -> f64 {
        100.0 * number(self.accepted) / number(self.robots)
    }

    /// Robots whose true parameters were found, percent.
    pub fn returned_percent(&self) -> f64 {
        100.0 * number(self.returned) / number(self.robots)
    }

    /// The same of those for which no other start than the nominal robot was needed.
    pub fn returned_from_nominal_percent(&self) -> f64 {
        100.0 * number(self.returned_from_nominal) / number(self.robots)
    }
}

#[allow(clippy::cast_precision_loss)] // counts far below 2⁵³
const fn number(count: u64) -> f64 {
    count as f64
}

/// What is gathered of one case while its rows pass by.
#[derive(Default)]
struct Gathered {
    robots: u64,
    accepted: u64,
    returned: u64,
    returned_from_nominal: u64,
    refusals: BTreeMap<String, u64>,
    squares: (f64, f64),
    finders: [QuantileFinder; 7],
    /// Arm, parameter and its gain; all of the robot's, or none.
    parameters: Vec<(usize, Parameter, QuantileFinder)>,
}

impl Gathered {
    fn new(plan: &Plan) -> Self {
        let all = parameters(plan).filter(|_| plan.parameters);
        Self {
            parameters: all
                .map(|(arm, parameter)| (arm, parameter, QuantileFinder::default()))
                .collect(),
            ..Self::default()
        }
    }

    /// In the first pass.
    fn count(&mut self, row: &Cells<'_>) -> io::Result<()> {
        self.robots += 1;
        if row.status()? != Status::ACCEPTED.name() {
            *self.refusals.entry(row.status()?.to_owned()).or_default() += 1;
            return Ok(());
        }
        self.accepted += 1;
        let returned = row.text("returned")? == "true";
        let from_nominal = row.text("from_nominal")? == "true";
        self.returned += u64::from(returned);
        self.returned_from_nominal += u64::from(returned && from_nominal);
        if let (Some(error), Some(bound)) =
            (row.number("parameter_error_mm")?, row.number("bound_mm")?)
        {
            self.squares.0 += error * error;
            self.squares.1 += bound * bound;
        }
        Ok(())
    }

    /// In every pass.
    fn offer(&mut self, row: &Cells<'_>) -> io::Result<()> {
        if row.status()? != Status::ACCEPTED.name() {
            return Ok(());
        }
        for (finder, (column, _)) in self.finders.iter_mut().zip(QUANTITIES) {
            if let Some(value) = row.number(column)? {
                finder.offer(value);
            }
        }
        for (arm, parameter, finder) in &mut self.parameters {
            if let Some(value) = row.number(&gain_column(*arm, *parameter))? {
                finder.offer(value);
            }
        }
        Ok(())
    }

    fn another_pass(&mut self) -> bool {
        let mut another = false;
        let own = self.parameters.iter_mut().map(|(.., finder)| finder);
        for finder in self.finders.iter_mut().chain(own) {
            another |= finder.another_pass();
        }
        another
    }

    fn summary(&self, case: CaseColumns, seconds_per_calibration: Option<f64>) -> CaseSummary {
        let [
            gain,
            before,
            after,
            error,
            ratio,
            relative_before,
            relative_after,
        ] = self.finders.each_ref().map(QuantileFinder::quantiles);
        let (errors, bounds) = self.squares;
        CaseSummary {
            case,
            robots: self.robots,
            accepted: self.accepted,
            returned: self.returned,
            returned_from_nominal: self.returned_from_nominal,
            refusals: self.refusals.clone(),
            gain_percent: gain,
            error_before_mm: before,
            error_after_mm: after,
            parameter_error_mm: error,
            bound_ratio: ratio,
            relative_before_mm: relative_before,
            relative_after_mm: relative_after,
            bound_ratio_rms: (bounds > 0.0).then(|| (errors / bounds).sqrt()),
            seconds_per_calibration,
            parameter_gains: self
                .parameters
                .iter()
                .filter_map(|(arm, parameter, finder)| {
                    Some(ParameterGain {
                        arm: *arm,
                        parameter: parameter.symbol(),
                        gain_percent: finder.quantiles()?,
                    })
                })
                .collect(),
        }
    }
}

/// A row's cells by their column.
struct Cells<'a> {
    columns: &'a [String],
    cells: &'a ByteRecord,
}

impl Cells<'_> {
    fn text(&self, column: &str) -> io::Result<&str> {
        self.columns
            .iter()
            .position(|name| *name == column)
            .and_then(|index| self.cells.get(index))
            .and_then(|cell| std::str::from_utf8(cell).ok())
            .ok_or_else(|| io::Error::other(format!("a row has no column {column}")))
    }

    fn status(&self) -> io::Result<&str> {
        self.text("status")
    }

    fn number(&self, column: &str) -> io::Result<Option<f64>> {
        match self.text(column)? {
            "" => Ok(None),
            text => text.parse().map(Some).map_err(|_| {
                io::Error::other(format!("{text} in column {column} is not a number"))
            }),
        }
    }
}

/// Reads the rows of a campaign, or of its shard, once or a few times, and keeps none.
pub(super) fn summarise(
    rows: &Path,
    plan: &Plan,
    shard: Shard,
    record: &Record,
) -> Result<Vec<CaseSummary>, CampaignError> {
    let failed = |error: io::Error| CampaignError::file(rows, error);
    let broken = |error: csv::Error| CampaignError::file(rows, error);
    let mut reader = ReaderBuilder::new().from_path(rows).map_err(broken)?;
    reader.byte_headers().map_err(broken)?;
    let variants = plan.variants().len();
    let columns = columns(plan);
    let mut cases = cases(plan).into_iter();
    let mut times = record.calibrations.iter().zip(&record.seconds);
    let mut summaries = Vec::new();
    for _ in plan.scenarios() {
        let begin = reader.position().clone();
        let mut gathered: Vec<_> = (0..variants).map(|_| Gathered::new(plan)).collect();
        let mut first = true;
        loop {
            pass(
                &mut reader,
                &columns,
                shard.robots(plan),
                &mut gathered,
                first,
            )
            .map_err(failed)?;
            first = false;
            let another = gathered
                .iter_mut()
                .fold(false, |another, case| case.another_pass() | another);
            if !another {
                break;
            }
            reader.seek(begin.clone()).map_err(broken)?;
        }
        for ((gathered, case), (count, seconds)) in gathered.iter().zip(&mut cases).zip(&mut times)
        {
            let each = (*count > 0).then(|| seconds / number(*count));
            summaries.push(gathered.summary(case, each));
        }
    }
    Ok(summaries)
}

fn pass(
    reader: &mut Reader<File>,
    columns: &[String],
    robots: u64,
    gathered: &mut [Gathered],
    first: bool,
) -> io::Result<()> {
    let mut record = ByteRecord::new();
    for _ in 0..robots {
        for case in &mut *gathered {
            if !reader.read_byte_record(&mut record)? {
                return Err(io::Error::other("the rows end too early"));
            }
            let cells = Cells {
                columns,
                cells: &record,
            };
            if first {
                case.count(&cells)?;
            }
            case.offer(&cells)?;
        }
    }
    Ok(())
}

/// `summary.csv`.
pub(super) fn summary_csv(summaries: &[CaseSummary]) -> Result<String, CampaignError> {
    let mut columns: Vec<String> = CASE_COLUMNS.map(str::to_owned).into();
    columns.extend(
        [
            "robots",
            "accepted",
            "converged_percent",
            "returned_percent",
            "returned_from_nominal_percent",
        ]
        .map(str::to_owned),
    );
    for (_, pattern) in QUANTITIES {
        columns.extend(QUANTILES.map(|name| pattern.replace("{}", name)));
    }
    columns.extend(["bound_ratio_rms", "refusals"].map(str::to_owned));
    table(&columns, summaries, |summary| {
        let quantities = [
            summary.gain_percent,
            summary.error_before_mm,
            summary.error_after_mm,
            summary.parameter_error_mm,
            summary.bound_ratio,
            summary.relative_before_mm,
            summary.relative_after_mm,
        ]
        .map(|quantiles| quantiles.map_or([None; 5], |quantiles| quantiles.values().map(Some)));
        let refusals: Vec<_> = summary
            .refusals
            .iter()
            .map(|(reason, count)| format!("{reason} {count}"))
            .collect();
        (
            summary.case,
            (summary.robots, summary.accepted),
            [
                summary.converged_percent(),
                summary.returned_percent(),
                summary.returned_from_nominal_percent(),
            ],
            quantities,
            summary.bound_ratio_rms,
            refusals.join("; "),
        )
    })
}

/// `timing.csv`.
pub(super) fn timing_csv(summaries: &[CaseSummary]) -> Result<String, CampaignError> {
    let mut columns: Vec<String> = CASE_COLUMNS.map(str::to_owned).into();
    columns.push("seconds_per_calibration".to_owned());
    table(&columns, summaries, |summary| {
        (summary.case, summary.seconds_per_calibration)
    })
}

/// `parameters.csv`.
pub(super) fn parameters_csv(summaries: &[CaseSummary]) -> Result<String, CampaignError> {
    let mut columns: Vec<String> = CASE_COLUMNS.map(str::to_owned).into();
    columns.extend(["arm", "parameter"].map(str::to_owned));
    columns.extend(QUANTILES.map(|name| format!("gain_{name}_percent")));
    let rows: Vec<_> = summaries
        .iter()
        .flat_map(|summary| {
            summary
                .parameter_gains
                .iter()
                .map(move |gain| (summary, gain))
        })
        .collect();
    table(&columns, &rows, |(summary, gain)| {
        let values = gain.gain_percent.values();
        (summary.case, gain.arm, gain.parameter, values)
    })
}

/// A header and a row for each item.
fn table<I, T: Serialize>(
    columns: &[String],
    items: &[I],
    row: impl Fn(&I) -> T,
) -> Result<String, CampaignError> {
    let failed = |error: io::Error| CampaignError::file(Path::new("summary"), error);
    let mut writer = WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    let write = |writer: &mut csv::Writer<Vec<u8>>| -> Result<(), csv::Error> {
        writer.write_record(columns)?;
        for item in items {
            writer.serialize(row(item))?;
        }
        Ok(())
    };
    write(&mut writer).map_err(|error| failed(error.into()))?;
    let bytes = writer
        .into_inner()
        .map_err(|error| failed(error.into_error()))?;
    String::from_utf8(bytes).map_err(|error| failed(io::Error::other(error)))
}
