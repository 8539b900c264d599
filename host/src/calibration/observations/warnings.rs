//! What is doubtful about a calibration from observations.

use super::report::ObservationsReport;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::text::numbers::significant;
use crate::text::words::in_lines;

/// A row off by more than so many σ is named.
const DOUBTFUL_ROW: f64 = 4.0;
/// Residuals as small as this part of what is expected are doubtful, if that is improbable.
const MUCH_SMALLER: f64 = 0.25;

/// Anything doubtful, in plain words; `too_small` says whether χ² of the residuals is improbably small.
pub(super) fn of(report: &ObservationsReport, too_small: bool) -> Vec<String> {
    let mut warnings = Vec::new();
    if too_small && report.lack_of_fit < MUCH_SMALLER {
        warnings.push(format!(
            "the residuals are only {:.2} times what the stated [noise] and [tolerance] allow: were these rows measured, \
             or copied from the plan? If they were measured, state the [noise] that repeated readings of one pose show",
            report.lack_of_fit
        ));
    }
    warnings.extend(report.workspace.as_ref().and_then(of_comparison));
    if report.widening > 1.0 {
        warnings.push(format!(
            "the residuals are {:.2} times what the stated [noise] and [tolerance] allow, and every sigma was \
             multiplied by that: look for a wrong row, a plate that is not flat, or a noise stated too small",
            report.widening
        ));
    }
    if !report.fit.left_out.is_empty() {
        let lines = report
            .fit
            .left_out
            .iter()
            .map(|index| report.samples.rows[*index].line);
        let lines: Vec<_> = lines.collect();
        let rows = if lines.len() == 1 {
            "row was"
        } else {
            "rows were"
        };
        warnings.push(format!(
            "{}: the robot of the file does not reach these joint angles, so that the {rows} left out",
            in_lines(&lines)
        ));
    }
    if !report.fit.suspected.is_empty() {
        let lines = report.suspected_lines();
        let disagrees = if lines.len() == 1 {
            "the row disagrees with the others and was left out: measure it again"
        } else {
            "the rows disagree with the others and were left out: measure them again"
        };
        warnings.push(format!("{}: {disagrees}", in_lines(&lines)));
    }
    let suspected = |index: &usize| report.fit.suspected.contains(index);
    let rows = report.samples.rows.iter().enumerate();
    for (index, row) in rows.filter(|(index, _)| !suspected(index)) {
        let residual = report.row_residual(index) / report.widening;
        if residual > DOUBTFUL_ROW {
            warnings.push(format!(
                "line {} disagrees with the others by {residual:.1} sigma: measure it again",
                row.line
            ));
        }
    }
    warnings
}

/// Whether positions relative to each other may be worse than before.
fn of_comparison(comparison: &WorkspaceComparison) -> Option<String> {
    if comparison.unchanged() {
        return Some(
            "the measurements do not change the robot: it was calibrated with them before, or it is as accurate as they \
             can show"
                .to_owned(),
        );
    }
    comparison.may_be_worse().then(|| {
        format!(
            "with a probability of {} % the calibration makes the positions, relative to each other, worse: it moves them by \
             {:.3} mm (rms over the workspace), and they are then uncertain by {:.3} mm. Measure more, or state in \
             [tolerance] how far off the robot can be now, if that is less than when it was made",
            significant(100.0 * comparison.chance_of_harm.unwrap_or(1.0), 2),
            comparison.judged.change,
            comparison.judged.sigma
        )
    })
}
