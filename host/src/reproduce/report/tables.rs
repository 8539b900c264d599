//! The tables.

use super::shares::{pairs, ratio};
use crate::campaign::{CaseSummary, Quantiles};
use crate::render::table::{Rows, Table};
use crate::report::campaign::{NOISE, START_ERROR, or_dash, yes_no};
use crate::reproduce::{Comparison, Results};
use crate::text::numbers::{percent, share};
use maud::{Markup, html};

/// The paper's rows beside this program's.
pub(super) fn rows(comparisons: &[Comparison<'_>]) -> Markup {
    html! {
        (compared(comparisons, gain).table())
        p.note {
            "Gains: the median robot, in brackets 5 % and 95 % of the robots, over the calibrated ones; what \
            is refused is in the tables below. Above the paper: the median with noise and tolerance from \
            random poses, as the paper's are. Planned poses are those of `delta-cal plan`."
        }
    }
}

/// The same for people at a terminal, with how long one calibration takes.
pub fn table(comparisons: &[Comparison<'_>]) -> String {
    let of_paper = |row: &&Comparison<'_>| or_dash(row.paper.seconds, |s| format!("{s:.3}"));
    compared(comparisons, median)
        .column("seconds\nthe paper", of_paper)
        .column("\nhere", |row| seconds(row.best()))
        .table()
        .to_string()
}

fn compared<'a>(
    comparisons: &'a [Comparison<'a>],
    gain: fn(&CaseSummary) -> String,
) -> Rows<&'a Comparison<'a>> {
    let known = move |summary: Option<&CaseSummary>| summary.map_or_else(dash, gain);
    Table::of(comparisons)
        .column("case", |row| row.experiment.name)
        .column("poses", |row| row.case().poses)
        .column(START_ERROR.0, |row| START_ERROR.1(row.case()))
        .column(NOISE.0, |row| NOISE.1(row.case()))
        .column("gain, %\nthe paper", |row| {
            let gain = row.paper.gain_percent;
            gain.map_or_else(|| row.paper.remark.to_owned(), percent)
        })
        .column("\nleast squares", move |row| gain(row.as_in_the_paper))
        .column("noise and\ntolerance", move |row| known(row.with_prior))
        .page_column("above\nthe paper", |row| {
            row.above_the_paper().map_or("–", yes_no)
        })
        .column("and planned\nposes", move |row| known(row.planned))
}

/// How long one calibration takes.
pub(super) fn times(comparisons: &[Comparison<'_>]) -> Markup {
    let timed = comparisons.iter().filter(|row| row.paper.seconds.is_some());
    let table = Table::of(timed)
        .column("case", |row| row.experiment.name)
        .column("method", |row| row.case().method.to_uppercase())
        .column("poses", |row| row.case().poses)
        .column(START_ERROR.0, |row| START_ERROR.1(row.case()))
        .column(NOISE.0, |row| NOISE.1(row.case()))
        .column("the paper, s", |row| {
            or_dash(row.paper.seconds, |s| format!("{s:.3}"))
        })
        .column("here, ms", |row| {
            let time = row.best().seconds_per_calibration;
            or_dash(time, |seconds| format!("{:.2}", 1e3 * seconds))
        })
        .table();
    html! {
        (table)
        p.note {
            "Of one calibration, wall clock: the paper's on its machine, here on one processor of this one \
            while the others calibrate, too."
        }
    }
}

/// Every case of an experiment, unasked only if there are few.
pub(super) fn cases(results: &Results) -> Table {
    Table::of(&results.cases)
        .column("method", |summary| summary.case.method)
        .column("solver", |summary| summary.case.solver)
        .column("weights", |summary| yes_no(summary.case.weights))
        .column("prior", |summary| yes_no(summary.case.prior))
        .column("planned", |summary| yes_no(summary.case.planned))
        .column("poses", |summary| summary.case.poses)
        .column(START_ERROR.0, |summary| START_ERROR.1(&summary.case))
        .column(NOISE.0, |summary| NOISE.1(&summary.case))
        .column("calibrated, %", |summary| {
            share(summary.converged_percent())
        })
        .column("returned, %", |summary| share(summary.returned_percent()))
        .column("gain, %", |summary| gain(summary))
        .column("error before, mm", |summary| {
            millimetres(summary.error_before_mm)
        })
        .column("error after, mm", |summary| {
            millimetres(summary.error_after_mm)
        })
        .column("error/bound", |summary| bound_ratio(summary))
        .column("s", |summary| seconds(summary))
        .table()
        .folded(format!("All {} cases", results.cases.len()), false)
}

/// Shares of returned robots: start errors down, methods across.
pub(super) fn basins(cases: &[CaseSummary]) -> Table {
    let mut columns: Vec<(usize, &str, &str)> = Vec::new();
    let mut starts: Vec<(f64, f64)> = Vec::new();
    for CaseSummary { case, .. } in cases {
        let column = (case.poses, case.method, case.solver);
        let possible = case.method != "ikm-no-guess" || case.poses >= 12;
        if possible && !columns.contains(&column) {
            columns.push(column);
        }
        let start = (case.start_error_mm, case.start_error_deg);
        if !starts.contains(&start) {
            starts.push(start);
        }
    }
    let of = |start: (f64, f64), column: (usize, &str, &str)| {
        cases.iter().find(|summary| {
            let case = &summary.case;
            (case.start_error_mm, case.start_error_deg) == start
                && (case.poses, case.method, case.solver) == column
        })
    };
    let rows = Table::of(starts).column("start error", |(mm, deg)| format!("{mm} mm/{deg}°"));
    let rows = columns.into_iter().fold(rows, |rows, column| {
        let (poses, method, solver) = column;
        rows.column(format!("{poses} poses\n{method} {solver}"), |start| {
            of(*start, column).map_or_else(dash, |summary| share(summary.returned_percent()))
        })
    });
    rows.table().folded("Robots returned, %", false)
}

/// Both methods on the same measurements.
pub(super) fn accuracy(cases: &[CaseSummary]) -> Markup {
    let table = Table::of(pairs(cases))
        .column("poses", |(fkm, _)| fkm.case.poses)
        .column(NOISE.0, |(fkm, _)| NOISE.1(&fkm.case))
        .column("FKM, error, mm", |(fkm, _)| {
            millimetres(fkm.parameter_error_mm)
        })
        .column("IKM, error, mm", |(_, ikm)| {
            millimetres(ikm.parameter_error_mm)
        })
        .column("IKM/FKM", |(fkm, ikm)| {
            or_dash(ratio(fkm, ikm), |r| format!("{r:.3}"))
        })
        .column("FKM, error/bound", |(fkm, _)| bound_ratio(fkm))
        .column("IKM, error/bound", |(_, ikm)| bound_ratio(ikm))
        .column("FKM, s", |(fkm, _)| seconds(fkm))
        .column("IKM, s", |(_, ikm)| seconds(ikm))
        .table();
    html! {
        (table)
        p.note {
            "Error: of the parameters, ‖Pr − Pc‖ of the median robot. The bound is each method's own \
            Cramér–Rao bound; that of the IKM method is the larger one where positions are noisy."
        }
    }
}

fn dash() -> String {
    "–".to_owned()
}

/// Of the median robot, and in brackets of 5 % and 95 % of the robots.
fn gain(summary: &CaseSummary) -> String {
    summary.gain_percent.map_or_else(dash, |gain| {
        let [median, low, high] = [gain.median, gain.p05, gain.p95].map(percent);
        if median == low && low == high {
            median
        } else {
            format!("{median} [{low}, {high}]")
        }
    })
}

fn median(summary: &CaseSummary) -> String {
    or_dash(summary.gain_percent.map(|gain| gain.median), percent)
}

fn millimetres(quantiles: Option<Quantiles>) -> String {
    or_dash(quantiles.map(|error| error.median), |error| {
        if error < 1e-4 {
            format!("{error:.0e}").replace('-', "−")
        } else {
            format!("{error:.4}")
        }
    })
}

fn bound_ratio(summary: &CaseSummary) -> String {
    or_dash(summary.bound_ratio_rms, |ratio| format!("{ratio:.2}"))
}

fn seconds(summary: &CaseSummary) -> String {
    or_dash(summary.seconds_per_calibration, |seconds| {
        format!("{seconds:.5}")
    })
}
