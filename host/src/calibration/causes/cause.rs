//! A cause of residuals that the model does not hold, in figures and in words.

use crate::files::convention::Convention;
use crate::text::significant;
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use std::fmt;

/// What kind of error it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CauseKind {
    /// The joint turns by another angle than it says, in proportion: δq = g q.
    GearRatio,
    /// Once a turn: δq = a cos q + b sin q.
    Eccentricity,
    /// Twice a turn: δq = a cos 2q + b sin 2q.
    SecondHarmonic,
    /// A carriage is farther along its tower at the ends of its range than in the middle: δs = c u², u being −1 and 1
    /// at the lowest and the highest s of the file.
    UnevenTravel,
    /// With the direction of the joint's last move: δq = ±h.
    Backlash,
    /// The platform hangs lower the farther it is from the robot's axis: δz = −s (r/r_max)².
    Sag,
    /// The positions move in proportion to the row's number.
    Drift,
    /// Coordinates and distances are larger than the robot makes them, in proportion.
    Scale,
}

impl CauseKind {
    /// Those of one joint.
    pub(super) const fn of_joints(drive: Drive) -> &'static [Self] {
        match drive {
            Drive::Rotary => &[
                Self::GearRatio,
                Self::Eccentricity,
                Self::SecondHarmonic,
                Self::Backlash,
            ],
            Drive::Linear => &[Self::UnevenTravel, Self::Backlash],
        }
    }

    /// Those of no joint.
    pub(super) const OF_PLATFORM: [Self; 3] = [Self::Sag, Self::Drift, Self::Scale];

    /// Whether it must explain clearly more than the others to be taken for the cause.
    pub(super) const fn is_rare(self) -> bool {
        matches!(self, Self::SecondHarmonic | Self::Scale)
    }

    /// All that are looked for in robots with these drives.
    pub fn all(drive: Drive) -> impl Iterator<Item = Self> {
        let of_joints = Self::of_joints(drive).iter().copied();
        of_joints.chain(Self::OF_PLATFORM)
    }

    /// As it is written: `gear_ratio`, `eccentricity`, `second_harmonic`, `uneven_travel`, `backlash`, `sag`,
    /// `drift` or `scale`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::GearRatio => "gear_ratio",
            Self::Eccentricity => "eccentricity",
            Self::SecondHarmonic => "second_harmonic",
            Self::UnevenTravel => "uneven_travel",
            Self::Backlash => "backlash",
            Self::Sag => "sag",
            Self::Drift => "drift",
            Self::Scale => "scale",
        }
    }

    /// Of its size: `ratio`, `deg` or `mm`.
    pub const fn unit(self, drive: Drive) -> &'static str {
        match (self, drive) {
            (Self::GearRatio | Self::Scale, _) => "ratio",
            (Self::Eccentricity | Self::SecondHarmonic, _) | (Self::Backlash, Drive::Rotary) => {
                "deg"
            }
            (Self::UnevenTravel | Self::Sag | Self::Drift, _) | (Self::Backlash, Drive::Linear) => {
                "mm"
            }
        }
    }

    /// What a coefficient is multiplied by to be in that unit.
    pub(super) fn in_unit(self, drive: Drive, value: f64) -> f64 {
        if self.unit(drive) == "deg" {
            value.to_degrees()
        } else {
            value
        }
    }

    /// How many coefficients it has.
    pub(super) const fn columns(self) -> usize {
        match self {
            Self::GearRatio | Self::UnevenTravel | Self::Backlash | Self::Sag | Self::Scale => 1,
            Self::Eccentricity | Self::SecondHarmonic => 2,
            Self::Drift => 3,
        }
    }

    /// What its coefficients multiply in the error of a joint, and how many there are; `direction` is
    /// that of the joint's last move, `range` the lowest and the highest q of the file.
    pub(super) fn shapes(self, q: f64, direction: f64, [low, high]: [f64; 2]) -> ([f64; 2], usize) {
        match self {
            Self::GearRatio => ([q, 0.0], 1),
            Self::Eccentricity => ([q.cos(), q.sin()], 2),
            Self::SecondHarmonic => ([(2.0 * q).cos(), (2.0 * q).sin()], 2),
            Self::UnevenTravel if high > low => {
                let part = (2.0 * q - low - high) / (high - low);
                ([part * part, 0.0], 1)
            }
            Self::UnevenTravel => ([0.0, 0.0], 1),
            Self::Backlash => ([direction, 0.0], 1),
            Self::Sag | Self::Drift | Self::Scale => ([0.0, 0.0], 0),
        }
    }
}

/// An error that the model does not hold and the residuals show.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Of which kind.
    pub kind: CauseKind,
    /// Whose; `None` of one that is not an arm's.
    pub arm: Option<ArmIndex>,
    /// The robot's drives.
    pub drive: Drive,
    /// The lowest and the highest angle or travel of its joint in the file.
    pub range: [f64; 2],
    /// How large, in the [unit](CauseKind::unit): of a periodic error the amplitude, of the backlash
    /// half of it, of the sag that at the largest distance from the robot's axis, of the drift that
    /// from the first row to the last. Signed where there is one coefficient only.
    pub size: f64,
    /// One σ of the size.
    pub sigma: f64,
    /// The probability of residuals that show as much of it by chance, for this test alone and beside
    /// the other causes found.
    pub probability: f64,
    /// Of the columns that [`CauseKind`] states: radians, 1 or mm.
    pub coefficients: Vec<f64>,
    /// What explains the residuals about as well in its place: with at least a twentieth of the
    /// likelihood.
    pub alternatives: Vec<Alternative>,
}

/// Another cause that is as good as one found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alternative {
    /// Of which kind.
    pub kind: CauseKind,
    /// Whose; `None` of one that is not an arm's.
    pub arm: Option<ArmIndex>,
}

/// "an eccentricity of arm 2".
impl fmt::Display for Alternative {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self.kind {
            CauseKind::GearRatio => "a wrong gear ratio",
            CauseKind::Eccentricity => "an eccentricity",
            CauseKind::SecondHarmonic => "an error twice a turn",
            CauseKind::UnevenTravel => "an uneven travel",
            CauseKind::Backlash => "a backlash",
            CauseKind::Sag => "a sag of the platform",
            CauseKind::Drift => "a drift of the positions",
            CauseKind::Scale => "a wrong scale of the instrument or the sheet",
        })?;
        self.arm
            .map_or(Ok(()), |arm| write!(formatter, " of {arm}"))
    }
}

impl Cause {
    /// The error of the joint, radians or mm; 0 of a cause that is not a joint's.
    pub(super) fn joint_error(&self, q: f64, direction: f64) -> f64 {
        let (shapes, count) = self.kind.shapes(q, direction, self.range);
        let terms = shapes.iter().take(count).zip(&self.coefficients);
        terms.map(|(shape, coefficient)| shape * coefficient).sum()
    }

    /// A drift in the axes of a convention.
    pub(in crate::calibration) fn turn(&mut self, convention: &Convention) {
        if let (CauseKind::Drift, [x, y, z]) = (self.kind, &self.coefficients[..]) {
            let turned = convention.vector(&Vector3::new(*x, *y, *z));
            self.coefficients = turned.as_slice().to_vec();
        }
    }

    /// What there is to do about it.
    pub fn remedy(&self) -> &'static str {
        let of_transmission = |kind| {
            matches!(
                kind,
                CauseKind::GearRatio | CauseKind::Eccentricity | CauseKind::SecondHarmonic
            )
        };
        if !self.alternatives.is_empty() {
            let mut others = self.alternatives.iter();
            if of_transmission(self.kind) && others.all(|other| of_transmission(other.kind)) {
                return "state transmission_deg in [tolerance], with which the calibration finds any of these \
                        (docs/instruments.md#gears-and-encoders), or find out which it is by comparing the joint with \
                        a reference over its whole range, and mend that";
            }
            let is_scale = |kind| kind == CauseKind::Scale;
            if is_scale(self.kind) || self.alternatives.iter().any(|other| is_scale(other.kind)) {
                return "find out which of these it is: measure one known length with the same instrument or on the same \
                        sheet, and one pose with another load; then mend that";
            }
            return "find out which of these it is, by comparing the joint with a reference \
                    over its whole range, and by measuring one pose with another load, from another \
                    side and again at the end; then mend that";
        }
        match self.kind {
            CauseKind::GearRatio => {
                "correct the gear ratio or the encoder's steps per turn in the controller, or state transmission_deg \
                 in [tolerance], with which the calibration finds it (docs/instruments.md#gears-and-encoders)"
            }
            CauseKind::Eccentricity => {
                "centre the gear or the encoder, or correct the joint angle in the controller by a table, or state \
                 transmission_deg in [tolerance], with which the calibration finds it \
                 (docs/instruments.md#gears-and-encoders)"
            }
            CauseKind::SecondHarmonic => {
                "look at the encoder and the coupling, or correct the joint angle in the controller by a table, or \
                 state transmission_deg in [tolerance], with which the calibration finds it \
                 (docs/instruments.md#gears-and-encoders)"
            }
            CauseKind::UnevenTravel => {
                "straighten the tower, look at the belt or the screw, or correct the travel in the \
                 controller by a table"
            }
            CauseKind::Backlash => "remove the play, or approach every pose from the same side",
            CauseKind::Sag => {
                "measure with the load and the speed of later use, or stiffen what bends"
            }
            CauseKind::Drift => {
                "let the robot and the sensor warm up, fasten the sensor, and measure in random \
                 order"
            }
            CauseKind::Scale => {
                "measure one known length with the same instrument or on the same sheet, and correct the readings by it"
            }
        }
    }
}

/// "arm 2: the joint's error goes with one turn of the joint, with an amplitude of 0.051° ± 0.004°,
/// as an eccentric gear or encoder does".
impl fmt::Display for Cause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(arm) = self.arm {
            write!(formatter, "{arm}: ")?;
        }
        let size = significant(self.size.abs(), 2);
        let sigma = significant(self.sigma, 1);
        match self.kind {
            CauseKind::GearRatio => write!(
                formatter,
                "the joint turns {} than it reports, in proportion to the angle, by {size} ± {sigma} \
                 of it, as with a wrong gear ratio",
                if self.size > 0.0 {
                    "farther"
                } else {
                    "less far"
                }
            ),
            CauseKind::Eccentricity => write!(
                formatter,
                "the joint has an error that repeats once a turn, with an amplitude of \
                 {size}° ± {sigma}°, as with an eccentric gear or encoder"
            ),
            CauseKind::SecondHarmonic => write!(
                formatter,
                "the joint has an error that repeats twice a turn, with an amplitude of \
                 {size}° ± {sigma}°, as with a misaligned coupling or a distorted encoder disc"
            ),
            CauseKind::UnevenTravel => write!(
                formatter,
                "at the ends of its measured range the carriage is {} along its tower than in the middle, by \
                 {size} ± {sigma} mm, as with a bent tower or an uneven belt or screw",
                if self.size > 0.0 {
                    "farther"
                } else {
                    "less far"
                }
            ),
            CauseKind::Backlash => {
                let (joint, unit, of) = match self.drive {
                    Drive::Rotary => ("joint", "°", "backlash or hysteresis of the gear"),
                    Drive::Linear => ("carriage", " mm", "backlash of the belt or the screw"),
                };
                write!(
                    formatter,
                    "the {joint}'s error changes with the direction of its last move, by \
                     ±{size}{unit} ± {sigma}{unit}, as with {of}, if the rows are in \
                     the order in which they were measured"
                )
            }
            CauseKind::Sag => write!(
                formatter,
                "the platform is {} with its distance from the robot's axis, by {size} ± {sigma} mm \
                 at the largest distance, as with arms or a frame that bend under the load",
                if self.size > 0.0 { "lower" } else { "higher" }
            ),
            CauseKind::Drift => {
                write!(
                    formatter,
                    "the measured positions drift by {size} ± {sigma} mm from the first row to the \
                     last"
                )?;
                if let [x, y, z] = self.coefficients[..] {
                    write!(formatter, " (x {x:+.3}, y {y:+.3}, z {z:+.3} mm)")?;
                }
                formatter.write_str(
                    ", as with a sensor that moves or a robot that warms up, if the rows are in the \
                     order in which they were measured",
                )
            }
            CauseKind::Scale => write!(
                formatter,
                "all measured lengths are {} ± {} % {} than the robot makes them, as with a sheet printed at \
                 another size or an instrument of another scale",
                significant(100.0 * self.size.abs(), 2),
                significant(100.0 * self.sigma, 1),
                if self.size > 0.0 { "larger" } else { "smaller" }
            ),
        }?;
        if self.alternatives.is_empty() {
            return Ok(());
        }
        let alternatives: Vec<_> = self.alternatives.iter().map(ToString::to_string).collect();
        write!(
            formatter,
            "; about as likely: {}",
            alternatives.join(" or ")
        )
    }
}
