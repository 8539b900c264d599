use super::limits::SAMPLES_FOR_FREE_START;
use super::tolerance::Tolerance;
use crate::Real;
use crate::robot::Drive;
use crate::samples::Noise;
use crate::snapshot::Fingerprint;

/// What a calibration assumes and how it is solved. Default: no noise weights, no prior, Levenberg–Marquardt from the
/// nominal robot, at most 50 iterations.
///
/// ```
/// use delta_cal::{Noise, Settings, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// const QUICK: Settings<f32> = Settings::new().with_iteration_limit(15);
/// let settings = QUICK
///     .with_noise(Noise::new(0.02, 0.0)?)
///     .with_tolerance(Tolerance::new(0.5, 0.003)?);
/// assert!(settings.damped && settings.iteration_limit == 15);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Settings<T> {
    /// Measurement noise: weights the samples and tests the residuals. Without it the tolerance tests them.
    pub noise: Option<Noise<T>>,
    /// Manufacturing tolerance: the prior about the nominal robot.
    pub tolerance: Option<Tolerance<T>>,
    /// Whether a step is damped until it reduces the sum of squares (Levenberg 1944, Marquardt 1963). Otherwise it is
    /// always the full step of the linearised problem (Gauss–Newton), which can diverge, and reports this.
    pub damped: bool,
    /// Whether to start from the linear fit of c(P), without an initial guess, which needs 12 samples. Otherwise from the
    /// nominal robot; if the result then fits worse than it should and there are 12 or more samples, the free start is
    /// tried as well.
    pub free_start: bool,
    /// Most linearisations per start, at least 1; a solve may make several starts.
    pub iteration_limit: u16,
}

impl<T: Real> Default for Settings<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Settings<T> {
    /// The default settings; usable in a constant.
    pub const fn new() -> Self {
        Self {
            noise: None,
            tolerance: None,
            damped: true,
            free_start: false,
            iteration_limit: 50,
        }
    }

    /// Sets the measurement noise; `None` if it is unknown.
    pub fn with_noise(mut self, noise: impl Into<Option<Noise<T>>>) -> Self {
        self.noise = noise.into();
        self
    }

    /// Sets the manufacturing tolerance; `None` for no prior.
    pub fn with_tolerance(mut self, tolerance: impl Into<Option<Tolerance<T>>>) -> Self {
        self.tolerance = tolerance.into();
        self
    }

    /// Levenberg–Marquardt, or Gauss–Newton.
    pub const fn with_damping(mut self, damped: bool) -> Self {
        self.damped = damped;
        self
    }

    /// Free, or from the nominal robot.
    pub const fn with_free_start(mut self, free_start: bool) -> Self {
        self.free_start = free_start;
        self
    }

    /// Sets the limit of linearisations per start; 0 changes nothing.
    pub const fn with_iteration_limit(mut self, iteration_limit: u16) -> Self {
        if iteration_limit > 0 {
            self.iteration_limit = iteration_limit;
        }
        self
    }

    /// Everything a gate's predictions depend on apart from its calibrator's samples, for robots with this drive.
    pub(crate) fn mark_prior(&self, drive: Drive, fingerprint: &mut Fingerprint) {
        let places = drive.places();
        fingerprint.optional(self.tolerance.map(|tolerance| {
            places.map(|parameter| parameter.map_or(T::ZERO, |parameter| tolerance.of(parameter)))
        }));
        if let Some(zero) = self.tolerance.and_then(|own| own.joint_zero()) {
            fingerprint.number(zero);
        }
        if drive == Drive::Linear {
            fingerprint.optional(self.tolerance.map(|own| [own.radius(), own.forearm()]));
        }
    }

    /// Number of samples a calibration with these settings needs: 8, 12 with a free start, 1 with a tolerance.
    pub(crate) const fn samples_needed(&self) -> u64 {
        match (self.free_start, &self.tolerance) {
            (true, _) => SAMPLES_FOR_FREE_START,
            (false, None) => 8,
            (false, Some(_)) => 1,
        }
    }
}
