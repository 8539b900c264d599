//! The least-squares problem of the observations.

use super::equation::At;
use super::instruments::{Instruments, OF_PLANE, OF_ROBOT, OF_TRANSMISSIONS, PositionFrame};
use super::linearization::squared_length;
use super::observation::{ObservationError, ObservationRow};
use super::start::StartValues;
use crate::Real;
use crate::calibration::{Instrument, Piece, Problem, Refusal};
use crate::frame::RigidTransform;
use crate::robot::{
    Arm, ArmIndex, Drive, GeometryError, Parameter, ParameterKind, Robot, TRANSMISSION_NUMBERS,
    Transmission,
};
use crate::samples::{Triangle, moved_arm};
use nalgebra::Vector3;

/// Parameters of an arm.
const ARM: usize = 8;

/// The calibration from observations: the robot's 24 parameters, 15 transmission numbers if they are estimated, and the
/// unknowns of the instruments; at most N parameters, M = N + 1, E = M (M + 1)/2. Unused places keep their values.
///
/// ```
/// use delta_cal::calibration::Settings;
/// use delta_cal::observations::{
///     Height, Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow, Plane, PositionFrame,
/// };
/// use delta_cal::{Noise, SymmetricRobot, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
/// let drawn = drawn.robot()?;
///
/// // Gauge blocks of 0, 60 and 120 mm on a plate somewhere below the robot.
/// let mut rows = Vec::new();
/// for k in 0..45 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     let height = built.forward(&joints)?.z + 560.0;
///     let height = Some(Height { plane: 0, height });
///     rows.push(ObservationRow::new(Observation { height, ..Observation::at(joints) }));
/// }
/// let instruments = Instruments {
///     frame: PositionFrame::Base,
///     planes: &[Plane::default()],
///     points: &[],
///     noise: ObservationNoise::new(Noise::new(0.02, 0.0)?, 0.02, 0.02)?,
///     transmission: None,
/// };
/// let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.0035)?);
/// let problem = ObservationProblem::<f64, 27>::prepare(&drawn, &instruments, &mut rows)?;
/// let outcome = problem.solve::<28, 406>(&settings)?;
///
/// let joints = [0.1, 0.2, 0.3];
/// let before = (drawn.forward(&joints)? - built.forward(&joints)?).z;
/// let [c, ..] = outcome.plane(&instruments, 0);
/// let after = outcome.robot.forward(&joints)?.z - c - (built.forward(&joints)?.z + 560.0);
/// assert!(before.abs() > 0.5 && after.abs() < 0.1);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ObservationProblem<'a, T: Real, const N: usize> {
    pub(super) robot: &'a Robot<T>,
    pub(super) instruments: &'a Instruments<'a, T>,
    pub(super) rows: &'a [ObservationRow<T>],
    pub(super) prepared: Prepared<T, N>,
}

/// A robot and the unknowns of the instruments at a correction.
#[derive(Debug, Clone, Copy)]
pub struct InstrumentsAt<T: Real, const N: usize> {
    /// `None` if there is no such robot.
    robot: Option<Robot<T>>,
    unknowns: [T; N],
}

/// Why observations cannot be solved.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum PrepareError {
    /// A row is invalid.
    Row {
        /// Its index, from 0.
        index: usize,
        /// Its fault.
        error: ObservationError,
    },
    /// An instrument has fewer readings than unknowns.
    Refused(Refusal),
    /// N is too small for the unknowns of the instruments.
    TooManyUnknowns {
        /// Number of unknowns, including the robot's parameters.
        parameters: usize,
    },
}

impl core::fmt::Display for PrepareError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Row { index, error } => write!(formatter, "observation {index}: {error}"),
            Self::Refused(refusal) => refusal.fmt(formatter),
            Self::TooManyUnknowns { parameters } => {
                write!(formatter, "there is no room for {parameters} parameters")
            }
        }
    }
}

impl core::error::Error for PrepareError {}

impl<'a, T: Real, const N: usize> ObservationProblem<'a, T, N> {
    /// Checks the rows, and computes the start of the unknowns and the weights of the readings from the nominal robot.
    /// A row that the nominal robot does not reach is ignored.
    ///
    /// # Errors
    /// An invalid row, an instrument with fewer readings than unknowns, or more unknowns than fit.
    pub fn prepare(
        robot: &'a Robot<T>,
        instruments: &'a Instruments<'a, T>,
        rows: &'a mut [ObservationRow<T>],
    ) -> Result<Self, PrepareError> {
        let parameters = OF_ROBOT + instruments.unknowns();
        if parameters > N {
            return Err(PrepareError::TooManyUnknowns { parameters });
        }
        for (index, row) in rows.iter().enumerate() {
            row.check_weight()
                .and_then(|()| row.observation().check(robot.drive(), instruments))
                .map_err(|error| PrepareError::Row { index, error })?;
        }
        for (index, row) in rows.iter_mut().enumerate() {
            row.look_whether_reached(robot)
                .map_err(|error| PrepareError::Row { index, error })?;
        }
        let mut prepared =
            Prepared::begun(robot, instruments, rows).map_err(PrepareError::Refused)?;
        for row in rows.iter_mut() {
            prepared.weigh(robot, instruments, row);
        }
        Ok(Self {
            robot,
            instruments,
            rows,
            prepared,
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
            prepared,
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

    /// Each reading of a row minus its expected value at a robot and its [unknowns](Instruments::unknowns_at), in σ and
    /// times the row's weights: x, y, z, height, distance; 0 for a missing reading.
    pub fn residuals_at(&self, robot: &Robot<T>, unknowns: &[T; N], row: usize) -> Option<[T; 5]> {
        self.rows.get(row)?.residuals(&self.at(robot, unknowns))
    }

    /// The derivatives of a row's readings by the parameters at the start, in σ and with the row's weights: ∂r/∂p by
    /// columns, p in units of [`unit_of`](Problem::unit_of), and the residuals r as the last of the M = N + 1 columns.
    /// `None` for a row that does not exist.
    ///
    /// A column holds x, y, z, height and distance; 0 for a missing reading. JᵀJ summed over all rows is the
    /// information from the measurements (prior information is in [`prior`](Self::prior)).
    pub fn linearized<const M: usize>(&self, row: usize) -> Option<[[T; 5]; M]> {
        self.linearized_at(self.robot, self.start_unknowns(), row)
    }

    /// The same at another robot and other [unknowns](super::ObservationOutcome::unknowns).
    pub fn linearized_at<const M: usize>(
        &self,
        robot: &Robot<T>,
        unknowns: &[T; N],
        row: usize,
    ) -> Option<[[T; 5]; M]> {
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

    /// The start values of the unknowns, at their indices among all parameters.
    pub const fn start_unknowns(&self) -> &[T; N] {
        self.prepared.start.unknowns()
    }

    /// The start value of the coordinate frame: the transform from the robot's frame to it.
    pub const fn start_frame(&self) -> &RigidTransform<T> {
        self.prepared.start.frame()
    }

    pub(super) fn robot_at(&self, correction: &[T; N]) -> Result<Robot<T>, Refusal> {
        let mut displacements = [[T::ZERO; ARM]; 3];
        for ((value, unit), target) in correction
            .iter()
            .zip(self.prepared.units)
            .zip(displacements.as_flattened_mut())
        {
            *target = *value * unit;
        }
        let [one, two, three] = displacements;
        let arm = |index: ArmIndex, displacement: &[T; ARM]| {
            self.moved(index, displacement, correction)
                .map_err(|error| Refusal::ImpossibleGeometry { arm: index, error })
        };
        Robot::new([
            arm(ArmIndex::First, &one)?,
            arm(ArmIndex::Second, &two)?,
            arm(ArmIndex::Third, &three)?,
        ])
        .map_err(Refusal::ImpossibleRobot)
    }

    /// An arm with its parameters displaced, and its transmission displaced by its part of the correction.
    fn moved(
        &self,
        index: ArmIndex,
        displacement: &[T; ARM],
        correction: &[T; N],
    ) -> Result<Arm<T>, GeometryError> {
        let arm = moved_arm(self.robot.arm(index), displacement)?;
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
        for ((value, delta), unit) in values.iter_mut().zip(correction).zip(self.prepared.units) {
            *value += *delta * unit;
        }
        values
    }
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Problem<T, N, M, E>
    for ObservationProblem<'_, T, N>
{
    type At = InstrumentsAt<T, N>;
    const PIECEWISE: bool = true;
    const RESIDUALS: u8 = 1;
    const FREE_STARTS: u8 = 0;

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
            sum_of_squares: residuals.map_or(T::INFINITY, |own| squared_length(&own)),
            more: residuals.is_some() && piece + 1 < self.rows.len(),
        }
    }

    /// Absorbs the readings of one row.
    #[inline(never)]
    fn linearize(
        &self,
        at: &InstrumentsAt<T, N>,
        normal: &mut Triangle<T, M, E>,
        piece: usize,
    ) -> Piece<T> {
        let mut columns = [[T::ZERO; 5]; M];
        let row = self.rows.get(piece).zip(at.robot.as_ref());
        let residuals = row.and_then(|(row, robot)| {
            let at = self.at(robot, &at.unknowns);
            let entries = normal.entries_mut();
            T::absorb_row(row, &at, &self.prepared.units, &mut columns, entries)
        });
        Piece {
            sum_of_squares: residuals.unwrap_or(T::INFINITY),
            more: residuals.is_some() && piece + 1 < self.rows.len(),
        }
    }

    fn free_start(&self, _: u8) -> Option<[T; N]> {
        None
    }

    fn least_sum_of_squares(&self) -> T {
        T::ZERO
    }

    fn rows_squared(&self) -> T {
        self.prepared.terms_squared
    }

    fn terms_squared(&self) -> T {
        self.prepared.terms_squared
    }

    fn samples(&self) -> u64 {
        self.rows.len() as u64
    }

    fn effective_samples(&self) -> T {
        self.prepared.effective_rows
    }

    fn residuals(&self) -> T {
        self.prepared.readings
    }

    fn noise_stated(&self) -> bool {
        true
    }

    fn unit(&self) -> T {
        T::ONE
    }

    fn unit_of(&self, parameter: usize) -> T {
        self.prepared
            .units
            .get(parameter)
            .copied()
            .unwrap_or(T::ONE)
    }

    fn upper_arm(&self, parameter: usize) -> T {
        let arm = self.robot.arms().get(parameter / ARM);
        arm.map_or(T::ONE, Arm::upper_arm_length)
    }

    fn drive(&self) -> Drive {
        self.robot.drive()
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
    /// From checked rows, none of them [counted](Self::count) yet.
    ///
    /// # Errors
    /// [`Refusal::UnusableInstrument`], [`Refusal::TooFewObservations`].
    #[inline(never)]
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
        let start = StartValues::of(robot, instruments, rows);
        Ok(Self::new(robot, instruments, start))
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
        if instruments.frame == PositionFrame::Sensor {
            angles(instruments.frame_column() + 3, 3);
        }
        for (index, _) in (0..).zip(instruments.planes) {
            angles(instruments.plane_column(index) + 1, OF_PLANE - 1);
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
    ) {
        let start = &self.start;
        row.take_weights(&start.at(robot, instruments, start.unknowns()));
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
