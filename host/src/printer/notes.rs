//! What an owner must know of readings and lines beside the figures: an offset of the probe, a common scale, a move of
//! the end stops that may crash.

use super::contradiction::unnoticed;
use crate::effects::turned;
use crate::files::samples_file::ReadingFrom;
use crate::fit::Solution;
use crate::geometry::Shape;
use crate::import::{Firmware, Imported, USUAL_TOWERS};
use delta_cal::robot::{Arm, Drive};
use delta_cal::{Real, Robot};
use nalgebra::Vector3;
use serde::Serialize;
use std::f64::consts::TAU;

/// An end stop that moves by more may drive the nozzle into the bed, mm; an angle that lifts the end of an upper arm as far, degrees.
const CRASH: f64 = 1.0;
const CRASH_DEG: f64 = 0.5;
/// A common scale: so far off 1, and so many times its own σ and the scatter of the distances.
const SCALE: f64 = 0.005;
const CLEAR: f64 = 5.0;
/// Distances that show a common scale.
const LEAST_DISTANCES: usize = 3;
/// A probe is off if its heights are so far from those by hand, mm.
const PROBE_OFF: f64 = 0.03;

/// A parameter of the controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// As the controller calls it.
    pub name: String,
    /// In the configuration.
    pub before: f64,
    /// In the lines to paste.
    pub after: f64,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// Whether it is the place of an end stop.
    #[serde(skip)]
    pub is_endstop: bool,
}

/// Of what was read.
pub(super) fn notes(imported: &Imported, solution: &Solution) -> Vec<String> {
    let mut notes = Vec::new();
    let by_hand = |name: &String| name.starts_with("manual_height");
    if let [bed, probe] = solution.places.planes.as_slice()
        && imported.names.iter().any(by_hand)
    {
        let off = probe.offset - bed.offset;
        if off.abs() > PROBE_OFF {
            let word = if off < 0.0 { "large" } else { "small" };
            notes.push(format!(
                "The probe's z_offset is {:.2} mm too {word} compared with heights by hand, which the lines use.",
                off.abs()
            ));
        }
    }
    notes.extend(common_scale(imported));
    notes.extend(unnoticed(imported));
    notes
}

/// The warning of lines that move an end stop far.
pub(super) fn crash(changes: &[Change]) -> Option<String> {
    let endstops = changes.iter().filter(|own| own.is_endstop);
    let moved = endstops.map(|own| {
        let by = (own.after - own.before).abs();
        match own.unit {
            "deg" => (by / CRASH_DEG, format!("{by:.1}°")),
            _ => (by / CRASH, format!("{by:.1} mm")),
        }
    });
    let (_, most) = moved
        .filter(|(times, _)| *times > 1.0)
        .max_by(|(one, _), (other, _)| one.total_cmp(other))?;
    Some(format!(
        "WARNING: an end stop moves by {most}. After pasting, home, and lower the nozzle by hand in steps of 1 mm \
         before anything else: a wrong end stop drives it into the bed."
    ))
}

/// Errors of the end stops of arms that motors turn are sought in so many steps to each side, degrees.
const ZERO_STEPS: i32 = 2500;
const ZERO_STEP: f64 = 0.01;
/// Heights that are explained scatter by less, mm.
const EXPLAINED: f64 = 1.0;

/// What the heights say of a printer with arms that motors turn if all end stops are off by the same angle and the bed is at
/// another height; nothing if that does not explain them.
pub(crate) fn alike(imported: &Imported) -> Option<String> {
    let configured = &imported.configured;
    if configured.drive() == Drive::Linear {
        return None;
    }
    let turned = |degrees: f64| turned(configured, degrees.to_radians());
    let rows = &imported.readings.rows;
    // How far the bed is above z = 0, and how much the heights scatter about that, mm.
    let bed = |robot: &Robot<f64>| {
        let mut off = Vec::new();
        for row in rows {
            let (_, height) = row.value.height?;
            off.push(robot.forward(&row.value.joints).ok()?.z - height);
        }
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let scatter = off.iter().map(|own| (own - mean).abs()).fold(0.0, f64::max);
        Some((mean, scatter))
    };
    let steps = -ZERO_STEPS..=ZERO_STEPS;
    let tried = steps.filter_map(|step| {
        let degrees = ZERO_STEP * f64::from(step);
        let (mean, scatter) = bed(&turned(degrees)?)?;
        Some((scatter, degrees, mean))
    });
    let best = tried.min_by(|(one, ..), (other, ..)| one.total_cmp(other));
    let (_, degrees, mean) = best.filter(|(scatter, ..)| *scatter < EXPLAINED)?;
    if rows.len() < LEAST_DISTANCES {
        return None;
    }
    let home = turned(degrees)?.forward(&imported.home).ok()?.z - mean;
    let [arm, ..] = configured.arms();
    let options = match imported.firmware {
        Firmware::Klipper => {
            let height = arm.d().z - mean;
            format!(": position_endstop {home:.1}, shoulder_height {height:.1}")
        }
        _ => String::new(),
    };
    let degrees = degrees.abs();
    Some(format!(
        "If all end stops are off by the same angle, it is {degrees:.1}°{options}."
    ))
}

/// Distances that all are too long or too short by the same part, and what could do that.
pub(crate) fn common_scale(imported: &Imported) -> Option<String> {
    let robot = &imported.configured;
    let parts = imported.readings.rows.iter().filter_map(|row| {
        let Some((ReadingFrom::Pose(from), distance)) = row.value.distance else {
            return None;
        };
        let from = robot.forward(&from).ok()?;
        let to = robot.forward(&row.value.joints).ok()?;
        let length = (to - from).norm();
        Some((distance / length, row.value.sigma.unwrap_or(0.0) / length))
    });
    let parts: Vec<_> = parts.collect();
    if parts.len() < LEAST_DISTANCES {
        return None;
    }
    let count = parts.len() as f64;
    let mean = parts.iter().map(|(part, _)| part).sum::<f64>() / count;
    let squares = parts.iter().map(|(part, _)| (part - mean).powi(2));
    let scatter = (squares.sum::<f64>() / (count - 1.0)).sqrt();
    // Copies of one printed length do not scatter, but are no better than the calliper.
    let stated = parts.iter().map(|(_, sigma)| sigma.powi(2)).sum::<f64>() / count;
    let sigma = (scatter.powi(2) + stated).sqrt() / count.sqrt();
    let off = (mean - 1.0).abs();
    if off < SCALE || off < CLEAR * sigma || off < 2.0 * scatter {
        return None;
    }
    let percent = 100.0 * off;
    let towers = robot.drive() == Drive::Linear;
    let (lengths, measure) = if !towers {
        let name = imported.firmware.words().forearm;
        let measure = format!(
            " Measure the forearms between their joints with a calliper and correct {name}."
        );
        let lengths = "other forearms or another radius of the base; ".to_owned();
        (lengths, measure)
    } else if imported.rods_measured() {
        (String::new(), String::new())
    } else {
        let lengths = match lengths_for(robot, imported.bed_radius, mean) {
            Some([rods, radius]) => {
                format!("rods of {rods:.1} mm with a radius of {radius:.1} mm; ")
            }
            None => "other rods; ".to_owned(),
        };
        let [arm, ..] = robot.arms();
        let rod = arm.lb();
        let measure = format!(
            " Measure the rods between their joints with a calliper and state them: --rods {rod:.1}±0.1mm."
        );
        (lengths, measure)
    };
    let (word, shrink) = if mean < 1.0 {
        let shrink = format!("; prints that shrink by {percent:.1} % (--shrinkage)");
        ("short", shrink)
    } else {
        ("long", String::new())
    };
    Some(format!(
        "All {} distances are {percent:.1} % (±{:.2} %) too {word}: a common scale. Possible causes: {lengths}a belt, gear or \
         steps per mm {percent:.1} % off{shrink}.{measure}",
        parts.len(),
        100.0 * sigma,
    ))
}

/// The common length of the rods and the radius with which x and y have another scale and the bed stays flat: to first
/// order about symmetric towers.
fn lengths_for(robot: &Robot<f64>, bed: Option<f64>, scale: f64) -> Option<[f64; 2]> {
    let arms = robot.arms();
    let mean = |value: fn(&Arm<f64>) -> f64| arms.iter().map(value).sum::<f64>() / 3.0;
    let (radius, rod) = (mean(|arm| arm.d().xy().norm()), mean(Arm::lb));
    let out = 0.9 * bed?;
    let made = |radius: f64, rod: f64| {
        let towers = Shape::three(USUAL_TOWERS, radius, [[0.0; 3], [0.0; 3], [rod; 3]]);
        Shape::robot(&towers, Drive::Linear).ok()
    };
    let controller = made(radius, rod)?;
    // Height at the rim over that of the centre, and the part by which the rim is further out.
    let moved = |radius: f64, rod: f64| {
        let other = made(radius, rod)?;
        let at = |place: Vector3<f64>| other.forward(&controller.inverse(&place).ok()?).ok();
        let centre = at(Vector3::zeros())?;
        let (mut height, mut scale) = (0.0, 0.0);
        for index in 0..12_u8 {
            let (sine, cosine) = (TAU * f64::from(index) / 12.0).sine_cosine();
            let place = Vector3::new(out * cosine, out * sine, 0.0);
            let off = at(place)? - place - centre;
            height += off.z / 12.0;
            scale += off.dot(&place) / (12.0 * out * out);
        }
        Some([height, scale])
    };
    let [by_radius, scale_radius] = moved(radius + 0.1, rod)?;
    let [by_rod, scale_rod] = moved(radius, rod + 0.1)?;
    let radius_per_rod = -by_rod / by_radius;
    let per_rod = (scale_rod + radius_per_rod * scale_radius) / 0.1;
    let rods = (scale - 1.0) / per_rod;
    (rods.abs() < 0.2 * rod).then_some([rod + rods, radius + radius_per_rod * rods])
}
