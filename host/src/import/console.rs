//! The answers of a firmware's console to probing: touches of the bed.
//!
//! ```text
//! Klipper          probe at 10.000,20.000 is z=2.345        probe: at 10.000,20.000 bed will contact at z=2.345
//! Marlin           Bed X: 10.00 Y: 20.00 Z: 0.12            G33:  c:+0.36  x:+0.63  y:+0.21  z:-0.72
//! RepRapFirmware   G1 X10 Y20, then: Stopped at height 0.032 mm
//! ```

use super::Imported;
use crate::files::input::{InputError, InputText};
use crate::files::samples_file::{Reading, Readings, Row};
use nalgebra::Vector3;

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
/// Places closer than this are the same, mm.
const SAME: f64 = 0.01;

/// The line of an answer, and the nozzle's commanded x, y and z at the touch.
type Touch = (u64, [f64; 3]);

/// The touches in the answers of a console, one for each place. Each height is their mean, which is the probe's offset.
/// `None` if there are no answers.
///
/// # Errors
/// A place that the printer does not reach; G33 without the radius of its circle.
pub fn touches(imported: &Imported, text: &InputText) -> Result<Option<Readings>, InputError> {
    let mut found: Vec<(Touch, f64)> = Vec::new();
    for (line, at) in all(imported, text)? {
        let same = |own: &(Touch, f64)| {
            let [x, y, _] = own.0.1;
            (x - at[0]).hypot(y - at[1]) < SAME
        };
        let repeated = found.last().is_some_and(same);
        match found.last_mut().filter(|_| repeated) {
            // Repeated touches of a place are averaged.
            Some((touch, count)) => {
                *count += 1.0;
                touch.1[2] += (at[2] - touch.1[2]) / *count;
            }
            None => found.push(((line, at), 1.0)),
        }
    }
    if found.is_empty() {
        return Ok(None);
    }
    let heights = found.iter().map(|((_, at), _)| at[2]);
    let mean = heights.sum::<f64>() / found.len() as f64;
    let mut readings = Readings::of_name(text.name());
    readings.planes = vec!["plane".to_owned()];
    for ((line, [x, y, z]), _) in found {
        let joints = imported.configured.inverse(&Vector3::new(x, y, z));
        let joints = joints.map_err(|_| {
            InputError::new(text.name(), "the printer does not reach this place")
                .at_line(line)
                .with_remedy("check that configuration and answers belong to the same printer")
        })?;
        readings.rows.push(Row {
            line,
            value: Reading {
                height: Some((0, mean)),
                ..Reading::at(joints)
            },
        });
    }
    Ok(Some(readings))
}

fn all(imported: &Imported, text: &InputText) -> Result<Vec<Touch>, InputError> {
    let mut touches = Vec::new();
    let mut commanded = [None; 2];
    let mut of_g33 = Vec::new();
    for (line, own) in (1..).zip(text.text().lines()) {
        let after = |words: &str| own.find(words).map(|at| &own[at + words.len()..]);
        if let Some(rest) = after("probe at ").or(after("probe: at ")) {
            if let Some(at) = klipper(rest) {
                touches.push((line, at));
            }
        } else if let Some(rest) = after("Bed X:") {
            let number = |key: &str| rest.find(key).and_then(|at| first(&rest[at + key.len()..]));
            if let (Some(x), Some(y), Some(z)) = (first(rest), number("Y:"), number("Z:")) {
                touches.push((line, [x, y, z]));
            }
        } else if let Some(rest) = after("Stopped at height") {
            if let ([Some(x), Some(y)], Some(z)) = (commanded, first(rest)) {
                touches.push((line, [x, y, z]));
            }
        } else if own.contains("Iteration") {
            // The following points were measured with other parameters.
            break;
        } else if let Some(points) = g33(own) {
            of_g33.extend(points.into_iter().map(|point| (line, point)));
        } else if let Some(at) = own.find("G1 ").or(own.find("G0 ")) {
            for word in own[at + 3..].split_whitespace() {
                match word.split_at_checked(1) {
                    Some(("X", value)) => commanded[0] = first(value),
                    Some(("Y", value)) => commanded[1] = first(value),
                    _ => {}
                }
            }
        }
    }
    let Some((line, _)) = of_g33.first() else {
        return Ok(touches);
    };
    let radius = imported.bed_radius.ok_or_else(|| {
        let remedy =
            "give Configuration.h with PRINTABLE_RADIUS as the configuration, and this file as the samples";
        InputError::new(text.name(), "G33 does not state the radius at which it probed")
            .at_line(*line)
            .with_remedy(remedy)
    })?;
    for (line, (direction, out, z)) in of_g33 {
        let (sine, cosine) = f64::to_radians(direction).sin_cos();
        touches.push((line, [out * radius * cosine, out * radius * sine, z]));
    }
    Ok(touches)
}

/// The number at the start.
fn first(text: &str) -> Option<f64> {
    let own = text.trim_start();
    let end = own.find(|own: char| !"+-.0123456789eE".contains(own));
    own[..end.unwrap_or(own.len())].parse().ok()
}

/// "x,y is z=…".
fn klipper(text: &str) -> Option<[f64; 3]> {
    let (x, rest) = text.split_once(',')?;
    let (_, z) = rest.split_once("z=")?;
    Some([first(x)?, first(rest)?, first(z)?])
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
    (points.len() >= 3 && line.contains('.')).then_some(points)
}
