//! What is computed of a problem before it is solved.

use super::instruments::{Instruments, OF_PLANE, OF_ROBOT, OF_TRANSMISSIONS, PositionFrame};
use super::row::ObservationRow;
use super::start::StartValues;
use crate::Real;
use crate::calibration::Refusal;
use crate::robot::{Parameter, ParameterKind, Robot};

/// Where the unknowns start, and what the rows weigh together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prepared<T: Real, const N: usize> {
    pub(super) start: StartValues<T, N>,
    /// What a correction of 1 is: 1 rad, or the upper arm's length.
    pub(super) units: [T; N],
    pub(super) terms_squared: T,
    pub(super) readings: T,
    pub(super) effective_rows: T,
    /// Whether rows near singularities of the nominal robot do not count.
    pub(super) clear_alone: bool,
    /// Where to start if the start from nominal leads nowhere.
    pub(super) second_start: Option<[T; N]>,
}

impl<T: Real, const N: usize> Prepared<T, N> {
    /// From rows that are checked, none of them [counted](Self::count) yet.
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
            clear_alone: false,
            second_start: None,
        }
    }

    /// Counts a row that has its weights.
    pub(super) fn count(&mut self, robot: &Robot<T>, row: &ObservationRow<T>) {
        self.terms_squared += row.terms_squared(robot);
        self.readings += T::from_count(row.observation().readings() as u64) * row.weight();
        self.effective_rows += row.weight();
    }

    /// Where the unknowns start.
    pub(super) const fn start(&self) -> &StartValues<T, N> {
        &self.start
    }
}
