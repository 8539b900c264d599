//! The arms of a robot file.

use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::messages::{fault, fault_at, finite, foreign, required};
use crate::files::robot_file::schema::{ArmToml, NominalToml, TRANSMISSION_KEYS, arm_key};
use delta_cal::robot::{
    Arm, Drive, GeometryError, ParameterKind, SymmetricLinearRobot, Transmission,
};
use delta_cal::{Parameter, Robot, SymmetricRobot};
use toml::Spanned;

const IMPOSSIBLE: &str = "check the number and its unit: lengths are in mm, angles in degrees";

/// The robot of [nominal].
pub(super) fn symmetric(
    input: &InputText,
    section: &Spanned<NominalToml>,
) -> Result<Robot<f64>, InputError> {
    let line = input.line_at(section.span().start);
    let nominal = section.as_ref();
    match &nominal.kind {
        Some(kind) if kind.as_ref() == "linear" => linear(input, line, nominal),
        Some(kind) if kind.as_ref() != "rotary" => {
            let cause = format!("\"{}\" is neither \"rotary\" nor \"linear\"", kind.as_ref());
            Err(fault_at(input, kind, "kind", cause))
        }
        _ => rotary(input, line, nominal),
    }
}

fn rotary(input: &InputText, line: u64, nominal: &NominalToml) -> Result<Robot<f64>, InputError> {
    let drive = Drive::Rotary;
    foreign(
        input,
        drive,
        "tower_radius_mm",
        nominal.tower_radius_mm.as_ref(),
    )?;
    foreign(input, drive, "tower_deg", nominal.tower_deg.as_ref())?;
    let get = |key, number| required(input, line, "[nominal]", key, number);
    let base_radius = get("base_radius_mm", nominal.base_radius_mm.as_ref())?;
    let platform_radius = get("platform_radius_mm", nominal.platform_radius_mm.as_ref())?;
    let upper_arm = get("upper_arm_mm", nominal.upper_arm_mm.as_ref())?;
    let forearm = get("forearm_mm", nominal.forearm_mm.as_ref())?;
    let geometry = SymmetricRobot {
        base_radius: finite(input, "base_radius_mm", base_radius)?,
        platform_radius: finite(input, "platform_radius_mm", platform_radius)?,
        upper_arm: finite(input, "upper_arm_mm", upper_arm)?,
        forearm: finite(input, "forearm_mm", forearm)?,
    };
    geometry.robot().map_err(|error| {
        let (key, number) = match error {
            GeometryError::RadiusInvalid if geometry.base_radius < 0.0 => {
                ("base_radius_mm", base_radius)
            }
            GeometryError::RadiusInvalid => ("platform_radius_mm", platform_radius),
            GeometryError::NotPositive(Parameter::Lb) | GeometryError::NonFinite(Parameter::Lb) => {
                ("forearm_mm", forearm)
            }
            GeometryError::NonFinite(Parameter::Dx | Parameter::Dy) => {
                ("base_radius_mm", base_radius)
            }
            _ => ("upper_arm_mm", upper_arm),
        };
        fault_at(input, number, key, impossible(error)).with_remedy(IMPOSSIBLE)
    })
}

fn linear(input: &InputText, line: u64, nominal: &NominalToml) -> Result<Robot<f64>, InputError> {
    let drive = Drive::Linear;
    foreign(
        input,
        drive,
        "base_radius_mm",
        nominal.base_radius_mm.as_ref(),
    )?;
    foreign(
        input,
        drive,
        "platform_radius_mm",
        nominal.platform_radius_mm.as_ref(),
    )?;
    foreign(input, drive, "upper_arm_mm", nominal.upper_arm_mm.as_ref())?;
    let get = |key, number| required(input, line, "[nominal]", key, number);
    let radius = get("tower_radius_mm", nominal.tower_radius_mm.as_ref())?;
    let forearm = get("forearm_mm", nominal.forearm_mm.as_ref())?;
    let geometry = SymmetricLinearRobot {
        tower_radius: finite(input, "tower_radius_mm", radius)?,
        forearm: finite(input, "forearm_mm", forearm)?,
    };
    let robot = match &nominal.tower_deg {
        None => geometry.robot(),
        Some(azimuths) => {
            let degrees = azimuths.as_ref();
            if let Some(wrong) = degrees.iter().find(|angle| !(angle.abs() <= 720.0)) {
                let cause = format!("{wrong} is not an azimuth between −720 and 720 degrees");
                return Err(fault_at(input, azimuths, "tower_deg", cause));
            }
            geometry.robot_at(degrees.map(f64::to_radians))
        }
    };
    robot.map_err(|error| {
        let (key, number) = match error {
            GeometryError::NotPositive(_) | GeometryError::NonFinite(Parameter::Lb) => {
                ("forearm_mm", forearm)
            }
            _ => ("tower_radius_mm", radius),
        };
        fault_at(input, number, key, impossible(error)).with_remedy(IMPOSSIBLE)
    })
}

/// The robot of three [[arm]]. The first tells the drive.
pub(super) fn from_arms(
    input: &InputText,
    arms: [&Spanned<ArmToml>; 3],
) -> Result<Robot<f64>, InputError> {
    let [first, ..] = arms;
    let drive = match first.as_ref().foreign_to(Drive::Rotary) {
        Some(_) => Drive::Linear,
        None => Drive::Rotary,
    };
    let [first, second, third] = arms.map(|section| arm(input, drive, section));
    Robot::new([first?, second?, third?]).map_err(|error| {
        let [section, ..] = arms;
        let line = input.line_at(section.span().start);
        fault(input, line, "[[arm]]", impossible(error))
    })
}

fn arm(
    input: &InputText,
    drive: Drive,
    section: &Spanned<ArmToml>,
) -> Result<Arm<f64>, InputError> {
    let line = input.line_at(section.span().start);
    let own = section.as_ref();
    if let Some((parameter, number)) = own.foreign_to(drive) {
        foreign(input, drive, arm_key(parameter), Some(number))?;
    }
    let number = |parameter: Parameter| {
        let key = arm_key(parameter);
        required(input, line, "[[arm]]", key, own.number(parameter))
    };
    let value = |parameter: Parameter| -> Result<f64, InputError> {
        let stated = finite(input, arm_key(parameter), number(parameter)?)?;
        Ok(match parameter.kind() {
            ParameterKind::Length | ParameterKind::Ratio => stated,
            ParameterKind::Angle => stated.to_radians(),
        })
    };
    let made = match drive {
        Drive::Rotary => {
            let mut parameters = [0.0; 8];
            for (entry, parameter) in parameters.iter_mut().zip(Parameter::ROTARY) {
                *entry = value(parameter)?;
            }
            let numbers = transmission(input, own)?;
            Transmission::new(numbers).and_then(|transmission| {
                let arm = Arm::new(parameters)?;
                arm.with_transmission(transmission)
            })
        }
        Drive::Linear => {
            for (key, number) in TRANSMISSION_KEYS.into_iter().zip(own.transmission()) {
                foreign(input, drive, key, number)?;
            }
            let mut parameters = [0.0; 7];
            for (entry, parameter) in parameters.iter_mut().zip(Parameter::LINEAR) {
                *entry = value(parameter)?;
            }
            Arm::linear(parameters)
        }
    };
    match made {
        Ok(arm) => Ok(arm),
        Err(error @ GeometryError::TransmissionTooLarge) => {
            let stated = TRANSMISSION_KEYS.into_iter().zip(own.transmission());
            let mut stated = stated.filter_map(|(key, number)| Some((key, number?)));
            let (key, line) = stated.next().map_or(("[[arm]]", line), |(key, number)| {
                (key, input.line_at(number.span().start))
            });
            Err(fault(input, line, key, impossible(error)).with_remedy(IMPOSSIBLE))
        }
        Err(error) => {
            let parameter = match error {
                GeometryError::NonFinite(parameter) | GeometryError::NotPositive(parameter) => {
                    parameter
                }
                GeometryError::TiltTooLarge => Parameter::Alpha,
                GeometryError::LeanTooLarge => Parameter::LeanX,
                _ => Parameter::Theta,
            };
            let cause = impossible(error);
            let fault = fault_at(input, number(parameter)?, arm_key(parameter), cause);
            Err(fault.with_remedy(IMPOSSIBLE))
        }
    }
}

/// gain, and the harmonics in radians; 0 where nothing is stated.
fn transmission(input: &InputText, arm: &ArmToml) -> Result<[f64; 5], InputError> {
    let mut numbers = [0.0; 5];
    let stated = TRANSMISSION_KEYS.into_iter().zip(arm.transmission());
    for (index, (own, (key, number))) in numbers.iter_mut().zip(stated).enumerate() {
        if let Some(number) = number {
            let value = finite(input, key, number)?;
            *own = if index == 0 {
                value
            } else {
                value.to_radians()
            };
        }
    }
    Ok(numbers)
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
