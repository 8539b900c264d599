//! The least-squares problem of the observations.

use super::equation::At;
use super::instruments::{Instruments, OF_PLANE, OF_TRANSMISSIONS};
use super::linearization::PARTS;
use super::observation::{ObservationError, ObservationRow, READINGS};
use super::start::StartValues;
use crate::Real;
use crate::calibration::{Extent, Gradient, Instrument, Judged, Piece, Problem, Refusal};
use crate::frame::RigidTransform;
use crate::robot::{
    Arm, ArmIndex, GeometryError, OF_ARM, OF_ROBOT, Parameter, ParameterKind, Robot,
    TRANSMISSION_NUMBERS, Transmission,
};
use crate::samples::{Triangle, Unknowns, moved_arm, part, squares};
use core::ops::Deref;
use nalgebra::{SMatrix, Vector3};

/// Pieces of a row's linearisation: its derivatives, and the parts in which they are absorbed.
const PIECES: usize = 1 + PARTS;

/// The calibration from observations: the robot's 24 parameters, 15 transmission numbers if they are estimated, and the
/// unknowns of the instruments; at most N parameters. Unused places keep their values.
///
/// [`FkmCalibrator`](super::FkmCalibrator) solves it in bounded steps.
#[derive(Debug, Clone)]
pub struct ObservationProblem<'a, T: Real, const N: usize> {
    pub(super) robot: &'a Robot<T>,
    pub(super) instruments: &'a Instruments<'a, T>,
    pub(super) rows: &'a [ObservationRow<T>],
    pub(super) prepared: Held<'a, T, N>,
}

/// Owned, or where a calibrator has it: a copy would take longer than the rest of a short step.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)] // the large one is the usual one where memory does not matter
pub(super) enum Held<'a, T: Real, const N: usize> {
    Own(Prepared<T, N>),
    Lent(&'a Prepared<T, N>),
}

impl<T: Real, const N: usize> Deref for Held<'_, T, N> {
    type Target = Prepared<T, N>;

    #[inline]
    fn deref(&self) -> &Prepared<T, N> {
        match self {
            Self::Own(own) => own,
            Self::Lent(lent) => lent,
        }
    }
}

/// A robot and the unknowns of the instruments at a correction.
#[derive(Debug, Clone)]
pub(crate) struct InstrumentsAt<T: Real, const N: usize> {
    /// `None` if there is no such robot.
    robot: Option<Robot<T>>,
    unknowns: [T; N],
}

/// Why observations cannot be solved.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// A row is invalid.
    #[error("observation {index}: {error}")]
    Row {
        /// Its index, from 0.
        index: usize,
        /// Its fault.
        error: ObservationError,
    },
    /// An instrument has fewer readings than unknowns or invalid stated values, or N is too small for the unknowns.
    #[error(transparent)]
    Refused(Refusal),
}

impl<'a, T: Real, const N: usize> ObservationProblem<'a, T, N> {
    /// Checks the rows, and computes the start of the unknowns and the weights of the readings from the nominal robot.
    /// A row that the nominal robot does not reach [is left out](ObservationRow::is_left_out).
    ///
    /// # Errors
    /// An invalid row, an instrument with fewer readings than unknowns, or more unknowns than fit.
    pub fn prepare(
        robot: &'a Robot<T>,
        instruments: &'a Instruments<'a, T>,
        rows: &'a mut [ObservationRow<T>],
    ) -> Result<Self, PrepareError> {
        Self::prepare_with((robot, robot), instruments, rows, |_| None)
    }

    /// The same with the weights at a robot `near` that reaches the rows, too, and with errors that are not independent or not
    /// alike. `shape` gives the readings' covariance, without the joints' part, by the index of the row: of x, y, z, height and
    /// distance, in products of the σ of the [noise](super::ObservationNoise), symmetric and positive definite.
    ///
    /// # Errors
    /// As [`prepare`](Self::prepare).
    pub fn prepare_with(
        (robot, near): (&'a Robot<T>, &Robot<T>),
        instruments: &'a Instruments<'a, T>,
        rows: &'a mut [ObservationRow<T>],
        mut shape: impl FnMut(usize) -> Option<SMatrix<T, 5, 5>>,
    ) -> Result<Self, PrepareError> {
        let parameters = OF_ROBOT + instruments.unknowns();
        if parameters > N {
            let parameters = parameters as u64;
            return Err(PrepareError::Refused(Refusal::TooManyUnknowns {
                parameters,
            }));
        }
        for (index, row) in rows.iter().enumerate() {
            row.check_weight()
                .and_then(|()| row.observation().check(robot, instruments))
                .map_err(|error| PrepareError::Row { index, error })?;
        }
        for (index, row) in rows.iter_mut().enumerate() {
            let placed = row.place(near).and_then(|()| row.place(robot));
            row.left_out = placed == Err(ObservationError::Unreached);
            if !row.left_out {
                placed.map_err(|error| PrepareError::Row { index, error })?;
            }
        }
        let mut prepared =
            Prepared::begun(robot, instruments, rows).map_err(PrepareError::Refused)?;
        prepared.start.locate_all(robot, instruments, rows);
        for (index, row) in rows.iter_mut().enumerate() {
            let shape = shape(index);
            prepared.weigh(near, instruments, row, |one, other| {
                shape?.get((one, other)).copied()
            });
        }
        Ok(Self {
            robot,
            instruments,
            rows,
            prepared: Held::Own(prepared),
        })
    }

    /// The same problem and rows with other [weights](ObservationRow::set_weight) of the given total.
    #[must_use]
    pub fn weighed<'b>(
        &self,
        rows: &'b [ObservationRow<T>],
        effective_rows: T,
    ) -> ObservationProblem<'b, T, N>
    where
        'a: 'b,
    {
        let mut prepared = Prepared::new(self.robot, self.instruments, self.prepared.start);
        for row in rows {
            prepared.count(self.robot, row);
        }
        prepared.readings *= effective_rows / prepared.effective_rows.larger(T::EPSILON);
        prepared.effective_rows = effective_rows;
        ObservationProblem {
            robot: self.robot,
            instruments: self.instruments,
            rows,
            prepared: Held::Own(prepared),
        }
    }

    /// The instruments the readings refer to.
    pub const fn instruments(&self) -> &Instruments<'a, T> {
        self.instruments
    }

    /// The rows, including those that are ignored because the nominal robot does not reach them.
    pub const fn rows(&self) -> &[ObservationRow<T>] {
        self.rows
    }

    /// Each reading of a row minus its expected value at a robot and its
    /// [unknowns](super::ObservationOutcome::unknowns), in σ and times the row's weights: x, y, z, height, distance; 0 for
    /// a missing reading.
    pub fn residuals_at(&self, robot: &Robot<T>, unknowns: &[T; N], row: usize) -> Option<[T; 5]> {
        self.rows.get(row)?.residuals(&self.at(robot, unknowns))
    }

    /// The derivatives of a row's readings by the parameters at a robot and its
    /// [unknowns](super::ObservationOutcome::unknowns), in σ and with the row's weights: ∂r/∂p by columns, p in units of
    /// [`unit_of`](Self::unit_of), and the residuals r as the last of the N + 1 columns. `None` for a row that does not
    /// exist.
    ///
    /// A column holds x, y, z, height and distance; 0 for a missing reading. JᵀJ summed over all rows is the
    /// information from the measurements (prior information is in [`prior`](Self::prior)).
    pub fn linearized_at(
        &self,
        robot: &Robot<T>,
        unknowns: &[T; N],
        row: usize,
    ) -> Option<T::Columns<[T; 5]>>
    where
        T: Unknowns<N>,
    {
        self.rows
            .get(row)?
            .linearized(&self.at(robot, unknowns), &self.prepared.units)
    }

    /// The derivatives of a row's readings by the platform's position, ∂h/∂X in σ per length and with the row's
    /// weights: at the pose and at the start of a distance between two poses. 0 for a missing reading.
    pub fn by_positions_at(
        &self,
        robot: &Robot<T>,
        unknowns: &[T; N],
        row: usize,
    ) -> Option<[[Vector3<T>; 5]; 2]> {
        self.rows.get(row)?.by_positions(&self.at(robot, unknowns))
    }

    fn at<'b>(&'b self, robot: &'b Robot<T>, unknowns: &'b [T; N]) -> At<'b, T> {
        self.prepared.start.at(robot, self.instruments, unknowns)
    }

    /// Σ r² of each row, in order, at a correction of the start in units of [`unit_of`](Self::unit_of); infinite where
    /// the robot does not reach it.
    pub fn sums_of_squares_at(&self, correction: &[T; N]) -> impl Iterator<Item = T>
    where
        T: Unknowns<N>,
    {
        let at = self.displaced(correction);
        (0..self.rows.len()).map(move |row| self.sum_of_squares(&at, row).sum_of_squares)
    }

    /// A correction of 1 of a parameter in the caller's units.
    pub fn unit_of(&self, parameter: usize) -> T {
        let unit = self.prepared.units.get(parameter);
        unit.copied().unwrap_or(T::ONE)
    }

    /// The start values of the unknowns, at their indices among all parameters.
    pub fn start_unknowns(&self) -> &[T; N] {
        self.prepared.start.unknowns()
    }

    /// The start value of the coordinate frame: the transform from the robot's frame to it.
    pub fn start_frame(&self) -> &RigidTransform<T> {
        self.prepared.start.frame()
    }

    pub(super) fn robot_at(&self, correction: &[T; N]) -> Result<Robot<T>, Refusal> {
        let arm = |arm: ArmIndex| {
            self.moved(arm, correction)
                .map_err(|error| Refusal::ImpossibleGeometry { arm, error })
        };
        let [first, second, third] = ArmIndex::ALL;
        Robot::new([arm(first)?, arm(second)?, arm(third)?]).map_err(Refusal::ImpossibleRobot)
    }

    /// An arm with its parameters and transmission displaced by their parts of the correction.
    fn moved(&self, index: ArmIndex, correction: &[T; N]) -> Result<Arm<T>, GeometryError> {
        let first = OF_ARM * index.index();
        let mut displacement = part(correction, first);
        for (value, unit) in displacement
            .iter_mut()
            .zip(self.prepared.units.iter().skip(first))
        {
            *value *= *unit;
        }
        let arm = moved_arm(self.robot.arm(index), &displacement)?;
        if self.instruments.transmission.is_none() {
            return Ok(arm);
        }
        let mut numbers = [T::ZERO; TRANSMISSION_NUMBERS];
        if let Some(transmission) = arm.transmission() {
            numbers = transmission.numbers();
        }
        let first = OF_ROBOT + TRANSMISSION_NUMBERS * index.index();
        for (number, delta) in numbers.iter_mut().zip(correction.iter().skip(first)) {
            *number += *delta;
        }
        Ok(arm.driven_by(Transmission::new(numbers)?))
    }

    pub(super) fn unknowns_at(&self, correction: &[T; N]) -> [T; N] {
        let mut values = *self.prepared.start.unknowns();
        for ((value, delta), unit) in values.iter_mut().zip(correction).zip(&self.prepared.units) {
            *value += *delta * *unit;
        }
        values
    }
}

/// The rows of a set of readings, by columns.
#[derive(Debug, Clone)]
pub(crate) struct ReadingRows<T: Unknowns<N>, const N: usize>(T::Columns<[T; READINGS]>);

impl<T: Unknowns<N>, const N: usize> Default for ReadingRows<T, N> {
    fn default() -> Self {
        Self(T::columns([T::ZERO; READINGS]))
    }
}

impl<T: Unknowns<N>, const N: usize> Problem<T, N> for ObservationProblem<'_, T, N> {
    type At = InstrumentsAt<T, N>;
    type Rows = ReadingRows<T, N>;
    const GRADIENT: Option<Gradient<T, N, Self, InstrumentsAt<T, N>>> = None;

    fn displaced(&self, correction: &[T; N]) -> InstrumentsAt<T, N> {
        InstrumentsAt {
            robot: self.robot_at(correction).ok(),
            unknowns: self.unknowns_at(correction),
        }
    }

    /// Of a single row. Infinite if the robot does not reach it.
    fn sum_of_squares(&self, at: &InstrumentsAt<T, N>, piece: usize) -> Piece<T> {
        let residuals = at
            .robot
            .as_ref()
            .and_then(|robot| self.residuals_at(robot, &at.unknowns, piece));
        Piece {
            sum_of_squares: residuals.map_or(T::INFINITY, |own| squares(&own)),
            more: residuals.is_some() && piece + 1 < self.rows.len(),
        }
    }

    /// Derives the readings of one row, or absorbs a part of them.
    fn linearize(
        &self,
        at: &InstrumentsAt<T, N>,
        rows: &mut ReadingRows<T, N>,
        normal: &mut Triangle<T, N>,
        piece: usize,
    ) -> Piece<T> {
        // Columns of zeros change nothing but cost time. On a board, to leave them out would take flash and a long step.
        let used = if cfg!(target_os = "none") {
            N
        } else {
            OF_ROBOT + self.instruments.unknowns()
        };
        if piece == 0 && used < N {
            normal.pack(used, false);
        }
        let (row, part) = (piece / PIECES, piece % PIECES);
        let columns = rows.0.as_mut().get_mut(..=used).unwrap_or_default();
        let row = self.rows.get(row).zip(at.robot.as_ref());
        let residuals = row.and_then(|(row, robot)| {
            if let Some(part) = part.checked_sub(1) {
                let entries = normal.entries_mut();
                let entries = entries.get_mut(..(used + 1) * (used + 2) / 2);
                row.absorb(part, columns, entries.unwrap_or_default());
                return Some(T::ZERO);
            }
            let at = self.at(robot, &at.unknowns);
            T::derive_row(row, &at, &self.prepared.units, columns)
        });
        let more = residuals.is_some() && piece + 1 < PIECES * self.rows.len();
        if !more && used < N {
            normal.pack(used, true);
        }
        Piece {
            sum_of_squares: residuals.unwrap_or(T::INFINITY),
            more,
        }
    }

    fn terms_squared(&self) -> T {
        self.prepared.terms_squared
    }
}

impl<T: Unknowns<N>, const N: usize> Judged<T, N> for ObservationProblem<'_, T, N> {
    const FREE_STARTS: u8 = 0;

    fn free_start(&self, _: u8) -> Option<[T; N]> {
        None
    }

    fn extent(&self) -> Extent<T> {
        Extent {
            samples: self.rows.len() as u64,
            effective_samples: self.prepared.effective_rows,
            residuals: self.prepared.readings,
            per_sample: 1,
            unit: None,
            least_sum_of_squares: T::ZERO,
        }
    }

    fn rows_squared(&self) -> T {
        self.prepared.terms_squared
    }

    fn units(&self) -> [T; N] {
        self.prepared.units
    }

    fn arm(&self, parameter: usize) -> &Arm<T> {
        let arms = self.robot.arms();
        let [first, ..] = arms;
        arms.get(parameter / OF_ARM).unwrap_or(first)
    }

    fn instrument_of(&self, parameter: usize) -> Option<Instrument> {
        self.instruments.instrument_of(parameter)
    }
}

/// The start of the unknowns, and the combined weights of the rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prepared<T: Real, const N: usize> {
    pub(super) start: StartValues<T, N>,
    /// A correction of 1 in the caller's units: 1 rad, or the upper arm's length.
    pub(super) units: [T; N],
    pub(super) terms_squared: T,
    pub(super) readings: T,
    pub(super) effective_rows: T,
}

impl<T: Real, const N: usize> Prepared<T, N> {
    /// From checked rows: nothing is [located](StartValues::locate) and no row [counted](Self::count) yet.
    ///
    /// # Errors
    /// [`Refusal::UnusableInstrument`], [`Refusal::TooFewObservations`].
    pub(super) fn begun(
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        rows: &[ObservationRow<T>],
    ) -> Result<Self, Refusal> {
        if let Some(instrument) = instruments.unusable() {
            return Err(Refusal::UnusableInstrument(instrument));
        }
        if let Some((instrument, observations, needed)) = instruments.lacking(rows) {
            return Err(Refusal::TooFewObservations {
                instrument,
                observations,
                needed,
            });
        }
        Ok(Self::new(robot, instruments, StartValues::new(rows)))
    }

    /// No row is counted yet.
    pub(super) fn new(
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        start: StartValues<T, N>,
    ) -> Self {
        let [first, ..] = robot.arms();
        let mut units = [first.upper_arm_length(); N];
        let mut places = units.iter_mut();
        for arm in robot.arms() {
            for parameter in robot.drive().places() {
                if let Some(unit) = places.next() {
                    *unit = match parameter.map(Parameter::kind) {
                        Some(ParameterKind::Length) => arm.upper_arm_length(),
                        Some(ParameterKind::Angle | ParameterKind::Ratio) => T::ONE,
                        None => T::ZERO,
                    };
                }
            }
        }
        let mut angles = |column: usize, count: usize| {
            for unit in units.iter_mut().skip(column).take(count) {
                *unit = T::ONE;
            }
        };
        if instruments.transmission.is_some() {
            angles(OF_ROBOT, OF_TRANSMISSIONS);
        }
        if instruments.sensor_frame {
            angles(instruments.frame_column() + 3, 3);
        }
        for (index, _) in (0..).zip(instruments.planes) {
            angles(instruments.first_of_plane(index) + 1, OF_PLANE - 1);
        }
        if let Some(scale) = instruments.of_scale() {
            angles(scale, 1);
        }
        Self {
            start,
            units,
            terms_squared: T::ZERO,
            readings: T::ZERO,
            effective_rows: T::ZERO,
        }
    }

    /// Gives a row its weights, and counts it.
    pub(super) fn weigh(
        &mut self,
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        row: &mut ObservationRow<T>,
        shape: impl Fn(usize, usize) -> Option<T>,
    ) {
        let start = &self.start;
        row.take_weights(&start.at(robot, instruments, start.unknowns()), shape);
        self.count(robot, row);
    }

    /// Counts a row whose weights are known.
    pub(super) fn count(&mut self, robot: &Robot<T>, row: &ObservationRow<T>) {
        self.terms_squared += row.terms_squared(robot);
        self.readings += T::from_count(row.observation().readings() as u64) * row.weight();
        self.effective_rows += row.weight();
    }
}

#[cfg(test)]
mod tests;
