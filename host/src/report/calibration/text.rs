//! Text shared by the terminal and the HTML page.

use super::{ArmReport, ParameterReport, Report, TargetReport, TiltReport};
use crate::accuracy::budget::Contribution;
use crate::effects::EffectKind;
use crate::finding::Level;
use crate::fit::Frame;
use crate::judge::credibility::NoiseVerdict;
use crate::render::{Part, Section, Table, terminal};
use crate::report::repeatability;
use crate::text::{count, freedom, list, mean_rms_worst, probability, significant, small};
use nalgebra::Vector3;

/// Explains what the expanded uncertainty covers.
pub(super) const CONTENTS: &str = "The error in space of 95 % of the positions over the workspace is within the expanded uncertainty: a quantile of its \
    length (JCGM 102), not a multiple of the rms. It covers the sources of the budget and the errors found in the residuals. It excludes \
    load, speed and temperatures other than those of the measurement.";

/// The whole report for a terminal.
pub(super) fn render(report: &Report) -> String {
    let mut sections = vec![heading(report), parameters(report), errors(report)];
    sections.extend([noise(report), expected(report)]);
    sections.extend(budget(report));
    sections.extend(causes(report));
    sections.extend(report.repeatability.as_ref().map(repeatability));
    sections.extend(places(report));
    sections.extend(next(report));
    sections.push(findings(report));
    sections.extend(limit(report));
    terminal::text(sections)
}

fn or_blank(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |own| own.to_string())
}

/// "robot.toml calibrated from samples.csv", with the method.
pub(super) fn how(report: &Report) -> String {
    let frame = match report.frame {
        Frame::Base => "",
        Frame::Sensor => " in the sensor frame",
    };
    let loss = report
        .loss
        .map_or_else(String::new, |loss| format!(", {loss} loss"));
    let stated = match (
        report.before.tolerance.is_some(),
        report.solution.noise.iter().all(|own| own.stated),
    ) {
        (true, true) => "tolerance and noise stated",
        (true, false) => "tolerance stated, noise estimated",
        (false, true) => "noise stated, no tolerance",
        (false, false) => "no tolerance, noise estimated",
    };
    format!(
        "{} ({}){frame}; {} method{loss}; {stated}",
        count(report.sample_count, "sample"),
        count(report.reading_count, "reading"),
        report.method.title()
    )
}

fn heading(report: &Report) -> Section {
    let title = format!(
        "{} calibrated from {}",
        report.robot_file, report.samples_file
    );
    let convention = report.convention.as_ref();
    Section::new(title)
        .text(how(report))
        .texts(convention.map(|own| format!("Convention: {own}.")))
        .texts(report.origin)
}

pub(super) fn parameters(report: &Report) -> Section {
    type Row<'a> = (&'a ArmReport, &'a ParameterReport);
    let rows = report.arms.iter().flat_map(|arm| {
        let all = arm.parameters.iter().chain(&arm.upper_arm);
        all.map(move |own| (arm, own))
    });
    let rows: Vec<_> = rows.collect();
    let each = rows.len() / report.arms.len().max(1);
    let stated = report.before.tolerance.is_some();
    // Scales have no unit and need more decimals.
    let decimals = |own: &ParameterReport| if own.unit.is_empty() { 6 } else { 4 };
    let table = Table::of(rows)
        .column("arm", |(arm, _): &Row<'_>| arm.arm)
        .column("parameter", |(_, own)| own.symbol)
        .vector(["before", "after", "change", "σ"], |(_, own)| {
            let decimals = decimals(own);
            let [before, after, sigma] =
                [own.before, own.after, own.sigma].map(|own| format!("{own:.decimals$}"));
            [before, after, format!("{:+.decimals$}", own.change), sigma]
        })
        .column("unit", |(_, own)| own.unit)
        .column_if(stated, "by tolerance", |(_, own)| {
            format!("{:.0} %", 100.0 * own.prior_share)
        })
        .table()
        .in_groups_of(each);
    let conditions = report.arms.iter();
    let conditions = conditions.map(|arm| format!("{:.0}", arm.condition));
    let mut section = Section::new("Parameters").table(table);
    if stated {
        section = section.note(
            "By tolerance: the share of a parameter that comes from the [tolerance], not the samples.",
        );
    }
    // Where a tolerance holds the robot's place, more readings make it worse.
    if !report.solution.is_absolute() {
        return section;
    }
    section.note(format!(
        "Condition of each arm: {} (below 100 is good).",
        list(&conditions.collect::<Vec<_>>())
    ))
}

pub(super) fn errors(report: &Report) -> Section {
    let mut section = Section::new("Errors over the samples, mm");
    if let Some(error) = &report.position_error_mm {
        let table = Table::of([("before", &error.before), ("after", &error.after)])
            .column("distance of positions", |(when, _)| *when)
            .column("rms", |(_, own)| small(own.rms))
            .column("median", |(_, own)| small(own.median))
            .column("max", |(_, own)| small(own.max))
            .column("in line", |(_, own)| or_blank(own.max_at_line))
            .column_if(
                error.before.unreachable + error.after.unreachable > 0,
                "out of reach",
                |(_, own)| own.unreachable,
            );
        section = section.table(table);
    }
    let table = Table::of(&report.residuals)
        .column("residuals of", |own| own.kind.plural())
        .column("readings", |own| own.readings)
        .column("before, rms", |own| small(own.before_rms_mm))
        .column("after, rms", |own| small(own.after_rms_mm))
        .column("max", |own| small(own.after_max_mm))
        .column("in line", |own| or_blank(own.max_at_line));
    section.table(table)
}

pub(super) fn noise(report: &Report) -> Section {
    let table = Table::of(&report.noise)
        .column("noise of", |own| own.kind.plural())
        .column("stated, mm", |own| {
            own.stated_mm
                .map_or_else(|| "estimated".to_owned(), |sigma| significant(sigma, 3))
        })
        .column("residuals show, mm", |own| significant(own.sigma_mm, 2))
        .column("95 % limits", |own| {
            own.limits_mm.map(|own| significant(own, 2)).join("–")
        })
        .column("deg. of freedom", |own| {
            format!("{:.1}", own.degrees_of_freedom)
        })
        .column("p", |own| match own.verdict {
            NoiseVerdict::Estimated => String::new(),
            _ => probability(own.probability),
        });
    let by = report.sigma_widened_by;
    let widened =
        (by > 1.0).then(|| format!("The readings' part of every σ is multiplied by {by:.2}."));
    Section::new("Noise").table(table).texts(widened)
}

pub(super) fn expected(report: &Report) -> Section {
    let section = Section::new("Expected position error of the calibrated robot, mm (σ)");
    let Some(own) = &report.expected_error else {
        return section.text("Unknown: no pose is clear of singularities.");
    };
    let at = |[x, y, z]: [f64; 3]| format!("x {x:.0}, y {y:.0}, z {z:.0}");
    let cells = |rms, worst, place| [significant(rms, 2), significant(worst, 2), at(place)];
    let table = Table::new(["", "rms over workspace", "worst", "at"])
        .row(
            "absolute, in the frame of the base",
            cells(
                own.absolute_rms_mm,
                own.absolute_worst_mm,
                own.absolute_worst_at_mm,
            ),
        )
        .row(
            "relative, after the best rigid motion",
            cells(
                own.relative_rms_mm,
                own.relative_worst_mm,
                own.relative_worst_at_mm,
            ),
        );
    let over = match &report.before.within {
        Some(_) => "Over the region of use.".to_owned(),
        None => format!(
            "Over all that the robot reaches: relative {} mm in the outermost tenth, {} mm in the rest. State the region of \
             use in [workspace].",
            significant(own.relative_outermost_mm, 2),
            significant(own.relative_others_mm, 2)
        ),
    };
    let expanded = report.expanded_uncertainty.as_ref().map(|own| {
        let freedom = own.degrees_of_freedom.map(freedom);
        let freedom = freedom.map_or_else(String::new, |own| format!(", {own}"));
        format!(
            "Expanded uncertainty ({}): 95 % of positions within {} mm, {} mm at the worst place (k = {:.2}{freedom}).",
            own.of,
            significant(own.workspace_mm, 2),
            significant(own.worst_mm, 2),
            own.coverage_factor
        )
    });
    let harm = report.workspace.as_ref().and_then(|own| {
        let chance = probability(own.chance_of_harm?);
        let both = [own.absolute_chance_of_harm, own.relative_chance_of_harm];
        let both = match both.map(|own| own.map(probability)) {
            [Some(absolute), Some(relative)] => {
                format!(" (absolute {absolute}, relative {relative})")
            }
            _ => String::new(),
        };
        Some(format!(
            "The calibration moves positions by {} mm rms. Chance that it makes the robot worse: {chance}{both}.",
            significant(own.change, 2)
        ))
    });
    let section = section.table(table).text(over);
    section.texts(expanded).texts(harm)
}

/// What each source contributes to the expected error.
pub(super) fn budget(report: &Report) -> Option<Section> {
    let two = |value: f64| significant(value, 2);
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let absolute = report.solution.is_absolute();
    let stated = report
        .budget
        .iter()
        .any(|own| own.without_absolute_mm.is_some());
    let part = |own: &Contribution| {
        if absolute {
            own.absolute_mm
        } else {
            own.relative_mm
        }
    };
    let table = Table::of(&report.budget)
        .column("uncertainty due to", |own| own.source.clone())
        .column("type", |own| own.kind)
        .column("σ", |own| {
            let unit = own.unit.replace("deg", "°");
            or_blank(own.sigma.map(|sigma| format!("{} {unit}", two(sigma))))
        })
        .column("mm per unit", |own| {
            or_blank(own.sigma.map(|sigma| two(part(own) / sigma)))
        })
        .column("absolute, mm", |own| two(own.absolute_mm))
        .column("of variance", |own| percent(own.absolute_share))
        .column("relative, mm", |own| two(own.relative_mm))
        .column("of its variance", |own| percent(own.relative_share))
        .column_if(stated, "if it were exact", |own| {
            or_blank(own.without_absolute_mm.map(two))
        })
        .column_if(stated, "if it were exact, relative", |own| {
            or_blank(own.without_relative_mm.map(two))
        })
        .table();
    let own = report.expected_error?;
    let (absolute_mm, relative_mm) = (two(own.absolute_rms_mm), two(own.relative_rms_mm));
    let mut table = table.row(
        "combined",
        ["", "", "", &absolute_mm, "100 %", &relative_mm, "100 %"],
    );
    if let Some(expanded) = &report.expanded_uncertainty {
        let mut cells = vec![String::new(); if absolute { 3 } else { 5 }];
        cells.push(two(expanded.workspace_mm));
        table = table.row("expanded, 95 %", cells);
    }
    if let Some(rods) = &report.unknown_rods {
        let both = |absolute: f64, relative: f64| {
            let [absolute, relative] = [absolute, relative].map(two);
            [String::new(), absolute, String::new(), relative]
        };
        let name = format!(
            "not combined: rods that differ, {} mm apart",
            rods.spacing_mm
        );
        let sigma = rods.difference_mm;
        let cells = ["B".to_owned(), format!("{sigma} mm")];
        let own_cells = both(rods.absolute_mm, rods.relative_mm);
        table = table.row(name, cells.into_iter().chain(own_cells));
        let total = both(
            own.absolute_rms_mm.hypot(rods.absolute_mm),
            own.relative_rms_mm.hypot(rods.relative_mm),
        );
        let empty = [String::new(), String::new()];
        table = table.row("combined with that", empty.into_iter().chain(total));
    }
    let title = "Uncertainty budget of a position, rms over the workspace (σ)";
    (!report.budget.is_empty()).then(|| Section::new(title).table(table))
}

/// Position errors before and after, side by side.
pub(super) fn found_and_left(report: &Report) -> Option<Section> {
    let table = Table::of(&report.found_and_left)
        .column("over", |own| own.over)
        .column("error along", |own| own.of)
        .vector(["as found: mean", "rms", "worst"], |own| {
            mean_rms_worst(own.found_mm)
        })
        .vector(["as left: mean", "rms", "worst"], |own| {
            mean_rms_worst(own.left_mm)
        });
    let frame = if report.solution.is_absolute() {
        "in the frame of the base"
    } else {
        "after the best rigid motion"
    };
    let section = table.table().in_groups_of(4);
    let section = section.under("Position errors as found and as left, mm")?;
    Some(section.note(format!(
        "Position less the one that the controller computes. Over the workspace {frame}: as found, from the calibrated robot; as \
         left, its standard uncertainty."
    )))
}

/// The causes found, or the reason why none was looked for.
pub(super) fn causes(report: &Report) -> Option<Section> {
    let section = Section::new("Errors that the model cannot represent");
    if let Some(why) = report.causes.not_tested {
        return Some(section.text(format!("Not tested: {why}.")));
    }
    if report.causes.found.is_empty() {
        return None;
    }
    let table = Table::of(&report.causes.found)
        .column("cause", |cause| cause.kind.name().replace('_', " "))
        .column("arm", |cause| or_blank(cause.arm))
        .column("size", |cause| significant(cause.size, 3))
        .column("σ", |cause| significant(cause.sigma, 2))
        .column("unit", |cause| cause.unit)
        .column("p", |cause| probability(cause.p));
    Some(section.table(table).text(format!(
        "They add {} mm rms to the calibrated positions over the workspace.",
        significant(report.causes.position_error, 2)
    )))
}

/// That no cause was found, with a list of those tested.
pub(super) fn no_causes(report: &Report) -> Section {
    let kinds = EffectKind::all(report.before.robot.drive());
    let kinds: Vec<_> = kinds.map(|kind| kind.name().replace('_', " ")).collect();
    Section::new("Errors that the model cannot represent")
        .text(format!("None found. Tested: {}.", list(&kinds)))
}

/// Where the sensor, the datum, targets, planes and points are, and what the transmissions and rods do.
pub(super) fn places(report: &Report) -> impl Iterator<Item = Section> {
    let frame = report.sensor_frame.as_ref().map(|frame| {
        let [x, y, z] = frame.translation_mm;
        let row = |[a, b, c]: [f64; 3]| format!("[{a:.9}, {b:.9}, {c:.9}]");
        let rows = frame.rotation.map(row).join(", ");
        Section::new("Sensor frame (X_sensor = rotation · X_robot + translation)").text(format!(
            "translation [{x:.4}, {y:.4}, {z:.4}] mm, rotation [{rows}]"
        ))
    });
    let mm = |own: f64| format!("{:+.3}", own + 0.0);
    let datum = Table::of(&report.datum)
        .column("datum point", |own| own.name.clone())
        .vector(["off x, mm", "y", "z"], |own| own.off_mm.map(mm))
        .column("distance", |own| {
            format!("{:.3}", Vector3::from(own.off_mm).norm())
        });
    let stated = |own: &TargetReport| {
        let [x, y, z] = own.stated_mm;
        let [a, b, c] = own.sigma_mm;
        format!("{x}, {y}, {z} ± {a}, {b}, {c}")
    };
    let targets = Table::of(&report.targets)
        .column("target", |own| own.name.clone())
        .column("stated x, y, z, mm (σ)", |own| stated(own))
        .column("found less stated, mm", |own| {
            own.moved_mm
                .map_or_else(|| "not determined".to_owned(), |own| own.map(mm).join(", "))
        });
    let planes = Table::of(&report.planes)
        .column("plane", |own| own.name.clone())
        .column("z at the axis, mm", |own| format!("{:.4}", own.z_mm))
        .column("tilt, °", |own| format!("{:.3}", own.tilt_deg));
    let points = Table::of(&report.points)
        .column("point", |own| own.name.clone())
        .vector(["x, mm", "y, mm", "z, mm"], |own| {
            own.place_mm.map(|own| format!("{own:.3}"))
        })
        .column("offset, mm", |own| format!("{:.4}", own.offset_mm));
    let names = ["gain", "cos, °", "sin, °", "cos 2q, °", "sin 2q, °"];
    let transmissions = Table::of(&report.transmissions)
        .column("arm", |own| own.arm)
        .vector(names, |own| with_sigmas(own.numbers, own.sigmas))
        .column("once a turn, °", |own| {
            significant(own.first_harmonic_deg, 2)
        });
    let sections = [
        frame,
        datum.under("Datum points, measured less stated"),
        targets.under("Targets"),
        planes.under("Planes"),
        points.under("Points"),
        transmissions.under("Transmissions"),
        report.tilt.as_ref().map(tilt),
    ];
    sections.into_iter().flatten()
}

fn with_sigmas<const N: usize>(numbers: [f64; N], sigmas: [f64; N]) -> [String; N] {
    std::array::from_fn(|place| {
        let (number, sigma) = (numbers[place], sigmas[place]);
        format!("{} ± {}", significant(number, 3), significant(sigma, 1))
    })
}

/// The rods, and the tilt that they give the platform.
fn tilt(own: &TiltReport) -> Section {
    let names = [
        "rod difference, mm",
        "spacing difference, mm",
        "axis yaw, °",
        "axis roll, °",
    ];
    let table = Table::of(&own.arms)
        .column("arm", |own| own.arm)
        .vector(names, |own| with_sigmas(own.numbers, own.sigmas));
    let title = format!(
        "Rods: the platform tilts by {} mrad, median over the workspace",
        significant(own.median_mrad, 2)
    );
    let section = Section::new(title).table(table);
    let Some(read) = &own.orientation else {
        return section;
    };
    let shown = read.shown_deg.map_or_else(String::new, |own| {
        format!("; residuals show {}°", significant(own, 2))
    });
    section.note(format!(
        "Rotations of {} with σ {}°{shown}.",
        count(read.rows, "row"),
        significant(read.used_deg, 2),
    ))
}

pub(super) fn next(report: &Report) -> Option<Section> {
    let title = Section::new("What to measure next");
    let frame = match report.frame {
        Frame::Base => "",
        Frame::Sensor => " --frame sensor",
    };
    let plan = format!(
        "delta-cal plan {} --samples {}{frame} --count 8",
        report.robot_file, report.samples_file
    );
    if report.next_poses.is_empty() {
        return Some(title.text(plan));
    }
    let expected = report.expected_error?;
    let (now, of) = if report.solution.is_absolute() {
        (expected.absolute_rms_mm, "expected error")
    } else {
        (expected.relative_rms_mm, "expected relative error")
    };
    let limiting = limiting(report, now);
    let last = report.next_poses.last();
    let Some(last) = last.filter(|own| own.expected_error_mm < now) else {
        return limiting.map(|own| title.text(own));
    };
    let names = report.before.convention.joint_names();
    let table = Table::of(&report.next_poses)
        .vector(names.each_ref().map(String::as_str), |own| {
            own.joints.map(|own| format!("{own:.1}"))
        })
        .column(format!("{of}, mm"), |own| {
            significant(own.expected_error_mm, 2)
        });
    let poses = format!(
        "x, y and z at these poses would lower the {of} from {} to {} mm.",
        significant(now, 2),
        significant(last.expected_error_mm, 2)
    );
    let more = (!report.solution.is_absolute()).then_some(plan);
    let others = limiting.into_iter().chain(more);
    Some(title.table(table).text(poses).texts(others))
}

/// What to measure in place of poses where a datum or a target makes most of the expected error.
fn limiting(report: &Report, now: f64) -> Option<String> {
    let largest = report.budget.first()?;
    let absolute = report.solution.is_absolute();
    let (share, exact) = if absolute {
        (largest.absolute_share, largest.without_absolute_mm?)
    } else {
        (largest.relative_share, largest.without_relative_mm?)
    };
    let what = match largest.source.as_str() {
        "datum" => "more datum points, or their coordinates more accurately",
        "scale" => {
            "a longer known distance, or the temperature of the robot, and state the [noise] scale"
        }
        _ => "the place of the target on the platform, or add a second target",
    };
    (share > MOST_OF_ALL).then(|| {
        format!(
            "Most of the expected error comes from the {}: measure {what}. Were it exact, the error would be {} in place of {} mm.",
            largest.source,
            significant(exact, 2),
            significant(now, 2)
        )
    })
}

/// Share of the variance of one source that is worth measuring first.
const MOST_OF_ALL: f64 = 0.5;

pub(super) fn findings(report: &Report) -> Section {
    let of = |level: Level| -> Vec<String> {
        let own = report.findings.iter().filter(|own| own.level == level);
        own.map(|own| own.text.clone()).collect()
    };
    let (warnings, notes) = (of(Level::Warning), of(Level::Note));
    let verdict = if warnings.is_empty() {
        Part::Good("Calibrated, no warnings.".to_owned())
    } else {
        let heading = format!("Calibrated, with {}:", count(warnings.len(), "warning"));
        Part::Doubts(heading, warnings)
    };
    let section = Section::new("").part(verdict);
    if notes.is_empty() {
        section
    } else {
        section.part(Part::List(notes))
    }
}

/// Whether the limit is met, if there is one.
pub(super) fn limit(report: &Report) -> Option<Section> {
    let (passed, figures) = verdict(report)?;
    Some(Section::new("").part(Part::verdict(passed, figures)))
}

/// Whether the limit is met, and the sentence that says so.
pub(in crate::report) fn verdict(report: &Report) -> Option<(bool, String)> {
    let own = report.acceptance?;
    let figures = match report.expanded_uncertainty {
        None => "the expanded uncertainty is unknown".to_owned(),
        Some(expanded) => format!(
            "expanded uncertainty ({}) {} mm for 95 % of positions, limit {} mm",
            expanded.of,
            significant(expanded.workspace_mm, 2),
            own.limit_mm
        ),
    };
    let verdict = if own.passed { "Pass" } else { "Fail" };
    Some((own.passed, format!("{verdict}: {figures}.")))
}
