//! A robot: what a robot file says, and the kinematics of whole arrays.

use crate::arrays::{array, each_row};
use crate::errors::{input_error, value_error};
use crate::files::{dict, sha256};
use crate::lanes::{Derivatives, Exact, Forward, Inverse, Kernel, margin};
use crate::stated::{Stated, arms_of, limits_of, tolerance_of, with_transmissions};
use delta_cal::kinematics::KinematicsError;
use delta_cal::robot::{Arm, Drive};
use delta_cal::{ArmIndex, Noise, Robot as Geometry, SymmetricRobot};
use delta_cal_host::files::convention::{Convention, Three};
use delta_cal_host::files::kinematics;
use delta_cal_host::files::robot_file::Tool;
use delta_cal_host::geometry::hangs_below;
use delta_cal_host::{InputText, RobotFile};
use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use std::error::Error;
use std::fmt::Display;

/// The robot of `delta_cal/_robot.py`.
#[pyclass(frozen, module = "delta_cal._native")]
#[derive(Clone)]
pub(crate) struct Robot {
    pub(crate) file: RobotFile,
    /// The robot file.
    pub(crate) source: InputText,
}

/// Why a row has no pose.
type NoPose = Box<dyn Error>;

impl Robot {
    /// Of the text of a robot file.
    pub(crate) fn of_text(source: InputText) -> PyResult<Self> {
        let file = RobotFile::read(&source).map_err(|error| input_error(&error, None))?;
        Ok(Self { file, source })
    }

    /// A robot that has no file yet, made of these arguments.
    pub(crate) fn of_file(file: &RobotFile, comment: &str, arguments: &str) -> PyResult<Self> {
        Self::of_arguments(&file.name, &file.to_toml(comment), arguments)
    }

    fn of_arguments(name: &str, text: &str, arguments: &str) -> PyResult<Self> {
        let source = InputText::new(name, text);
        let file = RobotFile::read(&source).map_err(|mut error| {
            // Nobody has this text.
            (error.file, error.line) = (arguments.into(), None);
            input_error(&error, None)
        })?;
        Ok(Self { file, source })
    }

    /// Numbers of each row, `q` joints or `x` positions, in the type of the array.
    fn each<'py, K: Kernel<WIDTH>, const WIDTH: usize>(
        &self,
        (argument, rows): (&str, &Bound<'py, PyAny>),
        shape: &[usize],
        raise: bool,
        point: Option<&Tool>,
        compute: impl Fn(&[f64; 3]) -> Result<[f64; WIDTH], NoPose> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let angles = argument != "x" && self.file.robot.drive() == Drive::Rotary;
        let rows = (argument, rows, angles);
        let several = point.map(|own| (&self.file, own));
        if rows.1.cast::<PyArrayDyn<f32>>().is_ok() {
            each_row::<f32, WIDTH, K, _>(rows, shape, raise, several, compute)
        } else {
            each_row::<f64, WIDTH, K, _>(rows, shape, raise, several, compute)
        }
    }

    /// Derivatives of positions by the 24 parameters, row by row, and where there is room by the 15 numbers of transmissions,
    /// then by the twelve of the arms' rods, to first order, at a point of the platform.
    fn by_parameters<'py, const WIDTH: usize>(
        &self,
        q: &Bound<'py, PyAny>,
        point: [f64; 3],
        raise: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, robot) = (self.file.convention, &self.file.robot);
        let (axes, signs) = (convention.axes(), convention.signs());
        let (numbers, of_rods) = (convention.transmission([1.0; 5]), convention.rods([1.0; 4]));
        let (point, columns) = (convention.vector(&Vector3::from(point)), WIDTH / 3);
        let rods = self.file.parallelograms.filter(|_| columns > 39);
        self.each::<Exact, WIDTH>(("q", q), &[3, columns], raise, None, |q| {
            let q = convention.directed(q);
            let x = self.pose(&q)?;
            let own = robot.platform_jacobian(&x, &q)?.by_parameters;
            let more = robot.by_transmissions(&x, &q)?;
            let tilting = rods.map(|own| {
                let columns = own.columns(robot, (&x, &q), &point);
                columns.ok_or(KinematicsError::Parallel(ArmIndex::First))
            });
            let tilting = tilting.transpose()?;
            Ok(std::array::from_fn(|place| {
                let (row, column) = (place / columns, place % columns);
                let own = match column {
                    0..24 => signs[column % 8] * own[column / 8][(row, column % 8)],
                    24..39 => numbers[(column - 24) % 5] * more[(row, column - 24)],
                    _ => tilting.map_or(0.0, |own| {
                        of_rods[(column - 39) % 4] * own[(row, column - 39)]
                    }),
                };
                axes[row] * own
            }))
        })
    }

    fn pose(&self, q: &[f64; 3]) -> Result<Vector3<f64>, NoPose> {
        self.within_limits(q, self.file.robot.forward(q)?)
    }

    fn within_limits<T>(&self, q: &[f64; 3], found: T) -> Result<T, NoPose> {
        if outside(&self.file, q) {
            return Err("a joint is outside its limits".into());
        }
        Ok(found)
    }

    /// The platform point, a target by name, or a point at these coordinates.
    fn point(&self, target: Option<Target>) -> PyResult<Tool> {
        match target {
            None => Ok(self.file.platform_point()),
            Some(Target::Name(name)) => kinematics::target(&self.file, &name).map_err(|error| {
                let remedy = error.remedy.unwrap_or_default();
                value_error("target", format!("{name:?} is none; {remedy}"))
            }),
            Some(Target::Place(place)) => Ok(Tool {
                place: self.file.convention.vector(&Vector3::from(place)),
                ..self.file.platform_point()
            }),
        }
    }
}

#[derive(FromPyObject)]
enum Target {
    Name(String),
    Place([f64; 3]),
}

/// Arguments are checked in Python.
#[pymethods]
impl Robot {
    #[staticmethod]
    fn nominal(
        base_radius: f64,
        platform_radius: f64,
        upper_arm: f64,
        forearm: f64,
    ) -> PyResult<Self> {
        let names = "base_radius, platform_radius, upper_arm, forearm";
        let sheet = SymmetricRobot {
            base_radius,
            platform_radius,
            upper_arm,
            forearm,
        };
        let robot = sheet.robot().map_err(|error| value_error(names, error))?;
        let mut file = RobotFile::of("robot", robot, limits_of(ANY_LIMITS, Drive::Rotary)?);
        file.platform_radius = Some(platform_radius);
        Self::of_file(&file, "", names)
    }

    #[staticmethod]
    fn of_parameters(parameters: [[f64; 8]; 3], linear: bool) -> PyResult<Self> {
        let drive = if linear { Drive::Linear } else { Drive::Rotary };
        let arms = arms_of(&Convention::usual(drive), &parameters);
        let fault = |error| value_error("parameters", error);
        let arm = |own: [f64; 8]| match (drive, own) {
            (Drive::Rotary, own) => Arm::new(own),
            (Drive::Linear, [a, b, c, d, e, f, _, h]) => Arm::linear([a, b, c, d, e, f, h]),
        };
        let [one, two, three] = arms.map(arm);
        let robot = Geometry::new([
            one.map_err(fault)?,
            two.map_err(fault)?,
            three.map_err(fault)?,
        ]);
        let robot = robot.map_err(fault)?;
        let file = RobotFile::of("robot", robot, limits_of(ANY_LIMITS, drive)?);
        Self::of_file(&file, "", "parameters")
    }

    #[staticmethod]
    fn of_bytes(name: &str, bytes: &[u8]) -> PyResult<Self> {
        let text = InputText::from_bytes(name, bytes);
        Self::of_text(text.map_err(|error| input_error(&error, None))?)
    }

    /// Of sections, which these arguments changed.
    #[staticmethod]
    fn of_json(name: &str, json: &str, arguments: &str) -> PyResult<Self> {
        let fault = |error: &dyn Display| value_error(arguments, error);
        let whole: Value = serde_json::from_str(json).map_err(|error| fault(&error))?;
        let text = toml::to_string(&whole).map_err(|error| fault(&error))?;
        Self::of_arguments(name, &text, arguments)
    }

    /// The same robot in the convention of another.
    fn counted_as(&self, other: &Self) -> PyResult<Self> {
        let mut file = self.file.clone();
        file.convention = other.file.convention;
        Self::of_file(&file, "", "convention")
    }

    /// With what is stated in its place.
    fn replaced(&self, stated: Stated) -> PyResult<Self> {
        let mut file = self.file.clone();
        let drive = file.robot.drive();
        if let Some(parameters) = &stated.parameters {
            let arms = arms_of(&file.convention, parameters);
            let robot = file.robot.with_parameters(arms);
            file.robot = robot.map_err(|error| value_error("parameters", error))?;
        }
        if let Some(transmissions) = stated.transmissions {
            file.robot = with_transmissions(&file, transmissions)?;
        }
        if let Some([low, high]) = stated.limits {
            let (low, high) = file.convention.limits(low, high);
            file.limits = limits_of((low, high), drive)?;
        }
        if let Some((position, joint)) = stated.noise {
            let noise = Noise::by_axis(position, joint);
            file.noise = Some(noise.map_err(|error| value_error("noise", error))?);
        }
        if let Some(tolerance) = stated.tolerance {
            file.tolerance = Some(tolerance_of(tolerance, &file)?);
        }
        if let Some(zero) = stated.zero {
            if drive == Drive::Linear {
                return Err(value_error("zero", "the joints of this robot do not turn"));
            }
            let Some(tolerance) = file.tolerance else {
                return Err(value_error("zero", "needs a tolerance as well"));
            };
            let with_zero = tolerance.with_joint_zero(zero);
            file.tolerance = Some(with_zero.map_err(|error| value_error("zero", error))?);
        }
        if file == self.file {
            return Ok(self.clone());
        }
        Self::of_file(&file, "", &stated.names)
    }

    fn text(&self) -> (&str, &str) {
        (self.source.name(), self.source.text())
    }

    /// Sections of the file: JSON.
    fn json(&self) -> PyResult<String> {
        let sections = toml::from_str::<Value>(self.source.text());
        let sections = sections.map_err(|error| value_error("robot", error))?;
        Ok(sections.to_string())
    }

    fn forward<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        target: Option<Target>,
        strict: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, point) = (self.file.convention, self.point(target)?);
        self.each::<Forward, 3>(("q", q), &[3], strict, Some(&point), |q| {
            let q = convention.directed(q);
            let at = self.within_limits(&q, point.position(&self.file.robot, &q)?)?;
            Ok(convention.vector(&at).into())
        })
    }

    fn inverse<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        target: Option<Target>,
        strict: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, robot) = (self.file.convention, &self.file.robot);
        let point = self.point(target)?;
        self.each::<Inverse, 3>(("x", x), &[3], strict, Some(&point), |x| {
            let x = convention.vector(&Vector3::from(*x));
            let (q, platform) = point.joints(robot, &x)?;
            self.within_limits(&q, ())?;
            if !hangs_below(robot, &platform, &q) {
                return Err("the platform would be above its elbows".into());
            }
            Ok(convention.directed(&q))
        })
    }

    fn jacobian<'py>(&self, q: &Bound<'py, PyAny>, strict: bool) -> PyResult<Bound<'py, PyAny>> {
        let convention = self.file.convention;
        let (sense, axes) = (convention.sense(), convention.axes());
        let point = self.point(None)?;
        self.each::<Derivatives, 9>(("q", q), &[3, 3], strict, Some(&point), |q| {
            let q = convention.directed(q);
            let own = self.file.robot.platform_jacobian(&self.pose(&q)?, &q)?;
            Ok(std::array::from_fn(|place| {
                let (row, column) = (place / 3, place % 3);
                sense * axes[row] * own.by_joints[(row, column)]
            }))
        })
    }

    /// With transmissions, and at this point of the platform, mm, with rods as well.
    fn parameter_jacobian<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        transmissions: bool,
        rods_at: Option<[f64; 3]>,
        strict: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        match rods_at {
            Some(point) => self.by_parameters::<153>(q, point, strict),
            None if transmissions => self.by_parameters::<117>(q, [0.0; 3], strict),
            None => self.by_parameters::<72>(q, [0.0; 3], strict),
        }
    }

    /// The columns with `q` joints or `x` positions of a frame, and what converts them.
    fn columns(&self, argument: &str, names: Vec<String>) -> PyResult<Vec<(String, f64)>> {
        let (drive, convention) = (self.file.robot.drive(), self.file.convention);
        let (columns, example) = match (argument, drive) {
            ("x", _) => (Three::of_positions(&names), "x_mm, y_mm, z_mm"),
            (_, Drive::Rotary) => (Three::of_joints(drive, &names), "q1_rad, q2_rad, q3_rad"),
            (_, Drive::Linear) => (Three::of_joints(drive, &names), "s1_mm, s2_mm, s3_mm"),
        };
        let columns = columns.ok_or_else(|| {
            let wanted = format!("needs columns such as {example}, each once and with its unit");
            value_error(argument, wanted)
        })?;
        let factors = columns.inwards(&convention, [1.0; 3]).ok_or_else(|| {
            let cause = "counts need counts_per_deg in the robot's convention";
            value_error(argument, cause)
        })?;
        let factors = match argument {
            "x" => convention.vector(&factors.into()).into(),
            _ => convention.directed(&factors),
        };
        let names = columns.names().map(str::to_owned);
        Ok(names.into_iter().zip(factors).collect())
    }

    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let arms = self.file.robot.parameters();
        let stated = arms_of(&self.file.convention, &arms);
        array(py, stated.concat(), &[3, 8])
    }

    fn transmissions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let own = self.file.robot.transmissions().map(|own| own.numbers());
        let stated = own.map(|own| self.file.convention.transmission(own));
        array(py, stated.concat(), &[3, 5])
    }

    fn name(&self) -> &str {
        &self.file.name
    }

    /// What the properties of these names are; `noise` with σ of each axis.
    fn stated<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (low, high) = (self.file.limits.minimum(), self.file.limits.maximum());
        let linear = self.file.robot.drive() == Drive::Linear;
        let tolerance = self.file.tolerance;
        let sigmas = tolerance.map(|own| (own.length(), own.angle()));
        let noise = self.file.noise;
        Ok(dict!(py,
            "drive": if linear { "linear" } else { "rotary" },
            "limits": self.file.convention.limits(low, high),
            "tolerance": sigmas,
            "zero": tolerance.and_then(|own| own.joint_zero()),
            "noise": noise.map(|own| (own.position_by_axis(), own.joint())),
        ))
    }

    /// SHA-256 of all that the file says, 64 hexadecimal digits.
    pub(crate) fn fingerprint(&self) -> String {
        sha256(&self.file.to_toml(""))
    }
}

/// Whether a joint is farther outside the limits.
pub(crate) fn outside(robot: &RobotFile, joints: &[f64; 3]) -> bool {
    let margin = margin(robot);
    let (low, high) = (robot.limits.minimum(), robot.limits.maximum());
    joints
        .iter()
        .any(|own| *own < low - margin || *own > high + margin)
}

/// Limits of a robot before its own are stated.
const ANY_LIMITS: (f64, f64) = (-1.0, 1.0);
