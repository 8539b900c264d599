//! The campaign file.

use super::plan::{
    CampaignMethod, CampaignSolver, LengthAngle, Measure, NoiseLevel, Plan, Scenario, Spread,
};
use crate::files::example;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::planning::{LEAST as LEAST_POSES, MOST as MOST_POSES};
use crate::text::words::decimal_comma;
use delta_cal::robot::Drive;
use delta_cal::{Noise, Tolerance};
use serde::Deserialize;
use std::path::Path;
use toml::Spanned;

const KEYS: &str = "`delta-cal simulate --example` prints a campaign file with every key";
const POSES_AT_MOST: i64 = 1_000_000;
const ROBOTS_AT_MOST: i64 = 1_000_000_000;
const CASES_AT_MOST: usize = 100_000;

type List<T> = Spanned<Vec<Spanned<T>>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignToml {
    robot: Option<Spanned<String>>,
    robots: Spanned<i64>,
    #[serde(default = "first_seed")]
    seed: Spanned<i64>,
    #[serde(default)]
    spread: Spread,
    measure: Option<List<String>>,
    poses: List<i64>,
    start_errors: List<LengthAngleToml>,
    noise_levels: List<NoiseToml>,
    methods: Option<List<CampaignMethod>>,
    solvers: Option<List<CampaignSolver>>,
    weights: Option<List<bool>>,
    prior: Option<List<bool>>,
    planned: Option<List<bool>>,
    #[serde(default)]
    parameters: bool,
    tolerance: Option<Spanned<LengthAngleToml>>,
}

fn first_seed() -> Spanned<i64> {
    Spanned::new(0..0, 1)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LengthAngleToml {
    length_mm: Spanned<f64>,
    angle_deg: Spanned<f64>,
    radius_mm: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NoiseToml {
    position_mm: Spanned<f64>,
    joint_deg: Option<Spanned<f64>>,
    joint_mm: Option<Spanned<f64>>,
}

impl Plan {
    /// Reads a campaign file. The robot file that it names is looked for in `folder`.
    ///
    /// # Errors
    /// The first fault: TOML that does not parse, an unknown or missing key, a number that is not
    /// possible, an empty list or one that holds something twice, a robot file that is wrong.
    pub fn read(input: &InputText, folder: &Path) -> Result<Self, InputError> {
        let toml: CampaignToml = toml::from_str(input.text()).map_err(|e| syntax(input, &e))?;
        let reader = Reader(input);
        let robot = match &toml.robot {
            None => RobotFile::read(&InputText::new("built-in robot.toml", example::ROBOT_TOML))?,
            Some(name) => {
                let text = InputText::from_file(&folder.join(name.as_ref()))
                    .map_err(|error| reader.fault(name, "robot", error.to_string()))?;
                RobotFile::read(&text)?
            }
        };
        let drive = robot.robot.drive();
        let poses = reader.list("poses", &toml.poses, |number| {
            let count = reader.whole("poses", number, 1, POSES_AT_MOST)?;
            Ok(usize::try_from(count).unwrap_or(usize::MAX))
        })?;
        let start_errors = reader.list("start_errors", &toml.start_errors, |error| {
            let values = reader.length_angle(drive, error.as_ref())?;
            if values.length_mm == 0.0 && values.angle_deg == 0.0 && values.radius_mm == 0.0 {
                let cause = "length_mm and angle_deg are both 0: there is nothing to calibrate";
                return Err(reader.fault(error, "start_errors", cause));
            }
            Ok(values)
        })?;
        let noise_levels = reader.list("noise_levels", &toml.noise_levels, |level| {
            reader.noise_level(drive, level)
        })?;
        let methods = reader.axis("methods", toml.methods.as_ref(), CampaignMethod::Ikm)?;
        let solvers = reader.axis("solvers", toml.solvers.as_ref(), CampaignSolver::Lm)?;
        let weights = reader.axis("weights", toml.weights.as_ref(), true)?;
        let prior = reader.axis("prior", toml.prior.as_ref(), true)?;
        let planned = reader.axis("planned", toml.planned.as_ref(), false)?;
        let measure = match &toml.measure {
            None => vec![Measure::Positions],
            Some(list) => reader.list("measure", list, |name| reader.measure(name))?,
        };
        reader.check_joint(&measure, &toml)?;
        reader.check_transmissions(&robot, &measure, toml.measure.as_ref())?;
        if planned.contains(&true) {
            let possible = LEAST_POSES..=MOST_POSES;
            let counts = toml.poses.as_ref().iter().zip(&poses);
            if let Some((at, count)) = counts.into_iter().find(|(_, n)| !possible.contains(n)) {
                let cause =
                    format!("{count} poses cannot be planned, only {LEAST_POSES} to {MOST_POSES}");
                let error = reader.fault(at, "poses", cause);
                return Err(error.with_remedy("change the list, or leave out planned = [true]"));
            }
        }
        let tolerance = match &toml.tolerance {
            Some(section) => Some(reader.length_angle(drive, section.as_ref())?),
            None => None,
        };
        let mut plan = Self {
            robots: reader.whole("robots", &toml.robots, 1, ROBOTS_AT_MOST)?,
            seed: reader.whole("seed", &toml.seed, 0, i64::MAX)?,
            spread: toml.spread,
            robot,
            tolerance,
            measure,
            poses,
            start_errors,
            noise_levels,
            planned,
            methods,
            solvers,
            weights,
            prior,
            parameters: toml.parameters,
            scenarios: Vec::new(),
        };
        plan.scenarios = reader.scenarios(&plan, &toml)?;
        let cases = plan.scenarios.len().saturating_mul(plan.variants().len());
        if cases > CASES_AT_MOST {
            let cause = format!("{cases} cases are more than {CASES_AT_MOST}");
            return Err(InputError::new(input.name(), cause)
                .with_remedy("shorten some lists, or divide them into several campaigns"));
        }
        Ok(plan)
    }
}

/// Reads values and knows where they stand.
struct Reader<'a>(&'a InputText);

impl Reader<'_> {
    fn fault<T>(&self, at: &Spanned<T>, key: &str, cause: impl Into<String>) -> InputError {
        self.fault_at(at.span().start, key, cause)
    }

    fn fault_at(&self, start: usize, key: &str, cause: impl Into<String>) -> InputError {
        InputError::new(self.0.name(), cause)
            .at_line(self.0.line_at(start))
            .at_key(key)
            .with_remedy(KEYS)
    }

    fn whole(
        &self,
        key: &str,
        number: &Spanned<i64>,
        least: i64,
        most: i64,
    ) -> Result<u64, InputError> {
        let value = *number.as_ref();
        match u64::try_from(value) {
            Ok(whole) if (least..=most).contains(&value) => Ok(whole),
            _ => {
                let cause = format!("{value} is not a whole number from {least} to {most}");
                Err(self.fault(number, key, cause))
            }
        }
    }

    fn not_negative(&self, key: &str, number: &Spanned<f64>) -> Result<f64, InputError> {
        let value = *number.as_ref();
        if value >= 0.0 && value.is_finite() {
            // −0 is 0.
            Ok(value.abs())
        } else {
            let cause = format!("{value} is not a finite number, 0 or greater");
            Err(self.fault(number, key, cause))
        }
    }

    fn length_angle(
        &self,
        drive: Drive,
        toml: &LengthAngleToml,
    ) -> Result<LengthAngle, InputError> {
        let radius_mm = match (&toml.radius_mm, drive) {
            (None, _) => 0.0,
            (Some(radius), Drive::Linear) => self.not_negative("radius_mm", radius)?,
            (Some(radius), Drive::Rotary) => {
                let cause = "the robot's motors turn its arms: it has no towers";
                return Err(self.fault(radius, "radius_mm", cause));
            }
        };
        Ok(LengthAngle {
            length_mm: self.not_negative("length_mm", &toml.length_mm)?,
            angle_deg: self.not_negative("angle_deg", &toml.angle_deg)?,
            radius_mm,
        })
    }

    fn noise_level(
        &self,
        drive: Drive,
        level: &Spanned<NoiseToml>,
    ) -> Result<NoiseLevel, InputError> {
        let toml = level.as_ref();
        let (key, own, other, joints) = match drive {
            Drive::Rotary => ("joint_deg", &toml.joint_deg, &toml.joint_mm, "angles"),
            Drive::Linear => ("joint_mm", &toml.joint_mm, &toml.joint_deg, "travels"),
        };
        let Some(own) = own.as_ref().filter(|_| other.is_none()) else {
            let at = other
                .as_ref()
                .map_or(level.span().start, |other| other.span().start);
            let cause = format!("the noise of this robot's joints, which are {joints}, is {key}");
            return Err(self.fault_at(at, "noise_levels", cause));
        };
        let joint = self.not_negative(key, own)?;
        let mut values = NoiseLevel {
            position_mm: self.not_negative("position_mm", &toml.position_mm)?,
            joint_deg: 0.0,
            joint_mm: 0.0,
        };
        match drive {
            Drive::Rotary => values.joint_deg = joint,
            Drive::Linear => values.joint_mm = joint,
        }
        if noise(&values).is_err() {
            let cause = format!("position_mm is 0 where {key} is not");
            return Err(self
                .fault(level, "noise_levels", cause)
                .with_remedy("exact measurements have both 0; others a position noise above 0"));
        }
        Ok(values)
    }

    /// A list with something in it, and nothing twice.
    fn list<T, V: PartialEq>(
        &self,
        key: &str,
        list: &List<T>,
        read: impl Fn(&Spanned<T>) -> Result<V, InputError>,
    ) -> Result<Vec<V>, InputError> {
        let mut values = Vec::with_capacity(list.as_ref().len());
        for entry in list.as_ref() {
            let value = read(entry)?;
            if values.contains(&value) {
                return Err(self.fault(entry, key, "the list holds this entry twice"));
            }
            values.push(value);
        }
        if values.is_empty() {
            return Err(self.fault(list, key, "the list is empty"));
        }
        Ok(values)
    }

    fn axis<T: Copy + PartialEq>(
        &self,
        key: &str,
        list: Option<&List<T>>,
        default: T,
    ) -> Result<Vec<T>, InputError> {
        match list {
            None => Ok(vec![default]),
            Some(list) => self.list(key, list, |entry| Ok(*entry.as_ref())),
        }
    }

    fn measure(&self, name: &Spanned<String>) -> Result<Measure, InputError> {
        let found = Measure::all().find(|own| own.name() == name.as_ref());
        found.ok_or_else(|| {
            let names: Vec<_> = Measure::all().map(Measure::name).collect();
            let cause = format!("there is no instrument \"{}\"", name.as_ref());
            self.fault(name, "measure", cause)
                .with_remedy(format!("choose among {}", names.join(", ")))
        })
    }

    /// Transmissions are found from what instruments read alone.
    fn check_transmissions(
        &self,
        robot: &RobotFile,
        measure: &[Measure],
        list: Option<&List<String>>,
    ) -> Result<(), InputError> {
        if robot.transmission.is_none() || !measure.contains(&Measure::Positions) {
            return Ok(());
        }
        let cause = "the robot file states transmission_deg, and transmissions are not found from positions";
        let start = list.map_or(0, |list| list.span().start);
        Err(self.fault_at(start, "measure", cause).with_remedy(
            "set measure = [\"tracker\"] or other instruments, or delete transmission_deg",
        ))
    }

    /// What instruments read is calibrated by the joint method, which needs the noise.
    fn check_joint(&self, measure: &[Measure], toml: &CampaignToml) -> Result<(), InputError> {
        let Some(instrument) = measure.iter().find(|own| **own != Measure::Positions) else {
            return Ok(());
        };
        let name = instrument.name();
        let joint = [CampaignMethod::Joint];
        let methods = toml.methods.as_ref();
        let other = methods.is_none_or(|list| {
            list.as_ref()
                .iter()
                .any(|own| !joint.contains(own.as_ref()))
        });
        if let (true, Some(at)) = (other, &toml.measure) {
            let cause =
                format!("what \"{name}\" reads can only be calibrated by the method \"joint\"");
            return Err(self
                .fault_at(
                    methods.map_or(at.span().start, |list| list.span().start),
                    "methods",
                    cause,
                )
                .with_remedy("set methods = [\"joint\"]"));
        }
        let weights = toml.weights.as_ref();
        let without = weights.and_then(|list| list.as_ref().iter().find(|own| !*own.as_ref()));
        if let Some(at) = without {
            let cause = format!("what \"{name}\" reads cannot be calibrated without the noise");
            return Err(self
                .fault(at, "weights", cause)
                .with_remedy("set weights = [true]"));
        }
        Ok(())
    }

    fn scenarios(&self, plan: &Plan, toml: &CampaignToml) -> Result<Vec<Scenario>, InputError> {
        let mut scenarios = Vec::new();
        let counts = plan
            .measure
            .iter()
            .flat_map(|own| plan.poses.iter().map(move |count| (*own, *count)));
        for (measure, poses) in counts {
            for (&start_error, entry) in plan.start_errors.iter().zip(toml.start_errors.as_ref()) {
                let assumed = plan.tolerance.unwrap_or(start_error);
                let tolerance = Tolerance::new(assumed.length_mm, assumed.angle_deg.to_radians())
                    .and_then(|own| own.with_radius(assumed.radius_mm))
                    .ok();
                if tolerance.is_none() && plan.prior.contains(&true) {
                    let cause = "a prior needs a length_mm and an angle_deg above 0";
                    let fault = match &toml.tolerance {
                        Some(section) => self.fault(section, "[tolerance]", cause),
                        None => self.fault(entry, "start_errors", cause),
                    };
                    return Err(fault.with_remedy("or set prior = [false]"));
                }
                for level in &plan.noise_levels {
                    for &planned in &plan.planned {
                        scenarios.push(Scenario {
                            measure,
                            poses,
                            start_error,
                            noise_level: *level,
                            noise: noise(level).unwrap_or_default(),
                            tolerance,
                            planned,
                        });
                    }
                }
            }
        }
        Ok(scenarios)
    }
}

/// `None` for exact measurements.
fn noise(level: &NoiseLevel) -> Result<Option<Noise<f64>>, delta_cal::samples::NoiseError> {
    // A drive has one of both.
    let joint = level.joint_deg.to_radians() + level.joint_mm;
    if level.position_mm == 0.0 && joint == 0.0 {
        return Ok(None);
    }
    Noise::new(level.position_mm, joint).map(Some)
}

/// The TOML reader's error, with its line and key.
fn syntax(input: &InputText, error: &toml::de::Error) -> InputError {
    let line = input.line_at(error.span().map_or(0, |span| span.start));
    let index = usize::try_from(line).unwrap_or(usize::MAX);
    let text = input
        .text()
        .lines()
        .nth(index - 1)
        .unwrap_or_default()
        .trim();
    let message = error.message().trim().replace('\n', "; ");
    let cause = message
        .replace("missing field", "missing key")
        .replace("unknown field", "unknown key")
        .replace("expected i64", "expected a whole number")
        .replace("expected f64", "expected a number")
        .replace("expected a sequence", "expected a list in brackets");
    let fault = InputError::new(input.name(), cause).at_line(line);
    let value = text.split_once('=').map_or("", |(_, value)| value).trim();
    match decimal_comma(value) {
        Some(number) => fault.with_remedy(format!("write {number}, with a decimal point")),
        None => fault.with_remedy(KEYS),
    }
}
