mod geometry;

use super::RobotFile;
use super::instruments::{InstrumentFacts, KnownPlane, NamedPoint};
use super::messages::{
    SECTIONS, fault, fault_at, finite, foreign, required, syntax, table_instead,
};
use super::record::Record;
use super::schema::{
    ByAxis, JointsToml, NoiseToml, Number, PointToml, RobotToml, SensorFrameToml, ToleranceToml,
};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::geometry::sweep::reaches_anywhere;
use crate::text::words::count;
use delta_cal::calibration::ToleranceError;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::{JointLimits, JointLimitsError};
use delta_cal::robot::{Drive, TransmissionTolerance};
use delta_cal::samples::NoiseError;
use delta_cal::{Noise, Tolerance};
use geometry::{from_arms, symmetric};
use nalgebra::{Matrix3, Vector3};
use toml::Spanned;

/// A rotation read from a file may be off by its rounding, not by more than this.
const ROTATION_ERROR: f64 = 1e-6;

impl RobotFile {
    /// Reads a robot file.
    ///
    /// # Errors
    /// The first fault: TOML that does not parse, an unknown or missing key, a number that is not
    /// finite or not possible, a robot that reaches no pose within its joint limits.
    pub fn read(input: &InputText) -> Result<Self, InputError> {
        let toml: RobotToml = toml::from_str(input.text())
            .map_err(|e| table_instead(input).unwrap_or_else(|| syntax(input, &e)))?;
        let (robot, line) = match (&toml.nominal, toml.arm.as_deref()) {
            (Some(nominal), None) => (
                symmetric(input, nominal)?,
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
        let drive = robot.drive();
        let limits = joint_limits(input, drive, &toml.joints)?;
        let forearm_max = toml.joints.as_ref().forearm_max_deg.as_ref();
        if drive == Drive::Linear {
            foreign(input, drive, "forearm_max_deg", forearm_max)?;
        }
        let forearm_limit = match forearm_max {
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
        let instruments = instruments(input, drive, &toml)?;
        let transmission = match &toml.tolerance {
            Some(section) => transmission(input, drive, section.as_ref())?,
            None => None,
        };
        let record = Record::read(input, &toml)?;
        Ok(Self {
            name: input.name().to_owned(),
            robot,
            limits,
            forearm_limit,
            tolerance: toml
                .tolerance
                .map(|section| tolerance(input, drive, &section))
                .transpose()?,
            transmission,
            noise: match &toml.noise {
                Some(section) => noise(input, drive, section)?,
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

fn joint_limits(
    input: &InputText,
    drive: Drive,
    section: &Spanned<JointsToml>,
) -> Result<JointLimits<f64>, InputError> {
    let line = input.line_at(section.span().start);
    let joints = section.as_ref();
    let (keys, [low, high], others) = match drive {
        Drive::Rotary => (
            ["min_deg", "max_deg"],
            [&joints.min_deg, &joints.max_deg],
            [("min_mm", &joints.min_mm), ("max_mm", &joints.max_mm)],
        ),
        Drive::Linear => (
            ["min_mm", "max_mm"],
            [&joints.min_mm, &joints.max_mm],
            [("min_deg", &joints.min_deg), ("max_deg", &joints.max_deg)],
        ),
    };
    for (key, number) in others {
        foreign(input, drive, key, number.as_ref())?;
    }
    let (low, high) = (
        required(input, line, "[joints]", keys[0], low.as_ref())?,
        required(input, line, "[joints]", keys[1], high.as_ref())?,
    );
    let minimum = finite(input, keys[0], low)?;
    let maximum = finite(input, keys[1], high)?;
    let limits = match drive {
        Drive::Rotary => JointLimits::new(minimum.to_radians(), maximum.to_radians()),
        Drive::Linear => JointLimits::travel(minimum, maximum),
    };
    limits.map_err(|error| {
        let cause = match (error, drive) {
            (JointLimitsError::Empty, Drive::Rotary) => {
                format!("the largest joint angle, {maximum}, is not above the smallest, {minimum}")
            }
            (JointLimitsError::Empty, Drive::Linear) => {
                format!("the largest travel, {maximum}, is not above the smallest, {minimum}")
            }
            (error, _) => error.to_string(),
        };
        fault_at(input, high, keys[1], cause)
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

fn tolerance(
    input: &InputText,
    drive: Drive,
    section: &Spanned<ToleranceToml>,
) -> Result<Tolerance<f64>, InputError> {
    let line = input.line_at(section.span().start);
    let section = section.as_ref();
    let length = finite(input, "length_mm", &section.length_mm)?;
    let angle = finite(input, "angle_deg", &section.angle_deg)?;
    let mut stated = Tolerance::new(length, angle.to_radians());
    match drive {
        Drive::Rotary => {
            foreign(input, drive, "zero_mm", section.zero_mm.as_ref())?;
            foreign(input, drive, "scale", section.scale.as_ref())?;
            foreign(input, drive, "radius_mm", section.radius_mm.as_ref())?;
        }
        Drive::Linear => {
            let scale = required(input, line, "[tolerance]", "scale", section.scale.as_ref())?;
            let scale = finite(input, "scale", scale)?;
            let zero = match &section.zero_mm {
                Some(zero) => finite(input, "zero_mm", zero)?,
                None => length,
            };
            stated = stated.and_then(|own| own.with_linear(zero, scale));
            if let Some(radius) = &section.radius_mm {
                let radius = finite(input, "radius_mm", radius)?;
                stated = stated.and_then(|own| own.with_radius(radius));
            }
        }
    }
    stated.map_err(|error| {
        let of_error = match error {
            ToleranceError::Angle => ("angle_deg", Some(&section.angle_deg)),
            ToleranceError::Zero => ("zero_mm", section.zero_mm.as_ref()),
            ToleranceError::Scale => ("scale", section.scale.as_ref()),
            ToleranceError::Radius => ("radius_mm", section.radius_mm.as_ref()),
            _ => ("length_mm", None),
        };
        let (key, number) = match of_error {
            (key, Some(number)) => (key, number),
            _ => ("length_mm", &section.length_mm),
        };
        fault_at(input, number, key, error.to_string())
            .with_remedy("if the tolerance is not known, delete the whole section [tolerance]")
    })
}

/// What is known of transmissions that are to be found.
fn transmission(
    input: &InputText,
    drive: Drive,
    section: &ToleranceToml,
) -> Result<Option<TransmissionTolerance<f64>>, InputError> {
    const KEY: &str = "transmission_deg";
    let Some(stated) = &section.transmission_deg else {
        return Ok(None);
    };
    if drive == Drive::Linear {
        foreign(input, drive, KEY, Some(stated))?;
    }
    let degrees = finite(input, KEY, stated)?;
    let tolerance = TransmissionTolerance::new(degrees.to_radians());
    tolerance.map(Some).map_err(|_| {
        let cause = format!("{degrees} is not above 0 and below 5.7 degrees");
        fault_at(input, stated, KEY, cause)
            .with_remedy("if gears and encoders are exact, delete the line")
    })
}

/// Of positions; `None` if only other readings have a noise.
fn noise(
    input: &InputText,
    drive: Drive,
    section: &Spanned<NoiseToml>,
) -> Result<Option<Noise<f64>>, InputError> {
    let line = input.line_at(section.span().start);
    let (joint, key, number) = joint_noise(input, drive, section)?;
    let section = section.as_ref();
    let Some(stated) = &section.position_mm else {
        if section.height_mm.is_none() && section.distance_mm.is_none() {
            let cause = "the key is missing";
            return Err(fault(input, line, "position_mm", cause));
        }
        return Ok(None);
    };
    let ByAxis(position) = stated.as_ref();
    let noise = Noise::by_axis(*position, joint).map_err(|error| {
        let cause = error.to_string();
        match error {
            NoiseError::Joint => fault_at(input, number, key, cause),
            _ => fault_at(input, stated, "position_mm", cause),
        }
        .with_remedy("if the noise is not known, delete the whole section [noise]")
    })?;
    Ok(Some(noise))
}

/// In radians or mm, its key and where it stands.
fn joint_noise<'a>(
    input: &InputText,
    drive: Drive,
    section: &'a Spanned<NoiseToml>,
) -> Result<(f64, &'static str, &'a Number), InputError> {
    let line = input.line_at(section.span().start);
    let section = section.as_ref();
    let (key, own, (other_key, other)) = match drive {
        Drive::Rotary => (
            "joint_deg",
            &section.joint_deg,
            ("joint_mm", &section.joint_mm),
        ),
        Drive::Linear => (
            "joint_mm",
            &section.joint_mm,
            ("joint_deg", &section.joint_deg),
        ),
    };
    foreign(input, drive, other_key, other.as_ref())?;
    let number = required(input, line, "[noise]", key, own.as_ref())?;
    let stated = finite(input, key, number)?;
    let joint = match drive {
        Drive::Rotary => stated.to_radians(),
        Drive::Linear => stated,
    };
    Ok((joint, key, number))
}

fn instruments(
    input: &InputText,
    drive: Drive,
    toml: &RobotToml,
) -> Result<InstrumentFacts, InputError> {
    let mut facts = InstrumentFacts::default();
    if let Some(spanned) = &toml.noise {
        let section = spanned.as_ref();
        let of = |key: &str, number: &Option<Number>| match number {
            Some(number) => positive(input, key, number).map(Some),
            None => Ok(None),
        };
        facts.height_noise = of("height_mm", &section.height_mm)?;
        facts.distance_noise = of("distance_mm", &section.distance_mm)?;
        if section.position_mm.is_none() {
            let (joint, key, number) = joint_noise(input, drive, spanned)?;
            if !(joint >= 0.0) {
                let cause = NoiseError::Joint.to_string();
                return Err(fault_at(input, number, key, cause));
            }
            facts.joint_noise = Some(joint);
        }
    }
    for (name, plane) in &toml.planes {
        let own = plane.as_ref();
        facts.planes.push(KnownPlane {
            name: name.clone(),
            line: input.line_at(plane.span().start),
            height: finite(input, "z_mm", &own.z_mm)?,
            sigma: positive(input, "sigma_mm", &own.sigma_mm)?,
            tilt: match &own.tilt_deg {
                Some(tilt) => Some(positive(input, "tilt_deg", tilt)?.to_radians()),
                None => None,
            },
            blocks: match &own.blocks_mm {
                Some(blocks) => blocks_of(input, blocks)?,
                None => Vec::new(),
            },
        });
    }
    for (name, section) in &toml.points {
        facts.points.push(point(input, name, section)?);
    }
    if let Some(section) = &toml.distances {
        facts.lengths = Some(lengths(input, &section.length_mm)?);
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

/// Heights of gauge blocks.
fn blocks_of(input: &InputText, blocks: &Spanned<Vec<f64>>) -> Result<Vec<f64>, InputError> {
    let heights = blocks.as_ref();
    if !heights.is_empty() && heights.iter().all(|own| *own >= 0.0 && own.is_finite()) {
        return Ok(heights.clone());
    }
    let cause = "gauge blocks have heights of 0 mm (the bare plane) or more";
    Err(fault_at(input, blocks, "blocks_mm", cause).with_remedy("write blocks_mm = [0, 60, 120]"))
}

/// The shortest and the longest distance.
fn lengths(input: &InputText, lengths: &Spanned<[f64; 2]>) -> Result<(f64, f64), InputError> {
    let [shortest, longest] = *lengths.as_ref();
    if shortest > 0.0 && shortest <= longest && longest.is_finite() {
        return Ok((shortest, longest));
    }
    let cause = format!("[{shortest}, {longest}] is not the shortest and the longest distance");
    let remedy = "write length_mm = [100, 600], or [300, 300] for a bar of 300 mm";
    Err(fault_at(input, lengths, "length_mm", cause).with_remedy(remedy))
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
        lengths: match &own.length_mm {
            Some(stated) => Some(lengths(input, stated)?),
            None => None,
        },
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
