//! The campaign file.

use super::plan::{CampaignSolver, Case, Measure, Method, Plan, Scenario, Spread, fingerprint};
use crate::files::example;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use crate::text::words::decimal_comma;
use delta_cal::robot::Drive;
use delta_cal::samples::NoiseError;
use delta_cal::{Noise, Tolerance};
use serde::Deserialize;
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
    start_errors: List<StartErrorToml>,
    noise_levels: List<NoiseToml>,
    methods: Option<List<Method>>,
    solvers: Option<List<CampaignSolver>>,
    weights: Option<List<bool>>,
    prior: Option<List<bool>>,
    planned: Option<List<bool>>,
}

fn first_seed() -> Spanned<i64> {
    Spanned::new(0..0, 1)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StartErrorToml {
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
    /// Reads a campaign file. `robot_file` reads the robot file that it names.
    ///
    /// # Errors
    /// The first fault: TOML that does not parse, an unknown or missing key, a number that is not
    /// possible, an empty list or one that holds something twice, a robot file that is wrong.
    pub fn read(
        input: &InputText,
        robot_file: &dyn Fn(&str) -> Result<InputText, InputError>,
    ) -> Result<Self, InputError> {
        let toml: CampaignToml = toml::from_str(input.text()).map_err(|e| syntax(input, &e))?;
        let reader = Reader(input);
        let robot = match &toml.robot {
            None => RobotFile::read(&InputText::new("built-in robot.toml", example::ROBOT_TOML))?,
            Some(name) => {
                let text = robot_file(name.as_ref())
                    .map_err(|error| reader.fault(name, "robot", error.to_string()))?;
                RobotFile::read(&text)?
            }
        };
        let variants = reader.variants(&toml)?;
        let mut plan = Self {
            robots: reader.whole("robots", &toml.robots, 1, ROBOTS_AT_MOST)?,
            seed: reader.whole("seed", &toml.seed, 0, i64::MAX)?,
            robot,
            scenarios: Vec::new(),
        };
        for case in reader.shared(&toml, &plan.robot)? {
            let scenario = reader.scenario(&toml, case, &variants)?;
            plan.scenarios.push(scenario);
            let cases = plan.scenarios.len().saturating_mul(variants.len());
            if cases > CASES_AT_MOST {
                let cause = format!("there are more than {CASES_AT_MOST} cases");
                return Err(InputError::new(input.name(), cause)
                    .with_remedy("shorten some lists, or write several campaign files"));
            }
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

    /// Methods × solvers × weights × prior.
    fn variants(
        &self,
        toml: &CampaignToml,
    ) -> Result<Vec<(Method, CampaignSolver, bool, bool)>, InputError> {
        let methods = self.axis("methods", toml.methods.as_ref(), Method::Ikm)?;
        let solvers = self.axis("solvers", toml.solvers.as_ref(), CampaignSolver::Lm)?;
        let weights = self.axis("weights", toml.weights.as_ref(), true)?;
        let prior = self.axis("prior", toml.prior.as_ref(), true)?;
        let mut variants = Vec::new();
        for &method in &methods {
            for &solver in &solvers {
                for &weights in &weights {
                    variants.extend(prior.iter().map(|&prior| (method, solver, weights, prior)));
                }
            }
        }
        Ok(variants)
    }

    /// What is measured × poses × start errors × noise levels × random or planned.
    fn shared(&self, toml: &CampaignToml, file: &RobotFile) -> Result<Vec<Case>, InputError> {
        let drive = file.robot.drive();
        let measure = match &toml.measure {
            None => vec![Measure::Positions],
            Some(list) => self.list("measure", list, |name| self.measure(name))?,
        };
        self.check_measure(&measure, toml, file)?;
        let poses = self.list("poses", &toml.poses, |number| {
            let count = self.whole("poses", number, 1, POSES_AT_MOST)?;
            Ok(usize::try_from(count).unwrap_or(usize::MAX))
        })?;
        let start_errors = self.list("start_errors", &toml.start_errors, |error| {
            self.start_error(drive, error)
        })?;
        let noise_levels = self.list("noise_levels", &toml.noise_levels, |level| {
            self.noise_level(drive, level)
        })?;
        let planned = self.axis("planned", toml.planned.as_ref(), false)?;
        let geometry = fingerprint(file);
        let mut cases = Vec::new();
        for measure in &measure {
            for &poses in &poses {
                for &[length, angle, radius] in &start_errors {
                    for &[position, joint_deg, joint_mm] in &noise_levels {
                        cases.extend(planned.iter().map(|&planned| Case {
                            geometry: geometry.clone(),
                            spread: toml.spread,
                            measure: measure.name().to_owned(),
                            poses,
                            planned,
                            start_error_mm: length,
                            start_error_deg: angle,
                            start_error_radius_mm: radius,
                            noise_position_mm: position,
                            noise_joint_deg: joint_deg,
                            noise_joint_mm: joint_mm,
                            ..Case::default()
                        }));
                    }
                }
            }
        }
        Ok(cases)
    }

    /// Length, angle, and the radius that towers have in common.
    fn start_error(
        &self,
        drive: Drive,
        error: &Spanned<StartErrorToml>,
    ) -> Result<[f64; 3], InputError> {
        let toml = error.as_ref();
        let radius = match (&toml.radius_mm, drive) {
            (None, _) => 0.0,
            (Some(radius), Drive::Linear) => self.not_negative("radius_mm", radius)?,
            (Some(radius), Drive::Rotary) => {
                return Err(self.fault(radius, "radius_mm", "this robot has no towers"));
            }
        };
        let length = self.not_negative("length_mm", &toml.length_mm)?;
        let angle = self.not_negative("angle_deg", &toml.angle_deg)?;
        if length == 0.0 && angle == 0.0 && radius == 0.0 {
            let cause = "length_mm and angle_deg are both 0: there is nothing to calibrate";
            return Err(self.fault(error, "start_errors", cause));
        }
        Ok([length, angle, radius])
    }

    /// Of positions, of joint angles and of travels.
    fn noise_level(
        &self,
        drive: Drive,
        level: &Spanned<NoiseToml>,
    ) -> Result<[f64; 3], InputError> {
        let toml = level.as_ref();
        let (key, own, other) = match drive {
            Drive::Rotary => ("joint_deg", &toml.joint_deg, &toml.joint_mm),
            Drive::Linear => ("joint_mm", &toml.joint_mm, &toml.joint_deg),
        };
        let (Some(own), None) = (own, other) else {
            let at = other.as_ref().map_or(level.span(), Spanned::span);
            let cause = format!("this robot's joint noise is {key}");
            return Err(self.fault_at(at.start, "noise_levels", cause));
        };
        let joint = self.not_negative(key, own)?;
        let position = self.not_negative("position_mm", &toml.position_mm)?;
        let values = match drive {
            Drive::Rotary => [position, joint, 0.0],
            Drive::Linear => [position, 0.0, joint],
        };
        if noise(values).is_err() {
            let cause = format!("position_mm is 0 where {key} is not");
            return Err(self
                .fault(level, "noise_levels", cause)
                .with_remedy("set both to 0 for exact measurements, or position_mm above 0"));
        }
        Ok(values)
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

    /// Instruments need the FKM method with known noise; transmissions need instruments.
    fn check_measure(
        &self,
        measure: &[Measure],
        toml: &CampaignToml,
        file: &RobotFile,
    ) -> Result<(), InputError> {
        let start = toml.measure.as_ref().map_or(0, |list| list.span().start);
        if file.transmission.is_some() && measure.contains(&Measure::Positions) {
            let cause = "positions do not determine the transmissions that the robot file allows";
            return Err(self.fault_at(start, "measure", cause).with_remedy(
                "set measure = [\"tracker\"] or other instruments, or delete transmission_deg",
            ));
        }
        let Some(instrument) = measure.iter().find(|own| **own != Measure::Positions) else {
            return Ok(());
        };
        let name = instrument.name();
        let methods = toml.methods.as_ref();
        let is_fkm =
            |list: &List<Method>| list.as_ref().iter().all(|own| *own.as_ref() == Method::Fkm);
        if !methods.is_some_and(is_fkm) {
            let at = methods.map_or(start, |list| list.span().start);
            let cause = format!("readings of \"{name}\" need the method \"fkm\"");
            let fault = self.fault_at(at, "methods", cause);
            return Err(fault.with_remedy("set methods = [\"fkm\"]"));
        }
        let weights = toml.weights.iter().flat_map(Spanned::as_ref);
        if let Some(at) = weights.into_iter().find(|own| !*own.as_ref()) {
            let cause = format!("readings of \"{name}\" need a known noise");
            let fault = self.fault(at, "weights", cause);
            return Err(fault.with_remedy("set weights = [true]"));
        }
        Ok(())
    }

    fn scenario(
        &self,
        toml: &CampaignToml,
        shared: Case,
        variants: &[(Method, CampaignSolver, bool, bool)],
    ) -> Result<Scenario, InputError> {
        let angle = shared.start_error_deg.to_radians();
        let tolerance = Tolerance::new(shared.start_error_mm, angle)
            .and_then(|own| own.with_radius(shared.start_error_radius_mm))
            .ok();
        if tolerance.is_none() && variants.iter().any(|(.., prior)| *prior) {
            let cause = "a prior needs a length_mm and an angle_deg above 0";
            return Err(self
                .fault(&toml.start_errors, "start_errors", cause)
                .with_remedy("or set prior = [false]"));
        }
        let cases = variants
            .iter()
            .map(|&(method, solver, weights, prior)| Case {
                method,
                solver,
                weights,
                prior,
                ..shared.clone()
            });
        let levels = [
            shared.noise_position_mm,
            shared.noise_joint_deg,
            shared.noise_joint_mm,
        ];
        Ok(Scenario {
            cases: cases.collect(),
            measure: Measure::all()
                .find(|own| own.name() == shared.measure)
                .unwrap_or(Measure::Positions),
            noise: noise(levels).unwrap_or_default(),
            tolerance,
            shared,
        })
    }
}

/// `None` for exact measurements.
fn noise([position, joint_deg, joint_mm]: [f64; 3]) -> Result<Option<Noise<f64>>, NoiseError> {
    // A drive has one of both.
    let joint = joint_deg.to_radians() + joint_mm;
    if position == 0.0 && joint == 0.0 {
        return Ok(None);
    }
    Noise::new(position, joint).map(Some)
}

/// The TOML reader's error, with its line and key.
fn syntax(input: &InputText, error: &toml::de::Error) -> InputError {
    let line = input.line_at(error.span().map_or(0, |span| span.start));
    let index = usize::try_from(line).unwrap_or(usize::MAX);
    let text = input.text().lines().nth(index - 1).unwrap_or_default();
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
