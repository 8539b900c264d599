//! A robot: what a robot file says, and the kinematics of whole arrays.

use crate::arrays::{array, each_row};
use crate::errors::{input_error, value_error};
use crate::files::{dict, sha256};
use crate::lanes::{Derivatives, Exact, Forward, Inverse, Kernel, margin};
use delta_cal::ArmIndex;
use delta_cal::kinematics::KinematicsError;
use delta_cal::robot::{Drive, Transmission};
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

    /// With other parameters and transmissions.
    fn with_arms(
        &self,
        parameters: Option<[[f64; 8]; 3]>,
        transmissions: Option<[[f64; 5]; 3]>,
    ) -> PyResult<Self> {
        let mut file = self.file.clone();
        if let Some(parameters) = &parameters {
            let arms = arms_of(&file.convention, parameters);
            let robot = file.robot.with_parameters(arms);
            file.robot = robot.map_err(|error| value_error("parameters", error))?;
        }
        if let Some(transmissions) = transmissions {
            let fault = |error| value_error("transmissions", error);
            let arms =
                transmissions.map(|own| Transmission::new(file.convention.transmission(own)));
            let [one, two, three] = arms.map(|own| own.map_err(fault));
            let robot = file.robot.with_transmissions([one?, two?, three?]);
            file.robot = robot.map_err(fault)?;
        }
        if file == self.file {
            return Ok(self.clone());
        }
        let names = match transmissions {
            None => "parameters",
            Some(_) => "parameters, transmissions",
        };
        Self::of_file(&file, "", names)
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

/// The parameters of three arms, from a convention to the internal axes and back; no zero is negative.
fn arms_of(convention: &Convention, arms: &[[f64; 8]; 3]) -> [[f64; 8]; 3] {
    let signs = convention.signs();
    arms.map(|arm| std::array::from_fn(|place| signs[place] * arm[place] + 0.0))
}
