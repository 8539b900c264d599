//! The robot file as text.

use super::schema::{TRANSMISSION_KEYS, arm_key};
use super::{Record, RobotFile};
use crate::files::convention::{Convention, JointUnit, LengthUnit, Vertical};
use crate::text::{degrees, joint};
use delta_cal::Parameter;
use delta_cal::robot::{Drive, ParameterKind};
use nalgebra::Vector3;
use std::fmt::Write;

impl RobotFile {
    /// The file as text: three `[[arm]]` and every other section that is known. Each number reads
    /// back as the same `f64`. `comment` comes first, line by line.
    pub fn to_toml(&self, comment: &str) -> String {
        let mut text = String::new();
        for line in comment.lines() {
            // TOML allows no control characters in a comment, file names may hold any.
            let _ = writeln!(text, "# {}", line.replace(char::is_control, "?"));
        }
        write_record(&self.record, &mut text);
        write_convention(&self.convention, &mut text);
        for arm in self.robot.arms() {
            text.push_str("\n[[arm]]\n");
            for parameter in arm.drive().parameters().iter().copied() {
                let value = match parameter.kind() {
                    ParameterKind::Length | ParameterKind::Ratio => arm.get(parameter),
                    ParameterKind::Angle => degrees(arm.get(parameter)),
                };
                entry(&mut text, arm_key(parameter), value);
            }
            if let Some(transmission) = arm.transmission() {
                let [gain, harmonics @ ..] = transmission.numbers();
                let [key, keys @ ..] = TRANSMISSION_KEYS;
                entry(&mut text, key, gain);
                for (key, harmonic) in keys.into_iter().zip(harmonics) {
                    entry(&mut text, key, degrees(harmonic));
                }
            }
        }
        if let Some(radius) = self.platform_radius {
            text.push_str("\n[platform]\n");
            entry(&mut text, "radius_mm", radius);
        }
        text.push_str("\n[joints]\n");
        let drive = self.robot.drive();
        let convention = &self.convention;
        let (low, high) = convention.limits(self.limits.minimum(), self.limits.maximum());
        for (name, limit) in [("min", low), ("max", high)] {
            if convention.joint_unit == Some(JointUnit::Radian) {
                entry(&mut text, &format!("{name}_rad"), limit);
            } else {
                let limit = joint::in_file(drive, limit);
                entry(&mut text, &joint::key(name, drive), limit);
            }
        }
        if let Some(angle) = self.forearm_limit {
            entry(&mut text, "forearm_max_deg", degrees(angle));
        }
        if let Some(tolerance) = &self.tolerance {
            text.push_str("\n[tolerance]\n");
            entry(&mut text, "length_mm", tolerance.of(Parameter::Lb));
            let angle = degrees(tolerance.of(Parameter::Theta));
            entry(&mut text, "angle_deg", angle);
            if let Some(zero) = tolerance.joint_zero() {
                entry(&mut text, "zero_deg", degrees(zero));
            }
            if drive == Drive::Linear {
                entry(&mut text, "zero_mm", tolerance.of(Parameter::Zero));
                entry(&mut text, "scale", tolerance.of(Parameter::Scale));
                if tolerance.radius() > 0.0 {
                    entry(&mut text, "radius_mm", tolerance.radius());
                }
                if tolerance.forearm() > 0.0 {
                    entry(&mut text, "forearm_mm", tolerance.forearm());
                }
            }
            if let Some(transmission) = &self.transmission {
                entry(&mut text, "transmission_deg", degrees(transmission.sigma()));
            }
        }
        if let Some(noise) = &self.noise {
            text.push_str("\n[noise]\n");
            if let Some(position) = noise.isotropic() {
                entry(&mut text, "position_mm", position);
            } else {
                let [x, y, z] = noise.position_by_axis();
                let _ = writeln!(text, "position_mm = [{x:?}, {y:?}, {z:?}]");
            }
        }
        self.write_instruments(&mut text);
        if let Some(frame) = &self.sensor_frame {
            text.push_str("\n# X_sensor = rotation * X_robot + translation\n[sensor_frame]\n");
            text.push_str("rotation = [\n");
            for row in convention.rotation(&frame.rotation).row_iter() {
                let _ = writeln!(text, "    [{:?}, {:?}, {:?}],", row[0], row[1], row[2]);
            }
            let [x, y, z] = convention.vector(&frame.translation).data.0[0];
            let _ = writeln!(text, "]\ntranslation_mm = [{x:?}, {y:?}, {z:?}]");
        }
        text
    }

    /// The rest of `[noise]`, and the sections of the instruments.
    fn write_instruments(&self, text: &mut String) {
        let facts = &self.instruments;
        let others = [
            ("height_mm", facts.height_noise),
            ("distance_mm", facts.distance_noise),
        ];
        let any = others.iter().any(|(_, sigma)| sigma.is_some()) || facts.joint_noise.is_some();
        if self.noise.is_none() && any {
            text.push_str("\n[noise]\n");
        }
        for (key, sigma) in others {
            if let Some(sigma) = sigma {
                entry(text, key, sigma);
            }
        }
        if let Some(joint) = self.noise.map(|noise| noise.joint()).or(facts.joint_noise) {
            let drive = self.robot.drive();
            entry(
                text,
                &joint::key("joint", drive),
                joint::in_file(drive, joint),
            );
        }
        for plane in &facts.planes {
            let _ = writeln!(text, "\n[planes.{}]", key_of(&plane.name));
            let at = self
                .convention
                .vector(&Vector3::new(0.0, 0.0, plane.height));
            entry(text, "z_mm", at.z);
            entry(text, "sigma_mm", plane.sigma);
            if let Some(tilt) = plane.tilt {
                entry(text, "tilt_deg", degrees(tilt));
            }
            if !plane.blocks.is_empty() {
                let _ = writeln!(text, "blocks_mm = {:?}", plane.blocks);
            }
        }
        for point in &facts.points {
            let _ = writeln!(text, "\n[points.{}]", key_of(&point.name));
            if let Some((place, sigma)) = point.place {
                let place = self.convention.vector(&place);
                entry(text, "x_mm", place.x);
                entry(text, "y_mm", place.y);
                entry(text, "z_mm", place.z);
                entry(text, "sigma_mm", sigma);
            }
            if point.offset_unknown {
                text.push_str("offset = \"unknown\"\n");
            }
            if let Some((shortest, longest)) = point.lengths {
                let _ = writeln!(text, "length_mm = [{shortest:?}, {longest:?}]");
            }
        }
        if let Some((shortest, longest)) = facts.lengths {
            let _ = writeln!(
                text,
                "\n[distances]\nlength_mm = [{shortest:?}, {longest:?}]"
            );
        }
        for point in &facts.datum {
            let _ = writeln!(text, "\n[datum.{}]", key_of(&point.name));
            let [x, y, z] = self.convention.vector(&point.place).data.0[0];
            entry(text, "x_mm", x);
            entry(text, "y_mm", y);
            entry(text, "z_mm", z);
            let seen = self.convention.vector(&point.seen).data.0[0];
            let _ = writeln!(text, "sensor_mm = {seen:?}");
        }
        if let Some(target) = &facts.target {
            let target = self.convention.vector(target);
            text.push_str("\n[target]\n");
            entry(text, "x_mm", target.x);
            entry(text, "y_mm", target.y);
            entry(text, "z_mm", target.z);
        }
    }
}

fn write_convention(convention: &Convention, text: &mut String) {
    if convention.is_usual() {
        return;
    }
    let axis = |vertical| match vertical {
        Vertical::Up => "up",
        Vertical::Down => "down",
    };
    text.push_str("\n# The arms' parameters below are in the axes of the program: z up, positive joints down.\n");
    text.push_str("[convention]\n");
    if convention.drive == Drive::Rotary {
        let _ = writeln!(
            text,
            "joint_positive = {:?}",
            axis(convention.joint_positive)
        );
    }
    let _ = writeln!(text, "z_axis = {:?}", axis(convention.z_axis));
    let unit = match convention.joint_unit {
        Some(JointUnit::Degree) => "deg",
        Some(JointUnit::Radian) => "rad",
        Some(JointUnit::Counts(_)) => "counts",
        None => "",
    };
    if !unit.is_empty() {
        let _ = writeln!(text, "joint_unit = {unit:?}");
    }
    if let Some(JointUnit::Counts(counts)) = convention.joint_unit {
        let _ = writeln!(text, "counts_per_deg = {counts:?}");
    }
    let unit = match convention.length_unit {
        Some(LengthUnit::Millimetre) => "mm",
        Some(LengthUnit::Centimetre) => "cm",
        Some(LengthUnit::Metre) => "m",
        Some(LengthUnit::Micrometre) => "um",
        Some(LengthUnit::Inch) => "inch",
        None => return,
    };
    let _ = writeln!(text, "length_unit = {unit:?}");
}

fn write_record(record: &Record, text: &mut String) {
    let robot = [("name", &record.name), ("serial", &record.serial)];
    let measurement = [
        ("operator", &record.operator),
        ("instrument", &record.instrument),
        ("date", &record.date),
    ];
    for (section, entries) in [("robot", &robot[..]), ("measurement", &measurement)] {
        let mut stated = entries
            .iter()
            .filter_map(|(key, text)| Some((*key, text.as_ref()?)));
        let Some(first) = stated.next() else { continue };
        let _ = writeln!(text, "\n[{section}]");
        for (key, value) in std::iter::once(first).chain(stated) {
            let _ = writeln!(text, "{key} = {}", toml::Value::from(value.as_str()));
        }
    }
}

/// A TOML key that may hold anything.
fn key_of(name: &str) -> String {
    toml::Value::from(name).to_string()
}

/// Rust's `{:?}` of an `f64` is the shortest text that reads back as the same number, and TOML.
fn entry(text: &mut String, key: &str, value: f64) {
    let _ = writeln!(text, "{key} = {value:?}");
}
