//! Effects that have a prior, estimated together with the robot.
//!
//! The estimators fit the robot to readings from which the effects, as known so far, are removed. One linear step of all
//! unknowns then says how far the effects are off:
//!
//! ```text
//! minimise  |A u + E a − r|² + |U u − m|² + |(a − mean)/σ|² + |datum points|²
//! ```
//!
//! A, E are the rows' derivatives by unknowns u and effects a, U the prior of u. Both are repeated until the step would
//! gain nothing; the covariance is that of all unknowns together.

use super::Frame;
use super::datum::Datum;
use super::observations::{SETTLED, USUAL_TOUCH, is_stated, places as known_places};
use super::solution::{Sensitivity, Solution, Unsolved};
use crate::effects::{
    At, Course, Effect, EffectKind, Estimated, Orientation, OrientationNoise, Places, Platform,
    PointFound, USUAL_TURN, motion, moved, orientations, sigmas_of_bed,
};
use crate::files::robot_file::{ONLY_TARGET, RobotFile};
use crate::files::samples_file::{Kind, READINGS, Readings};
use crate::geometry::{NUMBERS, centroid};
use crate::halt;
use delta_cal::frame::RigidTransform;
use delta_cal::{Refusal, Robot};
use nalgebra::{DMatrix, DVector, SMatrix, Vector3};

/// Fits with the effects of the last one removed; a slip of 30° takes six.
const ROUNDS: u32 = 12;
/// Degrees of freedom of what touches and beds usually are.
const BED_FREEDOM: f64 = 2.0;
/// Rounds of the factor of heights, in each of which everything else is linear.
const HEIGHT_ROUNDS: u32 = 60;
/// Noise so many times the stated one is no noise.
const WIDEST: f64 = 1e6;
/// Factor by which a widened noise shrinks while that is possible.
const NARROWED: f64 = 3.0;
/// σ of an unknown that is exact.
const EXACT: f64 = 1e-6;
/// A step that would lower the cost by less than this, in units of the residuals' variance, is none: every unknown is
/// within a tenth of its σ.
const NOTHING: f64 = 0.01;
/// A turn of the sensor's frame that moves rows against each other by less than this many σ is none.
const STILL: f64 = 0.05;
/// Weight of 0 for an effect without a prior, as a fraction of its column.
const INDISTINCT: f64 = 1e-6;

/// What the robot file states about effects on readings of these kinds; in a sensor's own frame, where one target is is the
/// frame's place.
pub(crate) fn stated(
    robot: &RobotFile,
    targets: &[String],
    measured: impl Fn(Kind) -> bool,
    frame: Frame,
) -> Vec<Estimated> {
    let facts = &robot.instruments;
    let only = [ONLY_TARGET.to_owned()];
    let names = if targets.is_empty() {
        &only[..]
    } else {
        targets
    };
    let targets = names.iter().enumerate().filter_map(|(index, name)| {
        let own = facts.target(name)?;
        let [mean, sigma] = [own.place, own.sigma].map(|own| own.as_slice().to_vec());
        let mut found = Estimated::new(Effect::of(EffectKind::Target).at(index), mean, sigma);
        if frame == Frame::Sensor && facts.datum.is_empty() && names.len() == 1 {
            found.sigma.fill(0.0);
        }
        Some(found)
    });
    let mut all: Vec<_> = targets.collect();
    if let Some(rods) = &robot.parallelograms {
        let mean = rods.numbers.as_flattened().to_vec();
        let sigma = rods.sigmas().to_vec();
        all.push(Estimated::new(Effect::of(EffectKind::Tilt), mean, sigma));
    }
    let scaled = measured(Kind::Position) || measured(Kind::Distance);
    if scaled && facts.distance_scale.is_none() {
        let sigma = vec![facts.scale_sigma()];
        all.push(Estimated::new(
            Effect::of(EffectKind::Scale),
            vec![facts.expansion],
            sigma,
        ));
    }
    if let Some(uneven) = facts.bed.filter(|_| measured(Kind::Height)) {
        let effect = Effect::of(EffectKind::Bed);
        let mean = vec![0.0; effect.unknowns()];
        all.push(Estimated::new(effect, mean, sigmas_of_bed(uneven)));
    }
    if let Some(sigma) = facts.oversize.filter(|_| measured(Kind::Distance)) {
        let effect = Effect::of(EffectKind::Oversize);
        all.push(Estimated::new(effect, vec![0.0], vec![sigma]));
    }
    all
}

/// Fits the robot and the effects stated in its file, and those opened beside them. `alone`: the robot fitted to readings
/// in a frame, with a noise times a factor, and with this noise of heights if that is estimated here. The factor is above 1 until the effects explain what contradicts the noise;
/// if this is not `strict`, also where they do not.
pub(super) fn jointly(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
    (opened, strict): (&[Estimated], bool),
    alone: impl Fn(&Readings, Frame, f64, Option<f64>) -> Result<Solution, Unsolved>,
) -> Result<Solution, Unsolved> {
    // An invalid datum was refused earlier.
    let datum = Datum::of(robot, frame).ok().flatten();
    let mut effects = stated(robot, &readings.targets, |own| readings.holds(own), frame);
    if datum.is_some() {
        effects.push(Estimated::open(Effect::of(EffectKind::Datum)));
    }
    for own in opened {
        match effects.iter_mut().find(|known| known.effect == own.effect) {
            Some(known) => *known = own.clone(),
            None => effects.push(own.clone()),
        }
    }
    let mut state = State {
        own: robot.robot.clone(),
        counted: robot.instruments.target_place(),
        platform: Platform::of(robot, &readings.targets),
        found: places(robot, readings, datum.as_ref().map(|own| own.frame)),
        datum,
        effects,
        height: None,
        turn: (
            robot.instruments.orientation_noise.unwrap_or(USUAL_TURN),
            robot.instruments.orientation_noise,
        ),
        orientations: Vec::new(),
    };
    if state.of_bed().is_some() && !is_stated(robot, Kind::Height) {
        state.height = Some(USUAL_TOUCH);
    }
    let is_free = frame == Frame::Sensor && state.datum.is_none();
    if is_free {
        state.found.frame = state.aligned(readings);
    }
    let mut last = f64::INFINITY;
    for round in 1.. {
        halt::check();
        let course = state.course(readings);
        let undone = state.without(&course, readings);
        let sensor = state.datum.as_ref().and(state.found.frame);
        let (seen, within) = match sensor {
            Some(sensor) => (undone.turned(&sensor.inverse()), Frame::Base),
            None => (undone.clone(), frame),
        };
        let exact = alone(&seen, within, 1.0, state.height);
        let (mut solution, factor) = match exact {
            Ok(ref solution) => (solution.clone(), 1.0),
            Err(why) if !strict || (round < ROUNDS && !state.effects.is_empty()) => {
                let fit = |factor| alone(&seen, within, factor, state.height);
                let narrower = last / NARROWED;
                let possible = narrower > 1.0 && narrower.is_finite();
                match possible.then(|| fit(narrower)) {
                    Some(Ok(solution)) => (solution, narrower),
                    Some(Err(_)) => widened(why, narrower, fit)?,
                    None => widened(why, 1.0, fit)?,
                }
            }
            Err(why) => return Err(why),
        };
        let [seen, undone] = [seen, undone].map(|own| own.with_sigma_times(factor));
        // With less noise, effects and robot are better known.
        let narrows = factor > 1.0 && factor < last;
        last = factor;
        if sensor.is_some() {
            (solution.places.frame, solution.places_before.frame) = (sensor, sensor);
        }
        state.orientations = state.turned(&course, readings, &solution);
        let step = Step::of(&solution, &seen, &course, &state);
        state.own = solution.robot.clone();
        state.found.planes.clone_from(&solution.places.planes);
        state.found.points.clone_from(&solution.places.points);
        let turn = if is_free {
            let turn = state.turn(&solution, readings);
            state.found.frame = solution.places.frame;
            turn
        } else {
            Turn::default()
        };
        let turns = turn.spread > STILL * solution.levels.position.position();
        let noisier = step.heights.as_ref().is_some_and(|own| !own.settled())
            || step
                .orientation
                .is_some_and(|own| (own.used_deg.to_radians() / state.turn.0).ln().abs() > SETTLED);
        if round < ROUNDS && (turns || narrows || noisier || step.gains()) {
            state.take(&step);
            continue;
        }
        // The effects explain no more of what the noise does not.
        if strict {
            exact?;
        }
        turn.added_to(&mut solution);
        solution.readings = undone.moved(&-turn.mean);
        step.added_to(&mut solution, state.effects);
        return Ok(solution);
    }
    Err(Unsolved::NoRedundancy)
}

/// A fit with so much noise, more than `too_little`, that nothing contradicts it.
///
/// # Errors
/// `why` there is none with the stated noise, if more noise does not help.
fn widened(
    why: Unsolved,
    too_little: f64,
    fit: impl Fn(f64) -> Result<Solution, Unsolved>,
) -> Result<(Solution, f64), Unsolved> {
    let (mut factor, mut last) = (1.0, why);
    while factor < WIDEST {
        let (times, is_far) = match last {
            Unsolved::Refused(Refusal::ResidualContradictsNoise { ratio, .. }) => {
                (f64::from(ratio).max(2.0), false)
            }
            Unsolved::Refused(
                Refusal::FarFromNominal { .. }
                | Refusal::NotConverged { .. }
                | Refusal::Undetermined { .. }
                | Refusal::ImpossibleGeometry { .. }
                | Refusal::ImpossibleRobot(_)
                | Refusal::NonFinite { .. }
                | Refusal::WrongSide,
            ) => (8.0, true),
            _ => return Err(why),
        };
        factor *= times;
        if is_far && factor <= too_little {
            continue;
        }
        match fit(factor) {
            Ok(solution) => return Ok((solution, factor)),
            Err(error) => last = error,
        }
    }
    Err(why)
}

/// The readings of the platform point where targets are as stated, in the frame that they are in: a known one, or the one in
/// which the robot of the file fits best.
pub(crate) fn of_platform_point(
    robot: &RobotFile,
    readings: &Readings,
    known: Option<RigidTransform<f64>>,
) -> Readings {
    let mut state = State {
        own: robot.robot.clone(),
        counted: robot.instruments.target_place(),
        platform: Platform::of(robot, &readings.targets),
        found: places(robot, readings, known),
        datum: None,
        height: None,
        turn: (USUAL_TURN, None),
        orientations: Vec::new(),
        effects: stated(
            robot,
            &readings.targets,
            |own| readings.holds(own),
            Frame::Base,
        ),
    };
    if known.is_none() {
        state.found.frame = state.aligned(readings);
    }
    let course = state.course(readings);
    state.without(&course, readings)
}

/// What is known of the instruments before a fit.
fn places(robot: &RobotFile, readings: &Readings, frame: Option<RigidTransform<f64>>) -> Places {
    let (_, points) = known_places(robot, readings);
    let found = points.iter().map(|own| {
        let (place, _) = own.known?;
        Some(PointFound { place, offset: 0.0 })
    });
    Places {
        frame,
        points: found.collect::<Option<_>>().unwrap_or_default(),
        ..Places::default()
    }
}

/// What is known of everything so far.
struct State {
    own: Robot<f64>,
    /// The target that the places of planes and points count already.
    counted: Vector3<f64>,
    platform: Platform,
    found: Places,
    datum: Option<Datum>,
    effects: Vec<Estimated>,
    /// σ of heights, if it is estimated together with the shape of the bed.
    height: Option<f64>,
    /// σ of rotations, and the stated one.
    turn: (f64, Option<f64>),
    /// The rotations that were read.
    orientations: Vec<Orientation>,
}

impl State {
    /// The shape of the bed, if it is estimated.
    fn of_bed(&mut self) -> Option<&mut Estimated> {
        let mut all = self.effects.iter_mut();
        all.find(|own| own.effect.kind == EffectKind::Bed)
    }

    fn of_kind(&self, kind: EffectKind) -> impl Iterator<Item = &Estimated> {
        let all = self.effects.iter();
        all.filter(move |own| own.effect.kind == kind)
    }

    /// The effects that are removed from readings; the frame of the datum is that of `found` itself.
    fn removed(&self) -> Vec<(Effect, &[f64])> {
        let own = self.effects.iter();
        let own = own.filter(|own| own.effect.kind != EffectKind::Datum);
        let own = own.map(|own| (own.effect, own.by.as_slice()));
        own.filter(|(_, by)| by.iter().any(|by| *by != 0.0))
            .collect()
    }

    fn course(&self, readings: &Readings) -> Course {
        Course {
            counted: self.counted,
            ..Course::of(&self.own, self.platform.clone(), &self.found, readings)
        }
    }

    fn without(&self, course: &Course, readings: &Readings) -> Readings {
        course.without(&self.found, readings, &self.removed())
    }

    /// The rotations in rows, if the rods are known: with the weights of a solution, in its frame.
    fn turned(
        &self,
        course: &Course,
        readings: &Readings,
        solution: &Solution,
    ) -> Vec<Orientation> {
        let mut effects = self.effects.iter();
        let tilt = effects.find(|own| own.effect.kind == EffectKind::Tilt);
        let Some((rods, tilt)) = self.platform.rods.zip(tilt) else {
            return Vec::new();
        };
        orientations(
            (&course.robot, &rods.with_numbers(&tilt.by)),
            solution.places.frame.as_ref(),
            readings,
            |row| solution.rows.get(row).map_or(1.0, |own| own.weight),
        )
    }

    /// A first frame of the sensor, in which the robot of the file fits best.
    fn aligned(&self, readings: &Readings) -> Option<RigidTransform<f64>> {
        let course = self.course(readings);
        let pairs = readings.rows.iter().enumerate().filter_map(|(index, row)| {
            let sample = row.value.sample()?;
            let at = At::new(&self.own, &sample.joints)?;
            let own = self.of_kind(EffectKind::Target);
            let beside = own.map(|own| own.effect.displacement(&at, &course, index, &own.by));
            Some((at.position + beside.sum::<Vector3<f64>>(), sample.position))
        });
        RigidTransform::align(pairs.collect::<Vec<_>>())
    }

    /// How the frame that was found moves targets against where the last frame had them.
    fn turn(&self, solution: &Solution, readings: &Readings) -> Turn {
        let shift = |frame: &Option<RigidTransform<f64>>, index: usize| {
            let mut own = self.of_kind(EffectKind::Target);
            let own = own.find(|own| own.effect.index == index);
            let by = own.map_or_else(Vector3::zeros, |own| Vector3::from_row_slice(&own.by));
            frame.map_or(by, |frame| frame.rotation * by)
        };
        let rows = readings.rows.iter().map(|row| row.value.target);
        let moves = rows
            .map(|index| shift(&solution.places.frame, index) - shift(&self.found.frame, index));
        let moves: Vec<_> = moves.collect();
        let mean = centroid(moves.iter().copied());
        let spread = moves
            .iter()
            .map(|own| (own - mean).norm())
            .fold(0.0, f64::max);
        Turn { mean, spread }
    }

    /// Rows of what is known of the effects beside the readings: stated values, and the datum points, of this noise.
    fn of_effects(&self, course: &Course, noise: f64) -> DMatrix<f64> {
        let number: usize = self.effects.iter().map(|own| own.by.len()).sum();
        let mut rows: Vec<DVector<f64>> = Vec::new();
        let mut place = 0;
        for own in &self.effects {
            for ((by, mean), sigma) in own.by.iter().zip(&own.mean).zip(&own.sigma) {
                let weight = 1.0 / sigma.max(EXACT);
                let mut row = DVector::zeros(number + 1);
                row[place] = weight;
                row[number] = weight * (mean - by);
                rows.push(row);
                place += 1;
            }
        }
        if let (Some(datum), Some(frame)) = (&self.datum, &self.found.frame) {
            let scale = self.of_kind(EffectKind::Scale).next();
            let scale = scale.map_or(0.0, |own| own.by[0]);
            for (point, sigma) in datum.points(noise) {
                let seen = frame.inverse().apply(&point.seen);
                let off = seen - point.place * (1.0 + scale);
                let columns = self.effects.iter().flat_map(|own| match own.effect.kind {
                    EffectKind::Datum => motion(&(point.place - course.centre)).to_vec(),
                    EffectKind::Scale => vec![point.place],
                    _ => vec![Vector3::zeros(); own.by.len()],
                });
                let columns: Vec<_> = columns.collect();
                for axis in 0..3 {
                    let cells = columns.iter().map(|own| own[axis]).chain([off[axis]]);
                    rows.push(DVector::from_iterator(number + 1, cells) / sigma);
                }
            }
        }
        let before = self.effects.iter();
        let before = before.take_while(|own| own.effect.kind != EffectKind::Tilt);
        let first = before.map(|own| own.by.len()).sum();
        for own in self.orientations.iter().flat_map(SMatrix::row_iter) {
            let mut row = DVector::zeros(number + 1);
            row.rows_mut(first, NUMBERS)
                .copy_from(&own.columns(0, NUMBERS).transpose());
            row[number] = own[NUMBERS];
            rows.push(row / self.turn.0);
        }
        DMatrix::from_fn(rows.len(), number + 1, |row, column| rows[row][column])
    }

    /// What the last rows of what is known of the effects say of the noise of rotations; with the step of the effects and its
    /// covariance.
    fn noise_of_rotations(
        &self,
        known: &DMatrix<f64>,
        (by, covariance): (&DVector<f64>, &DMatrix<f64>),
    ) -> Option<OrientationNoise> {
        let rows = 3 * self.orientations.len();
        let read = known.rows_range(known.nrows() - rows..);
        let columns = read.columns(0, by.len());
        let residuals = read.column(by.len()) - columns * by;
        // The mean over a target's rows says how it is mounted.
        let taken = 3.0 * self.platform.targets() as f64
            + (columns * covariance * columns.transpose()).trace();
        let freedom = residuals.len() as f64 - taken;
        (rows > 0).then(|| OrientationNoise::of(&residuals, self.turn, freedom))
    }

    /// Adds a step to the effects.
    fn take(&mut self, step: &Step) {
        let mut next = 0;
        for own in &mut self.effects {
            let by = &step.by.as_slice()[next..next + own.by.len()];
            next += own.by.len();
            if own.effect.kind == EffectKind::Datum {
                let frame = self.found.frame.unwrap_or_default();
                self.found.frame = Some(after_motion(&frame, &step.centre, by));
            } else {
                for (own, more) in own.by.iter_mut().zip(by) {
                    *own += more;
                }
            }
        }
        if let Some(own) = &step.orientation {
            self.turn.0 = own.used_deg.to_radians();
        }
        if let (Some(height), Some(own)) = (self.height, &step.heights) {
            let factor = own.widened * own.variance.sqrt();
            self.height = Some(height * factor);
            for sigma in self.of_bed().into_iter().flat_map(|own| &mut own.sigma) {
                *sigma *= factor;
            }
        }
    }
}

/// The frame from which readings come if everything is moved and turned about a centre before.
fn after_motion(
    frame: &RigidTransform<f64>,
    centre: &Vector3<f64>,
    by: &[f64],
) -> RigidTransform<f64> {
    let origin = moved(&Vector3::zeros(), centre, by);
    let axes = [0, 1, 2].map(|axis| moved(&Vector3::ith(axis, 1.0), centre, by) - origin);
    RigidTransform {
        rotation: frame.rotation * nalgebra::Matrix3::from_columns(&axes),
        translation: frame.apply(&origin),
    }
}

/// Targets moved by a turn of the sensor's frame: all of them, and against each other, mm.
#[derive(Default)]
struct Turn {
    mean: Vector3<f64>,
    spread: f64,
}

impl Turn {
    /// What moves all targets alike is the frame's place.
    fn added_to(&self, solution: &mut Solution) {
        if self.mean == Vector3::zeros() {
            return;
        }
        for frame in [
            &mut solution.places.frame,
            &mut solution.places_before.frame,
        ]
        .into_iter()
        .flatten()
        {
            frame.translation -= self.mean;
        }
    }
}

/// One linear step of all unknowns.
struct Step {
    /// Of the effects.
    by: DVector<f64>,
    /// The decrease of the cost, in units of the residuals' variance.
    gain: f64,
    /// Covariance of the effects.
    covariance: DMatrix<f64>,
    /// −∂u/∂a: how the other unknowns follow.
    follows: DMatrix<f64>,
    /// E of each row with derivatives.
    columns: Vec<DMatrix<f64>>,
    /// Triangle of the effects' own prior, the datum points' information included, and its right-hand side.
    prior: (DMatrix<f64>, DVector<f64>),
    /// About which frames turn.
    centre: Vector3<f64>,
    /// The noise of heights and the shape of the bed, if they are estimated.
    heights: Option<Heights>,
    /// The noise of rotations.
    orientation: Option<OrientationNoise>,
}

impl Step {
    fn of(solution: &Solution, readings: &Readings, course: &Course, state: &State) -> Self {
        let (unknowns, rows) = (solution.covariance.nrows(), &solution.sensitivities);
        let effects = &state.effects;
        let number: usize = effects.iter().map(|own| own.by.len()).sum();
        let width = unknowns + number + 1;
        let every = solution.rows.len() as f64 / (rows.len() as f64).max(1.0);
        let mut all: Vec<DVector<f64>> = Vec::new();
        let mut columns = Vec::with_capacity(rows.len());
        // How much each row counts as a touch.
        let mut touched = Vec::new();
        for own in rows {
            let e = columns_of(solution, readings, course, effects, own);
            let fit = &solution.rows[own.row];
            let weight = (every * fit.weight).sqrt();
            for reading in 0..READINGS {
                if own.by_positions[0][reading] == Vector3::zeros() {
                    continue;
                }
                let mut row = DVector::zeros(width);
                for place in 0..unknowns {
                    row[place] = weight * own.by_unknowns[(reading, place)];
                }
                for place in 0..number {
                    row[unknowns + place] = weight * e[(reading, place)];
                }
                row[width - 1] = weight * fit.whitened[reading];
                let touch = Kind::of_place(reading) == Kind::Height;
                touched.push(if touch { weight * weight } else { 0.0 });
                all.push(row);
            }
            columns.push(e);
        }
        let off = &solution.prior * &solution.moved;
        for (own, off) in solution.prior.row_iter().zip(&off) {
            if own.iter().any(|entry| *entry != 0.0) {
                let mut row = own.transpose().resize_vertically(width, 0.0);
                row[width - 1] = -off;
                all.push(row);
            }
        }
        // Unused entries of an arm's vector have no error.
        for index in (0..unknowns).filter(|index| !(solution.covariance[(*index, *index)] > 0.0)) {
            let mut row = DVector::zeros(width);
            row[index] = 1.0;
            all.push(row);
        }
        let of_effects = all.len();
        let own = state.of_effects(course, solution.levels.position.position());
        for row in own.row_iter() {
            let mut whole = DVector::zeros(width);
            whole
                .rows_mut(unknowns, number + 1)
                .copy_from(&row.transpose());
            all.push(whole);
        }
        let measured = DMatrix::from_fn(all.len().max(width), width, |row, column| {
            all.get(row).map_or(0.0, |own| own[column])
        });
        let heights = state.height.and_then(|height| {
            let mut before = effects.iter();
            let before = before
                .by_ref()
                .take_while(|own| own.effect.kind != EffectKind::Bed);
            let bed = of_effects + before.map(|own| own.by.len()).sum::<usize>();
            let bed = bed..bed + EffectKind::Bed.unknowns();
            Heights::of(&all, &touched, (bed, height, solution.levels.height))
        });
        let mut triangle = measured.qr().unpack_r();
        hold_indistinct(&mut triangle, unknowns..width - 1);
        let upper = triangle
            .view((unknowns, unknowns), (number, number))
            .into_owned();
        let right = triangle
            .view((unknowns, width - 1), (number, 1))
            .column(0)
            .into_owned();
        let inverse = inverted(&upper);
        let by = &inverse * &right;
        let robots = triangle.view((0, 0), (unknowns, unknowns)).into_owned();
        let shared = triangle.view((0, unknowns), (unknowns, number));
        let follows = -(inverted(&robots) * shared);
        let variance = (solution.squares() / solution.degrees_of_freedom()).max(1.0);
        let covariance = &inverse * inverse.transpose();
        let orientation = state.noise_of_rotations(&own, (&by, &covariance));
        let height = own.nrows().max(number + 1);
        let prior = own.resize_vertically(height, 0.0).qr().unpack_r();
        Self {
            gain: right.norm_squared() / variance,
            covariance,
            by,
            follows,
            columns,
            prior: (
                prior.view((0, 0), (number, number)).into_owned(),
                prior.view((0, number), (number, 1)).column(0).into_owned(),
            ),
            centre: course.centre,
            heights,
            orientation,
        }
    }

    fn gains(&self) -> bool {
        self.gain > NOTHING
    }

    /// Adds the effects to the unknowns of a solution.
    fn added_to(self, solution: &mut Solution, mut effects: Vec<Estimated>) {
        let (first, number) = (solution.covariance.nrows(), self.by.len());
        if number == 0 {
            return;
        }
        let mut next = first;
        for own in &mut effects {
            own.first = next;
            next += own.by.len();
        }
        let size = first + number;
        let beside = &self.follows * &self.covariance;
        let mut covariance = solution.covariance.clone().resize(size, size, 0.0);
        let mut robots = covariance.view_mut((0, 0), (first, first));
        robots += &beside * self.follows.transpose();
        covariance
            .view_mut((0, first), (first, number))
            .copy_from(&beside);
        covariance
            .view_mut((first, 0), (number, first))
            .copy_from(&beside.transpose());
        covariance
            .view_mut((first, first), (number, number))
            .copy_from(&self.covariance);
        let mut prior = solution.prior.clone().resize(size, size, 0.0);
        let (own, right) = self.prior;
        prior
            .view_mut((first, first), (number, number))
            .copy_from(&own);
        let mut moved = solution.moved.clone().resize_vertically(size, 0.0);
        moved
            .rows_mut(first, number)
            .copy_from(&-(inverted(&own) * right));
        let held = &prior * &covariance;
        solution.of_readings = &covariance - held.tr_mul(&held);
        (solution.covariance, solution.prior, solution.moved) = (covariance, prior, moved);
        for (own, e) in solution.sensitivities.iter_mut().zip(self.columns) {
            let all = std::mem::take(&mut own.by_unknowns).resize_horizontally(first, 0.0);
            own.by_unknowns = all.resize_horizontally(size, 0.0);
            own.by_unknowns.columns_mut(first, number).copy_from(&e);
            let product = &own.by_unknowns * &solution.covariance;
            let fit = &mut solution.rows[own.row];
            for (reading, leverage) in fit.leverage.iter_mut().enumerate() {
                *leverage = product.row(reading).dot(&own.by_unknowns.row(reading));
            }
        }
        solution.effects = effects;
        solution.orientation = self.orientation;
        let mut noise = solution.noise.iter_mut();
        if let Some(heights) = self.heights
            && let Some(own) = noise.find(|own| own.kind == Kind::Height)
        {
            own.stated = false;
            own.squares = heights.squares;
            own.freedom = heights.freedom;
            own.known = heights.freedom + BED_FREEDOM;
        }
    }
}

/// The common factor of the noise of heights and of the bed's unevenness, estimated as the noise of other readings, with the
/// waves of the bed as further readings of 0.
struct Heights {
    /// σ of a height in the fit, over that which was asked for.
    widened: f64,
    /// Of the next estimate, in units of the variance in the fit.
    variance: f64,
    /// Of the residuals at it.
    squares: f64,
    freedom: f64,
}

impl Heights {
    /// Of all rows, the right-hand side last, those that are touches, and those of the `bed`; σ of a height as `asked` for and
    /// as in the `fit`. `None` if they do not determine the unknowns.
    fn of(
        rows: &[DVector<f64>],
        touched: &[f64],
        (bed, asked, fit): (std::ops::Range<usize>, f64, f64),
    ) -> Option<Self> {
        let last = rows.first()?.len() - 1;
        let [mut own, mut others] = [0, 1].map(|_| DMatrix::zeros(last + 1, last + 1));
        let mut count = 0.0;
        let widened = fit / asked;
        for (index, row) in rows.iter().enumerate() {
            let touch = touched.get(index).copied().unwrap_or_default();
            if bed.contains(&index) {
                own.ger(widened.powi(-2), row, row, 1.0);
                count += 1.0;
            } else if touch > 0.0 {
                own.ger(1.0, row, row, 1.0);
                count += touch;
            } else {
                others.ger(1.0, row, row, 1.0);
            }
        }
        let usual = (USUAL_TOUCH / fit).powi(2);
        let mut found = Self {
            widened,
            variance: 1.0,
            squares: 0.0,
            freedom: 0.0,
        };
        for _ in 0..HEIGHT_ROUNDS {
            let whole = &others + &own / found.variance;
            let normal = whole.view((0, 0), (last, last)).into_owned().cholesky()?;
            let right = whole.view((0, last), (last, 1)).into_owned();
            let off = normal.solve(&right).insert_row(last, -1.0);
            let taken = normal.solve(&own.view((0, 0), (last, last)).into_owned());
            found.squares = (off.transpose() * &own * &off)[(0, 0)] / found.variance;
            found.freedom = count - taken.trace() / found.variance;
            let squares = found.squares * found.variance + BED_FREEDOM * usual;
            let next = squares / (found.freedom + BED_FREEDOM);
            let change = (next / found.variance).ln();
            found.variance = next;
            if change.abs() < SETTLED {
                break;
            }
        }
        Some(found)
    }

    fn settled(&self) -> bool {
        (self.widened * self.variance.sqrt()).ln().abs() < 2.0 * SETTLED
    }
}

/// E of a row: the derivatives of its readings by the effects.
pub(crate) fn columns_of(
    solution: &Solution,
    readings: &Readings,
    course: &Course,
    effects: &[Estimated],
    own: &Sensitivity,
) -> DMatrix<f64> {
    let number = effects.iter().map(|own| own.by.len()).sum();
    let mut columns = DMatrix::zeros(READINGS, number);
    let Some(row) = readings.rows.get(own.row) else {
        return columns;
    };
    halt::check();
    for (by_position, joints) in own.by_positions.iter().zip(row.value.poses()) {
        let Some(at) = joints.and_then(|joints| At::new(&solution.robot, &joints)) else {
            continue;
        };
        let unfixed = effects.iter().map(|own| (own, own.sigma.iter()));
        let moves = unfixed.flat_map(|(effect, sigma)| {
            let moves = effect.effect.columns(&at, course, own.row).into_iter();
            moves
                .zip(sigma)
                .map(|(own, sigma)| if *sigma > 0.0 { own } else { Vector3::zeros() })
        });
        for (place, moved) in moves.enumerate() {
            for (reading, by_position) in by_position.iter().enumerate() {
                columns[(reading, place)] += by_position.dot(&moved);
            }
        }
    }
    columns
}

/// What no reading shows stays as it is.
fn hold_indistinct(triangle: &mut DMatrix<f64>, places: std::ops::Range<usize>) {
    for place in places {
        let length = triangle.column(place).norm();
        if triangle[(place, place)].abs() <= INDISTINCT * length {
            triangle[(place, place)] = f64::INFINITY;
        }
    }
}

/// A triangle's inverse; an unknown with an infinite pivot has none and stays.
fn inverted(upper: &DMatrix<f64>) -> DMatrix<f64> {
    let size = upper.nrows();
    let mut inverse = DMatrix::zeros(size, size);
    for column in 0..size {
        for row in (0..=column).rev() {
            let pivot = upper[(row, row)];
            if !(pivot.abs() > 0.0) || !pivot.is_finite() {
                continue;
            }
            let unit = if row == column { 1.0 } else { 0.0 };
            let later: f64 = (row + 1..=column)
                .map(|place| upper[(row, place)] * inverse[(place, column)])
                .sum();
            inverse[(row, column)] = (unit - later) / pivot;
        }
    }
    inverse
}
