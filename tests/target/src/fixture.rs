//! One run through the core. Host and target write the same lines, to the bit.

pub(crate) mod calibrations;

use crate::measurements::{nominal, samples};
use core::fmt::{self, Write};
use delta_cal::frame::RigidTransform;
use delta_cal::{ArmIndex, Real, Refusal, Robot, RobotOutcome};
use nalgebra::{RealField, Vector3};

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
    calibrations::run::<T>(out)?;
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
        pose(out, &robot, &[q1, q2, q3].map(angle))?;
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
        inverse(out, &robot, &Vector3::new(x, y, z).map(T::from_f64))?;
    }
    // All forearms in one plane.
    jacobian(out, &robot, &Vector3::zeros(), &[T::ZERO; 3])
}

/// The platform at these joints, and what follows from it.
#[inline(never)]
pub(crate) fn pose<T: Scalar>(out: &mut dyn Write, robot: &Robot<T>, q: &[T; 3]) -> fmt::Result {
    match robot.forward(q) {
        Err(error) => record::<T>(out, format_args!("forward {error:?}"), &[]),
        Ok(x) => {
            record(out, format_args!("forward"), x.as_slice())?;
            inverse(out, robot, &x)?;
            jacobian(out, robot, &x, q)
        }
    }
}

#[inline(never)]
pub(crate) fn inverse<T: Scalar>(
    out: &mut dyn Write,
    robot: &Robot<T>,
    x: &Vector3<T>,
) -> fmt::Result {
    match robot.inverse(x) {
        Err(error) => record::<T>(out, format_args!("inverse {error:?}"), &[]),
        Ok(q) => record(out, format_args!("inverse"), &q),
    }
}

#[inline(never)]
fn jacobian<T: Scalar>(
    out: &mut dyn Write,
    robot: &Robot<T>,
    x: &Vector3<T>,
    q: &[T; 3],
) -> fmt::Result {
    match robot.platform_jacobian(x, q) {
        Err(error) => record::<T>(out, format_args!("jacobian {error:?}"), &[]),
        Ok(jacobian) => {
            record(out, format_args!("joints"), jacobian.by_joints.as_slice())?;
            for block in &jacobian.by_parameters {
                record(out, format_args!("parameters"), block.as_slice())?;
            }
            Ok(())
        }
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
        None => record::<T>(out, format_args!("not aligned"), &[]),
        Some(transform) => {
            record(out, format_args!("rotation"), transform.rotation.as_slice())?;
            record(
                out,
                format_args!("translation"),
                transform.translation.as_slice(),
            )
        }
    }
}

/// A scalar whose bits can be compared.
pub trait Scalar: Real {
    /// `f32` or `f64`.
    const NAME: &'static str;
    /// How many hexadecimal digits its bits take.
    const DIGITS: usize;

    /// Its bits, zero-extended.
    fn bits(self) -> u64;
}

impl Scalar for f32 {
    const NAME: &'static str = "f32";
    const DIGITS: usize = 8;

    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }
}

impl Scalar for f64 {
    const NAME: &'static str = "f64";
    const DIGITS: usize = 16;

    fn bits(self) -> u64 {
        self.to_bits()
    }
}

/// Writes `BITS <scalar> <label>: <bits> <bits> …`, one line.
pub(crate) fn record<T: Scalar>(
    out: &mut dyn fmt::Write,
    label: fmt::Arguments<'_>,
    values: &[T],
) -> fmt::Result {
    write!(out, "BITS {} {label}:", T::NAME)?;
    for value in values {
        write!(out, " {:0width$x}", value.bits(), width = T::DIGITS)?;
    }
    out.write_char('\n')
}

#[inline(never)]
pub(crate) fn accepted<T: Scalar>(
    out: &mut dyn Write,
    label: fmt::Arguments<'_>,
    outcome: &RobotOutcome<T>,
) -> fmt::Result {
    for (arm, index) in outcome.arms.iter().zip(ArmIndex::ALL) {
        let mut line =
            |what: &str, values: &[T]| record(out, format_args!("{label}, {index} {what}"), values);
        line("parameters", arm.arm.parameters().as_slice())?;
        line("prior share", arm.prior_share.as_slice())?;
        if let Some(covariance) = &arm.covariance {
            line("covariance", covariance.as_slice())?;
        }
        if let Some(noise) = arm.estimated_noise {
            line("noise", &[noise])?;
        }
        line("residual", &[arm.residual_rms])?;
        line("degrees of freedom", &[arm.degrees_of_freedom])?;
        line("condition", &[arm.condition])?;
        record::<T>(
            out,
            format_args!(
                "{label}, {index} {} samples, {} iterations, {:?}, {:?}",
                arm.samples, arm.iterations, arm.termination, arm.start
            ),
            &[],
        )?;
    }
    Ok(())
}

/// The figures of a refusal are single-precision numbers; `{:?}` writes each so that it reads back
/// to the same bits.
pub(crate) fn refused<T: Scalar>(
    out: &mut dyn Write,
    label: fmt::Arguments<'_>,
    refusal: &Refusal,
) -> fmt::Result {
    record::<T>(out, format_args!("{label}, {refusal:?}"), &[])
}
