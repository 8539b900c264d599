//! Errors that the model cannot represent: their effect on positions, and their description.

use crate::files::convention::Convention;
use crate::text::significant;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Robot};
use nalgebra::{DVector, Matrix3, Vector3};
use serde::Serialize;
use std::ops::Range;

/// Kind of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CauseKind {
    /// The joint's error is proportional to its reading: δq = g q.
    GearRatio,
    /// Error that repeats once a turn: δq = a cos q + b sin q.
    Eccentricity,
    /// Error that repeats twice a turn: δq = a cos 2q + b sin 2q.
    SecondHarmonic,
    /// A carriage is further along its tower at the ends of its range than in the middle: δs = c u², u being −1 and 1
    /// at the lowest and the highest s of the file.
    UnevenTravel,
    /// Depends on the direction of the joint's last move: δq = ±h.
    Backlash,
    /// The platform sags with its distance from the robot's axis: δz = −s (r/r_max)².
    Sag,
    /// The positions move in proportion to the row number.
    Drift,
    /// Coordinates and distances are proportionally larger than the robot's own.
    Scale,
}

impl CauseKind {
    /// The kinds that affect a single joint.
    const fn of_joints(drive: Drive) -> &'static [Self] {
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

    /// The kinds that affect no single joint.
    const OF_PLATFORM: [Self; 3] = [Self::Sag, Self::Drift, Self::Scale];

    /// Whether it is rare, so that it must explain clearly more than the others to be accepted.
    pub(crate) const fn is_rare(self) -> bool {
        matches!(self, Self::SecondHarmonic | Self::Scale)
    }

    /// Whether it can be calibrated as a transmission.
    pub(crate) const fn is_of_transmission(self) -> bool {
        matches!(
            self,
            Self::GearRatio | Self::Eccentricity | Self::SecondHarmonic
        )
    }

    /// All kinds tested for robots with these drives.
    pub fn all(drive: Drive) -> impl Iterator<Item = Self> {
        let of_joints = Self::of_joints(drive).iter().copied();
        of_joints.chain(Self::OF_PLATFORM)
    }

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

    /// Unit of its size: `ratio`, `deg` or `mm`.
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

    /// Number of coefficients.
    const fn columns(self) -> usize {
        match self {
            Self::GearRatio | Self::UnevenTravel | Self::Backlash | Self::Sag | Self::Scale => 1,
            Self::Eccentricity | Self::SecondHarmonic => 2,
            Self::Drift => 3,
        }
    }
}

/// A pose of the calibrated robot.
#[derive(Clone, Copy)]
pub(crate) struct At {
    pub(crate) joints: [f64; 3],
    pub(super) position: Vector3<f64>,
    pub(crate) by_joints: Matrix3<f64>,
}

impl At {
    pub(super) fn new(robot: &Robot<f64>, joints: &[f64; 3]) -> Option<Self> {
        let position = robot.forward(joints).ok()?;
        let by_joints = robot.platform_jacobian(&position, joints).ok()?.by_joints;
        Some(Self {
            joints: *joints,
            position,
            by_joints,
        })
    }
}

/// A row's place in the file as a whole.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// −1 or 1 for each joint: the direction of its last move; 0 before its first move.
    pub(super) directions: [f64; 3],
    /// From −½ in the first row to ½ in the last.
    pub(super) part: f64,
    /// Squared distance from the robot's axis, 1 at the largest in the file.
    pub(super) radius_squared: f64,
    /// 1 for a row whose readings have the instrument's scale, 0 for a touch of a plane.
    pub(super) scaled: f64,
}

/// A hypothesis: a cause and its range of columns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) kind: CauseKind,
    /// `None` for a cause that does not belong to an arm.
    pub(super) arm: Option<ArmIndex>,
    columns: Range<usize>,
}

impl Hypothesis {
    /// All hypotheses, in the order of their columns.
    pub(crate) fn all(drive: Drive) -> Vec<Self> {
        let of_arms = CauseKind::of_joints(drive)
            .iter()
            .flat_map(|kind| ArmIndex::ALL.map(|arm| (*kind, Some(arm))));
        let of_platform = CauseKind::OF_PLATFORM.map(|kind| (kind, None));
        let mut next = 0;
        of_arms
            .chain(of_platform)
            .map(|(kind, arm)| {
                let columns = next..next + kind.columns();
                next = columns.end;
                Self { kind, arm, columns }
            })
            .collect()
    }

    pub(super) fn columns(&self) -> Vec<usize> {
        self.columns.clone().collect()
    }

    /// Number of columns.
    pub(crate) fn number(&self) -> usize {
        self.columns.len()
    }

    /// Displacement of a position per unit of each column: mm per radian, 1, or mm. `ranges` are the lowest and highest
    /// angle or travel of each joint in the file.
    pub(super) fn moves(
        &self,
        at: &At,
        ranges: &[(f64, f64); 3],
        place: &Place,
    ) -> Vec<Vector3<f64>> {
        let Some(arm) = self.arm.map(ArmIndex::index) else {
            return match self.kind {
                CauseKind::Sag => vec![Vector3::new(0.0, 0.0, -place.radius_squared)],
                CauseKind::Drift => [0, 1, 2].map(|axis| Vector3::ith(axis, place.part)).into(),
                _ => vec![at.position * place.scaled],
            };
        };
        let column = at.by_joints.column(arm);
        let turns = self.turns(at.joints[arm], ranges[arm], place.directions[arm]);
        turns.into_iter().map(|own| column * own).collect()
    }

    /// Error of the joint of an arm per unit of each column.
    pub(super) fn turns(&self, q: f64, (low, high): (f64, f64), direction: f64) -> Vec<f64> {
        match self.kind {
            CauseKind::GearRatio => vec![q],
            CauseKind::Eccentricity => vec![q.cos(), q.sin()],
            CauseKind::SecondHarmonic => vec![(2.0 * q).cos(), (2.0 * q).sin()],
            CauseKind::UnevenTravel if high > low => {
                let part = (2.0 * q - low - high) / (high - low);
                vec![part * part]
            }
            CauseKind::Backlash => vec![direction],
            _ => vec![0.0],
        }
    }

    /// Its size in the [unit](CauseKind::unit) with its σ, and in words, from the coefficients of its columns.
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
    pub(super) fn named(&self) -> String {
        let [_, noun, _] = self.kind.words();
        match self.arm {
            Some(arm) => format!("{noun} of {arm}"),
            None => noun.to_owned(),
        }
    }
}

/// An error outside the model that the residuals reveal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// Its kind.
    pub kind: CauseKind,
    /// 1, 2 or 3; `null` for a cause that does not belong to an arm.
    pub arm: Option<usize>,
    /// Its size: the amplitude of a periodic error, half of a backlash, the sag at the largest distance from the
    /// robot's axis, the drift from the first row to the last. Signed if there is only one coefficient.
    pub size: f64,
    /// `ratio`, `deg` or `mm`.
    pub unit: &'static str,
    /// One σ of the size.
    pub sigma: f64,
    /// The probability that chance shows as much in this test alone, given the other causes found.
    pub p: f64,
    /// Alternatives that explain the residuals about as well: with at least a twentieth of the likelihood.
    pub alternatives: Vec<String>,
    /// The cause in one sentence.
    pub text: String,
    /// The remedy.
    pub remedy: &'static str,
    #[serde(skip)]
    pub(super) hypothesis: Hypothesis,
    /// Coefficients of its columns: per radian, 1 or mm.
    #[serde(skip)]
    pub(super) coefficients: Vec<f64>,
}

/// A cause in words, with its size and σ in the [unit](CauseKind::unit): "arm 2: the joint has an error that repeats
/// once a turn, with an amplitude of 0.051° ± 0.004°, as with an eccentric gear or encoder". `drifted`: the drift along
/// the axes of the file's convention.
fn words(
    hypothesis: &Hypothesis,
    drive: Drive,
    (signed, sigma): (f64, f64),
    drifted: &Vector3<f64>,
) -> String {
    let (size, of_sigma) = (significant(signed.abs(), 2), significant(sigma, 1));
    let farther = if signed > 0.0 { "farther" } else { "less far" };
    let what = match hypothesis.kind {
        CauseKind::GearRatio => format!(
            "the joint turns {farther} than it reports, in proportion to the angle, by {size} ± {of_sigma} \
             of it: a wrong gear ratio"
        ),
        CauseKind::Eccentricity => format!(
            "the joint has an error that repeats once a turn, with an amplitude of \
             {size}° ± {of_sigma}°; an eccentric gear or encoder"
        ),
        CauseKind::SecondHarmonic => format!(
            "the joint has an error that repeats twice a turn, with an amplitude of \
             {size}° ± {of_sigma}°; a misaligned coupling or a distorted encoder disc"
        ),
        CauseKind::UnevenTravel => format!(
            "at the ends of its measured range the carriage is {farther} along its tower than in the middle, by \
             {size} ± {of_sigma} mm; a bent tower or an uneven belt or screw"
        ),
        CauseKind::Backlash => {
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
        CauseKind::Sag => format!(
            "the platform is {} with its distance from the robot's axis, by {size} ± {of_sigma} mm \
             at the largest distance; arms or a frame that bend under the load",
            if signed > 0.0 { "lower" } else { "higher" }
        ),
        CauseKind::Drift => format!(
            "the measured positions drift by {size} ± {of_sigma} mm from the first row to the \
             last (x {:+.3}, y {:+.3}, z {:+.3} mm); a sensor that moves or a robot that warms up, if the rows are in \
             measured order",
            drifted.x, drifted.y, drifted.z
        ),
        CauseKind::Scale => format!(
            "all measured lengths are {} ± {} % {} than the robot makes them; a sheet printed at \
             another size or an instrument of another scale",
            significant(100.0 * signed.abs(), 2),
            significant(100.0 * sigma, 1),
            if signed > 0.0 { "larger" } else { "smaller" }
        ),
    };
    match hypothesis.arm {
        Some(arm) => format!("{arm}: {what}"),
        None => what,
    }
}
