//! How the problem is solved: what is known beforehand, the minimisation, a second start.

use super::instruments::{OF_FRAME, OF_PLANE, OF_POINT, OF_ROBOT, PositionFrame};
use super::outcome::ObservationOutcome;
use super::problem::{InstrumentsAt, ObservationProblem};
use super::row::ObservationRow;
use crate::Real;
use crate::calibration::{Minimizer, Progress, Refusal, Settings};
use crate::robot::ArmIndex;

impl<T: Real, const N: usize> ObservationProblem<'_, T, N> {
    /// Calibrates the robot. Where the iteration from nominal leads nowhere because some pose is near a
    /// singularity of the nominal robot, it starts again from the solution of the other poses.
    ///
    /// # Errors
    /// A [`Refusal`]; the robot keeps its parameters.
    pub fn solve<const M: usize, const E: usize>(
        &self,
        settings: &Settings<T>,
    ) -> Result<ObservationOutcome<T, N>, Refusal> {
        let found = self.minimised::<M, E>(settings);
        match found.1 {
            Err(
                refusal @ (Refusal::NotConverged { .. }
                | Refusal::Undetermined { .. }
                | Refusal::ResidualContradictsNoise { .. }
                | Refusal::FarFromNominal { .. }
                | Refusal::NonFinite { .. }),
            ) if self.rows.iter().any(ObservationRow::is_steep) => {
                let clear = Self {
                    clear_alone: true,
                    ..*self
                };
                let again = Self {
                    second_start: clear.minimised::<M, E>(settings).0,
                    ..*self
                };
                if again.second_start.is_none() {
                    return Err(refusal);
                }
                again.minimised::<M, E>(settings).1
            }
            result => result,
        }
    }

    /// Where the iteration ended, and what is to be said of it.
    #[allow(clippy::type_complexity)]
    fn minimised<const M: usize, const E: usize>(
        &self,
        settings: &Settings<T>,
    ) -> (Option<[T; N]>, Result<ObservationOutcome<T, N>, Refusal>) {
        let mut minimizer = match self.minimizer::<M, E>(settings) {
            Ok(minimizer) => minimizer,
            Err(refusal) => return (None, Err(refusal)),
        };
        while minimizer.step(self) == Progress::Working {}
        let outcome = minimizer
            .estimate(self)
            .and_then(|estimate| self.outcome(&estimate));
        (minimizer.end(), outcome)
    }

    /// The minimisation of this problem, with the settings' tolerance and what is known of the instruments.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    #[allow(clippy::type_complexity)]
    pub fn minimizer<const M: usize, const E: usize>(
        &self,
        settings: &Settings<T>,
    ) -> Result<Minimizer<T, InstrumentsAt<T, N>, [T; N], N, M, E>, Refusal> {
        Minimizer::with_prior(
            self,
            ArmIndex::First,
            self.prior_weights(settings),
            settings,
        )
    }

    /// 1/σ of what is known of each parameter beforehand, in units of
    /// [`unit_of`](crate::calibration::Problem::unit_of); 0 where nothing is known, 1 for places that no
    /// unknown needs.
    pub fn prior_weights(&self, settings: &Settings<T>) -> [T; N] {
        let mut weights = [T::ZERO; N];
        let places = self.robot.drive().places();
        let places = places.into_iter().cycle().take(OF_ROBOT);
        for ((weight, unit), parameter) in weights.iter_mut().zip(self.units).zip(places) {
            *weight = match (parameter, &settings.tolerance) {
                (Some(parameter), Some(tolerance)) => unit / tolerance.of(parameter),
                (Some(_), None) => T::ZERO,
                (None, _) => T::ONE,
            };
        }
        let mut put = |column: usize, count: usize, sigma: T| {
            let places = weights.iter_mut().zip(self.units).skip(column).take(count);
            for (weight, unit) in places {
                *weight = unit / sigma;
            }
        };
        for (index, plane) in (0..).zip(self.instruments.planes) {
            if let Some((_, sigma)) = plane.known {
                put(self.instruments.plane_column(index), 1, sigma);
            }
            if let Some(sigma) = plane.level {
                put(
                    self.instruments.plane_column(index) + 1,
                    OF_PLANE - 1,
                    sigma,
                );
            }
        }
        for (index, point) in (0..).zip(self.instruments.points) {
            if let Some((_, sigma)) = point.known {
                put(self.instruments.point_column(index), OF_POINT, sigma);
            }
        }
        let used = OF_ROBOT + self.instruments.unknowns();
        for weight in weights.iter_mut().skip(used) {
            *weight = T::ONE;
        }
        if self.instruments.frame == PositionFrame::Sensor {
            let numbers = weights.iter_mut().skip(OF_ROBOT).take(OF_FRAME);
            for (number, weight) in numbers.enumerate() {
                if self.start.is_free(number) {
                    *weight = T::ONE;
                }
            }
        }
        weights
    }
}
