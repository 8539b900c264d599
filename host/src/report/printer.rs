//! What the report of a printer says: at most six statements in its owner's words, the lines to paste, then the details.

use super::calibration::{Report, verdict};
use crate::calibration::refusal::{CalibrateError, Refused};
use crate::files::{InputError, Kind};
use crate::finding::Level;
use crate::fit::solution::KindNoise;
use crate::import::{Firmware, Imported};
use crate::order;
use crate::printer::{
    ACROSS, Change, DOUBTFUL, Map, Next, Off, Printer, alike, bad_touch, common_scale,
    contradicted_length, contradicting, lack_of_fit, worst_reading,
};
use crate::render::page::figure;
use crate::render::plot::{Axis, Colour, Figure, Shape};
use crate::render::terminal::wrapped;
use crate::text::{count, list, probability, significant};
use maud::html;
use serde::Serialize;
use std::fmt::Write;

/// Measurements that make the expected error smaller by less than this part are not proposed.
const WORTH: f64 = 0.1;
/// A change below this is none, mm or degrees.
const CHANGED: f64 = 0.01;

/// Shades of a map to each side, the least step between them, mm, and one place of so many with a line.
const SHADES: u32 = 4;
const LEAST_SHADE: f64 = 0.005;
const EVERY: usize = 13;
/// Readings that are so many times noisier than usual are no printer's.
const UNEXPLAINED: f64 = 20.0;
/// Lines after which the bed is less certain are not printed, one σ, mm.
const UNCERTAIN: f64 = 1.0;

/// The calibration of a printer and what it means for its configuration.
#[derive(Debug, Clone, Serialize)]
pub struct PrinterReport {
    /// The calibration.
    #[serde(flatten)]
    pub calibration: Report,
    /// What the configuration is off, what to measure next, what to paste.
    pub printer: Printer,
}

impl PrinterReport {
    /// Of the printer whose configuration this is.
    ///
    /// # Errors
    /// Readings that no printer within the tolerance explains; a robot that its controller cannot hold.
    pub fn of(imported: &Imported, calibration: Report) -> Result<Self, CalibrateError> {
        let contradicted = || contradicted_length(imported, &calibration.solution);
        if let Some(refused) = bad_touch(imported).or_else(contradicted) {
            return Err(refused.into());
        }
        let worst = lack_of_fit(&calibration.solution);
        let scale = common_scale(imported);
        if worst > DOUBTFUL
            && scale.is_none()
            && let Some((names, left)) = contradicting(imported, &calibration.solution)
        {
            let names = list(&names);
            let cause =
                format!("Residuals are {worst:.1} × the usual, but {left:.1} × without {names}.");
            let remedy = format!(
                "Measure {names} again. With 16 or more readings, --robust leaves out those that disagree."
            );
            return Err(Refused::new(cause, remedy).into());
        }
        if worst > UNEXPLAINED {
            let cause = format!(
                "No printer within the tolerance explains these measurements (residuals {worst:.0} × the usual)."
            );
            let first = if imported.kinematics() != "delta" {
                "the gears (gear_ratio, microsteps), the arms' lengths"
            } else if imported.robot.robot == imported.configured {
                "the steps (rotation_distance, microsteps), the rods' length (--rods)"
            } else {
                "--rods or --radius"
            };
            let named = worst_reading(imported, &calibration.solution);
            let remedy = scale.unwrap_or_else(|| {
                format!(
                    "Check {first} and that nothing is loose. If all is right, measure {} again.",
                    named.as_deref().unwrap_or("everything")
                )
            });
            return Err(Refused::new(cause, remedy).into());
        }
        let (after, solution) = (&calibration.after, &calibration.solution);
        let printer = Printer::of(imported, after, solution);
        let printer = printer.map_err(|error| {
            InputError::new(&imported.robot.name, error.to_string()).with_remedy(error.remedy())
        })?;
        let sigma = printer.after.as_ref().map_or(0.0, |own| own.height_sigma);
        if sigma > UNCERTAIN {
            let [heights, distances] = imported.counts();
            let cause = format!(
                "The height of the bed is uncertain by {sigma:.1} mm (σ) from {}.",
                count(heights + distances, "reading")
            );
            let places = "Touch the bed at seven or more places all over it.";
            let remedy = match alike(imported) {
                Some(alike) => format!("{alike} {places}"),
                None => places.to_owned(),
            };
            return Err(Refused::new(cause, remedy).into());
        }
        Ok(Self {
            calibration,
            printer,
        })
    }

    /// For a terminal: numbered statements, what to paste, warnings, details.
    pub fn to_text(&self) -> String {
        let (report, printer) = (&self.calibration, &self.printer);
        let mut text = String::new();
        for (number, statement) in (1..).zip(statements(report, printer)) {
            let _ = writeln!(text, "{number}. {}", wrapped(&statement, "   "));
        }
        if let Some(lines) = &printer.lines {
            let _ = write!(text, "\n{lines}");
        }
        for note in &printer.notes {
            let _ = write!(text, "\n{}\n", wrapped(note, ""));
        }
        let warnings = report.findings.iter();
        // What rods do is said in the words of towers.
        for own in warnings.filter(|own| own.level == Level::Warning && own.kind != "rods_differ") {
            let _ = write!(text, "\nWarning: {}\n", wrapped(&own.text, ""));
        }
        text.push_str("\nDetails:\n");
        for own in details(report, printer) {
            let _ = writeln!(text, "- {}", wrapped(&own, "  "));
        }
        text
    }

    /// For programs.
    pub fn to_json(&self) -> String {
        super::json(self)
    }

    /// The same first, then the whole calibration.
    pub fn to_html(&self) -> String {
        let printer = &self.printer;
        self.calibration.to_html_below(&html! {
            ol { @for own in statements(&self.calibration, printer) { li { (own) } } }
            div.views { @for (drawn, caption) in maps(printer) { (figure(&drawn, caption)) } }
            @if let Some(lines) = &printer.lines { pre { (lines) } }
            @for note in &printer.notes { p.note { (note) } }
            ul { @for own in details(&self.calibration, printer) { li { (own) } } }
        })
    }
}

/// The nozzle above a flat bed as configured and with the lines pasted, the bed itself and the probe, in the same shades.
fn maps(printer: &Printer) -> Vec<(Figure, &'static str)> {
    let before = printer.before.as_ref().map(|own| &own.map);
    let after = printer.after.as_ref().filter(|_| printer.lines.is_some());
    let after = after.map(|own| &own.map);
    let all = || before.into_iter().chain(after).flatten();
    let highest = all().map(|(_, off)| off.z.abs()).fold(0.0, f64::max);
    let widest = all().map(|(_, off)| off.xy().norm()).fold(0.0, f64::max);
    let shade = (highest / f64::from(SHADES)).max(LEAST_SHADE);
    // Arrows as long as a tenth of the bed.
    let largest = 0.1 * printer.bed_radius_mm / widest.max(1e-6);
    let times = 10f64.powf(largest.log10().floor());
    let uneven = printer.uneven.as_ref().map(|own| &own.map);
    let bias = printer.effector.as_ref().map(|own| &own.map);
    let now = "The nozzle above a flat bed, as configured.";
    let then = "The nozzle above a flat bed, with the lines pasted.";
    let itself = "The bed itself: no line changes that.";
    let biased = "The bias of the probe, from the tilt of the effector.";
    let maps = [
        (before, "nozzle", now),
        (after, "nozzle", then),
        (uneven, "bed", itself),
        (bias, "probe", biased),
    ];
    let shown = maps.into_iter().filter_map(|(map, what, caption)| {
        Some((map_of(printer, map?, what, (shade, times)), caption))
    });
    shown.collect()
}

/// Heights about their mean as shades, x and y as lines, and the touches.
fn map_of(printer: &Printer, map: &Map, what: &str, (shade, times): (f64, f64)) -> Figure {
    let end = 1.05 * printer.bed_radius_mm;
    let axis = |label| Axis::linear(label, -end, end);
    let mut figure = Figure::new(axis("x, mm"), axis("y, mm")).sized(560, 520);
    let half = printer.bed_radius_mm / f64::from(ACROSS);
    let sides = [
        ("low", Colour::Blue, -1.0),
        ("high", Colour::Vermilion, 1.0),
    ];
    for (word, colour, sign) in sides {
        for class in 0..SHADES {
            let (from, to) = (shade * f64::from(class), shade * f64::from(class + 1));
            let tiles = map.iter().filter(|(_, off)| {
                let own = sign * off.z;
                own >= from && (own < to || class + 1 == SHADES)
            });
            let tiles = tiles.map(|([x, y], _)| [(x - half, y - half), (x + half, y + half)]);
            let tiles: Vec<_> = tiles.collect();
            let opacity = f64::from(class + 1) / f64::from(SHADES + 1);
            if !tiles.is_empty() {
                let name = format!("{what} {from:.3} to {to:.3} mm {word}");
                figure = figure.with(name, colour, Shape::Tiles(tiles, opacity));
            }
        }
    }
    let lines = map.iter().step_by(EVERY);
    let lines = lines.map(|([x, y], off)| [(*x, *y), (x + times * off.x, y + times * off.y)]);
    if printer.distances > 0 {
        let name = format!("x and y, {times} times");
        figure = figure.with(name, Colour::Grey, Shape::Segments(lines.collect()));
    }
    let touches = printer.touches.iter().map(|[x, y]| (*x, *y));
    figure
        .with("touches", Colour::Ink, Shape::Points(touches.collect()))
        .with_equal_scales()
}

/// What is wrong, how sure that is, what to do next, what the lines to paste do.
fn statements(report: &Report, printer: &Printer) -> Vec<String> {
    let mut lines = vec![measured(report, printer)];
    let after = printer.after.as_ref().filter(|_| printer.lines.is_some());
    if let Some(off) = printer.before.as_ref().filter(|_| printer.heights > 0) {
        let error = |off: &Off| {
            // What is not known may be more than the worst that is.
            let known = off.worst_height > off.height;
            let worst = known.then(|| format!(" ({:.2} mm worst)", off.worst_height));
            format!("{:.2} mm rms{}", off.height, worst.unwrap_or_default())
        };
        let (now, radius) = (error(off), printer.bed_radius_mm);
        let then = after.map(|off| {
            let (then, sigma) = (error(off), off.height_sigma);
            format!(" With the lines below: {then}, uncertain by {sigma:.2} mm (σ).")
        });
        let then = then.unwrap_or_default();
        lines.push(format!(
            "Bed error now: {now} within {radius:.0} mm of the centre.{then}"
        ));
    }
    lines.push(size(report, printer));
    if let Some(next) = &printer.next {
        lines.push(proposal(report, printer, next));
    }
    lines.extend(verdict(report).map(|(_, own)| own));
    lines.push(paste(printer));
    lines
}

/// The size of parts, which distances alone show.
fn size(report: &Report, printer: &Printer) -> String {
    if !report.determined.scale {
        let why = if report.after.instruments.distance_scale.is_some() {
            "uncertain: the shrinkage of prints is unknown (--shrinkage)"
        } else if printer.distances > 0 {
            "uncertain: the distances do not tell it from the lengths of the robot"
        } else {
            "not measured"
        };
        return format!("Part size is {why}.");
    }
    let hundred = |words, off: Option<&Off>| {
        let text = off.map(|off| format!("{words}{:.2} mm", off.hundred));
        text.unwrap_or_default()
    };
    let now = hundred("", printer.before.as_ref());
    let after = printer.after.as_ref().filter(|_| printer.lines.is_some());
    let then = hundred(", with the lines below as ", after);
    format!("100 mm come out as {now} now{then}.")
}

/// What the figures come from.
fn details(report: &Report, printer: &Printer) -> Vec<String> {
    let mut lines = vec![noise(report, printer)];
    if printer.lines.is_some() {
        lines.extend(changes(&printer.changes));
    }
    lines.push(format!(
        "The {} readings improve {} of {} parameter combinations; the rest stay at the tolerance.",
        printer.heights + printer.distances,
        report.determined.combinations,
        report.determined.of
    ));
    if let Some(next) = &printer.next {
        let before = printer.sigma_before_mm.map_or_else(String::new, |before| {
            format!("; {before:.2} mm before calibration")
        });
        lines.push(format!(
            "Expected position error: {:.2} mm rms over the printed area (σ){before}.",
            next.now
        ));
    }
    lines
}

fn measured(report: &Report, printer: &Printer) -> String {
    let kinds = [(printer.heights, "height"), (printer.distances, "distance")];
    let kinds = kinds.into_iter().filter(|(number, _)| *number > 0);
    let kinds: Vec<_> = kinds.map(|(number, kind)| count(number, kind)).collect();
    let kind = match printer.kinematics {
        "delta" => "Delta with towers",
        _ => "Delta with rotary arms",
    };
    let noted = !printer.notes.is_empty();
    let notes = noted.then_some(" (see the note below)");
    let (file, notes) = (&report.robot_file, notes.unwrap_or_default());
    format!("{file}: {kind}, {}{notes}.", list(&kinds))
}

/// The three largest changes of what the controller is told.
fn changes(changes: &[Change]) -> Option<String> {
    let by = |change: &Change| change.after - change.before;
    let changed = changes.iter().filter(|own| by(own).abs() >= CHANGED);
    let mut changed: Vec<_> = changed.collect();
    order::sort_by(&mut changed, |own| -by(own).abs());
    let largest = changed.iter().take(3);
    let largest = largest.map(|own| format!("{} {:+.2} {}", own.name, by(own), own.unit));
    let largest: Vec<_> = largest.collect();
    (!largest.is_empty()).then(|| format!("Largest changes: {}.", list(&largest)))
}

/// The noise that the readings show.
fn noise(report: &Report, printer: &Printer) -> String {
    // Without touches the bed is held as configured.
    let touched = |own: &&KindNoise| own.kind != Kind::Height || printer.heights > 0;
    let kinds = report.solution.noise.iter().filter(touched).map(|own| {
        let from = if own.stated {
            "stated".to_owned()
        } else {
            format!("estimated, {:.1} degrees of freedom", own.known)
        };
        let sigma = significant(own.sigma, 2);
        format!("{} {sigma} mm ({from})", own.kind.plural())
    });
    let kinds: Vec<_> = kinds.collect();
    let doubtful = printer.lack_of_fit > DOUBTFUL;
    let worst = printer.fits_worst.as_ref().filter(|_| doubtful);
    let worst = worst.map(|name| format!("; {name} fits worst"));
    format!("Noise of {}{}.", list(&kinds), worst.unwrap_or_default())
}

/// The one thing to do next, in the commands of the printer's firmware.
fn proposal(report: &Report, printer: &Printer, next: &Next) -> String {
    let places = next.heights.iter();
    let places = places.map(|[x, y]| format!("({}, {})", x.round() + 0.0, y.round() + 0.0));
    let places = places.collect::<Vec<_>>().join(" ");
    let klipper = printer.firmware == Firmware::Klipper;
    let touch = match printer.firmware {
        Firmware::Klipper if printer.heights == 0 => {
            "touch the bed at seven places (DELTA_CALIBRATE, then SAVE_CONFIG)".to_owned()
        }
        Firmware::Klipper => format!(
            "nozzle on a sheet of paper at x, y = {places} (DELTA_ANALYZE MANUAL_HEIGHT=0.1 at each)"
        ),
        Firmware::FluidNc | Firmware::GrblHal => format!(
            "touch the bed at x, y = {places} as well (G38.2), and give all answers [PRB:…] of the console"
        ),
        own => format!(
            "touch the bed at 16 places: delta-cal plan with --count 16 writes the {} commands",
            own.words().touch
        ),
    };
    if printer.heights == 0 {
        return format!("Measure next: {touch}.");
    }
    let print = if klipper {
        "print Klipper's docs/prints/calibrate_size.stl and measure its twelve distances (DELTA_ANALYZE)"
    } else {
        "print a long part, measure it with a calliper, and state its length (--printed 100=99.7)"
    };
    // One printed length is no substitute for twelve, but all that other firmware can be told.
    let object = next
        .with_object
        .filter(|_| klipper || printer.distances == 0);
    let both = [(object, print.to_owned()), (next.with_heights, touch)];
    let both = both
        .into_iter()
        .filter_map(|(error, proposal)| Some((error?, proposal)));
    let worthwhile = both.filter(|(error, _)| *error < (1.0 - WORTH) * next.now);
    let best = worthwhile.min_by(|one, other| one.0.total_cmp(&other.0));
    if let Some((_, proposal)) = best {
        return format!("Measure next: {proposal}.");
    }
    let known = report.determined.scale || printer.rods_measured;
    let otherwise = match (known, printer.kinematics) {
        (true, _) => "nothing".to_owned(),
        (false, "delta") => {
            let [arm, ..] = report.before.robot.arms();
            let rod = arm.lb();
            format!("the rods between their joints with a calliper (--rods {rod:.1}±0.1mm)")
        }
        (false, _) => format!(
            "the forearms between their joints with a calliper ({})",
            printer.firmware.words().forearm
        ),
    };
    format!(
        "Measure next: {otherwise}. More heights or printed distances would hardly improve the printer."
    )
}

fn paste(printer: &Printer) -> String {
    let chances = printer.better_probability.map(|own| {
        let flatter = own
            .height
            .map(|own| format!("{} chance of a flatter bed", probability(own)));
        let nearer = own
            .across
            .map(|own| format!("{} chance of better x and y", probability(own)));
        list(&flatter.into_iter().chain(nearer).collect::<Vec<_>>())
    });
    let chances = chances.filter(|own| !own.is_empty());
    if printer.lines.is_some() {
        let chances = chances.map(|own| format!(": {own}"));
        return format!("Paste the lines below{}.", chances.unwrap_or_default());
    }
    if let Some((touches, off)) = printer.agreeing {
        return format!(
            "Nothing to change: {} agree with the configuration to {} mm rms. Touch ten or more places to improve it.",
            count(touches, "height"),
            significant(off, 1)
        );
    }
    let chances = chances.map(|own| format!(" (best: {own})"));
    format!(
        "Nothing to change: no other parameters would print clearly better{}.",
        chances.unwrap_or_default()
    )
}
