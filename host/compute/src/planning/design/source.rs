//! Where candidates come from, and what a set of them is judged by.

use super::exchange::{Criterion, Rows};
use nalgebra::SMatrix;
use rand_pcg::Pcg32;

/// A source of candidates: `R` rows of `B` blocks of `D` parameters, judged by `K` combinations of each
/// block's parameters.
pub(in crate::planning) trait Source<const B: usize, const D: usize, const R: usize, const K: usize>:
    Sync
{
    type Candidate: Clone + Send + Sync;
    type Error;

    /// Candidates from all over.
    fn draw_many(&self, count: usize, rng: &mut Pcg32)
    -> Result<Vec<Self::Candidate>, Self::Error>;

    /// One near another, one σ of its joint angles in radians away; `None` if that is not allowed.
    fn near(
        &self,
        candidate: &Self::Candidate,
        spread: f64,
        rng: &mut Pcg32,
    ) -> Option<Self::Candidate>;

    /// What each candidate adds to the information; `None` where it says nothing.
    fn rows(&self, candidates: &[Self::Candidate]) -> Vec<Option<Rows<B, D, R>>>;

    /// Information before any measurement, of each block.
    fn prior(&self) -> Vec<SMatrix<f64, D, D>>;

    fn criterion(&self) -> Criterion;

    fn combinations(&self) -> [SMatrix<f64, D, K>; B];

    /// How many of each kind a set may hold.
    fn most(&self) -> &[usize];
}
