//! Measurements that may be chosen.

use super::kind::Kind;
use super::planned::{Planned, measurements_file};
use super::precision::{Judge, PARAMETERS, information_of_prior};
use super::request::MeasurementRequest;
use super::setup::Setup;
use crate::fit::observations::{self, Linearized, READINGS, linearized};
use crate::planning::design::{Criterion, Rows, Source};
use crate::planning::poses::{PlanError, Selection};
use delta_cal::{Parameter, Robot, Sample};
use nalgebra::{SMatrix, SVector, Vector3};
use rand_core::Rng;
use rand_pcg::Pcg32;

/// Draws without a usable measurement before there is said to be none.
const HOPELESS: usize = 20_000;
/// Draws a candidate at most, on average.
const DRAWS: usize = 400;
/// Poses that show how steep the workspace is.
const DRAWN: usize = 200;
/// Candidates of each kind that show where the instruments are, whatever else is looked at.
const ANCHORS: usize = 40;

/// Where an error along a forearm moves the platform by more than this factor, the robot is far from linear, and
/// a calibration from poses that are all so may lead nowhere.
const STEEP: f64 = 3.0;

/// Measurements of the wished kinds, of which `R` readings at most belong to one.
pub(super) struct Candidates<'a, const R: usize> {
    request: &'a MeasurementRequest<'a>,
    setup: &'a Setup,
    selection: &'a Selection<'a>,
    judge: &'a Judge,
    anchors: Vec<Planned>,
    most: Vec<usize>,
    prior: SVector<f64, PARAMETERS>,
    /// [`STEEP`], or what half of the workspace is where that is more.
    steep: f64,
}

impl<'a, const R: usize> Candidates<'a, R> {
    pub(super) fn new(
        request: &'a MeasurementRequest<'a>,
        setup: &'a Setup,
        selection: &'a Selection<'a>,
        judge: &'a Judge,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let drawn = selection.draw_many(DRAWN, rng)?;
        let mut steepness: Vec<_> = drawn
            .iter()
            .map(|pose| steepness(&setup.robot.robot, pose))
            .collect();
        steepness.sort_by(f64::total_cmp);
        let half = steepness.get(DRAWN / 2).copied().unwrap_or(STEEP);
        let mut source = Self {
            request,
            setup,
            selection,
            judge,
            anchors: Vec::new(),
            most: Vec::new(),
            prior: SVector::zeros(),
            steep: STEEP.max(half),
        };
        for wish in &request.kinds.0 {
            source.most.push(wish.most.unwrap_or(usize::MAX));
            for instrument in 0..source.instruments_of(wish.kind) {
                let anchors = source.drawn(wish.kind, Some(instrument), ANCHORS, rng)?;
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

    fn instruments_of(&self, kind: Kind) -> usize {
        if kind == Kind::Point {
            self.setup.points.len()
        } else {
            1
        }
    }

    /// So many of one kind, with one instrument or with any.
    fn drawn(
        &self,
        kind: Kind,
        instrument: Option<usize>,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let mut found = Vec::with_capacity(count);
        let mut draws = 0;
        while found.len() < count {
            let instrument = instrument.unwrap_or_else(|| below(self.instruments_of(kind), rng));
            if let Some(pose) = self.selection.draw(rng) {
                let other = self.selection.draw(rng);
                let block = below(self.setup.blocks.len(), rng);
                found.extend(self.placed(kind, pose, other, block, instrument));
            }
            draws += 1;
            if draws >= HOPELESS + DRAWS * found.len() {
                // Where a region or the limits leave nothing at all, that is said first.
                self.selection.draw_many(1, rng)?;
                return Err(PlanError::NoMeasurement(kind.title()));
            }
        }
        Ok(found)
    }

    /// The measurement nearest to poses: on a gauge block, or as far from its point or its other pose as can be
    /// measured.
    fn placed(
        &self,
        kind: Kind,
        pose: Sample<f64>,
        other: Option<Sample<f64>>,
        block: usize,
        point: usize,
    ) -> Option<Planned> {
        let planned = Planned {
            kind,
            pose,
            other: None,
            block: None,
            point: None,
        };
        let placed = match kind {
            Kind::Xy | Kind::Z | Kind::Xyz => planned,
            Kind::Plane => {
                let height = *self.setup.blocks.get(block)?;
                let (x, y) = (pose.position.x, pose.position.y);
                let above = Vector3::new(x, y, self.setup.plane + height);
                Planned {
                    pose: self.selection.at(&above)?,
                    block: Some(block),
                    ..planned
                }
            }
            Kind::Distance => Planned {
                other: Some(self.as_far(&pose.position, &other?)?),
                ..planned
            },
            Kind::Point => {
                let (_, place) = self.setup.points.get(point)?;
                let pose = self.as_far(place, &pose)?;
                if self.setup.on_table && pose.position.z < place.z {
                    return None;
                }
                Planned {
                    pose,
                    point: Some(point),
                    ..planned
                }
            }
        };
        let robot = &self.setup.robot.robot;
        let mut poses = std::iter::once(&placed.pose).chain(&placed.other);
        let gentle = poses.all(|pose| steepness(robot, pose) <= self.steep);
        gentle.then_some(placed)
    }

    /// The pose on the line from a place to another pose whose distance can be measured.
    fn as_far(&self, from: &Vector3<f64>, pose: &Sample<f64>) -> Option<Sample<f64>> {
        let (shortest, longest) = self.setup.lengths;
        let apart = pose.position - from;
        let distance = apart.norm();
        let wanted = distance.clamp(shortest, longest);
        if (wanted - distance).abs() < f64::EPSILON {
            return Some(*pose);
        }
        (distance > 0.0).then_some(())?;
        self.selection.at(&(from + apart * (wanted / distance)))
    }

    fn kind_index(&self, kind: Kind) -> usize {
        let mut wishes = self.request.kinds.0.iter();
        wishes.position(|wish| wish.kind == kind).unwrap_or(0)
    }
}

/// By what factor an error along a forearm moves the platform at most.
fn steepness(robot: &Robot<f64>, pose: &Sample<f64>) -> f64 {
    let jacobian = robot.platform_jacobian(&pose.position, &pose.joints);
    jacobian.map_or(f64::INFINITY, |jacobian| {
        let columns = jacobian.by_parameters.iter();
        let lengths = columns.map(|arm| arm.column(Parameter::Lb.index()).norm());
        lengths.fold(0.0, f64::max)
    })
}

/// A number below another.
fn below(number: usize, rng: &mut Pcg32) -> usize {
    usize::try_from(rng.next_u64() % number.max(1) as u64).unwrap_or(0)
}

impl<const R: usize> Source<1, PARAMETERS, R, { super::precision::COMBINATIONS }>
    for Candidates<'_, R>
{
    type Candidate = Planned;
    type Error = PlanError;

    fn draw_many(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        let wishes = &self.request.kinds.0;
        let each = count.div_ceil(wishes.len().max(1));
        let mut all = Vec::with_capacity(count);
        for wish in wishes {
            all.extend(self.drawn(wish.kind, None, each, rng)?);
        }
        Ok(all)
    }

    fn near(&self, planned: &Planned, spread: f64, rng: &mut Pcg32) -> Option<Planned> {
        let pose = self.selection.near(&planned.pose, spread, rng)?;
        let other = match &planned.other {
            Some(other) => Some(self.selection.near(other, spread, rng)?),
            None => None,
        };
        let (block, point) = (planned.block.unwrap_or(0), planned.point.unwrap_or(0));
        self.placed(planned.kind, pose, other, block, point)
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

    fn prior(&self) -> [SVector<f64, PARAMETERS>; 1] {
        [self.prior]
    }

    fn criterion(&self) -> Criterion {
        Criterion::A
    }

    fn combinations(&self) -> [SMatrix<f64, PARAMETERS, { super::precision::COMBINATIONS }>; 1] {
        [*self.judge.combinations()]
    }

    fn most(&self) -> &[usize] {
        &self.most
    }
}
