//! How far each measured position is from where the robot of the file says it is.

use crate::accuracy::information::whitening;
use crate::accuracy::rigid_motion::RigidMotions;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Row;
use delta_cal::frame::RigidTransform;
use delta_cal::{Noise, Robot, Sample};
use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// The instrument's and the joints' noise in one deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowNoise {
    /// The trace of its covariance, mm².
    pub(super) mean_square: f64,
    /// The largest standard deviation along any direction, mm.
    pub(super) largest: f64,
    /// |L⁻¹ d|² of the deviation, L Lᵀ the covariance.
    pub(super) squares: f64,
}

/// One row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowDeviation {
    pub(super) line: u64,
    /// In the robot's frame.
    pub(super) measured: Sample<f64>,
    /// Measured less computed, mm.
    pub(super) deviation: Vector3<f64>,
    /// How much of the row's own deviation the adjustment of a frame took up, 0 to 1.
    pub(super) leverage: f64,
    /// `None` if it is not stated.
    pub(super) noise: Option<RowNoise>,
}

impl RowDeviation {
    pub(super) fn length(&self) -> f64 {
        self.deviation.norm()
    }

    /// Whether the stated noise explains the deviation: without any error of the robot one of so many rows deviates more
    /// in one file of a hundred.
    pub(super) fn is_noise(&self, rows: usize) -> bool {
        #[allow(clippy::cast_precision_loss)] // rows of a file
        let tail = 0.01 / rows as f64;
        let limit = ChiSquared::new(3.0).map(|chi_squared| chi_squared.inverse_cdf(1.0 - tail));
        self.noise
            .zip(limit.ok())
            .is_some_and(|(noise, limit)| noise.squares < limit)
    }

    /// The squared deviation that the row would have without the adjustment of a frame, mm².
    pub(super) fn square(&self) -> f64 {
        self.deviation.norm_squared() / (1.0 - self.leverage).max(f64::EPSILON)
    }
}

/// Of every row; `Err` with the index of a row whose joint angles the robot does not reach. `frame` is that of the
/// sensor, if it was adjusted.
pub(super) fn deviations(
    robot: &RobotFile,
    samples: &[Row<Sample<f64>>],
    frame: Option<&RigidTransform<f64>>,
) -> Result<Vec<RowDeviation>, usize> {
    let to_robot = frame.map(RigidTransform::inverse);
    let mut rows = Vec::with_capacity(samples.len());
    for (index, row) in samples.iter().enumerate() {
        let position = row.value.position;
        let measured = Sample {
            position: to_robot
                .as_ref()
                .map_or(position, |own| own.apply(&position)),
            ..row.value
        };
        let expected = robot.robot.forward(&measured.joints).map_err(|_| index)?;
        let deviation = measured.position - expected;
        rows.push(RowDeviation {
            line: row.line,
            measured,
            deviation,
            leverage: 0.0,
            noise: robot
                .noise
                .as_ref()
                .and_then(|noise| row_noise(&robot.robot, &measured, &deviation, noise)),
        });
    }
    if frame.is_some() {
        let points: Vec<_> = rows.iter().map(|row| row.measured.position).collect();
        if let Some(motions) = RigidMotions::of(points.into_iter()) {
            for row in &mut rows {
                row.leverage = motions.leverage(&row.measured.position);
            }
        }
    }
    Ok(rows)
}

fn row_noise(
    robot: &Robot<f64>,
    measured: &Sample<f64>,
    deviation: &Vector3<f64>,
    noise: &Noise<f64>,
) -> Option<RowNoise> {
    let whitening = whitening(robot, measured, noise)?;
    let factor = whitening.try_inverse()?;
    let covariance = factor * factor.transpose();
    Some(RowNoise {
        mean_square: covariance.trace(),
        largest: covariance.symmetric_eigenvalues().max().max(0.0).sqrt(),
        squares: (whitening * deviation).norm_squared(),
    })
}
