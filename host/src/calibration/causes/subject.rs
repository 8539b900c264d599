//! A fitted robot and its residuals, as rows of a regression.

use super::hypotheses::{self, Place};
use super::regression::{Regression, Rows};
use crate::accuracy::evaluation::differences;
use crate::accuracy::information::{PARAMETERS, rows_of_prior, tolerance_prior, units};
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::fit::fkm::{self, Linearization};
use crate::fit::weights::SampleWeight;
use delta_cal::{Noise, Robot, Sample, Tolerance};
use nalgebra::{DVector, Matrix3, SMatrix, SVector, Vector3};

/// More samples are not looked at: evenly spread ones stand for all.
const MOST_SAMPLES: usize = 5000;
/// A residual of more scales counts as if it were that large, so that one wrong sample is no cause.
const LARGEST_RESIDUAL: f64 = 4.0;
/// The median length of a vector of three standard normal numbers.
const MEDIAN_LENGTH: f64 = 1.538;
/// Unknowns of the sensor's frame.
const FRAME: usize = 6;
/// Without a stated noise: the part of the joints in the noise of the positions that are tried.
const JOINT_PARTS: [f64; 5] = [0.0, 0.2, 0.5, 0.8, 0.95];
/// The logarithm of the likelihood by which a part of the joints must be better than none, to be more than chance.
const SHOWN: f64 = 2.0;

/// A fitted robot, and what it was fitted to.
pub(crate) struct Subject<'a> {
    /// The centre of the tolerance.
    pub(crate) nominal: &'a Robot<f64>,
    pub(crate) calibrated: &'a Robot<f64>,
    pub(crate) samples: &'a [Sample<f64>],
    /// In which direction each joint moved last before each sample: −1, 1, or 0 if it had not moved.
    pub(crate) directions: &'a [[f64; 3]],
    /// What the fit made of each sample.
    pub(crate) weights: &'a [SampleWeight],
    pub(crate) noise: Option<Noise<f64>>,
    /// One σ of each coordinate, mm, that the fit estimates where no noise is stated.
    pub(crate) estimated_noise: Option<f64>,
    pub(crate) tolerance: Option<Tolerance<f64>>,
    /// Whether the positions were aligned with the nominal robot.
    pub(crate) aligned: bool,
    /// Whether each arm has its own estimate of a noise that is not stated.
    pub(crate) arms_apart: bool,
}

/// A sample that counts, at the fitted robot.
pub(super) struct Counted {
    pub(super) sample: Sample<f64>,
    place: Place,
    weight: f64,
    pub(super) at: Linearization,
    by_joints: Matrix3<f64>,
}

impl Subject<'_> {
    /// The square of the largest distance from the robot's axis, mm².
    pub(super) fn radius_squared(&self) -> f64 {
        hypotheses::largest_radius_squared(self.samples)
    }

    /// The lowest and the highest angle or travel of each joint.
    pub(super) fn ranges(&self) -> [[f64; 2]; 3] {
        hypotheses::ranges(self.samples)
    }

    /// The samples that count.
    pub(super) fn counted(&self) -> Vec<Counted> {
        let places = hypotheses::places(self.samples, self.directions);
        let every = self.samples.len().div_ceil(MOST_SAMPLES).max(1);
        self.samples
            .iter()
            .zip(places)
            .zip(self.weights)
            .step_by(every)
            .filter(|(_, weight)| !weight.suspected && weight.weight > 0.0)
            .filter_map(|((sample, place), weight)| {
                let at = Linearization::new(self.calibrated, &sample.joints).ok()?;
                let by_joints = hypotheses::by_joints(self.calibrated, &at, &sample.joints);
                Some(Counted {
                    sample: *sample,
                    place,
                    weight: weight.weight,
                    at,
                    by_joints,
                })
            })
            .collect()
    }

    /// All rows, the σ of a coordinate (mm), and the noise. Without a stated noise the part of the joints in it is
    /// the one that makes the residuals most probable.
    pub(super) fn regression(&self, counted: &[Counted]) -> Option<(Regression, f64, Noise<f64>)> {
        if let Some(noise) = self.noise {
            return Some((self.rows(counted, &noise).0, noise.position(), noise));
        }
        let sigma = self.estimated_noise.filter(|sigma| *sigma > 0.0)?;
        let squares: f64 = counted.iter().map(|c| c.by_joints.norm_squared()).sum();
        let number = counted.iter().fold(0.0, |count, _| count + 3.0);
        let by_joint = (squares / number).sqrt();
        let tried = JOINT_PARTS.into_iter().filter_map(|part: f64| {
            let joint = sigma * part.sqrt() / by_joint;
            let noise = Noise::new(sigma * (1.0 - part).sqrt(), joint).ok()?;
            let (regression, log_whitening) = self.rows(counted, &noise);
            let solution = regression.solve(&[])?;
            // The restricted likelihood (Patterson and Thompson 1971).
            let likelihood = log_whitening
                - solution.log_determinant
                - 0.5 * solution.freedom * solution.variance().ln();
            let scale = solution.variance().sqrt();
            let noise = Noise::new(scale * noise.position(), scale * noise.joint()).ok()?;
            likelihood
                .is_finite()
                .then_some((likelihood, regression, noise))
        });
        let tried: Vec<_> = tried.collect();
        let even = tried
            .first()
            .map(|(likelihood, _, noise)| (*likelihood, *noise))?;
        let (likelihood, regression, noise) =
            tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let shown = likelihood - even.0 > SHOWN;
        Some((regression, sigma, if shown { noise } else { even.1 }))
    }

    /// By what the σ of the positions over the workspace, of a fit that took the noise as even with this σ (mm), is too small
    /// if the noise is this one; 1 if it is not.
    ///
    /// With A = Σ JᵀJ/σ² + P⁻¹ the fit says A⁻¹, but the parameters scatter by A⁻¹ (Σ JᵀΣₖJ/σ⁴ + P⁻¹) A⁻¹, where
    /// Σₖ = σx² I + σq² J_q J_qᵀ.
    pub(super) fn widening_by_uneven_noise(
        &self,
        counted: &[Counted],
        sigma: f64,
        noise: &Noise<f64>,
        poses: &[Sample<f64>],
    ) -> Option<f64> {
        let units = units(self.calibrated);
        let prior = rows_of_prior(&tolerance_prior(self.calibrated, self.tolerance.as_ref()));
        let mut information = prior.tr_mul(&prior);
        let mut scatter = information;
        for c in counted {
            let mut jacobian: SMatrix<f64, 3, PARAMETERS> = c.at.jacobian();
            for (mut column, unit) in jacobian.column_iter_mut().zip(&units) {
                column /= *unit;
            }
            let own = Matrix3::identity() * noise.position().powi(2)
                + c.by_joints * c.by_joints.transpose() * noise.joint().powi(2);
            information.gemm_tr(c.weight / sigma.powi(2), &jacobian, &jacobian, 1.0);
            let weighed = own * jacobian;
            scatter.gemm_tr((c.weight / sigma.powi(2)).powi(2), &jacobian, &weighed, 1.0);
        }
        // What stands at no place of an arm's vector is not off.
        let places = std::iter::repeat_n(self.calibrated.drive().places(), 3).flatten();
        for (index, _) in places.enumerate().filter(|(_, place)| place.is_none()) {
            information[(index, index)] += 1.0;
        }
        let said = information.cholesky()?.inverse();
        let is = said * scatter * said;
        let over = |covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>| {
            let robot = self.calibrated;
            Some(PositionUncertainty { robot, covariance }.over(poses)?.rms)
        };
        let ratio = over(&is)? / over(&said)?;
        ratio.is_finite().then(|| ratio.max(1.0))
    }

    /// All rows with this noise, and Σ log |Lₖ⁻¹|.
    fn rows(&self, counted: &[Counted], noise: &Noise<f64>) -> (Regression, f64) {
        let framed = self.aligned && self.tolerance.is_some();
        let frame = if framed { FRAME } else { 0 };
        let drive = self.calibrated.drive();
        let ranges = self.ranges();
        let mut rows = Rows::new(PARAMETERS + frame, hypotheses::columns(drive));
        let whitened: Vec<_> = counted
            .iter()
            .map(|c| {
                let whitening = fkm::whitening(self.calibrated, &c.sample, noise);
                let residual = whitening * (c.sample.position - c.at.position);
                (whitening, residual)
            })
            .collect();
        let largest = LARGEST_RESIDUAL * scale(&whitened, self.noise.is_some());
        let mut log_whitening = 0.0;
        let units = units(self.calibrated);
        for (c, (whitening, residual)) in counted.iter().zip(&whitened) {
            let length = residual.norm();
            let weight = c.weight
                * if length > largest {
                    largest / length
                } else {
                    1.0
                };
            log_whitening += whitening.determinant().abs().ln();
            let mut jacobian = c.at.jacobian();
            for (mut column, unit) in jacobian.column_iter_mut().zip(&units) {
                column /= *unit;
            }
            let jacobian: SMatrix<f64, 3, PARAMETERS> = whitening * jacobian;
            let mut columns: Vec<Vector3<f64>> = (0..PARAMETERS)
                .map(|index| jacobian.column(index).into_owned())
                .collect();
            if framed {
                columns.extend(frame_movements(&c.sample.position).map(|by| whitening * by));
            }
            let movements =
                hypotheses::movements(drive, &c.by_joints, &c.sample.joints, &ranges, &c.place);
            columns.extend(movements.iter().map(|movement| whitening * movement));
            columns.push(*residual);
            for axis in 0..3 {
                let row = columns.iter().map(|column| column[axis]);
                rows.add(DVector::from_iterator(columns.len(), row), weight);
            }
        }
        // What stands at no place of an arm's vector is not off.
        let places = std::iter::repeat_n(drive.places(), 3).flatten();
        for (index, _) in places.enumerate().filter(|(_, place)| place.is_none()) {
            let row = (0..PARAMETERS).map(|own| if own == index { 1.0 } else { 0.0 });
            rows.add_prior(row, 0.0);
        }
        if self.tolerance.is_some() {
            let prior = rows_of_prior(&tolerance_prior(self.calibrated, self.tolerance.as_ref()));
            let off = prior * differences(self.nominal, self.calibrated);
            for (row, off) in prior.row_iter().zip(&off) {
                rows.add_prior(row.iter().copied(), *off);
            }
        }
        (rows.regression(), log_whitening)
    }

    /// The parameters' corrections, and the frame's.
    pub(super) fn corrections(&self, coefficients: &DVector<f64>) -> Corrections {
        let units = units(self.calibrated);
        let frame = self.aligned && self.tolerance.is_some();
        Corrections {
            parameters: SVector::from_fn(|index, _| coefficients[index] / units[index]),
            frame: std::array::from_fn(|index| {
                if frame {
                    coefficients[PARAMETERS + index]
                } else {
                    0.0
                }
            }),
        }
    }
}

/// What a fit with causes changes in the parameters and in the sensor's frame.
pub(super) struct Corrections {
    pub(super) parameters: SVector<f64, PARAMETERS>,
    pub(super) frame: [f64; FRAME],
}

/// By how much a position moves for each unknown of its frame: 1 mm, or the rotation by one radian.
pub(in crate::calibration) fn frame_movements(position: &Vector3<f64>) -> [Vector3<f64>; FRAME] {
    std::array::from_fn(|index| {
        let axis = Vector3::ith(index % 3, 1.0);
        if index < 3 {
            axis
        } else {
            axis.cross(position)
        }
    })
}

/// The scale of the residuals, which some wrong samples do not change; not below a stated noise.
fn scale(whitened: &[(Matrix3<f64>, Vector3<f64>)], stated: bool) -> f64 {
    let mut lengths: Vec<_> = whitened
        .iter()
        .map(|(_, residual)| residual.norm())
        .collect();
    lengths.sort_by(f64::total_cmp);
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
    (median / MEDIAN_LENGTH).max(if stated { 1.0 } else { 0.0 })
}
