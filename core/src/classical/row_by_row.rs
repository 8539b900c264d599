//! The parts of a problem whose samples are stored: sums over rows of the Jacobian (3.21). Each sample
//! comes with the root of the factor with which it enters the sum of squares.

use crate::Real;
use crate::calibration::{Means, Normal, spread};
use crate::samples::{ArmSample, Displacement};
use nalgebra::Vector3;

/// Rows reduced together.
const BLOCK: usize = 8;

pub(crate) fn linearize<'a, T: Real>(
    mut samples: impl Iterator<Item = (&'a ArmSample<T>, T)>,
    at: &Displacement<T>,
    normal: &mut Normal<T>,
) -> T {
    let mut sum = T::ZERO;
    loop {
        let mut block = [[T::ZERO; BLOCK]; 9];
        let mut rows = 0;
        for (index, (sample, root)) in samples.by_ref().take(BLOCK).enumerate() {
            let (row, constraint) = at.constraint_row(sample);
            for (column, value) in block.iter_mut().zip(row.iter().chain([&constraint])) {
                if let Some(entry) = column.get_mut(index) {
                    *entry = *value * root;
                }
            }
            sum += (constraint * root).squared();
            rows += 1;
        }
        if rows == 0 {
            return sum;
        }
        normal.absorb(&mut block);
    }
}

pub(crate) fn sum_of_squares<'a, T: Real>(
    samples: impl Iterator<Item = (&'a ArmSample<T>, T)>,
    at: &Displacement<T>,
) -> T {
    let mut sum = T::ZERO;
    for (sample, root) in samples {
        sum += (at.weighted_constraint(sample) * root).squared();
    }
    sum
}

pub(crate) fn means<'a, T: Real>(samples: impl Iterator<Item = (&'a ArmSample<T>, T)>) -> Means<T> {
    let mut sums = (Vector3::zeros(), T::ZERO, T::ZERO, T::ZERO);
    let mut squares = T::ZERO;
    for (sample, root) in samples {
        let weight = (sample.weight * root).squared();
        sums.0 += sample.x * weight;
        squares += sample.x.dot(&sample.x) * weight;
        sums.1 += sample.sine * weight;
        sums.2 += sample.cosine * weight;
        sums.3 += weight;
    }
    let x = sums.0 / sums.3;
    Means {
        x,
        spread: spread(squares / sums.3, &x),
        sine: sums.1 / sums.3,
        cosine: sums.2 / sums.3,
    }
}

/// The residual is |X − B|² − Lb², of numbers of about 1.
pub(crate) fn rows_squared<'a, T: Real>(samples: impl Iterator<Item = (&'a ArmSample<T>, T)>) -> T {
    let mut sum = T::ZERO;
    for (sample, root) in samples {
        sum += (sample.weight * root).squared() * (T::ONE + sample.constraint.squared());
    }
    sum
}
