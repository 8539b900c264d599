//! A Klipper configuration of a Delta, and the measurements that it saved in `[delta_calibrate]`.

use super::Firmware;
use super::configuration::{Configuration, Includes};
use super::imported::{Imported, Machine, USUAL_TOWERS, rods_note};
use crate::files::input::{InputError, InputText};
use crate::files::samples_file::{Reading, ReadingFrom, Readings, Row};
use delta_cal::robot::Arm;
use std::f64::consts::TAU;

const STEPPERS: [&str; 3] = ["stepper_a", "stepper_b", "stepper_c"];
const SAVED: &str = "delta_calibrate";
/// Klipper looks for no more measurements of a kind.
const MOST: usize = 999;
/// Of a motor whose section does not say it.
const FULL_STEPS: f64 = 200.0;
/// The azimuths of arms that motors turn, degrees.
const USUAL_ARMS: [f64; 3] = [30.0, 150.0, 270.0];

/// Reads a configuration and its saved measurements. `rods` take the place of its `arm_length`.
///
/// # Errors
/// No Delta, an option that is missing or damaged, or a geometry that is impossible.
pub(super) fn import(
    input: &InputText,
    rods: Option<[f64; 3]>,
    includes: &Includes<'_>,
) -> Result<Imported, InputError> {
    let configuration = Configuration::read(input, includes)?;
    match configuration
        .require("printer", "kinematics")?
        .value
        .as_str()
    {
        "delta" => linear(&configuration, rods),
        "rotary_delta" if rods.is_none() => rotary(&configuration),
        "rotary_delta" => {
            let cause = "kinematics: rotary_delta has no arm_length that --rods could replace";
            Err(InputError::new(&configuration.name, cause)
                .with_remedy("leave out --rods, and edit lb_mm in the robot file"))
        }
        _ => Err(configuration
            .damaged("printer", "kinematics", "delta or rotary_delta")
            .with_remedy("delta-cal calibrates Delta robots only")),
    }
}

fn linear(configuration: &Configuration, stated: Option<[f64; 3]>) -> Result<Imported, InputError> {
    let name = &configuration.name;
    let radius = configuration.require_above_zero("printer", "delta_radius")?;
    let configured = like_first(configuration, "arm_length", Some(radius));
    let rods = match stated {
        Some(rods) => rods,
        None => configured.clone()?,
    };
    if let Some(short) = rods.iter().find(|rod| !(**rod > radius)) {
        let cause = format!("rods of {short} mm do not reach from delta_radius, {radius} mm");
        return Err(InputError::new(name, cause)
            .with_remedy("state with --rods the length between the joints of a rod"));
    }
    let endstops = like_first(configuration, "position_endstop", None)?;
    let azimuths = azimuths(configuration, USUAL_TOWERS)?;
    let machine = Machine::towers(name, radius, azimuths, rods, endstops)?;
    let mut notes = missing(configuration);
    if let Ok(configured) = configured {
        notes.extend(rods_note(rods, configured, stated.is_some()));
    }
    let bed = configuration.above_zero("printer", "print_radius")?;
    let bed = bed
        .or(configuration.above_zero(SAVED, "radius")?)
        .unwrap_or(radius);
    let lowest = configuration.number("printer", "minimum_z_position")?;
    let imported = finished(
        configuration,
        &machine,
        false,
        (bed, lowest.unwrap_or(0.0)),
        notes,
    )?;
    Ok(Imported {
        bed_radius: Some(bed),
        ..imported
    })
}

fn rotary(configuration: &Configuration) -> Result<Imported, InputError> {
    let radius = configuration.require_above_zero("printer", "shoulder_radius")?;
    let height = configuration.require_above_zero("printer", "shoulder_height")?;
    let azimuths = azimuths(configuration, USUAL_ARMS)?;
    let upper = like_first(configuration, "upper_arm_length", Some(0.0))?;
    let lower = like_first(configuration, "lower_arm_length", Some(0.0))?;
    let endstops = like_first(configuration, "position_endstop", None)?;
    let arm = |index: usize| {
        let azimuth = azimuths[index].to_radians();
        let (sine, cosine) = azimuth.sin_cos();
        let (x, y) = (radius * cosine, radius * sine);
        Arm::new([x, y, height, azimuth, 0.0, upper[index], 0.0, lower[index]])
    };
    let machine = Machine::of(&configuration.name, [arm(0), arm(1), arm(2)], endstops)?;
    let notes = missing(configuration);
    finished(configuration, &machine, true, (0.0, 0.0), notes)
}

/// The robot with what was measured. Steps lead down from the end stops; down is positive for angles, and not for travels.
fn finished(
    configuration: &Configuration,
    machine: &Machine,
    rotary: bool,
    area: (f64, f64),
    notes: Vec<String>,
) -> Result<Imported, InputError> {
    let mut home = [0.0; 3];
    let mut step_lengths = [0.0; 3];
    for (index, section) in STEPPERS.into_iter().enumerate() {
        home[index] = machine.home()[index].ok_or_else(|| {
            configuration.damaged(section, "position_endstop", "a height that the arm reaches")
        })?;
        let length = step_length(configuration, section, rotary)?;
        step_lengths[index] = if rotary { length } else { -length };
    }
    let joints =
        |steps: [f64; 3]| [0, 1, 2].map(|motor| home[motor] + steps[motor] * step_lengths[motor]);
    let (readings, names) = measured(configuration, joints)?;
    Ok(Imported {
        firmware: Firmware::Klipper,
        robot: machine.robot_file(&configuration.name, home, area, &readings)?,
        readings,
        names,
        home,
        bed_radius: configuration.above_zero(SAVED, "radius")?,
        notes,
    })
}

/// Heights by the probe, then those entered by hand, then distances; and what the configuration calls each.
fn measured(
    configuration: &Configuration,
    joints: impl Fn([f64; 3]) -> [f64; 3],
) -> Result<(Readings, Vec<String>), InputError> {
    let mut file = Readings::of_name(&configuration.name);
    let mut names = Vec::new();
    for prefix in ["height", "manual_height", "distance"] {
        for index in 0..MOST {
            let name = format!("{prefix}{index}");
            let Some(entry) = configuration.get(SAVED, &name) else {
                break;
            };
            let pose = |suffix: &str| -> Result<[f64; 3], InputError> {
                let steps = steps(configuration, &format!("{name}_{suffix}"))?;
                Ok(joints(steps))
            };
            let mut reading = Reading::at([0.0; 3]);
            if prefix == "distance" {
                let distance = configuration.require_above_zero(SAVED, &name)?;
                reading.joints = pose("pos1")?;
                reading.distance = Some((ReadingFrom::Pose(pose("pos2")?), distance));
            } else {
                let height = configuration.number(SAVED, &name)?.unwrap_or_default();
                reading.joints = pose("pos")?;
                reading.height = Some((0, height));
                file.planes = vec!["plane".to_owned()];
            }
            file.rows.push(Row {
                line: entry.line,
                value: reading,
            });
            names.push(name);
        }
    }
    Ok((file, names))
}

/// Steps of the three motors from their end stops.
fn steps(configuration: &Configuration, option: &str) -> Result<[f64; 3], InputError> {
    let entry = configuration.require(SAVED, option)?;
    let parts = entry
        .value
        .split(',')
        .map(|part| part.trim().parse::<f64>().ok());
    let parts: Option<Vec<f64>> = parts.map(|own| own.filter(|own| own.is_finite())).collect();
    parts.and_then(|own| own.try_into().ok()).ok_or_else(|| {
        let wanted = "three numbers of steps, separated by commas";
        configuration.damaged(SAVED, option, wanted)
    })
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
        let own = configuration.number(section, option)?;
        let place = if own.is_some() { section } else { STEPPERS[0] };
        *value = own
            .or(first)
            .ok_or_else(|| configuration.lacking(section, option))?;
        if let Some(least) = least
            && !(*value > least)
        {
            return Err(configuration.damaged(place, option, &format!("above {least}")));
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
    rotary: bool,
) -> Result<f64, InputError> {
    let turn = if rotary {
        configuration.require(section, "gear_ratio")?;
        TAU
    } else if let Some(distance) = configuration.above_zero(section, "rotation_distance")? {
        distance
    } else {
        // As older versions of Klipper have it.
        let length = configuration.above_zero(section, "step_distance")?;
        return length.ok_or_else(|| configuration.lacking(section, "rotation_distance"));
    };
    let microsteps = configuration.require_above_zero(section, "microsteps")?;
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

/// Includes that are not there.
fn missing(configuration: &Configuration) -> Vec<String> {
    let note = |(file, line): &(String, u64)| {
        format!(
            "{file}:{line} includes a file that is not there. If it holds a part of [printer], [stepper_a] to [stepper_c] \
             or [delta_calibrate], copy it beside the configuration and import again."
        )
    };
    configuration.missing.iter().map(note).collect()
}
