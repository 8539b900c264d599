//! The core's three estimators applied to readings with given noise, and the residuals of every row.

use super::observations::{instruments, is_stated, places as known_places, rows, shape};
use super::robust;
use super::solution::{
    KindNoise, Levels, MOST, PARAMETERS, RowFit, Sensitivity, Solution, Unsolved,
};
use super::{Frame, Method};
use crate::cores;
use crate::effects::{Places, PlaneFound, PointFound};
use crate::files::{Kind, READINGS, Readings, RobotFile};
use crate::halt;
use delta_cal::calibration::{ArmOutcome, Estimate, Start, Unknowns};
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{Instruments, ObservationError, ObservationProblem, ObservationRow};
use delta_cal::samples::{SampleError, Triangle};
use delta_cal::{
    ArmIndex, IkmCalibrator, JointCalibrator, Noise, Robot, Sample, Settings, Tolerance,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3};

/// Parameters of the smaller, faster problem, enough for files with one instrument beside the robot.
const FEW: usize = 30;
/// At most this many rows, evenly spread, keep their derivatives.
const MOST_SENSITIVITIES: usize = 5000;

/// Samples that a calibrator is given between two looks at whether it is to stop.
const AT_ONCE: usize = 1000;

/// The data and settings of an estimate.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) robot: &'a RobotFile,
    pub(super) readings: &'a Readings,
    pub(super) method: Method,
    pub(super) frame: Frame,
    pub(super) robust: bool,
    /// The stated tolerance, or a wide one that fixes the robot's place in an unknown frame.
    pub(super) tolerance: Option<Tolerance<f64>>,
}

struct Found {
    robot: Robot<f64>,
    /// Displacement of the parameters.
    moved: [f64; PARAMETERS],
    /// Of all unknowns, or of the parameters alone.
    covariance: DMatrix<f64>,
    prior_share: [f64; PARAMETERS],
    conditions: [f64; 3],
    start: Start,
    separate: Option<Separate>,
}

impl Found {
    fn of<const N: usize>(
        robot: &Robot<f64>,
        moved: [f64; PARAMETERS],
        estimate: &Estimate<f64, N>,
    ) -> Result<Self, Unsolved> {
        let covariance = estimate.covariance.as_ref();
        Ok(Self {
            robot: robot.clone(),
            moved,
            covariance: dynamic(covariance.ok_or(Unsolved::NoRedundancy)?),
            prior_share: std::array::from_fn(|place| estimate.prior_share[place]),
            conditions: estimate.conditions,
            start: estimate.start,
            separate: None,
        })
    }
}

impl Task<'_> {
    pub(super) fn solve(&self, levels: &Levels) -> Result<Solution, Unsolved> {
        let settings = Settings::new().with_tolerance(self.tolerance);
        let noisy = settings.with_noise(levels.position);
        let given = match self.method {
            Method::Fkm => None,
            Method::Joint => Some(self.joint(&noisy)?),
            Method::Ikm => Some(self.ikm(&noisy, &levels.position)?),
        };
        let (planes, points) = known_places(self.robot, self.readings);
        let instruments = instruments(self.robot, self.frame, &planes, &points, levels)?;
        let mut rows = rows(self.readings.rows.iter().map(|row| &row.value))?;
        let (own, rows) = (&instruments, rows.as_mut_slice());
        if PARAMETERS + instruments.unknowns() <= FEW {
            self.with_room::<FEW>(own, rows, &settings, levels, given)
        } else {
            self.with_room::<MOST>(own, rows, &settings, levels, given)
        }
    }

    fn samples(&self) -> Vec<Sample<f64>> {
        self.readings.samples().map(|row| row.value).collect()
    }

    /// The parameters of a robot less those of the file.
    fn moved(&self, robot: &Robot<f64>) -> [f64; PARAMETERS] {
        let [after, before] = [robot, &self.robot.robot].map(|own| own.parameters().concat());
        std::array::from_fn(|place| after[place] - before[place])
    }

    fn joint(&self, settings: &Settings<f64>) -> Result<Found, Unsolved> {
        let samples = self.samples();
        let empty = JointCalibrator::new(&self.robot.robot, settings);
        let (before, after) = samples.split_at(samples.len() / 2);
        let taken = |first: usize, samples: &[Sample<f64>]| {
            let mut own = empty.clone();
            for (part, samples) in samples.chunks(AT_ONCE).enumerate() {
                halt::check();
                let first = first + part * AT_ONCE;
                own.add_many(samples)
                    .map_err(|(index, error)| unusable(first + index, error))?;
            }
            own.flush();
            Ok::<_, Unsolved>(own)
        };
        let (one, other) = cores::join(|| taken(0, before), || taken(before.len(), after));
        let mut calibrator = one?;
        // Merging cannot fail: robot and noise are the same.
        let _ = calibrator.merge(&other?);
        let outcome = calibrator.calibrate()?;
        let moved = self.moved(&outcome.robot);
        Found::of(&outcome.robot, moved, &outcome.estimate)
    }

    fn ikm(&self, settings: &Settings<f64>, noise: &Noise<f64>) -> Result<Found, Unsolved> {
        let samples = self.samples();
        let mut calibrator = IkmCalibrator::new(&self.robot.robot, settings);
        for (part, samples) in samples.chunks(AT_ONCE).enumerate() {
            halt::check();
            calibrator
                .add_many(samples)
                .map_err(|(index, error)| unusable(part * AT_ONCE + index, error))?;
        }
        let outcome = calibrator.calibrate()?;
        let covariance = by_arms(&outcome.arms).ok_or(Unsolved::NoRedundancy)?;
        let shares = outcome.arms.each_ref().map(|arm| arm.prior_share);
        let [one, ..] = &outcome.arms;
        let separate = Separate::of(&outcome.robot, &samples, noise, &covariance);
        Ok(Found {
            covariance: dynamic(&separate.covariance),
            separate: Some(separate),
            moved: self.moved(&outcome.robot),
            robot: outcome.robot,
            prior_share: std::array::from_fn(|place| shares[place / 8][place % 8]),
            conditions: outcome.arms.each_ref().map(|arm| arm.condition),
            start: one.start,
        })
    }

    fn with_room<const N: usize>(
        &self,
        instruments: &Instruments<'_, f64>,
        rows: &mut [ObservationRow<f64>],
        settings: &Settings<f64>,
        levels: &Levels,
        given: Option<Found>,
    ) -> Result<Solution, Unsolved>
    where
        f64: Unknowns<N>,
    {
        let robot = &self.robot.robot;
        let readings = &self.readings.rows;
        let shape = |row: usize| shape(&readings.get(row)?.value, levels);
        let mut again = rows.to_vec();
        let first = ObservationProblem::prepare_with((robot, robot), instruments, rows, shape)?;
        let unknowns = PARAMETERS + instruments.unknowns();
        let units: Vec<f64> = (0..unknowns).map(|place| first.unit_of(place)).collect();
        let start = *first.start_unknowns();
        let prior = first.prior(settings);
        let fit = |problem: &_| robust::fit(problem, settings, self.robust);
        let near = match &given {
            Some(own) => Some(own.robot.clone()),
            None if levels.position.joint() > 0.0 => Some(fit(&first)?.outcome.robot),
            None => None,
        };
        let problem = match &near {
            // Near a singularity the readings' weights are others at the robot of the file.
            Some(near) => {
                let from = if given.is_some() { near } else { robot };
                ObservationProblem::prepare_with((from, near), instruments, &mut again, shape)?
            }
            None => first,
        };
        let (mut of_rows, mut worth) = ((Vec::new(), Vec::new()), 1.0);
        let (found, end, frame) = if let Some(given) = given {
            (given, start, RigidTransform::identity())
        } else {
            let own = fit(&problem)?;
            (of_rows, worth) = ((own.weights, own.suspected), own.worth);
            let estimate = &own.outcome.estimate;
            let moved = std::array::from_fn(|place| estimate.correction[place] * units[place]);
            let found = Found::of(&own.outcome.robot, moved, estimate)?;
            (found, *own.outcome.unknowns(), own.outcome.frame())
        };
        let moved = DVector::from_fn(unknowns, |place, _| match found.moved.get(place) {
            Some(moved) => *moved,
            None => end[place] - start[place],
        });
        let mut correction = [0.0; N];
        for ((own, moved), unit) in correction.iter_mut().zip(&moved).zip(&units) {
            *own = if *unit > 0.0 { moved / unit } else { 0.0 };
        }
        let triangle: Triangle<f64, N> = prior.rows(1.0, &correction);
        let mut prior = DMatrix::zeros(unknowns, unknowns);
        let mut right = DVector::zeros(unknowns);
        for (index, row) in triangle.rows().take(unknowns).enumerate() {
            right[index] = row.last().copied().unwrap_or_default();
            for (column, entry) in (index..unknowns).zip(row) {
                let unit = units[column];
                prior[(index, column)] = if unit > 0.0 { entry / unit } else { 0.0 };
            }
        }
        let tolerance = settings.tolerance.as_ref();
        let moved = match tolerance.and_then(Tolerance::joint_zero) {
            Some(_) => from_centre(&prior, &right, moved),
            None => moved,
        };
        let covariance = found.covariance.resize(unknowns, unknowns, 0.0);
        let held = &prior * &covariance;
        let (at, of_rows) = ((&found.robot, &end), (&of_rows.0[..], &of_rows.1[..]));
        let (rows, sensitivities, log_spread) = looked_at(&problem, at, &covariance, of_rows);
        let mut noise = self.noise_of(&rows, levels, worth);
        if let (Some(separate), [own]) = (&found.separate, noise.as_mut_slice()) {
            own.squares = separate.squares;
            own.freedom = separate.freedom;
            own.known = separate.freedom;
        }
        Ok(Solution {
            method: self.method,
            frame: self.frame,
            robot: found.robot,
            places: places(instruments, &end, frame),
            places_before: places(instruments, &start, *problem.start_frame()),
            // With the prior's information P: C (C⁻¹ − P) C.
            of_readings: &covariance - held.tr_mul(&held),
            widening: 1.0,
            of_causes: None,
            beyond_expected: 0.0,
            covariance,
            prior,
            moved,
            prior_share: found.prior_share,
            transmissions: instruments.transmission.is_some(),
            noise,
            orientation: None,
            rows,
            sensitivities,
            effects: Vec::new(),
            readings: Readings::of_name(""),
            levels: *levels,
            log_spread,
            joint_noise_estimated: false,
            conditions: found.conditions,
            start: found.start,
        })
    }

    /// `worth`: of the rows, in parts of the sum of their weights.
    fn noise_of(&self, rows: &[RowFit], levels: &Levels, worth: f64) -> Vec<KindNoise> {
        let of = |kind: Kind| {
            let mut own = KindNoise {
                kind,
                stated: is_stated(self.robot, kind),
                sigma: levels.of(kind),
                readings: 0.0,
                freedom: 0.0,
                squares: 0.0,
                known: 0.0,
            };
            for (row, fit) in self.readings.rows.iter().zip(rows) {
                halt::check();
                if fit.left_out || fit.suspected {
                    continue;
                }
                for (place, read) in row.value.read().into_iter().enumerate() {
                    if read.is_some() && Kind::of_place(place) == kind {
                        own.readings += fit.weight * worth;
                        own.freedom += fit.weight * (worth - fit.leverage[place]);
                        own.squares += fit.weight * fit.whitened[place].powi(2);
                    }
                }
            }
            own.known = own.freedom;
            own
        };
        Kind::ALL
            .into_iter()
            .map(of)
            .filter(|own| own.readings > 0.0)
            .collect()
    }
}

/// For a linearised prior (U, r), the displacements u from its centre, U u = r. Unknowns outside the prior stay.
fn from_centre(
    prior: &DMatrix<f64>,
    right: &DVector<f64>,
    mut moved: DVector<f64>,
) -> DVector<f64> {
    let held = |place: &usize| prior[(*place, *place)] > 0.0;
    let held: Vec<_> = (0..moved.len()).filter(held).collect();
    let upper = prior.select_rows(&held).select_columns(&held);
    let mut others = moved.clone();
    for place in &held {
        others[*place] = 0.0;
    }
    let right = (right - prior * others).select_rows(&held);
    if let Some(found) = upper.solve_upper_triangular(&right) {
        for (place, own) in held.into_iter().zip(&found) {
            moved[place] = *own;
        }
    }
    moved
}

fn unusable(index: usize, error: SampleError) -> Unsolved {
    let error = match error {
        SampleError::Busy(busy) => busy.into(),
        error => ObservationError::Joints(error),
    };
    Unsolved::Row(index, error)
}

fn dynamic<const N: usize>(matrix: &SMatrix<f64, N, N>) -> DMatrix<f64> {
    DMatrix::from_column_slice(N, N, matrix.as_slice())
}

/// Places of the instruments for given values of the unknowns.
fn places<const N: usize>(
    instruments: &Instruments<'_, f64>,
    unknowns: &[f64; N],
    frame: RigidTransform<f64>,
) -> Places {
    let planes = (0..).zip(instruments.planes).map(|(index, _)| {
        let first = instruments.first_of_plane(index);
        let [c, a, b] = [0, 1, 2].map(|number| unknowns[first + number]);
        let up = Vector3::new(-a, -b, 1.0);
        PlaneFound {
            normal: up.normalize(),
            offset: c / up.norm(),
        }
    });
    let points = (0..).zip(instruments.points).map(|(index, point)| {
        let first = instruments.first_of_point(index);
        let [x, y, z] = [0, 1, 2].map(|number| unknowns[first + number]);
        PointFound {
            place: Vector3::new(x, y, z),
            offset: if point.offset {
                unknowns[first + 3]
            } else {
                0.0
            },
        }
    });
    Places {
        frame: instruments.sensor_frame.then_some(frame),
        planes: planes.collect(),
        points: points.collect(),
        distance_scale: instruments.of_scale().map_or(0.0, |place| unknowns[place]),
    }
}

/// Residuals and leverage of every row, the derivatives of some, and Σ ln of the spreads of the readings' σ.
fn looked_at<const N: usize>(
    problem: &ObservationProblem<'_, f64, N>,
    (robot, end): (&Robot<f64>, &[f64; N]),
    covariance: &DMatrix<f64>,
    (weights, suspected): (&[f64], &[bool]),
) -> (Vec<RowFit>, Vec<Sensitivity>, f64)
where
    f64: Unknowns<N>,
{
    let unknowns = covariance.nrows();
    let units: Vec<_> = (0..unknowns).map(|place| problem.unit_of(place)).collect();
    let count = problem.rows().len();
    let every = count.div_ceil(MOST_SENSITIVITIES).max(1);
    let looked = cores::map(0..count, |row| {
        let whitened = problem.residuals_at(robot, end, row);
        let columns = problem.linearized_at(robot, end, row);
        let mut by_unknowns = DMatrix::zeros(READINGS, unknowns);
        if let Some(columns) = columns {
            for (place, (column, unit)) in columns.as_ref().iter().zip(&units).enumerate() {
                if *unit > 0.0 {
                    let own = SVector::<f64, READINGS>::from(*column) / -*unit;
                    by_unknowns.set_column(place, &own);
                }
            }
        }
        let product = &by_unknowns * covariance;
        let leverage =
            std::array::from_fn(|reading| product.row(reading).dot(&by_unknowns.row(reading)));
        let fit = RowFit {
            whitened: whitened.unwrap_or_default(),
            leverage,
            weight: weights.get(row).copied().unwrap_or(1.0),
            suspected: suspected.get(row).is_some_and(|own| *own),
            left_out: problem.rows()[row].is_left_out(),
        };
        let kept = row.is_multiple_of(every) && !fit.left_out && !fit.suspected;
        let by_positions = kept
            .then(|| problem.by_positions_at(robot, end, row))
            .flatten();
        let sensitivity = by_positions.map(|by_positions| Sensitivity {
            row,
            by_unknowns,
            by_positions,
        });
        (fit, sensitivity)
    });
    let (fits, kept): (Vec<_>, Vec<_>) = looked.into_iter().unzip();
    let counted = problem.rows().iter().filter(|row| !row.is_left_out());
    let spread = counted
        .inspect(|_| halt::check())
        .map(|row| row.spread().ln());
    (fits, kept.into_iter().flatten().collect(), spread.sum())
}

/// The covariance of arms that were fitted separately; `None` without redundant readings.
pub(crate) fn by_arms(arms: &[ArmOutcome<f64>; 3]) -> Option<SMatrix<f64, PARAMETERS, PARAMETERS>> {
    let mut whole = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    for (arm, outcome) in arms.iter().enumerate() {
        whole
            .fixed_view_mut::<8, 8>(8 * arm, 8 * arm)
            .copy_from(outcome.covariance.as_ref()?);
    }
    Some(whole)
}

/// A fit to the arms' closure errors one by one, as the IKM method's, in which they count as independent.
struct Separate {
    covariance: SMatrix<f64, PARAMETERS, PARAMETERS>,
    /// Sum of the squared closure errors, in σ.
    squares: f64,
    freedom: f64,
}

impl Separate {
    /// The arms share the position's noise, which correlates the errors of their parameters:
    ///
    /// ```text
    /// Cᵢⱼ = Cᵢ (Σ gᵢₖ ρᵢⱼₖ gⱼₖᵀ) Cⱼ,   gᵢ = (∂fᵢ/∂Pᵢ)/σfᵢ,   ρᵢⱼ = σx² (∂fᵢ/∂X)ᵀ(∂fⱼ/∂X)/(σfᵢ σfⱼ)
    /// ```
    ///
    /// and leaves a pose with fewer degrees of freedom than closure errors, by 3/Σ ρᵢⱼ² (Satterthwaite 1946). `by_arms`
    /// holds Cᵢ. The residuals of positions would overstate the noise, because such a fit does not minimise them.
    fn of(
        robot: &Robot<f64>,
        samples: &[Sample<f64>],
        noise: &Noise<f64>,
        by_arms: &SMatrix<f64, PARAMETERS, PARAMETERS>,
    ) -> Self {
        let (mut squares, mut freedom) = (0.0, 0.0);
        let mut shared = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
        for sample in samples {
            let rows = ArmIndex::ALL.map(|index| Closure::of(robot, sample, index, noise));
            let mut correlations = 0.0;
            let (mut own_squares, mut own_freedom) = (0.0, 0.0);
            for (i, one) in rows.iter().enumerate() {
                for (j, other) in rows.iter().enumerate() {
                    let correlation = if i == j {
                        1.0
                    } else {
                        one.by_position.dot(&other.by_position)
                    };
                    correlations += correlation * correlation;
                    if i != j {
                        let mut block = shared.fixed_view_mut::<8, 8>(8 * i, 8 * j);
                        block += one.by_parameters * other.by_parameters.transpose() * correlation;
                    }
                }
                let known = by_arms.fixed_view::<8, 8>(8 * i, 8 * i);
                own_squares += one.error * one.error;
                own_freedom += 1.0 - one.by_parameters.dot(&(known * one.by_parameters));
            }
            squares += 3.0 / correlations * own_squares;
            freedom += 3.0 / correlations * own_freedom;
        }
        Self {
            covariance: by_arms + by_arms * shared * by_arms,
            squares,
            freedom,
        }
    }
}

/// An arm's closure error f at a pose, in σf, σf² = |∂f/∂X|² σx² + (∂f/∂q)² σq².
pub(crate) struct Closure {
    error: f64,
    pub(crate) by_parameters: SVector<f64, 8>,
    /// By the position's noise, in σx.
    by_position: Vector3<f64>,
}

impl Closure {
    pub(crate) fn of(
        robot: &Robot<f64>,
        sample: &Sample<f64>,
        index: ArmIndex,
        noise: &Noise<f64>,
    ) -> Self {
        let (arm, x, q) = (
            robot.arm(index),
            &sample.position,
            sample.joints[index.index()],
        );
        let by_position = arm.constraint_by_position(x, q);
        let by_joint = arm.constraint_by_joint(x, q) * noise.joint();
        let sigma = (by_position.norm() * noise.position()).hypot(by_joint);
        Self {
            error: arm.constraint(x, q) / sigma,
            by_parameters: arm.constraint_by_parameters(x, q) / sigma,
            by_position: by_position * (noise.position() / sigma),
        }
    }
}
