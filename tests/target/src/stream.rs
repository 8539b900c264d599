//! Samples one after the other: the gate and forgetting, to the bit.

use crate::fixture::{Scalar, record};
use crate::measurements::{measured, robot_near, tolerance};
use crate::measurements::{noise, nominal};
use core::fmt::{self, Write};
use delta_cal::calibration::{Ikm, Progress};
use delta_cal::stream::{Forgetting, Innovation, Selection, StreamCalibrator, Verdict};
use delta_cal::{ArmIndex, IkmCalibrator, Robot, Sample, Settings};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

const ROBOTS: u64 = 4;
/// Before and after the robot has changed.
const SAMPLES: (usize, usize) = (50, 20);

/// Several robots that change, every eleventh sample wrong.
#[inline(never)]
pub(crate) fn run<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    for seed in 0..ROBOTS {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near::<T>(&nominal(), 1.0, &mut rng);
        let changed = robot_near::<T>(&truth, 1.0, &mut rng);
        let settings = Settings::default()
            .with_noise((seed % 3 != 1).then(noise))
            .with_tolerance((seed % 2 == 0).then(tolerance));
        let memory = (seed == 3).then(|| Forgetting::new(T::from_f64(20.0)).expect("a memory"));
        gated(
            out,
            seed,
            &settings,
            memory,
            &truth,
            &changed,
            &mut rng.clone(),
        )?;
        forgetting(out, seed, &settings, &truth, &mut rng)?;
    }
    Ok(())
}

#[inline(never)]
fn gated<T: Scalar>(
    out: &mut dyn Write,
    seed: u64,
    settings: &Settings<T>,
    memory: Option<Forgetting<T>>,
    truth: &Robot<T>,
    changed: &Robot<T>,
    rng: &mut Pcg32,
) -> fmt::Result {
    let selection = Selection {
        gated: true,
        forgetting: memory,
    };
    let mut stream = StreamCalibrator::<T, Ikm>::new(&nominal::<T>(), settings, &selection);
    for index in 0..SAMPLES.0 + SAMPLES.1 {
        let robot = if index < SAMPLES.0 { truth } else { changed };
        let Some(mut sample) = measured(robot, Some(&noise()), rng) else {
            continue;
        };
        // Not among the first twelve, from which the gate begins where nothing is stated.
        if index % 11 == 10 && index > 12 {
            sample.position.x += T::from_f64(5.0);
        }
        match stream.add(&sample).expect("finite numbers") {
            Verdict::Ungated => continue,
            untested @ (Verdict::NoEstimate | Verdict::NoNoise) => {
                record::<T>(out, format_args!("gate {seed} {index} {untested:?}"), &[])?;
            }
            Verdict::Taken(innovation) => {
                recorded(out, format_args!("gate {seed} {index} taken"), &innovation)?;
            }
            Verdict::Rejected(innovation) => {
                recorded(
                    out,
                    format_args!("gate {seed} {index} rejected"),
                    &innovation,
                )?;
            }
        }
        while stream.step() == Progress::Working {}
    }
    record::<T>(
        out,
        format_args!(
            "gate {seed} {:?} {:?}",
            stream.gate_counts(),
            stream.alarm()
        ),
        &[],
    )
}

fn recorded<T: Scalar>(
    out: &mut dyn Write,
    what: fmt::Arguments<'_>,
    innovation: &Innovation<T>,
) -> fmt::Result {
    record(
        out,
        format_args!("{what} {}", innovation.arm),
        &[innovation.distance, innovation.normalized],
    )
}

#[inline(never)]
fn forgetting<T: Scalar>(
    out: &mut dyn Write,
    seed: u64,
    settings: &Settings<T>,
    truth: &Robot<T>,
    rng: &mut Pcg32,
) -> fmt::Result {
    let memory = Forgetting::new(T::from_f64(30.0)).expect("a memory");
    let mut calibrator = IkmCalibrator::new(&nominal::<T>(), settings);
    for _ in 0..200 {
        let Some(sample): Option<Sample<T>> = measured(truth, Some(&noise()), rng) else {
            continue;
        };
        calibrator
            .add_forgetting(&sample, &memory)
            .expect("finite numbers");
    }
    match calibrator.calibrate() {
        Err(refusal) => record::<T>(out, format_args!("forgetting {seed} {refusal:?}"), &[]),
        Ok(outcome) => {
            for (arm, index) in outcome.robot.arms().iter().zip(ArmIndex::ALL) {
                record(
                    out,
                    format_args!("forgetting {seed} {index}"),
                    arm.parameters().as_slice(),
                )?;
            }
            Ok(())
        }
    }
}
