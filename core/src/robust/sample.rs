use crate::Real;

/// What a robust fit makes of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedSample<T> {
    /// ψ(d)/d.
    pub(super) weight: T,
    /// By what the sample's squared residuals are multiplied.
    pub(crate) factor: T,
    /// d = |W f|, in σ or in units of length.
    pub(crate) distance: T,
    /// How many residuals it has; one without any is passed over.
    pub(crate) dimensions: u8,
    pub(super) suspected: bool,
    /// Whether the start looks at it.
    pub(super) starting: bool,
}

impl<T: Real> WeighedSample<T> {
    /// A place that holds no sample.
    pub const fn vacant() -> Self {
        Self {
            weight: T::ONE,
            factor: T::ONE,
            distance: T::ZERO,
            dimensions: 3,
            suspected: false,
            starting: true,
        }
    }

    /// What the sample counts in the fit, 0 to 1.
    pub const fn weight(&self) -> T {
        self.weight
    }

    /// By what its squared residuals are multiplied in the fit: its weight over κ of
    /// [`WeightNormalization`](super::WeightNormalization).
    pub const fn factor(&self) -> T {
        self.factor
    }

    /// How far the sample is off: the length of its whitened residuals, in σ of the stated noise or
    /// of the one estimated from the residuals. Of good samples with three residuals it is 1.5 in the median.
    pub const fn residual(&self) -> T {
        self.distance
    }

    /// Whether the sample is wrong: its residual is beyond what the loss counts.
    pub const fn suspected(&self) -> bool {
        self.suspected
    }
}
