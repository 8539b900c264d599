//! What a session is begun with, as the core has it.

use crate::messages::{Begin, Fault};
use delta_cal::calibration::Start;
use delta_cal::stream::{Forgetting, Selection, StreamCalibrator, StreamOptions};
use delta_cal::{Noise, Real, Robot, Settings, Tolerance};

impl<T: Real> Begin<T> {
    /// The calibrator that this begins: the same on the controller and on whoever compares with it.
    ///
    /// # Errors
    /// [`Fault::Settings`].
    pub fn calibrator(&self, nominal: &Robot<T>) -> Result<StreamCalibrator<T>, Fault> {
        if self.session == 0 {
            return Err(Fault::Settings);
        }
        StreamCalibrator::new(nominal, &self.settings()?, &self.options()?)
            .map_err(|_| Fault::Settings)
    }

    fn settings(&self) -> Result<Settings<T>, Fault> {
        let tolerance = tolerance(self.tolerance)?;
        let noise = self
            .noise
            .map(|(position, joint)| Noise::by_axis(position, joint))
            .transpose()
            .map_err(|_| Fault::Settings)?;
        Ok(Settings::default()
            .with_noise(noise)
            .with_tolerance(tolerance)
            .with_start(if self.without_guess {
                Start::Free
            } else {
                Start::Nominal
            }))
    }

    fn options(&self) -> Result<StreamOptions<T>, Fault> {
        let forgetting = self
            .forgetting
            .map(Forgetting::new)
            .transpose()
            .map_err(|_| Fault::Settings)?;
        let selection = match (self.held_out, self.gate) {
            (Some(every), false) if forgetting.is_none() => Selection::HeldOut {
                every: u64::from(every),
            },
            (Some(_), _) => return Err(Fault::Settings),
            (None, true) => Selection::Gated { forgetting },
            (None, false) => Selection::All { forgetting },
        };
        Ok(StreamOptions {
            estimator: self.estimator,
            selection,
        })
    }
}

/// One σ of lengths and angles, as the core has it.
pub(crate) fn tolerance<T: Real>(stated: Option<(T, T)>) -> Result<Option<Tolerance<T>>, Fault> {
    stated
        .map(|(length, angle)| Tolerance::new(length, angle))
        .transpose()
        .map_err(|_| Fault::Settings)
}
