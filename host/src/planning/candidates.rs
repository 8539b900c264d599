//! Candidate measurements: allowed poses, read by the instruments where they stand.

use super::PlanError;
use super::request::{Kind, Wishes, below};
use super::selection::{Selection, drawn};
use super::setup::{Planned, Setup};
use crate::files::samples_file::Reading;
use delta_cal::{Parameter, Robot, Sample};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

/// Draws allowed per candidate, on average.
const DRAWS: usize = 400;
/// Poses sampled to find out how steep the workspace is.
const DRAWN: usize = 200;
/// Where an error along a forearm moves the platform by more than this factor, the robot is far from linear. A
/// calibration from such poses alone may not converge.
const STEEP: f64 = 3.0;
/// Measurements per kind and instrument that locate the instruments, whatever else is measured.
const ANCHORS: usize = 40;

/// Where measurements are drawn from.
pub(super) struct Candidates<'a> {
    setup: &'a Setup,
    selection: &'a Selection<'a>,
    /// [`STEEP`], or the median over the workspace if that is larger.
    steep: f64,
}

impl<'a> Candidates<'a> {
    pub(super) fn new(
        setup: &'a Setup,
        selection: &'a Selection<'a>,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let drawn = selection.draw_many(DRAWN, rng)?;
        let steepness = drawn.iter().map(|pose| steepness(&setup.robot.robot, pose));
        let mut steepness: Vec<_> = steepness.collect();
        steepness.sort_by(f64::total_cmp);
        let half = steepness.get(DRAWN / 2).copied().unwrap_or(STEEP);
        Ok(Self {
            setup,
            selection,
            steep: STEEP.max(half),
        })
    }

    /// `count` in all, divided evenly among the kinds.
    pub(super) fn of_kinds(
        &self,
        kinds: &Wishes,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let each = count.div_ceil(kinds.0.len().max(1));
        let mut all = Vec::with_capacity(count);
        for wish in &kinds.0 {
            all.extend(self.of(wish.kind, None, each, rng)?);
        }
        Ok(all)
    }

    /// Rows of [`ANCHORS`] of each kind with each instrument.
    pub(super) fn anchors(
        &self,
        kinds: &Wishes,
        rng: &mut Pcg32,
    ) -> Result<Vec<Reading>, PlanError> {
        let mut all = Vec::new();
        for wish in &kinds.0 {
            for instrument in 0..self.instruments_of(wish.kind) {
                let own = self.of(wish.kind, Some(instrument), ANCHORS, rng)?;
                all.extend(own.iter().map(|own| self.setup.row(own)));
            }
        }
        Ok(all)
    }

    fn instruments_of(&self, kind: Kind) -> usize {
        match kind {
            Kind::Plane => self.setup.planes.len(),
            Kind::Point => self.setup.points.len(),
            Kind::Distance | Kind::Position(_) => 1,
        }
    }

    /// `count` of one kind, with one instrument or with any.
    fn of(
        &self,
        kind: Kind,
        instrument: Option<usize>,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let found = drawn(count, DRAWS, || {
            let instrument = instrument.unwrap_or_else(|| below(self.instruments_of(kind), rng));
            let pose = self.selection.draw(rng)?;
            let other = self.selection.draw(rng);
            let plane = self.setup.planes.get(instrument);
            let block = below(plane.map_or(0, |plane| plane.blocks.len()), rng);
            self.placed(kind, pose, other, (instrument, block))
        });
        if found.is_none() {
            // If the region or the limits leave no pose at all, report that instead.
            self.selection.draw_many(1, rng)?;
        }
        found.ok_or(PlanError::NoMeasurement(kind))
    }

    /// A measurement near another; `spread` is one σ of the joint angles, radians. `None` if it is not allowed.
    pub(super) fn near(&self, own: &Planned, spread: f64, rng: &mut Pcg32) -> Option<Planned> {
        let pose = self.selection.near(&own.pose, spread, rng)?;
        let other = match &own.other {
            Some(other) => Some(self.selection.near(other, spread, rng)?),
            None => None,
        };
        let at = own.plane.unwrap_or((own.point.unwrap_or(0), 0));
        self.placed(own.kind, pose, other, at)
    }

    /// Moves poses to where they can be measured: onto a gauge block, or to a measurable distance from a point or from
    /// the other pose. `at`: plane and block, or point.
    fn placed(
        &self,
        kind: Kind,
        pose: Sample<f64>,
        other: Option<Sample<f64>>,
        at: (usize, usize),
    ) -> Option<Planned> {
        let mut planned = Planned {
            kind,
            pose,
            other: None,
            plane: None,
            point: None,
        };
        match kind {
            Kind::Position(_) => {}
            Kind::Plane => {
                let plane = self.setup.places.planes.get(at.0)?;
                let block = self.setup.planes.get(at.0)?.blocks.get(at.1)?;
                let mut above = pose.position;
                above.z += (plane.offset + block - plane.normal.dot(&above)) / plane.normal.z;
                planned.pose = self.selection.at(&above)?;
                planned.plane = Some(at);
            }
            Kind::Distance => {
                let far = self.as_far(&pose.position, &other?, self.setup.lengths)?;
                planned.other = Some(far);
            }
            Kind::Point => {
                let place = self.setup.places.points.get(at.0)?.place;
                let lengths = self.setup.points.get(at.0)?.lengths;
                planned.pose = self.as_far(&place, &pose, lengths)?;
                planned.point = Some(at.0);
                if self.setup.on_table && planned.pose.position.z < place.z {
                    return None;
                }
            }
        }
        // From complete positions a calibration converges anywhere.
        let robot = &self.setup.robot.robot;
        let mut poses = std::iter::once(&planned.pose).chain(&planned.other);
        let gentle = kind == Kind::XYZ || poses.all(|pose| steepness(robot, pose) <= self.steep);
        gentle.then_some(planned)
    }

    /// The pose on the line through a place and another pose whose distance from the place can be measured.
    fn as_far(
        &self,
        from: &Vector3<f64>,
        pose: &Sample<f64>,
        (shortest, longest): (f64, f64),
    ) -> Option<Sample<f64>> {
        let apart = pose.position - from;
        let distance = apart.norm();
        let wanted = distance.clamp(shortest, longest);
        if (wanted - distance).abs() < f64::EPSILON {
            return Some(*pose);
        }
        (distance > 0.0).then_some(())?;
        self.selection.at(&(from + apart * (wanted / distance)))
    }
}

/// The largest factor by which an error along a forearm moves the platform.
fn steepness(robot: &Robot<f64>, pose: &Sample<f64>) -> f64 {
    let jacobian = robot.platform_jacobian(&pose.position, &pose.joints);
    jacobian.map_or(f64::INFINITY, |jacobian| {
        let columns = jacobian.by_parameters.iter();
        let lengths = columns.map(|arm| arm.column(Parameter::Lb.index()).norm());
        lengths.fold(0.0, f64::max)
    })
}
