use super::median::median;
use super::sample::WeighedSample;
use crate::Real;
use crate::calibration::{Refusal, Settings};

/// The scale of exact samples, in ε: what rounding leaves.
const ROUNDING: f64 = 32.0;

/// What a robust fit is made of: samples with one residual or several each, and how they are fitted as they are
/// weighed.
pub(crate) trait Fits<T: Real> {
    /// A correction of all parameters, in internal units.
    type Correction: Copy;
    /// A judged fit.
    type Outcome;

    fn settings(&self) -> &Settings<T>;

    /// The first round's scales are so many times as large.
    fn widened(&self) -> T;

    /// The correction of the robot before calibration.
    fn nominal(&self) -> Self::Correction;

    /// How many samples determine the robot, from its nominal parameters if the settings begin there.
    fn subset(&self) -> usize;

    /// What a correction costs beside the samples: Σ ((p − p nominal)/σ)² of what is known beforehand.
    fn prior_cost(&self, correction: &Self::Correction) -> T;

    /// Samples that the parameters use up.
    fn parameters(&self) -> usize;

    /// The fit; `None` if it does not settle. What is judged is the last fit alone.
    fn fit(
        &mut self,
        settings: &Settings<T>,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Option<Self::Correction>;

    /// The judged fit.
    fn outcome(
        &mut self,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Result<Self::Outcome, Refusal>;

    /// Every sample's distance at a correction.
    fn measure(&self, correction: &Self::Correction, weighed: &mut [WeighedSample<T>]);
}

/// The scale of the distances: their median over that of normal residuals. The parameters make them smaller than
/// they are for others, and the start chooses the smallest half besides, which of few good samples names one in
/// two hundred if it is not made up for: together half as much again as the parameters.
pub(super) fn scale<T: Real>(fits: &impl Fits<T>, weighed: &[WeighedSample<T>]) -> T {
    let used_up = T::from_f64(1.5) * T::from_count(fits.parameters() as u64);
    let counted = || weighed.iter().filter(|own| own.dimensions > 0);
    let count = T::from_count(counted().count() as u64);
    let fitted = (count / (count - used_up)).square_root();
    let least = match fits.settings().noise {
        Some(_) => T::ONE,
        None => T::from_f64(ROUNDING) * T::EPSILON,
    };
    let typical = counted().map(|own| own.distance / median_length(own.dimensions));
    least.larger(median(typical) * fitted)
}

/// The median length of so many normal residuals with σ = 1: √ of the median of χ².
fn median_length<T: Real>(dimensions: u8) -> T {
    T::from_f64(match dimensions {
        0 | 1 => 0.674_490,
        2 => 1.177_410,
        3 => 1.538_172,
        4 => 1.832_128,
        _ => 2.086_015,
    })
}

#[cfg(test)]
mod tests {
    use super::median_length;

    /// Half of all normal residuals are shorter: by the distribution of χ² in closed form.
    #[test]
    fn half_of_the_residuals_are_shorter_than_the_median_length() {
        for dimensions in 1..=5 {
            let length: f64 = median_length(dimensions);
            let (half, density) = (length * length / 2.0, libm::exp(-length * length / 2.0));
            let of_one = libm::erf(length / core::f64::consts::SQRT_2);
            let odd = libm::sqrt(2.0 / core::f64::consts::PI) * length * density;
            let shorter = match dimensions {
                1 => of_one,
                2 => 1.0 - density,
                3 => of_one - odd,
                4 => 1.0 - density * (1.0 + half),
                _ => of_one - odd * (1.0 + 2.0 * half / 3.0),
            };
            // Six decimals of the length.
            assert!((shorter - 0.5).abs() < 1e-6, "{dimensions}: {shorter}");
        }
    }
}
