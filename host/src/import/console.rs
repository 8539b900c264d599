//! The answers of a firmware's console to probing, its saved maps, and tables of heights: touches of the bed.
//!
//! ```text
//! Klipper          probe at 10.000,20.000 is z=2.345        probe: at 10.000,20.000 bed will contact at z=2.345
//! Marlin           Bed X: 10.00 Y: 20.00 Z: 0.12            G33:  c:+0.36  x:+0.63  y:+0.21  z:-0.72
//! RepRapFirmware   G1 X10 Y20, then: Stopped at height 0.032 mm          heightmap.csv
//! Repetier         Z-probe:12.45 X:-80.00 Y:80.00           X: -80 0 80, then: y: 80 12.45 12.40 12.42
//! Smoothieware     PROBE: X:0.0000,Y:0.0000,Z:5.2410          G1 X10 Y20, then: Z:5.3087
//! FluidNC, grblHAL [PRB:10.000,20.000,-182.345:1]
//! tables           Bed probe heights: … after the G30 P… of bed.g; Bilinear Leveling Grid: where the bed's radius is known
//! a table          x_mm,y_mm,height_mm      of the nozzle on paper: x_mm,y_mm,paper_mm
//! ```

use super::stated::{Table, finite};
use super::{Firmware, Imported, OF_PROBE};
use crate::files::{InputError, InputText, Reading, Readings, Row};
use delta_cal::Real;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// The points of G33, with their directions, degrees, and distances from the centre relative to the radius: the centre,
/// the towers, and the points opposite them.
const POINTS: [(&str, f64, f64); 7] = [
    ("c:", 0.0, 0.0),
    ("x:", 210.0, 1.0),
    ("y:", 330.0, 1.0),
    ("z:", 90.0, 1.0),
    ("yz:", 30.0, 1.0),
    ("zx:", 150.0, 1.0),
    ("xy:", 270.0, 1.0),
];
/// Answers that state heights and no places.
const WITHOUT_PLACES: [&str; 5] = [
    "leveling grid",
    "mesh leveling probed",
    "bed probe heights",
    "\nox:",
    "\nmesh:",
];
/// Touches that all are this near the centre, as a part of the rods, may have their places in inches.
const NEAR: f64 = 0.03;
/// Places closer than this are the same, mm.
const SAME: f64 = 0.01;

/// What an answer names the place of; a paper is touched by the nozzle, everything else by the probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Named {
    Nozzle,
    Probe,
    Paper,
}

/// A touch of the bed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// The line of the answer.
    pub(super) line: u64,
    /// Its place, and the commanded z of the nozzle apart from an offset common to all touches, mm.
    pub(super) at: [f64; 3],
    pub(super) named: Named,
}

impl Touch {
    const fn of(named: Named, line: u64, at: [f64; 3]) -> Self {
        Self { line, at, named }
    }
}

/// The printer with the touches in the answers of a console, one for each place. Each height is their mean, which is the
/// probe's offset. `None` if there are no answers.
///
/// # Errors
/// Answers without places or with decimal commas; a place that the printer does not reach; G33 without the radius of its circle.
pub fn touched(imported: &Imported, text: &InputText) -> Result<Option<Imported>, InputError> {
    let content = text.text().to_ascii_lowercase();
    let read = table(text.name(), &content)?;
    let mut touches = match read.or_else(|| height_map(&content)) {
        Some(found) => found,
        None => answers(imported, text, &content)?,
    };
    touches.extend(repetier_map(&content));
    if touches.is_empty() {
        touches = probe_heights(&content);
    }
    if touches.is_empty()
        && let Some(radius) = imported.probed_radius
    {
        touches = grid(&content, radius);
    }
    if touches.is_empty() {
        let lines = format!("\n{content}");
        let hold = |own: &[&str]| own.iter().any(|own| lines.contains(own));
        let (cause, remedy) = if hold(&WITHOUT_PLACES) {
            (
                "these are heights without places",
                "put bed.g with its G30 P commands above them (G32), give Configuration.h as the configuration (M420 V), \
                 write a table x_mm,y_mm,height_mm with the places, or touch the bed by the commands of delta-cal plan \
                 and give that answer",
            )
        } else if hold(&["\nprobe\n", "\ng30 ", "factors using"]) {
            (
                "these are touches of the bed without the answers",
                "run the commands of delta-cal plan, save the console output, and give that",
            )
        } else {
            return Ok(None);
        };
        return Err(InputError::new(text.name(), cause).with_remedy(remedy));
    }
    with_touches(imported.clone(), text.name(), touches).map(Some)
}

/// The printer with these touches in place of its readings; with papers beside them.
pub(super) fn with_touches(
    imported: Imported,
    name: &str,
    touches: Vec<Touch>,
) -> Result<Imported, InputError> {
    let mut found: Vec<(Touch, f64)> = Vec::new();
    for own in touches {
        let same = |(last, _): &(Touch, f64)| {
            (last.at[0] - own.at[0]).hypot(last.at[1] - own.at[1]) < SAME
        };
        let repeated = found.last().is_some_and(same);
        match found.last_mut().filter(|_| repeated) {
            // Repeated touches of a place are averaged.
            Some((touch, count)) => {
                *count += 1.0;
                touch.at[2] += (own.at[2] - touch.at[2]) / *count;
            }
            None => found.push((own, 1.0)),
        }
    }
    let out = found.iter().map(|(own, _)| own.at[0].hypot(own.at[1]));
    let [arm, ..] = imported.configured.arms();
    let out = out.fold(0.0, f64::max);
    if found.len() > 2 && out < NEAR * arm.lb() {
        let cause = format!("all touches are within {out:.1} mm of the centre, or in inches");
        return Err(in_inches(name, found[0].0.line, cause));
    }
    let heights = found.iter().map(|(own, _)| own.at[2]);
    let mean = heights.sum::<f64>() / found.len() as f64;
    let [beside_x, beside_y] = imported.probe.offset.unwrap_or_default();
    let paper = found.iter().any(|(own, _)| own.named == Named::Paper);
    let mut readings = Readings::of_name(name);
    readings.planes = vec!["plane".to_owned()];
    for (own, _) in &found {
        let [mut x, mut y, z] = own.at;
        if own.named == Named::Probe {
            (x, y) = (x - beside_x, y - beside_y);
        }
        let joints = imported.configured.inverse(&Vector3::new(x, y, z));
        let joints = joints.map_err(|_| {
            InputError::new(name, "the printer does not reach this place")
                .at_line(own.line)
                .with_remedy(if imported.below_the_arms() {
                    "give heights in machine coordinates, as the answers [PRB:…] to G38.2 have them"
                } else {
                    "check that configuration and answers belong to the same printer"
                })
        })?;
        readings.rows.push(Row {
            line: own.line,
            value: Reading {
                height: Some((0, mean)),
                target: if paper { 0 } else { OF_PROBE },
                ..Reading::at(joints)
            },
        });
    }
    let asked = imported.probe.offset.is_none();
    let asked = asked && found.iter().any(|(own, _)| own.named == Named::Probe);
    let mut imported = imported.with_touches_of(readings, paper);
    if imported.below_the_arms() {
        imported = imported.on_a_bed_at(mean);
    }
    if asked {
        imported.notes.push(format!(
            "{name} names where the probe touched, and the configuration does not state where the probe is beside the \
             nozzle: it is taken to be below it. If it is not, add {}: 25 mm may change the bed by 0.05 mm.",
            imported.firmware.words().offset
        ));
    }
    Ok(imported)
}

fn in_inches(name: &str, line: u64, cause: impl Into<String>) -> InputError {
    InputError::new(name, cause).at_line(line).with_remedy(
        "send G21 (grblHAL: $13=0), touch all over the bed, and give that answer; tables are in mm",
    )
}

/// The touches that a console answered, line by line in lower case.
fn answers(imported: &Imported, text: &InputText, content: &str) -> Result<Vec<Touch>, InputError> {
    let mut touches = Vec::new();
    let mut commanded = [None; 2];
    let mut of_g33 = Vec::new();
    let of_smoothieware = imported.firmware == Firmware::Smoothieware;
    let mut lines: Vec<_> = (1..).zip(content.lines()).collect();
    if is_newest_first(content) {
        lines.reverse();
    }
    for (line, own) in lines {
        let after = |words: &str| own.find(words).map(|at| &own[at + words.len()..]);
        let number = |key: &str| after(key).and_then(first);
        let mut heights = ["z:", "z=", "stopped at height"].into_iter();
        if heights.any(|key| after(key).is_some_and(has_decimal_comma)) {
            return Err(InputError::new(text.name(), "a height has a decimal comma")
                .at_line(line)
                .with_remedy("write all decimals with a point"));
        }
        if own.split([' ', '\t', ';']).any(|word| word == "g20") {
            return Err(in_inches(text.name(), line, "the touches are in inches"));
        }
        let mut add = |of_probe: bool, at: [Option<f64>; 3]| {
            if let [Some(x), Some(y), Some(z)] = at {
                let named = [Named::Nozzle, Named::Probe][usize::from(of_probe)];
                touches.push(Touch::of(named, line, [x, y, z]));
            }
        };
        let [to_x, to_y] = commanded;
        if let Some(rest) = after("probe at ").or(after("probe: at ")) {
            let (x, y) = rest.split_once(',').unwrap_or_default();
            // Since January 2026 Klipper names the place of the probe.
            let of_probe = own.contains("bed will contact");
            add(of_probe, [first(x), first(y), number("z=")]);
        } else if let Some(rest) = after("bed x:") {
            add(true, [first(rest), number("y:"), number("z:")]);
        } else if let Some(rest) = after("z-probe:") {
            // It states how far down the probe went.
            let z = first(rest).map(|own| -own);
            add(false, [number("x:"), number("y:"), z]);
        } else if let Some(rest) = after("probe: x").or(after("debug: x")) {
            // The grid names the place of the probe. Colons are written or not.
            let place = rest.replace(['y', 'z', ':'], "");
            add(own.contains("debug:"), three(&place));
        } else if let Some((place, _)) = after("[prb:").and_then(|own| own.split_once(":1]")) {
            add(false, three(place));
        } else if of_smoothieware
            && let Some(rest) = own
                .rsplit(": ")
                .next()
                .and_then(|own| own.strip_prefix("z:"))
        {
            add(false, [to_x, to_y, first(rest).map(|own| -own)]);
        } else if let Some(rest) = after("stopped at height") {
            add(false, [to_x, to_y, first(rest)]);
        } else if own.contains("iteration") {
            // The following points were measured with other parameters.
            break;
        } else if let Some(points) = g33(own) {
            of_g33.extend(points.into_iter().map(|point| (line, point)));
        } else if let Some(at) = own.find("g1 ").or(own.find("g0 ")) {
            for (commanded, letter) in commanded.iter_mut().zip(['x', 'y']) {
                let mut words = own[at + 3..].split_whitespace();
                let to = words.find_map(|own| own.strip_prefix(letter));
                *commanded = to.map_or(*commanded, first);
            }
        }
    }
    let Some((line, _)) = of_g33.first() else {
        return Ok(touches);
    };
    let radius = imported.probed_radius.ok_or_else(|| {
        let remedy =
            "give Configuration.h with PRINTABLE_RADIUS as the configuration, and this file as the samples";
        InputError::new(text.name(), "G33 does not state the radius at which it probed")
            .at_line(*line)
            .with_remedy(remedy)
    })?;
    for (line, (direction, out, z)) in of_g33 {
        let (sine, cosine) = f64::to_radians(direction).sine_cosine();
        let at = [out * radius * cosine, out * radius * sine, z];
        touches.push(Touch::of(Named::Nozzle, line, at));
    }
    Ok(touches)
}

/// Whether a console lists what was last first, as Duet Web Control does: its heights stand above the moves to their places.
fn is_newest_first(content: &str) -> bool {
    let is_move = |own: &str| (own.contains("g1 ") || own.contains("g0 ")) && own.contains(" x");
    let is_height = |own: &str| own.contains("stopped at height");
    let mut lines = content.lines().filter(|own| is_move(own) || is_height(own));
    lines.next().is_some_and(is_height) && lines.next_back().is_some_and(is_move)
}

/// Numbers separated by these marks; `None` if anything else stands between them.
fn numbers(text: &str, marks: &[char]) -> Option<Vec<f64>> {
    let parts = text
        .split(marks)
        .map(str::trim)
        .filter(|own| !own.is_empty());
    parts.map(finite).collect()
}

/// A table `x_mm,y_mm,height_mm` or `x_mm,y_mm,paper_mm`: places of the nozzle.
fn table(name: &str, content: &str) -> Result<Option<Vec<Touch>>, InputError> {
    let Table { header, rows } = Table::of(content);
    let names: Vec<_> = header.iter().map(String::as_str).collect();
    let named = match names.as_slice() {
        ["x_mm", "y_mm", "height_mm"] => Named::Nozzle,
        ["x_mm", "y_mm", "paper_mm"] => Named::Paper,
        _ => return Ok(None),
    };
    let touch = |(line, cells): (u64, Vec<String>)| {
        let at: Option<Vec<_>> = cells.iter().map(|own| finite(own)).collect();
        let at = at.and_then(|own| own.try_into().ok());
        at.map(|at| Touch::of(named, line, at)).ok_or_else(|| {
            let cause = format!("the row is not three numbers: {}", names.join(", "));
            InputError::new(name, cause)
                .at_line(line)
                .with_remedy("correct the row, or delete it")
        })
    };
    rows.into_iter()
        .map(touch)
        .collect::<Result<_, _>>()
        .map(Some)
}

/// RepRapFirmware's heightmap.csv: places of the probe; what it did not probe is 0 without decimals.
fn height_map(content: &str) -> Option<Vec<Touch>> {
    let mut lines = (1..).zip(content.lines());
    lines.find(|(_, own)| own.contains("height map file"))?;
    let (_, header) = lines.next()?;
    let names: Vec<_> = header.split(',').map(str::trim).collect();
    let (_, values) = lines.next()?;
    let values = values.split(',').map(str::trim);
    let facts: Vec<_> = names.into_iter().zip(values).collect();
    let of = |wanted: [&str; 2]| {
        let mut facts = facts.iter();
        let own = facts.find(|(name, _)| wanted.contains(name))?;
        own.1.parse::<f64>().ok()
    };
    let low = [of(["xmin", "min0"])?, of(["ymin", "min1"])?];
    let step = [of(["xspacing", "spacing0"])?, of(["yspacing", "spacing1"])?];
    let probed = |value: &str| finite(value).filter(|_| value.trim() != "0");
    let row = |(line, own): (u64, &str)| (line, own.split(',').map(probed).collect());
    let rows: Vec<_> = lines.map(row).collect();
    Some(gridded(&rows, (low, step), f64::INFINITY))
}

/// Touches of the probe at the places of a grid within a radius, from its lowest place on in these steps; each row with its line.
pub(super) fn gridded(
    rows: &[(u64, Vec<Option<f64>>)],
    (low, step): ([f64; 2], [f64; 2]),
    radius: f64,
) -> Vec<Touch> {
    let mut touches = Vec::new();
    for (row, (line, heights)) in rows.iter().enumerate() {
        for (column, z) in heights.iter().enumerate() {
            let x = low[0] + step[0] * column as f64;
            let y = low[1] + step[1] * row as f64;
            if let Some(z) = *z
                && x.hypot(y) <= radius + SAME
            {
                touches.push(Touch::of(Named::Probe, *line, [x, y, z]));
            }
        }
    }
    touches
}

/// RepRapFirmware's answer to G32: heights in the order of the points that `G30 P` of bed.g states.
fn probe_heights(content: &str) -> Vec<Touch> {
    let mut points: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
    for own in content.lines() {
        let code = own.split(';').next().unwrap_or_default();
        let Some((_, words)) = code.split_once("g30 p") else {
            continue;
        };
        let number = |letter: char| {
            let mut words = words.split_whitespace();
            words.find_map(|own| first(own.strip_prefix(letter)?))
        };
        let index = words
            .split_whitespace()
            .next()
            .and_then(|own| own.parse().ok());
        if let (Some(index), Some(x), Some(y)) = (index, number('x'), number('y')) {
            points.insert(index, [x, y]);
        }
    }
    let answers = (1..).zip(content.lines());
    let mut answers = answers.filter_map(|(line, own)| {
        let (_, heights) = own.split_once("bed probe heights:")?;
        let heights = heights.split(',').next().unwrap_or_default();
        Some((line, numbers(heights, &[' ', '\t'])?))
    });
    // The next answers are of other parameters.
    let Some((line, heights)) = answers.next() else {
        return Vec::new();
    };
    if heights.len() != points.len() {
        return Vec::new();
    }
    let touches = points.values().zip(heights);
    let touches = touches.map(|([x, y], z)| Touch::of(Named::Probe, line, [*x, *y, z]));
    touches.collect()
}

/// Marlin's grid of M420 V and G29: evenly spaced over the square around the probed circle, outside of which it is
/// extrapolated.
fn grid(content: &str, radius: f64) -> Vec<Touch> {
    let mut lines = (1..).zip(content.lines());
    if !lines.any(|(_, own)| own.contains("leveling grid:")) {
        return Vec::new();
    }
    let count = |text: &str| numbers(text, &[' ', '\t']).filter(|own| own.len() > 1);
    let mut rows: Vec<(u64, Vec<_>)> = Vec::new();
    for (line, own) in lines.skip(1) {
        let own = own.rsplit_once("recv:").map_or(own, |(_, own)| own);
        match count(own).as_deref() {
            Some([_, heights @ ..]) => {
                rows.push((line, heights.iter().copied().map(Some).collect()));
            }
            _ => break,
        }
    }
    let step = |places: usize| 2.0 * radius / (places.max(2) - 1) as f64;
    let across = rows.first().map_or(0, |(_, heights)| heights.len());
    let steps = [step(across), step(rows.len())];
    gridded(&rows, ([-radius; 2], steps), radius)
}

/// Repetier's map: a line of x, then lines of y with how far down the probe went.
fn repetier_map(content: &str) -> Vec<Touch> {
    let mut touches = Vec::new();
    let mut across: Vec<f64> = Vec::new();
    for (line, own) in (1..).zip(content.lines()) {
        let after = |key: &str| {
            let (before, own) = own.rsplit_once(key)?;
            let alone = before.is_empty() || before.ends_with([' ', '\t', ':']);
            numbers(own, &[' ', '\t', ',']).filter(|own| alone && own.len() >= 2)
        };
        if let Some(found) = after("x:") {
            across = found;
        } else if let Some(found) = after("y:")
            && let [y, heights @ ..] = found.as_slice()
            && heights.len() == across.len()
        {
            let row = across.iter().zip(heights);
            touches.extend(row.map(|(x, z)| Touch::of(Named::Nozzle, line, [*x, *y, -z])));
        }
    }
    touches
}

/// The first three numbers between commas.
fn three(text: &str) -> [Option<f64>; 3] {
    let all = numbers(text, &[',']).unwrap_or_default();
    [0, 1, 2].map(|axis| all.get(axis).copied())
}

/// The number at the start.
fn first(text: &str) -> Option<f64> {
    let own = text.trim_start();
    let end = own.find(|own: char| !"+-.0123456789e".contains(own));
    own[..end.unwrap_or(own.len())].parse().ok()
}

/// Whether the number at the start has a comma between digits.
fn has_decimal_comma(text: &str) -> bool {
    let digit = |own: char| own.is_ascii_digit();
    let own = text.trim_start_matches([' ', '+', '-']);
    let rest = own.trim_start_matches(digit);
    let decimals = rest.strip_prefix(',').unwrap_or_default();
    own.starts_with(digit) && decimals.starts_with(digit)
}

/// Direction, fraction of the radius, and height of each point in a line of G33's table.
fn g33(line: &str) -> Option<Vec<(f64, f64, f64)>> {
    let mut points = Vec::new();
    for word in line.split_whitespace() {
        let word = word.trim_start_matches('.');
        for (name, direction, out) in POINTS {
            if let Some(z) = word.strip_prefix(name) {
                points.push((direction, out, first(z)?));
            }
        }
    }
    // PROBE_ACCURACY and M114, which Marlin answers to G30 as well, name axes too.
    let table = ["c:", "yz:"].iter().any(|own| line.contains(own)) && !line.contains("count");
    (points.len() >= 3 && table).then_some(points)
}
