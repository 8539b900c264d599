//! A Klipper configuration of a Delta.

use super::configuration::Configuration;
use super::imported::Imported;
use super::linear::LinearPrinter;
use super::measured::{Saved, Steps};
use super::robot_text::{self, Beside, is_round};
use super::rotary::RotaryPrinter;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::text::numbers::rounded;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

const STEPPERS: [&str; 3] = ["stepper_a", "stepper_b", "stepper_c"];
/// Of a motor whose section does not say it.
const FULL_STEPS: f64 = 200.0;
/// What a joint angle may be at most, degrees: Klipper states no limit.
const LOWEST_ARM: f64 = 90.0;

/// Reads a configuration and its saved measurements. `rods` take the place of its `arm_length`.
///
/// # Errors
/// No Delta, an option that is missing or damaged, or a geometry that is impossible.
pub fn import(path: &Path, rods: Option<[f64; 3]>) -> Result<Imported, InputError> {
    let configuration = Configuration::read(path)?;
    let kinematics = configuration.require("printer", "kinematics")?;
    let imported = match kinematics.value.as_str() {
        "delta" => linear(&configuration, rods)?,
        "rotary_delta" if rods.is_none() => rotary(&configuration)?,
        "rotary_delta" => {
            let cause = "kinematics: rotary_delta has no arm_length that --rods could replace";
            return Err(InputError::new(&configuration.name, cause)
                .with_remedy("leave out --rods, and edit lb_mm in the robot file"));
        }
        _ => {
            let cause = "the printer is no Delta: its kinematics is neither delta nor rotary_delta";
            return Err(configuration
                .damaged("printer", "kinematics", "delta or rotary_delta")
                .with_remedy(format!("{cause}; delta-cal calibrates Delta robots only")));
        }
    };
    Ok(imported)
}

/// The same option of the three motors; the second and the third take the first's where they state none.
fn like_first(
    configuration: &Configuration,
    option: &str,
    least: Option<f64>,
) -> Result<[f64; 3], InputError> {
    let mut values = [0.0; 3];
    let mut first = None;
    for (value, section) in values.iter_mut().zip(STEPPERS) {
        let own = configuration.number(section, option)?.or(first);
        *value = own.ok_or_else(|| configuration.lacking(section, option))?;
        if least.is_some_and(|least| !(*value > least)) {
            let wanted = format!("above {}", least.unwrap_or_default());
            let place = if configuration.has(section, option) {
                section
            } else {
                "stepper_a"
            };
            return Err(configuration.damaged(place, option, &wanted));
        }
        first = first.or(Some(*value));
    }
    Ok(values)
}

fn azimuths(configuration: &Configuration, usual: [f64; 3]) -> Result<[f64; 3], InputError> {
    let mut azimuths = usual;
    for (azimuth, section) in azimuths.iter_mut().zip(STEPPERS) {
        if let Some(own) = configuration.number(section, "angle")? {
            if !(own.abs() <= 360.0) {
                return Err(configuration.damaged(
                    section,
                    "angle",
                    "an angle of up to 360 degrees",
                ));
            }
            *azimuth = own;
        }
    }
    Ok(azimuths)
}

/// Of one motor: mm, or radians where a turn is one of the arm.
fn step_length(
    configuration: &Configuration,
    section: &str,
    in_radians: bool,
) -> Result<f64, InputError> {
    let turn = if in_radians {
        configuration.require(section, "gear_ratio")?;
        TAU
    } else {
        match configuration.above_zero(section, "rotation_distance")? {
            Some(distance) => distance,
            // As older versions of Klipper have it.
            None => {
                return configuration
                    .above_zero(section, "step_distance")?
                    .ok_or_else(|| configuration.lacking(section, "rotation_distance"));
            }
        }
    };
    let microsteps = configuration.above_zero(section, "microsteps")?;
    let microsteps = microsteps.ok_or_else(|| configuration.lacking(section, "microsteps"))?;
    let full = configuration.above_zero(section, "full_steps_per_rotation")?;
    let full = full.unwrap_or(FULL_STEPS);
    Ok(turn / (full * microsteps * gear_ratio(configuration, section)?))
}

fn gear_ratio(configuration: &Configuration, section: &str) -> Result<f64, InputError> {
    let Some(entry) = configuration.get(section, "gear_ratio") else {
        return Ok(1.0);
    };
    let mut ratio = 1.0;
    for pair in entry
        .value
        .split(',')
        .filter(|pair| !pair.trim().is_empty())
    {
        let numbers = pair.split_once(':').and_then(|(driven, driving)| {
            let number = |text: &str| text.trim().parse::<f64>().ok();
            Some((number(driven)?, number(driving)?))
        });
        match numbers {
            Some((driven, driving)) if driven > 0.0 && driving > 0.0 => ratio *= driven / driving,
            _ => {
                let wanted = "ratios such as 107:16, separated by commas";
                return Err(configuration.damaged(section, "gear_ratio", wanted));
            }
        }
    }
    Ok(ratio)
}

fn step_lengths(configuration: &Configuration, in_radians: bool) -> Result<[f64; 3], InputError> {
    let [a, b, c] = STEPPERS.map(|section| step_length(configuration, section, in_radians));
    Ok([a?, b?, c?])
}

fn linear(configuration: &Configuration, rods: Option<[f64; 3]>) -> Result<Imported, InputError> {
    let radius = configuration.above_zero("printer", "delta_radius")?;
    let radius = radius.ok_or_else(|| configuration.lacking("printer", "delta_radius"))?;
    let configured = like_first(configuration, "arm_length", Some(radius));
    let printer = LinearPrinter {
        radius,
        azimuths: azimuths(configuration, [210.0, 330.0, 90.0])?,
        rods: match rods {
            Some(rods) => rods,
            None => configured.clone()?,
        },
        endstops: like_first(configuration, "position_endstop", None)?,
    };
    if let Some(short) = printer.rods.iter().find(|rod| !(**rod > radius)) {
        let cause = format!("rods of {short} mm do not reach from delta_radius, {radius} mm");
        return Err(InputError::new(&configuration.name, cause)
            .with_remedy("give --rods with the length between the joints of a rod"));
    }
    let saved = Saved::read(configuration)?;
    let steps = step_lengths(configuration, false)?;
    let carriages = |at: Steps| printer.carriages(at, steps);
    let mut notes = missing(configuration);
    notes.extend(rods_note(&printer, configured.ok(), rods.is_some()));
    let bed = configuration.above_zero("printer", "print_radius")?;
    let bed = bed.or(configuration.above_zero("delta_calibrate", "radius")?);
    let lowest = configuration.number("printer", "minimum_z_position")?;
    let poses = poses(&saved, &carriages);
    let limits = travel(
        &printer,
        bed.unwrap_or(radius),
        lowest.unwrap_or(0.0),
        &poses,
    );
    let beside = Beside {
        controller: "Klipper",
        source: &configuration.name,
        limits,
        heights: !saved.heights.is_empty(),
        notes: &notes,
    };
    let robot_text = robot_text::linear(&printer, &beside);
    let robot = RobotFile::read(&InputText::new(&configuration.name, &robot_text))?;
    Ok(Imported {
        source: configuration.name.clone(),
        robot,
        robot_text,
        samples_text: samples(&saved, "s", "mm", &carriages),
        saved,
        home: printer.home(),
        printer: Some(printer),
        bed_radius: Some(bed.unwrap_or(radius)),
        notes,
    })
}

fn rotary(configuration: &Configuration) -> Result<Imported, InputError> {
    let length = |option: &str| {
        let value = configuration.above_zero("printer", option)?;
        value.ok_or_else(|| configuration.lacking("printer", option))
    };
    let printer = RotaryPrinter {
        radius: length("shoulder_radius")?,
        height: length("shoulder_height")?,
        azimuths: azimuths(configuration, [30.0, 150.0, 270.0])?,
        upper: like_first(configuration, "upper_arm_length", Some(0.0))?,
        lower: like_first(configuration, "lower_arm_length", Some(0.0))?,
        endstops: like_first(configuration, "position_endstop", None)?,
    };
    let mut home = [0.0; 3];
    for ((angle, own), section) in printer.home().into_iter().zip(&mut home).zip(STEPPERS) {
        *own = angle.ok_or_else(|| {
            configuration.damaged(section, "position_endstop", "a height that the arm reaches")
        })?;
    }
    let saved = Saved::read(configuration)?;
    let steps = step_lengths(configuration, true)?;
    // Steps lead down from the end stop, and down is positive in the robot file.
    let joints = |at: Steps| {
        let mut joints = home;
        for ((joint, steps), length) in joints.iter_mut().zip(at).zip(steps) {
            *joint = (*joint + steps * length).to_degrees();
        }
        joints
    };
    let poses = poses(&saved, &joints);
    let angles = || poses.iter().flatten().copied();
    let highest = home.into_iter().map(f64::to_degrees);
    let limits = [
        highest.chain(angles()).fold(f64::INFINITY, f64::min),
        angles().fold(LOWEST_ARM, f64::max),
    ];
    let notes = missing(configuration);
    let beside = Beside {
        controller: "Klipper",
        source: &configuration.name,
        limits,
        heights: !saved.heights.is_empty(),
        notes: &notes,
    };
    let robot_text = robot_text::rotary(&printer, &beside);
    let robot = RobotFile::read(&InputText::new(&configuration.name, &robot_text))?;
    Ok(Imported {
        source: configuration.name.clone(),
        robot,
        robot_text,
        samples_text: samples(&saved, "q", "deg", &joints),
        saved,
        home,
        printer: None,
        bed_radius: configuration.above_zero("delta_calibrate", "radius")?,
        notes,
    })
}

/// Includes that are not there.
fn missing(configuration: &Configuration) -> Vec<String> {
    let missing = configuration.missing().iter();
    missing
        .map(|(file, line)| {
            format!(
                "{file}:{line} includes a file that is not there. If it holds a part of [printer], [stepper_a] to \
                 [stepper_c] or [delta_calibrate], copy it beside the configuration and import again."
            )
        })
        .collect()
}

fn rods_note(
    printer: &LinearPrinter,
    configured: Option<[f64; 3]>,
    replaced: bool,
) -> Option<String> {
    let of = |rods: [f64; 3]| rods.map(rounded).join(", ");
    match configured {
        Some(configured) if replaced => Some(format!(
            "The rods are {} mm as --rods states; the configuration has {}.",
            of(printer.rods),
            of(configured)
        )),
        Some(configured) if !configured.into_iter().all(is_round) => Some(format!(
            "The rods of {} mm are the result of an earlier calibration, for nobody makes them so; they are kept. If \
             you know how long they were made, give --rods.",
            of(configured)
        )),
        _ => None,
    }
}

fn poses(saved: &Saved, joints: &impl Fn(Steps) -> [f64; 3]) -> Vec<[f64; 3]> {
    let heights = saved.heights.iter().map(|(_, at)| joints(*at));
    let distances = saved.distances.iter();
    heights
        .chain(distances.flat_map(|(_, from, to)| [joints(*from), joints(*to)]))
        .collect()
}

/// The travel of the carriages, mm: from the lowest that the printed area or a measurement needs to the highest end
/// stop.
fn travel(printer: &LinearPrinter, bed: f64, lowest: f64, poses: &[[f64; 3]]) -> [f64; 2] {
    let mut low = f64::INFINITY;
    for azimuth in printer.azimuths {
        let (sine, cosine) = azimuth.to_radians().sin_cos();
        // Where the rods do not get that far, as far as they get.
        let parts = (0..=20).map(|step| bed * (1.0 - 0.05 * f64::from(step)));
        let mut reached =
            parts.filter_map(|out| printer.inverse([-out * cosine, -out * sine, lowest]));
        low = reached.next().into_iter().flatten().fold(low, f64::min);
    }
    let all = || poses.iter().flatten().copied();
    let high = printer
        .home()
        .into_iter()
        .chain(all())
        .fold(f64::MIN, f64::max);
    [all().fold(low, f64::min).floor(), high]
}

/// The samples file.
fn samples(
    saved: &Saved,
    letter: &str,
    unit: &str,
    joints: &impl Fn(Steps) -> [f64; 3],
) -> Option<String> {
    if saved.is_empty() {
        return None;
    }
    let names = |prefix: &str| {
        [1, 2, 3]
            .map(|k| format!("{prefix}{letter}{k}_{unit}"))
            .join(",")
    };
    let cells = |at: Steps| joints(at).map(rounded).join(",");
    let distances = !saved.distances.is_empty();
    let mut text = names("");
    if !saved.heights.is_empty() {
        text.push_str(",height_mm");
    }
    if distances {
        let _ = write!(text, ",distance_mm,{}", names("to_"));
    }
    text.push('\n');
    for (height, at) in &saved.heights {
        let rest = if distances { ",,,," } else { "" };
        let _ = writeln!(text, "{},{}{rest}", cells(*at), rounded(*height));
    }
    for (distance, from, to) in &saved.distances {
        let height = if saved.heights.is_empty() { "" } else { "," };
        let _ = writeln!(
            text,
            "{}{height},{},{}",
            cells(*from),
            rounded(*distance),
            cells(*to)
        );
    }
    Some(text)
}
