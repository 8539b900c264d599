//! The tables.

use super::shares::{pairs, percent, ratio, share};
use crate::campaign::{CaseColumns, CaseSummary, Quantiles};
use crate::reproduce::{Comparison, Results};
use maud::{Markup, html};

pub(super) fn rows(comparisons: &[Comparison<'_>]) -> Markup {
    html! {
        table.wide {
            thead { tr {
                th { "case" } th { "poses" } th { "start error" } th { "noise" }
                th { "the paper," br; "gain, %" } th { "least squares," br; "gain, %" }
                th { "noise and tolerance," br; "gain, %" } th { "above" br; "paper" }
                th { "and planned" br; "poses, gain, %" }
            } }
            tbody {
                @for comparison in comparisons {
                    @let case = comparison.case();
                    tr {
                        th scope="row" { (comparison.experiment.name) }
                        td { (case.poses) }
                        (start_and_noise(case))
                        td {
                            @match comparison.paper.gain_percent {
                                Some(gain) => { (percent(gain)) }
                                None => { (comparison.paper.remark) }
                            }
                        }
                        td { (gain(comparison.as_in_the_paper.gain_percent)) }
                        td { (comparison.with_prior.map_or_else(dash, |best| gain(best.gain_percent))) }
                        td { (comparison.above_the_paper().map_or("–", yes_no)) }
                        td { (comparison.planned.map_or_else(dash, median)) }
                    }
                }
            }
        }
        p.note {
            "Gains: the median robot, in brackets 5 % and 95 % of the robots, over the calibrated ones; what \
            is refused is in the tables below. Above the paper: the median with noise and tolerance from \
            random poses, as the paper's are. Planned poses are those of `delta-cal plan`."
        }
    }
}

fn start_and_noise(case: &CaseColumns) -> Markup {
    html! {
        td { (case.start_error_mm) " mm/" (case.start_error_deg) "°" }
        td {
            @if case.noise_position_mm > 0.0 {
                @if case.noise_position_mm < 0.01 {
                    (format!("{:.0} µm/", 1e3 * case.noise_position_mm))
                } @else {
                    (case.noise_position_mm) " mm/"
                }
                (case.noise_joint_deg) "°"
            } @else { "none" }
        }
    }
}

/// How long one calibration takes.
pub(super) fn times(comparisons: &[Comparison<'_>]) -> Markup {
    let timed = comparisons
        .iter()
        .filter(|comparison| comparison.paper.seconds.is_some());
    html! {
        table.wide {
            thead { tr {
                th { "case" } th { "method" } th { "poses" } th { "start error" } th { "noise" }
                th { "the paper, s" } th { "here, ms" }
            } }
            tbody {
                @for comparison in timed {
                    @let case = comparison.case();
                    tr {
                        th scope="row" { (comparison.experiment.name) }
                        td { (case.method.to_uppercase()) }
                        td { (case.poses) }
                        (start_and_noise(case))
                        td { (comparison.paper.seconds.map_or_else(dash, |s| format!("{s:.3}"))) }
                        td { (milliseconds(comparison.best())) }
                    }
                }
            }
        }
        p.note {
            "Of one calibration, wall clock: the paper's on its machine, here on one processor of this one \
            while the others calibrate, too."
        }
    }
}

/// Every case of an experiment, unasked only if there are few.
pub(super) fn cases(results: &Results) -> Markup {
    html! {
        details {
            summary { "All " (results.cases.len()) " cases" }
            table.numbers {
                thead { tr {
                    th { "method" } th { "solver" } th { "weights" } th { "prior" } th { "planned" }
                    th { "poses" } th { "start error" } th { "noise" }
                    th { "calibrated, %" } th { "returned, %" } th { "gain, %" }
                    th { "error before, mm" } th { "error after, mm" } th { "error/bound" } th { "s" }
                } }
                tbody {
                    @for summary in &results.cases {
                        @let case = &summary.case;
                        tr {
                            th scope="row" { (case.method) }
                            td { (case.solver) }
                            td { (yes_no(case.weights)) }
                            td { (yes_no(case.prior)) }
                            td { (yes_no(case.planned)) }
                            td { (case.poses) }
                            (start_and_noise(case))
                            td { (share(summary.converged_percent())) }
                            td { (share(summary.returned_percent())) }
                            td { (gain(summary.gain_percent)) }
                            td { (millimetres(summary.error_before_mm)) }
                            td { (millimetres(summary.error_after_mm)) }
                            td { (summary.bound_ratio_rms.map_or_else(dash, |ratio| format!("{ratio:.2}"))) }
                            td { (seconds(summary)) }
                        }
                    }
                }
            }
        }
    }
}

/// Shares of returned robots: start errors down, methods across.
pub(super) fn basins(cases: &[CaseSummary]) -> Markup {
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
    html! {
        details {
            summary { "Robots returned, %" }
            table.numbers {
                thead { tr {
                    th { "start error" }
                    @for (poses, method, solver) in &columns {
                        th { (poses) " poses" br; (method) " " (solver) }
                    }
                } }
                tbody {
                    @for start in &starts {
                        tr {
                            th scope="row" { (start.0) " mm/" (start.1) "°" }
                            @for column in &columns {
                                td { (of(*start, *column).map_or_else(dash, |s| share(s.returned_percent()))) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Both methods on the same measurements.
pub(super) fn accuracy(cases: &[CaseSummary]) -> Markup {
    let pairs = pairs(cases);
    html! {
        table.wide {
            thead { tr {
                th { "poses" } th { "noise" }
                th { "FKM, error, mm" } th { "IKM, error, mm" } th { "IKM/FKM" }
                th { "FKM, error/bound" } th { "IKM, error/bound" }
                th { "FKM, s" } th { "IKM, s" }
            } }
            tbody {
                @for (fkm, ikm) in &pairs {
                    tr {
                        th scope="row" { (fkm.case.poses) }
                        td { (fkm.case.noise_position_mm) " mm/" (fkm.case.noise_joint_deg) "°" }
                        td { (millimetres(fkm.parameter_error_mm)) }
                        td { (millimetres(ikm.parameter_error_mm)) }
                        td { (ratio(fkm, ikm).map_or_else(dash, |r| format!("{r:.3}"))) }
                        td { (fkm.bound_ratio_rms.map_or_else(dash, |ratio| format!("{ratio:.2}"))) }
                        td { (ikm.bound_ratio_rms.map_or_else(dash, |ratio| format!("{ratio:.2}"))) }
                        td { (seconds(fkm)) }
                        td { (seconds(ikm)) }
                    }
                }
            }
        }
        p.note {
            "Error: of the parameters, ‖Pr − Pc‖ of the median robot. The bound is each method's own \
            Cramér–Rao bound; that of the IKM method is the larger one where positions are noisy."
        }
    }
}

fn yes_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

fn dash() -> String {
    "–".to_owned()
}

fn gain(quantiles: Option<Quantiles>) -> String {
    quantiles.map_or_else(dash, |gain| {
        let [median, low, high] = [gain.median, gain.p05, gain.p95].map(percent);
        if median == low && low == high {
            median
        } else {
            format!("{median} [{low}, {high}]")
        }
    })
}

fn millimetres(quantiles: Option<Quantiles>) -> String {
    quantiles.map_or_else(dash, |error| {
        if error.median < 1e-4 {
            format!("{:.0e}", error.median).replace('-', "−")
        } else {
            format!("{:.4}", error.median)
        }
    })
}

fn milliseconds(summary: &CaseSummary) -> String {
    let time = summary.seconds_per_calibration;
    time.map_or_else(dash, |seconds| format!("{:.2}", 1e3 * seconds))
}

fn median(summary: &CaseSummary) -> String {
    let gain = summary.gain_percent;
    gain.map_or_else(dash, |gain| percent(gain.median))
}

fn seconds(summary: &CaseSummary) -> String {
    let time = summary.seconds_per_calibration;
    time.map_or_else(dash, |seconds| format!("{seconds:.5}"))
}
