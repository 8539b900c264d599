//! Effects in words: what each is, its size, and its remedy.

use super::{Effect, EffectKind};
use crate::files::convention::Convention;
use crate::text::significant;
use delta_cal::robot::Drive;
use nalgebra::{DVector, Vector3};

impl EffectKind {
    /// Its name: `gear_ratio`, `eccentricity`, `second_harmonic`, `uneven_travel`, `backlash`, `sag`, `drift` or
    /// `scale`.
    pub const fn name(self) -> &'static str {
        let [name, ..] = self.words();
        name
    }

    /// Its name, the noun for a sentence, and the remedy.
    const fn words(self) -> [&'static str; 3] {
        match self {
            Self::GearRatio => [
                "gear_ratio",
                "a wrong gear ratio",
                "correct the gear ratio or the encoder's steps per turn in the controller, or state transmission_deg \
                 in [tolerance], with which the calibration finds it (docs/instruments.md#gears-and-encoders)",
            ],
            Self::Eccentricity => [
                "eccentricity",
                "an eccentricity",
                "centre the gear or the encoder, or correct the joint angle in the controller by a table, or state \
                 transmission_deg in [tolerance], with which the calibration finds it \
                 (docs/instruments.md#gears-and-encoders)",
            ],
            Self::SecondHarmonic => [
                "second_harmonic",
                "an error twice a turn",
                "look at the encoder and the coupling, or correct the joint angle in the controller by a table, or \
                 state transmission_deg in [tolerance], with which the calibration finds it \
                 (docs/instruments.md#gears-and-encoders)",
            ],
            Self::UnevenTravel => [
                "uneven_travel",
                "an uneven travel",
                "straighten the tower, look at the belt or the screw, or correct the travel in the \
                 controller by a table",
            ],
            Self::Backlash => [
                "backlash",
                "a backlash",
                "remove the play, or approach every pose from the same side",
            ],
            Self::Sag => [
                "sag",
                "a sag of the platform",
                "measure with the load and the speed of later use, or stiffen what bends",
            ],
            Self::Drift => [
                "drift",
                "a drift of the positions",
                "let the robot and the sensor warm up, fasten the sensor, and measure in random \
                 order",
            ],
            Self::Slip => [
                "slip",
                "a jump of the joint zero",
                "an encoder or a coupling slipped: fix it, home the robot and measure again, or calibrate only the rows \
                 before or after",
            ],
            Self::Move => [
                "move",
                "a move of the sensor",
                "the sensor, its reflector, the plate or the robot's base was moved: calibrate the rows before and after \
                 separately",
            ],
            Self::Target => [
                "target",
                "a target beside its stated place",
                "measure where the target is on the platform, and correct [target]",
            ],
            Self::Datum => [
                "datum",
                "wrong datum points",
                "measure the datum points again",
            ],
            Self::Scale => [
                "scale",
                "a wrong scale of the instrument or the sheet",
                "measure one known length with the same instrument or on the same sheet, and correct the readings by it",
            ],
        }
    }

    /// The remedy, given the alternatives that explain the residuals about equally well.
    pub(crate) fn remedy(self, alternatives: &[Self]) -> &'static str {
        let [.., own] = self.words();
        let mut all = alternatives.iter().chain([&self]);
        if alternatives.is_empty() {
            own
        } else if all.clone().all(|kind| kind.is_of_transmission()) {
            "state transmission_deg in [tolerance], with which the calibration finds any of these \
             (docs/instruments.md#gears-and-encoders), or find out which it is by comparing the joint with \
             a reference over its whole range, and fix that"
        } else if all.any(|kind| *kind == Self::Scale) {
            "to tell them apart, measure one known length with the same instrument or on the same \
             sheet, and one pose with another load"
        } else {
            "to tell them apart, compare the joint with a reference \
             over its whole range, and measure one pose with another load, from another \
             side and again at the end"
        }
    }
}

impl Effect {
    /// Its size in the [unit](EffectKind::unit) with its σ, and in words, from the coefficients of its columns.
    pub(crate) fn described(
        &self,
        by: &[f64],
        sigma: f64,
        drive: Drive,
        convention: &Convention,
    ) -> (f64, f64, String) {
        let in_unit = |value: f64| match self.kind.unit(drive) {
            "deg" => value.to_degrees(),
            _ => value,
        };
        let (size, drifted) = match by {
            [only] => (*only, Vector3::zeros()),
            [x, y, z] => {
                let drift = Vector3::new(*x, *y, *z);
                (drift.norm(), convention.vector(&drift))
            }
            several => (DVector::from_column_slice(several).norm(), Vector3::zeros()),
        };
        let (size, sigma) = (in_unit(size), in_unit(sigma));
        (size, sigma, words(self, drive, (size, sigma), &drifted))
    }

    /// With article and arm: "an eccentricity of arm 2".
    pub(crate) fn named(&self) -> String {
        let [_, noun, _] = self.kind.words();
        match self.arm {
            Some(arm) => format!("{noun} of {arm}"),
            None => noun.to_owned(),
        }
    }
}

/// An effect in words, with its size and σ in the [unit](EffectKind::unit): "arm 2: the joint has an error that repeats
/// once a turn, with an amplitude of 0.051° ± 0.004°, as with an eccentric gear or encoder". `drifted`: the drift along
/// the axes of the file's convention.
fn words(
    effect: &Effect,
    drive: Drive,
    (signed, sigma): (f64, f64),
    drifted: &Vector3<f64>,
) -> String {
    let (size, of_sigma) = (significant(signed.abs(), 2), significant(sigma, 1));
    let farther = if signed > 0.0 { "farther" } else { "less far" };
    let what = match effect.kind {
        EffectKind::GearRatio => format!(
            "the joint turns {farther} than it reports, in proportion to the angle, by {size} ± {of_sigma} \
             of it: a wrong gear ratio"
        ),
        EffectKind::Eccentricity => format!(
            "the joint has an error that repeats once a turn, with an amplitude of \
             {size}° ± {of_sigma}°; an eccentric gear or encoder"
        ),
        EffectKind::SecondHarmonic => format!(
            "the joint has an error that repeats twice a turn, with an amplitude of \
             {size}° ± {of_sigma}°; a misaligned coupling or a distorted encoder disc"
        ),
        EffectKind::UnevenTravel => format!(
            "at the ends of its measured range the carriage is {farther} along its tower than in the middle, by \
             {size} ± {of_sigma} mm; a bent tower or an uneven belt or screw"
        ),
        EffectKind::Backlash => {
            let (joint, unit, of) = match drive {
                Drive::Rotary => ("joint", "°", "backlash or hysteresis of the gear"),
                Drive::Linear => ("carriage", " mm", "backlash of the belt or the screw"),
            };
            format!(
                "the {joint}'s error changes with the direction of its last move, by \
                 ±{size}{unit} (σ {of_sigma}{unit}): {of}, if the rows are in \
                 measured order"
            )
        }
        EffectKind::Sag => format!(
            "the platform is {} with its distance from the robot's axis, by {size} ± {of_sigma} mm \
             at the largest distance; arms or a frame that bend under the load",
            if signed > 0.0 { "lower" } else { "higher" }
        ),
        EffectKind::Drift => format!(
            "the measured positions drift by {size} ± {of_sigma} mm from the first row to the \
             last (x {:+.3}, y {:+.3}, z {:+.3} mm); a sensor that moves or a robot that warms up, if the rows are in \
             measured order",
            drifted.x, drifted.y, drifted.z
        ),
        EffectKind::Slip => format!(
            "the joint zero jumps by {} ± {of_sigma}{}",
            significant(signed, 2),
            if drive == Drive::Rotary { "°" } else { " mm" }
        ),
        EffectKind::Move | EffectKind::Datum => {
            format!("the sensor's frame is {size} mm and {of_sigma} mm off")
        }
        EffectKind::Target => format!(
            "the target is {size} ± {of_sigma} mm beside its stated place (x {:+.3}, y {:+.3}, z {:+.3} mm)",
            drifted.x, drifted.y, drifted.z
        ),
        EffectKind::Scale => format!(
            "all measured lengths are {} ± {} % {} than the robot makes them; a sheet printed at \
             another size or an instrument of another scale",
            significant(100.0 * signed.abs(), 2),
            significant(100.0 * sigma, 1),
            if signed > 0.0 { "larger" } else { "smaller" }
        ),
    };
    match effect.arm {
        Some(arm) => format!("{arm}: {what}"),
        None => what,
    }
}
