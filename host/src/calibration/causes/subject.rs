//! A solution and its residuals, as rows of a regression.

use super::cause::{Cause, CauseKind};
use super::regression::{Regression, Rows};
use super::{Place, columns, movements};
use crate::files::samples_file::{READINGS, ReadingFrom, Readings};
use crate::fit::Solution;
use crate::fit::solution::Sensitivity;
use crate::geometry::Directions;
use delta_cal::{Robot, Sample};
use nalgebra::{DVector, Matrix3, SVector, Vector3};

/// A residual of more scales counts as if it were that large, so that one wrong reading is no cause.
const LARGEST_RESIDUAL: f64 = 4.0;
/// The median of the size of a standard normal number.
const MEDIAN: f64 = 0.6745;

/// A solution, and the readings that it is of.
pub(crate) struct Subject<'a> {
    pub(crate) solution: &'a Solution,
    pub(crate) readings: &'a Readings,
}

/// A pose of the calibrated robot.
#[derive(Clone, Copy)]
pub(crate) struct At {
    pub(crate) joints: [f64; 3],
    pub(super) position: Vector3<f64>,
    pub(crate) by_joints: Matrix3<f64>,
}

/// A row that counts.
pub(super) struct Counted<'a> {
    at: At,
    /// Where a distance between two poses begins.
    other: Option<At>,
    place: Place,
    pub(super) sensitivity: &'a Sensitivity,
    residuals: SVector<f64, READINGS>,
}

impl At {
    pub(super) fn new(robot: &Robot<f64>, joints: &[f64; 3]) -> Option<Self> {
        let position = robot.forward(joints).ok()?;
        let by_joints = robot.platform_jacobian(&position, joints).ok()?.by_joints;
        Some(Self {
            joints: *joints,
            position,
            by_joints,
        })
    }
}

impl<'a> Subject<'a> {
    /// The rows that count, of many some.
    pub(super) fn counted(&self) -> Vec<Counted<'a>> {
        let robot = &self.solution.robot;
        let mut moves = Directions::default();
        let rows = &self.readings.rows;
        let directions: Vec<_> = rows
            .iter()
            .map(|row| moves.next(&row.value.joints))
            .collect();
        let positions = rows
            .iter()
            .filter_map(|row| robot.forward(&row.value.joints).ok());
        let largest = positions.fold(0.0, |most: f64, own| most.max(own.xy().norm_squared()));
        let last = rows.iter().skip(1).fold(0.0, |count, _| count + 1.0);
        let counted = self
            .solution
            .sensitivities
            .iter()
            .filter_map(|sensitivity| {
                let index = sensitivity.row;
                let reading = &rows.get(index)?.value;
                let at = At::new(robot, &reading.joints)?;
                let other = match reading.distance {
                    Some((ReadingFrom::Pose(joints), _)) => Some(At::new(robot, &joints)?),
                    _ => None,
                };
                let part = if last > 0.0 {
                    index as f64 / last - 0.5
                } else {
                    0.0
                };
                let squared = at.position.xy().norm_squared();
                Some(Counted {
                    at,
                    other,
                    place: Place {
                        directions: directions[index],
                        part,
                        radius_squared: if largest > 0.0 {
                            squared / largest
                        } else {
                            0.0
                        },
                        scaled: if reading.height.is_none() { 1.0 } else { 0.0 },
                    },
                    sensitivity,
                    residuals: SVector::from(self.solution.rows[index].whitened),
                })
            });
        counted.collect()
    }

    /// The square of the largest distance from the robot's axis, mm².
    pub(super) fn radius_squared(&self) -> f64 {
        let robot = &self.solution.robot;
        let rows = self.readings.rows.iter();
        let positions = rows.filter_map(|row| robot.forward(&row.value.joints).ok());
        positions.fold(0.0, |most: f64, own| most.max(own.xy().norm_squared()))
    }

    /// The lowest and the highest angle or travel of each joint.
    pub(super) fn ranges(&self) -> [[f64; 2]; 3] {
        std::array::from_fn(|joint| {
            let all = self.readings.rows.iter().map(|row| row.value.joints[joint]);
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
                [low.min(q), high.max(q)]
            })
        })
    }

    /// All rows: the unknowns always take part, the hypotheses may.
    pub(super) fn regression(&self, counted: &[Counted<'_>]) -> Regression {
        let drive = self.solution.robot.drive();
        let ranges = self.ranges();
        let largest = LARGEST_RESIDUAL * scale(counted);
        self.with_columns(counted, columns(drive), largest, |c, at| {
            movements(drive, at, &ranges, &c.place)
        })
    }

    /// All rows with so many columns beside the unknowns. `moves`: by how much a position of a row moves for one unit of
    /// each, mm. Residuals above `largest` count as that.
    pub(super) fn with_columns(
        &self,
        counted: &[Counted<'_>],
        columns: usize,
        largest: f64,
        moves: impl Fn(&Counted<'_>, &At) -> Vec<Vector3<f64>>,
    ) -> Regression {
        let unknowns = self.solution.covariance.nrows();
        let mut rows = Rows::new(unknowns, columns);
        for c in counted {
            let (own, other) = (moves(c, &c.at), c.other.as_ref().map(|at| moves(c, at)));
            for reading in 0..READINGS {
                let [by_own, by_other] = c.sensitivity.by_positions.map(|all| all[reading]);
                let read = c.sensitivity.by_unknowns.row(reading);
                if by_own == Vector3::zeros() {
                    continue;
                }
                let residual = c.residuals[reading];
                let mut row: Vec<f64> = read.columns(0, unknowns).iter().copied().collect();
                for (index, movement) in own.iter().enumerate() {
                    let there = other.as_ref().map_or(0.0, |all| by_other.dot(&all[index]));
                    row.push(by_own.dot(movement) + there);
                }
                row.push(residual);
                let size = residual.abs();
                let weight = if size > largest { largest / size } else { 1.0 };
                rows.add(DVector::from_vec(row), weight);
            }
        }
        self.add_prior(&mut rows);
        rows.regression()
    }

    /// What was known of the unknowns beforehand.
    fn add_prior(&self, rows: &mut Rows) {
        let solution = self.solution;
        let unknowns = solution.covariance.nrows();
        let off = &solution.prior * &solution.moved;
        for (row, off) in solution.prior.row_iter().zip(&off) {
            if row.iter().any(|entry| entry.abs() > 0.0) {
                rows.add_prior(row.iter().copied(), -off);
            }
        }
        // What stands at no place of an arm's vector is not off.
        for index in (0..unknowns).filter(|index| !(solution.covariance[(*index, *index)] > 0.0)) {
            let row = (0..unknowns).map(|own| if own == index { 1.0 } else { 0.0 });
            rows.add_prior(row, 0.0);
        }
    }

    /// What the causes found make of the calibrated robot's positions, rms over poses, mm: its parameters are wrong by what
    /// they have taken up of the causes, and the causes themselves are left; over both directions of a backlash.
    pub(super) fn discrepancy(
        &self,
        found: &[Cause],
        coefficients: &DVector<f64>,
        poses: &[Sample<f64>],
    ) -> f64 {
        let robot = &self.solution.robot;
        let radius_squared = self.radius_squared();
        let squared = |pose: &Sample<f64>| {
            let at = At::new(robot, &pose.joints)?;
            let blocks = robot
                .platform_jacobian(&at.position, &at.joints)
                .ok()?
                .by_parameters;
            let mut error = Vector3::zeros();
            for (arm, block) in blocks.iter().enumerate() {
                error += block * coefficients.fixed_rows::<8>(8 * arm);
            }
            let mut either_way = 0.0;
            for cause in found {
                match (cause.kind, cause.arm) {
                    (CauseKind::Backlash, Some(arm)) => {
                        let half = cause.joint_error(0.0, 1.0);
                        either_way += (at.by_joints.column(arm.index()) * half).norm_squared();
                    }
                    (_, Some(arm)) => {
                        let index = arm.index();
                        error +=
                            at.by_joints.column(index) * cause.joint_error(at.joints[index], 0.0);
                    }
                    (CauseKind::Sag, None) if radius_squared > 0.0 => {
                        let part = at.position.xy().norm_squared() / radius_squared;
                        error -= Vector3::z() * (cause.size * part);
                    }
                    // The positions drift, not the robot.
                    (_, None) => {}
                }
            }
            Some(error.norm_squared() + either_way)
        };
        let (sum, count) = poses
            .iter()
            .filter_map(squared)
            .fold((0.0, 0.0), |(sum, count), squared| {
                (sum + squared, count + 1.0)
            });
        if count > 0.0 {
            f64::sqrt(sum / count)
        } else {
            0.0
        }
    }
}

/// The scale of the residuals, which some wrong readings do not change; not below the noise.
fn scale(counted: &[Counted<'_>]) -> f64 {
    let residuals = counted.iter().flat_map(|c| c.residuals.iter().copied());
    let mut sizes: Vec<_> = residuals.filter(|own| *own != 0.0).map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    (median / MEDIAN).max(1.0)
}
