//! A solution and its residuals as rows of a regression.

use super::cause::{At, Cause, CauseKind, Hypothesis, Place};
use super::regression::Regression;
use crate::accuracy::quantiles::median;
use crate::accuracy::uncertainty::{Sensitivities, jacobian};
use crate::files::samples_file::{READINGS, Reading, ReadingFrom, Readings, Row};
use crate::fit::Solution;
use crate::fit::solution::PARAMETERS;
use crate::fit::solution::Sensitivity;
use crate::geometry::{Directions, range};
use delta_cal::{ArmIndex, Sample};
use nalgebra::{DVector, SVector, Vector3};

/// Residuals are clipped to this many scales, so that one wrong reading is not taken for a cause.
const LARGEST_RESIDUAL: f64 = 4.0;
/// σ of a row that says nothing, mm.
const UNKNOWN: f64 = 1e3;
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

    /// Every row's place in the file.
    fn places(&self) -> Vec<Place> {
        let rows = &self.readings.rows;
        let mut moves = Directions::default();
        let largest = self.radius_squared();
        let last = rows.len().saturating_sub(1) as f64;
        let place = |(index, row): (usize, &Row<Reading>)| {
            let position = self.solution.robot.forward(&row.value.joints).ok();
            let squared = position.map_or(0.0, |own| own.xy().norm_squared());
            Place {
                directions: moves.next(&row.value.joints),
                part: share(index as f64, last) - 0.5,
                radius_squared: share(squared, largest),
                scaled: if row.value.height.is_none() { 1.0 } else { 0.0 },
            }
        };
        rows.iter().enumerate().map(place).collect()
    }

    /// Largest squared distance from the robot's axis, mm².
    fn radius_squared(&self) -> f64 {
        let robot = &self.solution.robot;
        let rows = self.readings.rows.iter();
        let positions = rows.filter_map(|row| robot.forward(&row.value.joints).ok());
        positions
            .map(|own| own.xy().norm_squared())
            .fold(0.0, f64::max)
    }

    /// Lowest and highest angle or travel of each joint.
    fn ranges(&self) -> [(f64, f64); 3] {
        let rows = &self.readings.rows;
        [0, 1, 2].map(|joint| range(rows.iter().map(|row| row.value.joints[joint])))
    }

    /// The regression of all rows, with the hypotheses as candidates.
    pub(super) fn regression(&self, hypotheses: &[Hypothesis]) -> Regression {
        let (counted, places, ranges) = (self.counted(), self.places(), self.ranges());
        let largest = LARGEST_RESIDUAL * scale(&counted);
        let columns = hypotheses.iter().map(Hypothesis::number).sum();
        self.rows(&counted, columns, largest, |row, at| {
            let all = hypotheses.iter();
            all.flat_map(|own| own.moves(at, &ranges, &places[row]))
                .collect()
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
    pub(crate) fn undone(&self, hypothesis: &Hypothesis, by: &[f64]) -> Readings {
        let (places, ranges) = (self.places(), self.ranges());
        let found = &self.solution.places;
        let mut undone = self.readings.clone();
        for (row, place) in undone.rows.iter_mut().zip(&places) {
            let own = &mut row.value;
            if let Some(arm) = hypothesis.arm.map(ArmIndex::index) {
                // Its last move is not known.
                if hypothesis.kind == CauseKind::Backlash && place.directions[arm] == 0.0 {
                    own.sigma = Some(UNKNOWN);
                }
                own.each_pose(|mut joints| {
                    let turns = hypothesis.turns(joints[arm], ranges[arm], place.directions[arm]);
                    joints[arm] += turns.iter().zip(by).map(|(own, by)| own * by).sum::<f64>();
                    joints
                });
                continue;
            }
            let Some(at) = At::new(&self.solution.robot, &own.joints) else {
                continue;
            };
            let moves = hypothesis.moves(&at, &ranges, place).into_iter().zip(by);
            let moved: Vector3<f64> = moves.map(|(own, by)| own * *by).sum();
            let seen = found.frame.map_or(moved, |frame| frame.rotation * moved);
            for (coordinate, moved) in own.position.iter_mut().zip(&seen) {
                *coordinate = coordinate.map(|value| value - moved);
            }
            let normal = |plane: usize| found.planes.get(plane).map(|own| own.normal);
            own.height = own.height.map(|(plane, height)| {
                (
                    plane,
                    height - normal(plane).map_or(0.0, |own| own.dot(&moved)),
                )
            });
            if hypothesis.kind == CauseKind::Scale {
                own.distance = own
                    .distance
                    .map(|(from, length)| (from, length / (1.0 + by[0])));
            }
        }
        undone
    }

    /// Displacement of the position of a row by a hypothesis, per unit of each of its columns.
    pub(crate) fn moves<'h>(
        &self,
        hypothesis: &'h Hypothesis,
    ) -> impl Fn(usize, &At) -> Vec<Vector3<f64>> + use<'h> {
        let (places, ranges) = (self.places(), self.ranges());
        move |row, at| hypothesis.moves(at, &ranges, &places[row])
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
        let (largest, ranges) = (self.radius_squared(), self.ranges());
        let parameters = coefficients.fixed_rows::<PARAMETERS>(0);
        let error = |pose: &Sample<f64>, directions: [f64; 3]| {
            let at = At::new(robot, &pose.joints)?;
            let jacobian = jacobian::<PARAMETERS>(robot, &at.position, &at.joints)?;
            let place = Place {
                directions,
                part: 0.0,
                radius_squared: share(at.position.xy().norm_squared(), largest),
                scaled: 0.0,
            };
            let mut error = jacobian * parameters;
            for cause in found {
                let moves = cause.hypothesis.moves(&at, &ranges, &place);
                let terms = moves.iter().zip(&cause.coefficients);
                error += terms.map(|(moved, by)| moved * *by).sum::<Vector3<f64>>();
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

/// 0 of nothing.
fn share(part: f64, all: f64) -> f64 {
    if all > 0.0 { part / all } else { 0.0 }
}

/// Scale of the residuals, insensitive to a few wrong readings; at least the noise.
fn scale(counted: &[Counted<'_>]) -> f64 {
    let residuals = counted.iter().flat_map(|c| c.residuals.iter().copied());
    let sizes = residuals.filter(|own| *own != 0.0).map(f64::abs);
    (median(sizes).unwrap_or(0.0) / MEDIAN).max(1.0)
}
