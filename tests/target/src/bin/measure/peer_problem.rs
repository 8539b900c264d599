//! One arm's IKM problem for the `levenberg-marquardt` crate (MINPACK's algorithm), written from
//! the equations, without allocation.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra_of_peer::{ArrayStorage, Const, SMatrix, SVector, U8, Vector3};

/// The crate links `alloc`; without memory this one refuses whatever is asked of it.
#[global_allocator]
static NO_HEAP: embedded_alloc::LlffHeap = embedded_alloc::LlffHeap::empty();

/// Eight parameters in the order of the paper's (3.6), lengths in mm, angles in radians.
pub(crate) type Parameters = SVector<f32, 8>;

/// A sample with its sine and cosine.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// X in mm.
    pub(crate) x: Vector3<f32>,
    pub(crate) sine: f32,
    pub(crate) cosine: f32,
}

/// The samples, and the current parameters.
#[derive(Clone)]
pub(crate) struct PeerProblem<const N: usize> {
    pub(crate) rows: [Row; N],
    pub(crate) parameters: Parameters,
}

/// Solving is written out for each size: the crate's bounds cannot be stated for all.
pub(crate) trait Solve {
    /// With the crate's default tolerances; `None` if it says it failed.
    fn solve(self) -> Option<Parameters>;
}

macro_rules! solve {
    ($($size:literal)*) => {$(
        impl Solve for PeerProblem<$size> {
            fn solve(self) -> Option<Parameters> {
                let (solved, report) = LevenbergMarquardt::new().minimize(self);
                report
                    .termination
                    .was_successful()
                    .then_some(solved.parameters)
            }
        }
    )*};
}

solve!(20 60);

/// What the current parameters make of the arm.
struct Geometry {
    ex: Vector3<f32>,
    ez: Vector3<f32>,
    d: Vector3<f32>,
    u: Vector3<f32>,
    v: Vector3<f32>,
    ex_by_theta: Vector3<f32>,
    ez_by_theta: Vector3<f32>,
    ez_by_alpha: Vector3<f32>,
}

impl<const N: usize> PeerProblem<N> {
    fn geometry(&self) -> Geometry {
        let [dx, dy, dz, theta, alpha, la_x, la_y, _] = self.parameters.data.0[0];
        // The same sine as this project's own, so that it is not what makes the difference.
        let (sin_theta, cos_theta) = delta_cal::Real::sine_cosine(theta);
        let (sin_alpha, cos_alpha) = delta_cal::Real::sine_cosine(alpha);
        let ex = Vector3::new(cos_theta, sin_theta, 0.0);
        let ez = Vector3::new(sin_theta * sin_alpha, -cos_theta * sin_alpha, cos_alpha);
        Geometry {
            ex,
            ez,
            d: Vector3::new(dx, dy, dz),
            u: ex * la_x + ez * la_y,
            v: ex * la_y - ez * la_x,
            ex_by_theta: Vector3::new(-sin_theta, cos_theta, 0.0),
            ez_by_theta: ex * sin_alpha,
            ez_by_alpha: Vector3::new(sin_theta * cos_alpha, -cos_theta * cos_alpha, -sin_alpha),
        }
    }
}

impl<const N: usize> LeastSquaresProblem<f32, Const<N>, U8> for PeerProblem<N> {
    type ResidualStorage = ArrayStorage<f32, N, 1>;
    type JacobianStorage = ArrayStorage<f32, N, 8>;
    type ParameterStorage = ArrayStorage<f32, 8, 1>;

    fn set_params(&mut self, parameters: &Parameters) {
        self.parameters = *parameters;
    }

    fn params(&self) -> Parameters {
        self.parameters
    }

    fn residuals(&self) -> Option<SVector<f32, N>> {
        let arm = self.geometry();
        let [.., lb] = self.parameters.data.0[0];
        let mut residuals = SVector::<f32, N>::zeros();
        for (residual, row) in residuals.iter_mut().zip(&self.rows) {
            let w = row.x - (arm.d + arm.u * row.cosine + arm.v * row.sine);
            *residual = w.norm_squared() - lb * lb;
        }
        Some(residuals)
    }

    fn jacobian(&self) -> Option<SMatrix<f32, N, 8>> {
        let arm = self.geometry();
        let [_, _, _, _, _, la_x, la_y, lb] = self.parameters.data.0[0];
        let mut jacobian = SMatrix::<f32, N, 8>::zeros();
        for (mut line, row) in jacobian.row_iter_mut().zip(&self.rows) {
            let (c, s) = (row.cosine, row.sine);
            let w = (row.x - (arm.d + arm.u * c + arm.v * s)) * -2.0;
            let (radial, up) = (la_x * c + la_y * s, la_y * c - la_x * s);
            let (along_ex, along_ez) = (w.dot(&arm.ex), w.dot(&arm.ez));
            let entries = [
                w.x,
                w.y,
                w.z,
                w.dot(&arm.ex_by_theta) * radial + w.dot(&arm.ez_by_theta) * up,
                w.dot(&arm.ez_by_alpha) * up,
                along_ex * c - along_ez * s,
                along_ez * c + along_ex * s,
                -2.0 * lb,
            ];
            for (place, entry) in line.iter_mut().zip(entries) {
                *place = entry;
            }
        }
        Some(jacobian)
    }
}
