//! How far the measured positions are from where a geometry says they are.

use crate::accuracy::information::prior_covariance;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Row;
use crate::fit::outlier::OUTLIER;
use crate::fit::weights::SampleWeight;
use delta_cal::{Robot, Sample};

/// How far the measured positions are from where a robot's geometry says they are, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionError {
    /// √ of the mean square distance over the samples that the geometry can reach; NaN if there
    /// is none, as are the other distances. With forgetting each sample counts as much as the estimate
    /// remembers of it.
    pub rms: f64,
    /// The median distance, which an outlier does not move.
    pub median: f64,
    /// The largest distance; with forgetting of the samples of which at least a twentieth is
    /// remembered.
    pub max: f64,
    /// The line in the samples file of the sample with the largest distance.
    pub max_at_line: Option<u64>,
    /// Samples whose joint angles have no position in this geometry; not part of the other figures.
    pub unreachable: usize,
}

/// How far one measured position is from where the geometry says it is, before and after, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleErrors {
    /// The sample's line in the samples file.
    pub line: u64,
    /// The joint angles and the measured position in the robot's frame.
    pub measured: Sample<f64>,
    /// With the robot file's parameters; `None` where they cannot reach the joint angles.
    pub before: Option<f64>,
    /// With the calibrated ones.
    pub after: Option<f64>,
    /// The latter in σ of the [noise](crate::calibration::report::CalibrationReport::noise) at this pose, a joint's noise
    /// carried over to the position: 1 is expected. `None` also where no noise is known.
    pub after_in_sigmas: Option<f64>,
    /// What it counted in the fit: 1 with the squared loss.
    pub weight: SampleWeight,
}

/// A weight below it is noteworthy.
const LITTLE: f64 = 0.5;

impl SampleErrors {
    /// Whether it counts less than half of what the others do, but counts.
    pub fn counts_little(&self) -> bool {
        !self.weight.suspected && self.weight.weight < LITTLE
    }
}

/// |X − FK(q)| of every sample; `None` where the geometry cannot reach the joint angles.
pub(crate) fn distances(robot: &Robot<f64>, samples: &[Sample<f64>]) -> Vec<Option<f64>> {
    samples
        .iter()
        .map(|sample| {
            let position = robot.forward(&sample.joints).ok()?;
            Some((sample.position - position).norm())
        })
        .collect()
}

/// The error of samples that come one after the other; its median has to be known from elsewhere.
#[derive(Debug, Default)]
pub(crate) struct RunningError {
    squares: f64,
    reached: f64,
    farthest: Option<(f64, u64)>,
    unreachable: usize,
}

impl RunningError {
    /// As [`PositionError::of_counted`] has it.
    pub(crate) fn add(&mut self, distance: Option<f64>, line: u64, weight: &SampleWeight) {
        if weight.suspected {
            return;
        }
        let remembered = weight.remembered >= FORGOTTEN;
        let Some(distance) = distance else {
            self.unreachable += usize::from(remembered);
            return;
        };
        self.squares += weight.remembered * distance * distance;
        self.reached += weight.remembered;
        if remembered
            && self
                .farthest
                .is_none_or(|(farthest, _)| distance > farthest)
        {
            self.farthest = Some((distance, line));
        }
    }

    pub(crate) fn finish(self, median: f64) -> PositionError {
        PositionError {
            rms: (self.squares / self.reached).sqrt(),
            median,
            max: self.farthest.map_or(f64::NAN, |(distance, _)| distance),
            max_at_line: self.farthest.map(|(_, line)| line),
            unreachable: self.unreachable,
        }
    }
}

/// The known distances with their lines, the smallest first.
pub(crate) fn sorted<T>(distances: &[Option<f64>], rows: &[Row<T>]) -> Vec<(f64, u64)> {
    let mut known: Vec<_> = distances
        .iter()
        .zip(rows)
        .filter_map(|(distance, row)| Some(((*distance)?, row.line)))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    known
}

/// The median of sorted distances; NaN of none.
pub(crate) fn median(sorted: &[(f64, u64)]) -> f64 {
    let middle = sorted.get(sorted.len() / 2);
    middle.map_or(f64::NAN, |(distance, _)| *distance)
}

/// Measured positions further than this part of the forearm from where the robot should be are in
/// another frame, another unit or of other joints.
const ELSEWHERE: f64 = 0.05;

/// A sample of which less than this part is remembered is forgotten.
const FORGOTTEN: f64 = 0.05;

/// A tolerance allows so many times its σ.
const ALLOWED: f64 = 3.0;

/// One σ of a coordinate of robots made to the file's tolerance, the median over poses, mm; `None` without one.
pub(crate) fn sigma_by_tolerance(
    file: &RobotFile,
    poses: impl Iterator<Item = [f64; 3]>,
) -> Option<f64> {
    let tolerance = file.tolerance.as_ref()?;
    let uncertainty = PositionUncertainty {
        robot: &file.robot,
        covariance: &prior_covariance(&file.robot, tolerance),
    };
    let mut coordinates: Vec<_> = poses
        .filter_map(|joints| {
            let position = file.robot.forward(&joints).ok()?;
            let covariance = uncertainty.covariance(&position, &joints)?;
            Some((covariance.trace() / 3.0).sqrt())
        })
        .collect();
    coordinates.sort_by(f64::total_cmp);
    coordinates.get(coordinates.len() / 2).copied()
}

impl PositionError {
    /// Whether the measured points lie further from where the robot of a file would be than its tolerance
    /// allows, where another frame, unit or order of joints would put them.
    pub(crate) fn contradicts(
        &self,
        file: &RobotFile,
        poses: impl Iterator<Item = [f64; 3]>,
    ) -> bool {
        let allowed = |sigma: f64| self.median <= ALLOWED * 3.0_f64.sqrt() * sigma;
        self.lies_elsewhere(&file.robot) && !sigma_by_tolerance(file, poses).is_some_and(allowed)
    }

    /// Whether the measured points lie where another frame, unit or order of joints would put them.
    pub(crate) fn lies_elsewhere(&self, robot: &Robot<f64>) -> bool {
        let [arm, ..] = robot.arms();
        !(self.median <= ELSEWHERE * arm.lb())
    }

    /// Whether a sample this far off is an outlier among the others.
    pub(crate) fn is_outlier(&self, distance: f64) -> bool {
        distance > OUTLIER * self.median
    }

    /// The sample that is much further off than the others, if there is one.
    pub(crate) fn outlier(&self) -> Option<String> {
        let line = self.max_at_line?;
        self.is_outlier(self.max).then(|| {
            format!(
                "the sample in line {line} is {:.3} mm from where the robot would be, while half of \
             the samples are off by less than {:.3} mm",
                self.max, self.median
            )
        })
    }

    /// Over the samples that are not suspected, each as far as it is remembered.
    pub(crate) fn of_counted<T>(
        distances: &[Option<f64>],
        rows: &[Row<T>],
        weights: &[SampleWeight],
    ) -> Self {
        let counted: Vec<_> = distances
            .iter()
            .zip(rows)
            .zip(weights)
            .filter(|(_, weight)| !weight.suspected)
            .map(|((distance, row), weight)| (*distance, row.line, weight.remembered))
            .collect();
        let (mut squares, mut reached) = (0.0, 0.0);
        for (distance, _, remembered) in &counted {
            if let Some(distance) = distance {
                squares += remembered * distance * distance;
                reached += remembered;
            }
        }
        let (distances, rows): (Vec<_>, Vec<_>) = counted
            .into_iter()
            .filter(|(.., remembered)| *remembered >= FORGOTTEN)
            .map(|(distance, line, _)| (distance, Row { line, value: () }))
            .unzip();
        Self {
            rms: f64::sqrt(squares / reached),
            ..Self::of(&distances, &rows)
        }
    }

    pub(crate) fn of<T>(distances: &[Option<f64>], rows: &[Row<T>]) -> Self {
        let known = sorted(distances, rows);
        let reached = known.iter().fold(0.0, |count, _| count + 1.0);
        let squares: f64 = known.iter().map(|(distance, _)| distance.powi(2)).sum();
        let last = known.last();
        Self {
            rms: (squares / reached).sqrt(),
            median: median(&known),
            max: last.map_or(f64::NAN, |(distance, _)| *distance),
            max_at_line: last.map(|(_, line)| *line),
            unreachable: distances.len() - known.len(),
        }
    }
}
