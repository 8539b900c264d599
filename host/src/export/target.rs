//! The controllers to export for: what each holds of a robot and the lines that it reads, as `targets.toml` states them.

use super::Settings;
use super::error::ExportError;
use super::geometry::{Geometry, Holds, Shape, to_decimals};
use crate::files::{Convention, RobotFile, TRANSMISSION_KEYS};
use crate::import::USUAL_TOWERS;
use crate::text::arm_key;
use delta_cal::ArmIndex;
use delta_cal::robot::{Drive, ParameterKind};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// The platform radius if none is stated, mm.
const USUAL_PLATFORM: f64 = 25.0;
/// Steps of a mm if they are not known.
const USUAL_STEPS: f64 = 80.0;
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
    /// Whether its axes are those of the robot file; otherwise its z points up.
    #[serde(default, skip_serializing)]
    pub stated_axes: bool,
    /// The parameters that it holds, if these are fitted.
    #[serde(default, skip_serializing)]
    pub holds: Holds,
    #[serde(default, skip_serializing)]
    lines: String,
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
    text: String,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Condition {
    AxesNotAboveZero,
    UpperArmsDiffer,
    BeyondQuarterTurn,
    WithTransmissions,
    StepsUnknown,
}

/// A value in the lines: mm, degrees, or text.
enum Value {
    Length(f64),
    Degrees(f64),
    Text(String),
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
    /// Whether it is the place of an end stop.
    #[serde(skip)]
    pub is_endstop: bool,
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
    /// Of the controller.
    pub(super) convention: Convention,
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
    // The text is part of the program, and every test of an export shows that it can be read.
    static FILE: LazyLock<File> = LazyLock::new(|| toml::from_str(TARGETS).unwrap_or_default());
    &FILE.target
}

const TARGETS: &str = include_str!("targets.toml");

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
///
/// They belong to the help of every run: reading all of the file would take longer than many a command.
pub fn names() -> Vec<&'static str> {
    let mut names: Vec<_> = TARGETS.split("\nname = \"").skip(1).collect();
    for name in &mut names {
        *name = name.split('"').next().unwrap_or_default();
    }
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

/// With so many decimals, without −0.
fn decimals(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches(['-', '0', '.']).is_empty();
    text.trim_start_matches(|sign| zero && sign == '-')
        .to_owned()
}

impl Target {
    /// The controller's convention for the robot of a file.
    pub(super) const fn convention(&self, robot: &RobotFile) -> Convention {
        if self.stated_axes {
            robot.convention
        } else {
            robot.convention.upright()
        }
    }

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

    /// A template with its values, and the parameters among these.
    fn fill(
        &self,
        template: &str,
        fitted: &Fitted<'_>,
    ) -> Result<(Vec<Entry>, String), ExportError> {
        let (mut entries, mut lines) = (Vec::new(), String::new());
        for part in template.split_inclusive('}') {
            let braces = part.strip_suffix('}').and_then(|part| {
                let (before, own) = part.split_once('{')?;
                Some((before, own.split_once('=')?))
            });
            let Some((before, (name, value))) = braces else {
                lines.push_str(part);
                continue;
            };
            lines.push_str(before);
            let (quantity, motor) = value.trim().split_once(' ').unwrap_or((value.trim(), "1"));
            let motor: usize = motor.parse().unwrap_or(1);
            let (value, unit, digits) = match fitted.value(quantity, motor.clamp(1, 3) - 1)? {
                Value::Text(text) => {
                    lines.push_str(&text);
                    continue;
                }
                Value::Degrees(degrees) => (degrees, "deg", self.decimals),
                // Inches need more digits.
                Value::Length(length) if fitted.settings.inches => (length / 25.4, "in", 6),
                Value::Length(length) => (length, "mm", self.decimals),
            };
            lines.push_str(&decimals(value, digits));
            if !name.is_empty() {
                entries.push(Entry {
                    name: name.trim().to_owned(),
                    value,
                    unit,
                    is_endstop: quantity.contains("endstop"),
                });
            }
        }
        Ok((entries, lines))
    }
}

impl Fitted<'_> {
    /// A quantity of `targets.toml`: of the arm or tower that a motor drives, or of all. An unknown one stands in the lines
    /// as it is.
    fn value(&self, quantity: &str, motor: usize) -> Result<Value, ExportError> {
        let arms = &self.geometry.arms;
        let arm = self.geometry.motors[motor];
        let (own, home) = (&arms[arm], self.home[arm]);
        let (limits, instruments) = (self.robot.limits, &self.robot.instruments);
        let convention = &self.convention;
        let flange = convention.vector(&instruments.target_place());
        let stated = self.settings.platform_radius.or(self.robot.platform_radius);
        let platform = stated.unwrap_or(USUAL_PLATFORM);
        let triangle = 2.0 * 3f64.sqrt();
        // Above level the upper limit is at the smallest joint angle.
        let highest = -self.home.into_iter().fold(f64::INFINITY, f64::min);
        let endstops = self.endstops();
        let mean_endstop = endstops.iter().sum::<f64>() / 3.0;
        let lowest_endstop = endstops.into_iter().fold(f64::INFINITY, f64::min);
        let mean_rod = to_decimals(Shape::mean(arms).lower);
        let degrees = |radians: f64| Value::Degrees(radians.to_degrees());
        let rounded = |radians: f64| Value::Text(decimals(radians.to_degrees(), 4));
        let (mm, text) = (Value::Length, Value::Text);
        Ok(match quantity {
            // The number of the arm.
            "arm" => text((arm + 1).to_string()),
            // From 0° to 360°, and from 210°, 330° or 90°.
            "azimuth" => {
                let stated = convention.angle(own.azimuth).to_degrees();
                Value::Degrees(stated.rem_euclid(360.0))
            }
            "correction" => degrees(own.azimuth_beyond(USUAL_TOWERS[arm])),
            // Of the motor axis or tower minus that of the platform.
            "radius" => mm(own.radius),
            "shoulder_radius" => mm(shoulder_radius(own)?),
            // Radii of base and platform, and the sides of the triangles around these circles.
            "base" => mm(own.radius + platform),
            "base_triangle" => mm(triangle * (own.radius + platform)),
            "platform" => mm(platform),
            "platform_triangle" => mm(triangle * platform),
            "flange_x" => mm(flange.x),
            "flange_y" => mm(flange.y),
            "flange_z" => mm(flange.z),
            "nothing" => mm(0.0),
            // Of the motor axis, and of the platform with the upper arms level.
            "height" => mm(convention.height(own.height)),
            "height_with_arms_level" => {
                let out = own.radius + own.upper;
                let height = own.height - (own.lower * own.lower - out * out).max(0.0).sqrt();
                mm(self.robot.convention.height(height))
            }
            "upper" => mm(own.upper),
            // The forearm or rod.
            "lower" => mm(own.lower),
            "mean_rod" => mm(mean_rod),
            "above_mean_rod" => mm(own.lower - mean_rod),
            // The joint angle with the upper arm level, reversed; the same as the joints count.
            "endstop_correction" => degrees(-own.zero),
            "zero_as_counted" => degrees(convention.sense() * own.zero),
            "count_direction" => {
                let upwards = convention.sense() < 0.0;
                text(if upwards { "Inverse" } else { "Standard" }.to_owned())
            }
            // The joint angle at the end stop, counted from where the upper arm is level.
            "endstop_angle" => degrees(home - own.zero),
            // The height of the nozzle at x = y = 0 with the arm at its end stop.
            "position_endstop" => {
                let endstop = height_on_the_axis(own, own.zero - home);
                mm(endstop.ok_or(ExportError::Home {
                    arm: ArmIndex::ALL[arm],
                    degrees: home.to_degrees(),
                })?)
            }
            // Above level: the limits, and each end stop from the highest.
            "lowest_angle" => degrees(f64::min(-limits.maximum(), highest)),
            "highest_angle" => degrees(highest),
            "endstop_trim" => degrees(own.zero - home - highest),
            // The height of the nozzle at x = y = 0 with the carriage at its end stop.
            "tower_endstop" => mm(endstops[arm]),
            "mean_endstop" => mm(mean_endstop),
            "above_mean_endstop" => mm(endstops[arm] - mean_endstop),
            // No carriage moves up from its end stop.
            "lowest_endstop" => mm(lowest_endstop),
            "steps_above_lowest_endstop" => {
                let steps = self.settings.steps.unwrap_or(USUAL_STEPS);
                text(format!("{:.0}", steps * (endstops[arm] - lowest_endstop)))
            }
            "below_endstop" => mm(lowest_endstop - endstops[arm]),
            // Of the printed area: as stated, or the largest distance of a wanted position from the z axis.
            "reach" => {
                let stated = self.robot.within.and_then(|own| own.radius);
                let reach = self.settings.bed_radius.or(stated);
                let reach = reach.unwrap_or(self.reach.ceil());
                text(format!("{reach:.1}"))
            }
            // The parameters' number, and the range of the joints.
            "joint_sign" => text(format!("{:.1}", convention.sense())),
            "z_sign" => text(format!("{:.1}", convention.height(1.0))),
            "revision" => {
                let geometry = delta_cal_protocol::Geometry {
                    arms: self.robot.robot.parameters(),
                    transmissions: None,
                };
                text(geometry.fingerprint().max(1).to_string())
            }
            "least_joint" => rounded(limits.minimum()),
            "largest_joint" => rounded(limits.maximum()),
            "stated_endstop_angle" => text(self.settings.home.map_or_else(String::new, |home| {
                let offset = decimals(home[motor].to_degrees(), 4);
                format!("# HOME_OFFSET = {offset}\n")
            })),
            unknown => self
                .parameter(unknown, motor)
                .unwrap_or_else(|| text(format!("{{{unknown}}}"))),
        })
    }

    /// What the robot file states of an arm under this key, or of the transmission of its joint.
    fn parameter(&self, key: &str, motor: usize) -> Option<Value> {
        let arm = &self.robot.robot.arms()[motor];
        let mut parameters = arm.drive().parameters().iter();
        if let Some(own) = parameters.find(|own| arm_key(**own) == key) {
            let value = self.convention.parameter(*own, arm.get(*own));
            return Some(match own.kind() {
                ParameterKind::Angle => Value::Degrees(value.to_degrees()),
                ParameterKind::Length | ParameterKind::Ratio => Value::Length(value),
            });
        }
        let place = TRANSMISSION_KEYS.iter().position(|own| *own == key)?;
        let transmission = self.robot.robot.transmissions()[motor].numbers();
        let value = self.convention.transmission(transmission)[place];
        let is_gain = place == 0;
        let value = if is_gain { value } else { value.to_degrees() };
        Some(Value::Text(decimals(value, 9)))
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
            Condition::StepsUnknown => self.settings.steps.is_none(),
            Condition::BeyondQuarterTurn => {
                limits.minimum().abs() > FRAC_PI_2 || limits.maximum().abs() > FRAC_PI_2
            }
        }
    }

    /// With towers: the height of the nozzle at x = y = 0 with each carriage at its end stop, mm.
    fn endstops(&self) -> [f64; 3] {
        if let Some(kept) = self.settings.endstops {
            return kept;
        }
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
                let home = self.robot.convention.degrees(home);
                format!("joint angles of {home:.0}°")
            };
            warnings.push(format!(
                "The end stops are assumed at {place}. If they are elsewhere the lines are wrong: state them with --home."
            ));
        }
        if linear && self.settings.level.is_none() {
            warnings.push(
                "z = 0 and the level are the robot file's, not the bed's. If heights were measured, give their file with \
                 --bed."
                    .to_owned(),
            );
        }
        warnings
    }
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
