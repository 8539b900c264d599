//! The robust fit: an M-estimate by iteratively reweighted least squares.
//!
//! ```text
//! minimise  Σ ρ(rₖ/s),   rₖ = f(P; Xₖ, qₖ)/σf,ₖ
//! s = max over the arms of  median |r| / 0.6745 · √(n/(n − 8))
//! ```
//!
//! The scale s is the largest of the three arms', and the stated noise keeps it at 1 or above: with few
//! samples an arm's median may be far too small by chance, and would then shrink with every good sample
//! that it makes the fit leave out. One tracker measured for all three. A round weighs every sample with
//! ψ(r/s)/(r/s), fits, and takes the new residuals (Holland and Welsch 1977). The first residuals are
//! those of the least trimmed squares' fit: Tukey's loss has many minima, and the wrong samples must not
//! choose among them (Yohai's MM-estimate, 1987).
//!
//! Which arms a wrong sample spoils is not known: a wrong position spoils all three, a wrong joint
//! angle one. An arm weighs a sample by its own residual, and a sample that one arm rejects altogether
//! counts in none. Of good samples three in a million are rejected, so this sharing costs nothing.

mod arms;
mod fit;
mod loss;
mod median;
mod outcome;
mod start;
mod weighted;

pub use fit::robust_fit;
#[cfg(any(feature = "classical", test))]
pub(crate) use fit::{fit, places};
pub use loss::{Loss, WeightNormalization};
pub use outcome::{RobustOutcome, RobustRefusal};
pub use weighted::WeighedSample;
