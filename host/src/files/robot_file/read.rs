//! Parses a robot file.

use super::section::{OneOrThree, Positive, Section, parse};
use super::{
    DatumPoint, KnownPlane, MEASUREMENT, NamedPoint, ONLY_TARGET, ROD_KEYS, RobotFile,
    TRANSMISSION_KEYS, Target,
};
use crate::files::columns::Unit;
use crate::files::convention::{Convention, JOINT_UNITS, LENGTH_UNITS, Vertical};
use crate::files::input::{InputError, InputText};
use crate::geometry::{OF_ARM, Parallelograms, Region, Shape, reaches_anywhere};
use crate::text::{arm_key, count, joint, tolerance_key};
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{
    Arm, Drive, GeometryError, ParameterKind, Transmission, TransmissionTolerance,
};
use delta_cal::{Noise, Parameter, Robot, SettingError, SymmetricRobot, Tolerance};
use nalgebra::{Matrix3, Vector3};

const TARGET_KEYS: &str = "x_mm y_mm z_mm sigma_mm";
/// Typical σ of a reflector's or a tip's place on the platform, mm.
const USUAL_TARGET: f64 = 0.05;
/// Typical σ of what the two rods of an arm differ by, mm, and of the elbow's axis against the platform's, degrees.
const USUAL_RODS: f64 = 0.1;
const USUAL_AXES: f64 = 0.1;
/// A larger difference of the rods, as a fraction of their spacing, is a mistake.
const LARGEST_DIFFERENCE: f64 = 0.2;
/// The temperature for which lengths are stated (ISO 1), °C.
const REFERENCE_TEMPERATURE: f64 = 20.0;
/// A larger expansion is a mistake: 1 %.
const LARGEST_EXPANSION: f64 = 0.01;

/// Accepted deviation of a rotation matrix in a file, which is due to rounding.
const ROTATION_ERROR: f64 = 1e-6;

const SECTIONS: &str = "convention nominal arm joints workspace tolerance noise sensor_frame planes distances points platform \
                        parallelogram target targets tool datum robot measurement calibration";

impl RobotFile {
    /// Reads a robot file.
    ///
    /// # Errors
    /// The first fault: invalid TOML, an unknown or missing key, a number that is not finite or out of range, a robot
    /// that reaches no pose within its joint limits.
    pub fn read(input: &InputText) -> Result<Self, InputError> {
        let table = parse(input).map_err(|error| no_robot_file(input).unwrap_or(error))?;
        let file = Section::whole(input, table.get_ref(), SECTIONS)?;
        let (nominal, arms) = (file.any_section("nominal")?, file.repeated("arm")?);
        let drive = drive(nominal.as_ref(), &arms)?;
        let convention = convention(&file, drive)?;
        let (limits, forearm_limit) = limits(&file, &convention)?;
        let robot = match (&nominal, arms.as_slice()) {
            (Some(nominal), []) => robot(nominal, &convention)?,
            (None, [first, second, third]) => {
                let arms = [first, second, third].map(|own| arm(own, &convention));
                let [first_arm, second_arm, third_arm] = arms;
                let arms = [first_arm?, second_arm?, third_arm?];
                Robot::new(arms).map_err(|error| impossible(first, error))?
            }
            (Some(nominal), _) => {
                return Err(nominal
                    .fault("the file has both [nominal] and [[arm]]")
                    .with_remedy("keep the one that describes the robot and delete the other"));
            }
            (None, []) => return Err(file.fault("the file has neither [nominal] nor [[arm]]")),
            (None, [.., last]) => {
                let sections = count(arms.len(), "section");
                return Err(last.fault(format!("the file has {sections} [[arm]], not 3")));
            }
        };
        let [one, other, last] = robot.arms();
        let impossible = if one == other || other == last || last == one {
            Some(["two arms coincide", "give each arm another azimuth"])
        } else if reaches_anywhere(&robot, &limits) {
            None
        } else {
            Some([
                "the geometry is impossible: the forearms do not meet anywhere within the joint limits",
                "check the lengths (in mm), the arms' azimuths and the [joints]",
            ])
        };
        if let Some([cause, remedy]) = impossible {
            let place = nominal.as_ref().or(arms.first()).map(Section::place);
            return Err(input
                .fault_at(place.unwrap_or_default(), cause)
                .with_remedy(remedy));
        }
        let platform = file.section("platform", "radius_mm")?;
        let mut platform_radius = None;
        if let Some(nominal) = &nominal {
            platform_radius = nominal.optional("platform_radius_mm")?;
        }
        if let (None, Some(platform)) = (platform_radius, &platform) {
            platform_radius = Some(platform.number("radius_mm")?);
        }
        let mut own = Self {
            convention,
            forearm_limit,
            platform_radius,
            ..Self::of(input.name(), robot, limits)
        };
        own.read_workspace(&file)?;
        own.read_parallelograms(&file, &arms)?;
        own.read_tolerance(&file)?;
        own.read_noise(&file)?;
        own.read_instruments(&file)?;
        own.read_sensor_frame(&file)?;
        own.read_record(&file)?;
        if let Some(stated) = file.section("calibration", "absolute_mm relative_mm")? {
            let expected = [
                stated.positive("absolute_mm")?,
                stated.positive("relative_mm")?,
            ];
            own.instruments.expected = Some(expected);
        }
        Ok(own)
    }

    fn read_workspace(&mut self, file: &Section<'_>) -> Result<(), InputError> {
        let Some(own) = file.section("workspace", "within")? else {
            return Ok(());
        };
        let text: String = own.get("within")?;
        let region: Region = text.parse().map_err(|cause: String| own.fault(cause))?;
        self.within = Some(region.turned(&self.convention));
        let turned = region.turned(&self.convention);
        let mut points = turned.grid();
        if points.all(|x| self.reach().joints(&self.robot, &x).is_err()) {
            let cause = format!("the robot reaches no pose within {text}");
            return Err(own.fault(cause).with_remedy(
                "check the region, in mm in the axes of [convention], and the [joints]",
            ));
        }
        Ok(())
    }

    /// The rods of the arms, and the tool.
    fn read_parallelograms(
        &mut self,
        file: &Section<'_>,
        arms: &[Section<'_>],
    ) -> Result<(), InputError> {
        if let Some(own) = file.section("tool", "x_mm y_mm z_mm")? {
            self.tool = Some(vector(&own, &self.convention)?);
        }
        let Some(own) = file.section("parallelogram", "spacing_mm")? else {
            let mut arms = arms.iter();
            return match arms.find(|arm| ROD_KEYS.iter().any(|key| arm.has(key))) {
                Some(arm) => {
                    let fault =
                        arm.fault("the rods of an arm differ, and their spacing is not stated");
                    Err(fault.with_remedy("add [parallelogram] with spacing_mm"))
                }
                None => Ok(()),
            };
        };
        let spacing = own.positive("spacing_mm")?;
        let Some(platform_radius) = self.platform_radius else {
            let fault = own.fault("the rods' spacing needs the platform's radius");
            return Err(fault.with_remedy("add [platform] with radius_mm"));
        };
        let mut numbers = [[0.0; OF_ARM]; 3];
        for (numbers, arm) in numbers.iter_mut().zip(arms) {
            for (number, key) in numbers.iter_mut().zip(ROD_KEYS) {
                *number = arm.optional(key)?.unwrap_or_default();
            }
            let [_, _, angles @ ..] = numbers;
            *angles = angles.map(f64::to_radians);
            *numbers = self.convention.rods(*numbers);
        }
        let [rods, apart, ..] = numbers.map(|own| own.map(f64::abs));
        if rods
            .iter()
            .chain(&apart)
            .any(|own| *own > LARGEST_DIFFERENCE * spacing)
        {
            return Err(
                own.fault("the rods of an arm differ by more than a fifth of their spacing")
            );
        }
        self.parallelograms = Some(Parallelograms {
            spacing,
            platform_radius,
            numbers,
            tolerance: [USUAL_RODS, USUAL_AXES.to_radians()],
        });
        Ok(())
    }

    /// The tolerance of the geometry, and of the transmissions if they are estimated.
    fn read_tolerance(&mut self, file: &Section<'_>) -> Result<(), InputError> {
        let drive = self.robot.drive();
        let keys = match drive {
            Drive::Rotary => "zero_deg transmission_deg",
            Drive::Linear => "radius_mm forearm_mm",
        };
        let mut single: Vec<_> = drive
            .parameters()
            .iter()
            .map(|own| tolerance_key(*own))
            .collect();
        single.dedup();
        let single = single.join(" ");
        let keys =
            format!("length_mm angle_deg {keys} {single} parallelogram_mm parallelogram_deg");
        let Some(own) = file.section("tolerance", &keys)? else {
            return Ok(());
        };
        let rods = own.optional_positive("parallelogram_mm")?;
        let axes: Option<f64> = own.optional("parallelogram_deg")?;
        if axes.is_some_and(|own| !(own >= 0.0)) {
            return Err(own.fault("parallelogram_deg is below 0"));
        }
        match &mut self.parallelograms {
            Some(stated) => {
                stated.tolerance = [
                    rods.unwrap_or(USUAL_RODS),
                    axes.unwrap_or(USUAL_AXES).to_radians(),
                ];
            }
            None if rods.or(axes).is_some() => {
                let fault =
                    own.fault("parallelogram_mm and parallelogram_deg need the rods' spacing");
                return Err(fault.with_remedy("add [parallelogram] with spacing_mm"));
            }
            None => {}
        }
        let length = own.positive("length_mm")?;
        let angle = own.positive("angle_deg")?.to_radians();
        let mut stated = Tolerance::new(length, angle);
        for parameter in drive.parameters().iter().copied() {
            let key = tolerance_key(parameter);
            let sigma = match (parameter, own.optional_positive(key)?) {
                (Parameter::Zero, None) => length,
                (Parameter::Scale, None) => return Err(own.missing(key)),
                (_, None) => continue,
                (_, Some(sigma)) if parameter.kind() == ParameterKind::Angle => sigma.to_radians(),
                (_, Some(sigma)) => sigma,
            };
            stated = stated.and_then(|stated| stated.with(parameter, sigma));
        }
        let stated = match drive {
            Drive::Rotary => {
                let zero = own
                    .optional_positive("zero_deg")?
                    .map_or(angle, f64::to_radians);
                stated.and_then(|stated| stated.with_joint_zero(zero))
            }
            Drive::Linear => {
                let radius: f64 = own.optional("radius_mm")?.unwrap_or_default();
                let forearm = own.optional("forearm_mm")?.unwrap_or_default();
                stated.and_then(|stated| stated.with_radius(radius)?.with_forearm(forearm))
            }
        };
        self.tolerance = Some(stated.map_err(|error| own.fault(error.to_string()))?);
        if let Some(degrees) = own.optional_positive("transmission_deg")? {
            let cause = || format!("transmission_deg = {degrees} is not below 5.7 degrees");
            let stated = TransmissionTolerance::new(degrees.to_radians());
            self.transmission = Some(stated.map_err(|_| own.fault(cause()))?);
        }
        Ok(())
    }

    /// The noise of all readings, or that of the joints beside that of readings other than positions.
    fn read_noise(&mut self, file: &Section<'_>) -> Result<(), InputError> {
        let drive = self.robot.drive();
        let key = joint::key("joint", drive);
        let keys = format!(
            "position_mm height_mm distance_mm orientation_deg distance_scale oversize_mm scale bed_mm {key}"
        );
        let Some(own) = file.section("noise", &keys)? else {
            return Ok(());
        };
        let position = own.optional("position_mm")?;
        let position = position.map(|OneOrThree(own)| own.map(|Positive(sigma)| sigma));
        let facts = &mut self.instruments;
        facts.height_noise = own.optional_positive("height_mm")?;
        facts.distance_noise = own.optional_positive("distance_mm")?;
        let orientation = own.optional_positive("orientation_deg")?;
        facts.orientation_noise = orientation.map(f64::to_radians);
        facts.distance_scale = own.optional_positive("distance_scale")?;
        facts.scale = own.optional_positive("scale")?;
        facts.oversize = own.optional_positive("oversize_mm")?;
        facts.bed = own.optional_positive("bed_mm")?;
        let joint = joint::inwards(drive, own.number(&key)?);
        // Joint noise is checked in either case.
        let noise = Noise::by_axis(position.unwrap_or([1.0; 3]), joint);
        let noise = noise.map_err(|error| own.fault(error.to_string()))?;
        match position {
            Some(_) => self.noise = Some(noise),
            None => facts.joint_noise = Some(joint),
        }
        Ok(())
    }

    /// Facts about instruments other than their noise.
    fn read_instruments(&mut self, file: &Section<'_>) -> Result<(), InputError> {
        let convention = &self.convention;
        let facts = &mut self.instruments;
        for (name, own) in file.named("planes", "z_mm sigma_mm tilt_deg blocks_mm")? {
            let blocks: Vec<f64> = own.optional("blocks_mm")?.unwrap_or_default();
            if !blocks.iter().all(|height| *height >= 0.0) {
                let cause = "blocks_mm: a gauge block is 0 mm (the bare plane) high or more";
                return Err(own.fault(cause));
            }
            let tilt = own.optional_positive("tilt_deg")?;
            facts.planes.push(KnownPlane {
                name,
                line: own.line(),
                height: convention.height(own.number("z_mm")?),
                sigma: own.positive("sigma_mm")?,
                tilt: tilt.map(f64::to_radians),
                blocks,
            });
        }
        if let Some(own) = file.section("distances", "length_mm")? {
            let all = lengths(&own)?;
            facts.lengths = Some(all.ok_or_else(|| own.missing("length_mm"))?);
        }
        for (name, own) in file.named("points", "x_mm y_mm z_mm sigma_mm offset length_mm")? {
            let place = ["x_mm", "y_mm", "z_mm", "sigma_mm"];
            let place = if place.iter().any(|key| own.has(key)) {
                Some((vector(&own, convention)?, own.positive("sigma_mm")?))
            } else {
                None
            };
            facts.points.push(NamedPoint {
                name,
                line: own.line(),
                place,
                offset_unknown: own.choice("offset", &[("unknown", ())])?.is_some(),
                lengths: lengths(&own)?,
            });
        }
        for (name, own) in file.named("datum", "x_mm y_mm z_mm sensor_mm point sigma_mm")? {
            let place = vector(&own, convention)?;
            let seen = if let Some(point) = own.optional::<String>("point")? {
                if own.has("sensor_mm") {
                    let fault = own.fault("state either sensor_mm or point");
                    return Err(fault.with_remedy("delete one of them"));
                }
                facts.datum_measured.push((name.clone(), point));
                place
            } else {
                let seen = Vector3::from(own.get::<[f64; 3]>("sensor_mm")?);
                convention.vector(&seen)
            };
            facts.datum.push(DatumPoint {
                name,
                place,
                seen,
                sigma: own.optional_positive("sigma_mm")?,
            });
        }
        let only = file.section("target", TARGET_KEYS)?;
        let only = only.map(|own| (ONLY_TARGET.to_owned(), own));
        for (name, own) in only.into_iter().chain(file.named("targets", TARGET_KEYS)?) {
            if facts.target(&name).is_some() {
                let cause = format!("[target] is the target of this name, {name}");
                return Err(own
                    .fault(cause)
                    .with_remedy("name the other one differently"));
            }
            let sigma = own.optional("sigma_mm")?;
            let sigma = sigma.map(|OneOrThree(own)| own.map(|Positive(sigma)| sigma));
            facts.targets.push(Target {
                name,
                place: vector(&own, convention)?,
                sigma: sigma.map_or_else(|| Vector3::repeat(USUAL_TARGET), Vector3::from),
            });
        }
        Ok(())
    }

    fn read_sensor_frame(&mut self, file: &Section<'_>) -> Result<(), InputError> {
        let Some(own) = file.section("sensor_frame", "rotation translation_mm")? else {
            return Ok(());
        };
        let rows: [[f64; 3]; 3] = own.get("rotation")?;
        let rotation = Matrix3::from_fn(|row, column| rows[row][column]);
        let translation = Vector3::from(own.get::<[f64; 3]>("translation_mm")?);
        let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
        if !(off <= ROTATION_ERROR && rotation.determinant() > 0.0) {
            return Err(own.fault(
                "rotation is not a rotation matrix; `calibrate --frame sensor` finds the frame again",
            ));
        }
        self.sensor_frame = Some(RigidTransform {
            rotation: self.convention.rotation(&rotation),
            translation: self.convention.vector(&translation),
        });
        Ok(())
    }

    fn read_record(&mut self, file: &Section<'_>) -> Result<(), InputError> {
        if let Some(own) = file.section("robot", "name serial")? {
            self.record.name = own.optional("name")?;
            self.record.serial = own.optional("serial")?;
        }
        let keys = MEASUREMENT.map(|(key, _)| key);
        let keys = format!("{} temperature_c expansion_per_k", keys.join(" "));
        if let Some(own) = file.section("measurement", &keys)? {
            for (key, _) in MEASUREMENT {
                let stated = own.optional(key)?;
                let stated = stated.map(|value| (key, value));
                self.record.measurement.extend(stated);
            }
            let temperature: Option<f64> = own.optional("temperature_c")?;
            let expansion: Option<f64> = own.optional("expansion_per_k")?;
            self.instruments.expansion = match (temperature, expansion) {
                (None, None) => 0.0,
                (Some(_), None) => return Err(own.missing("expansion_per_k")),
                (None, Some(_)) => return Err(own.missing("temperature_c")),
                (Some(here), Some(per_kelvin)) => (here - REFERENCE_TEMPERATURE) * per_kelvin,
            };
            if !(self.instruments.expansion.abs() <= LARGEST_EXPANSION) {
                let cause = "temperature_c and expansion_per_k make an expansion of more than 1 %";
                return Err(own
                    .fault(cause)
                    .with_remedy("state the temperature in °C; steel expands by 1.15e-5 per K"));
            }
        }
        Ok(())
    }
}

/// The error for a file that is a table or a printer's configuration instead of TOML.
fn no_robot_file(input: &InputText) -> Option<InputError> {
    let starts = |own: &str| input.text().lines().any(|line| line.starts_with(own));
    if starts("[printer]") || starts("M665") {
        let cause = "this looks like a printer's configuration, but a robot file is needed here";
        let remedy = "delta-cal import makes a robot file of it";
        return Some(InputError::new(input.name(), cause).with_remedy(remedy));
    }
    let mut lines = (1..).zip(input.text().lines());
    let (line, first) =
        lines.find(|(_, line)| !(line.trim().is_empty() || line.starts_with('#')))?;
    let is_table = !first.contains(['=', '[']) && first.contains([',', ';', '\t']);
    is_table.then(|| {
        let cause = "this looks like a table of samples, but a robot file is needed here";
        InputError::new(input.name(), cause)
            .at_line(line)
            .with_remedy("give the robot file first and the table after it; delta-cal init writes a robot file")
    })
}

/// The drive by `kind` in `[nominal]`, or for arms by whether the first has a key of a tower.
fn drive(nominal: Option<&Section<'_>>, arms: &[Section<'_>]) -> Result<Drive, InputError> {
    let kinds = [("rotary", Drive::Rotary), ("linear", Drive::Linear)];
    if let Some(kind) = nominal.map(|own| own.choice("kind", &kinds)).transpose()? {
        return Ok(kind.unwrap_or(Drive::Rotary));
    }
    let own = [Parameter::LeanX, Parameter::LeanY, Parameter::Scale].map(arm_key);
    let mut first = arms.iter().take(1);
    let towers = first.any(|arm| own.iter().any(|key| arm.has(key)));
    Ok(if towers { Drive::Linear } else { Drive::Rotary })
}

fn convention(file: &Section<'_>, drive: Drive) -> Result<Convention, InputError> {
    let usual = Convention::usual(drive);
    let keys = match drive {
        Drive::Rotary => "joint_positive z_axis joint_unit counts_per_deg length_unit",
        Drive::Linear => "z_axis length_unit",
    };
    let Some(own) = file.section("convention", keys)? else {
        return Ok(usual);
    };
    let counts = own
        .optional("counts_per_deg")?
        .map(|OneOrThree(own): OneOrThree<f64>| own);
    if counts.is_some_and(|counts| counts.contains(&0.0)) {
        return Err(own.fault("counts_per_deg must not be 0"));
    }
    let joint_unit = own.choice("joint_unit", &JOINT_UNITS)?;
    match (joint_unit, counts) {
        (Some(Unit::Count), None) => return Err(own.missing("counts_per_deg")),
        (Some(Unit::Degree | Unit::Radian), Some(_)) => {
            return Err(own.fault("counts_per_deg needs joint_unit = \"counts\""));
        }
        _ => {}
    }
    let direction = |key, usual| Ok(own.choice(key, &Vertical::WORDS)?.unwrap_or(usual));
    Ok(Convention {
        drive,
        joint_positive: direction("joint_positive", usual.joint_positive)?,
        z_axis: direction("z_axis", usual.z_axis)?,
        joint_unit: counts.map(|_| Unit::Count).or(joint_unit),
        counts_per_degree: counts,
        length_unit: own.choice("length_unit", &LENGTH_UNITS)?,
    })
}

fn impossible(section: &Section<'_>, error: GeometryError) -> InputError {
    let cause = match error {
        GeometryError::NonFinite(_) => "a number is too large".to_owned(),
        GeometryError::NotPositive(own) => format!("{} must be above 0", arm_key(own)),
        error => error.to_string(),
    };
    section.fault(format!("the geometry is impossible: {cause}"))
}

/// A robot with three equal arms or towers.
fn robot(nominal: &Section<'_>, convention: &Convention) -> Result<Robot<f64>, InputError> {
    let made = match convention.drive {
        Drive::Rotary => {
            nominal.only("kind base_radius_mm platform_radius_mm upper_arm_mm forearm_mm azimuth_deg zero_deg")?;
            let azimuths = azimuths(nominal, "azimuth_deg", convention)?;
            let zeros = nominal.optional("zero_deg")?.map(|OneOrThree(own)| own);
            let lengths = SymmetricRobot {
                base_radius: nominal.number("base_radius_mm")?,
                platform_radius: nominal.number("platform_radius_mm")?,
                upper_arm: nominal.positive("upper_arm_mm")?,
                forearm: nominal.positive("forearm_mm")?,
            };
            lengths.robot().and_then(|robot| match (azimuths, zeros) {
                (None, None) => Ok(robot),
                (azimuths, zeros) => {
                    let usual = robot.arms().map(|arm| arm.get(Parameter::Theta));
                    turned(
                        &lengths,
                        azimuths.unwrap_or(usual),
                        zeros.unwrap_or_default().map(|zero| convention.angle(zero)),
                    )
                }
            })
        }
        Drive::Linear => {
            nominal.only("kind tower_radius_mm tower_deg forearm_mm")?;
            let radius = nominal.positive("tower_radius_mm")?;
            let forearm = nominal.positive("forearm_mm")?;
            Robot::linear(radius, forearm, azimuths(nominal, "tower_deg", convention)?)
        }
    };
    made.map_err(|error| impossible(nominal, error))
}

/// Equal arms at these azimuths (radians), with the angles above horizontal (degrees) at which their joints read 0.
fn turned(
    lengths: &SymmetricRobot<f64>,
    azimuths: [f64; 3],
    zeros: [f64; 3],
) -> Result<Robot<f64>, GeometryError> {
    let shape = |index: usize| Shape {
        azimuth: azimuths[index],
        radius: lengths.base_radius - lengths.platform_radius,
        height: 0.0,
        upper: lengths.upper_arm,
        lower: lengths.forearm,
        zero: zeros[index].to_radians(),
    };
    Shape::robot(&[0, 1, 2].map(shape), Drive::Rotary)
}

/// The azimuths of the arms or towers, radians about the internal z axis.
fn azimuths(
    nominal: &Section<'_>,
    key: &str,
    convention: &Convention,
) -> Result<Option<[f64; 3]>, InputError> {
    let Some(stated) = nominal.optional::<[f64; 3]>(key)? else {
        return Ok(None);
    };
    if stated.iter().any(|azimuth| azimuth.abs() > 720.0) {
        return Err(impossible(nominal, GeometryError::AzimuthTooLarge));
    }
    Ok(Some(
        stated.map(|azimuth| convention.angle(azimuth.to_radians())),
    ))
}

fn arm(section: &Section<'_>, convention: &Convention) -> Result<Arm<f64>, InputError> {
    let drive = convention.drive;
    let parameters = drive.parameters().iter().copied();
    let keys: Vec<_> = parameters.clone().map(arm_key).collect();
    let of_gears = match drive {
        Drive::Rotary => TRANSMISSION_KEYS.join(" "),
        Drive::Linear => String::new(),
    };
    let of_rods = ROD_KEYS.join(" ");
    section.only(&format!("{} {of_gears} {of_rods}", keys.join(" ")))?;
    let mut values = [0.0; 8];
    for (value, parameter) in values.iter_mut().zip(parameters) {
        let stated = section.number(arm_key(parameter))?;
        let stated = match parameter.kind() {
            ParameterKind::Length | ParameterKind::Ratio => stated,
            ParameterKind::Angle => stated.to_radians(),
        };
        *value = convention.parameter(parameter, stated);
    }
    let arm = match drive {
        Drive::Rotary => {
            let mut numbers = [0.0; 5];
            for (number, key) in numbers.iter_mut().zip(TRANSMISSION_KEYS) {
                *number = section.optional(key)?.unwrap_or_default();
            }
            let [_, angles @ ..] = &mut numbers;
            *angles = angles.map(f64::to_radians);
            Transmission::new(convention.transmission(numbers))
                .and_then(|transmission| Arm::new(values)?.with_transmission(transmission))
        }
        Drive::Linear => {
            let [values @ .., _] = values;
            Arm::linear(values)
        }
    };
    arm.map_err(|error| impossible(section, error))
}

/// Joint limits, and the largest angle of a forearm out of its arm's plane.
fn limits(
    file: &Section<'_>,
    convention: &Convention,
) -> Result<(JointLimits<f64>, Option<f64>), InputError> {
    let drive = convention.drive;
    let own = file.any_section("joints")?;
    let own = own.ok_or_else(|| file.missing("joints"))?;
    let unit = match drive {
        Drive::Rotary if own.has("min_rad") => "rad",
        drive => joint::unit(drive),
    };
    let [least, most] = ["min", "max"].map(|name| format!("{name}_{unit}"));
    let of_motors = match drive {
        Drive::Rotary => "forearm_max_deg",
        Drive::Linear => "",
    };
    own.only(&format!("{least} {most} {of_motors}"))?;
    let (low, high) = (own.number(&least)?, own.number(&most)?);
    let inside = |stated: f64| match unit {
        "rad" => stated,
        _ => joint::inwards(drive, stated),
    };
    let (least, most) = convention.limits(inside(low), inside(high));
    let limits = match drive {
        Drive::Rotary => JointLimits::new(least, most),
        Drive::Linear => JointLimits::travel(least, most),
    };
    let limits = limits.map_err(|error| match error {
        SettingError::JointLimitsEmpty => own.fault(format!(
            "the largest {}, {high}, is not above the smallest, {low}",
            joint::name(drive)
        )),
        error => own.fault(error.to_string()),
    })?;
    match own.optional_positive("forearm_max_deg")? {
        Some(degrees) if degrees > 90.0 => {
            Err(own.fault(format!("forearm_max_deg = {degrees} is above 90 degrees")))
        }
        forearm => Ok((limits, forearm.map(f64::to_radians))),
    }
}

/// `x_mm`, `y_mm` and `z_mm`, in internal axes.
fn vector(own: &Section<'_>, convention: &Convention) -> Result<Vector3<f64>, InputError> {
    let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|key| own.number(key));
    Ok(convention.vector(&Vector3::new(x?, y?, z?)))
}

/// The shortest and longest measurable distance.
fn lengths(own: &Section<'_>) -> Result<Option<(f64, f64)>, InputError> {
    match own.optional::<[Positive; 2]>("length_mm")? {
        Some([Positive(shortest), Positive(longest)]) if shortest > longest => {
            Err(own.fault("length_mm: the shortest distance comes first, then the longest"))
        }
        all => Ok(all.map(|[Positive(shortest), Positive(longest)]| (shortest, longest))),
    }
}
