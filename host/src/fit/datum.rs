//! The sensor's frame from points on the machine that the sensor measured too.

use super::Frame;
use super::solution::{MOST, Solution};
use crate::files::input::InputError;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{READINGS, Readings};
use crate::text::count;
use delta_cal::frame::RigidTransform;
use nalgebra::{DMatrix, Matrix3, Matrix6, SMatrix, Vector3};

/// Fewest points that determine a frame.
const LEAST: usize = 3;
/// A datum with residuals of this many σ contains a wrong point.
const MOST_SIGMAS: f64 = 5.0;

/// Transformation from the robot's base frame to the sensor's, from the points of `[datum]`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Datum {
    pub(crate) frame: RigidTransform<f64>,
    places: Vec<Vector3<f64>>,
    /// Residual of each point, mm.
    pub(crate) residuals: Vec<(String, f64)>,
}

impl Datum {
    /// `None` if the robot file has no `[datum]`.
    ///
    /// # Errors
    /// Positions that are not in the sensor's frame; points that determine no frame or disagree with the sensor.
    pub(crate) fn of(robot: &RobotFile, frame: Frame) -> Result<Option<Self>, InputError> {
        let fault = |cause: String| {
            InputError::new(&robot.name, cause)
                .at_key("[datum]")
                .with_remedy(
                    "measure three or more points of the machine, far apart, with the sensor where it stands",
                )
        };
        let points = &robot.instruments.datum;
        if points.is_empty() {
            return Ok(None);
        }
        if frame == Frame::Base {
            let cause = "the section says where the sensor stands, and the positions are taken as in the robot's frame";
            return Err(InputError::new(&robot.name, cause)
                .at_key("[datum]")
                .with_remedy("use --frame sensor, or delete the section"));
        }
        if points.len() < LEAST {
            let cause = format!(
                "{} do not fix a frame: at least {LEAST} are needed",
                count(points.len(), "datum point")
            );
            return Err(fault(cause));
        }
        let pairs = points.iter().map(|point| (point.place, point.seen));
        let on_a_line = "the datum points lie on a line, so they do not fix a frame";
        let frame = RigidTransform::align(pairs).map_err(|_| fault(on_a_line.to_owned()))?;
        let residuals = points.iter().map(|point| {
            let off = (point.seen - frame.apply(&point.place)).norm();
            (point.name.clone(), off)
        });
        let datum = Self {
            frame,
            places: points.iter().map(|point| point.place).collect(),
            residuals: residuals.collect(),
        };
        let rms = datum.rms();
        let worst = datum.residuals.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        if let (Some((point, off)), Some(noise)) = (worst, &robot.noise)
            && rms > MOST_SIGMAS * noise.position()
        {
            return Err(fault(format!(
                "the datum points do not fit the sensor's measurements ({rms:.3} mm rms), {point} least of all ({off:.3} mm)"
            )));
        }
        Ok(Some(datum))
    }

    /// Residual of the points, mm rms of a coordinate, over the remaining degrees of freedom.
    pub(crate) fn rms(&self) -> f64 {
        let squares: f64 = self.residuals.iter().map(|(_, off)| off * off).sum();
        (squares / (3.0 * self.residuals.len() as f64 - 6.0)).sqrt()
    }

    /// The sensor's readings, transformed into the robot's base frame.
    pub(super) fn turned(&self, readings: &Readings) -> Readings {
        readings.turned(&self.frame.inverse())
    }

    /// Transforms a solution from [turned](Self::turned) readings to the sensor's frame and adds the datum's own noise:
    ///
    /// ```text
    /// C + G D Gᵀ,   D = σ² (Σ MᵀM)⁻¹ over the datum points,   G = C Σ Jᵀ B M over the rows,   M(x) = (I, −[x]×)
    /// ```
    ///
    /// J are the derivatives of a row's readings with respect to the unknowns, B with respect to the position.
    pub(super) fn added_to(&self, mut solution: Solution, readings: &Readings) -> Solution {
        let sigma = solution.levels.position.position();
        let information: Matrix6<f64> = self
            .places
            .iter()
            .map(|x| motion(x).transpose() * motion(x))
            .sum();
        let unknowns = solution.covariance.nrows();
        if let Some(spread) = information.try_inverse() {
            let mut sum = SMatrix::<f64, MOST, 6>::zeros();
            for own in &solution.sensitivities {
                let Some(sample) = readings
                    .rows
                    .get(own.row)
                    .and_then(|row| row.value.sample())
                else {
                    continue;
                };
                let [by_position, _] = own.by_positions;
                let by_position =
                    SMatrix::<f64, READINGS, 3>::from_fn(|r, axis| by_position[r][axis]);
                sum += own.by_unknowns.transpose() * (by_position * motion(&sample.position));
            }
            let every = readings.rows.len() as f64 / (solution.sensitivities.len() as f64).max(1.0);
            let sum = DMatrix::from_fn(unknowns, 6, |row, column| every * sum[(row, column)]);
            let gain = &solution.covariance * sum;
            let spread = DMatrix::from_iterator(6, 6, spread.iter().map(|own| own * sigma * sigma));
            solution.covariance += &gain * spread * gain.transpose();
        }
        solution.places.frame = Some(self.frame);
        solution.places_before.frame = Some(self.frame);
        solution
    }
}

/// (I, −[x]×): displacement of a point by a translation and a rotation.
pub(crate) fn motion(x: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut columns = SMatrix::<f64, 3, 6>::zeros();
    columns
        .fixed_columns_mut::<3>(0)
        .copy_from(&Matrix3::identity());
    columns
        .fixed_columns_mut::<3>(3)
        .copy_from(&-x.cross_matrix());
    columns
}
