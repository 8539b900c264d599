//! The robot file: geometry, joint limits, what is known of tolerance and noise, and which robot it is.

mod read;
mod section;
mod write;

use super::convention::Convention;
use crate::geometry::{LIMIT_MARGIN, Reach, outside_limits};
use crate::text::joint;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Drive, TransmissionTolerance};
use delta_cal::{Noise, Parameter, Robot, Tolerance};
use nalgebra::Vector3;

/// The key of a parameter in an arm's section.
const fn arm_key(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Dx => "dx_mm",
        Parameter::Dy => "dy_mm",
        Parameter::Dz | Parameter::Zero => "dz_mm",
        Parameter::Theta => "theta_deg",
        Parameter::Alpha => "alpha_deg",
        Parameter::LaX => "la_x_mm",
        Parameter::LaY => "la_y_mm",
        Parameter::Lb => "lb_mm",
        Parameter::LeanX => "lean_x_deg",
        Parameter::LeanY => "lean_y_deg",
        Parameter::Scale => "scale",
    }
}

/// The keys of a transmission's numbers in an arm's section.
const TRANSMISSION_KEYS: [&str; 5] = [
    "transmission_gain",
    "transmission_cos_deg",
    "transmission_sin_deg",
    "transmission_cos2_deg",
    "transmission_sin2_deg",
];

/// What a robot file says. [`template`](Self::template) shows every key with its meaning.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFile {
    /// The file's name, for messages.
    pub name: String,
    /// How its controller counts joints and where its axes point; everything below is in radians, mm and the axes inside.
    pub convention: Convention,
    /// Its geometry; lengths in millimetres.
    pub robot: Robot<f64>,
    /// The range of every joint.
    pub limits: JointLimits<f64>,
    /// The largest angle of a forearm out of its arm's plane that the ball joints allow, radians;
    /// `None` for any.
    pub forearm_limit: Option<f64>,
    /// The manufacturing tolerance, if stated.
    pub tolerance: Option<Tolerance<f64>>,
    /// What is known of the joints' transmissions, if they are to be found as well.
    pub transmission: Option<TransmissionTolerance<f64>>,
    /// The measurement noise, if stated.
    pub noise: Option<Noise<f64>>,
    /// From the robot's frame to the sensor's, if an earlier calibration found it.
    pub sensor_frame: Option<RigidTransform<f64>>,
    /// The radius of the platform, mm, if it is known: the parameters hold only what the base's exceeds it by.
    pub platform_radius: Option<f64>,
    /// What is known of other instruments.
    pub instruments: InstrumentFacts,
    /// Which robot it is, and how it was measured.
    pub record: Record,
}

impl RobotFile {
    /// Of a geometry (mm) of which nothing else is stated.
    pub fn of(name: impl Into<String>, robot: Robot<f64>, limits: JointLimits<f64>) -> Self {
        Self {
            name: name.into(),
            convention: Convention::usual(robot.drive()),
            robot,
            limits,
            forearm_limit: None,
            tolerance: None,
            transmission: None,
            noise: None,
            sensor_frame: None,
            platform_radius: None,
            instruments: InstrumentFacts::default(),
            record: Record::default(),
        }
    }

    /// A robot file to edit: every key with a comment.
    pub const fn template(drive: Drive) -> &'static str {
        match drive {
            Drive::Rotary => include_str!("robot_file/rotary.toml"),
            Drive::Linear => include_str!("robot_file/linear.toml"),
        }
    }

    /// How to say that a joint is further outside the limits than encoder zeros differ; `None` if it is not.
    pub(crate) fn outside_limits(&self, joint: f64) -> Option<String> {
        let drive = self.limits.drive();
        let what = match drive {
            Drive::Rotary => "joint limits",
            Drive::Linear => "limits of the travel",
        };
        outside_limits(joint, &self.limits).then(|| {
            let (low, high) = self.convention.limits(self.limits.minimum(), self.limits.maximum());
            let [low, high] = [low, high].map(|limit| joint::in_file(drive, limit));
            format!(
                "{:.3}{mark} is more than {LIMIT_MARGIN}{mark} outside the {what} of {low}{mark} to {high}{mark}",
                self.convention.degrees(joint),
                mark = joint::mark(drive),
            )
        })
    }

    /// With every stated noise of readings so many times larger.
    pub(crate) fn loosened(&self, factor: f64) -> Self {
        let mut loose = self.clone();
        loose.noise = self.noise.and_then(|noise| {
            let axes = noise.position_by_axis().map(|own| factor * own);
            Noise::by_axis(axes, noise.joint()).ok()
        });
        let facts = &mut loose.instruments;
        for own in [&mut facts.height_noise, &mut facts.distance_noise] {
            *own = own.map(|sigma| factor * sigma);
        }
        loose
    }

    /// Which poses the robot may take.
    pub const fn reach(&self) -> Reach {
        Reach {
            limits: self.limits,
            forearm_limit: self.forearm_limit,
        }
    }
}

/// How good a reading is that is no position, and what is known of where instruments stand.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InstrumentFacts {
    /// One σ of a height, mm.
    pub height_noise: Option<f64>,
    /// One σ of a distance, mm.
    pub distance_noise: Option<f64>,
    /// One σ of a joint angle, radians, where the file states the noise of no position.
    pub joint_noise: Option<f64>,
    /// Planes of known height.
    pub planes: Vec<KnownPlane>,
    /// Points of which something is known.
    pub points: Vec<NamedPoint>,
    /// The shortest and the longest distance between two poses that can be measured, mm.
    pub lengths: Option<(f64, f64)>,
    /// Points of the machine that the sensor measured too, so that its coordinates are known in the machine's frame.
    pub datum: Vec<DatumPoint>,
    /// From the platform point to what is measured: a reflector, a tip. mm, in the robot's frame.
    pub target: Option<Vector3<f64>>,
}

/// A plane of known height.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownPlane {
    /// As the samples file names it.
    pub name: String,
    /// The line of its section.
    pub line: u64,
    /// Where it crosses the z axis, mm.
    pub height: f64,
    /// One σ of that, mm.
    pub sigma: f64,
    /// One σ of its tilt about x and about y, radians, if it is known to be nearly level.
    pub tilt: Option<f64>,
    /// The gauge blocks that heights are measured on, mm, 0 being the bare plane; empty if not stated.
    pub blocks: Vec<f64>,
}

/// A point of the machine's frame, and where the sensor saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct DatumPoint {
    /// Its name.
    pub name: String,
    /// Where it is in the frame of the robot's base, mm.
    pub place: Vector3<f64>,
    /// Where the sensor saw it, mm in the sensor's frame.
    pub seen: Vector3<f64>,
}

/// A point that distances begin at.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPoint {
    /// As the samples file names it.
    pub name: String,
    /// The line of its section.
    pub line: u64,
    /// Where it is and one σ of each coordinate, if that is known: mm.
    pub place: Option<(Vector3<f64>, f64)>,
    /// Whether its sensor reads a constant too much that is not known.
    pub offset_unknown: bool,
    /// The shortest and the longest distance that can be measured from it, mm.
    pub lengths: Option<(f64, f64)>,
}

/// What identifies a robot and its measurement, for reports: nothing is computed from it. `None` where the file does
/// not say it.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize)]
pub struct Record {
    /// The robot's name.
    #[serde(rename = "robot_name")]
    pub name: Option<String>,
    /// The robot's serial number.
    #[serde(rename = "robot_serial")]
    pub serial: Option<String>,
    /// Who measured.
    pub operator: Option<String>,
    /// With what.
    pub instrument: Option<String>,
    /// On which day.
    #[serde(rename = "measured_on")]
    pub date: Option<String>,
}

impl Record {
    /// All of them, each with its section and key in a robot file.
    fn entries(&mut self) -> [(&'static str, &'static str, &mut Option<String>); 5] {
        [
            ("robot", "name", &mut self.name),
            ("robot", "serial", &mut self.serial),
            ("measurement", "operator", &mut self.operator),
            ("measurement", "instrument", &mut self.instrument),
            ("measurement", "date", &mut self.date),
        ]
    }

    /// Without the measurement: that of a calibration is not that of what is measured afterwards.
    #[must_use]
    pub fn of_the_robot(&self) -> Self {
        Self {
            name: self.name.clone(),
            serial: self.serial.clone(),
            ..Self::default()
        }
    }
}
