//! The keys of a robot file. What they hold in common stands here; what a robot with motors and one with towers have of
//! their own, in two sets of sections behind the trait [`Kind`].

use crate::files::convention::{Convention, JointUnit, LengthUnit, Vertical};
use crate::text::joint;
use delta_cal::kinematics::{JointLimits, JointLimitsError};
use delta_cal::robot::{
    Arm, Drive, GeometryError, SymmetricLinearRobot, Transmission, TransmissionTolerance,
};
use delta_cal::{Parameter, Robot, SymmetricRobot, Tolerance};
use serde::de::{DeserializeOwned, Error, IgnoredAny, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use toml::Spanned;

/// What tells the kind of a robot before anything else is read.
#[derive(Deserialize)]
pub(super) struct Tag {
    nominal: Option<NominalTag>,
    arm: Option<Vec<toml::Table>>,
}

#[derive(Deserialize)]
struct NominalTag {
    kind: Option<KindToml>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum KindToml {
    Rotary,
    Linear,
}

impl Tag {
    /// `kind` in `[nominal]`; of arms, whether the first has a key of a tower.
    pub(super) fn drive(&self) -> Drive {
        let stated = self.nominal.as_ref().and_then(|nominal| nominal.kind);
        let arms = self.arm.as_deref().unwrap_or_default();
        let own = [Parameter::LeanX, Parameter::LeanY, Parameter::Scale].map(arm_key);
        let tower = |arm: &toml::Table| own.iter().any(|key| arm.contains_key(*key));
        match stated {
            Some(KindToml::Linear) => Drive::Linear,
            None if arms.first().is_some_and(tower) => Drive::Linear,
            Some(KindToml::Rotary) | None => Drive::Rotary,
        }
    }
}

/// A robot file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound = "")]
pub(super) struct RobotToml<K: Kind> {
    pub(super) convention: Option<Spanned<ConventionToml>>,
    pub(super) nominal: Option<Spanned<K::Nominal>>,
    pub(super) arm: Option<Vec<Spanned<K::Arm>>>,
    pub(super) joints: Spanned<K::Joints>,
    pub(super) tolerance: Option<Spanned<K::Tolerance>>,
    pub(super) noise: Option<Spanned<NoiseToml>>,
    pub(super) sensor_frame: Option<Spanned<SensorFrameToml>>,
    #[serde(default)]
    pub(super) planes: BTreeMap<String, Spanned<PlaneToml>>,
    pub(super) distances: Option<Spanned<DistancesToml>>,
    #[serde(default)]
    pub(super) points: BTreeMap<String, Spanned<PointToml>>,
    pub(super) platform: Option<PlatformToml>,
    pub(super) target: Option<TargetToml>,
    #[serde(default)]
    pub(super) datum: BTreeMap<String, DatumToml>,
    #[serde(default)]
    pub(super) robot: RobotRecordToml,
    #[serde(default)]
    pub(super) measurement: MeasurementToml,
}

/// The sections in which robots with motors and robots with towers differ. Results are in mm and radians.
pub(super) trait Kind {
    const DRIVE: Drive;
    type Nominal: DeserializeOwned;
    type Arm: DeserializeOwned;
    type Joints: DeserializeOwned;
    type Tolerance: DeserializeOwned;

    /// Azimuths are about the z axis of the convention.
    fn robot(nominal: &Self::Nominal, convention: &Convention)
    -> Result<Robot<f64>, GeometryError>;
    fn arm(arm: &Self::Arm) -> Result<Arm<f64>, GeometryError>;
    /// Of the platform, if it has one.
    fn platform_radius(nominal: &Self::Nominal) -> Option<f64>;
    /// With the largest angle of a forearm out of its arm's plane.
    fn joints(
        joints: &Self::Joints,
        convention: &Convention,
    ) -> Result<(JointLimits<f64>, Option<f64>), String>;
    fn tolerance(tolerance: &Self::Tolerance) -> Result<Tolerances, String>;
}

/// What `[tolerance]` says of the geometry, and of transmissions that are to be found.
pub(super) type Tolerances = (Tolerance<f64>, Option<TransmissionTolerance<f64>>);

/// Motors turn the arms.
pub(super) struct Rotary;
/// Carriages run along towers.
pub(super) struct Linear;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotaryNominal {
    #[serde(rename = "kind")]
    _kind: Option<IgnoredAny>,
    base_radius_mm: Number,
    platform_radius_mm: Number,
    upper_arm_mm: Positive,
    forearm_mm: Positive,
    azimuth_deg: Option<[Number; 3]>,
    zero_deg: Option<OneOrThree>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinearNominal {
    #[serde(rename = "kind")]
    _kind: IgnoredAny,
    tower_radius_mm: Positive,
    tower_deg: Option<[Number; 3]>,
    forearm_mm: Positive,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotaryArm {
    dx_mm: Number,
    dy_mm: Number,
    dz_mm: Number,
    theta_deg: Number,
    alpha_deg: Number,
    la_x_mm: Number,
    la_y_mm: Number,
    lb_mm: Number,
    #[serde(default)]
    transmission_gain: Number,
    #[serde(default)]
    transmission_cos_deg: Number,
    #[serde(default)]
    transmission_sin_deg: Number,
    #[serde(default)]
    transmission_cos2_deg: Number,
    #[serde(default)]
    transmission_sin2_deg: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinearArm {
    dx_mm: Number,
    dy_mm: Number,
    dz_mm: Number,
    lean_x_deg: Number,
    lean_y_deg: Number,
    scale: Number,
    lb_mm: Number,
}

/// The keys of a transmission's numbers in an arm's section.
pub(super) const TRANSMISSION_KEYS: [&str; 5] = [
    "transmission_gain",
    "transmission_cos_deg",
    "transmission_sin_deg",
    "transmission_cos2_deg",
    "transmission_sin2_deg",
];

/// The key of a parameter in an arm's section.
pub(super) const fn arm_key(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Dx => "dx_mm",
        Parameter::Dy => "dy_mm",
        Parameter::Dz | Parameter::Zero => "dz_mm",
        Parameter::Theta => "theta_deg",
        Parameter::Alpha => "alpha_deg",
        Parameter::LaX => "la_x_mm",
        Parameter::LaY => "la_y_mm",
        Parameter::Lb => "lb_mm",
        Parameter::LeanX => "lean_x_deg",
        Parameter::LeanY => "lean_y_deg",
        Parameter::Scale => "scale",
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotaryJoints {
    min_deg: Option<Number>,
    max_deg: Option<Number>,
    min_rad: Option<Number>,
    max_rad: Option<Number>,
    forearm_max_deg: Option<Positive>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinearJoints {
    min_mm: Number,
    max_mm: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotaryTolerance {
    length_mm: Positive,
    angle_deg: Positive,
    zero_deg: Option<Positive>,
    transmission_deg: Option<Positive>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinearTolerance {
    length_mm: Positive,
    angle_deg: Positive,
    scale: Positive,
    zero_mm: Option<Positive>,
    radius_mm: Option<Number>,
    forearm_mm: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseToml {
    pub(super) position_mm: Option<ByAxis>,
    pub(super) height_mm: Option<Positive>,
    pub(super) distance_mm: Option<Positive>,
    joint_deg: Option<Number>,
    joint_mm: Option<Number>,
}

impl NoiseToml {
    /// The joints', radians or mm.
    pub(super) fn joint(&self, drive: Drive) -> Result<f64, &'static str> {
        match (drive, self.joint_deg, self.joint_mm) {
            (Drive::Rotary, Some(own), None) => Ok(own.radians()),
            (Drive::Linear, None, Some(own)) => Ok(own.0),
            (Drive::Rotary, ..) => Err("this robot's joint noise is joint_deg"),
            (Drive::Linear, ..) => Err("this robot's joint noise is joint_mm"),
        }
    }
}

impl Kind for Rotary {
    const DRIVE: Drive = Drive::Rotary;
    type Nominal = RotaryNominal;
    type Arm = RotaryArm;
    type Joints = RotaryJoints;
    type Tolerance = RotaryTolerance;

    fn robot(
        nominal: &RotaryNominal,
        convention: &Convention,
    ) -> Result<Robot<f64>, GeometryError> {
        let robot = SymmetricRobot {
            base_radius: nominal.base_radius_mm.0,
            platform_radius: nominal.platform_radius_mm.0,
            upper_arm: nominal.upper_arm_mm.0,
            forearm: nominal.forearm_mm.0,
        }
        .robot()?;
        if nominal.azimuth_deg.is_none() && nominal.zero_deg.is_none() {
            return Ok(robot);
        }
        let usual = robot.arms().map(|arm| arm.get(Parameter::Theta));
        let azimuths = azimuths(nominal.azimuth_deg, convention)?.unwrap_or(usual);
        let zeros = nominal
            .zero_deg
            .as_ref()
            .map_or([0.0; 3], OneOrThree::values);
        let radius = nominal.base_radius_mm.0 - nominal.platform_radius_mm.0;
        let length = nominal.upper_arm_mm.0;
        let arm = |index: usize| {
            let (sine, cosine) = azimuths[index].sin_cos();
            let (up, along) = zeros[index].to_radians().sin_cos();
            Arm::new([
                radius * cosine,
                radius * sine,
                0.0,
                azimuths[index],
                0.0,
                length * along,
                length * up,
                nominal.forearm_mm.0,
            ])
        };
        Robot::new([arm(0)?, arm(1)?, arm(2)?])
    }

    fn platform_radius(nominal: &RotaryNominal) -> Option<f64> {
        Some(nominal.platform_radius_mm.0)
    }

    fn arm(arm: &RotaryArm) -> Result<Arm<f64>, GeometryError> {
        let transmission = Transmission::new([
            arm.transmission_gain.0,
            arm.transmission_cos_deg.radians(),
            arm.transmission_sin_deg.radians(),
            arm.transmission_cos2_deg.radians(),
            arm.transmission_sin2_deg.radians(),
        ])?;
        Arm::new([
            arm.dx_mm.0,
            arm.dy_mm.0,
            arm.dz_mm.0,
            arm.theta_deg.radians(),
            arm.alpha_deg.radians(),
            arm.la_x_mm.0,
            arm.la_y_mm.0,
            arm.lb_mm.0,
        ])?
        .with_transmission(transmission)
    }

    fn joints(
        joints: &RotaryJoints,
        convention: &Convention,
    ) -> Result<(JointLimits<f64>, Option<f64>), String> {
        let (low, high, radians) = match (
            joints.min_deg,
            joints.max_deg,
            joints.min_rad,
            joints.max_rad,
        ) {
            (Some(low), Some(high), None, None) => (low, high, [low, high].map(Number::radians)),
            (None, None, Some(low), Some(high)) => (low, high, [low.0, high.0]),
            _ => {
                return Err("the limits are min_deg and max_deg, or min_rad and max_rad".to_owned());
            }
        };
        let (least, most) = convention.limits(radians[0], radians[1]);
        let limits = JointLimits::new(least, most);
        let limits = limits.map_err(|error| limits_fault(Drive::Rotary, low, high, error))?;
        match joints.forearm_max_deg {
            Some(Number(degrees)) if degrees > 90.0 => {
                Err(format!("forearm_max_deg = {degrees} is above 90 degrees"))
            }
            forearm => Ok((limits, forearm.map(Number::radians))),
        }
    }

    fn tolerance(tolerance: &RotaryTolerance) -> Result<Tolerances, String> {
        let geometry = Tolerance::new(tolerance.length_mm.0, tolerance.angle_deg.radians());
        let geometry = match tolerance.zero_deg {
            Some(zero) => geometry.and_then(|own| own.with_joint_zero(zero.radians())),
            None => geometry,
        };
        let geometry = geometry.map_err(|error| error.to_string())?;
        let Some(degrees) = tolerance.transmission_deg else {
            return Ok((geometry, None));
        };
        match TransmissionTolerance::new(degrees.radians()) {
            Ok(transmission) => Ok((geometry, Some(transmission))),
            Err(_) => Err(format!(
                "transmission_deg = {} is not below 5.7 degrees",
                degrees.0
            )),
        }
    }
}

impl Kind for Linear {
    const DRIVE: Drive = Drive::Linear;
    type Nominal = LinearNominal;
    type Arm = LinearArm;
    type Joints = LinearJoints;
    type Tolerance = LinearTolerance;

    fn robot(
        nominal: &LinearNominal,
        convention: &Convention,
    ) -> Result<Robot<f64>, GeometryError> {
        let geometry = SymmetricLinearRobot {
            tower_radius: nominal.tower_radius_mm.0,
            forearm: nominal.forearm_mm.0,
        };
        match azimuths(nominal.tower_deg, convention)? {
            None => geometry.robot(),
            Some(azimuths) => geometry.robot_at(azimuths),
        }
    }

    fn platform_radius(_: &LinearNominal) -> Option<f64> {
        None
    }

    fn arm(arm: &LinearArm) -> Result<Arm<f64>, GeometryError> {
        Arm::linear([
            arm.dx_mm.0,
            arm.dy_mm.0,
            arm.dz_mm.0,
            arm.lean_x_deg.radians(),
            arm.lean_y_deg.radians(),
            arm.scale.0,
            arm.lb_mm.0,
        ])
    }

    fn joints(
        joints: &LinearJoints,
        _: &Convention,
    ) -> Result<(JointLimits<f64>, Option<f64>), String> {
        let (low, high) = (joints.min_mm, joints.max_mm);
        let limits = JointLimits::travel(low.0, high.0);
        let limits = limits.map_err(|error| limits_fault(Drive::Linear, low, high, error))?;
        Ok((limits, None))
    }

    fn tolerance(tolerance: &LinearTolerance) -> Result<Tolerances, String> {
        let zero = tolerance.zero_mm.unwrap_or(tolerance.length_mm).0;
        let radius = tolerance.radius_mm.unwrap_or_default().0;
        let forearm = tolerance.forearm_mm.unwrap_or_default().0;
        let geometry = Tolerance::new(tolerance.length_mm.0, tolerance.angle_deg.radians())
            .and_then(|own| {
                own.with_linear(zero, tolerance.scale.0)?
                    .with_radius(radius)?
                    .with_forearm(forearm)
            })
            .map_err(|error| error.to_string())?;
        Ok((geometry, None))
    }
}

/// Where the arms or towers stand, radians about the z axis inside.
fn azimuths(
    stated: Option<[Number; 3]>,
    convention: &Convention,
) -> Result<Option<[f64; 3]>, GeometryError> {
    let Some(stated) = stated else {
        return Ok(None);
    };
    if stated.iter().any(|azimuth| azimuth.0.abs() > 720.0) {
        return Err(GeometryError::AzimuthTooLarge);
    }
    let sense = match convention.z_axis {
        Vertical::Up => 1.0,
        Vertical::Down => -1.0,
    };
    Ok(Some(stated.map(|azimuth| sense * azimuth.radians())))
}

fn limits_fault(drive: Drive, low: Number, high: Number, error: JointLimitsError) -> String {
    match error {
        JointLimitsError::Empty => format!(
            "the largest {}, {}, is not above the smallest, {}",
            joint::name(drive),
            high.0,
            low.0
        ),
        error => error.to_string(),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ConventionToml {
    joint_positive: Option<Vertical>,
    z_axis: Option<Vertical>,
    joint_unit: Option<JointUnitToml>,
    counts_per_deg: Option<OneOrThree>,
    length_unit: Option<LengthUnit>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
enum JointUnitToml {
    Deg,
    Rad,
    Counts,
}

impl ConventionToml {
    pub(super) fn of(&self, drive: Drive) -> Result<Convention, &'static str> {
        let of_motors = self.joint_positive.is_some()
            || self.joint_unit.is_some()
            || self.counts_per_deg.is_some();
        if drive == Drive::Linear && of_motors {
            return Err(
                "joint_positive, joint_unit and counts_per_deg are for motors that turn arms",
            );
        }
        let counts = self.counts_per_deg.as_ref().map(OneOrThree::values);
        let joint_unit = match (self.joint_unit, counts) {
            (Some(JointUnitToml::Counts) | None, Some(counts)) => {
                if counts.contains(&0.0) {
                    return Err("counts_per_deg must not be 0");
                }
                Some(JointUnit::Counts(counts))
            }
            (Some(JointUnitToml::Counts), None) => {
                return Err("joint_unit = \"counts\" needs counts_per_deg, one number or three");
            }
            (Some(_), Some(_)) => return Err("counts_per_deg needs joint_unit = \"counts\""),
            (Some(JointUnitToml::Deg), None) => Some(JointUnit::Degree),
            (Some(JointUnitToml::Rad), None) => Some(JointUnit::Radian),
            (None, None) => None,
        };
        let usual = Convention::usual(drive);
        Ok(Convention {
            drive,
            joint_positive: self.joint_positive.unwrap_or(usual.joint_positive),
            z_axis: self.z_axis.unwrap_or(usual.z_axis),
            joint_unit,
            length_unit: self.length_unit,
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaneToml {
    pub(super) z_mm: Number,
    pub(super) sigma_mm: Positive,
    pub(super) tilt_deg: Option<Positive>,
    #[serde(default)]
    pub(super) blocks_mm: Vec<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DistancesToml {
    pub(super) length_mm: [Positive; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PointToml {
    pub(super) x_mm: Option<Number>,
    pub(super) y_mm: Option<Number>,
    pub(super) z_mm: Option<Number>,
    pub(super) sigma_mm: Option<Positive>,
    pub(super) offset: Option<OffsetToml>,
    pub(super) length_mm: Option<[Positive; 2]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum OffsetToml {
    Unknown,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(clippy::struct_field_names)] // the keys of the file
pub(super) struct TargetToml {
    pub(super) x_mm: Number,
    pub(super) y_mm: Number,
    pub(super) z_mm: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlatformToml {
    pub(super) radius_mm: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(clippy::struct_field_names)] // the keys of the file
pub(super) struct DatumToml {
    pub(super) x_mm: Number,
    pub(super) y_mm: Number,
    pub(super) z_mm: Number,
    pub(super) sensor_mm: [Number; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorFrameToml {
    pub(super) rotation: [[Number; 3]; 3],
    pub(super) translation_mm: [Number; 3],
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotRecordToml {
    pub(super) name: Option<Words>,
    pub(super) serial: Option<Words>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct MeasurementToml {
    pub(super) operator: Option<Words>,
    pub(super) instrument: Option<Words>,
    pub(super) date: Option<Words>,
}

/// A finite number, or one above 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Number<const ABOVE_ZERO: bool = false>(pub(super) f64);
pub(super) type Positive = Number<true>;

impl<const ABOVE_ZERO: bool> Number<ABOVE_ZERO> {
    /// Of a number of degrees.
    pub(super) fn radians(self) -> f64 {
        self.0.to_radians()
    }
}

impl<'de, const ABOVE_ZERO: bool> Deserialize<'de> for Number<ABOVE_ZERO> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read<const ABOVE_ZERO: bool>;
        impl<const ABOVE_ZERO: bool> Visitor<'_> for Read<ABOVE_ZERO> {
            type Value = f64;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(if ABOVE_ZERO {
                    "a number above 0"
                } else {
                    "a number"
                })
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<f64, E> {
                if value.is_finite() && (value > 0.0 || !ABOVE_ZERO) {
                    Ok(value)
                } else {
                    Err(E::invalid_value(
                        Unexpected::Other(&value.to_string()),
                        &self,
                    ))
                }
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<f64, E> {
                self.visit_f64(value as f64)
            }
        }
        let value = deserializer.deserialize_any(Read::<ABOVE_ZERO>)?;
        Ok(Self(value))
    }
}

/// One number, or one for each axis.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number above 0, or three of them in brackets: of x, y and z"
)]
pub(super) enum ByAxis {
    One(Positive),
    Three([Positive; 3]),
}

impl ByAxis {
    pub(super) fn values(&self) -> [f64; 3] {
        match self {
            Self::One(number) => [number.0; 3],
            Self::Three(numbers) => numbers.map(|number| number.0),
        }
    }
}

/// One number for all arms, or one for each.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or three of them in brackets: one an arm"
)]
pub(super) enum OneOrThree {
    One(Number),
    Three([Number; 3]),
}

impl OneOrThree {
    fn values(&self) -> [f64; 3] {
        match self {
            Self::One(number) => [number.0; 3],
            Self::Three(numbers) => numbers.map(|number| number.0),
        }
    }
}

/// One short line; a number or a date without quotation marks is read as well.
#[derive(Deserialize)]
#[serde(try_from = "toml::Value")]
pub(super) struct Words(pub(super) String);

/// Letters that a text may have, so that a certificate stays one page.
const LONGEST: usize = 60;

impl TryFrom<toml::Value> for Words {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, String> {
        let text = match value {
            toml::Value::String(text) => text.trim().to_owned(),
            toml::Value::Integer(number) => number.to_string(),
            toml::Value::Datetime(date) => date.to_string(),
            _ => return Err("expected text in quotation marks".to_owned()),
        };
        if text.is_empty() || text.contains(char::is_control) {
            Err("expected one line of text".to_owned())
        } else if text.chars().count() > LONGEST {
            Err(format!("the text has more than {LONGEST} letters"))
        } else {
            Ok(Self(text))
        }
    }
}
