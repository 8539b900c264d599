//! Samples of one arm: their noise, the factor that they are taken into, the store that keeps them.

use core::mem::MaybeUninit;
use delta_cal::classical::{StoredArmSamples, StoredError};
use delta_cal::robot::{Arm, Drive};
use delta_cal::samples::{ArmFactor, MergeError, NoiseError, NominalArm, SampleError};
use delta_cal::{ArmIndex, Noise, Sample};
use nalgebra::Vector3;

/// What the form that keeps its samples holds here.
pub(super) const STORED: usize = 24;

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                // Noise
                fn noise_new(position: $t, joint: $t) -> Result<Noise<$t>, NoiseError> {
                    Noise::new(position, joint)
                }
                fn noise_position(noise: &Noise<$t>) -> $t { noise.position() }
                fn noise_joint(noise: &Noise<$t>) -> $t { noise.joint() }

                // Samples
                fn sample_check(sample: &Sample<$t>, drive: Drive) -> Result<(), SampleError> {
                    sample.check(drive)
                }
                fn nominal_arm_new(
                    arm: &Arm<$t>,
                    centre: &Vector3<$t>,
                    noise: Option<&Noise<$t>>,
                ) -> NominalArm<$t> {
                    NominalArm::new(arm, centre, noise.copied())
                }
                fn nominal_arm_arm(nominal: &NominalArm<$t>) -> Arm<$t> { *nominal.arm() }
                fn nominal_arm_noise(nominal: &NominalArm<$t>) -> Option<Noise<$t>> {
                    nominal.noise().copied()
                }
                fn nominal_arm_scale(nominal: &NominalArm<$t>) -> $t { nominal.scale() }
                fn nominal_arm_centre(nominal: &NominalArm<$t>) -> Vector3<$t> {
                    *nominal.centre()
                }
                fn factor_new(nominal: &NominalArm<$t>) -> ArmFactor<$t> {
                    ArmFactor::new(*nominal)
                }
                fn factor_nominal_arm(factor: &ArmFactor<$t>) -> NominalArm<$t> {
                    *factor.nominal()
                }
                fn factor_samples(factor: &ArmFactor<$t>) -> u64 { factor.samples() }
                fn factor_effective_samples(factor: &ArmFactor<$t>) -> $t {
                    factor.effective_samples()
                }
                fn factor_add(
                    factor: &mut ArmFactor<$t>,
                    x: &Vector3<$t>,
                    q: $t,
                    arm: ArmIndex,
                ) -> Result<(), SampleError> {
                    factor.add(x, q, arm)
                }
                fn factor_add_many(
                    factor: &mut ArmFactor<$t>,
                    samples: &[(Vector3<$t>, $t); 40],
                    count: usize,
                    arm: ArmIndex,
                ) -> Result<(), (usize, SampleError)> {
                    let samples = samples.iter().take(count);
                    factor.add_many(samples.map(|(x, q)| (x, *q)), arm)
                }
                fn factor_merge(
                    factor: &mut ArmFactor<$t>,
                    other: &ArmFactor<$t>,
                ) -> Result<(), MergeError> {
                    factor.merge(other)
                }
                fn factor_forget(factor: &mut ArmFactor<$t>, lambda: $t) -> () {
                    factor.forget(lambda);
                }
                fn factor_sum_of_squares(factor: &ArmFactor<$t>, arm: &Arm<$t>) -> $t {
                    factor.sum_of_squares(arm)
                }
                fn stored_new(nominal: &NominalArm<$t>) -> StoredArmSamples<$t, STORED> {
                    StoredArmSamples::new(*nominal)
                }
                fn stored_nominal_arm(stored: &StoredArmSamples<$t, STORED>) -> NominalArm<$t> {
                    *stored.nominal()
                }
                fn stored_len(stored: &StoredArmSamples<$t, STORED>) -> usize { stored.len() }
                fn stored_is_empty(stored: &StoredArmSamples<$t, STORED>) -> bool {
                    stored.is_empty()
                }
                fn stored_add(
                    stored: &mut StoredArmSamples<$t, STORED>,
                    x: &Vector3<$t>,
                    q: $t,
                    arm: ArmIndex,
                ) -> Result<(), StoredError> {
                    stored.add(x, q, arm)
                }
                fn stored_check(
                    stored: &StoredArmSamples<$t, STORED>,
                    x: &Vector3<$t>,
                    q: $t,
                    arm: ArmIndex,
                ) -> Result<(), StoredError> {
                    stored.check(x, q, arm)
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32);
of_scalar!(double, "f64_", f64);
