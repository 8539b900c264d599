//! How well a robot will be known after planned measurements: the variance of its positions over the workspace, from
//! the Cramér–Rao bound with the tolerance as prior.

use super::PlanError;
use super::setup::Setup;
use crate::accuracy::information::prior;
use crate::accuracy::uncertainty::{self, INSIDE, Weights, first_inside, inside};
use crate::cores;
use crate::effects::{At, Course, EffectKind, Estimated, Platform};
use crate::files::{Kind, READINGS, Reading, Readings, RobotFile};
use crate::fit::Frame;
use crate::fit::jointly::stated;
use crate::fit::observations::{instruments, levels, rows as prepared, shape, tolerance};
use crate::fit::solution::{MOST, OF_ROBOT, PARAMETERS, RobotCovariance, WITH_TRANSMISSIONS};
use crate::geometry::{NUMBERS, Parallelograms};
use delta_cal::observations::ObservationProblem;
use delta_cal::simulate::made_robot;
use delta_cal::{Robot, Sample, Settings};
use nalgebra::{DMatrix, DVector};
use rand_pcg::Pcg32;
use serde::Serialize;

/// Robots drawn from the tolerance. The mean square differs by up to 40 % between robots, so the rms over 64 of them
/// is known to 3 %.
const MADE: usize = 64;
/// Poses per drawn robot.
const EACH: usize = 400;

/// The expected position error, one σ, mm: rms over the workspace and over robots drawn from the tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Precision {
    /// Relative: after the best rigid motion.
    #[serde(rename = "relative_rms_mm")]
    pub relative: f64,
    /// Absolute: in the robot's base frame.
    #[serde(rename = "absolute_rms_mm")]
    pub absolute: f64,
}

impl Precision {
    /// The absolute or the relative error.
    pub const fn of(&self, absolute: bool) -> f64 {
        if absolute {
            self.absolute
        } else {
            self.relative
        }
    }
}

/// A robot and what its position errors weigh.
#[derive(Debug, Clone)]
struct Place {
    file: RobotFile,
    weights: Weights,
}

/// Evaluates measurements over the workspaces of the nominal robot and of robots drawn from the tolerance.
#[derive(Debug, Clone)]
pub(super) struct Judge {
    nominal: Place,
    /// Empty without a tolerance.
    made: Vec<Place>,
}

impl Judge {
    /// `region`: the nominal robot's poses at which positions count; `None` for the whole workspace of each robot.
    pub(super) fn new(
        file: &RobotFile,
        region: Option<&[Sample<f64>]>,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        // Each robot's own workspace: near its edges errors grow steeply, and the edges differ between robots.
        let place = |file: RobotFile, count| match region {
            Some(poses) => Place::new(file, poses),
            None => Place::new(
                file.clone(),
                &first_inside(&file.robot, &file.reach(), count),
            ),
        };
        let nominal = place(file.clone(), INSIDE).ok_or(PlanError::NoPose)?;
        let made = file.tolerance.iter().flat_map(|tolerance| {
            let made = (0..MADE).filter_map(|_| made_robot(&file.robot, tolerance, rng).ok());
            made.collect::<Vec<_>>()
        });
        let made = cores::map(made, |robot| {
            let file = file.clone();
            place(RobotFile { robot, ..file }, EACH)
        });
        Ok(Self {
            nominal,
            made: made.into_iter().flatten().collect(),
        })
    }

    /// W of the nominal robot.
    pub(super) fn weights(&self, absolute: bool) -> &RobotCovariance {
        &self.nominal.weights[usize::from(!absolute)]
    }

    /// Before any measurement; `None` without a tolerance.
    pub(super) fn before(&self) -> Option<Precision> {
        self.over_robots(|robot| prior(&robot.file))
    }

    /// After measuring these rows. A robot that they do not calibrate keeps its error.
    pub(super) fn after(
        &self,
        setup: &Setup,
        rows: &[Reading],
        anchors: &[Reading],
    ) -> Option<Precision> {
        let known = |robot: &Robot<f64>| {
            let [rows, anchors] = [rows, anchors].map(|rows| {
                let rows = rows.iter().map(|row| setup.read(robot, row));
                rows.collect::<Vec<_>>()
            });
            let found = Information::of(robot, setup, &rows, &anchors).ok()?;
            found.robot_covariance()
        };
        self.over_robots(|place| known(&place.file.robot).or_else(|| prior(&place.file)))
    }

    /// The rms over all robots, given the covariance of each; `None` if one of them has none.
    fn over_robots(
        &self,
        known: impl Fn(&Place) -> Option<RobotCovariance> + Sync,
    ) -> Option<Precision> {
        let robots = match &self.made[..] {
            [] => std::slice::from_ref(&self.nominal),
            made => made,
        };
        let squares = cores::map(robots, |place| {
            let covariance = known(place)?;
            let squares = place.weights.each_ref().map(|own| own.dot(&covariance));
            squares.iter().all(|own| *own >= 0.0).then_some(squares)
        });
        let squares: Vec<[f64; 2]> = squares.into_iter().collect::<Option<_>>()?;
        let rms = |of: usize| {
            let sum: f64 = squares.iter().map(|own| own[of]).sum();
            (sum / squares.len() as f64).sqrt()
        };
        Some(Precision {
            absolute: rms(0),
            relative: rms(1),
        })
    }
}

/// [`Judge::weights`] over the whole workspace.
pub(super) fn weights(file: &RobotFile, absolute: bool) -> Option<Box<RobotCovariance>> {
    let poses = inside(&file.robot, &file.reach());
    let [of_absolute, of_relative] = Place::new(file.clone(), &poses)?.weights;
    Some(if absolute { of_absolute } else { of_relative })
}

impl Place {
    /// Only the poses that the robot reaches clear of singularities count.
    fn new(file: RobotFile, poses: &[Sample<f64>]) -> Option<Self> {
        let reach = file.reach();
        let there = poses.iter().filter_map(|pose| {
            let position = reach.clear_position(&file.robot, &pose.joints).ok()?;
            Some(Sample { position, ..*pose })
        });
        let there: Vec<_> = there.collect();
        let uncertain = file.transmission.is_some() || file.parallelograms.is_some();
        let weights = uncertainty::weights((&file.robot, &file.tool()), &there, uncertain)?;
        Some(Self { file, weights })
    }
}

/// The information of rows about all unknowns, in the units of the core's problem.
#[derive(Debug, Clone)]
pub(super) struct Information {
    /// The sensitivity of each row's readings to the unknowns, in σ: one column per reading.
    pub(super) rows: Vec<DMatrix<f64>>,
    /// Information before any measurement: the priors, and a weak one (no parameter is off by more than a forearm)
    /// that keeps the matrix regular.
    prior: DMatrix<f64>,
    /// The size of each unknown's unit, in mm or radians.
    pub(super) units: DVector<f64>,
    /// Of each of the robot's numbers, the index among the unknowns; `None` if it is known.
    of_robot: [Option<usize>; OF_ROBOT],
}

/// σ of a mounting of which nothing is known, radians.
const ANY_MOUNTING: f64 = 1.0;
/// σ of what is exact, mm.
const LEAST_SIGMA: f64 = 1e-6;

/// Number of the unknowns of the effects before one of a kind.
fn before(effects: &[Estimated], kind: EffectKind) -> Option<usize> {
    let index = effects.iter().position(|own| own.effect.kind == kind)?;
    Some(effects[..index].iter().map(|own| own.by.len()).sum())
}

/// The rods and the noise of rotations, radians, and the first unknown of the rods.
type Rotations = ((Parallelograms, f64), usize);

/// The sensitivity of a row's rotation, if it has one: to the rods, and to how its target is mounted, the first of these unknowns
/// being `mountings`.
fn read_rotation(
    robot: &Robot<f64>,
    rotations: Option<Rotations>,
    row: &Reading,
    (all, mountings): (&mut DMatrix<f64>, usize),
) {
    let Some(((rods, sigma), tilt)) = rotations else {
        return;
    };
    let position = row.turn.and_then(|_| robot.forward(&row.joints).ok());
    let by = position.and_then(|own| rods.turns(robot, (&own, &row.joints)));
    let Some(by) = by else {
        return;
    };
    let mounting = mountings + 3 * row.target;
    for axis in 0..3 {
        let mut column = all.column_mut(READINGS + axis);
        let by = by.row(axis).transpose() / sigma;
        column.rows_mut(tilt, NUMBERS).copy_from(&by);
        column[mounting + axis] = 1.0 / sigma;
    }
}

impl Information {
    /// The information of rows about a robot. Their values matter only where they locate the instruments; `anchors` help to locate
    /// the instruments and add no information.
    pub(super) fn of(
        robot: &Robot<f64>,
        setup: &Setup,
        rows: &[Reading],
        anchors: &[Reading],
    ) -> Result<Self, PlanError> {
        let (planes, points): (Vec<_>, Vec<_>) = (
            setup.planes.iter().map(|plane| plane.known).collect(),
            setup.points.iter().map(|point| point.known).collect(),
        );
        let levels = levels(&setup.robot).ok_or(PlanError::Singular)?;
        let all = prepared(rows.iter().chain(anchors));
        let mut all = all.map_err(|_| PlanError::TooManyInstruments)?;
        for anchor in &mut all[rows.len()..] {
            anchor.set_weight(0.0);
        }
        let instruments = instruments(&setup.robot, setup.frame, &planes, &points, &levels)
            .map_err(|_| PlanError::Singular)?;
        let unknowns = PARAMETERS + instruments.unknowns();
        if unknowns > MOST {
            return Err(PlanError::TooManyInstruments);
        }
        let shape = |index: usize| shape(rows.get(index)?, &levels);
        let (at, all) = ((robot, robot), &mut all);
        let problem = ObservationProblem::<f64, MOST>::prepare_with(at, &instruments, all, shape)
            .map_err(|_| PlanError::Singular)?;
        let known = setup.datum.as_ref();
        let frame = known.map_or(setup.frame, |_| Frame::Base);
        let settings = Settings::new().with_tolerance(tolerance(&setup.robot, frame));
        let prior = problem.prior(&settings);
        let [arm, ..] = robot.arms();
        let least = (arm.upper_arm_length() / arm.lb()).powi(2);
        let touched = !setup.planes.is_empty();
        let measured = |kind| kind != Kind::Height || touched;
        let effects = stated(&setup.robot, &setup.targets, measured, frame);
        let platform = Platform::of(&setup.robot, &setup.targets);
        let course = Course::of(robot, platform, &setup.places, &Readings::of_readings(rows));
        let of_effects: usize = effects.iter().map(|own| own.effect.unknowns()).sum();
        let orientation = setup.robot.instruments.orientation_noise;
        let rods = setup.robot.parallelograms.zip(orientation);
        // How each target is mounted, of which a rotation tells nothing else.
        let (turns, mountings) = rods.map_or((0, 0), |_| (3, 3 * setup.targets.len().max(1)));
        let beyond = of_effects + mountings;
        let start = problem.start_unknowns();
        let first = |kind| Some(unknowns + before(&effects, kind)?);
        let tilt = first(EffectKind::Tilt);
        let sensitivity = |index: usize| {
            let columns = problem.linearized_at(robot, start, index);
            let mut all =
                DMatrix::from_fn(unknowns + beyond, READINGS + turns, |unknown, reading| {
                    let own = columns.as_ref();
                    let own = own.and_then(|own| own.get(unknown)?.get(reading));
                    own.copied().unwrap_or_default()
                });
            let by_positions = problem.by_positions_at(robot, start, index);
            for (by_position, joints) in by_positions.iter().flatten().zip(rows[index].poses()) {
                let Some(at) = joints.and_then(|joints| At::new(robot, &joints)) else {
                    continue;
                };
                let moves = effects.iter();
                let moves = moves.flat_map(|own| own.effect.columns(&at, &course, index));
                for (place, moved) in moves.enumerate() {
                    for (reading, by_position) in by_position.iter().enumerate() {
                        all[(unknowns + place, reading)] -= by_position.dot(&moved);
                    }
                }
            }
            let mountings = unknowns + of_effects;
            read_rotation(robot, rods.zip(tilt), &rows[index], (&mut all, mountings));
            all
        };
        let of_core = |own| (own < unknowns).then(|| problem.unit_of(own));
        let units = DVector::from_fn(unknowns + beyond, |own, _| of_core(own).unwrap_or(1.0));
        let robots = setup.robot_unknowns();
        let of_robot = std::array::from_fn(|own| match own {
            WITH_TRANSMISSIONS.. => tilt.map(|first| first + own - WITH_TRANSMISSIONS),
            own => (own < robots).then_some(own),
        });
        let mut prior = DMatrix::from_fn(unknowns + beyond, unknowns + beyond, |row, column| {
            if row.max(column) >= unknowns {
                return 0.0;
            }
            let least = if row == column { least } else { 0.0 };
            prior.information(row, column) + least
        });
        let sigmas = effects.iter().flat_map(|own| own.sigma.iter().copied());
        let sigmas = sigmas.chain(std::iter::repeat_n(ANY_MOUNTING, mountings));
        for (place, sigma) in (unknowns..).zip(sigmas) {
            // Where one target is in a free frame is the frame's place.
            prior[(place, place)] = sigma.max(LEAST_SIGMA).powi(-2);
        }
        if let Some(datum) = known {
            // Shift and turn of the frame are the first unknowns after the robot's; the points show the scale as well.
            let scale = first(EffectKind::Scale);
            let places: Vec<_> = (robots..robots + 6).chain(scale).collect();
            for (row, to_row) in places.iter().enumerate() {
                for (column, to_column) in places.iter().enumerate() {
                    prior[(*to_row, *to_column)] +=
                        datum[(row, column)] * units[*to_row] * units[*to_column];
                }
            }
        }
        Ok(Self {
            rows: (0..rows.len()).map(sensitivity).collect(),
            prior,
            units,
            of_robot,
        })
    }

    /// The information of the priors and all rows.
    pub(super) fn matrix(&self) -> DMatrix<f64> {
        let prior = self.prior.clone();
        let rows = self.rows.iter();
        rows.fold(prior, |sum, rows| sum + rows * rows.transpose())
    }

    /// The covariance of all unknowns after these rows.
    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        Some(self.matrix().cholesky()?.inverse())
    }

    /// The covariance of the robot after these rows.
    pub(super) fn robot_covariance(&self) -> Option<RobotCovariance> {
        Some(self.of_robot(&self.covariance()?))
    }

    /// The robot's own part of a covariance, in mm and radians.
    pub(super) fn of_robot(&self, covariance: &DMatrix<f64>) -> RobotCovariance {
        RobotCovariance::from_fn(
            |row, column| match (self.of_robot[row], self.of_robot[column]) {
                (Some(row), Some(column)) => {
                    covariance[(row, column)] * self.units[row] * self.units[column]
                }
                _ => 0.0,
            },
        )
    }

    /// Weights of the robot's own parameters (mm, radians), extended to all unknowns and their units.
    pub(super) fn weights(&self, of_robot: &RobotCovariance) -> DMatrix<f64> {
        let mut weights = DMatrix::zeros(self.units.len(), self.units.len());
        for (own, row) in self.of_robot.iter().enumerate() {
            for (other, column) in self.of_robot.iter().enumerate() {
                if let (Some(row), Some(column)) = (*row, *column) {
                    weights[(row, column)] =
                        of_robot[(own, other)] * self.units[row] * self.units[column];
                }
            }
        }
        weights
    }
}
