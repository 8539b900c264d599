//! From the text of a robot file to the robot.

use super::schema::{
    ByAxis, Kind, Linear, NoiseToml, Number, PointToml, Positive, RobotToml, Rotary,
    SensorFrameToml, Tag, Words, arm_key,
};
use super::{DatumPoint, InstrumentFacts, KnownPlane, NamedPoint, Record, RobotFile};
use crate::files::convention::Convention;
use crate::files::input::{InputError, InputText};
use crate::geometry::reaches_anywhere;
use crate::text::count;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::{Drive, GeometryError};
use delta_cal::{Noise, Robot};
use nalgebra::{Matrix3, Vector3};
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::ops::Range;
use toml::Spanned;

/// A rotation read from a file may be off by its rounding, not by more than this.
const ROTATION_ERROR: f64 = 1e-6;

const REMEDY: &str = "`delta-cal init --output -` prints a robot file with every key (with towers, \
                      add --kind linear); numbers have a decimal point, text stands in quotation marks";

impl RobotFile {
    /// Reads a robot file.
    ///
    /// # Errors
    /// The first fault: TOML that does not parse, an unknown or missing key, a number that is not finite or not
    /// possible, a robot that reaches no pose within its joint limits.
    pub fn read(input: &InputText) -> Result<Self, InputError> {
        match parse::<Tag>(input)?.drive() {
            Drive::Rotary => read::<Rotary>(input),
            Drive::Linear => read::<Linear>(input),
        }
    }
}

/// The keys of a file, or what the TOML reader finds wrong with them.
fn parse<T: DeserializeOwned>(input: &InputText) -> Result<T, InputError> {
    toml::from_str(input.text()).map_err(|error| {
        table_instead(input).unwrap_or_else(|| {
            let cause = error.message().trim().replace('\n', "; ");
            let fault = input.fault_at(error.span().unwrap_or_default(), cause);
            fault.with_remedy(REMEDY)
        })
    })
}

/// That a file which is no TOML is a table.
fn table_instead(input: &InputText) -> Option<InputError> {
    let mut lines = (1..).zip(input.text().lines());
    let (line, first) =
        lines.find(|(_, line)| !(line.trim().is_empty() || line.starts_with('#')))?;
    let is_table = !first.contains(['=', '[']) && first.contains([',', ';', '\t']);
    is_table.then(|| {
        let cause = "this looks like a table of samples, and a robot file is needed here";
        InputError::new(input.name(), cause)
            .at_line(line)
            .with_remedy("give the robot file first and the table after it; delta-cal init writes a robot file")
    })
}

fn read<K: Kind>(input: &InputText) -> Result<RobotFile, InputError> {
    let toml: RobotToml<K> = parse(input)?;
    let convention = match &toml.convention {
        Some(own) => section(input, own, |own| own.of(K::DRIVE))?,
        None => Convention::usual(K::DRIVE),
    };
    let (robot, place) = robot(input, &toml, &convention)?;
    let (limits, forearm_limit) = section(input, &toml.joints, |own| K::joints(own, &convention))?;
    if !reaches_anywhere(&robot, &limits) {
        let cause =
            "the geometry is impossible: the forearms do not meet anywhere within the joint limits";
        return Err(input
            .fault_at(place, cause)
            .with_remedy("check the lengths (in mm), the arms' azimuths and the [joints]"));
    }
    let (tolerance, transmission) = match &toml.tolerance {
        Some(own) => {
            let (tolerance, transmission) = section(input, own, K::tolerance)?;
            (Some(tolerance), transmission)
        }
        None => (None, None),
    };
    let mut instruments = InstrumentFacts {
        target: toml
            .target
            .as_ref()
            .map(|own| convention.vector(&Vector3::new(own.x_mm.0, own.y_mm.0, own.z_mm.0))),
        ..InstrumentFacts::default()
    };
    let noise = match &toml.noise {
        Some(own) => section(input, own, |own| {
            noise(own, robot.drive(), &mut instruments)
        })?,
        None => None,
    };
    for (name, spanned) in toml.planes {
        let own = spanned.as_ref();
        instruments.planes.push(KnownPlane {
            name,
            line: input.line_at(spanned.span().start),
            height: convention.vector(&Vector3::new(0.0, 0.0, own.z_mm.0)).z,
            sigma: own.sigma_mm.0,
            tilt: own.tilt_deg.map(super::schema::Number::radians),
            blocks: section(input, &spanned, |own| blocks(&own.blocks_mm))?,
        });
    }
    if let Some(distances) = &toml.distances {
        instruments.lengths = Some(section(input, distances, |own| lengths(own.length_mm))?);
    }
    for (name, own) in toml.points {
        let line = input.line_at(own.span().start);
        let point = section(input, &own, |own| point(name, line, own, &convention))?;
        instruments.points.push(point);
    }
    for (name, own) in toml.datum {
        let inside = |[x, y, z]: [Number; 3]| convention.vector(&Vector3::new(x.0, y.0, z.0));
        instruments.datum.push(DatumPoint {
            name,
            place: inside([own.x_mm, own.y_mm, own.z_mm]),
            seen: inside(own.sensor_mm),
        });
    }
    let sensor_frame = match &toml.sensor_frame {
        Some(own) => Some(section(input, own, |own| sensor_frame(own, &convention))?),
        None => None,
    };
    let text = |words: Option<Words>| words.map(|words| words.0);
    Ok(RobotFile {
        name: input.name().to_owned(),
        convention,
        robot,
        limits,
        forearm_limit,
        tolerance,
        transmission,
        noise,
        sensor_frame,
        platform_radius: match &toml.nominal {
            Some(nominal) => K::platform_radius(nominal.as_ref()),
            None => toml.platform.map(|own| own.radius_mm.0),
        },
        instruments,
        record: Record {
            name: text(toml.robot.name),
            serial: text(toml.robot.serial),
            operator: text(toml.measurement.operator),
            instrument: text(toml.measurement.instrument),
            date: text(toml.measurement.date),
        },
    })
}

/// What a section says, or a fault of the section.
fn section<S, T, E: Display>(
    input: &InputText,
    section: &Spanned<S>,
    read: impl FnOnce(&S) -> Result<T, E>,
) -> Result<T, InputError> {
    read(section.as_ref()).map_err(|cause| {
        let fault = input.fault_at(section.span(), cause.to_string());
        fault.with_remedy(REMEDY)
    })
}

/// The robot, and where the file begins to describe it.
fn robot<K: Kind>(
    input: &InputText,
    toml: &RobotToml<K>,
    convention: &Convention,
) -> Result<(Robot<f64>, Range<usize>), InputError> {
    match (&toml.nominal, toml.arm.as_deref()) {
        (Some(nominal), None) => {
            let robot = section(input, nominal, |own| {
                K::robot(own, convention).map_err(impossible)
            })?;
            Ok((robot, nominal.span()))
        }
        (None, Some([first, second, third])) => {
            let arm = |own| section(input, own, |own| K::arm(own).map_err(impossible));
            let arms = [arm(first)?, arm(second)?, arm(third)?];
            let robot = section(input, first, |_| Robot::new(arms).map_err(impossible))?;
            Ok((robot, first.span()))
        }
        (None, Some(arms)) => {
            let cause = format!(
                "the file has {} [[arm]], not 3",
                count(arms.len(), "section")
            );
            let place = arms.last().map_or(0..0, Spanned::span);
            Err(input.fault_at(place, cause).with_remedy(REMEDY))
        }
        (Some(nominal), Some(_)) => Err(input
            .fault_at(nominal.span(), "the file has both [nominal] and [[arm]]")
            .with_remedy("keep the one that describes the robot and delete the other")),
        (None, None) => Err(input
            .fault_at(0..0, "the file has neither [nominal] nor [[arm]]")
            .with_remedy(REMEDY)),
    }
}

fn impossible(error: GeometryError) -> String {
    let cause = match error {
        GeometryError::NonFinite(_) => "a number is too large".to_owned(),
        GeometryError::NotPositive(own) => format!("{} must be above 0", arm_key(own)),
        error => error.to_string(),
    };
    format!("the geometry is impossible: {cause}")
}

/// Of positions; `None` if the file states it of other readings only.
fn noise(
    toml: &NoiseToml,
    drive: Drive,
    facts: &mut InstrumentFacts,
) -> Result<Option<Noise<f64>>, String> {
    facts.height_noise = toml.height_mm.map(|own| own.0);
    facts.distance_noise = toml.distance_mm.map(|own| own.0);
    let joint = toml.joint(drive)?;
    // The joints' is checked in either case.
    let position = toml.position_mm.as_ref().map(ByAxis::values);
    let noise = Noise::by_axis(position.unwrap_or([1.0; 3]), joint);
    let noise = noise.map_err(|error| error.to_string())?;
    if position.is_some() {
        return Ok(Some(noise));
    }
    facts.joint_noise = Some(joint);
    Ok(None)
}

fn point(
    name: String,
    line: u64,
    toml: &PointToml,
    convention: &Convention,
) -> Result<NamedPoint, &'static str> {
    let place = match (toml.x_mm, toml.y_mm, toml.z_mm, toml.sigma_mm) {
        (Some(x), Some(y), Some(z), Some(sigma)) => {
            let place = convention.vector(&Vector3::new(x.0, y.0, z.0));
            Some((place, sigma.0))
        }
        (None, None, None, None) => None,
        _ => return Err("a known place needs all of x_mm, y_mm, z_mm and sigma_mm"),
    };
    Ok(NamedPoint {
        name,
        line,
        place,
        offset_unknown: toml.offset.is_some(),
        lengths: toml.length_mm.map(lengths).transpose()?,
    })
}

/// Heights of gauge blocks.
fn blocks(heights: &[Number]) -> Result<Vec<f64>, &'static str> {
    let heights: Vec<_> = heights.iter().map(|height| height.0).collect();
    if heights.iter().all(|height| *height >= 0.0) {
        Ok(heights)
    } else {
        Err("blocks_mm: a gauge block is 0 mm (the bare plane) high or more")
    }
}

/// The shortest and the longest distance.
fn lengths([shortest, longest]: [Positive; 2]) -> Result<(f64, f64), &'static str> {
    if shortest.0 <= longest.0 {
        Ok((shortest.0, longest.0))
    } else {
        Err("length_mm: the shortest distance comes first, then the longest")
    }
}

fn sensor_frame(
    toml: &SensorFrameToml,
    convention: &Convention,
) -> Result<RigidTransform<f64>, &'static str> {
    let rotation = Matrix3::from_fn(|row, column| toml.rotation[row][column].0);
    let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    if !(off <= ROTATION_ERROR && rotation.determinant() > 0.0) {
        return Err(
            "rotation is not a rotation matrix; `calibrate --frame sensor` finds the frame again",
        );
    }
    Ok(RigidTransform {
        rotation: convention.rotation(&rotation),
        translation: convention.vector(&Vector3::from(toml.translation_mm.map(|number| number.0))),
    })
}
