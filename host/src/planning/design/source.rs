//! Where candidates come from, and what a set of them is judged by.

use nalgebra::SMatrix;
use rand_pcg::Pcg32;

/// What a set is judged by; C is the covariance of the parameters, the prior included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// tr C, angles times the upper arm's length: the mean square of the parameter error.
    #[default]
    A,
    /// det C: the volume of the parameters' confidence region, whatever their units.
    D,
}

impl Criterion {
    /// As it is written: `a` or `d`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::D => "d",
        }
    }
}

/// What each candidate adds to the information: `R` rows of each of `B` blocks of `D` parameters.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Rows<const B: usize, const D: usize, const R: usize> {
    /// Transposed: a row is a column here.
    pub(in crate::planning) blocks: [SMatrix<f64, D, R>; B],
    /// Of which kind the candidate is.
    pub(in crate::planning) kind: usize,
}

/// A source of candidates.
pub(in crate::planning) trait Source<const B: usize, const D: usize, const R: usize>:
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

    /// W of the criterion A, tr W C: symmetric, of each block.
    fn weights(&self) -> Vec<SMatrix<f64, D, D>>;

    /// How many of each kind a set may hold.
    fn most(&self) -> &[usize];
}
