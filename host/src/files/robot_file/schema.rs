//! The keys of a robot file, each with its place in the text.

use serde::Deserialize;
use toml::Spanned;

pub(super) type Number = Spanned<f64>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotToml {
    pub(super) nominal: Option<Spanned<NominalToml>>,
    pub(super) arm: Option<Vec<Spanned<ArmToml>>>,
    pub(super) joints: Spanned<JointsToml>,
    pub(super) tolerance: Option<ToleranceToml>,
    pub(super) noise: Option<NoiseToml>,
    pub(super) sensor_frame: Option<Spanned<SensorFrameToml>>,
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
    pub(super) position_mm: Number,
    pub(super) joint_deg: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorFrameToml {
    pub(super) rotation: [[Number; 3]; 3],
    pub(super) translation_mm: [Number; 3],
}
