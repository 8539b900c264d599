//! The report as one HTML file that opens from disk: everything it needs is in it.

mod figures;
mod poses;
mod uncertainty;

use super::names::solver_name;
use super::next::advice;
use super::suspected::{self, loss_name};
use super::{causes, expanded, sections, stream};
use crate::accuracy::position_error::SampleErrors;
use crate::accuracy::sampled::{MANY_ON_A_PAGE, in_words};
use crate::accuracy::uncertainty_map::UncertaintyMap;
use crate::calibration::report::CalibrationReport;
use crate::fit::options::Frame;
use crate::fit::outlier::OUTLIER;
use crate::render::page::{self, figure, tile};
use crate::render::plot::PlotError;
use crate::render::section::{Part, Section};
use crate::render::table::Table;
use crate::report::document::About;
use crate::text::joint;
use crate::text::numbers::{millimetres, small_or};
use crate::text::tolerance;
use crate::text::words::{capitalised, count};
use maud::{Markup, html};

/// So many samples or fewer are shown without being asked for.
const SHOWN: usize = 40;

/// The whole report.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub fn render(report: &CalibrationReport, about: &About) -> Result<String, PlotError> {
    let report = &report.clone().with_at_most(MANY_ON_A_PAGE);
    let title = format!("Calibration of {}", report.before.name);
    let mut parts: Vec<_> = suspected::section(report).into_iter().collect();
    parts.extend(stream::sections(report));
    parts.extend([
        parameters(report)?,
        residuals(report)?,
        unmodelled(report)?,
        views(report)?,
        conditions(report)?,
    ]);
    if let Some(map) = &report.uncertainty {
        parts.push(uncertain(map)?);
    }
    let expanded = report.expanded();
    parts.push(expanded::section(
        expanded.as_ref(),
        "the position",
        &report.before.robot,
    ));
    let joints = figure(
        &figures::joints(report),
        "Joint angles of the samples within the joint limits.",
    )?;
    parts.push(
        Section::new("What to measure next")
            .part(Part::List(advice(report)))
            .in_page(joints),
    );
    parts.extend(sections::sensor_frame(report));
    parts.push(expanded::glossary());
    let body = html! {
        h1 { (title) }
        (how(report, about.origin))
        @if let Some(document) = about.document { (document.page()) }
        (tiles(report))
        (expanded::page_verdict(about.acceptance))
        (sections::doubts(report))
        @for part in &parts { (part) }
    };
    Ok(page::render(&title, &body))
}

fn how(report: &CalibrationReport, origin: Option<&str>) -> Markup {
    let options = &report.options;
    let drive = report.before.robot.drive();
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
            (capitalised(options.method.title())) " method"
            ", " (solver_name(options.solver))
            @if options.no_guess { ", without a guess" }
            @if options.loss.is_some() { ", loss " (loss_name(options.loss)) }
            ". "
            @match &report.before.tolerance {
                Some(stated) => {
                    "Tolerance: " (tolerance::in_words(drive, stated)) ". "
                }
                None => { "No tolerance stated. " }
            }
            @match &report.before.noise {
                Some(noise) => {
                    "Noise: " (noise.position()) " mm and "
                    (joint::in_file(drive, noise.joint())) (joint::mark(drive)) "."
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

fn tiles(report: &CalibrationReport) -> Markup {
    let over_samples = |name: &str, before: f64, after: f64| {
        let before = format!("before: {}", millimetres(before));
        tile(name, &millimetres(after), &before)
    };
    let (before, after) = (&report.error_before, &report.error_after);
    let expected = report.uncertainty.as_ref().map_or_else(
        || "unknown".to_owned(),
        |map| millimetres(map.expected.absolute.rms),
    );
    let note = report.workspace.map_or_else(
        || "too few samples are left over to estimate it".to_owned(),
        |comparison| {
            let change = millimetres(comparison.change);
            format!("standard uncertainty, k = 1; the calibration moves positions by {change} rms")
        },
    );
    let expanded = report.expanded();
    html! {
        div.tiles {
            (over_samples("Position error over the samples, rms", before.rms, after.rms))
            (over_samples("Position error over the samples, max", before.max, after.max))
            (tile("Expected position error over the workspace, rms", &expected, &note))
            @if let Some(expanded) = &expanded {
                (tile(
                    "Expanded uncertainty over the workspace, rms",
                    &millimetres(expanded.rms),
                    &expanded::factor(&expanded.coverage),
                ))
            }
        }
    }
}

fn parameters(report: &CalibrationReport) -> Result<Section, PlotError> {
    let section = sections::parameters(report);
    Ok(match figures::parameters(report) {
        Some((changes, caption)) => section.after(figure(&changes, caption)?),
        None => section,
    })
}

fn residuals(report: &CalibrationReport) -> Result<Section, PlotError> {
    let mut section = Section::new("Position error of each sample");
    if report.sampled.is_some() {
        let shown = in_words(report.sample_errors.len(), report.samples);
        section = section.note(format!("Figures and table show {shown}."));
    }
    if let Some(residuals) = figures::residuals(report) {
        let caption = format!(
            "Distance between the measured position and the one computed from the joint angles, before and \
             after the calibration; dashed: the rms of each. A ring: the sample stands out, because it is more than \
             {OUTLIER:.0} times as far off as the median sample, or left out."
        );
        section = section.in_page(figure(&residuals, &caption)?);
    }
    if let Some(in_sigmas) = figures::residuals_in_sigmas(report) {
        let noise = match report.before.noise {
            Some(_) => "stated",
            None => "estimated",
        };
        let caption = format!(
            "The same after the calibration, in σ of the {noise} noise at each pose; 1 is expected. \
             Beyond the line \"hardly by chance\" is one sample in three million, if the noise is right."
        );
        section = section.in_page(figure(&in_sigmas, &caption)?);
    }
    let section = section.table(sections::positions(report));
    Ok(section.table(samples(report)))
}

fn samples(report: &CalibrationReport) -> Table {
    let drive = report.before.robot.drive();
    let of_joint = |joint: usize| {
        move |sample: &&SampleErrors| {
            format!(
                "{:.3}",
                joint::in_file(drive, sample.measured.joints[joint])
            )
        }
    };
    let [q1, q2, q3] = joint::names(drive).map(|name| name.replace("deg", "°"));
    let coordinate = |axis: usize| {
        move |sample: &&SampleErrors| format!("{:.3}", sample.measured.position[axis])
    };
    Table::of(&report.sample_errors)
        .column("line", |sample| sample.line)
        .column(q1, of_joint(0))
        .column(q2, of_joint(1))
        .column(q3, of_joint(2))
        .column("x, mm", coordinate(0))
        .column("y, mm", coordinate(1))
        .column("z, mm", coordinate(2))
        .column("before, mm", |sample| {
            small_or("out of reach", sample.before)
        })
        .column("after, mm", |sample| small_or("out of reach", sample.after))
        .column_if(report.noise.is_some(), "after, σ", |sample| {
            let sigmas = sample.after_in_sigmas;
            sigmas.map_or_else(String::new, |sigmas| format!("{sigmas:.2}"))
        })
        .column("", |sample| {
            if sample.weight.suspected {
                "suspected"
            } else if report.stands_out(sample) {
                "stands out"
            } else {
                ""
            }
        })
        .rows_standing_out(|sample| report.stands_out(sample))
        .table()
        .folded(
            if report.sampled.is_some() {
                in_words(report.sample_errors.len(), report.samples)
            } else {
                format!("All {} samples", report.samples)
            },
            report.samples <= SHOWN,
        )
}

fn unmodelled(report: &CalibrationReport) -> Result<Section, PlotError> {
    let section = causes::page_section(report);
    let figures = figures::closures(report);
    if figures.is_empty() {
        return Ok(section);
    }
    let curves = report.causes.arms.iter().any(|arm| !arm.curves.is_empty());
    let note = if curves {
        "What is left of each arm's closure error along its forearm, over its joint's angle or travel, with the \
         parameters that fit best beside the causes found. Line: the causes found in this joint, where \
         the other joints have their mean values."
    } else {
        "What is left of each arm's closure error along its forearm, over its joint's angle or travel. A curve in \
         these points is an error of the joint that the model does not hold."
    };
    let panels = html! {
        div.views {
            @for (panel, caption) in &figures { (figure(panel, caption)?) }
        }
    };
    Ok(section.in_page(panels).note(note))
}

fn views(report: &CalibrationReport) -> Result<Section, PlotError> {
    let views = poses::views(report);
    let views = html! {
        div.views { @for view in &views { (figure(&view.figure, view.caption)?) } }
    };
    Ok(Section::new("Poses").in_page(views).note(
        "Measured positions in the robot's frame. Reachable: the convex hull of what the calibrated \
         robot reaches within the joint limits.",
    ))
}

fn conditions(report: &CalibrationReport) -> Result<Section, PlotError> {
    let conditions = figure(
        &figures::conditions(report),
        "A condition below 100 is good. Beyond 1000 the \
                                                   poses hardly distinguish some parameters.",
    )?;
    let section = sections::solution(report).after(conditions);
    Ok(match (&report.before.noise, &report.noise_test) {
        (Some(noise), Some(test)) => section.note(format!("Noise: {}.", test.found(noise))),
        _ => section,
    })
}

fn uncertain(map: &UncertaintyMap) -> Result<Section, PlotError> {
    let absolute = &map.expected.absolute;
    let (rms, max, at) = (absolute.rms, absolute.max, absolute.max_at);
    let intrinsic = map.expected.intrinsic.rms;
    let slices = html! {
        p {
            "Expected position error (one standard deviation), from the covariance of the parameters, over all \
            poses clear of singularities: " b { (millimetres(rms)) } " rms, " b { (millimetres(max)) }
            (format!(" at worst, at x {:.0}, y {:.0}, z {:.0} mm.", at.x, at.y, at.z))
            " If the robot's place in space does not count, " b { (millimetres(intrinsic)) }
            " rms remain."
        }
        div.views {
            @for (slice, caption) in uncertainty::slices(map) { (figure(&slice, &caption)?) }
        }
    };
    Ok(Section::new("How uncertain the calibrated positions are")
        .in_page(slices)
        .note("Shades: one standard deviation of the position at that place, in mm; the same shades in all figures. \
              The rms of a figure is that over its plane alone."))
}
