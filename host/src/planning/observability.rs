//! Whether measured poses determine the robot: singular values of the weighted Jacobian, the
//! observability indices of the literature, the weakest combination of parameters, and the leverage
//! of each sample. None of it needs the measured positions.
//!
//! Rows are in σ of their noise and columns in mm, angles times the upper arm's length. So 1/σₖ is
//! one standard deviation, in mm, of the combination of parameters that belongs to the singular
//! value σₖ.

mod combination;
mod indices;

pub use combination::Combination;
pub use indices::Indices;

use crate::accuracy::information::{
    ARM, PARAMETERS, closure_rows, is_empty, parameters, position_rows, unit,
};
use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::CalibrationMethod;
use crate::planning::poses::Assumptions;
use delta_cal::calibration::limits::LARGEST_SIGMA;
use delta_cal::{ArmIndex, Parameter, Sample};
use nalgebra::{DMatrix, DVector};

/// A singular value is zero below this part of the largest: the core's limit of a condition.
const ZERO: f64 = 64.0 * f64::EPSILON;

/// What samples say of the parameters that a method estimates together: one arm's (IKM), or all (FKM).
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// The arm; `None` for the whole robot.
    pub arm: Option<ArmIndex>,
    /// Of the weighted Jacobian, the largest first, 1/mm.
    pub singular_values: Vec<f64>,
    /// How many of them are not zero.
    pub rank: usize,
    /// What the literature makes of them.
    pub indices: Indices,
    /// What is known worst, by the samples alone.
    pub weakest: Combination,
    /// The parameter known worst as part of what a calibration asks of it, and its σ in mm or
    /// radians, infinite if it is not determined.
    pub worst: (ArmIndex, Parameter, f64),
    /// Whether every parameter is known well enough not to be refused.
    pub determined: bool,
}

/// How much one sample decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leverage {
    /// Its line in the file.
    pub line: u64,
    /// Its joint angles, radians.
    pub joints: [f64; 3],
    /// The trace of its diagonal block of the hat matrix J (JᵀJ)⁻¹ Jᵀ: parameters that it
    /// determines. Over all samples it sums up to the rank.
    pub total: f64,
    /// The largest of a residual of it, 0 to 1: at 1 nothing else checks it, and an error in it goes
    /// unseen into the parameters.
    pub largest: f64,
}

/// Whether measured poses determine the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Observability {
    /// The noise they are judged for.
    pub assumptions: Assumptions,
    /// Three arms, or the robot.
    pub blocks: Vec<Block>,
    /// Each sample's.
    pub leverages: Vec<Leverage>,
    /// The poses as the robot file has them.
    pub poses: Vec<Sample<f64>>,
}

impl Observability {
    /// Of the joint angles of a samples file.
    ///
    /// # Errors
    /// Joint angles that the robot file's geometry does not reach, with their line.
    pub fn new(
        robot: &RobotFile,
        samples: &SamplesFile,
        method: CalibrationMethod,
    ) -> Result<Self, InputError> {
        let places: Vec<_> = (0..PARAMETERS)
            .filter(|place| !is_empty(&robot.robot, *place))
            .collect();
        let assumptions = Assumptions::of(robot)
            .map_err(|error| InputError::new(&robot.name, error.to_string()).at_key("[noise]"))?;
        let mut rows = Vec::with_capacity(samples.rows.len());
        let mut poses = Vec::with_capacity(samples.rows.len());
        for (index, row) in samples.rows.iter().enumerate() {
            let joints = row.value.joints;
            let fault = |error: String| samples.fault(index, error);
            let position = robot
                .robot
                .forward(&joints)
                .map_err(|error| fault(error.to_string()))?;
            let pose = Sample { joints, position };
            poses.push(pose);
            rows.push(match method {
                CalibrationMethod::Ikm => closure_rows(&robot.robot, &pose, &assumptions.noise)
                    .map(|row| {
                        let own = places.iter().filter(|place| **place < ARM);
                        DMatrix::from_row_iterator(
                            1,
                            places.len() / 3,
                            own.map(|place| row[*place]),
                        )
                    })
                    .to_vec(),
                CalibrationMethod::Joint | CalibrationMethod::Fkm => {
                    let rows = position_rows(&robot.robot, &pose, &assumptions.noise)
                        .ok_or_else(|| fault("the pose is singular".to_owned()))?;
                    vec![DMatrix::from_fn(3, places.len(), |row, column| {
                        rows[(row, places[column])]
                    })]
                }
            });
        }
        let mut leverages: Vec<_> = samples
            .rows
            .iter()
            .map(|row| Leverage {
                line: row.line,
                joints: row.value.joints,
                total: 0.0,
                largest: 0.0,
            })
            .collect();
        let count = rows.first().map_or(0, Vec::len);
        let mut blocks = Vec::with_capacity(count);
        for block in 0..count {
            let own: Vec<_> = rows.iter().map(|rows| &rows[block]).collect();
            let arm = match method {
                CalibrationMethod::Ikm => ArmIndex::ALL.get(block).copied(),
                CalibrationMethod::Joint | CalibrationMethod::Fkm => None,
            };
            let parameters: Vec<_> = parameters(&robot.robot)
                .filter(|(own, _)| arm.is_none_or(|arm| arm == *own))
                .map(Some)
                .collect();
            blocks.push(Block::new(robot, arm, &parameters, &own, &mut leverages));
        }
        Ok(Self {
            assumptions,
            blocks,
            leverages,
            poses,
        })
    }

    /// Whether a calibration without a tolerance would find every parameter.
    pub fn determined(&self) -> bool {
        self.blocks.iter().all(|block| block.determined)
    }
}

impl Block {
    /// Adds to the leverages.
    fn new(
        robot: &RobotFile,
        arm: Option<ArmIndex>,
        parameters: &[Option<(ArmIndex, Parameter)>],
        rows: &[&DMatrix<f64>],
        leverages: &mut [Leverage],
    ) -> Self {
        let columns = rows.first().map_or(0, |rows| rows.ncols());
        // At least as many rows as columns, so that every singular value is there.
        let each = rows.first().map_or(0, |rows| rows.nrows());
        let mut jacobian = DMatrix::<f64>::zeros((each * rows.len()).max(columns), columns);
        for (index, rows) in rows.iter().enumerate() {
            jacobian.rows_mut(each * index, each).copy_from(rows);
        }
        let (singular_values, directions) = decomposed(&jacobian);
        let least = ZERO * singular_values.first().copied().unwrap_or(0.0);
        let rank = singular_values
            .iter()
            .filter(|value| **value > least)
            .count();
        for (rows, leverage) in rows.iter().zip(leverages) {
            for row in rows.row_iter() {
                let parts = directions.iter().zip(&singular_values).take(rank);
                let own: f64 = parts
                    .map(|(direction, value)| (row.tr_dot(direction) / value).powi(2))
                    .sum();
                leverage.total += own;
                leverage.largest = leverage.largest.max(own);
            }
        }
        let last = singular_values.len().saturating_sub(1);
        let sigma = |index: usize| -> f64 {
            if rank < columns {
                return f64::INFINITY;
            }
            let parts = directions.iter().zip(&singular_values);
            let variance: f64 = parts
                .map(|(direction, value)| (direction[index] / value).powi(2))
                .sum();
            variance.sqrt()
        };
        let (worst, part) = worst_parameter(robot, parameters, sigma);
        Self {
            arm,
            rank,
            indices: Indices::of(&singular_values, rows.len()),
            weakest: Combination::new(
                parameters,
                &directions
                    .last()
                    .cloned()
                    .unwrap_or_else(|| DVector::zeros(columns)),
                if rank < columns {
                    f64::INFINITY
                } else {
                    singular_values[last].recip()
                },
            ),
            worst,
            determined: part <= 1.0,
            singular_values,
        }
    }
}

/// Singular values, the largest first, and the right singular vectors, by the triangle of the rows.
fn decomposed(jacobian: &DMatrix<f64>) -> (Vec<f64>, Vec<DVector<f64>>) {
    let triangle = jacobian.clone().qr().r();
    let svd = triangle.svd(false, true);
    let values = svd.singular_values.iter().copied();
    let directions = svd.v_t.map_or_else(Vec::new, |transposed| {
        transposed.row_iter().map(|row| row.transpose()).collect()
    });
    let mut pairs: Vec<_> = values.zip(directions).collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs.into_iter().unzip()
}

/// The parameter whose σ (mm, angles times the upper arm) is the largest part of what a calibration
/// accepts, and that part.
fn worst_parameter(
    robot: &RobotFile,
    parameters: &[Option<(ArmIndex, Parameter)>],
    sigma: impl Fn(usize) -> f64,
) -> ((ArmIndex, Parameter, f64), f64) {
    let mut worst = ((ArmIndex::First, Parameter::Dx, 0.0), 0.0);
    for (index, (arm, parameter)) in parameters.iter().flatten().copied().enumerate() {
        let geometry = robot.robot.arm(arm);
        let part = sigma(index) / (LARGEST_SIGMA * geometry.upper_arm_length());
        if !(part <= worst.1) {
            let own = sigma(index) / unit(geometry, parameter);
            worst = ((arm, parameter, own), part);
        }
    }
    worst
}
