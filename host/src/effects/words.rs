//! Effects in words: what each is, its size, and its remedy.

use super::{Effect, EffectKind};
use crate::files::{Kind, ONLY_TARGET, Readings, RobotFile};
use crate::text::{joint, list, significant};
use delta_cal::robot::Drive;
use nalgebra::{DVector, Vector3};

/// A mistake leaves at most this part of the difference.
const EXPLAINED: f64 = 0.2;

impl EffectKind {
    /// Its name: `gear_ratio`, `eccentricity`, `second_harmonic`, `uneven_travel`, `backlash`, `sag`, `drift` or
    /// `scale`.
    pub const fn name(self) -> &'static str {
        let [name, ..] = self.words();
        name
    }

    /// Its name, the noun for a sentence, and the remedy.
    #[expect(clippy::too_many_lines, reason = "one entry a kind")]
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
            Self::Bed => [
                "bed",
                "an uneven surface",
                "touch a flatter one, or state in [noise] bed_mm by how much it is uneven, rms",
            ],
            Self::Oversize => [
                "oversize",
                "an error common to all distances",
                "set the calliper to zero, or correct the extrusion or the slicer's horizontal expansion",
            ],
            Self::Tilt => [
                "tilt",
                "rods of a pair that differ",
                "exchange the rods of each arm for a matched pair",
            ],
            Self::Datum => [
                "datum",
                "wrong datum points",
                "measure the datum points again",
            ],
            Self::Zeros => [
                "joint_zeros",
                "wrong joint zeros",
                "home the robot again, or state in [tolerance] zero_deg how many degrees its joint zeros may be off",
            ],
            Self::Gears => [
                "gears",
                "a wrong gear ratio of all joints",
                "correct the gear ratio or the steps per mm in the controller",
            ],
            Self::Forearm => [
                "forearm",
                "wrong forearms",
                "measure the forearms, and correct the robot file",
            ],
            Self::UpperArm => [
                "upper_arm",
                "wrong upper arms",
                "measure the upper arms, and correct the robot file",
            ],
            Self::Radius => [
                "radius",
                "a wrong radius",
                "measure the distance between two motors or towers, and correct the robot file",
            ],
            Self::Size => [
                "size",
                "another size of the robot",
                "measure one known length, such as a gauge block",
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
        } else if all.any(|kind| matches!(kind, Self::Scale | Self::Size)) {
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
    /// Its size in the [unit](EffectKind::unit) with its σ, and in words, from its unknowns.
    pub(crate) fn described(
        &self,
        by: &[f64],
        sigma: f64,
        robot: &RobotFile,
        readings: &Readings,
    ) -> (f64, f64, String) {
        let drive = robot.robot.drive();
        let in_unit = |value: f64| match self.kind.unit(drive) {
            "deg" => value.to_degrees(),
            _ => value,
        };
        let size = match (by, self.kind) {
            ([only], _) => *only,
            // The size of a move is that of its translation.
            ([x, y, z, ..], EffectKind::Move | EffectKind::Datum) => {
                Vector3::new(*x, *y, *z).norm()
            }
            (several, _) => DVector::from_column_slice(several).norm(),
        };
        let (size, sigma) = (in_unit(size), in_unit(sigma));
        (
            size,
            sigma,
            self.sentence(by, (size, sigma), robot, readings),
        )
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

impl Effect {
    /// In words, with its size and σ in the [unit](EffectKind::unit): "arm 2: the joint has an error that repeats once a
    /// turn, with an amplitude of 0.051° ± 0.004°, as with an eccentric gear or encoder".
    #[expect(clippy::too_many_lines, reason = "one sentence a kind")]
    fn sentence(
        &self,
        by: &[f64],
        (signed, sigma): (f64, f64),
        robot: &RobotFile,
        readings: &Readings,
    ) -> String {
        let (drive, convention) = (robot.robot.drive(), &robot.convention);
        let line = readings.rows.get(self.index).map_or(0, |row| row.line);
        let vector = |by: &[f64]| match by {
            [x, y, z, ..] => convention.vector(&Vector3::new(*x, *y, *z)),
            _ => Vector3::zeros(),
        };
        let moved = vector(by);
        let [arm, ..] = robot.robot.arms();
        let percent = format!("{:+.2} %", 100.0 * by.first().copied().unwrap_or_default());
        let length = |own: f64| significant(own * (1.0 + by[0]), 4);
        let (size, of_sigma) = (significant(signed.abs(), 2), significant(sigma, 1));
        let farther = if signed > 0.0 { "farther" } else { "less far" };
        let what = match self.kind {
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
                moved.x, moved.y, moved.z
            ),
            EffectKind::Slip => format!(
                "the joint zero jumps by {} ± {of_sigma}{} at line {line}",
                significant(convention.degrees(by[0]), 2),
                joint::mark(drive)
            ),
            EffectKind::Move if readings.holds(Kind::Height) && !readings.holds(Kind::Position) => {
                format!("from line {line} on, all heights are off by {size} mm")
            }
            EffectKind::Move => {
                let (what, moved) = if readings.holds(Kind::Position) {
                    ("positions", moved)
                } else {
                    ("points from which distances are measured", -moved)
                };
                format!(
                    "from line {line} on, the {what} are moved by ({:.2}, {:.2}, {:.2}) mm and turned by {}°",
                    moved.x,
                    moved.y,
                    moved.z,
                    significant(vector(&by[3..]).norm().to_degrees(), 2)
                )
            }
            EffectKind::Datum => {
                format!("the datum points put the sensor {size} mm beside its place")
            }
            EffectKind::Bed => {
                format!("the touched surface itself is uneven by {size} ± {of_sigma} mm rms")
            }
            EffectKind::Tilt => {
                "the platform tilts, because the two rods of an arm differ".to_owned()
            }
            EffectKind::Oversize => {
                let than = if signed > 0.0 { "longer" } else { "shorter" };
                format!(
                    "all distances between two poses are {than} by the same, {size} ± {of_sigma} mm: a calliper's zero, or prints \
                     that are too thick"
                )
            }
            EffectKind::Zeros => {
                let each: Vec<_> = (1..)
                    .zip(by)
                    .map(|(arm, by)| {
                        format!("arm {arm} {:+.1}°", convention.angle(*by).to_degrees())
                    })
                    .collect();
                let hang = if by.iter().all(|own| *own < 0.0) {
                    " (the arms hang lower than their joints read)"
                } else if by.iter().all(|own| *own > 0.0) {
                    " (the arms hang higher than their joints read)"
                } else {
                    ""
                };
                format!("the joint zeros are off: {}{hang}", list(&each))
            }
            EffectKind::Gears if drive == Drive::Linear => {
                format!("the steps per mm are off by {percent}")
            }
            EffectKind::Gears => format!("the gear ratio is off by {percent}"),
            // Either may be the larger one.
            EffectKind::Radius => {
                let stated = arm.d().xy().norm();
                let found = (stated * (1.0 + by[0])).abs();
                let [found, stated] = [found, stated].map(|own| significant(own, 4));
                format!("the radii of base and platform differ by {found} mm, not {stated} mm")
            }
            EffectKind::Forearm => {
                format!("the forearms are {} mm long ({percent})", length(arm.lb()))
            }
            EffectKind::UpperArm => format!(
                "the upper arms are {} mm long ({percent})",
                length(arm.upper_arm_length())
            ),
            EffectKind::Size => format!(
                "all lengths are {:.2} % {}, or the instrument's scale is that far off",
                100.0 * signed.abs(),
                if signed > 0.0 { "larger" } else { "smaller" }
            ),
            EffectKind::Target => {
                let name = readings.targets.get(self.index);
                let name = name.map_or(ONLY_TARGET, String::as_str);
                misplaced(robot, name, by).unwrap_or_else(|| {
                    format!(
                        "all points are beside the platform point; if a reflector or a tip is mounted there, state \
                         [target] x_mm = {:.1}, y_mm = {:.1}, z_mm = {:.1}",
                        moved.x, moved.y, moved.z
                    )
                })
            }
            EffectKind::Scale => format!(
                "all measured lengths are {} ± {} % {} than the robot makes them; a sheet printed at \
             another size or an instrument of another scale",
                significant(100.0 * signed.abs(), 2),
                significant(100.0 * sigma, 1),
                if signed > 0.0 { "larger" } else { "smaller" }
            ),
        };
        match self.arm {
            Some(arm) => format!("{arm}: {what}"),
            None => what,
        }
    }
}

/// A stated target that the readings put elsewhere: "target: x and y look exchanged; fitted 17 mm from its stated place, …".
pub(crate) fn misplaced(robot: &RobotFile, name: &str, fitted: &[f64]) -> Option<String> {
    let targets = &robot.instruments.targets;
    let place = |own: &Vector3<f64>| robot.convention.vector(own);
    let stated = place(&robot.instruments.target(name)?.place);
    let fitted = place(&Vector3::from_column_slice(fitted));
    let others = targets.iter().filter(|own| own.name != name);
    let others = others.map(|own| {
        (
            place(&own.place),
            format!("looks exchanged with {}; ", own.name),
        )
    });
    let [x, y, z] = fitted.data.0[0];
    Some(format!(
        "{name}: {}fitted {} mm from its stated place, at x {x:.2}, y {y:.2}, z {z:.2} mm",
        mistaken(&stated, &fitted, others),
        significant((fitted - stated).norm(), 2)
    ))
}

/// A mistake that makes the stated coordinates the fitted ones: two exchanged, a sign, or one of others.
fn mistaken(
    stated: &Vector3<f64>,
    fitted: &Vector3<f64>,
    others: impl Iterator<Item = (Vector3<f64>, String)>,
) -> String {
    let names = ["x", "y", "z"];
    let pairs = [(0, 1), (1, 2), (0, 2)].map(|(one, other)| {
        let mut changed = *stated;
        changed.swap_rows(one, other);
        (
            changed,
            format!("{} and {} look exchanged; ", names[one], names[other]),
        )
    });
    let signs = [0, 1, 2].map(|axis| {
        let mut changed = *stated;
        changed[axis] = -changed[axis];
        (
            changed,
            format!("the sign of {} looks wrong; ", names[axis]),
        )
    });
    let all = pairs.into_iter().chain(signs).chain(others);
    let left = all.map(|(changed, text)| ((fitted - changed).norm(), text));
    let best = left.min_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(left, _)| *left < EXPLAINED * (fitted - stated).norm())
        .map_or_else(String::new, |(_, text)| text)
}
