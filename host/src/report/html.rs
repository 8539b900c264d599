//! The report as one HTML file that opens from disk: everything it needs is in it.

mod figures;
mod poses;
mod tables;
mod uncertainty;

use super::next::advice;
use super::page::{self, figure};
use super::suspected::{self, loss_name};
use super::table::small;
use super::{solver_name, start_name, termination_name};
use crate::plot::PlotError;
use crate::position_uncertainty::UncertaintyMap;
use crate::refusal::OUTLIER;
use crate::words::count;
use crate::{CalibrationMethod, CalibrationReport, Frame, PositionError};
use delta_cal::ArmOutcome;
use maud::{Markup, html};

/// The whole report. `origin` says what the report itself cannot know: that the samples are
/// simulated, or where the calibration was computed.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub fn render(report: &CalibrationReport, origin: Option<&str>) -> Result<String, PlotError> {
    let title = format!("Calibration of {}", report.before.name);
    let body = html! {
        h1 { (title) }
        (how(report, origin))
        (verdict(report))
        (suspected::markup(report))
        (super::stream::markup(report))
        section {
            h2 { "Parameters" }
            @if let Some((changes, caption)) = figures::parameters(report) {
                (figure(&changes, caption)?)
            }
            (tables::parameters(report))
        }
        section {
            h2 { "Position error of each sample" }
            (residuals(report)?)
        }
        section {
            h2 { "Poses" }
            (views(report)?)
        }
        section {
            h2 { "How well the samples determine each arm" }
            (figure(&figures::conditions(report), "A condition below 100 is good. Beyond 1000 the \
                                                   poses hardly distinguish some parameters.")?)
            (solution(report))
        }
        @if let Some(map) = &report.uncertainty {
            section {
                h2 { "How uncertain the calibrated positions are" }
                (uncertain(map)?)
            }
        }
        section {
            h2 { "What to measure next" }
            ul { @for sentence in advice(report) { li { (sentence) } } }
            (figure(&figures::joints(report), "Joint angles of the samples within the \
                joint limits.")?)
        }
        (sensor_frame(report))
    };
    Ok(page::render(&title, &body))
}

fn how(report: &CalibrationReport, origin: Option<&str>) -> Markup {
    let options = &report.options;
    html! {
        p {
            b { (report.before.name) } " from the " (count(report.samples, "sample")) " of "
            b { (report.samples_file) }
            @if report.distinct_poses < report.samples {
                " (" (count(report.distinct_poses, "distinct pose")) ")"
            }
            ", measured in the "
            (match options.frame { Frame::Base => "robot's", Frame::Sensor => "sensor's" })
            " frame. "
            (match options.method { CalibrationMethod::Ikm => "IKM method", CalibrationMethod::Fkm => "FKM method" })
            ", " (solver_name(options.solver))
            @if options.no_guess { ", without a guess" }
            @if options.loss.is_some() { ", loss " (loss_name(options.loss)) }
            ". "
            @match &report.before.tolerance {
                Some(tolerance) => {
                    "Tolerance: " (tolerance.of(delta_cal::Parameter::Lb)) " mm and "
                    (crate::units::degrees(tolerance.of(delta_cal::Parameter::Theta))) "°. "
                }
                None => { "No tolerance stated. " }
            }
            @match &report.before.noise {
                Some(noise) => {
                    "Noise: " (noise.position()) " mm and "
                    (crate::units::degrees(noise.joint())) "°."
                }
                None => {
                    "No noise is stated; with it this report would say whether the residuals are \
                     credible."
                    @if let Some(test) = &report.noise_test {
                        " They say that it is " (test.estimate()) ", and the σ are from it."
                    }
                }
            }
        }
        @if let Some(origin) = origin { p.origin { (origin) } }
    }
}

fn verdict(report: &CalibrationReport) -> Markup {
    let tile = |name: &str, before: f64, after: f64| {
        html! {
            div.tile {
                div.name { (name) }
                div.value { (millimetres(after)) }
                div.was { "before: " (millimetres(before)) }
            }
        }
    };
    let (before, after) = (&report.error_before, &report.error_after);
    html! {
        div.tiles {
            (tile("Position error over the samples, rms", before.rms, after.rms))
            (tile("Position error over the samples, max", before.max, after.max))
            div.tile {
                div.name { "Expected position error, one sigma over the workspace" }
                @match &report.workspace {
                    Some(comparison) => {
                        div.value { (millimetres(comparison.sigma)) }
                        div.was { "the calibration moves positions by "
                            (millimetres(comparison.change)) " rms" }
                    }
                    None => {
                        div.value { "unknown" }
                        div.was { "too few samples are left over to estimate it" }
                    }
                }
            }
        }
        @if report.warnings.is_empty() {
            p.good { "Calibrated. Nothing doubtful was found." }
        } @else {
            div.doubtful {
                p { "Calibrated, with " (count(report.warnings.len(), "doubt")) ":" }
                ul { @for warning in &report.warnings { li { (warning) } } }
            }
        }
    }
}

/// A length, or that it is not known.
fn millimetres(value: f64) -> String {
    if value.is_finite() {
        format!("{} mm", small(value))
    } else {
        "unknown".to_owned()
    }
}

fn residuals(report: &CalibrationReport) -> Result<Markup, PlotError> {
    let line = |name: &str, error: &PositionError| {
        html! {
            tr {
                th scope="row" { (name) }
                td { (millimetres(error.rms)) }
                td { (millimetres(error.max)) }
                td { @if let Some(line) = error.max_at_line { "line " (line) } }
                td { (error.unreachable) }
            }
        }
    };
    let residuals = figures::residuals(report);
    Ok(html! {
        @if let Some(residuals) = &residuals {
            (figure(residuals, &format!("Distance between the measured position and the one \
                computed from the joint angles; ringed: more than {OUTLIER:.0} times as far off as \
                the median sample."))?)
        }
        @if let Some(in_sigmas) = figures::residuals_in_sigmas(report) {
            (figure(&in_sigmas, &format!("The same after the calibration, in σ of the {} noise \
                at each pose; 1 is expected. Beyond the upper line is one sample in three \
                million, if the noise is right.",
                if report.before.noise.is_some() { "stated" } else { "estimated" }))?)
        }
        table {
            thead { tr {
                th {} th { "rms" } th { "max" } th { "max is in" } th { "out of reach" }
            } }
            tbody {
                (line("before", &report.error_before))
                (line("after", &report.error_after))
            }
        }
        (tables::samples(report))
    })
}

fn views(report: &CalibrationReport) -> Result<Markup, PlotError> {
    let views = poses::views(report);
    Ok(html! {
        div.views {
            @for view in &views { (figure(&view.figure, view.caption)?) }
        }
        p.note {
            "Measured positions in the robot's frame. Reachable: the convex hull of what the \
            calibrated robot reaches within the joint limits."
        }
    })
}

fn uncertain(map: &UncertaintyMap) -> Result<Markup, PlotError> {
    let at = map.sigma.max_at;
    Ok(html! {
        p {
            "One sigma of the position, from the covariance of the parameters, over all poses clear \
            of singularities: " b { (millimetres(map.sigma.rms)) } " rms, "
            b { (millimetres(map.sigma.max)) }
            (format!(" at worst, at x {:.0}, y {:.0}, z {:.0} mm.", at.x, at.y, at.z))
        }
        div.views {
            @for (slice, caption) in uncertainty::slices(map) { (figure(&slice, &caption)?) }
        }
        p.note { "Shades: one sigma of the position in mm, the same in all figures." }
    })
}

fn solution(report: &CalibrationReport) -> Markup {
    let arms = &report.outcome.robot.arms;
    let row = |name: &str, of: &dyn Fn(&ArmOutcome<f64>) -> String| {
        html! { tr { th scope="row" { (name) } @for arm in arms { td { (of(arm)) } } } }
    };
    html! {
        @if let (Some(noise), Some(test)) = (&report.before.noise, &report.noise_test) {
            p.note { "Noise: " (test.found(noise)) "." }
        }
        table {
            thead { tr { th {} @for arm in 1..=3 { th { "arm " (arm) } } } }
            tbody {
                (row("condition", &|arm| format!("{:.1}", arm.condition)))
                @if report.before.noise.is_some() {
                    (row("residual / stated noise", &|arm| format!("{:.3}", arm.residual_rms)))
                } @else {
                    (row("residual", &|arm| millimetres(arm.residual_rms)))
                    (row("estimated noise", &|arm| {
                        millimetres(arm.estimated_noise.unwrap_or(f64::NAN))
                    }))
                }
                (row("degrees of freedom", &|arm| format!("{:.1}", arm.degrees_of_freedom)))
                (row("iterations", &|arm| arm.iterations.to_string()))
                (row("stopped because", &|arm| termination_name(arm.termination).to_owned()))
                (row("started from", &|arm| start_name(arm.start).to_owned()))
            }
        }
    }
}

fn sensor_frame(report: &CalibrationReport) -> Markup {
    html! {
        @if let Some(frame) = &report.after.sensor_frame {
            section {
                h2 { "Sensor frame" }
                p { "X_sensor = rotation · X_robot + translation. The poses above are in the \
                     robot's frame, which the program chose so that the robot file fits the \
                     measured points best. A cyclic exchange of the joint columns cannot be \
                     detected, because a Delta has threefold symmetry." }
                table {
                    thead { tr { th colspan="3" { "rotation" } th { "translation, mm" } } }
                    tbody {
                        @for (row, shift) in frame.rotation.row_iter().zip(frame.translation.iter()) {
                            tr {
                                @for value in row.iter() { td { (format!("{value:.8}")) } }
                                td { (format!("{shift:.4}")) }
                            }
                        }
                    }
                }
            }
        }
    }
}
