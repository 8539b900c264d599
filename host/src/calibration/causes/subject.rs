//! A solution and its residuals as rows of a regression.

use super::Cause;
use super::regression::Regression;
use crate::accuracy::quantiles::median;
use crate::accuracy::uncertainty::{Sensitivities, jacobian};
use crate::effects::{At, Course, Effect};
use crate::files::samples_file::{READINGS, ReadingFrom, Readings};
use crate::fit::Solution;
use crate::fit::solution::PARAMETERS;
use crate::fit::solution::Sensitivity;
use delta_cal::Sample;
use nalgebra::{DVector, SVector, Vector3};

/// Residuals are clipped to this many scales, so that one wrong reading is not taken for a cause.
const LARGEST_RESIDUAL: f64 = 4.0;
/// Median absolute value of a standard normal variable.
const MEDIAN: f64 = 0.6745;

/// A solution and its readings.
pub(crate) struct Subject<'a> {
    pub(crate) solution: &'a Solution,
    pub(crate) readings: &'a Readings,
}

/// A row that takes part.
struct Counted<'a> {
    at: At,
    /// Start of a distance between two poses.
    other: Option<At>,
    sensitivity: &'a Sensitivity,
    residuals: SVector<f64, READINGS>,
}

impl<'a> Subject<'a> {
    pub(crate) const fn new(solution: &'a Solution, readings: &'a Readings) -> Self {
        Self { solution, readings }
    }

    /// The rows that take part; an even selection if there are many.
    fn counted(&self) -> Vec<Counted<'a>> {
        let robot = &self.solution.robot;
        let counted = |sensitivity: &'a Sensitivity| {
            let reading = &self.readings.rows.get(sensitivity.row)?.value;
            Some(Counted {
                at: At::new(robot, &reading.joints)?,
                other: match reading.distance {
                    Some((ReadingFrom::Pose(joints), _)) => Some(At::new(robot, &joints)?),
                    _ => None,
                },
                sensitivity,
                residuals: SVector::from(self.solution.rows[sensitivity.row].whitened),
            })
        };
        let sensitivities = self.solution.sensitivities.iter();
        sensitivities.filter_map(counted).collect()
    }

    fn course(&self) -> Course {
        let solution = self.solution;
        Course::of(&solution.robot, &solution.places, self.readings)
    }

    /// The regression of all rows, with the hypotheses as candidates.
    pub(super) fn regression(&self, effects: &[Effect]) -> Regression {
        let (counted, course) = (self.counted(), self.course());
        let largest = LARGEST_RESIDUAL * scale(&counted);
        let columns = effects.iter().map(Effect::unknowns).sum();
        self.rows(&counted, columns, largest, |row, at| {
            let all = effects.iter();
            all.flat_map(|own| own.columns(at, &course, row)).collect()
        })
    }

    /// The regression with `columns` columns beside the unknowns. `moves`: displacement of a position of the row with
    /// this index per unit of each column, mm.
    pub(super) fn with_columns(
        &self,
        columns: usize,
        moves: impl Fn(usize, &At) -> Vec<Vector3<f64>>,
    ) -> Regression {
        self.rows(&self.counted(), columns, f64::INFINITY, moves)
    }

    /// The regression, with residuals clipped to `largest`.
    fn rows(
        &self,
        counted: &[Counted<'_>],
        columns: usize,
        largest: f64,
        moves: impl Fn(usize, &At) -> Vec<Vector3<f64>>,
    ) -> Regression {
        let unknowns = self.solution.covariance.nrows();
        let mut measured = Vec::new();
        for c in counted {
            let moves = |at| moves(c.sensitivity.row, at);
            let (own, other) = (moves(&c.at), c.other.as_ref().map(moves));
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
                measured.push((DVector::from_vec(row), weight));
            }
        }
        Regression::new((unknowns, columns), measured, self.prior(columns))
    }

    /// Rows of the prior of the unknowns.
    fn prior(&self, columns: usize) -> Vec<DVector<f64>> {
        let solution = self.solution;
        let unknowns = solution.covariance.nrows();
        let off = &solution.prior * &solution.moved;
        let mut rows = Vec::new();
        for (row, off) in solution.prior.row_iter().zip(&off) {
            if row.iter().any(|entry| entry.abs() > 0.0) {
                let mut own = row
                    .transpose()
                    .resize_vertically(unknowns + columns + 1, 0.0);
                own[unknowns + columns] = -off;
                rows.push(own);
            }
        }
        // Unused entries of an arm's vector have no error.
        for index in (0..unknowns).filter(|index| !(solution.covariance[(*index, *index)] > 0.0)) {
            let mut own = DVector::zeros(unknowns + columns + 1);
            own[index] = 1.0;
            rows.push(own);
        }
        rows
    }

    /// The readings without an error of this kind and size.
    pub(crate) fn undone(&self, effect: &Effect, by: &[f64]) -> Readings {
        let solution = self.solution;
        let all = [(*effect, by)];
        self.course()
            .without(&solution.robot, &solution.places, self.readings, &all)
    }

    /// Displacement of the position of a row by an effect, per unit of each of its columns.
    pub(crate) fn moves<'h>(
        &self,
        effect: &'h Effect,
    ) -> impl Fn(usize, &At) -> Vec<Vector3<f64>> + use<'h> {
        let course = self.course();
        move |row, at| effect.columns(at, &course, row)
    }

    /// Effect of the causes found on the calibrated robot's positions, rms over poses, mm, absolute and relative: what its
    /// parameters have absorbed of the causes, plus the causes themselves, in both directions of a backlash. Drift and
    /// scale belong to the measured positions, not to the robot.
    pub(super) fn discrepancy(
        &self,
        found: &[Cause],
        coefficients: &DVector<f64>,
        poses: &[Sample<f64>],
    ) -> [f64; 2] {
        let robot = &self.solution.robot;
        let course = self.course();
        let parameters = coefficients.fixed_rows::<PARAMETERS>(0);
        let error = |pose: &Sample<f64>, directions: [f64; 3]| {
            let at = At::new(robot, &pose.joints)?;
            let jacobian = jacobian::<PARAMETERS>(robot, &at.position, &at.joints)?;
            let here = course.anywhere(&at, directions);
            let mut error = jacobian * parameters;
            for cause in found {
                error += cause
                    .effect
                    .displacement(&at, &here, 0, &cause.coefficients);
            }
            Some((*pose, error))
        };
        let ways =
            [1.0, -1.0].map(|way| poses.iter().filter_map(move |pose| error(pose, [way; 3])));
        let errors = Sensitivities(ways.into_iter().flatten().collect());
        let rms = |errors: &Sensitivities<1>| errors.mean_square().trace().sqrt();
        [rms(&errors), errors.relative().as_ref().map_or(0.0, rms)]
    }
}

/// Scale of the residuals, insensitive to a few wrong readings; at least the noise.
fn scale(counted: &[Counted<'_>]) -> f64 {
    let residuals = counted.iter().flat_map(|c| c.residuals.iter().copied());
    let sizes = residuals.filter(|own| *own != 0.0).map(f64::abs);
    (median(sizes).unwrap_or(0.0) / MEDIAN).max(1.0)
}
