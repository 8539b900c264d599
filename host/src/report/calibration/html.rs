//! The report as one self-contained HTML file.

use super::{Report, figures, text};
use crate::fit::Frame;
use crate::render::page::{self, figure, tile};
use crate::render::{Section, Table};
use crate::report::repeatability;
use crate::text::{in_words, probability, significant, small_or};
use delta_cal::robot::Drive;
use maud::{Markup, html};

/// Up to this many samples, the table is open initially.
const SHOWN: usize = 40;
/// Most samples on a page.
const MOST: usize = 2500;

/// The whole report, with `first` at the top.
pub(super) fn render(report: &Report, first: Option<&Markup>) -> String {
    let title = format!("Calibration of {}", report.robot_file);
    let parameters = text::parameters(report);
    let mut parts: Vec<_> = text::found_and_left(report).into_iter().collect();
    parts.push(text::expected(report).note(text::CONTENTS));
    parts.extend(text::budget(report));
    parts.extend(report.repeatability.as_ref().map(repeatability));
    parts.extend(text::places(report));
    parts.extend([
        match figures::parameters(report) {
            Some((drawing, caption)) => parameters.after(figure(&drawing, caption)),
            None => parameters,
        },
        residuals(report),
        text::noise(report),
        text::causes(report).unwrap_or_else(|| text::no_causes(report)),
    ]);
    let body = html! {
        h1 { (title) }
        p {
            b { (report.robot_file) }
            @if report.samples_file != report.robot_file { " from " b { (report.samples_file) } }
            ": " (text::how(report)) "." (stated(report))
        }
        @if let Some(origin) = report.origin { p.origin { (origin) } }
        @if let Some(document) = &report.document { (document.page()) }
        // Those of a printer are over its printed area.
        @if first.is_none() { (tiles(report)) }
        @if let Some(limit) = text::limit(report) { (limit.note(RULE)) }
        @if let Some(first) = first { (first) }
        (text::findings(report))
        @for part in &parts { (part) }
        @if let Some(next) = text::next(report) { div.screen { (next) } }
        (glossary(report.before.robot.drive()))
        @if report.document.is_some() { (page::signature()) }
    };
    page::render(&title, &body)
}

const RULE: &str = "Decision rule: simple acceptance. Pass if the expanded uncertainty of the calibrated positions is at \
    most the limit.";

fn stated(report: &Report) -> String {
    let drive = report.before.robot.drive();
    let tolerance = report.before.tolerance.as_ref();
    let tolerance = tolerance.map_or_else(String::new, |own| {
        format!(" Tolerance: {}.", in_words(drive, own))
    });
    let frame = match report.frame {
        Frame::Base => "",
        Frame::Sensor => " The sensor frame was found with the parameters.",
    };
    let convention = report.convention.as_ref();
    let convention = convention.map_or_else(String::new, |own| format!(" Convention: {own}."));
    format!("{tolerance}{frame}{convention}")
}

fn tiles(report: &Report) -> Markup {
    let mm = |value: f64| format!("{} mm", significant(value, 2));
    html! {
        div.tiles {
            @if let Some(error) = &report.position_error_mm {
                (tile("Position error over the samples, rms", &mm(error.after.rms), &format!("before: {}", mm(error.before.rms))))
            } @else {
                @for own in &report.residuals {
                    (tile(
                        &format!("Residuals of {}, rms", own.kind.plural()),
                        &mm(own.after_rms_mm),
                        &format!("before: {}", mm(own.before_rms_mm)),
                    ))
                }
            }
            @if let Some(own) = &report.expected_error {
                (tile("Expected error, relative, rms", &mm(own.relative_rms_mm), "after the best rigid motion (σ)"))
                (tile("Expected error, absolute, rms", &mm(own.absolute_rms_mm), "in the frame of the base (σ)"))
            }
            @if let Some(own) = &report.expanded_uncertainty {
                (tile(
                    &format!("Expanded uncertainty, {}", own.of),
                    &mm(own.workspace_mm),
                    &format!("95 % of positions over the workspace, k = {:.2}", own.coverage_factor),
                ))
            }
            @if let Some(chance) = report.workspace.and_then(|own| own.chance_of_harm) {
                (tile("Chance of harm", &probability(chance), "that the robot is worse than before"))
            }
        }
    }
}

fn residuals(report: &Report) -> Section {
    let mut section = text::errors(report);
    if let Some(residuals) = figures::residuals(report) {
        let caption = "Distance of each position, or the largest residual of other readings, before and after.";
        section = section.in_page(figure(&residuals, caption));
    }
    section.table(samples(report))
}

fn samples(report: &Report) -> Table {
    let convention = &report.before.convention;
    let named = report.samples.iter().any(|own| own.name.is_some());
    let positions = report.samples.iter().any(|own| own.residual_mm.is_some());
    let off = |sample: &super::SampleReport, axis: usize| {
        let own = sample.residual_mm;
        own.map_or_else(String::new, |own| format!("{:+.4}", own[axis] + 0.0))
    };
    let names = convention
        .joint_names()
        .map(|name| name.replace("deg", "°"));
    Table::of(report.samples.iter().take(MOST))
        .column("line", |sample| sample.line)
        .column_if(named, "name", |sample| {
            sample.name.clone().unwrap_or_default()
        })
        .vector(names.each_ref().map(String::as_str), |sample| {
            let joints = convention.joints(&sample.joints);
            joints.map(|own| format!("{own:.3}"))
        })
        .column("before, mm", |sample| {
            small_or("out of reach", sample.error_before_mm)
        })
        .column("after, mm", |sample| {
            small_or("out of reach", sample.error_after_mm)
        })
        .column_if(positions, "x", |sample| off(sample, 0))
        .column_if(positions, "y", |sample| off(sample, 1))
        .column_if(positions, "z", |sample| off(sample, 2))
        .column("after, σ", |sample| {
            format!("{:.2}", sample.error_after_sigma)
        })
        .column("", |sample| if sample.suspected { "left out" } else { "" })
        .rows_standing_out(|sample| sample.suspected)
        .table()
        .folded(
            format!(
                "{} of {} samples",
                report.samples.len().min(MOST),
                report.sample_count
            ),
            report.sample_count <= SHOWN,
        )
}

/// What the parameters of arms that motors turn mean, and those of towers.
const TERMS: &str = include_str!("terms.txt");
const TOWER_TERMS: &str = include_str!("tower-terms.txt");

/// Explains the parameters, with a drawing of an arm.
fn glossary(drive: Drive) -> Section {
    let terms = match drive {
        Drive::Rotary => TERMS,
        Drive::Linear => TOWER_TERMS,
    };
    let terms = terms.lines().filter_map(|line| line.split_once(": "));
    Section::new("What the parameters mean").in_page(html! {
        @if drive == Drive::Rotary { (page::drawing()) }
        dl.terms { @for (name, meaning) in terms { dt { (name) } dd { (meaning) } } }
    })
}
