//! One run through the core. Host and target write the same lines, to the bit.

mod joint;
mod results;
mod robust;

use crate::measurements::{noise, nominal, samples};
use crate::record::{Scalar, record};
use crate::simulation::{measured, robot_near, tolerance};
use core::fmt::{self, Write};
use delta_cal::calibration::{ArmProblem, RobotCalibrator, Solver, Start};
use delta_cal::classical::StoredCalibrator;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::KinematicsError;
use delta_cal::{ArmIndex, Calibrator, Noise, Sample, Settings};
use nalgebra::{RealField, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
#[cfg(feature = "linear")]
pub(crate) use results::{accepted, refused};
#[cfg(not(feature = "linear"))]
use results::{accepted, refused};

/// Simulated robots, the first of them with too few samples.
const ROBOTS: [usize; 16] = [5, 8, 9, 10, 11, 12, 13, 14, 16, 18, 20, 24, 28, 32, 40, 60];

/// Writes one line a result, `BITS <scalar> <what>: <bits> …`, in both precisions. A refusal is written in words.
///
/// # Errors
/// Those of `out`.
pub fn write(out: &mut dyn Write) -> fmt::Result {
    run::<f32>(out)?;
    run::<f64>(out)
}

fn run<T: Scalar + RealField>(out: &mut dyn Write) -> fmt::Result {
    functions::<T>(out)?;
    kinematics::<T>(out)?;
    frame::<T>(out)?;
    built_in_data::<T>(out)?;
    assumptions::<T>(out)?;
    stored::<T>(out)?;
    robust::run::<T>(out)?;
    joint::run::<T>(out)?;
    refusals::<T>(out)?;
    simulation::<T>(out)?;
    crate::stream::run::<T>(out)
}

/// The elementary functions over their ranges.
#[inline(never)]
fn functions<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    for step in -40_i16..=40 {
        let x = T::from_f64(f64::from(step) * 0.377);
        let (sine, cosine) = x.sine_cosine();
        let angle = sine.angle_over(cosine);
        let positive = x.squared() + T::HALF;
        record(
            out,
            format_args!("functions {step}"),
            &[
                sine,
                cosine,
                angle,
                positive.square_root(),
                positive.inverse_square_root(),
                positive.natural_logarithm(),
                x.nearest_integer(),
                positive.power_of_two_below(),
            ],
        )?;
    }
    Ok(())
}

/// Forward, inverse and both Jacobians across and beyond the workspace.
#[inline(never)]
fn kinematics<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    let robot = nominal::<T>();
    let angle = |degrees: f64| T::from_f64(degrees.to_radians());
    let fault = |out: &mut dyn Write, what: &str, error: KinematicsError| {
        record::<T>(out, format_args!("{what} {error:?}"), &[])
    };
    for (q1, q2, q3) in [
        (0.0, 0.0, 0.0),
        (10.0, 20.0, 30.0),
        (-60.0, -60.0, -60.0),
        (90.0, 90.0, 90.0),
        (-45.0, 60.0, 15.0),
        (75.0, -20.0, 40.0),
        (90.0, -60.0, -60.0),
        (-90.0, -90.0, -90.0),
        (180.0, 180.0, 180.0),
        (f64::NAN, 0.0, 0.0),
        (0.0, f64::INFINITY, 0.0),
    ] {
        let q = [angle(q1), angle(q2), angle(q3)];
        match robot.forward(&q) {
            Err(error) => fault(out, "forward", error)?,
            Ok(x) => {
                record(out, format_args!("forward {q1} {q2} {q3}"), x.as_slice())?;
                match robot.platform_jacobian(&x, &q) {
                    Err(error) => fault(out, "jacobian", error)?,
                    Ok(jacobian) => {
                        record(out, format_args!("joints"), jacobian.by_joints.as_slice())?;
                        for block in &jacobian.by_parameters {
                            record(out, format_args!("parameters"), block.as_slice())?;
                        }
                    }
                }
            }
        }
    }
    for (x, y, z) in [
        (0.0, 0.0, -450.0),
        (20.0, -30.0, -500.0),
        (-180.0, 90.0, -620.0),
        (0.0, 0.0, -700.0),
        (0.0, 0.0, -2000.0),
        (600.0, 0.0, -400.0),
        (164.0, 0.0, -50.0),
        // Upper arm and forearm of the first arm in line.
        (904.0, 0.0, 0.0),
        (0.0, f64::NAN, -450.0),
    ] {
        match robot.inverse(&Vector3::new(x, y, z).map(T::from_f64)) {
            Err(error) => fault(out, "inverse", error)?,
            Ok(q) => record(out, format_args!("inverse {x} {y} {z}"), &q)?,
        }
    }
    // All forearms in one plane.
    match robot.platform_jacobian(&Vector3::zeros(), &[T::ZERO; 3]) {
        Err(error) => fault(out, "jacobian", error),
        Ok(jacobian) => record(out, format_args!("flat"), jacobian.by_joints.as_slice()),
    }
}

/// The rigid transform between the measured points and the nominal robot's.
#[inline(never)]
fn frame<T: Scalar + RealField>(out: &mut dyn Write) -> fmt::Result {
    let robot = nominal::<T>();
    let measured = samples::<T>();
    let pairs = measured.iter().filter_map(|sample| {
        let own = robot.forward(&sample.joints).ok()?;
        Some((sample.position, own))
    });
    match RigidTransform::align(pairs) {
        Err(error) => record::<T>(out, format_args!("align {error:?}"), &[]),
        Ok(transform) => {
            record(out, format_args!("rotation"), transform.rotation.as_slice())?;
            record(
                out,
                format_args!("translation"),
                transform.translation.as_slice(),
            )
        }
    }
}

/// The built-in data: one by one, at once, in two halves, half forgotten.
#[inline(never)]
fn built_in_data<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    let samples = samples::<T>();
    let settings = Settings::default().with_noise(noise());
    let empty = Calibrator::new(&nominal::<T>(), &settings);

    let mut calibrator = empty;
    add_each(out, &mut calibrator, &samples)?;
    solve(out, format_args!("one by one"), &mut calibrator)?;

    calibrator = empty;
    add_at_once(out, &mut calibrator, &samples)?;
    solve(out, format_args!("at once"), &mut calibrator)?;

    let (left, right) = samples.split_at(samples.len() / 2);
    calibrator = empty;
    add_at_once(out, &mut calibrator, left)?;
    let mut other = empty;
    add_at_once(out, &mut other, right)?;
    if let Err(error) = calibrator.merge(&other) {
        record::<T>(out, format_args!("merge {error:?}"), &[])?;
    }
    solve(out, format_args!("merged"), &mut calibrator)?;

    calibrator.forget(T::from_f64(0.9));
    add_at_once(out, &mut calibrator, left)?;
    solve(out, format_args!("after forgetting"), &mut calibrator)
}

/// Every way to state what is known.
#[inline(never)]
fn assumptions<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    let samples = samples::<T>();
    let defaults = Settings::default();
    let noise = Some(noise());
    let tolerance = Some(tolerance());
    for (label, count, settings) in [
        ("no assumptions", samples.len(), defaults),
        ("no guess", samples.len(), defaults.with_start(Start::Free)),
        (
            "no guess, noise",
            16,
            defaults.with_start(Start::Free).with_noise(noise),
        ),
        (
            "tolerance and noise",
            12,
            defaults.with_noise(noise).with_tolerance(tolerance),
        ),
        ("tolerance", 12, defaults.with_tolerance(tolerance)),
        (
            "tolerance, few samples",
            3,
            defaults.with_noise(noise).with_tolerance(tolerance),
        ),
        (
            "Gauss-Newton",
            samples.len(),
            defaults.with_noise(noise).with_solver(Solver::GaussNewton),
        ),
    ] {
        let mut calibrator = Calibrator::new(&nominal::<T>(), &settings);
        add_at_once(out, &mut calibrator, &samples[..count])?;
        solve(out, format_args!("{label}"), &mut calibrator)?;
    }
    Ok(())
}

/// The form that keeps its samples, filled until it refuses one.
#[inline(never)]
fn stored<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    let settings = Settings::default().with_noise(noise());
    let mut calibrator = StoredCalibrator::<T, 24>::new(&nominal(), &settings);
    for (index, sample) in samples::<T>().iter().enumerate() {
        if let Err(error) = calibrator.add(sample) {
            record::<T>(out, format_args!("stored {index} {error:?}"), &[])?;
        }
    }
    solve(out, format_args!("stored"), &mut calibrator)
}

/// Samples and sets of samples that must be refused.
#[inline(never)]
fn refusals<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    let [first, ..] = samples::<T>();
    let [q1, q2, q3] = first.joints;
    let (nan, far) = (T::from_f64(f64::NAN), T::from_f64(1e3));
    let mut calibrator = Calibrator::new(&nominal::<T>(), &Settings::default());
    add_each(
        out,
        &mut calibrator,
        &[
            Sample {
                joints: [q1, nan, q3],
                ..first
            },
            Sample {
                joints: [q1, q2, T::INFINITY],
                ..first
            },
            Sample {
                joints: [far, q2, q3],
                ..first
            },
            Sample {
                position: Vector3::new(nan, T::ZERO, T::ZERO),
                ..first
            },
            Sample {
                position: Vector3::new(T::ZERO, T::ZERO, T::INFINITY),
                ..first
            },
        ],
    )?;
    solve(out, format_args!("no sample"), &mut calibrator)?;

    add_each(out, &mut calibrator, &[first; 20])?;
    solve(out, format_args!("one pose"), &mut calibrator)?;

    let optimistic = Settings::default()
        .with_noise(Noise::new(T::from_f64(1e-3), T::from_f64(1e-6)).expect("a noise"));
    calibrator = Calibrator::new(&nominal::<T>(), &optimistic);
    add_at_once(out, &mut calibrator, &samples::<T>())?;
    solve(out, format_args!("contradicted noise"), &mut calibrator)
}

/// Robots drawn, measured and calibrated on board.
#[inline(never)]
fn simulation<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    for (seed, count) in (0_u64..).zip(ROBOTS) {
        let mut rng = Pcg32::seed_from_u64(seed);
        let truth = robot_near::<T>(&nominal(), 1.0, &mut rng);
        for (arm, index) in truth.arms().iter().zip(ArmIndex::ALL) {
            record(
                out,
                format_args!("robot {seed} {index} truth"),
                arm.parameters().as_slice(),
            )?;
        }
        // Every other robot is measured without noise, every third has a prior.
        let noise = (seed % 2 == 0).then(noise);
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance((seed % 3 == 1).then(|| tolerance()));
        let mut calibrator = Calibrator::new(&nominal::<T>(), &settings);
        for _ in 0..count {
            let Some(sample) = measured(&truth, noise.as_ref(), &mut rng) else {
                record::<T>(out, format_args!("robot {seed} has no pose"), &[])?;
                continue;
            };
            add_each(out, &mut calibrator, &[sample])?;
        }
        solve(
            out,
            format_args!("robot {seed}, {count} samples"),
            &mut calibrator,
        )?;
    }
    Ok(())
}

#[inline(never)]
fn add_each<T: Scalar>(
    out: &mut dyn Write,
    calibrator: &mut Calibrator<T>,
    samples: &[Sample<T>],
) -> fmt::Result {
    for sample in samples {
        if let Err(error) = calibrator.add(sample) {
            record::<T>(out, format_args!("sample {error:?}"), &[])?;
        }
    }
    Ok(())
}

#[inline(never)]
fn add_at_once<T: Scalar>(
    out: &mut dyn Write,
    calibrator: &mut Calibrator<T>,
    samples: &[Sample<T>],
) -> fmt::Result {
    match calibrator.add_many(samples) {
        Ok(()) => Ok(()),
        Err((index, error)) => record::<T>(out, format_args!("sample {index} {error:?}"), &[]),
    }
}

#[inline(never)]
fn solve<T: Scalar, P: ArmProblem<T>>(
    out: &mut dyn Write,
    label: fmt::Arguments<'_>,
    calibrator: &mut RobotCalibrator<T, P>,
) -> fmt::Result {
    match calibrator.solve() {
        Ok(outcome) => accepted(out, label, &outcome),
        Err(refusal) => refused::<T>(out, label, &refusal),
    }
}
