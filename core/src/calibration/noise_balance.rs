//! The noise that a tolerance is weighed against where none is stated.

use super::end_point::EndPoint;
use super::problem::{Prior, Problem};
use crate::Real;

/// Rounds of estimating the noise when a tolerance but no noise is stated.
const ROUNDS: u8 = 20;

/// The noise, estimated from the residuals round by round so that samples and tolerance have the right weights
/// (`MacKay`'s evidence iteration, σ² = Σr²/(n − γ) with γ the number of parameters that the samples determine).
#[derive(Debug, Clone, Copy)]
pub(super) struct NoiseBalance<T> {
    /// One σ of the weighted residual; 1 with a stated noise.
    pub(super) sigma: T,
    rounds: u8,
}

impl<T: Real> NoiseBalance<T> {
    pub(super) const fn none() -> Self {
        Self {
            sigma: T::ONE,
            rounds: 0,
        }
    }

    /// Whether the noise was never estimated yet.
    pub(super) const fn is_first(&self) -> bool {
        self.rounds == 0
    }

    /// Whether the problem is to be solved once more, with the σ that this estimates from the best end point and the
    /// covariance there.
    pub(super) fn next<P, R, const N: usize, const M: usize, const E: usize>(
        &mut self,
        problem: &P,
        prior: &R,
        best: Option<&EndPoint<T, N, M, E>>,
        covariance: &[T],
    ) -> bool
    where
        P: Problem<T, N, M, E>,
        R: Prior<T, N, M, E>,
    {
        if self.rounds >= ROUNDS {
            return false;
        }
        let Some(best) = best else {
            // Too weak a tolerance leaves the problem without a firm minimum: start from a stronger.
            self.rounds += 1;
            self.sigma *= T::from_f64(10.0);
            return true;
        };
        let determined = determined_parameters(prior, best.residual_sigma, covariance);
        let spare = problem.residuals() - determined;
        if !(spare > T::from_f64(1e-3)) {
            return false;
        }
        let least = T::from_f64(8.0) * T::EPSILON;
        let sigma = (best.point.sum_of_squares / spare)
            .square_root()
            .larger(least);
        let change = (sigma - best.residual_sigma).magnitude();
        if best.residual_sigma != self.sigma || !(change > T::from_f64(0.01) * self.sigma) {
            // Settled; or the last round failed, and the one before it stands.
            return false;
        }
        self.rounds += 1;
        self.sigma = sigma;
        true
    }
}

/// γ = N − Σ σ² (UᵀU C)ⱼⱼ: how many parameters the samples determine and not the prior.
pub(super) fn determined_parameters<T, R, const N: usize, const M: usize, const E: usize>(
    prior: &R,
    sigma: T,
    covariance: &[T],
) -> T
where
    T: Real,
    R: Prior<T, N, M, E>,
{
    let mut determined = T::from_count(N as u64);
    for parameter in 0..N {
        determined -= prior.share(covariance, parameter) * sigma.squared();
    }
    determined
}
