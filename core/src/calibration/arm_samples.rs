//! Accumulated samples of each arm separately.

use super::parts::Samples;
use super::settings::Settings;
use crate::Real;
use crate::robot::{ArmIndex, Drive, Robot};
use crate::samples::{
    ArmFactor, BLOCK, Forgetting, MergeError, NominalArm, Sample, SampleError, Waiting,
};
use crate::state::state;
use nalgebra::Vector3;

/// Every sample is absorbed into three 13 × 13 triangular factors and discarded. Samples added singly wait until they
/// form a block of four or are needed; the factors absorb their blocks at different samples, so that every call of
/// [`add`](Samples::add) is short.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSamples<T: Real> {
    settings: Settings<T>,
    pub(crate) arms: [ArmFactor<T>; 3],
    pub(crate) waiting: Waiting<T>,
}

state!(ArmSamples<T>: arms: [ArmFactor<T>; 3], waiting: Waiting<T>);

/// The origin for positions, within the workspace: the platform at equal joint angles, or with the carriages a
/// forearm's length up.
#[inline(never)]
pub(super) fn workspace_centre<T: Real>(robot: &Robot<T>) -> Vector3<T> {
    let [first, ..] = robot.arms();
    if robot.drive() == Drive::Linear
        && let Ok(x) = robot.forward(&[first.lb(); 3])
    {
        return x;
    }
    for degrees in [20.0_f32, 0.0, 45.0, -20.0, 70.0] {
        let q = T::from_f64(f64::from(degrees)) * (T::PI / T::from_f64(180.0));
        if let Ok(x) = robot.forward(&[q; 3]) {
            return x;
        }
    }
    let [first, second, third] = robot.arms();
    (first.d() + second.d() + third.d() - robot.up() * first.lb()) / T::from_f64(3.0)
}

/// The nominal arms, relative to which the samples are expressed.
struct NominalArms<'a, T: Real> {
    robot: &'a Robot<T>,
    centre: Vector3<T>,
    settings: &'a Settings<T>,
}

impl<'a, T: Real> NominalArms<'a, T> {
    fn new(robot: &'a Robot<T>, settings: &'a Settings<T>) -> Self {
        Self {
            robot,
            centre: workspace_centre(robot),
            settings,
        }
    }

    fn of(&self, arm: ArmIndex) -> NominalArm<T> {
        NominalArm::new(self.robot.arm(arm), &self.centre, self.settings.noise)
    }
}

impl<T: Real> Samples<T> for ArmSamples<T> {
    #[inline]
    fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        let nominal_arms = NominalArms::new(robot, settings);
        // Not by `map`, which would build the three factors elsewhere and move them.
        Self {
            settings: *settings,
            arms: [
                ArmFactor::new(nominal_arms.of(ArmIndex::First)),
                ArmFactor::new(nominal_arms.of(ArmIndex::Second)),
                ArmFactor::new(nominal_arms.of(ArmIndex::Third)),
            ],
            waiting: Waiting::none(),
        }
    }

    fn reset(&mut self) {
        for factor in &mut self.arms {
            factor.clear();
        }
        self.waiting = Waiting::none();
    }

    fn check(&self, sample: &Sample<T>) -> Result<(), SampleError> {
        sample.check(self.drive())?;
        let joints = sample.joints.into_iter().zip(ArmIndex::ALL);
        for (factor, (q, arm)) in self.arms.iter().zip(joints) {
            factor.nominal().check(&sample.position, q, arm)?;
        }
        Ok(())
    }

    /// The sample waits for three others and is absorbed together with them.
    fn push(&mut self, sample: &Sample<T>) {
        self.waiting.push(sample);
        if let Some(arm) = self.waiting.due() {
            self.take_in_block(arm);
        }
    }

    fn push_forgetting(&mut self, sample: &Sample<T>, forgetting: &Forgetting<T>) {
        self.waiting.push(sample);
        let due = self.waiting.due();
        for (factor, arm) in self.arms.iter_mut().zip(ArmIndex::ALL) {
            // Samples absorbed by a solve must be forgotten too.
            if due == Some(arm) || factor.recent() >= 2 * BLOCK as u64 {
                factor.forget(forgetting.after(factor.recent()));
            }
        }
        if let Some(arm) = due {
            self.take_in_block(arm);
        }
    }

    fn take_in(&mut self, samples: &[Sample<T>]) {
        for (factor, arm) in self.arms.iter_mut().zip(ArmIndex::ALL) {
            let own = samples
                .iter()
                .map(|sample| (&sample.position, sample.joints[arm.index()]));
            factor.absorb_many(own);
        }
    }

    #[inline(never)]
    fn flush(&mut self) {
        for arm in ArmIndex::ALL {
            self.take_in_waiting_of(arm);
        }
    }

    fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if self.nominal_arms() != other.nominal_arms() {
            return Err(MergeError::DifferentNominal);
        }
        let mut other = other.clone();
        other.flush();
        for (factor, other) in self.arms.iter_mut().zip(&other.arms) {
            factor.merge(other)?;
        }
        Ok(())
    }

    fn forget(&mut self, lambda: T) {
        for factor in &mut self.arms {
            factor.forget(lambda);
        }
    }

    fn count(&self) -> u64 {
        let [first, ..] = &self.arms;
        first.samples() + self.waiting.waiting_for(ArmIndex::First) as u64
    }

    fn robot(&self) -> Robot<T> {
        Robot::of_valid(self.nominal_arms().map(|nominal| *nominal.arm()))
    }

    fn settings(&self) -> &Settings<T> {
        &self.settings
    }

    fn nominal_arms(&self) -> [&NominalArm<T>; 3] {
        let [first, second, third] = &self.arms;
        [first.nominal(), second.nominal(), third.nominal()]
    }
}

impl<T: Real> ArmSamples<T> {
    fn drive(&self) -> Drive {
        let [first, ..] = &self.arms;
        first.nominal().arm().drive()
    }

    /// The factors of the three arms; they exclude waiting samples.
    pub(crate) const fn arms(&self) -> &[ArmFactor<T>; 3] {
        &self.arms
    }

    pub(crate) fn take_in_waiting_of(&mut self, arm: ArmIndex) {
        while self.waiting.waiting_for(arm) > 0 {
            self.take_in_block(arm);
        }
    }

    #[inline(never)]
    pub(crate) fn take_in_block(&mut self, arm: ArmIndex) {
        if let Some(factor) = self.arms.get_mut(arm.index()) {
            T::absorb_block(factor, &self.waiting, arm);
        }
        self.waiting.take(arm);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::calibration::IkmCalibrator;
    use crate::calibration::Settings;
    use crate::robot::{Arm, Robot, SymmetricRobot};
    use crate::samples::{Noise, Sample};
    use nalgebra::{SMatrix, SVector, Vector3};
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    const COUNT: usize = 40;
    const NOISE: (f64, f64) = (0.05, 2e-4);

    fn samples(built: &Robot<f64>) -> [Sample<f64>; COUNT] {
        let mut rng = Pcg32::seed_from_u64(5);
        let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
        [(); COUNT].map(|()| {
            let joints = [0.3 + uniform(), 0.3 + uniform(), 0.3 + uniform()];
            let off = Vector3::new(uniform(), uniform(), uniform()) * 0.1;
            let position = built.forward(&joints).unwrap() + off;
            Sample { joints, position }
        })
    }

    /// Gauss–Newton iteration on all samples at once, by a singular value decomposition of a finite-difference
    /// Jacobian: the arm, its covariance (JᵀJ)⁻¹ and Σ r².
    fn fit(
        nominal: &Arm<f64>,
        samples: &[(Vector3<f64>, f64); COUNT],
        sigma: impl Fn(&Vector3<f64>, f64) -> f64,
    ) -> (SVector<f64, 8>, SMatrix<f64, 8, 8>, f64) {
        let residuals = |parameters: &SVector<f64, 8>| {
            let arm = Arm::new((*parameters).into()).unwrap();
            let rows = samples.map(|(x, q)| arm.constraint(&x, q) / sigma(&x, q));
            SVector::<f64, COUNT>::from(rows)
        };
        let mut parameters = SVector::from(nominal.parameters());
        let mut covariance = SMatrix::zeros();
        for _ in 0..12 {
            let mut jacobian = SMatrix::<f64, COUNT, 8>::zeros();
            for parameter in 0..8 {
                let mut by = SVector::<f64, 8>::zeros();
                by[parameter] = 1e-4;
                let difference = residuals(&(parameters + by)) - residuals(&(parameters - by));
                jacobian.set_column(parameter, &(difference / 2e-4));
            }
            let inverse = jacobian.svd(true, true).pseudo_inverse(0.0).unwrap();
            parameters -= inverse * residuals(&parameters);
            covariance = inverse * inverse.transpose();
        }
        (
            parameters,
            covariance,
            residuals(&parameters).norm_squared(),
        )
    }

    /// The factor of all samples gives the same parameters and covariance as a fit of the stored samples, with and
    /// without a stated noise.
    #[test]
    fn a_calibration_is_the_least_squares_fit_of_all_samples() {
        let drawn = SymmetricRobot::<f64>::PAPER;
        let built = SymmetricRobot {
            base_radius: drawn.base_radius + 0.4,
            upper_arm: drawn.upper_arm - 0.3,
            forearm: drawn.forearm + 0.5,
            ..drawn
        };
        let (drawn, built) = (drawn.robot().unwrap(), built.robot().unwrap());
        let samples = samples(&built);
        let (position, joint) = NOISE;
        for noise in [Some(Noise::new(position, joint).unwrap()), None] {
            let settings = Settings::new().with_noise(noise);
            let mut calibrator = IkmCalibrator::new(&drawn, &settings);
            for sample in &samples {
                calibrator.add(sample).unwrap();
            }
            let outcome = calibrator.calibrate().unwrap();
            for (index, (nominal, found)) in drawn.arms().iter().zip(&outcome.arms).enumerate() {
                let own = samples.map(|sample| (sample.position, sample.joints[index]));
                let along = 2.0 * nominal.lb();
                let (expected, mut covariance, squares) = fit(nominal, &own, |x, q| match noise {
                    Some(_) => {
                        libm::hypot(along * position, nominal.constraint_by_joint(x, q) * joint)
                    }
                    None => along,
                });
                if noise.is_none() {
                    // Student's t with 32 degrees of freedom.
                    covariance *= squares / 30.0;
                }
                let found_covariance = found.covariance.unwrap();
                let sigma = covariance.diagonal().map(libm::sqrt);
                for i in 0..8 {
                    let off = found.arm.parameters()[i] - expected[i];
                    assert!(off.abs() < 1e-5 * sigma[i], "{off:e} of {:e}", sigma[i]);
                    for j in 0..8 {
                        let off = found_covariance[(i, j)] - covariance[(i, j)];
                        assert!(off.abs() < 1e-3 * sigma[i] * sigma[j], "{off:e}");
                    }
                }
                let rms = libm::sqrt(squares / f64::from(u8::try_from(COUNT).unwrap()));
                assert!((found.residual_rms / rms - 1.0).abs() < 1e-6);
            }
        }
    }
}
