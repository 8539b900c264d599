//! The campaign file. Every combination of its lists is a case.

use crate::files::{InputError, InputText, RobotFile, Tool, example};
use crate::fit::Method;
use delta_cal::robot::{Arm, Drive};
use delta_cal::{Noise, Tolerance};
use serde::{Deserialize, Serialize};

const KEYS: &str = "`delta-cal simulate --example` prints a campaign file with every key; numbers have a decimal \
                    point";
const CASES_AT_MOST: usize = 100_000;

/// The algorithm that solves the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CampaignSolver {
    /// Levenberg–Marquardt.
    #[default]
    Lm,
    /// Gauss–Newton.
    Gn,
}

/// Distribution of the true robots about the nominal one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Spread {
    /// Every parameter uniform within ± the start error.
    #[default]
    Uniform,
    /// Every parameter normal, with the start error as σ.
    Normal,
}

/// The settings that identify a case: the first columns of the rows and of the summary. Lengths are in millimetres,
/// angles in degrees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Case {
    /// A fingerprint of the nominal robot and its joint limits.
    pub geometry: String,
    /// Distribution of the true parameters.
    pub spread: Spread,
    /// Measured poses per robot.
    pub poses: usize,
    /// Whether the poses were planned.
    pub planned: bool,
    /// Start error of every length.
    pub start_error_mm: f64,
    /// Start error of every angle.
    pub start_error_deg: f64,
    /// Start error of every rotary joint zero; if 0, `La_x` and `La_y` have the error of lengths instead.
    #[serde(default)]
    pub start_error_zero_deg: f64,
    /// Start error of the radius common to all towers.
    pub start_error_radius_mm: f64,
    /// Noise of each coordinate (σ).
    pub noise_position_mm: f64,
    /// Noise of each joint angle (σ).
    pub noise_joint_deg: f64,
    /// Noise of each joint travel (σ).
    pub noise_joint_mm: f64,
    /// The estimator.
    pub method: Method,
    /// The solver.
    pub solver: CampaignSolver,
    /// Whether the calibration knew the noise.
    pub weights: bool,
    /// Whether it knew the tolerance.
    pub prior: bool,
}

impl Case {
    /// The noise of the measurements; `None` for exact ones.
    pub(super) fn noise(&self) -> Option<Noise<f64>> {
        // A drive is either rotary or linear: one of the two is 0.
        let joint = self.noise_joint_deg.to_radians() + self.noise_joint_mm;
        Noise::new(self.noise_position_mm, joint).ok()
    }

    /// The tolerance that a calibration with a prior assumes: the start error, and of single parameters what the robot file
    /// states.
    pub(super) fn tolerance(&self, file: &RobotFile) -> Option<Tolerance<f64>> {
        let angle = self.start_error_deg.to_radians();
        let mut tolerance = Tolerance::new(self.start_error_mm, angle)
            .and_then(|own| own.with_radius(self.start_error_radius_mm))
            .ok()?;
        for parameter in file.robot.drive().parameters() {
            if let Some(own) = file.single(*parameter) {
                tolerance = tolerance.with(*parameter, own).ok()?;
            }
        }
        let zero = self.start_error_zero_deg.to_radians();
        if zero > 0.0 {
            tolerance.with_joint_zero(zero).ok()
        } else {
            Some(tolerance)
        }
    }
}

/// A campaign read from a file and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The nominal robot and its joint limits.
    pub robot: RobotFile,
    /// Number of robots per case unless a range is requested.
    pub robots: u64,
    /// Seed of all random robots.
    pub seed: u64,
    /// Cases that share their robots and measurements, and differ in the calibration. The first one stands for all.
    pub(super) scenarios: Vec<Vec<Case>>,
}

/// A hash of the nominal robot and its joint limits: 16 hexadecimal digits.
pub(super) fn fingerprint(file: &RobotFile) -> String {
    let parameters = file.robot.arms().iter().flat_map(Arm::parameters);
    let limits = [file.limits.minimum(), file.limits.maximum()];
    let values = parameters.chain(limits);
    // Treat −0 as 0.
    let state = values.fold(0, |state, value| mixed(state ^ (value + 0.0).to_bits()));
    format!("{state:016x}")
}

/// The output function of SplitMix64 (Steele, Lea, Flood 2014): a bijection in which every output bit depends on every
/// input bit.
fn mixed(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignToml {
    robot: Option<String>,
    robots: Whole<1, 1_000_000_000>,
    #[serde(default = "first_seed")]
    seed: Whole<0, { i64::MAX }>,
    #[serde(default)]
    spread: Spread,
    poses: List<Whole<1, 1_000_000>>,
    start_errors: List<StartError>,
    noise_levels: List<NoiseLevel>,
    #[serde(default)]
    methods: List<Method>,
    #[serde(default)]
    solvers: List<CampaignSolver>,
    #[serde(default = "yes")]
    weights: List<bool>,
    #[serde(default = "yes")]
    prior: List<bool>,
    #[serde(default)]
    planned: List<bool>,
}

const fn first_seed() -> Whole<0, { i64::MAX }> {
    Whole(1)
}

fn yes() -> List<bool> {
    List(vec![true])
}

#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StartError {
    length_mm: Size,
    angle_deg: Size,
    #[serde(default)]
    zero_deg: Size,
    #[serde(default)]
    radius_mm: Size,
}

#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NoiseLevel {
    position_mm: Size,
    joint_deg: Option<Size>,
    joint_mm: Option<Size>,
}

/// A whole number within bounds.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "i64")]
struct Whole<const LEAST: i64, const MOST: i64>(u64);

impl<const LEAST: i64, const MOST: i64> TryFrom<i64> for Whole<LEAST, MOST> {
    type Error = String;

    fn try_from(value: i64) -> Result<Self, String> {
        match u64::try_from(value) {
            Ok(whole) if (LEAST..=MOST).contains(&value) => Ok(Self(whole)),
            _ => Err(format!(
                "{value} is not a whole number from {LEAST} to {MOST}"
            )),
        }
    }
}

/// A finite number, 0 or greater.
#[derive(Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "f64")]
struct Size(f64);

impl TryFrom<f64> for Size {
    type Error = String;

    fn try_from(value: f64) -> Result<Self, String> {
        if value >= 0.0 && value.is_finite() {
            // −0 is 0.
            Ok(Self(value.abs()))
        } else {
            Err(format!("{value} is not a finite number, 0 or greater"))
        }
    }
}

/// A non-empty list without duplicates.
#[derive(Serialize, Deserialize)]
#[serde(
    try_from = "Vec<T>",
    bound(deserialize = "T: Deserialize<'de> + PartialEq")
)]
struct List<T>(Vec<T>);

impl<T: PartialEq> TryFrom<Vec<T>> for List<T> {
    type Error = &'static str;

    fn try_from(values: Vec<T>) -> Result<Self, &'static str> {
        if values.is_empty() {
            return Err("the list is empty");
        }
        let is_twice = |(index, value): (usize, &T)| values[..index].contains(value);
        if values.iter().enumerate().any(is_twice) {
            return Err("the list has a duplicate entry");
        }
        Ok(Self(values))
    }
}

impl<T: Default> Default for List<T> {
    fn default() -> Self {
        Self(vec![T::default()])
    }
}

impl Plan {
    /// Reads a campaign file. `robot_file` reads the robot file named in it.
    ///
    /// # Errors
    /// The first fault: invalid TOML, an unknown or missing key, a number out of range, an empty list or one with
    /// duplicates, an invalid robot file.
    pub fn read(
        input: &InputText,
        robot_file: &dyn Fn(&str) -> Result<InputText, InputError>,
    ) -> Result<Self, InputError> {
        let toml: CampaignToml = toml::from_str(input.text()).map_err(|e| syntax(input, &e))?;
        let robot = match &toml.robot {
            None => InputText::new("built-in robot.toml", example::ROBOT_TOML),
            Some(name) => robot_file(name).map_err(|error| {
                InputError::new(input.name(), error.to_string())
                    .at_key("robot")
                    .with_remedy(KEYS)
            })?,
        };
        toml.plan(input.name(), RobotFile::read(&robot)?)
            .map_err(|error| error.with_remedy(KEYS))
    }

    /// The point for which errors are evaluated: of a platform that tilts, the tool.
    pub(super) fn tool(&self) -> Tool {
        let tilting = self.robot.parallelograms;
        tilting.map_or_else(Tool::default, |_| self.robot.tool())
    }

    /// The seed of a robot. It depends on the geometry and the case's values, not on its position in the file:
    /// extending a list adds cases without changing the robots of the others, and robots of different geometries are
    /// unrelated.
    pub(super) fn seed_of(&self, case: &Case, robot: u64) -> u64 {
        let values = [
            case.poses as u64,
            u64::from(case.planned),
            case.start_error_mm.to_bits(),
            case.start_error_deg.to_bits(),
            case.start_error_zero_deg.to_bits(),
            case.start_error_radius_mm.to_bits(),
            case.noise_position_mm.to_bits(),
            case.noise_joint_deg.to_bits(),
            case.noise_joint_mm.to_bits(),
            robot,
        ];
        let geometry = case.geometry.bytes().map(u64::from);
        let values = geometry.chain(values);
        values.fold(mixed(self.seed), |state, value| mixed(state ^ value))
    }
}

type Fault = (&'static str, String);

impl CampaignToml {
    fn plan(&self, name: &str, robot: RobotFile) -> Result<Plan, InputError> {
        let scenarios = self.scenarios(&robot);
        Ok(Plan {
            scenarios: scenarios
                .map_err(|(key, cause)| InputError::new(name, cause).at_key(key))?,
            robot,
            robots: self.robots.0,
            seed: self.seed.0,
        })
    }

    /// Poses × start errors × noise levels × random or planned, each with methods × solvers × weights × prior.
    fn scenarios(&self, file: &RobotFile) -> Result<Vec<Vec<Case>>, Fault> {
        let drive = file.robot.drive();
        if file.transmission.is_some() {
            let cause = "positions do not determine transmissions: delete transmission_deg in the robot file";
            return Err(("robot", cause.to_owned()));
        }
        for start in &self.start_errors.0 {
            self.check_start_error(drive, start)?;
        }
        for level in &self.noise_levels.0 {
            level.check(drive)?;
        }
        let shared = vec![Case {
            geometry: fingerprint(file),
            spread: self.spread,
            ..Case::default()
        }];
        let shared = varied(&shared, &self.poses, |case, own| {
            case.poses = usize::try_from(own.0).unwrap_or(usize::MAX);
        });
        let shared = varied(&shared, &self.start_errors, |case, own| {
            case.start_error_mm = own.length_mm.0;
            case.start_error_deg = own.angle_deg.0;
            case.start_error_zero_deg = own.zero_deg.0;
            case.start_error_radius_mm = own.radius_mm.0;
        });
        let shared = varied(&shared, &self.noise_levels, |case, own| {
            case.noise_position_mm = own.position_mm.0;
            case.noise_joint_deg = own.joint_deg.unwrap_or_default().0;
            case.noise_joint_mm = own.joint_mm.unwrap_or_default().0;
        });
        let shared = varied(&shared, &self.planned, |case, own| case.planned = own);
        let calibrated = |shared: Case| {
            let cases = varied(&[shared], &self.methods, |case, own| case.method = own);
            let cases = varied(&cases, &self.solvers, |case, own| case.solver = own);
            let cases = varied(&cases, &self.weights, |case, own| case.weights = own);
            varied(&cases, &self.prior, |case, own| case.prior = own)
        };
        let scenarios: Vec<_> = shared.into_iter().map(calibrated).collect();
        match scenarios.iter().map(Vec::len).sum() {
            0..=CASES_AT_MOST => Ok(scenarios),
            cases => Err((
                "poses",
                format!("{cases} cases; at most {CASES_AT_MOST} are allowed"),
            )),
        }
    }

    fn check_start_error(&self, drive: Drive, start: &StartError) -> Result<(), Fault> {
        let [length, angle, radius] =
            [start.length_mm, start.angle_deg, start.radius_mm].map(|own| own.0);
        let zero = start.zero_deg.0;
        let cause = if drive == Drive::Rotary && radius > 0.0 {
            "this robot has no towers and no radius_mm"
        } else if drive == Drive::Linear && zero > 0.0 {
            "this robot's joints do not turn: it has no zero_deg"
        } else if length == 0.0 && angle == 0.0 && radius == 0.0 && zero == 0.0 {
            "length_mm and angle_deg are both 0: there is nothing to calibrate"
        } else if self.prior.0.contains(&true) && (length == 0.0 || angle == 0.0) {
            "a prior needs a length_mm and an angle_deg above 0; or set prior = [false]"
        } else {
            return Ok(());
        };
        Err(("start_errors", cause.to_owned()))
    }
}

fn varied<T: Copy>(cases: &[Case], values: &List<T>, set: impl Fn(&mut Case, T)) -> Vec<Case> {
    let mut all = Vec::with_capacity(cases.len() * values.0.len());
    for case in cases {
        for value in &values.0 {
            let mut case = case.clone();
            set(&mut case, *value);
            all.push(case);
        }
    }
    all
}

/// A campaign of one case, with the tolerance and the noise of a robot file.
#[derive(Debug, Clone, Copy)]
pub struct OneCase<'a> {
    /// The name of the robot file.
    pub robot: &'a str,
    /// Robots of the campaign.
    pub robots: u64,
    /// Another seed, other robots.
    pub seed: u64,
    /// How the robots scatter.
    pub spread: Spread,
    /// Measured poses of each robot.
    pub poses: u64,
    /// The estimator.
    pub method: Method,
    /// Whether the poses are planned.
    pub planned: bool,
}

impl OneCase<'_> {
    /// The campaign file.
    ///
    /// # Errors
    /// The section that the robot file lacks: `tolerance` or `noise`.
    pub fn to_toml(&self, file: &RobotFile) -> Result<String, &'static str> {
        // Numbers and words can always be written.
        Ok(toml::to_string(&self.campaign(file)?).unwrap_or_default())
    }

    /// The campaign itself, without reading the file.
    ///
    /// # Errors
    /// A robot file without tolerance or noise, or no poses.
    pub fn plan(&self, file: &RobotFile) -> Result<Plan, InputError> {
        let fault = |key: &str, cause| InputError::new(self.robot, cause).at_key(key);
        if self.poses == 0 {
            return Err(fault("poses", "0 poses are not enough"));
        }
        let campaign = self.campaign(file);
        let campaign = campaign.map_err(|missing| fault(missing, "there is no such section"))?;
        campaign.plan(self.robot, file.clone())
    }

    /// With the start error and the noise that the robot file states, or the section that it lacks.
    fn campaign(&self, file: &RobotFile) -> Result<CampaignToml, &'static str> {
        let tolerance = file.tolerance.ok_or("tolerance")?;
        let noise = file.noise.ok_or("noise")?;
        let rotary = file.robot.drive() == Drive::Rotary;
        let zero = tolerance.joint_zero().filter(|_| rotary);
        let start = StartError {
            length_mm: Size(tolerance.length()),
            angle_deg: Size(tolerance.angle().to_degrees()),
            zero_deg: Size(zero.unwrap_or_default().to_degrees()),
            radius_mm: Size(if rotary { 0.0 } else { tolerance.radius() }),
        };
        let level = NoiseLevel {
            position_mm: Size(noise.position()),
            joint_deg: rotary.then(|| Size(noise.joint().to_degrees())),
            joint_mm: (!rotary).then(|| Size(noise.joint())),
        };
        Ok(CampaignToml {
            robot: Some(self.robot.to_owned()),
            robots: Whole(self.robots),
            seed: Whole(self.seed),
            spread: self.spread,
            poses: List(vec![Whole(self.poses)]),
            start_errors: List(vec![start]),
            noise_levels: List(vec![level]),
            methods: List(vec![self.method]),
            solvers: List::default(),
            weights: yes(),
            prior: yes(),
            planned: List(vec![self.planned]),
        })
    }
}

impl NoiseLevel {
    /// Joint noise is in degrees for rotary drives, in mm for linear ones.
    fn check(&self, drive: Drive) -> Result<(), Fault> {
        let (key, given, other) = match drive {
            Drive::Rotary => ("joint_deg", self.joint_deg, self.joint_mm),
            Drive::Linear => ("joint_mm", self.joint_mm, self.joint_deg),
        };
        let cause = match (given, other) {
            (Some(joint), None) if joint.0 == 0.0 || self.position_mm.0 > 0.0 => return Ok(()),
            (Some(_), None) => {
                "position_mm is 0 and the joint noise is not; 0 in both is exact".to_owned()
            }
            _ => format!("this robot's joint noise is {key}"),
        };
        Err(("noise_levels", cause))
    }
}

/// Turns the TOML parser's error into one with its place in the file.
fn syntax(input: &InputText, error: &toml::de::Error) -> InputError {
    let cause = error
        .message()
        .trim()
        .replace('\n', "; ")
        .replace("missing field", "missing key")
        .replace("unknown field", "unknown key")
        .replace("expected i64", "expected a whole number")
        .replace("expected f64", "expected a number")
        .replace("expected a sequence", "expected a list in brackets");
    let place = error.span().unwrap_or_default();
    input.fault_at(place, cause).with_remedy(KEYS)
}

#[cfg(test)]
mod tests {
    use super::mixed;

    /// The first outputs that SplitMix64's authors publish for seed 1234567.
    #[test]
    fn the_mixing_is_that_of_splitmix64() {
        let published = [
            6_457_827_717_110_365_317_u64,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
        ];
        let mut state = 1_234_567_u64;
        for expected in published {
            assert_eq!(mixed(state), expected);
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        }
    }
}
