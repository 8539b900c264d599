//! The parts of a problem whose samples are stored: sums over rows of the Jacobian (3.21).

use crate::Real;
use crate::calibration::{Means, Normal, spread};
use crate::samples::{ArmSample, Displacement};
use nalgebra::Vector3;

/// Rows reduced together.
const BLOCK: usize = 8;

pub(crate) fn linearize<T: Real>(
    samples: &[ArmSample<T>],
    at: &Displacement<T>,
    normal: &mut Normal<T>,
) -> T {
    let mut sum = T::ZERO;
    for some in samples.chunks(BLOCK) {
        let mut block = [[T::ZERO; BLOCK]; 9];
        for (index, sample) in some.iter().enumerate() {
            let (row, constraint) = at.constraint_row(sample);
            for (column, value) in block.iter_mut().zip(row.iter().chain([&constraint])) {
                if let Some(entry) = column.get_mut(index) {
                    *entry = *value;
                }
            }
            sum += constraint.squared();
        }
        normal.absorb(&mut block);
    }
    sum
}

pub(crate) fn sum_of_squares<T: Real>(samples: &[ArmSample<T>], at: &Displacement<T>) -> T {
    let mut sum = T::ZERO;
    for sample in samples {
        sum += at.weighted_constraint(sample).squared();
    }
    sum
}

pub(crate) fn means<T: Real>(samples: &[ArmSample<T>]) -> Means<T> {
    let mut sums = (Vector3::zeros(), T::ZERO, T::ZERO, T::ZERO);
    let mut squares = T::ZERO;
    for sample in samples {
        let weight = sample.weight.squared();
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
pub(crate) fn rows_squared<T: Real>(samples: &[ArmSample<T>]) -> T {
    let mut sum = T::ZERO;
    for sample in samples {
        sum += sample.weight.squared() * (T::ONE + sample.constraint.squared());
    }
    sum
}
