//! Samples one after the other: the gate, held-out validation, forgetting.

use core::mem::MaybeUninit;
use delta_cal::calibration::limits::{chi_square_bound, variance_ratio_bound};
use delta_cal::samples::{MergeError, SampleError};
use delta_cal::stream::{
    Alarm, Forgetting, ForgettingError, Gate, GateCounts, GateError, HeldOut, HeldOutRefusal,
    Innovation, Untested, Validation, Verdict,
};
use delta_cal::{ArmIndex, Calibrator, RobotOutcome, Sample};

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                fn calibrator_check(
                    calibrator: &Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    calibrator.check(sample)
                }

                // The gate
                fn gate_new(calibrator: &mut Calibrator<$t>) -> Gate<$t> { Gate::new(calibrator) }
                fn gate_with_sigmas(gate: &Gate<$t>, sigmas: $t) -> Result<Gate<$t>, GateError> {
                    gate.with_sigmas(sigmas)
                }
                fn gate_with_forgetting(gate: &Gate<$t>, forgetting: &Forgetting<$t>) -> Gate<$t> {
                    gate.with_forgetting(*forgetting)
                }
                fn gate_add(
                    gate: &mut Gate<$t>,
                    calibrator: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<Verdict<$t>, SampleError> {
                    gate.add(calibrator, sample)
                }
                fn gate_innovations(
                    gate: &Gate<$t>,
                    calibrator: &Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<[Innovation<$t>; 3], Untested> {
                    gate.innovations(calibrator, sample)
                }
                fn gate_wants_estimate(gate: &Gate<$t>) -> bool { gate.wants_estimate() }
                fn gate_adopt(
                    gate: &mut Gate<$t>,
                    calibrator: &mut Calibrator<$t>,
                    outcome: &RobotOutcome<$t>,
                ) -> () {
                    gate.adopt(calibrator, outcome);
                }
                fn gate_counts(gate: &Gate<$t>) -> GateCounts { *gate.counts() }
                fn gate_alarm(gate: &Gate<$t>) -> Option<Alarm> { gate.alarm() }

                // Held-out validation
                fn held_out_new(
                    calibrator: &Calibrator<$t>,
                    every: u64,
                ) -> Result<HeldOut<$t>, HeldOutRefusal> {
                    HeldOut::new(calibrator, every)
                }
                fn held_out_add(
                    held_out: &mut HeldOut<$t>,
                    calibrator: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<bool, SampleError> {
                    held_out.add(calibrator, sample)
                }
                fn held_out_validate(
                    held_out: &mut HeldOut<$t>,
                    calibrator: &mut Calibrator<$t>,
                    outcome: &RobotOutcome<$t>,
                ) -> Result<[Validation<$t>; 3], HeldOutRefusal> {
                    held_out.validate(calibrator, outcome)
                }
                fn held_out_samples(held_out: &HeldOut<$t>) -> u64 { held_out.samples() }
                fn held_out_merge_into(
                    held_out: &HeldOut<$t>,
                    calibrator: &mut Calibrator<$t>,
                ) -> Result<(), MergeError> {
                    held_out.merge_into(calibrator)
                }
                fn bound_of_chi_square(freedom: $t, deviations: $t) -> $t {
                    chi_square_bound(freedom, deviations)
                }
                fn bound_of_variance_ratio(
                    numerator: $t,
                    denominator: $t,
                    deviations: $t,
                ) -> Option<$t> {
                    variance_ratio_bound(numerator, denominator, deviations)
                }

                // Forgetting
                fn forgetting_new(samples: $t) -> Result<Forgetting<$t>, ForgettingError> {
                    Forgetting::new(samples)
                }
                fn forgetting_mean_age(forgetting: &Forgetting<$t>) -> $t { forgetting.mean_age() }
                fn forgetting_factor(forgetting: &Forgetting<$t>) -> $t {
                    forgetting.factor()
                }
                fn calibrator_add_forgetting(
                    calibrator: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                    forgetting: &Forgetting<$t>,
                ) -> Result<(), SampleError> {
                    calibrator.add_forgetting(sample, forgetting)
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);

symbols! { "any_";
    fn alarm_first(alarm: &Alarm) -> u64 { alarm.first() }
    fn held_out_refusal_arm(refusal: &HeldOutRefusal) -> Option<ArmIndex> { refusal.arm() }
}
