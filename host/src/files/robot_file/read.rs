use super::RobotFile;
use super::instruments::{InstrumentFacts, KnownPlane, NamedPoint};
use super::messages::{SECTIONS, fault, fault_at, syntax};
use super::record::Record;
use super::schema::{
    ARM_KEYS, ArmToml, ByAxis, JointsToml, NoiseToml, NominalToml, Number, PointToml, RobotToml,
    SensorFrameToml, ToleranceToml,
};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::geometry::sweep::reaches_anywhere;
use crate::text::words::count;
use delta_cal::calibration::ToleranceError;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::{JointLimits, JointLimitsError};
use delta_cal::robot::{Arm, GeometryError, ParameterKind};
use delta_cal::samples::NoiseError;
use delta_cal::{Noise, Parameter, Robot, SymmetricRobot, Tolerance};
use nalgebra::{Matrix3, Vector3};
use toml::Spanned;

const IMPOSSIBLE: &str = "check the number and its unit: lengths are in mm, angles in degrees";

/// A rotation read from a file may be off by its rounding, not by more than this.
const ROTATION_ERROR: f64 = 1e-6;

impl RobotFile {
    /// Reads a robot file.
    ///
    /// # Errors
    /// The first fault: TOML that does not parse, an unknown or missing key, a number that is not
    /// finite or not possible, a robot that reaches no pose within its joint limits.
    pub fn read(input: &InputText) -> Result<Self, InputError> {
        let toml: RobotToml = toml::from_str(input.text()).map_err(|e| syntax(input, &e))?;
        let (robot, line) = match (&toml.nominal, toml.arm.as_deref()) {
            (Some(nominal), None) => (
                symmetric(input, nominal.as_ref())?,
                input.line_at(nominal.span().start),
            ),
            (None, Some([first, second, third])) => (
                from_arms(input, [first, second, third])?,
                input.line_at(first.span().start),
            ),
            (None, Some(arms)) => {
                let line = arms.last().map_or(1, |arm| input.line_at(arm.span().start));
                let found = count(arms.len(), "section");
                let cause = format!("{found} [[arm]] where there must be three");
                return Err(fault(input, line, "[[arm]]", cause));
            }
            (Some(nominal), Some(_)) => {
                let line = input.line_at(nominal.span().start);
                let cause = "the file has both [nominal] and [[arm]]";
                return Err(fault(input, line, "[nominal]", cause)
                    .with_remedy("keep the one that describes the robot and delete the other"));
            }
            (None, None) => {
                let cause = "the file has neither [nominal] nor [[arm]]: the robot has no geometry";
                return Err(InputError::new(input.name(), cause)
                    .at_line(1)
                    .with_remedy(SECTIONS));
            }
        };
        let limits = joint_limits(input, &toml.joints)?;
        let forearm_limit = match &toml.joints.as_ref().forearm_max_deg {
            Some(number) => Some(forearm_limit(input, number)?),
            None => None,
        };
        if !reaches_anywhere(&robot, &limits) {
            let cause = "the geometry is impossible: the forearms do not meet anywhere within the \
                         joint limits";
            return Err(InputError::new(input.name(), cause)
                .at_line(line)
                .with_remedy("check the lengths (in mm), the arms' azimuths and the [joints]"));
        }
        let instruments = instruments(input, &toml)?;
        let record = Record::read(input, &toml)?;
        Ok(Self {
            name: input.name().to_owned(),
            robot,
            limits,
            forearm_limit,
            tolerance: toml
                .tolerance
                .map(|section| tolerance(input, &section))
                .transpose()?,
            noise: match &toml.noise {
                Some(section) => noise(input, section)?,
                None => None,
            },
            instruments,
            record,
            sensor_frame: toml
                .sensor_frame
                .map(|section| sensor_frame(input, &section))
                .transpose()?,
        })
    }
}

fn finite(input: &InputText, key: &str, number: &Number) -> Result<f64, InputError> {
    let value = *number.as_ref();
    if value.is_finite() {
        Ok(value)
    } else {
        let cause = format!("{value} is not a finite number");
        Err(fault_at(input, number, key, cause))
    }
}

fn symmetric(input: &InputText, nominal: &NominalToml) -> Result<Robot<f64>, InputError> {
    let geometry = SymmetricRobot {
        base_radius: finite(input, "base_radius_mm", &nominal.base_radius_mm)?,
        platform_radius: finite(input, "platform_radius_mm", &nominal.platform_radius_mm)?,
        upper_arm: finite(input, "upper_arm_mm", &nominal.upper_arm_mm)?,
        forearm: finite(input, "forearm_mm", &nominal.forearm_mm)?,
    };
    geometry.robot().map_err(|error| {
        let (key, number) = match error {
            GeometryError::RadiusInvalid if geometry.base_radius < 0.0 => {
                ("base_radius_mm", &nominal.base_radius_mm)
            }
            GeometryError::RadiusInvalid => ("platform_radius_mm", &nominal.platform_radius_mm),
            GeometryError::NotPositive(Parameter::Lb) | GeometryError::NonFinite(Parameter::Lb) => {
                ("forearm_mm", &nominal.forearm_mm)
            }
            GeometryError::NonFinite(Parameter::Dx | Parameter::Dy) => {
                ("base_radius_mm", &nominal.base_radius_mm)
            }
            _ => ("upper_arm_mm", &nominal.upper_arm_mm),
        };
        fault_at(input, number, key, impossible(error)).with_remedy(IMPOSSIBLE)
    })
}

fn from_arms(input: &InputText, arms: [&Spanned<ArmToml>; 3]) -> Result<Robot<f64>, InputError> {
    let [first, second, third] = arms.map(|section| arm(input, section));
    Robot::new([first?, second?, third?]).map_err(|error| {
        let [section, ..] = arms;
        let line = input.line_at(section.span().start);
        fault(input, line, "[[arm]]", impossible(error))
    })
}

fn arm(input: &InputText, section: &Spanned<ArmToml>) -> Result<Arm<f64>, InputError> {
    let mut parameters = [0.0; 8];
    let numbers = section.as_ref().numbers();
    for (parameter, value) in Parameter::ALL.into_iter().zip(&mut parameters) {
        let index = parameter.index();
        let number = finite(input, ARM_KEYS[index], numbers[index])?;
        *value = match parameter.kind() {
            ParameterKind::Length => number,
            ParameterKind::Angle => number.to_radians(),
        };
    }
    Arm::new(parameters).map_err(|error| {
        let parameter = match error {
            GeometryError::NonFinite(parameter) | GeometryError::NotPositive(parameter) => {
                parameter
            }
            GeometryError::TiltTooLarge => Parameter::Alpha,
            _ => Parameter::Theta,
        };
        let index = parameter.index();
        fault_at(input, numbers[index], ARM_KEYS[index], impossible(error)).with_remedy(IMPOSSIBLE)
    })
}

fn impossible(error: GeometryError) -> String {
    match error {
        GeometryError::NonFinite(_) => "the geometry is impossible: the number is too large".into(),
        GeometryError::NotPositive(Parameter::LaX) => {
            "the geometry is impossible: the upper arm's length must be greater than 0".into()
        }
        GeometryError::NotPositive(_) => {
            "the geometry is impossible: the length must be greater than 0".into()
        }
        error => format!("the geometry is impossible: {error}"),
    }
}

fn joint_limits(
    input: &InputText,
    section: &Spanned<JointsToml>,
) -> Result<JointLimits<f64>, InputError> {
    let joints = section.as_ref();
    let minimum = finite(input, "min_deg", &joints.min_deg)?;
    let maximum = finite(input, "max_deg", &joints.max_deg)?;
    JointLimits::new(minimum.to_radians(), maximum.to_radians()).map_err(|error| {
        let cause = match error {
            JointLimitsError::Empty => {
                format!("the largest joint angle, {maximum}, is not above the smallest, {minimum}")
            }
            error => error.to_string(),
        };
        fault_at(input, &joints.max_deg, "max_deg", cause)
    })
}

fn forearm_limit(input: &InputText, number: &Number) -> Result<f64, InputError> {
    let degrees = finite(input, "forearm_max_deg", number)?;
    if degrees > 0.0 && degrees <= 90.0 {
        return Ok(degrees.to_radians());
    }
    let cause = format!("{degrees} is not an angle above 0 and up to 90 degrees");
    Err(fault_at(input, number, "forearm_max_deg", cause)
        .with_remedy("if the ball joints have no limit, delete the line"))
}

fn tolerance(input: &InputText, section: &ToleranceToml) -> Result<Tolerance<f64>, InputError> {
    let length = finite(input, "length_mm", &section.length_mm)?;
    let angle = finite(input, "angle_deg", &section.angle_deg)?;
    Tolerance::new(length, angle.to_radians()).map_err(|error| {
        let (key, number) = match error {
            ToleranceError::Angle => ("angle_deg", &section.angle_deg),
            _ => ("length_mm", &section.length_mm),
        };
        fault_at(input, number, key, error.to_string())
            .with_remedy("if the tolerance is not known, delete the whole section [tolerance]")
    })
}

/// Of positions; `None` if only other readings have a noise.
fn noise(
    input: &InputText,
    section: &Spanned<NoiseToml>,
) -> Result<Option<Noise<f64>>, InputError> {
    let line = input.line_at(section.span().start);
    let section = section.as_ref();
    let joint = finite(input, "joint_deg", &section.joint_deg)?;
    let Some(stated) = &section.position_mm else {
        if section.height_mm.is_none() && section.distance_mm.is_none() {
            let cause = "the key is missing";
            return Err(fault(input, line, "position_mm", cause));
        }
        return Ok(None);
    };
    let ByAxis(position) = stated.as_ref();
    let noise = Noise::by_axis(*position, joint.to_radians()).map_err(|error| {
        let cause = error.to_string();
        match error {
            NoiseError::Joint => fault_at(input, &section.joint_deg, "joint_deg", cause),
            _ => fault_at(input, stated, "position_mm", cause),
        }
        .with_remedy("if the noise is not known, delete the whole section [noise]")
    })?;
    Ok(Some(noise))
}

fn instruments(input: &InputText, toml: &RobotToml) -> Result<InstrumentFacts, InputError> {
    let mut facts = InstrumentFacts::default();
    if let Some(section) = &toml.noise {
        let section = section.as_ref();
        let of = |key: &str, number: &Option<Number>| match number {
            Some(number) => positive(input, key, number).map(Some),
            None => Ok(None),
        };
        facts.height_noise = of("height_mm", &section.height_mm)?;
        facts.distance_noise = of("distance_mm", &section.distance_mm)?;
        if section.position_mm.is_none() {
            let joint = finite(input, "joint_deg", &section.joint_deg)?;
            if !(joint >= 0.0) {
                let cause = NoiseError::Joint.to_string();
                return Err(fault_at(input, &section.joint_deg, "joint_deg", cause));
            }
            facts.joint_noise = Some(joint.to_radians());
        }
    }
    for (name, plane) in &toml.planes {
        let own = plane.as_ref();
        facts.planes.push(KnownPlane {
            name: name.clone(),
            line: input.line_at(plane.span().start),
            height: finite(input, "z_mm", &own.z_mm)?,
            sigma: positive(input, "sigma_mm", &own.sigma_mm)?,
        });
    }
    for (name, section) in &toml.points {
        facts.points.push(point(input, name, section)?);
    }
    if let Some(target) = &toml.target {
        facts.target = Some(Vector3::new(
            finite(input, "x_mm", &target.x_mm)?,
            finite(input, "y_mm", &target.y_mm)?,
            finite(input, "z_mm", &target.z_mm)?,
        ));
    }
    Ok(facts)
}

fn positive(input: &InputText, key: &str, number: &Number) -> Result<f64, InputError> {
    let value = finite(input, key, number)?;
    if value > 0.0 {
        return Ok(value);
    }
    let cause = format!("{value} is not greater than 0");
    Err(fault_at(input, number, key, cause).with_remedy("it is one standard deviation, in mm"))
}

fn point(
    input: &InputText,
    name: &str,
    section: &Spanned<PointToml>,
) -> Result<NamedPoint, InputError> {
    let own = section.as_ref();
    let line = input.line_at(section.span().start);
    let place = match (&own.x_mm, &own.y_mm, &own.z_mm, &own.sigma_mm) {
        (Some(x), Some(y), Some(z), Some(sigma)) => Some((
            Vector3::new(
                finite(input, "x_mm", x)?,
                finite(input, "y_mm", y)?,
                finite(input, "z_mm", z)?,
            ),
            positive(input, "sigma_mm", sigma)?,
        )),
        (None, None, None, None) => None,
        _ => {
            let cause = "a known place has all four of x_mm, y_mm, z_mm and sigma_mm";
            return Err(fault(input, line, &format!("[points.{name}]"), cause)
                .with_remedy("state all four, or none if the place is not known"));
        }
    };
    if let Some(offset) = &own.offset
        && offset.as_ref() != "unknown"
    {
        let cause = format!("\"{}\" is not \"unknown\"", offset.as_ref());
        return Err(fault_at(input, offset, "offset", cause).with_remedy(
            "subtract an offset that is known from the distances, and leave out the line",
        ));
    }
    Ok(NamedPoint {
        name: name.to_owned(),
        line,
        place,
        offset_unknown: own.offset.is_some(),
    })
}

fn sensor_frame(
    input: &InputText,
    section: &Spanned<SensorFrameToml>,
) -> Result<RigidTransform<f64>, InputError> {
    let frame = section.as_ref();
    let mut rotation = Matrix3::zeros();
    let mut translation = Vector3::zeros();
    for (i, row) in frame.rotation.iter().enumerate() {
        for (j, number) in row.iter().enumerate() {
            rotation[(i, j)] = finite(input, "rotation", number)?;
        }
        translation[i] = finite(input, "translation_mm", &frame.translation_mm[i])?;
    }
    let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    if !(off <= ROTATION_ERROR && rotation.determinant() > 0.0) {
        let [[first, ..], ..] = &frame.rotation;
        let cause = "the matrix is not a rotation: its rows must be orthogonal, of length 1, and \
                     right-handed";
        return Err(fault_at(input, first, "rotation", cause)
            .with_remedy("delete [sensor_frame]; `calibrate --frame sensor` finds it again"));
    }
    Ok(RigidTransform {
        rotation,
        translation,
    })
}
