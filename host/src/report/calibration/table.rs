//! The report for people at a terminal.

use super::names::solver_name;
use super::{causes, expanded, sections, stream, suspected};
use crate::calibration::report::CalibrationReport;
use crate::fit::options::Frame;
use crate::render::section::Section;
use crate::render::terminal;
use crate::report::document::About;
use crate::text::numbers::small;
use crate::text::words::count;

/// The whole report.
pub fn render(report: &CalibrationReport, about: &About) -> String {
    let mut parts = vec![summary(report), sections::parameters(report)];
    parts.extend(suspected::section(report));
    parts.extend(stream::sections(report));
    parts.extend(causes::section(report));
    parts.push(positions(report));
    parts.push(sections::solution(report));
    parts.extend(sections::sensor_frame(report));
    parts.push(doubts(report));
    parts.extend(expanded::limit(about.acceptance));
    terminal::text(parts)
}

fn summary(report: &CalibrationReport) -> Section {
    let stated = match (&report.before.tolerance, &report.before.noise) {
        (Some(_), Some(_)) => "tolerance and noise stated",
        (Some(_), None) => "tolerance stated, no noise",
        (None, Some(_)) => "noise stated, no tolerance",
        (None, None) => "no tolerance, no noise",
    };
    let no_guess = if report.options.no_guess {
        "; no guess"
    } else {
        ""
    };
    Section::new("")
        .text(format!(
            "{} calibrated from {}",
            report.before.name, report.samples_file
        ))
        .text(format!(
            "{} in the {} frame; {} method, {}; {stated}{no_guess}",
            count(report.samples, "sample"),
            match report.options.frame {
                Frame::Base => "robot's",
                Frame::Sensor => "sensor's",
            },
            report.options.method.title(),
            solver_name(report.options.solver),
        ))
}

fn positions(report: &CalibrationReport) -> Section {
    let expected = report.uncertainty.as_ref().map_or_else(
        || "unknown".to_owned(),
        |map| {
            let sigma = small(map.expected.absolute.rms);
            format!("{sigma} mm (one sigma, rms over the workspace)")
        },
    );
    let section = Section::new("")
        .table(sections::positions(report))
        .text(format!(
            "Expected position error of the calibrated robot: {expected}"
        ));
    match &report.uncertainty {
        Some(map) => {
            let at = map.expected.absolute.max_at;
            let most = small(map.expected.absolute.max);
            section
                .text(format!(
                    "at worst {most} mm, clear of singularities, at x {:.0}, y {:.0}, z {:.0} mm",
                    at.x, at.y, at.z
                ))
                .text(format!(
                    "of this {} mm (rms) remain if the robot's place in space does not count",
                    small(map.expected.intrinsic.rms)
                ))
                .text(expanded::sentence(
                    report.expanded().as_ref(),
                    "the position",
                ))
        }
        None => section,
    }
}

fn doubts(report: &CalibrationReport) -> Section {
    let section = Section::new("").part(sections::doubts(report));
    if report.before.noise.is_some() {
        return section;
    }
    let section = match &report.noise_test {
        Some(test) => section.text(format!(
            "The residuals show a noise of {}; the sigmas are computed from it.",
            test.estimate()
        )),
        None => section,
    };
    section.text(
        "Tip: state the [noise] in the robot file, to learn whether the residuals are credible.",
    )
}
