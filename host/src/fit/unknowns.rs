//! What each row and column of a solution's covariance is.

use super::Frame;
use super::solution::Solution;
use crate::effects::{EffectKind, Estimated};
use crate::files::{Convention, ONLY_TARGET, RobotFile};
use crate::geometry::OF_ARM;
use delta_cal::Parameter;
use delta_cal::robot::ParameterKind;

/// An unknown of a fit, in the convention of the robot file.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// `arm1.Dx`, `frame.x`, `plane.table.z`, `target.ball.x`, `scale`, …
    pub name: String,
    /// `mm`, `rad`, or nothing of a ratio.
    pub unit: &'static str,
    /// 1, or −1 if its sign is the other one in the internal axes.
    pub sign: f64,
    /// The estimate; NaN of a small turn, which has none of its own.
    pub value: f64,
}

const AXES: [&str; 3] = ["x", "y", "z"];
const TURNS: [&str; 3] = ["turn_x", "turn_y", "turn_z"];
/// The numbers of an arm's rods.
const RODS: [(&str, &str); OF_ARM] = [
    ("rod_difference", "mm"),
    ("spacing_difference", "mm"),
    ("axis_yaw", "rad"),
    ("axis_roll", "rad"),
];

/// Collects unknowns in the order of the covariance.
struct List<'a> {
    convention: &'a Convention,
    all: Vec<Unknown>,
}

impl List<'_> {
    fn add(&mut self, name: String, unit: &'static str, sign: f64, value: f64) {
        let value = sign * value + 0.0;
        self.all.push(Unknown {
            name,
            unit,
            sign,
            value,
        });
    }

    fn vector(&mut self, of: &str, names: [&str; 3], unit: &'static str, values: &[f64]) {
        for ((name, sign), value) in names.into_iter().zip(self.convention.axes()).zip(values) {
            self.add(format!("{of}.{name}"), unit, sign, *value);
        }
    }

    fn transmission(&mut self, of: &str, numbers: [f64; 5]) {
        let names = ["gain", "cos", "sin", "cos2", "sin2"];
        let signs = self.convention.transmission([1.0; 5]);
        for (place, name) in names.into_iter().enumerate() {
            let unit = if place == 0 { "" } else { "rad" };
            self.add(format!("{of}.{name}"), unit, signs[place], numbers[place]);
        }
    }

    fn effect(&mut self, own: &Estimated, targets: &[String]) {
        let (kind, by) = (own.effect.kind, own.by.as_slice());
        let mut name = match own.effect.arm {
            Some(arm) => format!("arm{}.{}", arm.index() + 1, kind.name()),
            None => kind.name().to_owned(),
        };
        if kind == EffectKind::Target
            && let Some(target) = targets.get(own.effect.index)
            && target != ONLY_TARGET
        {
            name = format!("{name}.{target}");
        }
        let sense = self.convention.sense();
        let unit = match kind.unit(self.convention.drive) {
            "deg" => "rad",
            "ratio" => "",
            unit => unit,
        };
        match kind {
            EffectKind::Target | EffectKind::Drift => self.vector(&name, AXES, unit, by),
            EffectKind::Move | EffectKind::Datum => {
                self.vector(&name, AXES, unit, by);
                self.vector(&name, TURNS, "rad", &by[3..]);
            }
            EffectKind::Eccentricity | EffectKind::SecondHarmonic => {
                self.add(format!("{name}.cos"), unit, sense, by[0]);
                self.add(format!("{name}.sin"), unit, 1.0, by[1]);
            }
            EffectKind::Tilt => {
                let signs = self.convention.rods([1.0; OF_ARM]);
                for (place, by) in by.iter().enumerate() {
                    let (arm, number) = (place / OF_ARM + 1, place % OF_ARM);
                    let (own, unit) = RODS[number];
                    self.add(format!("arm{arm}.{own}"), unit, signs[number], *by);
                }
            }
            kind => {
                let turns = matches!(kind, EffectKind::Slip | EffectKind::Zeros);
                let sign = if turns { sense } else { 1.0 };
                for (number, own) in (1..).zip(by) {
                    let name = match by.len() {
                        1 => name.clone(),
                        _ => format!("{name}.{number}"),
                    };
                    self.add(name, unit, sign, *own);
                }
            }
        }
    }
}

impl Solution {
    /// What each row and column of the covariance is.
    pub fn unknowns(&self, robot: &RobotFile) -> Vec<Unknown> {
        let convention = &robot.convention;
        let mut list = List {
            convention,
            all: Vec::with_capacity(self.covariance.nrows()),
        };
        let (signs, places) = (convention.signs(), self.robot.drive().places());
        for (index, value) in self.robot.parameters().concat().into_iter().enumerate() {
            let (arm, place) = (index / 8 + 1, index % 8);
            let symbol = places[place].map_or("unused", |own| own.symbol());
            let unit = match places[place].map(Parameter::kind) {
                Some(ParameterKind::Length) => "mm",
                Some(ParameterKind::Angle) => "rad",
                _ => "",
            };
            list.add(format!("arm{arm}.{symbol}"), unit, signs[place], value);
        }
        if self.transmissions {
            for (arm, own) in (1..).zip(self.robot.transmissions()) {
                list.transmission(&format!("arm{arm}"), own.numbers());
            }
        }
        self.instruments(robot, &mut list);
        for own in &self.effects {
            list.effect(own, &self.readings.targets);
        }
        list.all
    }

    fn instruments(&self, robot: &RobotFile, list: &mut List<'_>) {
        let (facts, readings) = (&robot.instruments, &self.readings);
        let target = facts.target_place();
        // One that datum points give is an effect.
        if let (Frame::Sensor, Some(frame)) = (self.frame, self.places.frame) {
            list.vector("frame", AXES, "mm", frame.translation.as_slice());
            list.vector("frame", TURNS, "rad", &[f64::NAN; 3]);
        }
        let [_, _, z] = list.convention.axes();
        for (name, own) in readings.planes.iter().zip(&self.places.planes) {
            let (normal, upward) = (own.normal, own.normal.z);
            let at_axis = (own.offset + normal.dot(&target)) / upward;
            list.add(format!("plane.{name}.z"), "mm", z, at_axis);
            list.add(format!("plane.{name}.slope_x"), "", z, -normal.x / upward);
            list.add(format!("plane.{name}.slope_y"), "", 1.0, -normal.y / upward);
        }
        for (name, own) in readings.points.iter().zip(&self.places.points) {
            let of = format!("point.{name}");
            list.vector(&of, AXES, "mm", (own.place + target).as_slice());
            let mut stated = facts.points.iter();
            if stated.any(|stated| stated.name == *name && stated.offset_unknown) {
                list.add(format!("{of}.offset"), "mm", 1.0, own.offset);
            }
        }
        if facts.distance_scale.is_some() {
            list.add(
                "distance_scale".to_owned(),
                "",
                1.0,
                self.places.distance_scale,
            );
        }
    }
}
