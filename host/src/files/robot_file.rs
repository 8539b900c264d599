//! The robot file: geometry, joint limits, tolerance and noise if known, and the robot's identity.

mod read;
mod section;
mod write;

use super::convention::Convention;
use crate::geometry::{LIMIT_MARGIN, Parallelograms, PlatformPose, Reach, Region, outside_limits};
use crate::text::joint;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::{JointLimits, KinematicsError};
use delta_cal::robot::{Drive, TransmissionTolerance};
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Tolerance};
use nalgebra::Vector3;
use serde::Serialize;

/// Kinds of readings, each with its own noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A coordinate: x, y or z.
    Position,
    /// A height above a plane.
    Height,
    /// A distance from a point or between two poses.
    Distance,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Position, Self::Height, Self::Distance];

    /// The kind of the reading at an index in a row.
    pub const fn of_place(place: usize) -> Self {
        match place {
            0..3 => Self::Position,
            3 => Self::Height,
            _ => Self::Distance,
        }
    }

    /// Its key in the `[noise]` section.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Position => "position_mm",
            Self::Height => "height_mm",
            Self::Distance => "distance_mm",
        }
    }

    /// "coordinates", "heights", "distances".
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Position => "coordinates",
            Self::Height => "heights",
            Self::Distance => "distances",
        }
    }
}

/// The target's name if the samples name none: that of the section `[target]`.
pub(crate) const ONLY_TARGET: &str = "target";

/// Most steps of the platform towards where it has its tool; four are usual.
const STEPS: u32 = 50;
/// The tool is there, mm.
const THERE: f64 = 1e-9;

/// The keys of transmission errors in an `[[arm]]` section.
pub(crate) const TRANSMISSION_KEYS: [&str; 5] = [
    "transmission_gain",
    "transmission_cos_deg",
    "transmission_sin_deg",
    "transmission_cos2_deg",
    "transmission_sin2_deg",
];

/// The keys of an arm's rods in an `[[arm]]` section.
const ROD_KEYS: [&str; 4] = [
    "rod_difference_mm",
    "spacing_difference_mm",
    "axis_yaw_deg",
    "axis_roll_deg",
];

/// The content of a robot file. [`template`](Self::template) explains every key.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFile {
    /// Name of the file, for messages.
    pub name: String,
    /// The controller's conventions; all fields below are in radians, mm and internal axes.
    pub convention: Convention,
    /// The geometry; lengths in millimetres.
    pub robot: Robot<f64>,
    /// The range of all joints.
    pub limits: JointLimits<f64>,
    /// The largest angle of a forearm out of its arm's plane that the ball joints allow, radians; `None` if unlimited.
    pub forearm_limit: Option<f64>,
    /// Where the robot works, if stated: what is said of the workspace is said of this.
    pub within: Option<Region>,
    /// The manufacturing tolerance, if stated.
    pub tolerance: Option<Tolerance<f64>>,
    /// The tolerance of the joints' transmissions, if these are estimated as well.
    pub transmission: Option<TransmissionTolerance<f64>>,
    /// The measurement noise, if stated.
    pub noise: Option<Noise<f64>>,
    /// The transform from the robot's frame to the sensor's, if an earlier calibration found it.
    pub sensor_frame: Option<RigidTransform<f64>>,
    /// The platform radius, mm, if known: the parameters hold only the difference between base and platform radius.
    pub platform_radius: Option<f64>,
    /// The two rods of each arm, if their spacing is known; without, the platform does not tilt.
    pub parallelograms: Option<Parallelograms>,
    /// The point of the platform for which errors are stated, if it is not the platform point, mm.
    pub tool: Option<Vector3<f64>>,
    /// Noise and positions of other instruments.
    pub instruments: InstrumentFacts,
    /// The robot's identity and how it was measured.
    pub record: Record,
}

impl RobotFile {
    /// A robot file with this geometry (mm) and nothing else.
    pub fn of(name: impl Into<String>, robot: Robot<f64>, limits: JointLimits<f64>) -> Self {
        Self {
            name: name.into(),
            convention: Convention::usual(robot.drive()),
            robot,
            limits,
            forearm_limit: None,
            within: None,
            tolerance: None,
            transmission: None,
            noise: None,
            sensor_frame: None,
            platform_radius: None,
            parallelograms: None,
            tool: None,
            instruments: InstrumentFacts::default(),
            record: Record::default(),
        }
    }

    /// A robot file to edit, with a comment on every key.
    pub const fn template(drive: Drive) -> &'static str {
        match drive {
            Drive::Rotary => include_str!("robot_file/rotary.toml"),
            Drive::Linear => include_str!("robot_file/linear.toml"),
        }
    }

    /// Describes a joint that is outside the limits by more than encoder zeros vary; `None` if it is not.
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

    /// The same with another geometry.
    pub(crate) fn with_robot(&self, robot: &Robot<f64>) -> Self {
        Self {
            robot: robot.clone(),
            ..self.clone()
        }
    }

    /// The same with another tolerance.
    pub fn with_tolerance(&self, tolerance: Option<Tolerance<f64>>) -> Self {
        Self {
            tolerance,
            ..self.clone()
        }
    }

    /// The σ stated of a single parameter.
    pub(crate) fn single(&self, parameter: Parameter) -> Option<f64> {
        self.tolerance.and_then(|own| own.single(parameter))
    }

    /// A copy with the stated noise multiplied by `factor`.
    pub(crate) fn with_noise_times(&self, factor: f64) -> Self {
        let mut loose = self.clone();
        loose.noise = self.noise.and_then(|noise| {
            let axes = noise.position_by_axis().map(|own| factor * own);
            Noise::by_axis(axes, factor * noise.joint()).ok()
        });
        let facts = &mut loose.instruments;
        for own in [
            &mut facts.height_noise,
            &mut facts.distance_noise,
            &mut facts.joint_noise,
        ] {
            *own = own.map(|sigma| factor * sigma);
        }
        loose
    }

    /// A copy with these σ of all readings.
    pub(crate) fn with_noise(&self, position: Noise<f64>, height: f64, distance: f64) -> Self {
        let mut stated = self.clone();
        stated.noise = Some(position);
        stated.instruments.height_noise = Some(height);
        stated.instruments.distance_noise = Some(distance);
        stated
    }

    /// A copy for readings of the platform point: planes and points are where it meets them.
    pub(crate) fn at_platform_point(&self) -> Self {
        let mut own = self.clone();
        let target = self.instruments.target_place();
        let facts = &mut own.instruments;
        facts.targets.clear();
        for plane in &mut facts.planes {
            plane.height -= target.z;
        }
        for (place, _) in facts.points.iter_mut().filter_map(|own| own.place.as_mut()) {
            *place -= target;
        }
        own
    }

    /// The stated σ of a kind of reading, mm; of coordinates the rms over the axes.
    pub(crate) fn sigma(&self, kind: Kind) -> Option<f64> {
        match kind {
            Kind::Position => self.noise.map(|own| own.position()),
            Kind::Height => self.instruments.height_noise,
            Kind::Distance => self.instruments.distance_noise,
        }
    }

    /// The stated noise of the joints, radians or mm.
    pub(crate) fn joint_noise(&self) -> Option<f64> {
        let beside = self.noise.map(|own| own.joint());
        beside.or(self.instruments.joint_noise)
    }

    /// The point of the platform for which errors are stated.
    pub fn tool(&self) -> Tool {
        Tool {
            place: self.tool.unwrap_or_default(),
            parallelograms: self.parallelograms,
        }
    }

    /// The platform point.
    pub fn platform_point(&self) -> Tool {
        Tool {
            parallelograms: self.parallelograms,
            ..Tool::default()
        }
    }

    /// The limits on poses.
    pub const fn reach(&self) -> Reach {
        Reach {
            limits: self.limits,
            forearm_limit: self.forearm_limit,
            within: self.within,
        }
    }
}

/// A point of a platform that may tilt.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tool {
    /// From the platform point to it, mm.
    pub place: Vector3<f64>,
    /// The rods that hold the platform; `None` if they are parallelograms.
    pub parallelograms: Option<Parallelograms>,
}

impl Tool {
    /// Its position with a robot at these joints (radians or mm), mm.
    ///
    /// # Errors
    /// Those of [`Parallelograms::pose`].
    pub fn position(
        &self,
        robot: &Robot<f64>,
        joints: &[f64; 3],
    ) -> Result<Vector3<f64>, KinematicsError> {
        let pose = match &self.parallelograms {
            Some(rods) => rods.pose(robot, joints)?,
            None => PlatformPose::level(robot.forward(joints)?),
        };
        Ok(pose.of(&self.place))
    }

    /// The joints (radians or mm), elbows out, that bring it to a position, mm, and where Model 24 has the platform point
    /// there.
    ///
    /// # Errors
    /// No joints do, or nothing holds the platform's rotation there.
    pub fn joints(
        &self,
        robot: &Robot<f64>,
        wanted: &Vector3<f64>,
    ) -> Result<([f64; 3], Vector3<f64>), KinematicsError> {
        let mut platform = wanted - self.place;
        let mut joints = robot.inverse(&platform)?;
        if self.parallelograms.is_none_or(|own| own.are_exact()) {
            return Ok((joints, platform));
        }
        // The tilt changes so little from place to place that a few steps bring the tool where it is wanted.
        for _ in 0..STEPS {
            let off = wanted - self.position(robot, &joints)?;
            if off.norm() < THERE {
                return Ok((joints, platform));
            }
            platform += off;
            joints = robot.inverse(&platform)?;
        }
        Err(KinematicsError::Parallel(ArmIndex::First))
    }
}

pub(crate) type Tooled<'a> = (&'a Robot<f64>, &'a Tool);

/// The tolerance with every σ multiplied by `factor`.
pub(crate) fn scaled(tolerance: &Tolerance<f64>, factor: f64) -> Option<Tolerance<f64>> {
    let kinds = Tolerance::new(factor * tolerance.length(), factor * tolerance.angle());
    let radius = kinds.and_then(|own| own.with_radius(factor * tolerance.radius()));
    let forearm = radius.and_then(|own| own.with_forearm(factor * tolerance.forearm()));
    let mut own = forearm.ok()?;
    for parameter in Parameter::ROTARY {
        if let Some(sigma) = tolerance.single(parameter) {
            own = own.with(parameter, factor * sigma).ok()?;
        }
    }
    match tolerance.joint_zero() {
        Some(zero) => own.with_joint_zero(factor * zero).ok(),
        None => Some(own),
    }
}

/// The noise of readings other than positions, and the known positions of instruments.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InstrumentFacts {
    /// Standard uncertainty of a height, mm.
    pub height_noise: Option<f64>,
    /// Standard uncertainty of a distance, mm.
    pub distance_noise: Option<f64>,
    /// Standard uncertainty of each component of a rotation vector, radians.
    pub orientation_noise: Option<f64>,
    /// Standard uncertainty of a relative error common to all distances between two poses, such as a print's shrinkage.
    pub distance_scale: Option<f64>,
    /// Standard uncertainty of a joint angle, radians, if the file states no noise of positions.
    pub joint_noise: Option<f64>,
    /// Planes of known height.
    pub planes: Vec<KnownPlane>,
    /// Points about which something is known.
    pub points: Vec<NamedPoint>,
    /// The shortest and longest measurable distance between two poses, mm.
    pub lengths: Option<(f64, f64)>,
    /// Points of the machine that the sensor measured as well, which locate the sensor in the machine's frame.
    pub datum: Vec<DatumPoint>,
    /// Datum points that the file of the measurements holds, each with its name there; until it is read, they count as seen in
    /// the frame of the base.
    pub datum_measured: Vec<(String, String)>,
    /// Reflectors and tips.
    pub targets: Vec<Target>,
    /// Standard uncertainty of an error common to all distances between two poses, mm, such as the oversize of prints.
    pub oversize: Option<f64>,
    /// What touched surfaces are uneven by, rms, mm; smooth, and flat if it is not stated. Where the noise of heights is
    /// estimated, so is this, in proportion.
    pub bed: Option<f64>,
    /// Relative standard uncertainty of the instrument's scale and of the robot's expansion together, if stated.
    pub scale: Option<f64>,
    /// The expected absolute and relative position error of a calibrated robot, σ, mm.
    pub expected: Option<[f64; 2]>,
    /// The relative excess of all lengths because the robot was not measured at 20 °C.
    pub expansion: f64,
}

/// A point on the platform that is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Its name in the samples file.
    pub name: String,
    /// From the platform point to it, mm, in the robot's frame.
    pub place: Vector3<f64>,
    /// Standard uncertainty of each coordinate, mm.
    pub sigma: Vector3<f64>,
}

/// σ of a scale if none is stated.
const USUAL_SCALE: f64 = 1e-5;

impl InstrumentFacts {
    pub(crate) fn target(&self, name: &str) -> Option<&Target> {
        self.targets.iter().find(|own| own.name == name)
    }

    /// Whether a row of this name is a datum point.
    pub(crate) fn is_datum(&self, name: &str) -> bool {
        let mut points = self.datum_measured.iter();
        points.any(|(_, own)| own == name)
    }

    /// σ of an instrument's scale and of a robot's expansion together.
    pub(crate) fn scale_sigma(&self) -> f64 {
        self.scale.unwrap_or(USUAL_SCALE)
    }

    pub(crate) fn plane(&self, name: &str) -> Option<&KnownPlane> {
        self.planes.iter().find(|own| own.name == name)
    }

    pub(crate) fn point(&self, name: &str) -> Option<&NamedPoint> {
        self.points.iter().find(|own| own.name == name)
    }

    /// Where the target of rows that name none is, mm; at the platform point if none is stated.
    pub fn target_place(&self) -> Vector3<f64> {
        let own = self.target(ONLY_TARGET);
        own.map_or_else(Vector3::zeros, |own| own.place)
    }
}

/// A plane of known height.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownPlane {
    /// Its name in the samples file.
    pub name: String,
    /// The line of its section.
    pub line: u64,
    /// Where it crosses the z axis, mm.
    pub height: f64,
    /// Standard uncertainty of that height, mm.
    pub sigma: f64,
    /// Standard uncertainty of its tilt about x and about y, radians, if it is known to be nearly level.
    pub tilt: Option<f64>,
    /// The gauge blocks on which heights are measured, mm; 0 is the bare plane. Empty if not stated.
    pub blocks: Vec<f64>,
}

/// A point known in the machine's frame and measured by the sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct DatumPoint {
    /// Its name.
    pub name: String,
    /// Its position in the base frame, mm.
    pub place: Vector3<f64>,
    /// Its position as measured by the sensor, mm, in the sensor's frame.
    pub seen: Vector3<f64>,
    /// Standard uncertainty of each coordinate of its place, mm, if stated.
    pub sigma: Option<f64>,
}

/// A point from which distances are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPoint {
    /// Its name in the samples file.
    pub name: String,
    /// The line of its section.
    pub line: u64,
    /// Its position and the standard uncertainty of each coordinate, mm, if known.
    pub place: Option<(Vector3<f64>, f64)>,
    /// Whether its sensor has an unknown constant offset.
    pub offset_unknown: bool,
    /// The shortest and longest measurable distance from it, mm.
    pub lengths: Option<(f64, f64)>,
}

/// The keys of `[measurement]` that are for reports only, each with its name there, in the order of a certificate.
pub(crate) const MEASUREMENT: [(&str, &str); 15] = [
    ("number", "Certificate number"),
    ("customer", "Customer"),
    ("place", "Place"),
    ("date", "Measured on"),
    ("operator", "Operator"),
    ("instrument", "Instrument"),
    ("instrument_serial", "Instrument, serial number"),
    ("instrument_certificate", "Instrument, certificate"),
    ("instrument_due", "Instrument, calibration due"),
    ("air_temperature_c", "Air temperature, °C"),
    ("load_kg", "Load, kg"),
    ("speed", "Speed"),
    ("approach", "Direction of approach"),
    ("warm_up", "Warm-up"),
    ("remarks", "Remarks"),
];

/// Identification of a robot and its measurement, for reports only. `None` where the file states nothing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Record {
    /// The robot's name.
    pub name: Option<String>,
    /// The robot's serial number.
    pub serial: Option<String>,
    /// How it was measured: keys of `[measurement]` and their values, in the order of a certificate.
    pub measurement: Vec<(&'static str, String)>,
}

impl Record {
    /// The value of a key of `[measurement]`.
    pub fn stated(&self, key: &str) -> Option<&str> {
        let mut all = self.measurement.iter();
        let (_, value) = all.find(|(own, _)| *own == key)?;
        Some(value)
    }

    /// Everything stated, each with its name on a certificate.
    pub(crate) fn entries(&self) -> Vec<(&'static str, String)> {
        let robot = [
            ("Robot", self.name.as_deref()),
            ("Robot, serial number", self.serial.as_deref()),
        ];
        let measurement = MEASUREMENT.map(|(key, name)| (name, self.stated(key)));
        let all = robot.into_iter().chain(measurement);
        all.filter_map(|(name, value)| Some((name, value?.to_owned())))
            .collect()
    }
}

/// `robot_name`, `robot_serial`, and each key of `[measurement]`.
impl serde::Serialize for Record {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("robot_name", &self.name)?;
        map.serialize_entry("robot_serial", &self.serial)?;
        for (key, _) in MEASUREMENT {
            let name = if key == "date" { "measured_on" } else { key };
            map.serialize_entry(name, &self.stated(key))?;
        }
        map.end()
    }
}
