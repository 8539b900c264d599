//! Rotary Deltas of RepRapFirmware (M669 K10), FluidNC (`parallel_delta`) and grblHAL (`$641` to `$648`).

use super::imported::{Imported, Machine};
use super::settings::Settings;
use super::{Firmware, Stated};
use crate::files::{InputError, InputText, Readings};
use crate::geometry::Shape;

pub(super) const M666: &str = "M666";
pub(super) const M669: &str = "M669";
/// The kinematics of rotary Deltas.
const ROTARY: f64 = 10.0;
/// Azimuths of RepRapFirmware's arms X, Y and Z, and of the motors of the others, degrees.
const ARMS: [f64; 3] = [-150.0, -30.0, 90.0];
const MOTORS: [f64; 3] = [-90.0, 30.0, 150.0];
/// The highest angle of an arm that RepRapFirmware assumes, degrees above level.
const HIGHEST: f64 = 45.0;

/// What FluidNC and grblHAL call the lengths and the angle of the end stops, grblHAL by number and by name; the sides of
/// triangles are 2√3 times the radii.
const NAMES: [(&str, &[&str]); 6] = [
    ("upper arm", &["crank_mm", "$642", "bicep length"]),
    ("forearm", &["linkage_mm", "$641", "forearm length"]),
    ("base", &["base_triangle_mm", "$643", "base radius"]),
    (
        "platform",
        &["end_effector_triangle_mm", "$644", "end effector radius"],
    ),
    (
        "home",
        &["homing_mpos_radians", "mpos_mm", "$646", "home position"],
    ),
    ("home in degrees", &["up_degrees"]),
];
const LENGTHS: &str = "lengths";

/// With each arm at its end stop at an angle below level, degrees.
fn imported(
    settings: &Settings,
    arms: &[Shape; 3],
    home: [f64; 3],
    bed: Option<f64>,
) -> Result<Imported, InputError> {
    let machine = Machine::rotary(&settings.name, arms, [0.0; 3], bed)?;
    let readings = Readings::of_name(&settings.name);
    machine.imported(settings, home.map(f64::to_radians), readings, Vec::new())
}

/// Towers have none of these.
pub(super) fn without_towers(settings: &Settings, stated: &Stated) -> Result<(), InputError> {
    if stated.rods.is_none() && stated.radius.is_none() {
        return Ok(());
    }
    let cause = "--rods and --radius are for towers, and this robot has none";
    Err(InputError::new(&settings.name, cause)
        .with_remedy("omit them, and edit lb_mm in the robot file"))
}

/// The rotary Delta that M669 K10 states; `None` if it states another kinematics.
///
/// # Errors
/// A word that is missing or damaged, or an impossible geometry.
pub(super) fn of_gcode(words: &Settings, stated: &Stated) -> Result<Option<Imported>, InputError> {
    if words.number(M669, "K")? != Some(ROTARY) {
        return Ok(None);
    }
    without_towers(words, stated)?;
    let each = |letter: &str| {
        let all = words.numbers(M669, letter, (':', "a finite number"))?;
        let first = *all.first().ok_or_else(|| words.lacking(M669, letter))?;
        let of = |index: usize| all.get(index).copied().unwrap_or(first);
        Ok::<_, InputError>([of(0), of(1), of(2)])
    };
    let range = words.numbers(M669, "A", (':', "two angles"))?;
    let highest = range.get(1).copied().unwrap_or(HIGHEST);
    let [corrections, trims] = [M669, M666].map(|command| words.three(command, ["X", "Y", "Z"]));
    let (corrections, trims) = (corrections?, trims?);
    let azimuths = [0, 1, 2].map(|arm| ARMS[arm] + corrections[arm]);
    let radius = words.require_above_zero(M669, "R")?;
    let arms = Shape::three(azimuths, radius, [each("H")?, each("U")?, each("L")?]);
    let home = trims.map(|trim| -(highest + trim));
    imported(words, &arms, home, words.above_zero(M669, "B")?).map(Some)
}

/// Reads FluidNC's configuration, or grblHAL's settings.
///
/// # Errors
/// A length that is missing or damaged, or an impossible geometry.
pub(super) fn import(
    input: &InputText,
    firmware: Firmware,
    stated: &Stated,
) -> Result<Imported, InputError> {
    let mut settings = Settings::of(firmware, input.name());
    for (line, own) in (1..).zip(input.text().lines()) {
        let lower = own.to_ascii_lowercase();
        let lower = lower.split(['#', ';', '(']).next().unwrap_or_default();
        let Some((name, value)) = lower.split_once([':', '=']) else {
            continue;
        };
        let mut known = NAMES.into_iter();
        let Some((option, _)) = known.find(|(_, names)| names.contains(&name.trim())) else {
            continue;
        };
        if settings.get(LENGTHS, option).is_none() {
            settings.set((LENGTHS, option), value.trim(), (input.name(), line), false);
        }
    }
    let lengths = &NAMES[..4];
    let mut lengths = lengths.iter();
    let missing = lengths.find(|(option, _)| settings.get(LENGTHS, option).is_none());
    if let Some((_, names)) = missing {
        let cause = format!("the file states no {}", names.join(" or "));
        return Err(InputError::new(input.name(), cause).with_remedy(
            "give FluidNC's YAML file with parallel_delta, or what grblHAL prints for $$ with its Delta kinematics",
        ));
    }
    without_towers(&settings, stated)?;
    let length = |option| settings.require_above_zero(LENGTHS, option);
    let [upper, lower, base, platform] = [
        length("upper arm")?,
        length("forearm")?,
        length("base")?,
        length("platform")?,
    ];
    // FluidNC may state one angle for each motor; beside the newer angle in degrees it ignores it.
    let home = settings.numbers(LENGTHS, "home", (',', "an angle"))?;
    let degrees = settings.number(LENGTHS, "home in degrees")?;
    let each = [0, 1, 2].map(|motor| match (home.get(motor).or(home.first()), firmware) {
        (Some(angle), Firmware::FluidNc) => angle.to_degrees(),
        (angle, _) => angle.copied().unwrap_or_default(),
    });
    let radius = (base - platform) / (2.0 * 3f64.sqrt());
    let arms = Shape::three(MOTORS, radius, [[0.0; 3], [upper; 3], [lower; 3]]);
    let home = degrees.map_or(each, |own| [own; 3]);
    let mut imported = imported(&settings, &arms, home, None)?;
    imported.robot.platform_radius = Some(platform / (2.0 * 3f64.sqrt()));
    Ok(imported)
}
