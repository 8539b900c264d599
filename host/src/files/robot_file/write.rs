//! Writes a robot file.

use super::{ONLY_TARGET, ROD_KEYS, RobotFile, TRANSMISSION_KEYS};
use crate::files::columns::Unit;
use crate::files::convention::{JOINT_UNITS, LENGTH_UNITS, Vertical};
use crate::text::{arm_key, degrees, in_file, joint, tolerance_keys};
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use std::fmt::{Debug, Display, Write};

impl RobotFile {
    /// The file as text: three `[[arm]]` sections and every other known section. Each number reads back as the same
    /// `f64`. `comment` comes first, line by line.
    pub fn to_toml(&self, comment: &str) -> String {
        let mut file = File::default();
        for line in comment.lines() {
            // TOML forbids control characters in comments, but file names may contain any.
            let _ = writeln!(file.text, "# {}", line.replace(char::is_control, "?"));
        }
        let own = &self.record;
        file.section("[robot]");
        file.text("name", own.name.as_ref());
        file.text("serial", own.serial.as_ref());
        file.section("[measurement]");
        for (key, value) in &own.measurement {
            file.text(key, Some(value));
        }
        self.write_convention(&mut file);
        self.write_arms(&mut file);
        file.section("[platform]");
        file.optional("radius_mm", self.platform_radius);
        file.section("[parallelogram]");
        file.optional("spacing_mm", self.parallelograms.map(|own| own.spacing));
        self.write_joints(&mut file);
        self.write_workspace(&mut file);
        self.write_tolerance(&mut file);
        self.write_noise(&mut file);
        self.write_instruments(&mut file);
        if let Some([absolute, relative]) = self.instruments.expected {
            file.section("# Expected position errors, rms over the workspace (σ)\n[calibration]");
            file.entry("absolute_mm", absolute);
            file.entry("relative_mm", relative);
        }
        if let Some(frame) = &self.sensor_frame {
            let rotation = self.convention.rotation(&frame.rotation);
            let rows = rotation
                .transpose()
                .data
                .0
                .map(|row| format!("    {row:?},\n"));
            file.section("# X_sensor = rotation * X_robot + translation\n[sensor_frame]");
            file.verbatim("rotation", format!("[\n{}]", rows.concat()));
            file.entry("translation_mm", self.outwards(&frame.translation));
        }
        file.text
    }

    /// Converts a vector to the file's axes.
    fn outwards(&self, vector: &Vector3<f64>) -> [f64; 3] {
        self.convention.vector(vector).into()
    }

    fn write_convention(&self, file: &mut File) {
        let own = &self.convention;
        if own.is_usual() {
            return;
        }
        file.section("[convention]");
        if own.drive == Drive::Rotary {
            file.entry("joint_positive", word(&Vertical::WORDS, own.joint_positive));
        }
        file.entry("z_axis", word(&Vertical::WORDS, own.z_axis));
        let unit = own.joint_unit.map(|unit| word(&JOINT_UNITS, unit));
        file.optional("joint_unit", unit);
        file.optional("counts_per_deg", own.counts_per_degree);
        let unit = own.length_unit.map(|unit| word(&LENGTH_UNITS, unit));
        file.optional("length_unit", unit);
    }

    fn write_arms(&self, file: &mut File) {
        for (index, arm) in self.robot.arms().iter().enumerate() {
            file.section("[[arm]]");
            for parameter in arm.drive().parameters().iter().copied() {
                let value = self.convention.parameter(parameter, arm.get(parameter));
                file.entry(arm_key(parameter), in_file(parameter, value));
            }
            if let Some(transmission) = arm.transmission() {
                let numbers = self.convention.transmission(transmission.numbers());
                let [gain, harmonics @ ..] = numbers;
                let [key, keys @ ..] = TRANSMISSION_KEYS;
                file.entry(key, gain);
                for (key, harmonic) in keys.into_iter().zip(harmonics) {
                    file.entry(key, degrees(harmonic));
                }
            }
            if let Some(rods) = self.parallelograms.filter(|own| !own.are_exact()) {
                let [lengths @ .., yaw, roll] = self.convention.rods(rods.numbers[index]);
                let [rod, spacing] = lengths;
                for (key, number) in
                    ROD_KEYS
                        .iter()
                        .zip([rod, spacing, degrees(yaw), degrees(roll)])
                {
                    file.entry(key, number);
                }
            }
        }
    }

    fn write_joints(&self, file: &mut File) {
        file.section("[joints]");
        let drive = self.robot.drive();
        let own = &self.convention;
        let (low, high) = own.limits(self.limits.minimum(), self.limits.maximum());
        for (name, limit) in [("min", low), ("max", high)] {
            if own.joint_unit == Some(Unit::Radian) {
                file.entry(&format!("{name}_rad"), limit);
            } else {
                file.entry(&joint::key(name, drive), joint::in_file(drive, limit));
            }
        }
        file.optional("forearm_max_deg", self.forearm_limit.map(degrees));
    }

    fn write_workspace(&self, file: &mut File) {
        if let Some(own) = &self.within {
            file.section("[workspace]");
            file.entry("within", own.turned(&self.convention).to_string());
        }
    }

    fn write_tolerance(&self, file: &mut File) {
        let Some(own) = &self.tolerance else { return };
        file.section("[tolerance]");
        for (key, sigma) in tolerance_keys(self.robot.drive(), own) {
            file.entry(key, sigma);
        }
        let transmission = self.transmission.map(|own| degrees(own.sigma()));
        file.optional("transmission_deg", transmission);
        if let Some([length, angle]) = self.parallelograms.map(|own| own.tolerance) {
            file.entry("parallelogram_mm", length);
            file.entry("parallelogram_deg", degrees(angle));
        }
    }

    fn write_noise(&self, file: &mut File) {
        let (facts, drive) = (&self.instruments, self.robot.drive());
        file.section("[noise]");
        if let Some(noise) = &self.noise {
            match noise.isotropic() {
                Some(position) => file.entry("position_mm", position),
                None => file.entry("position_mm", noise.position_by_axis()),
            }
        }
        file.optional("height_mm", facts.height_noise);
        file.optional("distance_mm", facts.distance_noise);
        file.optional("orientation_deg", facts.orientation_noise.map(degrees));
        file.optional("distance_scale", facts.distance_scale);
        file.optional("oversize_mm", facts.oversize);
        file.optional("scale", facts.scale);
        file.optional("bed_mm", facts.bed);
        let joint = self.joint_noise().map(|own| joint::in_file(drive, own));
        file.optional(&joint::key("joint", drive), joint);
    }

    fn write_instruments(&self, file: &mut File) {
        let facts = &self.instruments;
        for plane in &facts.planes {
            file.named("planes", &plane.name);
            file.entry("z_mm", self.convention.height(plane.height));
            file.entry("sigma_mm", plane.sigma);
            file.optional("tilt_deg", plane.tilt.map(degrees));
            let blocks = Some(&plane.blocks);
            file.optional("blocks_mm", blocks.filter(|blocks| !blocks.is_empty()));
        }
        for point in &facts.points {
            file.named("points", &point.name);
            if let Some((place, sigma)) = point.place {
                file.vector(self.outwards(&place));
                file.entry("sigma_mm", sigma);
            }
            file.optional("offset", point.offset_unknown.then_some("unknown"));
            file.optional("length_mm", point.lengths.map(<[f64; 2]>::from));
        }
        file.section("[distances]");
        file.optional("length_mm", facts.lengths.map(<[f64; 2]>::from));
        for point in &facts.datum {
            file.named("datum", &point.name);
            file.vector(self.outwards(&point.place));
            let mut measured = facts.datum_measured.iter();
            match measured.find(|(name, _)| *name == point.name) {
                Some((_, name)) => file.text("point", Some(name)),
                None => file.entry("sensor_mm", self.outwards(&point.seen)),
            }
            file.optional("sigma_mm", point.sigma);
        }
        for target in &facts.targets {
            if target.name == ONLY_TARGET {
                file.section("[target]");
            } else {
                file.named("targets", &target.name);
            }
            file.vector(self.outwards(&target.place));
            file.entry("sigma_mm", <[f64; 3]>::from(target.sigma));
        }
        if let Some(tool) = &self.tool {
            file.section("[tool]");
            file.vector(self.outwards(tool));
        }
    }
}

/// The word for one of several values in a robot file.
fn word<T: PartialEq + Copy>(words: &[(&'static str, T)], own: T) -> &'static str {
    let mut words = words.iter();
    words
        .find(|(_, value)| *value == own)
        .map_or("", |(word, _)| word)
}

#[derive(Default)]
struct File {
    text: String,
    /// The heading of the section that starts with the next entry.
    heading: Option<String>,
}

impl File {
    /// Starts a section; it is omitted if no entry follows.
    fn section(&mut self, heading: impl Into<String>) {
        self.heading = Some(heading.into());
    }

    /// Starts a section below `kind`; its name may contain any characters.
    fn named(&mut self, kind: &str, name: &str) {
        self.section(format!("[{kind}.{}]", toml::Value::from(name)));
        self.begin();
    }

    fn begin(&mut self) {
        if let Some(heading) = self.heading.take() {
            let _ = writeln!(self.text, "\n{heading}");
        }
    }

    fn verbatim(&mut self, key: &str, value: impl Display) {
        self.begin();
        let _ = writeln!(self.text, "{key} = {value}");
    }

    /// `{:?}` of an `f64` is valid TOML and the shortest text that reads back as the same number. It is valid TOML for
    /// arrays and plain words, too.
    fn entry(&mut self, key: &str, value: impl Debug) {
        self.verbatim(key, format_args!("{value:?}"));
    }

    fn optional(&mut self, key: &str, value: Option<impl Debug>) {
        if let Some(value) = value {
            self.entry(key, value);
        }
    }

    fn text(&mut self, key: &str, text: Option<&String>) {
        if let Some(text) = text {
            self.verbatim(key, toml::Value::from(text.as_str()));
        }
    }

    fn vector(&mut self, vector: [f64; 3]) {
        for (key, value) in ["x_mm", "y_mm", "z_mm"].into_iter().zip(vector) {
            self.entry(key, value);
        }
    }
}
