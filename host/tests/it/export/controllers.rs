//! The kinematics of each controller, from its equations in its own conventions, with the parameters read from
//! the lines to paste.

use crate::export::klipper::Delta;
use crate::support::Point;
use std::collections::BTreeMap;

/// From a position in the controller's frame (mm) to the robot's joints (degrees, or mm of travel).
pub(crate) type Inverse = Box<dyn Fn(Point) -> Point>;

/// One arm as a controller computes it: degrees and mm.
#[derive(Clone, Copy)]
pub(crate) struct Arm {
    pub(crate) azimuth: f64,
    pub(crate) radius: f64,
    pub(crate) height: f64,
    pub(crate) upper: f64,
    pub(crate) lower: f64,
}

impl Arm {
    /// The angle of the upper arm above horizontal, degrees, elbow outwards:
    /// (x − R − U cos a)² + y² + (z − H − U sin a)² = L², x along the azimuth.
    pub(crate) fn above_horizontal(&self, at: Point) -> f64 {
        let (sin, cos) = self.azimuth.to_radians().sin_cos();
        let x = at[0] * cos + at[1] * sin - self.radius;
        let y = at[1] * cos - at[0] * sin;
        let z = at[2] - self.height;
        let distance = x.hypot(z);
        let sum = x * x + y * y + z * z + self.upper.powi(2) - self.lower.powi(2);
        let opening = (sum / (2.0 * self.upper * distance)).acos();
        let towards = z.atan2(x);
        let both = [towards + opening, towards - opening];
        let outwards = both.into_iter().max_by(|a, b| a.cos().total_cmp(&b.cos()));
        let angle = outwards.unwrap().to_degrees();
        assert!(angle.is_finite());
        (angle + 180.0).rem_euclid(360.0) - 180.0
    }
}

fn number(text: &str) -> f64 {
    text.trim().parse().unwrap_or_else(|_| panic!("{text}"))
}

/// The numbers of the lines that begin with a name and a separator.
pub(crate) fn all_named(lines: &str, name: &str, separator: &str) -> Vec<f64> {
    let own = |line: &str| {
        let value = line
            .trim_start()
            .strip_prefix(name)?
            .strip_prefix(separator)?;
        let first = value.split_whitespace().next().unwrap();
        Some(number(first.trim_end_matches(';')))
    };
    lines.lines().filter_map(own).collect()
}

fn named(lines: &str, name: &str, separator: &str) -> f64 {
    let found = all_named(lines, name, separator);
    assert_eq!(found.len(), 1, "{name}");
    found[0]
}

/// The words of a line of G-code, each a letter with its numbers.
fn words(lines: &str, command: &str) -> BTreeMap<char, Vec<f64>> {
    let line = lines.lines().find(|line| line.starts_with(command));
    let words = line.unwrap().split_whitespace().skip(1);
    let word = |word: &str| {
        let values = word[1..].split(':').map(number).collect();
        (word.chars().next().unwrap(), values)
    };
    words.map(word).collect()
}

/// With towers: the printer that a controller takes its lines for.
pub(crate) fn towers(target: &str, lines: &str) -> Delta {
    let step_lengths = [1.0; 3];
    if target == "klipper" {
        return Delta::pasted(lines, step_lengths);
    }
    let (m665, m666) = (words(lines, "M665"), words(lines, "M666"));
    let height = m665[&'H'][0];
    let axes = ['X', 'Y', 'Z'];
    let stops = axes.map(|axis| m666[&axis][0]);
    let (arms, endstops) = if target == "reprapfirmware" {
        // Each end stop is higher by M666.
        assert!((stops.iter().sum::<f64>()).abs() < 2e-4);
        let arms = [0, 1, 2].map(|k| m665[&'L'][k]);
        (arms, stops.map(|by| height + by))
    } else {
        // Marlin moves each carriage by M666 after its end stop, never upwards, and is then at H.
        assert!(stops.iter().all(|by| *by <= 0.0) && !m665.contains_key(&'S'));
        let arms = ['A', 'B', 'C'].map(|rod| m665[&'L'][0] + m665[&rod][0]);
        (arms, stops.map(|by| height - by))
    };
    Delta {
        radius: m665[&'R'][0],
        angles: [0, 1, 2].map(|k| [210.0, 330.0, 90.0][k] + m665[&axes[k]][0]),
        arms,
        endstops,
        step_lengths,
    }
}

/// The separator and the names of f, e, rf and re, and of the angle of all arms at their end stops, positive downwards; CODESYS has
/// radii in place of sides.
const FOUR_LENGTHS: &str = "
    smoothieware ⇒ _   ⇒ delta_f ⇒ delta_e ⇒ delta_rf ⇒ delta_re
    fluidnc      ⇒ :_  ⇒ base_triangle_mm ⇒ end_effector_triangle_mm ⇒ crank_mm ⇒ linkage_mm ⇒ up_degrees
    grblhal      ⇒ =   ⇒ $643 ⇒ $644 ⇒ $642 ⇒ $641 ⇒ $646
    ucnc         ⇒ _=_ ⇒ delta_base_radius ⇒ delta_effector_radius ⇒ delta_bicep_length ⇒ delta_forearm_length
    delta-x      ⇒ _   ⇒ #define DEFAULT_RD_F ⇒ #define DEFAULT_RD_E ⇒ #define DEFAULT_RD_RF ⇒ #define DEFAULT_RD_RE
    codesys      ⇒ _:=_ ⇒ dArm1Radius ⇒ dStewartRadius ⇒ dArmLength1 ⇒ dArmLength2
    ";

/// The arms, and the robot's joint angle with each upper arm horizontal.
pub(crate) fn arms(target: &str, lines: &str, home: Point) -> ([Arm; 3], Point) {
    match target {
        // The height of an arm's end stop on the z axis; steps count from there, angles are positive upwards.
        "klipper" => {
            let sections = lines.lines().filter(|line| line.starts_with('['));
            assert!(sections.eq(["[printer]", "[stepper_a]", "[stepper_b]", "[stepper_c]"]));
            assert!(lines.contains("kinematics: rotary_delta"));
            let of = |key: &str| all_named(lines, key, ": ");
            let arms = [0, 1, 2].map(|k| Arm {
                azimuth: of("angle")[k],
                radius: of("shoulder_radius")[0],
                height: of("shoulder_height")[0],
                upper: of("upper_arm_length")[k],
                lower: of("lower_arm_length")[k],
            });
            let refused = arms
                .iter()
                .any(|arm| arm.height <= 0.0 || arm.radius <= 0.0);
            assert!(!refused, "Klipper refuses this");
            let endstop = |k: usize| [0.0, 0.0, of("position_endstop")[k]];
            let high = [0, 1, 2].map(|k| arms[k].above_horizontal(endstop(k)));
            (arms, [0, 1, 2].map(|k| home[k] + high[k]))
        }
        // The arm is at the upper limit of A, corrected by M666, at its end stop; angles are positive upwards.
        "reprapfirmware" => {
            let (m669, m666) = (words(lines, "M669"), words(lines, "M666"));
            assert_eq!(m669[&'K'], [10.0]);
            let axes = [('X', -150.0), ('Y', -30.0), ('Z', 90.0)];
            let arms = [0, 1, 2].map(|k| Arm {
                azimuth: axes[k].1 + m669[&axes[k].0][0],
                radius: m669[&'R'][0],
                height: m669[&'H'][k],
                upper: m669[&'U'][k],
                lower: m669[&'L'][k],
            });
            let high = axes.map(|(axis, _)| m669[&'A'][1] + m666[&axis][0]);
            (arms, [0, 1, 2].map(|k| home[k] + high[k]))
        }
        // Everything for each arm but side and tilt.
        "b-and-r" => {
            let of = |key: &str, arm: usize| {
                let key = key.replace('#', &arm.to_string());
                named(lines, &key, " = ")
            };
            let arms = [1, 2, 3].map(|k| Arm {
                azimuth: of("BasePlatform.Arm#LinkPoint.Angle", k),
                radius: of("BasePlatform.Arm#LinkPoint.Radius", k)
                    - of("EndEffectorPlatform.Arm#LinkPoint.Radius", k),
                height: of("BasePlatform.Arm#LinkPoint.Z", k),
                upper: of("Arms.Arm#.UpperArmLength", k),
                lower: of("Arms.Arm#.LowerArmLength", k),
            });
            (arms, [1, 2, 3].map(|k| of("Offsets.JointAxis[#]", k)))
        }
        // Joint 0 at −y, joint 1 at −x, joint 2 at +x: counter-clockwise, joint 0 is followed by joint 2.
        "linuxcnc" => {
            let pin = |name: &str| named(lines, &format!("setp rotarydeltakins.{name}"), " ");
            let offsets = all_named(lines, "HOME_OFFSET", " = ");
            let joints = [(0, -90.0), (2, 30.0), (1, 150.0)];
            let arms = joints.map(|(_, azimuth)| Arm {
                azimuth,
                radius: pin("platformradius") - pin("footradius"),
                height: 0.0,
                upper: pin("thighlength"),
                lower: pin("shinlength"),
            });
            (arms, [0, 1, 2].map(|k| home[k] - offsets[joints[k].0]))
        }
        _ => {
            let mut table = FOUR_LENGTHS.lines().map(str::trim);
            let row = table.find(|row| row.starts_with(target)).unwrap();
            let cells: Vec<_> = row.split('⇒').skip(1).map(str::trim).collect();
            let separator = &cells[0].replace('_', " ");
            let [f, e, upper, lower] = [1, 2, 3, 4].map(|k| named(lines, cells[k], separator));
            // The circle in a triangle of these sides.
            let part = match target {
                "codesys" => 1.0,
                _ => 30f64.to_radians().tan() / 2.0,
            };
            let (mut height, mut zeros) = (0.0, [0.0; 3]);
            if target == "smoothieware" {
                let value = |name: &str| named(lines, name, separator);
                height = value("delta_z_offset") - value("tool_offset") - value("delta_ee_offs");
                let m206 = words(lines, "M206");
                zeros = ['X', 'Y', 'Z'].map(|axis| -m206[&axis][0]);
            }
            if let Some(angle) = cells.get(5) {
                zeros = home.map(|own| own - named(lines, angle, separator));
            }
            let arms = [-90.0, 30.0, 150.0].map(|azimuth| Arm {
                azimuth,
                radius: (f - e) * part,
                height,
                upper,
                lower,
            });
            (arms, zeros)
        }
    }
}

/// The controllers of robots with rotary arms, and those of robots with towers.
pub(crate) const ROTARY: [&str; 10] = [
    "klipper",
    "reprapfirmware",
    "b-and-r",
    "linuxcnc",
    "smoothieware",
    "fluidnc",
    "grblhal",
    "ucnc",
    "delta-x",
    "codesys",
];
pub(crate) const LINEAR: [&str; 3] = ["klipper", "reprapfirmware", "marlin"];

/// The kinematics of the lines to paste and of the joints at the end stops.
pub(crate) fn kinematics(target: &str, lines: &str, home: Point) -> Inverse {
    if lines.contains("delta_radius") || lines.contains("M665") {
        let printer = towers(target, lines);
        return Box::new(move |at| {
            let steps = printer.steps(at);
            [0, 1, 2].map(|k| home[k] - steps[k])
        });
    }
    let (arms, horizontal) = arms(target, lines, home);
    Box::new(move |at| [0, 1, 2].map(|k| horizontal[k] - arms[k].above_horizontal(at)))
}
