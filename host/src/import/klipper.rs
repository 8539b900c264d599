//! A Delta's Klipper configuration, and the measurements saved in its `[delta_calibrate]`.

use super::configuration::{self, MESH, PRINTER, SAVED, STEPPERS};
use super::console::{Touch, gridded, with_touches};
use super::imported::{Imported, Machine, OF_PROBE, PROBE, Towers, USUAL_TOWERS};
use super::probe::Probe;
use super::rotary::without_towers;
use super::settings::Settings;
use super::stated::finite;
use super::{Includes, Stated};
use crate::files::{InputError, InputText, Reading, ReadingFrom, Readings, Row};
use crate::geometry::Shape;
use std::f64::consts::TAU;

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
    let (settings, broken) = configuration::read(input, includes)?;
    let kinematics = settings.require(PRINTER, "kinematics")?;
    let machine = match kinematics.value.as_str() {
        "delta" => linear(&settings, stated)?,
        "rotary_delta" => {
            without_towers(&settings, stated)?;
            rotary(&settings)?
        }
        _ => {
            return Err(settings
                .damaged(PRINTER, "kinematics", "delta or rotary_delta")
                .with_remedy("delta-cal calibrates Delta robots only"));
        }
    };
    let rotary = kinematics.value == "rotary_delta";
    let mut home = [0.0; 3];
    let mut step_lengths = [0.0; 3];
    for (index, (section, own)) in STEPPERS.into_iter().zip(machine.home()).enumerate() {
        home[index] = own.ok_or_else(|| {
            settings.damaged(section, "position_endstop", "a height that the arm reaches")
        })?;
        // Steps lead down from the end stops: angles increase, travels decrease.
        let length = step_length(&settings, section, rotary)?;
        step_lengths[index] = if rotary { length } else { -length };
    }
    let joints =
        |steps: [f64; 3]| [0, 1, 2].map(|motor| home[motor] + steps[motor] * step_lengths[motor]);
    let (readings, names) = measured(&settings, joints)?;
    let notes = configuration::notes(&settings, broken);
    let mut imported = machine.imported(&settings, home, readings, notes)?;
    imported.names = names;
    let probe = Probe {
        clearance: settings
            .number(SAVED, "horizontal_move_z")?
            .unwrap_or_default(),
        ..Probe::of(
            &settings,
            configuration::PROBE,
            ["x_offset", "y_offset", "z_offset"],
        )?
    };
    imported = imported.with_probe(probe, stated.apart);
    if imported.readings.rows.is_empty() && broken.is_none() {
        let meshed = mesh(&settings)?;
        if !meshed.is_empty() {
            imported = with_touches(imported, &settings.name, meshed)?;
        }
    }
    imported.saved_ignored = broken.is_some();
    if !rotary {
        refuse_elsewhere(&settings, &imported)?;
    }
    configuration::refuse_foreign(&settings)?;
    Ok(imported)
}

fn linear(settings: &Settings, stated: &Stated) -> Result<Machine, InputError> {
    let radius = settings.require_above_zero(PRINTER, "delta_radius")?;
    let rods = like_first(settings, "arm_length", Some(radius));
    let configured = Towers {
        radius,
        offsets: [0.0; 3],
        rods: match stated.rods {
            Some(stated) => rods.unwrap_or(stated),
            None => rods?,
        },
        azimuths: azimuths(settings, USUAL_TOWERS)?,
        endstops: like_first(settings, "position_endstop", None)?,
    };
    let towers = configured.as_stated(stated);
    if let Some(short) = towers.rods.iter().find(|rod| !(**rod > towers.radius)) {
        let cause = format!(
            "rods of {short} mm are not longer than the delta radius, {} mm",
            towers.radius
        );
        return Err(InputError::new(&settings.name, cause)
            .with_remedy("state the distance between a rod's joints with --rods"));
    }
    let bed = settings.above_zero(PRINTER, "print_radius")?;
    let bed = bed.or(settings.above_zero(SAVED, "radius")?);
    let lowest = settings.number(PRINTER, "minimum_z_position")?;
    let area = (Some(bed.unwrap_or(radius)), lowest.unwrap_or(0.0));
    Machine::towers(&settings.name, &configured, stated, area)
}

/// Refuses poses far below the bed, and heights to which the saved parameters were not fitted.
fn refuse_elsewhere(settings: &Settings, imported: &Imported) -> Result<(), InputError> {
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
            return Err(settings.fault(SAVED, name, &cause).with_remedy(remedy));
        }
        if reading.height.is_some() {
            squares += (to - height).powi(2);
            count += 1.0;
        }
    }
    let off = f64::sqrt(squares / f64::max(count, 1.0));
    let together = [
        (PRINTER, "delta_radius"),
        (STEPPERS[0], "position_endstop"),
        (SAVED, "height0"),
    ];
    let saved = |(section, option)| settings.get(section, option).is_some_and(|own| own.saved);
    if off > STALE && together.into_iter().all(saved) {
        let cause = format!(
            "the saved heights are {off:.1} mm rms off the saved parameters: rods, end stops or steps were changed after \
             DELTA_CALIBRATE"
        );
        let fault = settings.fault(SAVED, "height0", &cause);
        return Err(fault.with_remedy("run DELTA_CALIBRATE and SAVE_CONFIG again"));
    }
    Ok(())
}

fn rotary(settings: &Settings) -> Result<Machine, InputError> {
    let radius = settings.require_above_zero(PRINTER, "shoulder_radius")?;
    let height = settings.require_above_zero(PRINTER, "shoulder_height")?;
    let azimuths = azimuths(settings, USUAL_ARMS)?;
    let upper = like_first(settings, "upper_arm_length", Some(0.0))?;
    let lower = like_first(settings, "lower_arm_length", Some(0.0))?;
    let endstops = like_first(settings, "position_endstop", None)?;
    let arms = Shape::three(azimuths, radius, [[height; 3], upper, lower]);
    let bed = settings.above_zero(SAVED, "radius")?;
    Machine::rotary(&settings.name, &arms, endstops, bed)
}

/// Probed heights, manual heights and distances, each with its name in the settings. If there are heights of both
/// kinds, the manual ones are the bed's, because the probe's offset is unknown.
fn measured(
    settings: &Settings,
    joints: impl Fn([f64; 3]) -> [f64; 3],
) -> Result<(Readings, Vec<String>), InputError> {
    let mut file = Readings::of_name(&settings.name);
    let mut names = Vec::new();
    let has = |option| settings.get(SAVED, option).is_some();
    // The height of rotary arms is too uncertain for a probe's offset to matter.
    let linear = settings.get(PRINTER, "delta_radius").is_some();
    let both = linear && has("height0") && has("manual_height0");
    for prefix in ["height", "manual_height", "distance"] {
        for index in 0..MOST {
            let name = format!("{prefix}{index}");
            let Some(entry) = settings.get(SAVED, &name) else {
                break;
            };
            let pose = |suffix: &str| steps(settings, &format!("{name}_{suffix}")).map(&joints);
            let mut reading = Reading::at([0.0; 3]);
            if prefix == "distance" {
                let distance = settings.require_above_zero(SAVED, &name)?;
                reading.joints = pose("pos1")?;
                reading.distance = Some((ReadingFrom::Pose(pose("pos2")?), distance));
            } else {
                let height = settings.number(SAVED, &name)?.unwrap_or_default();
                reading.joints = pose("pos")?;
                let probed = prefix == "height";
                reading.height = Some((usize::from(both && probed), height));
                reading.target = if probed { OF_PROBE } else { 0 };
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

/// The bed as `BED_MESH_CALIBRATE` saved it; outside a round bed its values are extrapolated.
fn mesh(settings: &Settings) -> Result<Vec<Touch>, InputError> {
    let Some(entry) = settings.get(MESH, "points") else {
        return Ok(Vec::new());
    };
    let side = |axis: &str| {
        let [low, high] = ["min", "max"].map(|end| settings.number(MESH, &format!("{end}_{axis}")));
        Ok::<_, InputError>(low?.zip(high?))
    };
    let (Some(x), Some(y)) = (side("x")?, side("y")?) else {
        return Ok(Vec::new());
    };
    let rows = entry.value.lines().filter(|row| !row.trim().is_empty());
    let rows = rows.map(|row| (entry.line, row.split(',').map(finite).collect()));
    let rows: Vec<(u64, Vec<_>)> = rows.collect();
    if rows.iter().any(|(_, row)| row.contains(&None)) {
        return Err(settings.damaged(MESH, "points", "rows of numbers"));
    }
    let step = |(low, high): (f64, f64), places: usize| (high - low) / (places.max(2) - 1) as f64;
    let across = rows.first().map_or(0, |(_, row)| row.len());
    let steps = [step(x, across), step(y, rows.len())];
    Ok(gridded(&rows, ([x.0, y.0], steps), x.1.max(y.1)))
}

/// The steps of the three motors from their end stops.
fn steps(settings: &Settings, option: &str) -> Result<[f64; 3], InputError> {
    const WANTED: &str = "three numbers of steps, separated by commas";
    settings.require(SAVED, option)?;
    let parts = settings.numbers(SAVED, option, (',', WANTED))?;
    parts
        .try_into()
        .map_err(|_| settings.damaged(SAVED, option, WANTED))
}

/// An option of the three motors; the first motor's value applies where the others state none.
fn like_first(
    settings: &Settings,
    option: &str,
    least: Option<f64>,
) -> Result<[f64; 3], InputError> {
    let mut values = [0.0; 3];
    let mut first = None;
    for (value, section) in values.iter_mut().zip(STEPPERS) {
        let own = settings.number(section, option)?;
        let place = if own.is_some() { section } else { STEPPERS[0] };
        *value = own
            .or(first)
            .ok_or_else(|| settings.lacking(section, option))?;
        if let Some(least) = least
            && !(*value > least)
        {
            return Err(settings.damaged(place, option, &format!("above {least}")));
        }
        first = first.or(Some(*value));
    }
    Ok(values)
}

fn azimuths(settings: &Settings, usual: [f64; 3]) -> Result<[f64; 3], InputError> {
    let mut azimuths = usual;
    for (azimuth, section) in azimuths.iter_mut().zip(STEPPERS) {
        if let Some(own) = settings.number(section, "angle")? {
            if !(own.abs() <= 360.0) {
                return Err(settings.damaged(section, "angle", "an angle of up to 360 degrees"));
            }
            *azimuth = own;
        }
    }
    Ok(azimuths)
}

/// The length of a motor's step: mm, or radians of a rotary arm.
fn step_length(settings: &Settings, section: &str, rotary: bool) -> Result<f64, InputError> {
    let turn = if rotary {
        settings.require(section, "gear_ratio")?;
        TAU
    } else if let Some(distance) = settings.above_zero(section, "rotation_distance")? {
        distance
    } else {
        // Older versions of Klipper.
        let length = settings.above_zero(section, "step_distance")?;
        return length.ok_or_else(|| settings.lacking(section, "rotation_distance"));
    };
    let microsteps = settings.require_above_zero(section, "microsteps")?;
    let full = settings.above_zero(section, "full_steps_per_rotation")?;
    let full = full.unwrap_or(FULL_STEPS);
    Ok(turn / (full * microsteps * gear_ratio(settings, section)?))
}

fn gear_ratio(settings: &Settings, section: &str) -> Result<f64, InputError> {
    let Some(entry) = settings.get(section, "gear_ratio") else {
        return Ok(1.0);
    };
    let number = |text: &str| text.trim().parse().ok().filter(|own: &f64| *own > 0.0);
    let ratio = |pair: &str| {
        let (driven, driving) = pair.split_once(':')?;
        Some(number(driven)? / number(driving)?)
    };
    let pairs = entry.value.split(',').filter(|own| !own.trim().is_empty());
    let ratio: Option<f64> = pairs.map(ratio).product();
    ratio.ok_or_else(|| {
        let wanted = "ratios such as 107:16, separated by commas";
        settings.damaged(section, "gear_ratio", wanted)
    })
}
