//! Residuals that are too large to be noise, stated or not.

use super::explain::Explainer;
use crate::calibration::advice::CHECK;
use crate::calibration::noise_test::NoiseTest;
use crate::calibration::reason::Refused;
use crate::text::numbers::significant;

impl Explainer<'_> {
    /// Without a stated noise, residuals that the tolerance does not explain.
    pub(super) fn noise_beyond_tolerance(&self, test: &NoiseTest) -> Refused {
        let tolerated = test
            .tolerated
            .map_or_else(String::new, |value| significant(value, 3));
        let cause = format!(
            "no [noise] is stated, and if the residuals were all noise, it would be {} in each \
             coordinate. But the stated [tolerance] lets the robot be off by only {tolerated} mm. \
             Such samples say nothing about the robot, and the result would be the robot file \
             itself{}",
            test.estimate(),
            self.unmodelled()
        );
        let remedy = format!(
            "{CHECK}; look for wrong samples; if the robot really is that far off, state a larger \
             [tolerance]; if the sensor really is that noisy, state the [noise]"
        );
        self.refused(&cause, self.mend_first(remedy))
    }

    /// What noise the residuals would be, if they were all noise.
    pub(super) fn residuals_say(&self, ratio: f64) -> String {
        let samples = u32::try_from(self.case.samples.count()).map_or(f64::INFINITY, f64::from);
        let per_sample = if self.case.options.method.separates_arms() {
            1.0
        } else {
            3.0
        };
        let parameters = if self.case.robot.tolerance.is_some() {
            0.0
        } else {
            8.0
        };
        // As the refusal counted them.
        let freedom = (per_sample * (samples - parameters)).max(1.0);
        self.case.robot.noise.as_ref().map_or(String::new(), |noise| {
            let test = NoiseTest::against(noise, ratio, freedom, None);
            test.map_or(String::new(), |test| {
                format!(
                    ": {}. With the noise as stated every sigma would come out {ratio:.1} times too \
                     small",
                    test.found(noise)
                )
            })
        })
    }
}
