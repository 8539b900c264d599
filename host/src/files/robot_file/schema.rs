//! The keys of a robot file, each with its place in the text.

use delta_cal::Parameter;
use delta_cal::robot::Drive;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use toml::Spanned;

pub(super) type Number = Spanned<f64>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotToml {
    pub(super) nominal: Option<Spanned<NominalToml>>,
    pub(super) arm: Option<Vec<Spanned<ArmToml>>>,
    pub(super) joints: Spanned<JointsToml>,
    pub(super) tolerance: Option<Spanned<ToleranceToml>>,
    pub(super) noise: Option<Spanned<NoiseToml>>,
    pub(super) sensor_frame: Option<Spanned<SensorFrameToml>>,
    #[serde(default)]
    pub(super) planes: BTreeMap<String, Spanned<PlaneToml>>,
    #[serde(default)]
    pub(super) points: BTreeMap<String, Spanned<PointToml>>,
    pub(super) distances: Option<DistancesToml>,
    pub(super) target: Option<TargetToml>,
    #[serde(default)]
    pub(super) robot: RobotRecordToml,
    #[serde(default)]
    pub(super) measurement: MeasurementToml,
}

/// Text; a number or a date without quotation marks is read as well.
pub(super) type Words = Option<Spanned<toml::Value>>;

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotRecordToml {
    pub(super) name: Words,
    pub(super) serial: Words,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct MeasurementToml {
    pub(super) operator: Words,
    pub(super) instrument: Words,
    pub(super) date: Words,
}

/// Of either kind; what a kind needs is looked for when it is known.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NominalToml {
    pub(super) kind: Option<Spanned<String>>,
    pub(super) base_radius_mm: Option<Number>,
    pub(super) platform_radius_mm: Option<Number>,
    pub(super) upper_arm_mm: Option<Number>,
    pub(super) tower_radius_mm: Option<Number>,
    pub(super) tower_deg: Option<Spanned<[f64; 3]>>,
    pub(super) forearm_mm: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ArmToml {
    dx_mm: Option<Number>,
    dy_mm: Option<Number>,
    dz_mm: Option<Number>,
    theta_deg: Option<Number>,
    alpha_deg: Option<Number>,
    la_x_mm: Option<Number>,
    la_y_mm: Option<Number>,
    lean_x_deg: Option<Number>,
    lean_y_deg: Option<Number>,
    scale: Option<Number>,
    lb_mm: Option<Number>,
    transmission_gain: Option<Number>,
    transmission_cos_deg: Option<Number>,
    transmission_sin_deg: Option<Number>,
    transmission_cos2_deg: Option<Number>,
    transmission_sin2_deg: Option<Number>,
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

impl ArmToml {
    pub(super) const fn number(&self, parameter: Parameter) -> Option<&Number> {
        match parameter {
            Parameter::Dx => self.dx_mm.as_ref(),
            Parameter::Dy => self.dy_mm.as_ref(),
            Parameter::Dz | Parameter::Zero => self.dz_mm.as_ref(),
            Parameter::Theta => self.theta_deg.as_ref(),
            Parameter::Alpha => self.alpha_deg.as_ref(),
            Parameter::LaX => self.la_x_mm.as_ref(),
            Parameter::LaY => self.la_y_mm.as_ref(),
            Parameter::Lb => self.lb_mm.as_ref(),
            Parameter::LeanX => self.lean_x_deg.as_ref(),
            Parameter::LeanY => self.lean_y_deg.as_ref(),
            Parameter::Scale => self.scale.as_ref(),
        }
    }

    /// The numbers of its transmission that are stated, in the order of their keys.
    pub(super) const fn transmission(&self) -> [Option<&Number>; 5] {
        [
            self.transmission_gain.as_ref(),
            self.transmission_cos_deg.as_ref(),
            self.transmission_sin_deg.as_ref(),
            self.transmission_cos2_deg.as_ref(),
            self.transmission_sin2_deg.as_ref(),
        ]
    }

    /// Whether it has a key that an arm with this drive has not.
    pub(super) fn foreign_to(&self, drive: Drive) -> Option<(Parameter, &Number)> {
        let other = match drive {
            Drive::Rotary => Drive::Linear,
            Drive::Linear => Drive::Rotary,
        };
        let own = drive.parameters();
        let foreign =
            |parameter: &&Parameter| !own.iter().any(|own| arm_key(*own) == arm_key(**parameter));
        let mut others = other.parameters().iter().filter(foreign);
        others.find_map(|parameter| Some((*parameter, self.number(*parameter)?)))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointsToml {
    pub(super) min_deg: Option<Number>,
    pub(super) max_deg: Option<Number>,
    pub(super) min_mm: Option<Number>,
    pub(super) max_mm: Option<Number>,
    pub(super) forearm_max_deg: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToleranceToml {
    pub(super) length_mm: Number,
    pub(super) angle_deg: Number,
    pub(super) zero_mm: Option<Number>,
    pub(super) radius_mm: Option<Number>,
    pub(super) scale: Option<Number>,
    pub(super) transmission_deg: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseToml {
    pub(super) position_mm: Option<Spanned<ByAxis>>,
    pub(super) height_mm: Option<Number>,
    pub(super) distance_mm: Option<Number>,
    pub(super) joint_deg: Option<Number>,
    pub(super) joint_mm: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaneToml {
    pub(super) z_mm: Number,
    pub(super) sigma_mm: Number,
    pub(super) tilt_deg: Option<Number>,
    pub(super) blocks_mm: Option<Spanned<Vec<f64>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DistancesToml {
    pub(super) length_mm: Spanned<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PointToml {
    pub(super) x_mm: Option<Number>,
    pub(super) y_mm: Option<Number>,
    pub(super) z_mm: Option<Number>,
    pub(super) sigma_mm: Option<Number>,
    pub(super) offset: Option<Spanned<String>>,
    pub(super) length_mm: Option<Spanned<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(clippy::struct_field_names)] // the keys of the file
pub(super) struct TargetToml {
    pub(super) x_mm: Number,
    pub(super) y_mm: Number,
    pub(super) z_mm: Number,
}

/// One number, or one for each axis.
pub(super) struct ByAxis(pub(super) [f64; 3]);

impl<'de> Deserialize<'de> for ByAxis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ByAxisVisitor).map(Self)
    }
}

struct ByAxisVisitor;

impl<'de> Visitor<'de> for ByAxisVisitor {
    type Value = [f64; 3];

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, or three numbers in brackets: those of x, y and z")
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<[f64; 3], E> {
        Ok([value; 3])
    }

    #[allow(clippy::cast_precision_loss)] // a measurement's noise
    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<[f64; 3], E> {
        Ok([value as f64; 3])
    }

    fn visit_seq<S: SeqAccess<'de>>(self, mut sequence: S) -> Result<[f64; 3], S::Error> {
        let mut values = Vec::new();
        while let Some(value) = sequence.next_element()? {
            values.push(value);
        }
        let count = values.len();
        <[f64; 3]>::try_from(values).map_err(|_| S::Error::invalid_length(count, &self))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorFrameToml {
    pub(super) rotation: [[Number; 3]; 3],
    pub(super) translation_mm: [Number; 3],
}
