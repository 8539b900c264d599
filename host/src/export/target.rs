//! The controllers to export for: what each holds of a robot and the lines that it reads, as `targets.toml` states them.

use super::Settings;
use super::error::ExportError;
use super::geometry::{Geometry, Holds, Shape, to_decimals};
use crate::files::convention::Vertical;
use crate::files::robot_file::RobotFile;
use crate::import::USUAL_TOWERS;
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use serde::de::Error;
use serde::de::value::Error as Malformed;
use serde::{Deserialize, Deserializer, Serialize};
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// The platform radius if none is stated, mm.
const USUAL_PLATFORM: f64 = 25.0;
/// The side of the equilateral triangle around a circle of radius 1.
const TRIANGLE: f64 = 2.0 * 1.732_050_807_568_877_2;
/// If upper arms differ by more than this, mm, RepRapFirmware's forward and inverse kinematics differ.
const EQUAL: f64 = 0.001;

/// A controller to export for.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// The name on the command line.
    #[serde(rename(serialize = "target"))]
    pub name: String,
    /// The name in reports.
    #[serde(skip_serializing)]
    pub title: String,
    /// The drives that it supports; `None` for all.
    #[serde(default, deserialize_with = "drive", skip_serializing)]
    pub drive: Option<Drive>,
    /// What it receives.
    #[serde(default, skip_serializing)]
    pub content: Content,
    /// The parameters that it holds, if these are fitted.
    #[serde(default, skip_serializing)]
    pub holds: Holds,
    #[serde(default, skip_serializing)]
    lines: Template,
    #[serde(default = "four", skip_serializing)]
    decimals: usize,
    /// Whether the lines depend on where the end stops are.
    #[serde(default, skip_serializing)]
    end_stops: bool,
    #[serde(default, skip_serializing)]
    warnings: Vec<Warning>,
    /// How to put the lines in place of a printer's.
    #[serde(default, skip_serializing)]
    pub paste: String,
    /// The start of a comment in its configuration.
    #[serde(skip_serializing)]
    pub comment: String,
    /// Its conventions: signs, zero angles, order of arms.
    pub conventions: Vec<String>,
    /// The source of the conventions.
    pub source: String,
    /// The alternative if it keeps too little of the calibration.
    #[serde(skip_serializing)]
    pub alternative: String,
}

/// What a target receives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Content {
    /// Fitted parameters of its own kinematics.
    #[default]
    Fitted,
    /// All 24 parameters.
    Everything,
    /// Corrections of the positions commanded to a controller with the nominal robot.
    Corrections,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Warning {
    when: Option<Condition>,
    /// For each longer parameter; # is its name.
    longer_than_mm: Option<f64>,
    text: Template,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Condition {
    AxesNotAboveZero,
    UpperArmsDiffer,
    BeyondQuarterTurn,
    WithTransmissions,
}

/// Text with values in it.
#[derive(Debug, Default, Deserialize)]
#[serde(try_from = "String")]
struct Template(Vec<Piece>);

#[derive(Debug)]
enum Piece {
    Text(String),
    /// A parameter, or a value that is none if the name is empty; of the arm or tower that this motor drives.
    Value {
        name: String,
        value: Value,
        motor: usize,
    },
}

/// How a value follows from what was fitted, for a motor.
#[derive(Debug, Clone, Copy)]
enum Value {
    /// Millimetres.
    Length(fn(&Fitted<'_>, usize) -> f64),
    /// The same, if the controller can state it.
    Possible(fn(&Fitted<'_>, usize) -> Result<f64, ExportError>),
    Degrees(fn(&Fitted<'_>, usize) -> f64),
    Text(fn(&Fitted<'_>, usize) -> String),
}

/// The quantities of `targets.toml`.
fn quantity(name: &str) -> Option<Value> {
    use Value::{Degrees, Length, Possible, Text};
    Some(match name {
        // The number of the arm.
        "arm" => Text(|own, k| (own.geometry.motors[k] + 1).to_string()),
        // From 0° to 360°, and from 210°, 330° or 90°.
        "azimuth" => Degrees(|own, k| own.arm(k).azimuth.to_degrees().rem_euclid(360.0)),
        "correction" => Degrees(|own, k| own.arm(k).azimuth_beyond(USUAL_TOWERS[k]).to_degrees()),
        // Of the motor axis or tower minus that of the platform.
        "radius" => Length(|own, k| own.arm(k).radius),
        "shoulder_radius" => Possible(|own, k| shoulder_radius(own.arm(k))),
        // Radii of base and platform, and the sides of the triangles around these circles.
        "base" => Length(|own, k| own.arm(k).radius + own.platform()),
        "base_triangle" => Length(|own, k| TRIANGLE * (own.arm(k).radius + own.platform())),
        "platform" => Length(|own, _| own.platform()),
        "platform_triangle" => Length(|own, _| TRIANGLE * own.platform()),
        "flange_x" => Length(|own, _| own.flange().x),
        "flange_y" => Length(|own, _| own.flange().y),
        "flange_z" => Length(|own, _| own.flange().z),
        "nothing" => Length(|_, _| 0.0),
        // Of the motor axis, and of the platform with the upper arms level.
        "height" => Length(|own, k| own.arm(k).height),
        "height_with_arms_level" => Length(|own, k| height_with_arms_level(own.arm(k))),
        "upper" => Length(|own, k| own.arm(k).upper),
        // The forearm or rod.
        "lower" => Length(|own, k| own.arm(k).lower),
        "mean_rod" => Length(|own, _| own.mean_rod()),
        "above_mean_rod" => Length(|own, k| own.arm(k).lower - own.mean_rod()),
        // The joint angle with the upper arm level, reversed; the same as the joints count.
        "minus_zero" => Degrees(|own, k| -own.arm(k).zero.to_degrees()),
        "zero_as_counted" => Degrees(|own, k| {
            let zero = own.arm(k).zero.to_degrees();
            if own.counts_up() { -zero } else { zero }
        }),
        "count_direction" => Text(|own, _| {
            let up = own.counts_up();
            if up { "Inverse" } else { "Standard" }.to_owned()
        }),
        // The joint angle at the end stop, counted from where the upper arm is level.
        "home_offset" => Degrees(|own, k| (own.home(k) - own.arm(k).zero).to_degrees()),
        // The height of the nozzle at x = y = 0 with the arm at its end stop.
        "position_endstop" => Possible(|own, k| {
            let (arm, home) = (own.arm(k), own.home(k));
            height_on_the_axis(arm, arm.zero - home).ok_or_else(|| ExportError::Home {
                arm: ArmIndex::ALL[k],
                degrees: home.to_degrees(),
            })
        }),
        // Above level: the limits, and each end stop from the highest.
        "lowest_angle" => {
            Degrees(|own, _| f64::min(-own.robot.limits.maximum(), own.highest()).to_degrees())
        }
        "highest_angle" => Degrees(|own, _| own.highest().to_degrees()),
        "angle_trim" => {
            Degrees(|own, k| (own.arm(k).zero - own.home(k) - own.highest()).to_degrees())
        }
        // The height of the nozzle at x = y = 0 with the carriage at its end stop.
        "tower_endstop" => Length(|own, k| own.endstops()[k]),
        "mean_endstop" => Length(|own, _| own.mean_endstop()),
        "above_mean_endstop" => Length(|own, k| own.endstops()[k] - own.mean_endstop()),
        // No carriage moves up from its end stop.
        "lowest_endstop" => Length(|own, _| own.lowest_endstop()),
        "below_endstop" => Length(|own, k| own.lowest_endstop() - own.endstops()[k]),
        // The largest distance of a wanted position from the z axis.
        "reach" => Text(|own, _| format!("{:.1}", own.reach.ceil())),
        // The robot's own parameters, their number, and the joints' limits.
        "dx" => Length(|own, k| own.parameters()[k][0]),
        "dy" => Length(|own, k| own.parameters()[k][1]),
        "dz" => Length(|own, k| own.parameters()[k][2]),
        "theta" => Degrees(|own, k| own.parameters()[k][3].to_degrees()),
        "alpha" => Degrees(|own, k| own.parameters()[k][4].to_degrees()),
        "la_x" => Length(|own, k| own.parameters()[k][5]),
        "la_y" => Length(|own, k| own.parameters()[k][6]),
        "lb" => Length(|own, k| own.parameters()[k][7]),
        "revision" => Text(|own, _| {
            let (arms, transmissions) = (own.parameters(), None);
            let geometry = delta_cal_protocol::Geometry {
                arms,
                transmissions,
            };
            geometry.fingerprint().max(1).to_string()
        }),
        "least_joint" => Text(|own, _| decimals(own.robot.limits.minimum().to_degrees(), 4)),
        "largest_joint" => Text(|own, _| decimals(own.robot.limits.maximum().to_degrees(), 4)),
        "stated_home_offset" => Text(|own, k| {
            let offset = |home: [f64; 3]| decimals(home[k].to_degrees(), 4);
            let line = |home| format!("# HOME_OFFSET = {}\n", offset(home));
            own.settings.home.map_or_else(String::new, line)
        }),
        _ => return None,
    })
}

/// A parameter of a target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// Its name in the controller.
    pub name: String,
    /// The value in the unit.
    pub value: f64,
    /// `mm`, `in` or `deg`.
    pub unit: &'static str,
}

/// The parameters of a target, and the lines to paste.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Written {
    /// All parameters.
    #[serde(rename = "parameters")]
    pub entries: Vec<Entry>,
    /// The lines to paste.
    pub lines: String,
    /// Warnings about these values.
    pub warnings: Vec<String>,
}

/// The values from which lines are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted<'a> {
    pub(super) robot: &'a RobotFile,
    pub(super) settings: &'a Settings,
    /// The fitted geometry, rounded.
    pub(super) geometry: Geometry,
    /// The joint of each arm at its end stop: radians, or mm of travel.
    pub(super) home: [f64; 3],
    /// The largest distance of a wanted position from the z axis, mm.
    pub(super) reach: f64,
}

/// All targets.
pub fn targets() -> &'static [Target] {
    #[derive(Default, Deserialize)]
    struct File {
        target: Vec<Target>,
    }
    // A test reads the same text.
    static FILE: LazyLock<File> =
        LazyLock::new(|| toml::from_str(include_str!("targets.toml")).unwrap_or_default());
    &FILE.target
}

/// The target of this name that supports these drives.
///
/// # Errors
/// There is no such target.
pub fn target(name: &str, drive: Drive) -> Result<&'static Target, ExportError> {
    let all = targets().iter();
    let supporting = all.filter(|own| own.drive.is_none_or(|own| own == drive));
    let found = supporting.clone().find(|own| own.name == name);
    found.ok_or_else(|| ExportError::OtherDrive {
        drive,
        others: supporting.map(|own| own.name.clone()).collect(),
    })
}

/// The targets' names on the command line.
pub fn names() -> Vec<&'static str> {
    let mut names: Vec<_> = targets().iter().map(|own| own.name.as_str()).collect();
    names.dedup();
    names
}

const fn four() -> usize {
    4
}

fn drive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Drive>, D::Error> {
    match String::deserialize(deserializer)?.as_str() {
        "rotary" => Ok(Some(Drive::Rotary)),
        "linear" => Ok(Some(Drive::Linear)),
        other => Err(D::Error::unknown_variant(other, &["rotary", "linear"])),
    }
}

impl TryFrom<String> for Template {
    type Error = Malformed;

    fn try_from(text: String) -> Result<Self, Malformed> {
        let mut pieces = Vec::new();
        let mut rest = text.as_str();
        while let Some((before, after)) = rest.split_once('{') {
            let braces = after.split_once('}').and_then(|(own, after)| {
                let (name, value) = own.split_once('=')?;
                Some((name.trim(), value.trim(), after))
            });
            let (name, value, after) = braces.ok_or_else(|| Malformed::missing_field("= or }"))?;
            let (quantity, motor) = value.split_once(' ').unwrap_or((value, "1"));
            let found = self::quantity(quantity);
            let motor: usize = motor.parse().map_err(Malformed::custom)?;
            pieces.push(Piece::Text(before.to_owned()));
            pieces.push(Piece::Value {
                name: name.to_owned(),
                value: found.ok_or_else(|| Malformed::unknown_variant(quantity, &[]))?,
                motor: motor.clamp(1, 3) - 1,
            });
            rest = after;
        }
        pieces.push(Piece::Text(rest.to_owned()));
        Ok(Self(pieces))
    }
}

/// With so many decimals, without −0.
pub(super) fn decimals(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches(['-', '0', '.']).is_empty();
    text.trim_start_matches(|sign| zero && sign == '-')
        .to_owned()
}

impl Target {
    /// The lines and what to know of them.
    pub(super) fn write(&self, fitted: &Fitted<'_>) -> Result<Written, ExportError> {
        let (entries, lines) = self.fill(&self.lines, fitted)?;
        let mut warnings = Vec::new();
        if self.end_stops {
            warnings.extend(fitted.assumptions());
        }
        for warning in &self.warnings {
            let (_, text) = self.fill(&warning.text, fitted)?;
            if let Some(limit) = warning.longer_than_mm {
                let long = entries.iter().filter(|entry| entry.value > limit);
                warnings.extend(long.map(|entry| text.replace('#', &entry.name)));
            } else if warning.when.is_none_or(|own| fitted.is(own)) {
                warnings.push(text);
            }
        }
        Ok(Written {
            entries,
            lines,
            warnings,
        })
    }

    fn fill(
        &self,
        template: &Template,
        fitted: &Fitted<'_>,
    ) -> Result<(Vec<Entry>, String), ExportError> {
        let (mut entries, mut lines) = (Vec::new(), String::new());
        for piece in &template.0 {
            let (name, value, motor) = match piece {
                Piece::Text(text) => {
                    lines.push_str(text);
                    continue;
                }
                Piece::Value { name, value, motor } => (name, value, *motor),
            };
            let (value, unit) = match value {
                Value::Text(text) => {
                    lines.push_str(&text(fitted, motor));
                    continue;
                }
                Value::Degrees(angle) => (angle(fitted, motor), "deg"),
                Value::Length(length) => (length(fitted, motor), "mm"),
                Value::Possible(length) => (length(fitted, motor)?, "mm"),
            };
            let (value, unit, digits) = if unit == "mm" && fitted.settings.inches {
                // Inches need more digits.
                (value / 25.4, "in", 6)
            } else {
                (value, unit, self.decimals)
            };
            lines.push_str(&decimals(value, digits));
            if !name.is_empty() {
                entries.push(Entry {
                    name: name.clone(),
                    value,
                    unit,
                });
            }
        }
        Ok((entries, lines))
    }
}

impl Fitted<'_> {
    fn arm(&self, motor: usize) -> &Shape {
        &self.geometry.arms[self.geometry.motors[motor]]
    }

    fn home(&self, motor: usize) -> f64 {
        self.home[self.geometry.motors[motor]]
    }

    fn platform(&self) -> f64 {
        let stated = self.settings.platform_radius;
        stated
            .or(self.robot.platform_radius)
            .unwrap_or(USUAL_PLATFORM)
    }

    fn flange(&self) -> Vector3<f64> {
        self.robot.instruments.target.unwrap_or_default()
    }

    fn parameters(&self) -> [[f64; 8]; 3] {
        self.robot.robot.parameters()
    }

    fn counts_up(&self) -> bool {
        self.robot.convention.joint_positive == Vertical::Up
    }

    fn mean_rod(&self) -> f64 {
        to_decimals(Shape::mean(&self.geometry.arms).lower)
    }

    /// The upper limit above level is at the smallest joint angle.
    fn highest(&self) -> f64 {
        -self.home.into_iter().fold(f64::INFINITY, f64::min)
    }

    fn mean_endstop(&self) -> f64 {
        self.endstops().iter().sum::<f64>() / 3.0
    }

    fn lowest_endstop(&self) -> f64 {
        self.endstops().into_iter().fold(f64::INFINITY, f64::min)
    }

    fn is(&self, condition: Condition) -> bool {
        let [first, ..] = &self.geometry.arms;
        let limits = self.robot.limits;
        match condition {
            Condition::AxesNotAboveZero => !(first.height > 0.0),
            Condition::UpperArmsDiffer => {
                let mut arms = self.geometry.arms.iter();
                arms.any(|arm| (arm.upper - first.upper).abs() > EQUAL)
            }
            Condition::WithTransmissions => {
                let mut arms = self.robot.robot.arms().iter();
                arms.any(|arm| arm.transmission().is_some())
            }
            Condition::BeyondQuarterTurn => {
                limits.minimum().abs() > FRAC_PI_2 || limits.maximum().abs() > FRAC_PI_2
            }
        }
    }

    /// With towers: the height of the nozzle at x = y = 0 with each carriage at its end stop, mm.
    fn endstops(&self) -> [f64; 3] {
        let mut endstops = self.home;
        for (endstop, tower) in endstops.iter_mut().zip(&self.geometry.arms) {
            let square = tower.lower * tower.lower - tower.radius * tower.radius;
            *endstop += tower.height - square.max(0.0).sqrt();
        }
        endstops
    }

    /// Warnings about end stops and a bed that the user did not state.
    fn assumptions(&self) -> Vec<String> {
        let [home, ..] = self.home;
        let linear = self.geometry.drive == Drive::Linear;
        let mut warnings = Vec::new();
        if self.settings.home.is_none() {
            let place = if linear {
                format!("a travel of {home:.3} mm, the largest of [joints]")
            } else {
                format!("joint angles of {:.0}°", home.to_degrees())
            };
            warnings.push(format!(
                "The end stops are assumed at {place}. If they are elsewhere the lines are wrong: state them with --home."
            ));
        }
        if linear && self.settings.level.is_none() {
            warnings.push(
                "z = 0 and level are the robot file's. After a calibration from heights the bed is elsewhere: give the \
                 file of the heights with --bed."
                    .to_owned(),
            );
        }
        warnings
    }
}

fn height_with_arms_level(arm: &Shape) -> f64 {
    let out = arm.radius + arm.upper;
    arm.height - (arm.lower * arm.lower - out * out).max(0.0).sqrt()
}

fn shoulder_radius(arm: &Shape) -> Result<f64, ExportError> {
    if arm.radius > 0.0 {
        return Ok(arm.radius);
    }
    Err(ExportError::CannotHold {
        arm: ArmIndex::First,
        key: "dx_mm",
        cause: format!(
            "its base radius minus the platform radius is {:.3} mm; Klipper accepts only a shoulder_radius above 0",
            arm.radius
        ),
    })
}

/// The height of the platform on the z axis with the upper arm at an angle above level, mm. `None` if there is none, or if
/// Klipper, which assumes the outer elbow, would find another arm angle.
fn height_on_the_axis(arm: &Shape, angle: f64) -> Option<f64> {
    let (sin, cos) = angle.sin_cos();
    let out = arm.radius + arm.upper * cos;
    let square = arm.lower * arm.lower - out * out;
    if !(square > 0.0) {
        return None;
    }
    let below = arm.upper * sin - square.sqrt();
    let towards = f64::atan2(below, -arm.radius);
    (cos > (2.0 * towards - angle).cos()).then_some(arm.height + below)
}

#[cfg(test)]
mod tests {
    use super::targets;

    #[test]
    fn the_file_of_targets_is_read() {
        assert_eq!(targets().len(), 15);
    }
}
