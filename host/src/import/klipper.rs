//! A Delta's Klipper configuration, and the measurements saved in its `[delta_calibrate]`.

use super::Firmware;
use super::configuration::{Configuration, Includes};
use super::imported::{Imported, Machine, PROBE, Towers, USUAL_TOWERS, rods_note};
use super::stated::Stated;
use crate::files::input::{InputError, InputText};
use crate::files::samples_file::{Reading, ReadingFrom, Readings, Row};
use delta_cal::robot::Arm;
use std::f64::consts::TAU;

const STEPPERS: [&str; 3] = ["stepper_a", "stepper_b", "stepper_c"];
const SAVED: &str = "delta_calibrate";
/// The number of measurements of a kind that Klipper reads.
const MOST: usize = 999;
/// The full steps of a motor's turn if its section does not state them.
const FULL_STEPS: f64 = 200.0;
/// The azimuths of rotary arms, degrees.
const USUAL_ARMS: [f64; 3] = [30.0, 150.0, 270.0];

/// A pose this far below its measured height was saved with another configuration, mm.
const BELOW: f64 = 20.0;
/// Klipper's parameters fit the heights saved with them far better than this, mm rms.
const STALE: f64 = 4.0;

/// Reads a configuration and its saved measurements; stated values replace configured ones.
///
/// # Errors
/// Not a Delta, an option that is missing or damaged, or an impossible geometry.
pub(super) fn import(
    input: &InputText,
    stated: &Stated,
    includes: &Includes<'_>,
) -> Result<Imported, InputError> {
    let configuration = Configuration::read(input, includes)?;
    let kinematics = configuration.require("printer", "kinematics")?;
    let imported = match kinematics.value.as_str() {
        "delta" => linear(&configuration, stated),
        "rotary_delta" if stated.rods.is_none() && stated.radius.is_none() => {
            rotary(&configuration)
        }
        "rotary_delta" => {
            let cause = "--rods and --radius are for towers, and kinematics: rotary_delta has none";
            Err(InputError::new(&configuration.name, cause)
                .with_remedy("omit them, and edit lb_mm in the robot file"))
        }
        _ => Err(configuration
            .damaged("printer", "kinematics", "delta or rotary_delta")
            .with_remedy("delta-cal calibrates Delta robots only")),
    }?;
    configuration.refuse_foreign()?;
    Ok(imported)
}

fn linear(configuration: &Configuration, stated: &Stated) -> Result<Imported, InputError> {
    let name = &configuration.name;
    let radius = configuration.require_above_zero("printer", "delta_radius")?;
    let mut notes = missing(configuration);
    let rods = match (
        like_first(configuration, "arm_length", Some(radius)),
        stated.rods,
    ) {
        (Ok(rods), _) => {
            notes.extend(rods_note(stated.rods, rods));
            rods
        }
        (Err(_), Some(stated)) => stated,
        (Err(error), None) => return Err(error),
    };
    let configured = Towers {
        radius,
        rods,
        azimuths: azimuths(configuration, USUAL_TOWERS)?,
        endstops: like_first(configuration, "position_endstop", None)?,
    };
    let towers = configured.as_stated(stated);
    if let Some(short) = towers.rods.iter().find(|rod| !(**rod > towers.radius)) {
        let cause = format!(
            "rods of {short} mm are not longer than the delta radius, {} mm",
            towers.radius
        );
        return Err(InputError::new(name, cause)
            .with_remedy("state the distance between a rod's joints with --rods"));
    }
    let machine = Machine::towers(name, &configured, stated)?;
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
    refuse_elsewhere(configuration, &imported)?;
    Ok(Imported {
        bed_radius: Some(bed),
        ..imported
    })
}

/// Refuses poses far below the bed, and heights to which the saved parameters were not fitted.
fn refuse_elsewhere(configuration: &Configuration, imported: &Imported) -> Result<(), InputError> {
    let fault = |name: &str, cause: String, remedy: &str| {
        let fault = InputError::new(&configuration.name, cause).at_key(name);
        let entry = configuration.get(SAVED, name);
        entry
            .map_or(fault.clone(), |entry| fault.at_line(entry.line))
            .with_remedy(remedy)
    };
    let high = |joints: &[f64; 3]| imported.configured.forward(joints).map(|at| at.z);
    let (mut squares, mut count) = (0.0, 0.0);
    for (row, name) in imported.readings.rows.iter().zip(&imported.names) {
        let reading = &row.value;
        let height = reading.height.map_or(0.0, |(_, height)| height);
        let Ok(to) = high(&reading.joints) else {
            continue;
        };
        let below = match reading.distance {
            Some((ReadingFrom::Pose(from), _)) => high(&from).map(|from| vec![from, to]),
            _ => Ok(vec![to - height]),
        };
        let below = below.unwrap_or_default();
        if below.iter().any(|own| *own < -BELOW) {
            let depths: Vec<_> = below.iter().map(|own| format!("{:.0}", -own)).collect();
            let cause = format!(
                "measured {} mm below the bed: it was saved with other end stops or steps",
                depths.join(" and ")
            );
            let remedy = "measure it again (DELTA_CALIBRATE, DELTA_ANALYZE), or delete it";
            return Err(fault(name, cause, remedy));
        }
        if reading.height.is_some() {
            squares += (to - height).powi(2);
            count += 1.0;
        }
    }
    let off = f64::sqrt(squares / f64::max(count, 1.0));
    let together = [
        ("printer", "delta_radius"),
        (STEPPERS[0], "position_endstop"),
        (SAVED, "height0"),
    ];
    let saved = |(section, option)| {
        configuration
            .get(section, option)
            .is_some_and(|own| own.saved)
    };
    if off > STALE && together.into_iter().all(saved) {
        let cause = format!(
            "the saved heights are {off:.1} mm rms off the saved parameters: rods, end stops or steps were changed after \
             DELTA_CALIBRATE"
        );
        let remedy = "run DELTA_CALIBRATE and SAVE_CONFIG again";
        return Err(fault("height0", cause, remedy));
    }
    Ok(())
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
    let machine = Machine::rotary(&configuration.name, arm, endstops)?;
    let notes = missing(configuration);
    finished(configuration, &machine, true, (0.0, 0.0), notes)
}

/// The robot and its readings. Steps lead down from the end stops: angles increase, travels decrease.
fn finished(
    configuration: &Configuration,
    machine: &Machine,
    rotary: bool,
    area: (f64, f64),
    mut notes: Vec<String>,
) -> Result<Imported, InputError> {
    let mut home = [0.0; 3];
    let mut step_lengths = [0.0; 3];
    for (index, (section, own)) in STEPPERS.into_iter().zip(machine.home()).enumerate() {
        home[index] = own.ok_or_else(|| {
            configuration.damaged(section, "position_endstop", "a height that the arm reaches")
        })?;
        let length = step_length(configuration, section, rotary)?;
        step_lengths[index] = if rotary { length } else { -length };
    }
    let joints =
        |steps: [f64; 3]| [0, 1, 2].map(|motor| home[motor] + steps[motor] * step_lengths[motor]);
    let (readings, names) = measured(configuration, joints)?;
    notes.extend(configuration.included_geometry());
    if let Some(line) = configuration.broken {
        notes.push(format!(
            "{}:{line} makes Klipper ignore the SAVE_CONFIG block: every line in and below it must begin with #*#. Move \
             the line above the block, or delete it if it is empty.",
            configuration.name
        ));
    }
    Ok(Imported {
        firmware: Firmware::Klipper,
        robot: machine.robot_file(&configuration.name, home, area, &readings)?,
        configured: machine.configured,
        readings,
        names,
        home,
        bed_radius: configuration.above_zero(SAVED, "radius")?,
        saved_ignored: configuration.broken.is_some(),
        notes,
    })
}

/// Probed heights, manual heights and distances, each with its name in the configuration. If there are heights of both
/// kinds, the manual ones are the bed's, because the probe's offset is unknown.
fn measured(
    configuration: &Configuration,
    joints: impl Fn([f64; 3]) -> [f64; 3],
) -> Result<(Readings, Vec<String>), InputError> {
    let mut file = Readings::of_name(&configuration.name);
    let mut names = Vec::new();
    let has = |option| configuration.get(SAVED, option).is_some();
    // The height of rotary arms is too uncertain for a probe's offset to matter.
    let linear = configuration.get("printer", "delta_radius").is_some();
    let both = linear && has("height0") && has("manual_height0");
    for prefix in ["height", "manual_height", "distance"] {
        for index in 0..MOST {
            let name = format!("{prefix}{index}");
            let Some(entry) = configuration.get(SAVED, &name) else {
                break;
            };
            let pose =
                |suffix: &str| steps(configuration, &format!("{name}_{suffix}")).map(&joints);
            let mut reading = Reading::at([0.0; 3]);
            if prefix == "distance" {
                let distance = configuration.require_above_zero(SAVED, &name)?;
                reading.joints = pose("pos1")?;
                reading.distance = Some((ReadingFrom::Pose(pose("pos2")?), distance));
            } else {
                let height = configuration.number(SAVED, &name)?.unwrap_or_default();
                reading.joints = pose("pos")?;
                reading.height = Some((usize::from(both && prefix == "height"), height));
                file.planes = vec!["plane".to_owned()];
                if both {
                    file.planes.push(PROBE.to_owned());
                }
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

/// The steps of the three motors from their end stops.
fn steps(configuration: &Configuration, option: &str) -> Result<[f64; 3], InputError> {
    let entry = configuration.require(SAVED, option)?;
    let number = |part: &str| part.trim().parse().ok().filter(|own: &f64| own.is_finite());
    let parts: Option<Vec<f64>> = entry.value.split(',').map(number).collect();
    parts.and_then(|own| own.try_into().ok()).ok_or_else(|| {
        let wanted = "three numbers of steps, separated by commas";
        configuration.damaged(SAVED, option, wanted)
    })
}

/// An option of the three motors; the first motor's value applies where the others state none.
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

/// The length of a motor's step: mm, or radians of a rotary arm.
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
        // Older versions of Klipper.
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
    let pairs = entry
        .value
        .split(',')
        .filter(|pair| !pair.trim().is_empty());
    for pair in pairs {
        let number = |text: &str| text.trim().parse().ok().filter(|own| *own > 0.0);
        let numbers = pair.split_once(':').and_then(|(driven, driving)| {
            let ratio: f64 = number(driven)?;
            Some(ratio / number(driving)?)
        });
        ratio *= numbers.ok_or_else(|| {
            let wanted = "ratios such as 107:16, separated by commas";
            configuration.damaged(section, "gear_ratio", wanted)
        })?;
    }
    Ok(ratio)
}

/// Notes on included files that do not exist.
fn missing(configuration: &Configuration) -> Vec<String> {
    let note = |(file, line): &(String, u64)| {
        format!(
            "{file}:{line} includes a file that does not exist. If it contains part of [printer], [stepper_a] to \
             [stepper_c] or [delta_calibrate], copy it beside the configuration and import again."
        )
    };
    configuration.missing.iter().map(note).collect()
}
