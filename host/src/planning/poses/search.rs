//! Poses at which the position is measured, as candidates of a design: in blocks of parameters that no row
//! couples.

use super::candidates::Selection;
use super::{Assumptions, PlanError, PlanRequest};
use crate::accuracy::information::{
    ARM, PARAMETERS, closure_rows, position_rows, tolerance_prior, weights_by_arm,
};
use crate::fit::options::CalibrationMethod;
use crate::planning::design::{Criterion, Effort, Rows, Source, added, all_over, nearer};
use delta_cal::{Noise, Robot, Sample};
use nalgebra::SMatrix;
use rand_pcg::Pcg32;

/// Random sets that a search begins with: fewer of more poses, for they differ less.
fn starts(count: usize) -> usize {
    (480 / count.max(1)).clamp(2, 40)
}

/// What is searched for.
pub(super) struct Search<'a> {
    pub(super) request: &'a PlanRequest<'a>,
    pub(super) assumptions: &'a Assumptions,
    pub(super) selection: &'a Selection<'a>,
}

/// Each arm by itself: one row of three blocks of eight.
struct Ikm<'a>(&'a Search<'a>);
/// All arms at once: three rows of one block of 24.
struct Fkm<'a>(&'a Search<'a>);

impl Search<'_> {
    /// The poses, in the order in which they were found.
    ///
    /// The information of the other methods is nearly that of three separate arms: their search begins
    /// with theirs, which is the faster.
    pub(super) fn run(&self, rng: &mut Pcg32) -> Result<Vec<Sample<f64>>, PlanError> {
        let count = self.request.count;
        let effort = Effort::thorough(starts(count));
        let found = all_over(&Ikm(self), count, &effort, rng)?.ok_or(PlanError::Singular)?;
        let better = match self.request.method {
            CalibrationMethod::Ikm => Some(found),
            CalibrationMethod::Joint | CalibrationMethod::Fkm => {
                nearer(&Fkm(self), found.chosen, &effort, rng)
            }
        };
        better.map(|found| found.chosen).ok_or(PlanError::Singular)
    }

    /// The poses that are best added to those measured, one after the other.
    pub(super) fn added(
        &self,
        measured: &[Sample<f64>],
        rng: &mut Pcg32,
    ) -> Result<Vec<Sample<f64>>, PlanError> {
        let count = self.request.count;
        if count == 0 {
            return Ok(Vec::new());
        }
        let found = match self.request.method {
            CalibrationMethod::Ikm => added(&Ikm(self), measured, count, rng)?,
            CalibrationMethod::Joint | CalibrationMethod::Fkm => {
                added(&Fkm(self), measured, count, rng)?
            }
        };
        found.ok_or(PlanError::Singular)
    }

    fn each<T>(
        &self,
        poses: &[Sample<f64>],
        rows: impl Fn(&Robot<f64>, &Sample<f64>, &Noise<f64>) -> T,
    ) -> Vec<T> {
        let (robot, noise) = (&self.request.robot.robot, &self.assumptions.noise);
        poses.iter().map(|pose| rows(robot, pose, noise)).collect()
    }
}

macro_rules! source_of_poses {
    ($model:ident, $blocks:literal, $parameters:ident, $rows:literal, $of_pose:expr, $prior:expr) => {
        impl Source<$blocks, $parameters, $rows> for $model<'_> {
            type Candidate = Sample<f64>;
            type Error = PlanError;

            fn draw_many(
                &self,
                count: usize,
                rng: &mut Pcg32,
            ) -> Result<Vec<Sample<f64>>, PlanError> {
                self.0.selection.draw_many(count, rng)
            }

            fn near(
                &self,
                pose: &Sample<f64>,
                spread: f64,
                rng: &mut Pcg32,
            ) -> Option<Sample<f64>> {
                self.0.selection.near(pose, spread, rng)
            }

            fn rows(
                &self,
                poses: &[Sample<f64>],
            ) -> Vec<Option<Rows<$blocks, $parameters, $rows>>> {
                self.0.each(poses, |robot, pose, noise| {
                    let blocks = $of_pose(robot, pose, noise)?;
                    Some(Rows { blocks, kind: 0 })
                })
            }

            /// The tolerance's, and that no parameter is off by more than a forearm, so that there always
            /// is some.
            fn prior(&self) -> Vec<SMatrix<f64, $parameters, $parameters>> {
                let robot = &self.0.request.robot.robot;
                let [arm, ..] = robot.arms();
                let least = SMatrix::from_diagonal_element(arm.lb().powi(-2));
                let known: SMatrix<f64, PARAMETERS, PARAMETERS> =
                    $prior(robot, self.0.assumptions.tolerance.as_ref());
                let of_block = |block: usize| {
                    let first = $parameters * block;
                    known.fixed_view::<$parameters, $parameters>(first, first) + least
                };
                (0..$blocks).map(of_block).collect()
            }

            fn criterion(&self) -> Criterion {
                self.0.request.criterion
            }

            fn weights(&self) -> Vec<SMatrix<f64, $parameters, $parameters>> {
                vec![SMatrix::identity(); $blocks]
            }

            fn most(&self) -> &[usize] {
                &[usize::MAX]
            }
        }
    };
}

source_of_poses!(
    Ikm,
    3,
    ARM,
    1,
    |robot, pose, noise| Some(closure_rows(robot, pose, noise)),
    |robot, tolerance| {
        let weights = weights_by_arm(robot, tolerance);
        SMatrix::from_diagonal(&weights.map(|weight| weight.powi(2)))
    }
);
source_of_poses!(
    Fkm,
    1,
    PARAMETERS,
    3,
    |robot, pose, noise| {
        let rows = position_rows(robot, pose, noise)?;
        Some([rows.transpose()])
    },
    |robot, tolerance| {
        let prior = tolerance_prior(robot, tolerance);
        SMatrix::from_fn(|row, column| prior.information(row, column))
    }
);
