//! One arm's IKM problem written for the `levenberg-marquardt` crate (MINPACK's algorithm), from
//! the equations and without this project's code: a second oracle, and the peer of the benchmark.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra_of_peer as na;

/// Eight parameters in the order of the paper's (3.6), lengths in mm, angles in radians.
pub type Parameters = na::SVector<f64, 8>;

/// A sample with its sine and cosine, and the weight of its residual.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// X in mm.
    pub x: na::Vector3<f64>,
    /// sin q.
    pub sine: f64,
    /// cos q.
    pub cosine: f64,
    /// 1/σf.
    pub weight: f64,
}

/// The least-squares problem Σ (w f)² over the rows, and a prior of independent parameters.
#[derive(Debug, Clone)]
pub struct PeerProblem {
    /// The samples.
    pub rows: Vec<Row>,
    /// 1/tolerance of each parameter; zeros without a prior.
    pub prior: Parameters,
    /// Where the prior is centred.
    pub nominal: Parameters,
    /// The current parameters.
    pub parameters: Parameters,
}

struct Basis {
    ex: na::Vector3<f64>,
    ez: na::Vector3<f64>,
    sin_theta: f64,
    cos_theta: f64,
    sin_alpha: f64,
    cos_alpha: f64,
}

impl PeerProblem {
    fn basis(&self) -> Basis {
        let (sin_theta, cos_theta) = self.parameters[3].sin_cos();
        let (sin_alpha, cos_alpha) = self.parameters[4].sin_cos();
        Basis {
            ex: na::Vector3::new(cos_theta, sin_theta, 0.0),
            ez: na::Vector3::new(sin_theta * sin_alpha, -cos_theta * sin_alpha, cos_alpha),
            sin_theta,
            cos_theta,
            sin_alpha,
            cos_alpha,
        }
    }

    fn has_prior(&self) -> bool {
        self.prior != Parameters::zeros()
    }

    fn length(&self) -> usize {
        self.rows.len() + if self.has_prior() { 8 } else { 0 }
    }

    /// Solves from the current parameters with the crate's default tolerances; `None` if it says it
    /// failed.
    pub fn solve(self) -> Option<Parameters> {
        let (solved, report) = LevenbergMarquardt::new().minimize(self);
        report
            .termination
            .was_successful()
            .then_some(solved.parameters)
    }
}

impl LeastSquaresProblem<f64, na::Dyn, na::U8> for PeerProblem {
    type ResidualStorage = na::storage::Owned<f64, na::Dyn>;
    type JacobianStorage = na::storage::Owned<f64, na::Dyn, na::U8>;
    type ParameterStorage = na::storage::Owned<f64, na::U8>;

    fn set_params(&mut self, parameters: &Parameters) {
        self.parameters = *parameters;
    }

    fn params(&self) -> Parameters {
        self.parameters
    }

    fn residuals(&self) -> Option<na::DVector<f64>> {
        let basis = self.basis();
        let [dx, dy, dz, _, _, la_x, la_y, lb] = self.parameters.data.0[0];
        let d = na::Vector3::new(dx, dy, dz);
        let u = basis.ex * la_x + basis.ez * la_y;
        let v = basis.ex * la_y - basis.ez * la_x;
        let mut residuals = na::DVector::zeros(self.length());
        for (residual, row) in residuals.iter_mut().zip(&self.rows) {
            let w = row.x - (d + u * row.cosine + v * row.sine);
            *residual = row.weight * (w.norm_squared() - lb * lb);
        }
        if self.has_prior() {
            for index in 0..8 {
                residuals[self.rows.len() + index] =
                    self.prior[index] * (self.parameters[index] - self.nominal[index]);
            }
        }
        Some(residuals)
    }

    fn jacobian(&self) -> Option<na::OMatrix<f64, na::Dyn, na::U8>> {
        let basis = self.basis();
        let [dx, dy, dz, _, _, la_x, la_y, lb] = self.parameters.data.0[0];
        let d = na::Vector3::new(dx, dy, dz);
        let u = basis.ex * la_x + basis.ez * la_y;
        let v = basis.ex * la_y - basis.ez * la_x;
        let ex_by_theta = na::Vector3::new(-basis.sin_theta, basis.cos_theta, 0.0);
        let ez_by_theta = basis.ex * basis.sin_alpha;
        let ez_by_alpha = na::Vector3::new(
            basis.sin_theta * basis.cos_alpha,
            -basis.cos_theta * basis.cos_alpha,
            -basis.sin_alpha,
        );
        let mut jacobian = na::OMatrix::<f64, na::Dyn, na::U8>::zeros(self.length());
        for (index, row) in self.rows.iter().enumerate() {
            let (c, s) = (row.cosine, row.sine);
            let w = (row.x - (d + u * c + v * s)) * (-2.0 * row.weight);
            let elbow_by_theta =
                ex_by_theta * (la_x * c + la_y * s) + ez_by_theta * (la_y * c - la_x * s);
            let elbow_by_alpha = ez_by_alpha * (la_y * c - la_x * s);
            let entries = [
                w.x,
                w.y,
                w.z,
                w.dot(&elbow_by_theta),
                w.dot(&elbow_by_alpha),
                w.dot(&basis.ex) * c - w.dot(&basis.ez) * s,
                w.dot(&basis.ez) * c + w.dot(&basis.ex) * s,
                -2.0 * lb * row.weight,
            ];
            for (column, entry) in entries.into_iter().enumerate() {
                jacobian[(index, column)] = entry;
            }
        }
        if self.has_prior() {
            for index in 0..8 {
                jacobian[(self.rows.len() + index, index)] = self.prior[index];
            }
        }
        Some(jacobian)
    }
}
