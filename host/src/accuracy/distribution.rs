//! How the errors of many samples are distributed.

use crate::accuracy::position_error::SampleErrors;
use crate::accuracy::sampled::Histogram;

/// How all samples of a report are distributed that shows some of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// How many the robust fit does not count.
    pub suspected: usize,
    /// How many count less than half.
    pub counting_little: usize,
    /// Of the position errors after the calibration, mm.
    pub after: Histogram,
    /// Of the same in σ of the noise, if that is known.
    pub after_in_sigmas: Option<Histogram>,
}

impl Sampled {
    pub(crate) fn of(samples: &[SampleErrors]) -> Self {
        let count = |is: fn(&SampleErrors) -> bool| samples.iter().filter(|own| is(own)).count();
        let sigmas = samples.iter().map(|sample| sample.after_in_sigmas);
        Self {
            suspected: count(|sample| sample.weight.suspected),
            counting_little: count(SampleErrors::counts_little),
            after: Histogram::of(samples.iter().map(|sample| sample.after)),
            after_in_sigmas: sigmas
                .clone()
                .any(|value| value.is_some())
                .then(|| Histogram::of(sigmas)),
        }
    }
}
