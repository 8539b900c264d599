//! A robot: what a robot file says, and the kinematics of whole arrays.

use crate::arrays::{
    Rows, array, as_table, each_row, hexadecimal, is_frame, numbers, outside, radians, rows,
    rows_of,
};
use crate::errors::{input_error, value_error};
use delta_cal::kinematics::{JointLimits, KinematicsError};
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Noise, Parameter, Robot as Geometry, SymmetricRobot, Tolerance};
use delta_cal_host::files::convention::Convention;
use delta_cal_host::geometry::hangs_below;
use delta_cal_host::{InputText, RobotFile, read_joints, read_positions};
use nalgebra::Vector3;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use sha2::{Digest, Sha256};
use std::fmt;
use std::path::PathBuf;

/// A Delta robot: geometry, joint limits, convention, tolerance, noise.
///
/// Arrays are in millimetres and radians, in the directions and axes of the robot file's `[convention]`; of a robot
/// with linear drives joints are travels in millimetres. Two robots are equal if all that their files say is, whatever
/// the names of the files.
///
/// Examples
/// --------
/// >>> import delta_cal as dc
/// >>> robot = dc.Robot.nominal(base_radius=194, platform_radius=30, upper_arm=260, forearm=480, limits=(-1.05, 1.57))
/// >>> robot.forward([[0.1, 0.2, 0.3]]).round(1).tolist()
/// [[26.2, 14.9, -412.4]]
#[pyclass(frozen, eq, hash, module = "delta_cal")]
pub(crate) struct Robot {
    pub(crate) file: RobotFile,
    /// The robot file.
    pub(crate) source: InputText,
}

/// Why a row has no pose.
enum NoPose {
    Kinematics(KinematicsError),
    Limits,
    AboveElbows,
}

impl fmt::Display for NoPose {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kinematics(error) => error.fmt(formatter),
            Self::Limits => formatter.write_str("a joint is outside its limits"),
            Self::AboveElbows => formatter.write_str("the platform would be above its elbows"),
        }
    }
}

impl From<KinematicsError> for NoPose {
    fn from(error: KinematicsError) -> Self {
        Self::Kinematics(error)
    }
}

impl Robot {
    /// Of the text of a robot file.
    pub(crate) fn of_text(source: InputText) -> PyResult<Self> {
        let file = RobotFile::read(&source).map_err(|error| input_error(&error, None))?;
        Ok(Self { file, source })
    }

    /// A robot that has no file yet.
    pub(crate) fn of_file(file: &RobotFile, comment: &str) -> PyResult<Self> {
        Self::of_text(InputText::new(&file.name, &file.to_toml(comment)))
    }

    /// With what is stated beside it.
    pub(crate) fn known(
        &self,
        noise: Option<&Bound<'_, PyAny>>,
        tolerance: Option<(f64, f64)>,
        zero: Option<f64>,
    ) -> PyResult<Self> {
        let Self { file, source } = self;
        let mut file = file.clone();
        if let Some(noise) = noise {
            file.noise = Some(noise_of(noise)?);
        }
        if let Some((length, angle)) = tolerance {
            let new = Tolerance::new(length, angle);
            let new = new.map_err(|error| value_error("tolerance", error))?;
            let old = file.tolerance;
            let kept = match (file.robot.drive(), old) {
                (Drive::Linear, Some(old)) => new
                    .with_linear(old.of(Parameter::Zero), old.of(Parameter::Scale))
                    .and_then(|own| own.with_radius(old.radius()))
                    .and_then(|own| own.with_forearm(old.forearm())),
                _ => match old.and_then(|own| own.joint_zero()) {
                    Some(zero) => new.with_joint_zero(zero),
                    None => Ok(new),
                },
            };
            file.tolerance = Some(kept.map_err(|error| value_error("tolerance", error))?);
        }
        if let Some(zero) = zero {
            if file.robot.drive() == Drive::Linear {
                return Err(value_error("zero", "the joints of this robot do not turn"));
            }
            let Some(tolerance) = file.tolerance else {
                return Err(value_error("zero", "needs a tolerance as well"));
            };
            let with_zero = tolerance.with_joint_zero(zero);
            file.tolerance = Some(with_zero.map_err(|error| value_error("zero", error))?);
        }
        if file == self.file {
            return Ok(Self {
                file,
                source: source.clone(),
            });
        }
        Self::of_file(&file, "")
    }

    /// Joints in the controller's direction.
    pub(crate) fn joints<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Rows<'py>> {
        let drive = self.file.robot.drive();
        if !is_frame(given)? {
            let own = rows("q", given)?;
            radians("q", own.get()?, drive)?;
            return Ok(own);
        }
        let read = read_joints(&as_table("q", given)?, &self.file);
        let read = read.map_err(|error| input_error(&error, Some("q")))?;
        let convention = self.file.convention;
        let rows = read.iter().map(|row| convention.directed(&row.value));
        rows_of(given.py(), rows)
    }

    /// Positions in the controller's axes.
    pub(crate) fn positions<'py>(&self, given: &Bound<'py, PyAny>) -> PyResult<Rows<'py>> {
        if !is_frame(given)? {
            return rows("x", given);
        }
        let read = read_positions(&as_table("x", given)?, &self.file.convention);
        let read = read.map_err(|error| input_error(&error, Some("x")))?;
        let convention = self.file.convention;
        let rows = read.iter().map(|row| convention.vector(&row.value).into());
        rows_of(given.py(), rows)
    }

    fn pose(&self, q: &[f64; 3]) -> Result<Vector3<f64>, NoPose> {
        let at = self.file.robot.forward(q)?;
        if outside(&self.file, q) {
            return Err(NoPose::Limits);
        }
        Ok(at)
    }
}

/// "raise" or "nan".
fn raises(errors: &str) -> PyResult<bool> {
    match errors {
        "raise" => Ok(true),
        "nan" => Ok(false),
        _ => Err(value_error("errors", "\"nan\" or \"raise\" is needed")),
    }
}

/// (σ of a coordinate in mm, or of each axis, σ of a joint).
fn noise_of(noise: &Bound<'_, PyAny>) -> PyResult<Noise<f64>> {
    let wanted = || {
        let cause = "(position, joint) is needed: standard uncertainties in mm and radians";
        value_error("noise", cause)
    };
    let (position, joint): (Bound<'_, PyAny>, f64) = noise.extract().map_err(|_| wanted())?;
    let noise = match position.extract::<f64>() {
        Ok(position) => Noise::new(position, joint),
        Err(_) => Noise::by_axis(position.extract().map_err(|_| wanted())?, joint),
    };
    noise.map_err(|error| value_error("noise", error))
}

fn limits_of((low, high): (f64, f64), drive: Drive) -> PyResult<JointLimits<f64>> {
    let limits = match drive {
        Drive::Rotary => JointLimits::new(low, high),
        Drive::Linear => JointLimits::travel(low, high),
    };
    limits.map_err(|error| {
        let unit = match drive {
            Drive::Rotary => " (radians)",
            Drive::Linear => " (mm)",
        };
        value_error("limits", format!("{error}{unit}"))
    })
}

#[pymethods]
impl Robot {
    /// A robot of a data sheet: three equal arms, 120° apart, arm 1 along +x.
    ///
    /// Parameters
    /// ----------
    /// base_radius, platform_radius, upper_arm, forearm : float
    ///     Base centre to motor axes, platform centre to forearm ends, and the two links, mm.
    /// limits : (float, float)
    ///     Smallest and largest joint angle, radians; positive angles swing the arm towards the platform.
    /// tolerance : (float, float), optional
    ///     One σ of the lengths (mm) and angles (radians) of the parts as made: the prior.
    /// zero : float, optional
    ///     One σ of the joint zeros, radians, where they are less exact than the parts.
    /// noise : (float, float), optional
    ///     One σ of a measured coordinate (mm, or three) and of a joint angle (radians): the weights.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Lengths or limits that are impossible; the message begins with the argument.
    #[staticmethod]
    #[pyo3(signature = (*, base_radius, platform_radius, upper_arm, forearm, limits, tolerance=None, zero=None, noise=None))]
    fn nominal(
        base_radius: f64,
        platform_radius: f64,
        upper_arm: f64,
        forearm: f64,
        limits: (f64, f64),
        tolerance: Option<(f64, f64)>,
        zero: Option<f64>,
        noise: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let lengths = [
            ("base_radius", base_radius),
            ("platform_radius", platform_radius),
            ("upper_arm", upper_arm),
            ("forearm", forearm),
        ];
        for (name, length) in lengths {
            if !(length > 0.0 && length.is_finite()) {
                let cause = format!("{length}; a length above 0 mm is needed");
                return Err(value_error(name, cause));
            }
        }
        let robot = SymmetricRobot {
            base_radius,
            platform_radius,
            upper_arm,
            forearm,
        };
        let robot = robot.robot().map_err(|error| value_error("robot", error))?;
        let mut file = RobotFile::of("robot", robot, limits_of(limits, Drive::Rotary)?);
        file.platform_radius = Some(platform_radius);
        Self::of_file(&file, "")?.known(noise, tolerance, zero)
    }

    /// A robot of its 24 parameters.
    ///
    /// Parameters
    /// ----------
    /// parameters : array (3, 8)
    ///     Dx, Dy, Dz (mm), theta, alpha (radians), La_x, La_y, Lb (mm) of each arm.
    /// limits, tolerance, zero, noise
    ///     As of `nominal`.
    #[staticmethod]
    #[pyo3(signature = (parameters, *, limits, tolerance=None, zero=None, noise=None))]
    fn from_parameters(
        parameters: &Bound<'_, PyAny>,
        limits: (f64, f64),
        tolerance: Option<(f64, f64)>,
        zero: Option<f64>,
        noise: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let given = numbers("parameters", parameters)?;
        if given.shape() != [3, 8] {
            let cause = format!(
                "shape {:?}; an array of shape (3, 8) is needed",
                given.shape()
            );
            return Err(value_error("parameters", cause));
        }
        let (arms, _) = given.as_slice()?.as_chunks::<8>();
        let arms = std::array::from_fn(|arm| arms[arm]);
        let robot = Geometry::from_parameters(arms);
        let robot = robot.map_err(|error| value_error("parameters", error))?;
        let file = RobotFile::of("robot", robot, limits_of(limits, Drive::Rotary)?);
        Self::of_file(&file, "")?.known(noise, tolerance, zero)
    }

    /// Reads a robot file, with its convention, tolerance, noise and instruments.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     The first fault of the file, with its line and what to do.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let bytes = std::fs::read(&path)?;
        let text = InputText::from_bytes(path.display().to_string(), &bytes);
        Self::of_text(text.map_err(|error| input_error(&error, None))?)
    }

    /// Writes the robot file, which `delta-cal` reads as well.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, self.source.text())?)
    }

    /// The robot file: TOML.
    fn to_toml(&self) -> &str {
        self.source.text()
    }

    /// The same robot with other standard uncertainties; `None` keeps what it has.
    ///
    /// Parameters
    /// ----------
    /// noise, tolerance, zero
    ///     As of `nominal`.
    #[pyo3(signature = (*, noise=None, tolerance=None, zero=None))]
    fn replace(
        &self,
        noise: Option<&Bound<'_, PyAny>>,
        tolerance: Option<(f64, f64)>,
        zero: Option<f64>,
    ) -> PyResult<Self> {
        self.known(noise, tolerance, zero)
    }

    /// Positions of the platform point.
    ///
    /// Parameters
    /// ----------
    /// q : array (n, 3) or (3,), or a frame with the columns of a samples file
    ///     Joint angles, radians.
    /// errors : {"nan", "raise"}
    ///     How to treat a row without a pose: out of reach, at a singularity, more than 1° outside the limits.
    ///
    /// Returns
    /// -------
    /// array (n, 3) or (3,)
    ///     mm.
    #[pyo3(signature = (q, *, errors="nan"))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let convention = self.file.convention;
        each_row(py, "q", &self.joints(q)?, &[3], raises(errors)?, |q| {
            let at = self.pose(&convention.directed(q))?;
            Ok::<[f64; 3], NoPose>(convention.vector(&at).into())
        })
    }

    /// Joint angles, elbows out.
    ///
    /// Parameters
    /// ----------
    /// x : array (n, 3) or (3,), or a frame with the columns of a samples file
    ///     Positions of the platform point, mm.
    /// errors : {"nan", "raise"}
    ///     How to treat a row that no joint angles within the limits reach.
    ///
    /// Returns
    /// -------
    /// array (n, 3) or (3,)
    ///     Radians.
    #[pyo3(signature = (x, *, errors="nan"))]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        x: &Bound<'py, PyAny>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, robot) = (self.file.convention, &self.file.robot);
        each_row(py, "x", &self.positions(x)?, &[3], raises(errors)?, |x| {
            let x = convention.vector(&Vector3::from(*x));
            let q = robot.inverse(&x)?;
            if outside(&self.file, &q) {
                return Err(NoPose::Limits);
            }
            if !hangs_below(robot, &x, &q) {
                return Err(NoPose::AboveElbows);
            }
            Ok(convention.directed(&q))
        })
    }

    /// ∂x/∂q.
    ///
    /// Parameters
    /// ----------
    /// q, errors
    ///     As of `forward`; NaN also at singularities.
    ///
    /// Returns
    /// -------
    /// array (n, 3, 3) or (3, 3)
    ///     mm a radian: [..., i, j] is how x_i moves with q_j.
    #[pyo3(signature = (q, *, errors="nan"))]
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let convention = self.file.convention;
        let (sense, axes) = (convention.sense(), convention.axes());
        each_row(py, "q", &self.joints(q)?, &[3, 3], raises(errors)?, |q| {
            let q = convention.directed(q);
            let own = self.file.robot.platform_jacobian(&self.pose(&q)?, &q)?;
            Ok::<[f64; 9], NoPose>(std::array::from_fn(|place| {
                let (row, column) = (place / 3, place % 3);
                sense * axes[row] * own.by_joints[(row, column)]
            }))
        })
    }

    /// ∂x/∂p of the 24 parameters, arm by arm in the order of `parameters`.
    ///
    /// Parameters
    /// ----------
    /// q, errors
    ///     As of `forward`; NaN also at singularities.
    ///
    /// Returns
    /// -------
    /// array (n, 3, 24) or (3, 24)
    ///     Without a unit, or mm a radian.
    #[pyo3(signature = (q, *, errors="nan"))]
    fn parameter_jacobian<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let convention = self.file.convention;
        let (axes, signs) = (convention.axes(), convention.signs());
        each_row(py, "q", &self.joints(q)?, &[3, 24], raises(errors)?, |q| {
            let q = convention.directed(q);
            let own = self.file.robot.platform_jacobian(&self.pose(&q)?, &q)?;
            Ok::<[f64; 72], NoPose>(std::array::from_fn(|place| {
                let (row, column) = (place / 24, place % 24);
                axes[row] * signs[column % 8] * own.by_parameters[column / 8][(row, column % 8)]
            }))
        })
    }

    /// The 24 parameters: array (3, 8), a row an arm. Dx, Dy, Dz (mm), theta, alpha (radians), La_x, La_y, Lb (mm); of
    /// linear drives Dx, Dy, Dz (mm), lean_x, lean_y (radians), scale, 0, Lb (mm).
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parameters_of(py, &self.file.robot, &self.file.convention)
    }

    /// Smallest and largest joint, radians (mm of travel), in the controller's direction.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        let own = self.file.limits;
        self.file.convention.limits(own.minimum(), own.maximum())
    }

    /// One σ of lengths (mm) and angles (radians) as made, or None.
    #[getter]
    fn tolerance(&self) -> Option<(f64, f64)> {
        let own = self.file.tolerance?;
        Some((own.of(Parameter::Lb), own.of(Parameter::Theta)))
    }

    /// One σ of the joint zeros, radians, or None.
    #[getter]
    fn zero(&self) -> Option<f64> {
        self.file.tolerance?.joint_zero()
    }

    /// One σ of a measured coordinate (mm, rms over the axes) and of a joint (radians), or None.
    #[getter]
    fn noise(&self) -> Option<(f64, f64)> {
        let own = self.file.noise?;
        Some((own.position(), own.joint()))
    }

    /// The name of its file.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    /// "rotary" or "linear".
    #[getter]
    fn drive(&self) -> &'static str {
        match self.file.robot.drive() {
            Drive::Rotary => "rotary",
            Drive::Linear => "linear",
        }
    }

    /// SHA-256 of all that the file says, 64 hexadecimal digits.
    #[getter]
    pub(crate) fn fingerprint(&self) -> String {
        hexadecimal(Sha256::digest(self.file.to_toml("")))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let again = py.import("delta_cal._native")?.getattr("robot_of_text")?;
        let text = self.source.text().to_owned();
        Ok((again, (self.source.name().to_owned(), text)))
    }

    fn __repr__(&self) -> String {
        let mut text = format!("<delta_cal.Robot {}, {}", self.file.name, self.drive());
        for (arm, index) in self.file.robot.arms().iter().zip(ArmIndex::ALL) {
            let values = arm.drive().parameters().iter().map(|own| {
                let decimals = 4;
                let value = self.file.convention.parameter(*own, arm.get(*own));
                format!("{} {value:.decimals$}", own.symbol())
            });
            let values = values.collect::<Vec<_>>().join(", ");
            text = format!("{text}\n  arm {}: {values}", index.index() + 1);
        }
        text + ">"
    }
}

/// The 24 parameters of a robot in its file's convention: array (3, 8).
pub(crate) fn parameters_of<'py>(
    py: Python<'py>,
    robot: &Geometry<f64>,
    convention: &Convention,
) -> PyResult<Bound<'py, PyAny>> {
    let signs = convention.signs();
    let own = robot.parameters().into_iter();
    let stated = own.flat_map(|arm| std::array::from_fn::<_, 8, _>(|at| signs[at] * arm[at] + 0.0));
    array(py, stated.collect(), &[3, 8])
}

/// Of the name and text of a robot file.
#[pyfunction]
pub(crate) fn robot_of_text(name: &str, text: &str) -> PyResult<Robot> {
    Robot::of_text(InputText::new(name, text))
}
