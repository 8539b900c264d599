use super::limits::SAMPLES_FOR_FREE_START;
use super::tolerance::Tolerance;
use crate::Real;
use crate::robot::Drive;
use crate::samples::Noise;
use crate::snapshot::Fingerprint;

/// How a step is computed from the linearised problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Solver {
    /// Always the full step of the linearised problem. It can diverge, and reports this.
    GaussNewton,
    /// Damped until the step reduces the sum of squares (Levenberg 1944, Marquardt 1963).
    #[default]
    LevenbergMarquardt,
}

/// Where the iteration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Start {
    /// From the nominal robot. If the result fits worse than it should and there are 12 or more samples, the free start
    /// is tried as well.
    #[default]
    Nominal,
    /// From the linear fit of c(P), without an initial guess. Needs 12 samples.
    Free,
}

/// What a calibration assumes and how it is solved. Default: no noise weights, no prior, Levenberg–Marquardt from the
/// nominal robot, at most 50 iterations.
///
/// ```
/// use delta_cal::calibration::{Settings, Solver};
/// use delta_cal::{Noise, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// const QUICK: Settings<f32> = Settings::new().with_iteration_limit(15);
/// let settings = QUICK
///     .with_noise(Noise::new(0.02, 0.0)?)
///     .with_tolerance(Tolerance::new(0.5, 0.003)?);
/// assert_eq!(settings.solver, Solver::LevenbergMarquardt);
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
    /// Gauss–Newton or Levenberg–Marquardt.
    pub solver: Solver,
    /// Where to start.
    pub start: Start,
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
            solver: Solver::LevenbergMarquardt,
            start: Start::Nominal,
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

    /// Sets the solver.
    pub const fn with_solver(mut self, solver: Solver) -> Self {
        self.solver = solver;
        self
    }

    /// Sets the start.
    pub const fn with_start(mut self, start: Start) -> Self {
        self.start = start;
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
        #[cfg(feature = "linear")]
        if drive == Drive::Linear {
            fingerprint.optional(self.tolerance.map(|own| [own.radius(), own.forearm()]));
        }
    }

    /// Number of samples a calibration with these settings needs: 8, 12 with a free start, 1 with a tolerance.
    pub const fn samples_needed(&self) -> u64 {
        match (self.start, &self.tolerance) {
            (Start::Free, _) => SAMPLES_FOR_FREE_START,
            (Start::Nominal, None) => 8,
            (Start::Nominal, Some(_)) => 1,
        }
    }
}
