//! A robot: what a robot file says, and the kinematics of whole arrays.

use crate::arrays::{array, each_row, in_numpy};
use crate::errors::{input_error, length, type_error, value_error};
use crate::files::{bytes_of, loads, sha256, write};
use crate::lanes::{Derivatives, Exact, Forward, Inverse, Kernel, margin};
use crate::stated::{Stated, arms_of, limits_of, merge, tolerance_of, with_transmissions};
use delta_cal::kinematics::KinematicsError;
use delta_cal::robot::{Arm, Drive};
use delta_cal::{ArmIndex, Noise, Parameter, Robot as Geometry, SymmetricRobot};
use delta_cal_host::files::convention::{Convention, Three};
use delta_cal_host::files::kinematics;
use delta_cal_host::files::robot_file::Tool;
use delta_cal_host::geometry::hangs_below;
use delta_cal_host::{InputText, RobotFile};
use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use std::error::Error;

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

    /// A robot that has no file yet.
    pub(crate) fn of_file(file: &RobotFile, comment: &str) -> PyResult<Self> {
        Self::of_text(InputText::new(&file.name, &file.to_toml(comment)))
    }

    /// With what is stated in its place.
    pub(crate) fn with(&self, stated: Stated) -> PyResult<Self> {
        let mut file = self.file.clone();
        let mut sections: serde_json::Map<String, Value> =
            serde_json::from_str(&stated.sections).unwrap_or_default();
        // The numbers of the file are in it.
        if let Some(convention) = sections.remove("convention") {
            let mut all = serde_json::Map::new();
            all.insert("convention".to_owned(), convention);
            file.convention = Self::of_file(&file, "")?.merged(all)?.file.convention;
        }
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
        let same = file == self.file;
        let own = if same {
            self.clone()
        } else {
            Self::of_file(&file, "")?
        };
        if sections.is_empty() {
            Ok(own)
        } else {
            own.merged(sections)
        }
    }

    /// With other keys in sections of its file.
    fn merged(&self, sections: serde_json::Map<String, Value>) -> PyResult<Self> {
        let names = sections.keys().cloned().collect::<Vec<_>>().join(", ");
        let mut whole = self.sections()?;
        merge(&mut whole, Value::Object(sections));
        let text = toml::to_string(&whole).map_err(|error| value_error("robot", error))?;
        let source = InputText::new(&self.file.name, &text);
        let file = RobotFile::read(&source).map_err(|mut error| {
            // Nobody has this text: the sections are arguments.
            (error.file, error.line) = (names.into(), None);
            input_error(&error, None)
        })?;
        Ok(Self { file, source })
    }

    /// The sections of its file.
    fn sections(&self) -> PyResult<Value> {
        toml::from_str(self.source.text()).map_err(|error| value_error("robot", error))
    }

    /// The columns with `q` joints or `x` positions of a frame, and what converts them.
    fn columns(&self, argument: &str, names: &[String]) -> PyResult<Vec<(String, f64)>> {
        let (drive, convention) = (self.file.robot.drive(), self.file.convention);
        let (columns, example) = match (argument, drive) {
            ("x", _) => (Three::of_positions(names), "x_mm, y_mm, z_mm"),
            (_, Drive::Rotary) => (Three::of_joints(drive, names), "q1_rad, q2_rad, q3_rad"),
            (_, Drive::Linear) => (Three::of_joints(drive, names), "s1_mm, s2_mm, s3_mm"),
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

    /// Numbers of each row: of `q` joints, of `x` positions, in the type of the array.
    fn each<'py, K: Kernel<WIDTH>, const WIDTH: usize>(
        &self,
        (argument, given): (&str, &Bound<'py, PyAny>),
        shape: &[usize],
        errors: &str,
        point: Option<&Tool>,
        compute: impl Fn(&[f64; 3]) -> Result<[f64; WIDTH], NoPose> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let raise = match errors {
            "raise" => true,
            "nan" => false,
            _ => return Err(value_error("errors", "\"nan\" or \"raise\" is needed")),
        };
        let angles = argument != "x" && self.file.robot.drive() == Drive::Rotary;
        let several = point.map(|own| (&self.file, own));
        if given.cast::<PyArrayDyn<f32>>().is_ok() {
            let rows = in_numpy(given.py(), "rows", (argument, given, "float32"))?;
            return each_row::<f32, WIDTH, K, _>(
                (argument, &rows, angles),
                shape,
                raise,
                several,
                compute,
            );
        }
        let rows = self.vectors(argument, given)?;
        each_row::<f64, WIDTH, K, _>((argument, &rows, angles), shape, raise, several, compute)
    }

    /// Derivatives of positions by the 24 parameters, row by row, and where there is room by the 15 numbers of transmissions.
    fn by_parameters<'py, const WIDTH: usize>(
        &self,
        q: &Bound<'py, PyAny>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, robot) = (self.file.convention, &self.file.robot);
        let (axes, signs) = (convention.axes(), convention.signs());
        let (numbers, columns) = (convention.transmission([1.0; 5]), WIDTH / 3);
        self.each::<Exact, WIDTH>(("q", q), &[3, columns], errors, None, |q| {
            let q = convention.directed(q);
            let x = self.pose(&q)?;
            let own = robot.platform_jacobian(&x, &q)?.by_parameters;
            let more = robot.by_transmissions(&x, &q)?;
            Ok(std::array::from_fn(|place| {
                let (row, column) = (place / columns, place % columns);
                let own = match column.checked_sub(24) {
                    None => signs[column % 8] * own[column / 8][(row, column % 8)],
                    Some(number) => numbers[number % 5] * more[(row, number)],
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
    fn point(&self, target: Option<&Bound<'_, PyAny>>) -> PyResult<Tool> {
        let Some(target) = target else {
            return Ok(self.file.platform_point());
        };
        if let Ok(name) = target.extract::<String>() {
            let found = kinematics::target(&self.file, &name);
            return found.map_err(|error| {
                let remedy = error.remedy.unwrap_or_default();
                value_error("target", format!("{name:?} is none; {remedy}"))
            });
        }
        let place = target.extract::<[f64; 3]>();
        let place =
            place.map_err(|_| value_error("target", "a name or (x, y, z) in mm is needed"))?;
        Ok(Tool {
            place: self.file.convention.vector(&Vector3::from(place)),
            ..self.file.platform_point()
        })
    }
}

#[pymethods]
impl Robot {
    /// A robot of a data sheet: three equal arms, 120° apart, arm 1 along +x.
    ///
    /// Parameters
    /// ----------
    /// base_radius, platform_radius, upper_arm, forearm : float
    ///     Base centre to motor axes, platform centre to forearm ends, and the two links, mm: `upper_arm=260`.
    /// limits : (float, float)
    ///     Smallest and largest joint angle, radians; positive angles swing the arm towards the platform: `limits=(-1.05, 1.57)`.
    /// tolerance : (float, float), optional
    ///     One σ of the lengths (mm) and angles (radians) of the parts as made, the prior: `tolerance=(0.5, 0.003)`.
    /// zero : float, optional
    ///     One σ of the joint zeros, radians, where they are less exact than the parts: `tolerance=(0.5, 0.003), zero=0.1`.
    /// noise : (float, float), optional
    ///     One σ of a measured coordinate (mm, or three) and of a joint angle (radians), the weights: `noise=((0.01, 0.01,
    ///     0.03), 3e-5)`.
    /// **sections : dict
    ///     Sections of the robot file with its keys and units, `noise` and `tolerance` among them; a key that is None is
    ///     removed: `target={"x_mm": 0, "y_mm": 0, "z_mm": -40}`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Lengths or limits that are impossible; the message begins with the argument.
    #[staticmethod]
    #[pyo3(
        signature = (*, base_radius, platform_radius, upper_arm, forearm, limits, **stated),
        text_signature = "(*, base_radius, platform_radius, upper_arm, forearm, limits, tolerance=None, zero=None, noise=None, **sections)"
    )]
    fn nominal<'py>(
        py: Python<'py>,
        base_radius: &Bound<'py, PyAny>,
        platform_radius: &Bound<'py, PyAny>,
        upper_arm: &Bound<'py, PyAny>,
        forearm: &Bound<'py, PyAny>,
        limits: &Bound<'py, PyAny>,
        stated: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Self> {
        let of = |argument, given: &Bound<'py, PyAny>| {
            let own = given
                .extract()
                .map_err(|_| type_error(argument, "a number is needed"))?;
            length(argument, own)
        };
        let sheet = SymmetricRobot {
            base_radius: of("base_radius", base_radius)?,
            platform_radius: of("platform_radius", platform_radius)?,
            upper_arm: of("upper_arm", upper_arm)?,
            forearm: of("forearm", forearm)?,
        };
        let robot = sheet.robot().map_err(|error| value_error("robot", error))?;
        let mut file = RobotFile::of("robot", robot, limits_of(ANY_LIMITS, Drive::Rotary)?);
        file.platform_radius = Some(sheet.platform_radius);
        Self::of_file(&file, "")?.with(Stated::of(py, stated, &[("limits", limits)])?)
    }

    /// A robot of its parameters.
    ///
    /// Parameters
    /// ----------
    /// parameters : array (3, 8)
    ///     A row an arm: Dx, Dy, Dz (mm), theta, alpha (radians), La_x, La_y, Lb (mm); of linear drives Dx, Dy, Dz (mm),
    ///     lean_x, lean_y (radians), scale, 0, Lb (mm): `parameters=robot.parameters`.
    /// limits : (float, float)
    ///     Smallest and largest joint, radians, or mm of travel: `limits=robot.limits`.
    /// transmissions : array (3, 5), optional
    ///     A row an arm: gain, then cos, sin, cos2, sin2 (radians); otherwise joints are exact: `transmissions=np.zeros((3, 5))`.
    /// drive : {"rotary", "linear"}
    ///     What moves the elbows: `drive="rotary"`.
    /// tolerance, zero, noise, sections
    ///     As of `nominal`: `tolerance=(0.5, 0.003)`.
    #[staticmethod]
    #[pyo3(
        signature = (parameters, *, limits, drive="rotary", **stated),
        text_signature = "(parameters, *, limits, transmissions=None, drive='rotary', tolerance=None, zero=None, noise=None, **sections)"
    )]
    fn from_parameters<'py>(
        py: Python<'py>,
        parameters: &Bound<'py, PyAny>,
        limits: &Bound<'py, PyAny>,
        drive: &str,
        stated: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Self> {
        let drive = match drive {
            "rotary" => Drive::Rotary,
            "linear" => Drive::Linear,
            _ => return Err(value_error("drive", "\"rotary\" or \"linear\" is needed")),
        };
        let more = [("parameters", parameters), ("limits", limits)];
        let stated = Stated::of(py, stated, &more)?;
        let parameters = stated.parameters.unwrap_or_default();
        let arms = arms_of(&Convention::usual(drive), &parameters);
        let fault = |error| value_error("parameters", error);
        match (drive, arms.iter().position(|arm| arm[6] != 0.0)) {
            // Upper arms of 1 mm are the scales of linear drives.
            (Drive::Rotary, None) if arms.iter().all(|arm| (arm[5] - 1.0).abs() < 0.5) => {
                let cause = "these are the parameters of linear drives; drive=\"linear\" is needed";
                return Err(value_error("parameters", cause));
            }
            (Drive::Linear, Some(arm)) => {
                let cause = format!("[{arm}, 6] is not 0; linear drives have seven parameters");
                return Err(value_error("parameters", cause));
            }
            _ => {}
        }
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
        Self::of_file(&file, "")?.with(stated)
    }

    /// Reads a robot file, with its convention, tolerance, noise and instruments.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     The file: `path="robot.toml"`.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     The first fault of the file, with its line and what to do.
    #[staticmethod]
    fn read(path: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (name, bytes) = bytes_of(path)?;
        let text = InputText::from_bytes(name, &bytes);
        Self::of_text(text.map_err(|error| input_error(&error, None))?)
    }

    /// A robot of the text of a robot file.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     The file's text: `text=robot.to_toml()`.
    /// name : str
    ///     What messages call it: `text=robot.to_toml(), name="robot"`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Its first fault, with its line and what to do.
    #[staticmethod]
    #[pyo3(signature = (text, *, name="robot"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        Self::of_text(InputText::new(name, text))
    }

    /// Writes the robot file, which `delta-cal` reads as well.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     The file: `path="calibrated.toml"`.
    fn write(&self, path: &Bound<'_, PyAny>) -> PyResult<()> {
        write(path, self.source.text())
    }

    /// The robot file: TOML.
    fn to_toml(&self) -> &str {
        self.source.text()
    }

    /// The sections of the robot file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        loads(py, &self.sections()?.to_string())
    }

    /// The same robot with something else; `None` keeps what it has.
    ///
    /// Parameters
    /// ----------
    /// parameters, limits, transmissions
    ///     As of `from_parameters`.
    /// tolerance, zero, noise, sections
    ///     As of `nominal`; `convention` counts the same robot in another way: `convention={"z_axis": "down"}`.
    #[pyo3(
        signature = (**stated),
        text_signature = "(self, *, parameters=None, limits=None, transmissions=None, tolerance=None, zero=None, noise=None, **sections)"
    )]
    fn replace<'py>(&self, py: Python<'py>, stated: Option<&Bound<'py, PyDict>>) -> PyResult<Self> {
        self.with(Stated::of(py, stated, &[])?)
    }

    /// Positions of the platform point, or of a target.
    ///
    /// Parameters
    /// ----------
    /// q : array (…, 3), or a frame with the columns of a samples file
    ///     Joint angles, radians: `q=[0.1, 0.2, 0.3]`.
    /// target : str or (3,), optional
    ///     A target of the robot file, "tool", or a point of the platform, mm: `target=(0, 0, -40)`.
    /// errors : {"nan", "raise"}
    ///     How to treat a row without a pose, out of reach, at a singularity, more than 1° outside the limits:
    ///     `errors="raise"`.
    ///
    /// Returns
    /// -------
    /// array (…, 3)
    ///     mm, float32 if `q` is. From 64 rows on they are computed several at once, float32 in 32 bits, and agree with
    ///     those of single rows to 1e-12, float32 to 1e-6, near singularities to 1e-4.
    #[pyo3(signature = (q, *, target=None, errors="nan"))]
    fn forward<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        target: Option<&Bound<'py, PyAny>>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, point) = (self.file.convention, self.point(target)?);
        self.each::<Forward, 3>(("q", q), &[3], errors, Some(&point), |q| {
            let q = convention.directed(q);
            let at = self.within_limits(&q, point.position(&self.file.robot, &q)?)?;
            Ok(convention.vector(&at).into())
        })
    }

    /// Joint angles, elbows out.
    ///
    /// Parameters
    /// ----------
    /// x : array (…, 3), or a frame with the columns of a samples file
    ///     Positions of the platform point, or of the target, mm: `x=[26.2, 14.9, -412.4]`.
    /// target
    ///     As of `forward`.
    /// errors : {"nan", "raise"}
    ///     How to treat a row that no joint angles within the limits reach: `errors="raise"`.
    ///
    /// Returns
    /// -------
    /// array (…, 3)
    ///     Radians.
    #[pyo3(signature = (x, *, target=None, errors="nan"))]
    fn inverse<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        target: Option<&Bound<'py, PyAny>>,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, robot) = (self.file.convention, &self.file.robot);
        let point = self.point(target)?;
        self.each::<Inverse, 3>(("x", x), &[3], errors, Some(&point), |x| {
            let x = convention.vector(&Vector3::from(*x));
            let (q, platform) = point.joints(robot, &x)?;
            self.within_limits(&q, ())?;
            if !hangs_below(robot, &platform, &q) {
                return Err("the platform would be above its elbows".into());
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
    /// array (…, 3, 3)
    ///     mm a radian: [..., i, j] is how x_i moves with q_j.
    #[pyo3(signature = (q, *, errors="nan"))]
    fn jacobian<'py>(&self, q: &Bound<'py, PyAny>, errors: &str) -> PyResult<Bound<'py, PyAny>> {
        let convention = self.file.convention;
        let (sense, axes) = (convention.sense(), convention.axes());
        let point = self.point(None)?;
        self.each::<Derivatives, 9>(("q", q), &[3, 3], errors, Some(&point), |q| {
            let q = convention.directed(q);
            let own = self.file.robot.platform_jacobian(&self.pose(&q)?, &q)?;
            Ok(std::array::from_fn(|place| {
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
    /// transmissions : bool
    ///     The 15 numbers of `transmissions` below them: `transmissions=True`.
    ///
    /// Returns
    /// -------
    /// array (…, 3, 24) or (…, 3, 39)
    ///     Without a unit, or mm a radian.
    #[pyo3(signature = (q, *, transmissions=false, errors="nan"))]
    fn parameter_jacobian<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        transmissions: bool,
        errors: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        if transmissions {
            self.by_parameters::<117>(q, errors)
        } else {
            self.by_parameters::<72>(q, errors)
        }
    }

    /// ∂x/∂n of the twelve numbers of the arms' rods, to first order, at a point of the platform, mm: array (…, 3, 12), mm per
    /// mm or radian. NaN at singularities; 0 if the spacing of the rods is not stated.
    #[pyo3(name = "_rods_jacobian")]
    fn rods_jacobian<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        point: [f64; 3],
    ) -> PyResult<Bound<'py, PyAny>> {
        let (convention, robot) = (self.file.convention, &self.file.robot);
        let (axes, signs) = (convention.axes(), convention.rods([1.0; 4]));
        let point = convention.vector(&Vector3::from(point));
        self.each::<Exact, 36>(("q", q), &[3, 12], "nan", None, |q| {
            let q = convention.directed(q);
            let x = self.pose(&q)?;
            let Some(rods) = &self.file.parallelograms else {
                return Ok([0.0; 36]);
            };
            let columns = rods.columns(robot, (&x, &q), &point);
            let columns = columns.ok_or(KinematicsError::Parallel(ArmIndex::First))?;
            Ok(std::array::from_fn(|place| {
                let (row, column) = (place / 12, place % 12);
                axes[row] * signs[column % 4] * columns[(row, column)]
            }))
        })
    }

    /// Rows of three numbers of an array or a frame: of `x` positions, of all else joints.
    #[pyo3(name = "_vectors")]
    pub(crate) fn vectors<'py>(
        &self,
        argument: &str,
        given: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = given.py();
        let frame = in_numpy(py, "framed", (given,))?;
        if frame.is_none() {
            return in_numpy(py, "rows", (argument, given));
        }
        let names = frame.getattr("columns")?.try_iter()?;
        let names = names
            .map(|name| Ok(name?.str()?.to_string()))
            .collect::<PyResult<Vec<_>>>()?;
        in_numpy(py, "in_units", (&frame, self.columns(argument, &names)?))
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

    /// One σ of a measured coordinate (mm, or of each axis where they differ) and of a joint (radians), or None.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyAny>, f64)>> {
        let Some(own) = self.file.noise else {
            return Ok(None);
        };
        let [x, y, z] = own.position_by_axis();
        let alike = [y, z].iter().all(|own| own.to_bits() == x.to_bits());
        let position = if alike {
            x.into_bound_py_any(py)
        } else {
            (x, y, z).into_bound_py_any(py)
        };
        Ok(Some((position?, own.joint())))
    }

    /// The errors of the joints: array (3, 5), a row an arm. The arm's angle is q + gain q + cos cos q + sin sin q +
    /// cos2 cos 2q + sin2 sin 2q, radians.
    #[getter]
    fn transmissions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let own = self.file.robot.transmissions().map(|own| own.numbers());
        let stated = own.map(|own| self.file.convention.transmission(own));
        array(py, stated.concat(), &[3, 5])
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
        sha256(&self.file.to_toml(""))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let again = py.import("delta_cal._native")?.getattr("robot_of_text")?;
        let text = self.source.text().to_owned();
        Ok((again, (self.source.name().to_owned(), text)))
    }

    fn __repr__(&self) -> String {
        let (low, high) = self.limits();
        let [arm, ..] = self.file.robot.arms();
        let unit = match self.file.robot.drive() {
            Drive::Rotary => "rad",
            Drive::Linear => "mm",
        };
        format!(
            "<delta_cal.Robot {}: {}, forearm {:.1} mm, joints {low:.3} to {high:.3} {unit}>",
            self.file.name,
            self.drive(),
            arm.lb()
        )
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let pages = slf.py().import("delta_cal._pages")?;
        pages.call_method1("robot", (slf,))
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
