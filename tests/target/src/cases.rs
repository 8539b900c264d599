//! Calibrations drawn at random: any number of samples, every kind of assumption, and the faults
//! that must be refused.

use crate::fixture::Scalar;
use crate::fixture::calibrations::Written;
use crate::measurements::{measured, robot_near, tolerance};
use crate::measurements::{noise, nominal};
use core::fmt;
use crc::{CRC_64_XZ, Crc, Digest, NoTable};
use delta_cal::calibration::{ArmOutcome, Calibrator, Estimator, Ikm, Joint};
use delta_cal::simulate::{simulate_sample, standard_normal};
use delta_cal::{ArmIndex, Noise, Real, Robot, Sample, Settings};
use heapless::Vec;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// The most samples of a case.
pub const MOST_SAMPLES: usize = 100;
const COUNTS: [usize; 16] = [
    2,
    5,
    7,
    8,
    9,
    10,
    11,
    12,
    13,
    16,
    18,
    20,
    25,
    33,
    60,
    MOST_SAMPLES,
];
const CRC: Crc<u64, NoTable> = Crc::<u64, NoTable>::new(&CRC_64_XZ);

/// What is wrong with the samples of a case, or with what is said about them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    None,
    /// The noise is thirty times as large as stated.
    NoiseUnderstated,
    /// The noise is stated as 20 mm.
    NoiseOverstated,
    /// Every sample was taken at the same pose.
    OnePose,
    /// All poses lie within a degree or so.
    Cluster,
    /// One sample is 20 mm off.
    Outlier,
    /// The positions are in metres, the robot in millimetres.
    WrongUnit,
    /// z of the positions points down.
    UpsideDown,
    /// The first two joints are exchanged.
    JointsExchanged,
    /// The origin of the positions is 1 km away.
    FarOrigin,
    /// Every third sample has a number that is not finite, or in degrees.
    FaultyNumbers,
    /// Far from nominal, and no more than two linearisations are allowed.
    FewIterations,
}

/// Faults by a draw of four bits: a third of all cases has none.
const FAULTS: [Fault; 16] = [
    Fault::None,
    Fault::None,
    Fault::None,
    Fault::None,
    Fault::None,
    Fault::NoiseUnderstated,
    Fault::NoiseOverstated,
    Fault::OnePose,
    Fault::Cluster,
    Fault::Outlier,
    Fault::WrongUnit,
    Fault::UpsideDown,
    Fault::JointsExchanged,
    Fault::FarOrigin,
    Fault::FaultyNumbers,
    Fault::FewIterations,
];

/// One calibration.
#[derive(Debug, Clone)]
pub struct Case<T: Real> {
    /// The robot before calibration.
    pub nominal: Robot<T>,
    /// What is assumed.
    pub settings: Settings<T>,
    /// What is wrong.
    pub fault: Fault,
    /// The measurements.
    pub samples: Vec<Sample<T>, MOST_SAMPLES>,
}

impl<T: Real> Case<T> {
    /// The case of a number.
    #[inline(never)]
    pub fn draw(seed: u64) -> Self {
        let mut rng = Pcg32::seed_from_u64(seed);
        let mut bits = rng.next_u32();
        let mut draw = |choices: usize| {
            let (chosen, rest) = (bits as usize % choices, bits as usize / choices);
            bits = u32::try_from(rest).unwrap_or(0);
            chosen
        };
        let count = COUNTS.get(draw(16)).copied().unwrap_or(MOST_SAMPLES);
        let fault = FAULTS.get(draw(16)).copied().unwrap_or(Fault::None);
        let noisy = draw(4) > 0;
        let mut settings = Settings::default()
            .with_noise((draw(2) == 0).then(noise))
            .with_tolerance((draw(3) == 0).then(tolerance))
            .with_damping(draw(8) != 0)
            .with_free_start(draw(4) == 0);
        let far_from_nominal = draw(8) == 0 || fault == Fault::FewIterations;
        match fault {
            Fault::NoiseOverstated => {
                settings.noise = Noise::new(T::from_f64(20.0), T::ZERO).ok();
            }
            Fault::NoiseUnderstated => {
                let thirtieth = T::from_f64(1.0 / 30.0);
                let true_noise = noise::<T>();
                settings.noise = Noise::new(
                    true_noise.position() * thirtieth,
                    true_noise.joint() * thirtieth,
                )
                .ok();
            }
            Fault::FewIterations => settings.iteration_limit = 2,
            _ => {}
        }

        let nominal = nominal::<T>();
        let spread = if far_from_nominal { 10.0 } else { 1.0 };
        let truth = robot_near(&nominal, spread, &mut rng);
        let noise = (noisy || fault == Fault::NoiseUnderstated).then(noise);
        let mut samples = Vec::new();
        while samples.len() < count {
            let sample = match (fault, samples.first()) {
                (Fault::OnePose, Some(first)) => {
                    simulated(&truth, first, T::ZERO, noise.as_ref(), &mut rng)
                }
                (Fault::Cluster, Some(first)) => {
                    let spread = T::from_f64(0.01);
                    simulated(&truth, first, spread, noise.as_ref(), &mut rng)
                }
                _ => measured(&truth, noise.as_ref(), &mut rng),
            };
            if samples.extend_from_slice(sample.as_slice()).is_err() {
                break;
            }
        }
        for (index, sample) in samples.iter_mut().enumerate() {
            spoil(fault, index, sample);
        }
        Self {
            nominal,
            settings,
            fault,
            samples,
        }
    }

    /// A calibrator with the samples of the case, and how many of them it refused.
    #[inline(never)]
    pub fn calibrator<E: Estimator>(&self) -> (Calibrator<T, E>, usize) {
        let mut calibrator = Calibrator::new(&self.nominal, &self.settings);
        let mut refused = 0;
        for sample in &self.samples {
            refused += usize::from(calibrator.add(sample).is_err());
        }
        (calibrator, refused)
    }
}

/// A sample near the pose of another.
fn simulated<T: Real>(
    truth: &Robot<T>,
    near: &Sample<T>,
    spread: T,
    noise: Option<&Noise<T>>,
    rng: &mut Pcg32,
) -> Option<Sample<T>> {
    let joints = near
        .joints
        .map(|q| q + spread * standard_normal::<T, _>(rng));
    simulate_sample(truth, &joints, noise, rng).ok()
}

fn spoil<T: Real>(fault: Fault, index: usize, sample: &mut Sample<T>) {
    let [q1, q2, q3] = sample.joints;
    match fault {
        Fault::WrongUnit => sample.position *= T::from_f64(1e-3),
        Fault::UpsideDown => sample.position.z = -sample.position.z,
        Fault::JointsExchanged => sample.joints = [q2, q1, q3],
        Fault::FarOrigin => sample.position.x += T::from_f64(1e6),
        Fault::Outlier if index == 2 => sample.position.z += T::from_f64(20.0),
        Fault::FaultyNumbers => match index % 12 {
            2 => sample.position.y = T::from_f64(f64::NAN),
            5 => sample.joints = [q1, T::INFINITY, q3],
            8 => sample.joints = [q1, q2, T::from_f64(45.0)],
            11 => sample.position.x = T::from_f64(1e30),
            _ => {}
        },
        _ => {}
    }
}

/// Writes one line a case, `CASE <scalar>-<estimator> <number> <fault> <samples> <hash> <result>`: the result
/// is `accepted` or the refusal in words, the hash a CRC-64 over all bits of the samples and of
/// everything that came out. Fewer in double precision, which a Cortex-M4F computes in software.
///
/// # Errors
/// Those of `out`.
pub fn write(out: &mut dyn fmt::Write) -> fmt::Result {
    run::<f32, Ikm>(out, 1000)?;
    run::<f32, Joint>(out, 100)?;
    run::<f64, Ikm>(out, 50)?;
    run::<f64, Joint>(out, 10)
}

fn run<T: Scalar, E: Written>(out: &mut dyn fmt::Write, cases: u64) -> fmt::Result {
    for seed in 0..cases {
        case::<T, E>(out, seed)?;
    }
    Ok(())
}

#[inline(never)]
fn case<T: Scalar, E: Written>(out: &mut dyn fmt::Write, seed: u64) -> fmt::Result {
    let case = Case::<T>::draw(seed);
    let mut hash = Hash(CRC.digest());
    for sample in &case.samples {
        hash.numbers(&sample.joints);
        hash.numbers(sample.position.as_slice());
    }
    let (mut calibrator, refused) = case.calibrator::<E>();
    hash.count(refused as u64);
    let result = calibrator.calibrate();
    if let Ok(outcome) = &result {
        hash.outcome::<T, E>(outcome);
    }
    write!(
        out,
        "CASE {}-{} {seed} {:?} {} {:016x} ",
        T::NAME,
        E::NAME,
        case.fault,
        case.samples.len(),
        hash.0.finalize(),
    )?;
    match result {
        Ok(_) => writeln!(out, "accepted"),
        // The figures of a refusal are single-precision numbers; `{:?}` writes each so that it
        // reads back to the same bits.
        Err(refusal) => writeln!(out, "{refusal:?}"),
    }
}

struct Hash(Digest<'static, u64, NoTable>);

impl Hash {
    fn count(&mut self, count: u64) {
        self.0.update(&count.to_le_bytes());
    }

    fn numbers<T: Scalar>(&mut self, numbers: &[T]) {
        for number in numbers {
            // All NaN are one: the sign of a NaN is the platform's.
            let nan = number.partial_cmp(number).is_none();
            self.count(if nan { 0 } else { number.bits() });
        }
    }

    fn outcome<T: Scalar, E: Estimator>(&mut self, outcome: &E::Outcome<T>) {
        for (arm, index) in E::robot(outcome).arms().iter().zip(ArmIndex::ALL) {
            self.numbers(arm.parameters().as_slice());
            self.arm(&E::arm(outcome, index));
        }
    }

    fn arm<T: Scalar>(&mut self, outcome: &ArmOutcome<T>) {
        self.numbers(outcome.arm.parameters().as_slice());
        self.count(u64::from(outcome.covariance.is_some()));
        if let Some(covariance) = &outcome.covariance {
            self.numbers(covariance.as_slice());
        }
        self.numbers(outcome.prior_share.as_slice());
        self.count(u64::from(outcome.estimated_noise.is_some()));
        self.numbers(outcome.estimated_noise.as_slice());
        self.numbers(&[
            outcome.residual_rms,
            outcome.degrees_of_freedom,
            outcome.condition,
        ]);
        self.count(outcome.samples);
        self.count(u64::from(outcome.iterations));
        self.count(outcome.termination as u64);
        self.count(outcome.start as u64);
    }
}
