//! The robust fit: an M-estimate by iteratively reweighted least squares of all 24 parameters.
//!
//! ```text
//! minimise  Σ ρ(dₖ/s),   dₖ = |W f(P; Xₖ, qₖ)|,   s = median d / 1.538 · √(n/(n − 12))
//! ```
//!
//! One weight a sample: it is right or wrong as a whole. d is the length of the three whitened residuals
//! of the three arms together, of normal ones 1.538 in the median, and the stated
//! noise keeps s at 1 or above: with few samples the median may be far too small by chance, and would then
//! shrink with every good sample that it makes the fit leave out. A round weighs every sample with
//! ψ(d/s)/(d/s), fits, and takes the new residuals (Holland and Welsch 1977). The first residuals are
//! those of the least trimmed squares' fit: Tukey's loss has many minima, and the wrong samples must not
//! choose among them (Yohai's MM-estimate, 1987).

mod fit;
mod fits;
mod loss;
mod median;
mod outcome;
mod positions;
mod sample;
mod start;

pub(crate) use fit::fit;
pub use fit::robust_fit;
pub(crate) use fits::Fits;
pub use loss::{Loss, WeightNormalization};
pub use outcome::{RobustOutcome, RobustRefusal};
pub use sample::WeighedSample;
