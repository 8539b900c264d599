//! How the problem is solved: what is known beforehand, the minimisation, a second start.

use super::instruments::{OF_FRAME, OF_PLANE, OF_POINT, OF_ROBOT, OF_TRANSMISSIONS, PositionFrame};
use super::outcome::ObservationOutcome;
use super::problem::{InstrumentsAt, ObservationProblem};
use super::row::ObservationRow;
use crate::Real;
use crate::calibration::{Minimizer, Progress, Refusal, Settings, TolerancePrior, enough_samples};
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
        let mut minimisation = Minimisation::<T, N, M, E>::new();
        loop {
            if let Some(result) = minimisation.step(self, settings) {
                return result;
            }
        }
    }

    /// The minimisation of this problem, with the settings' tolerance and what is known of the instruments.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    #[allow(clippy::type_complexity)]
    pub fn minimizer<const M: usize, const E: usize>(
        &self,
        settings: &Settings<T>,
    ) -> Result<Minimizer<T, InstrumentsAt<T, N>, TolerancePrior<T, N>, N, M, E>, Refusal> {
        Minimizer::with_prior(self, ArmIndex::First, self.prior(settings), settings)
    }

    /// What is known of the parameters beforehand, in units of
    /// [`unit_of`](crate::calibration::Problem::unit_of).
    pub fn prior(&self, settings: &Settings<T>) -> TolerancePrior<T, N> {
        let [first, second, third] = self.robot.arms();
        let arms = [first, second, third];
        TolerancePrior::coupled(self.weights(settings), arms, settings.tolerance.as_ref())
    }

    /// 1/σ of what is known of each parameter by itself; 0 where nothing is known, 1 for places that no
    /// unknown needs.
    fn weights(&self, settings: &Settings<T>) -> [T; N] {
        let mut weights = [T::ZERO; N];
        let places = self.robot.drive().places();
        let places = places.into_iter().cycle().take(OF_ROBOT);
        for ((weight, unit), parameter) in weights.iter_mut().zip(self.prepared.units).zip(places) {
            *weight = match (parameter, &settings.tolerance) {
                (Some(parameter), Some(tolerance)) => unit / tolerance.of(parameter),
                (Some(_), None) => T::ZERO,
                (None, _) => T::ONE,
            };
        }
        let mut put = |column: usize, count: usize, sigma: T| {
            let places = weights
                .iter_mut()
                .zip(self.prepared.units)
                .skip(column)
                .take(count);
            for (weight, unit) in places {
                *weight = unit / sigma;
            }
        };
        if let Some(tolerance) = &self.instruments.transmission {
            put(OF_ROBOT, OF_TRANSMISSIONS, tolerance.sigma());
        }
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
            let first = self.instruments.frame_column();
            let numbers = weights.iter_mut().skip(first).take(OF_FRAME);
            for (number, weight) in numbers.enumerate() {
                if self.prepared.start.is_free(number) {
                    *weight = T::ONE;
                }
            }
        }
        weights
    }
}

type Correction<T, const N: usize, const M: usize, const E: usize> =
    Minimizer<T, InstrumentsAt<T, N>, TolerancePrior<T, N>, N, M, E>;

/// One minimisation after the other, in bounded steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimisation<T: Real, const N: usize, const M: usize, const E: usize> {
    pass: Pass<T, N>,
    minimizer: Option<Correction<T, N, M, E>>,
}

#[derive(Debug, Clone, Copy)]
enum Pass<T, const N: usize> {
    /// All rows, from nominal.
    FromNominal,
    /// The rows of poses that are not near a singularity of the nominal robot; why from nominal nothing came.
    ClearAlone(Refusal),
    /// All rows, from the solution of those.
    FromClear([T; N]),
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Minimisation<T, N, M, E> {
    pub(super) const fn new() -> Self {
        Self {
            pass: Pass::FromNominal,
            minimizer: None,
        }
    }

    /// One step of the same problem; the result with the last one.
    pub(super) fn step(
        &mut self,
        whole: &ObservationProblem<'_, T, N>,
        settings: &Settings<T>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        let mut problem = *whole;
        problem.prepared.clear_alone = matches!(self.pass, Pass::ClearAlone(_));
        problem.prepared.second_start = match self.pass {
            Pass::FromClear(start) => Some(start),
            _ => None,
        };
        let Some(minimizer) = &mut self.minimizer else {
            return self.begin(&problem, settings);
        };
        if minimizer.step(&problem) == Progress::Working {
            return None;
        }
        self.end(&problem)
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn begin(
        &mut self,
        problem: &ObservationProblem<'_, T, N>,
        settings: &Settings<T>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        if let Err(refusal) = enough_samples::<T, _, N, M, E>(problem, ArmIndex::First, settings) {
            return Some(Err(refusal));
        }
        let prior = problem.prior(settings);
        let minimizer = Minimizer::unstarted(ArmIndex::First, prior, settings);
        self.minimizer.insert(minimizer).begin(problem);
        None
    }

    #[inline(never)]
    fn end(
        &mut self,
        problem: &ObservationProblem<'_, T, N>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        let minimizer = self.minimizer.as_ref()?;
        if let Pass::ClearAlone(refusal) = self.pass {
            let Some(start) = minimizer.end() else {
                return Some(Err(refusal));
            };
            self.pass = Pass::FromClear(start);
            self.minimizer = None;
            return None;
        }
        let result = minimizer
            .estimate(problem)
            .and_then(|estimate| problem.outcome(&estimate));
        match (&self.pass, &result) {
            (
                Pass::FromNominal,
                Err(
                    refusal @ (Refusal::NotConverged { .. }
                    | Refusal::Undetermined { .. }
                    | Refusal::ResidualContradictsNoise { .. }
                    | Refusal::FarFromNominal { .. }
                    | Refusal::NonFinite { .. }),
                ),
            ) if problem.rows().iter().any(ObservationRow::is_steep) => {
                self.pass = Pass::ClearAlone(*refusal);
                self.minimizer = None;
                None
            }
            _ => Some(result),
        }
    }
}

#[cfg(test)]
mod tests;
