//! A calibration from observations: rows that are kept, solved step by step.

use crate::Number;
use delta_cal::Refusal;
use delta_cal::Robot;
use delta_cal::observations::ObservationRow;
use delta_cal::stream::StreamOutcome;
use delta_cal_protocol::{
    BeginObservations, Fault, ObservationMessage, Places, Setup, Solved, Solver,
};
use heapless::Vec;

/// Observations that a session has room for.
pub(crate) const OBSERVATIONS: usize = 100;

/// The rows, and how far the solve is.
#[derive(Debug)]
pub(crate) struct Observing<T: Number> {
    nominal: Robot<T>,
    setup: Setup<T>,
    rows: Vec<ObservationRow<T>, OBSERVATIONS>,
    solver: Option<Solver<T>>,
    result: Option<Result<Observed<T>, Refusal>>,
}

/// What came out: the robot's 24 parameters, and where the instruments are.
#[derive(Debug)]
pub(crate) struct Observed<T: Number> {
    pub(crate) outcome: StreamOutcome<T>,
    pub(crate) places: Places<T>,
}

impl<T: Number> Observing<T> {
    pub(crate) fn new(nominal: &Robot<T>, begin: &BeginObservations<T>) -> Result<Self, Fault> {
        Ok(Self {
            nominal: *nominal,
            setup: begin.setup()?,
            rows: Vec::new(),
            solver: None,
            result: None,
        })
    }

    /// Observations that came.
    pub(crate) fn count(&self) -> usize {
        self.rows.len()
    }

    #[inline(never)]
    pub(crate) fn add(&mut self, message: &ObservationMessage<T>) -> Result<(), Fault> {
        if self.solving() {
            return Err(Fault::Busy);
        }
        let instruments = self.setup.instruments();
        let row = ObservationRow::checked(message.observation(), &self.nominal, &instruments)
            .map_err(Fault::Observation)?;
        self.rows
            .push(row)
            .map_err(|_| Fault::TooManyObservations {
                capacity: u32::try_from(OBSERVATIONS).unwrap_or(u32::MAX),
            })?;
        self.result = None;
        Ok(())
    }

    /// Starts solving, if that is not under way or done.
    pub(crate) fn solve(&mut self) {
        if self.result.is_none() && self.solver.is_none() {
            self.solver = Some(Solver::new());
        }
    }

    pub(crate) const fn solving(&self) -> bool {
        self.solver.is_some()
    }

    pub(crate) const fn result(&self) -> Option<&Result<Observed<T>, Refusal>> {
        self.result.as_ref()
    }

    /// One bounded step; whether that was the last one.
    #[inline(never)]
    pub(crate) fn step(&mut self) -> bool {
        let Some(solver) = &mut self.solver else {
            return true;
        };
        let Setup { settings, .. } = &self.setup;
        let instruments = self.setup.instruments();
        let result = solver.step(&self.nominal, &instruments, &mut self.rows, settings);
        let Some(result) = result.as_ref() else {
            return false;
        };
        self.take(result);
        true
    }

    // Not inlined: the solver's stack is free again.
    #[inline(never)]
    fn take(&mut self, result: &Result<Solved<T>, Refusal>) {
        self.solver = None;
        let instruments = self.setup.instruments();
        self.result = Some(match result {
            Ok(solved) => Ok(Observed {
                places: Places::new(solved, &instruments),
                outcome: StreamOutcome::Joint(solved.of_robot()),
            }),
            Err(refusal) => Err(*refusal),
        });
    }
}
