//! Measurements that may be chosen.

use super::draws::Draws;
use super::kind::Kind;
use super::planned::{Planned, measurements_file};
use super::precision::{Judge, PARAMETERS, information_of_prior};
use super::request::MeasurementRequest;
use super::setup::Setup;
use crate::fit::observations::{self, Linearized, READINGS, linearized};
use crate::planning::design::{Criterion, Rows, Source};
use crate::planning::poses::{PlanError, Selection};
use nalgebra::SMatrix;
use rand_pcg::Pcg32;

/// Candidates of each kind that show where the instruments are, whatever else is looked at.
const ANCHORS: usize = 40;

/// Measurements of the wished kinds, of which `R` readings at most belong to one.
pub(super) struct Candidates<'a, const R: usize> {
    request: &'a MeasurementRequest<'a>,
    setup: &'a Setup,
    draws: Draws<'a>,
    judge: &'a Judge,
    anchors: Vec<Planned>,
    most: Vec<usize>,
    prior: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

impl<'a, const R: usize> Candidates<'a, R> {
    pub(super) fn new(
        request: &'a MeasurementRequest<'a>,
        setup: &'a Setup,
        selection: &'a Selection<'a>,
        judge: &'a Judge,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let mut source = Self {
            request,
            setup,
            draws: Draws::new(setup, selection, rng)?,
            judge,
            anchors: Vec::new(),
            most: Vec::new(),
            prior: SMatrix::zeros(),
        };
        for wish in &request.kinds.0 {
            source.most.push(wish.most.unwrap_or(usize::MAX));
            for instrument in 0..source.draws.instruments_of(wish.kind) {
                let anchors = source.draws.of(wish.kind, Some(instrument), ANCHORS, rng)?;
                source.anchors.extend(anchors);
            }
        }
        let file = measurements_file(&source.anchors, &setup.robot.robot, setup);
        let found = file.and_then(|file| linearized(&setup.robot, &file, setup.frame).ok());
        let found = found.ok_or(PlanError::Singular)?;
        if found.parameters > PARAMETERS {
            return Err(PlanError::TooManyInstruments);
        }
        source.prior = information_of_prior(&found, &setup.robot.robot);
        Ok(source)
    }

    fn kind_index(&self, kind: Kind) -> usize {
        let mut wishes = self.request.kinds.0.iter();
        wishes.position(|wish| wish.kind == kind).unwrap_or(0)
    }
}

impl<const R: usize> Source<1, PARAMETERS, R> for Candidates<'_, R> {
    type Candidate = Planned;
    type Error = PlanError;

    fn draw_many(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        self.draws.of_kinds(&self.request.kinds, count, rng)
    }

    fn near(&self, planned: &Planned, spread: f64, rng: &mut Pcg32) -> Option<Planned> {
        let pose = self.draws.selection.near(&planned.pose, spread, rng)?;
        let other = match &planned.other {
            Some(other) => Some(self.draws.selection.near(other, spread, rng)?),
            None => None,
        };
        let (block, point) = (planned.block.unwrap_or(0), planned.point.unwrap_or(0));
        self.draws.placed(planned.kind, pose, other, block, point)
    }

    fn rows(&self, planned: &[Planned]) -> Vec<Option<Rows<1, PARAMETERS, R>>> {
        let all: Vec<_> = planned.iter().chain(&self.anchors).cloned().collect();
        let file = measurements_file(&all, &self.setup.robot.robot, self.setup);
        let found =
            file.and_then(|file| linearized(&self.setup.robot, &file, self.setup.frame).ok());
        let Some(Linearized { rows, .. }) = found else {
            return vec![None; planned.len()];
        };
        let of_row = |(own, row): (
            &Planned,
            &SMatrix<f64, { observations::PARAMETERS }, READINGS>,
        )| {
            let mut columns = SMatrix::<f64, PARAMETERS, R>::zeros();
            let readings = own.readings();
            for (column, reading) in readings.into_iter().enumerate().take(R) {
                let sensitivities = row.fixed_view::<PARAMETERS, 1>(0, reading);
                columns.set_column(column, &sensitivities);
            }
            Some(Rows {
                blocks: [columns],
                kind: self.kind_index(own.kind),
            })
        };
        planned.iter().zip(&rows).map(of_row).collect()
    }

    fn prior(&self) -> Vec<SMatrix<f64, PARAMETERS, PARAMETERS>> {
        vec![self.prior]
    }

    fn criterion(&self) -> Criterion {
        Criterion::A
    }

    fn weights(&self) -> Vec<SMatrix<f64, PARAMETERS, PARAMETERS>> {
        vec![*self.judge.weights()]
    }

    fn most(&self) -> &[usize] {
        &self.most
    }
}
