//! What came of a calibration, in one word.

use delta_cal::Refusal;
use serde::Serialize;

/// Whether a robot was calibrated, or why not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub(super) struct Status(&'static str);

impl Status {
    pub(super) const ACCEPTED: Self = Self("accepted");
    /// A sample is out of all proportion.
    pub(super) const FAULTY_SAMPLE: Self = Self("faulty_sample");
    /// The start error makes no robot, or one without usable poses.
    pub(super) const NO_ROBOT: Self = Self("no_robot");

    pub(super) const fn name(self) -> &'static str {
        self.0
    }

    pub(super) const fn of(refusal: &Refusal) -> Self {
        Self(match refusal {
            Refusal::TooFewSamples { .. } => "too_few_samples",
            Refusal::Undetermined { .. } => "undetermined",
            Refusal::Uncertain { .. } => "uncertain",
            Refusal::NotConverged { .. } => "not_converged",
            Refusal::ResidualContradictsNoise { .. } => "residual_contradicts_noise",
            Refusal::FarFromNominal { .. } => "far_from_nominal",
            Refusal::ImpossibleGeometry { .. } => "impossible_geometry",
            Refusal::ImpossibleRobot(_) => "impossible_robot",
            Refusal::WrongSide => "wrong_side",
            Refusal::NonFinite { .. } => "non_finite",
            Refusal::TooFewObservations { .. } => "too_few_observations",
            Refusal::UndeterminedInstrument(_) => "undetermined_instrument",
            _ => "refused",
        })
    }
}
