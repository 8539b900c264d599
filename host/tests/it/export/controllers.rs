//! The kinematics of each controller, from its equations in its own conventions, with the parameters read from
//! the lines to paste.

use crate::support::Point;
use std::collections::BTreeMap;

/// From a position in the controller's frame (mm) to the robot's joint angles (degrees).
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

/// The lines that are no comments.
fn content<'a>(lines: &'a str, comment: &'a str) -> impl Iterator<Item = &'a str> {
    lines
        .lines()
        .filter(move |line| !line.starts_with(comment) && !line.is_empty())
}

/// Klipper: `position_endstop` is a height, steps count from there, angles are positive upwards.
fn klipper(lines: &str, home: Point) -> Inverse {
    let mut section = String::new();
    let mut values = BTreeMap::new();
    for line in content(lines, "#") {
        if let Some(name) = line.strip_prefix('[') {
            name.trim_end_matches(']').clone_into(&mut section);
        } else {
            let (key, value) = line.split_once(':').unwrap();
            values.insert(format!("{section} {key}"), value.trim().to_owned());
        }
    }
    assert_eq!(values["printer kinematics"], "rotary_delta");
    let arms = ["a", "b", "c"].map(|letter| {
        let of = |key: &str| number(&values[&format!("stepper_{letter} {key}")]);
        let arm = Arm {
            azimuth: of("angle"),
            radius: number(&values["printer shoulder_radius"]),
            height: number(&values["printer shoulder_height"]),
            upper: of("upper_arm_length"),
            lower: of("lower_arm_length"),
        };
        assert!(arm.height > 0.0 && arm.radius > 0.0, "Klipper refuses this");
        let at_endstop = arm.above_horizontal([0.0, 0.0, of("position_endstop")]);
        (arm, at_endstop)
    });
    Box::new(move |at| [0, 1, 2].map(|k| home[k] - (arms[k].0.above_horizontal(at) - arms[k].1)))
}

/// The words of a line of G-code, each a letter with its numbers.
pub(crate) fn words(lines: &str, command: &str) -> BTreeMap<char, Vec<f64>> {
    let line = lines.lines().find(|line| line.starts_with(command));
    let words = line.unwrap().split_whitespace().skip(1);
    let word = |word: &str| {
        let values = word[1..].split(':').map(number).collect();
        (word.chars().next().unwrap(), values)
    };
    words.map(word).collect()
}

/// RepRapFirmware: the arm is at the upper limit of A, corrected by M666, at its end stop.
fn reprapfirmware(lines: &str, home: Point) -> Inverse {
    let (m669, m666) = (words(lines, "M669"), words(lines, "M666"));
    assert_eq!(m669[&'K'], [10.0]);
    let nominal = [-150.0, -30.0, 90.0];
    let arms = [('X', 0), ('Y', 1), ('Z', 2)].map(|(axis, k)| {
        let arm = Arm {
            azimuth: nominal[k] + m669[&axis][0],
            radius: m669[&'R'][0],
            height: m669[&'H'][k],
            upper: m669[&'U'][k],
            lower: m669[&'L'][k],
        };
        (arm, m669[&'A'][1] + m666[&axis][0])
    });
    Box::new(move |at| [0, 1, 2].map(|k| home[k] - (arms[k].0.above_horizontal(at) - arms[k].1)))
}

/// B&R: everything for each arm but side and tilt; the joint angle is positive downwards.
fn b_and_r(lines: &str) -> Inverse {
    let values: BTreeMap<_, _> = content(lines, "#")
        .filter(|line| !line.starts_with("CountDirections"))
        .map(|line| {
            let (name, value) = line.split_once('=').unwrap();
            (
                name.trim(),
                number(value.split_whitespace().next().unwrap()),
            )
        })
        .collect();
    let arms = [1, 2, 3].map(|k| {
        let of = |key: &str| values[key.replace('#', &k.to_string()).as_str()];
        let arm = Arm {
            azimuth: of("BasePlatform.Arm#LinkPoint.Angle"),
            radius: of("BasePlatform.Arm#LinkPoint.Radius")
                - of("EndEffectorPlatform.Arm#LinkPoint.Radius"),
            height: of("BasePlatform.Arm#LinkPoint.Z"),
            upper: of("Arms.Arm#.UpperArmLength"),
            lower: of("Arms.Arm#.LowerArmLength"),
        };
        (arm, of("Offsets.JointAxis[#]"))
    });
    Box::new(move |at| [0, 1, 2].map(|k| arms[k].1 - arms[k].0.above_horizontal(at)))
}

/// LinuxCNC: joint 0 at −y, joint 1 at −x, joint 2 at +x; the knee is positive downwards.
fn linuxcnc(lines: &str, home: Point) -> Inverse {
    let pin = |name: &str| {
        let start = format!("setp rotarydeltakins.{name} ");
        number(lines.lines().find_map(|l| l.strip_prefix(&start)).unwrap())
    };
    let offsets: Vec<_> = lines
        .lines()
        .filter_map(|line| line.strip_prefix("HOME_OFFSET ="))
        .map(number)
        .collect();
    let arms = [-90.0, 150.0, 30.0].map(|azimuth| Arm {
        azimuth,
        radius: pin("platformradius") - pin("footradius"),
        height: 0.0,
        upper: pin("thighlength"),
        lower: pin("shinlength"),
    });
    // Counter-clockwise, joint 0 is followed by joint 2.
    let joint_of_arm = [0, 2, 1];
    Box::new(move |at| {
        [0, 1, 2].map(|arm| {
            let joint = joint_of_arm[arm];
            home[arm] + (-arms[joint].above_horizontal(at) - offsets[joint])
        })
    })
}

/// f, e, rf, re: triangles with these sides; the angle is positive downwards.
fn four([f, e, upper, lower]: [f64; 4], height: f64, zeros: Point) -> Inverse {
    let arms = [-90.0, 30.0, 150.0].map(|azimuth| Arm {
        azimuth,
        radius: (f - e) * 30f64.to_radians().tan() / 2.0,
        height,
        upper,
        lower,
    });
    Box::new(move |at| [0, 1, 2].map(|k| -arms[k].above_horizontal(at) - zeros[k]))
}

/// The number that the separator separates from a name.
fn named(lines: &str, name: &str, separator: &str) -> f64 {
    let own = |line: &str| Some(line.strip_prefix(name)?.strip_prefix(separator)?.to_owned());
    let mut lines = lines.lines().map(str::trim_start);
    let value = lines.find_map(own).unwrap_or_else(|| panic!("{name}"));
    number(value.trim_end_matches("; // mm"))
}

fn smoothieware(lines: &str) -> Inverse {
    let value = |name: &str| named(lines, name, " ");
    let command = lines.lines().find(|line| line.starts_with("M206")).unwrap();
    let words: Vec<_> = command.split_whitespace().skip(1).collect();
    let zeros = [0, 1, 2].map(|k| number(&words[k][1..]));
    let height = value("delta_z_offset") - value("tool_offset") - value("delta_ee_offs");
    let lengths = ["delta_f", "delta_e", "delta_rf", "delta_re"].map(value);
    four(lengths, height, zeros)
}

/// Every controller.
pub(crate) const ALL: [&str; 10] = [
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

/// The kinematics of the lines to paste and of the end stops' joint angles.
pub(crate) fn kinematics(target: &str, lines: &str, home: Point) -> Inverse {
    let (separator, names) = match target {
        "klipper" => return klipper(lines, home),
        "reprapfirmware" => return reprapfirmware(lines, home),
        "b-and-r" => return b_and_r(lines),
        "linuxcnc" => return linuxcnc(lines, home),
        "smoothieware" => return smoothieware(lines),
        "fluidnc" => (
            ": ",
            "base_triangle_mm,end_effector_triangle_mm,crank_mm,linkage_mm",
        ),
        "grblhal" => (
            " = ",
            "Base radius,End effector radius,Bicep length,Forearm length",
        ),
        "ucnc" => (
            " = ",
            "delta_base_radius,delta_effector_radius,delta_bicep_length,delta_forearm_length",
        ),
        "delta-x" => (
            " ",
            "#define DEFAULT_RD_F,#define DEFAULT_RD_E,#define DEFAULT_RD_RF,#define DEFAULT_RD_RE",
        ),
        _ => (" := ", "dArm1Radius,dStewartRadius,dArmLength1,dArmLength2"),
    };
    let mut lengths = [0.0; 4];
    for (length, name) in lengths.iter_mut().zip(names.split(',')) {
        *length = named(lines, name, separator);
    }
    if target == "codesys" {
        // Radii of the circles in the triangles.
        lengths[0] *= 2.0 * 3f64.sqrt();
        lengths[1] *= 2.0 * 3f64.sqrt();
    }
    four(lengths, 0.0, [0.0; 3])
}
