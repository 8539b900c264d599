//! The keys of a robot file, each with its place in the text.

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
    pub(super) tolerance: Option<ToleranceToml>,
    pub(super) noise: Option<Spanned<NoiseToml>>,
    pub(super) sensor_frame: Option<Spanned<SensorFrameToml>>,
    #[serde(default)]
    pub(super) planes: BTreeMap<String, Spanned<PlaneToml>>,
    #[serde(default)]
    pub(super) points: BTreeMap<String, Spanned<PointToml>>,
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(clippy::struct_field_names)] // the keys of the file
pub(super) struct NominalToml {
    pub(super) base_radius_mm: Number,
    pub(super) platform_radius_mm: Number,
    pub(super) upper_arm_mm: Number,
    pub(super) forearm_mm: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ArmToml {
    pub(super) dx_mm: Number,
    pub(super) dy_mm: Number,
    pub(super) dz_mm: Number,
    pub(super) theta_deg: Number,
    pub(super) alpha_deg: Number,
    pub(super) la_x_mm: Number,
    pub(super) la_y_mm: Number,
    pub(super) lb_mm: Number,
}

/// The keys of an arm in the order of `Parameter::ALL`.
pub(super) const ARM_KEYS: [&str; 8] = [
    "dx_mm",
    "dy_mm",
    "dz_mm",
    "theta_deg",
    "alpha_deg",
    "la_x_mm",
    "la_y_mm",
    "lb_mm",
];

impl ArmToml {
    /// In the order of `Parameter::ALL`.
    pub(super) fn numbers(&self) -> [&Number; 8] {
        [
            &self.dx_mm,
            &self.dy_mm,
            &self.dz_mm,
            &self.theta_deg,
            &self.alpha_deg,
            &self.la_x_mm,
            &self.la_y_mm,
            &self.lb_mm,
        ]
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(clippy::struct_field_names)] // the keys of the file
pub(super) struct JointsToml {
    pub(super) min_deg: Number,
    pub(super) max_deg: Number,
    pub(super) forearm_max_deg: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToleranceToml {
    pub(super) length_mm: Number,
    pub(super) angle_deg: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseToml {
    pub(super) position_mm: Option<Spanned<ByAxis>>,
    pub(super) height_mm: Option<Number>,
    pub(super) distance_mm: Option<Number>,
    pub(super) joint_deg: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaneToml {
    pub(super) z_mm: Number,
    pub(super) sigma_mm: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PointToml {
    pub(super) x_mm: Option<Number>,
    pub(super) y_mm: Option<Number>,
    pub(super) z_mm: Option<Number>,
    pub(super) sigma_mm: Option<Number>,
    pub(super) offset: Option<Spanned<String>>,
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
