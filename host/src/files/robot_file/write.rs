use super::RobotFile;
use super::schema::ARM_KEYS;
use crate::text::units::degrees;
use delta_cal::Parameter;
use delta_cal::robot::ParameterKind;
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
        for arm in self.robot.arms() {
            text.push_str("\n[[arm]]\n");
            for (key, parameter) in ARM_KEYS.into_iter().zip(Parameter::ALL) {
                let value = match parameter.kind() {
                    ParameterKind::Length => arm.get(parameter),
                    ParameterKind::Angle => degrees(arm.get(parameter)),
                };
                entry(&mut text, key, value);
            }
        }
        text.push_str("\n[joints]\n");
        entry(&mut text, "min_deg", degrees(self.limits.minimum()));
        entry(&mut text, "max_deg", degrees(self.limits.maximum()));
        if let Some(angle) = self.forearm_limit {
            entry(&mut text, "forearm_max_deg", degrees(angle));
        }
        if let Some(tolerance) = &self.tolerance {
            text.push_str("\n[tolerance]\n");
            entry(&mut text, "length_mm", tolerance.of(Parameter::Lb));
            let angle = degrees(tolerance.of(Parameter::Theta));
            entry(&mut text, "angle_deg", angle);
        }
        if let Some(noise) = &self.noise {
            text.push_str("\n[noise]\n");
            entry(&mut text, "position_mm", noise.position());
            entry(&mut text, "joint_deg", degrees(noise.joint()));
        }
        if let Some(frame) = &self.sensor_frame {
            text.push_str("\n# X_sensor = rotation * X_robot + translation\n[sensor_frame]\n");
            text.push_str("rotation = [\n");
            for row in frame.rotation.row_iter() {
                let _ = writeln!(text, "    [{:?}, {:?}, {:?}],", row[0], row[1], row[2]);
            }
            let [x, y, z] = frame.translation.data.0[0];
            let _ = writeln!(text, "]\ntranslation_mm = [{x:?}, {y:?}, {z:?}]");
        }
        text
    }
}

/// Rust's `{:?}` of an `f64` is the shortest text that reads back as the same number, and TOML.
fn entry(text: &mut String, key: &str, value: f64) {
    let _ = writeln!(text, "{key} = {value:?}");
}
