//! One run through what the core computes of linear drives. Host and target write the same lines, to the bit.

use crate::fixture::calibrations::{Written, add_each, solve};
use crate::fixture::{Scalar, accepted, inverse, pose, record, refused};
use core::fmt::{self, Write};
use delta_cal::calibration::{Calibrator, Ikm, Joint, Settings};
use delta_cal::kinematics::JointLimits;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationProblem,
    ObservationRow, Plane,
};
use delta_cal::simulate::{made_robot, random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Parameter, Real, Robot, RobotOutcome, Sample, Tolerance};
use heapless::Vec;
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// Radius and rod, mm, and the range of the travel.
const PRINTERS: [([f64; 2], [f64; 2]); 3] = [
    ([140.0, 330.0], [100.0, 600.0]),
    ([80.0, 180.0], [50.0, 350.0]),
    ([120.0, 700.0], [300.0, 1200.0]),
];
/// Samples of the simulated robots, the first too few.
const ROBOTS: [usize; 8] = [2, 7, 8, 10, 12, 20, 33, 60];
/// Robot and plane.
const N: usize = 27;
const ROWS: usize = 24;

/// Writes one line a result, `BITS <scalar> <what>: <bits> …`, in both precisions. A refusal is written in words.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// If the limits stated here are none.
pub fn write(out: &mut dyn Write) -> fmt::Result {
    run::<f32>(out)?;
    run::<f64>(out)
}

fn run<T: Scalar>(out: &mut dyn Write) -> fmt::Result {
    for (number, (lengths, travel)) in (0..).zip(PRINTERS) {
        let nominal = printer::<T>(lengths);
        let limits = JointLimits::travel(T::from_f64(travel[0]), T::from_f64(travel[1]))
            .expect("the limits are valid");
        kinematics(out, &nominal, travel)?;
        for (count, seed) in ROBOTS.into_iter().zip(200 + 100 * number..) {
            calibrations(out, &nominal, &limits, (seed, count))?;
        }
        observations(out, &nominal, &limits, 290 + 100 * number)?;
    }
    Ok(())
}

fn printer<T: Real>([tower_radius, forearm]: [f64; 2]) -> Robot<T> {
    Robot::linear(T::from_f64(tower_radius), T::from_f64(forearm), None)
        .expect("the dimensions are a robot's")
}

fn noise<T: Real>() -> Noise<T> {
    Noise::new(T::from_f64(0.02), T::from_f64(0.005)).expect("the numbers are a noise")
}

/// With a radius that the towers have in common.
fn tolerance<T: Real>(radius: f64) -> Tolerance<T> {
    let number = T::from_f64;
    Tolerance::new(number(0.5), number(3e-3))
        .and_then(|own| {
            own.with(Parameter::Zero, number(5.0))?
                .with(Parameter::Scale, number(1e-3))
        })
        .and_then(|own| own.with_radius(number(radius)))
        .expect("the numbers are a tolerance")
}

/// Forward, inverse and both Jacobians across and beyond the workspace.
#[inline(never)]
fn kinematics<T: Scalar>(
    out: &mut dyn Write,
    robot: &Robot<T>,
    [low, high]: [f64; 2],
) -> fmt::Result {
    for (s1, s2, s3) in [
        (0.5, 0.5, 0.5),
        (0.4, 0.5, 0.6),
        (0.1, 0.12, 0.08),
        (0.9, 0.8, 0.85),
        (0.0, 1.0, 0.0),
        (1.0, 1.0, 0.0),
        (f64::NAN, 0.5, 0.5),
        (0.5, f64::INFINITY, 0.5),
    ] {
        let q = [s1, s2, s3].map(|part| T::from_f64(low + part * (high - low)));
        pose(out, robot, &q)?;
    }
    inverse(out, robot, &Vector3::new(1e3, 0.0, 100.0).map(T::from_f64))
}

/// A robot drawn, measured and calibrated on board, arm by arm and jointly.
#[inline(never)]
fn calibrations<T: Scalar>(
    out: &mut dyn Write,
    nominal: &Robot<T>,
    limits: &JointLimits<T>,
    (seed, count): (u64, usize),
) -> fmt::Result {
    let mut rng = Pcg32::seed_from_u64(seed);
    let radius = if seed.is_multiple_of(2) { 3.0 } else { 0.0 };
    let Ok(truth) = made_robot(nominal, &tolerance(radius), &mut rng) else {
        return record::<T>(out, format_args!("tower {seed}, no robot"), &[]);
    };
    // Every third robot is measured without noise, every fourth has no prior.
    let noise = (seed % 3 > 0).then(noise);
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance((seed % 4 > 0).then(|| tolerance(radius)))
        .with_free_start(seed % 8 == 6);
    let mut samples = Vec::<Sample<T>, 60>::new();
    for _ in 0..count {
        let pose = random_pose(&truth, limits, &mut rng);
        let sample = pose
            .and_then(|pose| simulate_sample(&truth, &pose.joints, noise.as_ref(), &mut rng).ok());
        if samples.extend_from_slice(sample.as_slice()).is_err() {
            break;
        }
    }
    solved::<T, Ikm>(out, nominal, &settings, (seed, &samples))?;
    solved::<T, Joint>(out, nominal, &settings, (seed, &samples))
}

#[inline(never)]
fn solved<T: Scalar, E: Written>(
    out: &mut dyn Write,
    nominal: &Robot<T>,
    settings: &Settings<T>,
    (seed, samples): (u64, &[Sample<T>]),
) -> fmt::Result {
    let mut calibrator = Calibrator::<T, E>::new(nominal, settings);
    add_each(out, &mut calibrator, samples)?;
    solve(
        out,
        format_args!("{}, towers {seed}", E::NAME),
        &mut calibrator,
    )
}

/// Touches of a plate and distances between two poses, by turns.
#[inline(never)]
fn observations<T: Scalar>(
    out: &mut dyn Write,
    nominal: &Robot<T>,
    limits: &JointLimits<T>,
    seed: u64,
) -> fmt::Result {
    let mut rng = Pcg32::seed_from_u64(seed);
    let Ok(truth) = made_robot(nominal, &tolerance(3.0), &mut rng) else {
        return record::<T>(out, format_args!("tower {seed}, no robot"), &[]);
    };
    let mut rows = Vec::<ObservationRow<T>, ROWS>::new();
    while rows.len() < ROWS {
        let poses = [(); 2].map(|()| random_pose(&truth, limits, &mut rng));
        let [Some(pose), Some(other)] = poses else {
            return record::<T>(out, format_args!("tower {seed}, no pose"), &[]);
        };
        let mut row = Observation::at(pose.joints);
        let off = T::from_f64(0.05) * standard_normal::<T, _>(&mut rng);
        if rows.len().is_multiple_of(2) {
            let height = pose.position.z + off;
            row.height = Some(Height { plane: 0, height });
        } else {
            let apart = pose.position - other.position;
            row.distance = Some(Distance {
                from: DistanceFrom::Pose(other.joints),
                distance: apart.dot(&apart).square_root() + off,
            });
        }
        if rows.push(ObservationRow::new(row)).is_err() {
            break;
        }
    }
    let number = T::from_f64;
    let noise = ObservationNoise::new(noise(), number(0.05), number(0.05));
    let instruments = Instruments {
        planes: &[Plane::default()],
        ..Instruments::new(noise.expect("the numbers are a noise"))
    };
    let settings = Settings::new().with_tolerance(tolerance(3.0));
    let problem = match ObservationProblem::<T, N>::prepare(nominal, &instruments, &mut rows) {
        Ok(problem) => problem,
        Err(error) => return record::<T>(out, format_args!("touched {seed}, {error:?}"), &[]),
    };
    match problem.solve(&settings) {
        Err(refusal) => refused::<T>(out, format_args!("touched {seed}"), &refusal),
        Ok(outcome) => {
            record(
                out,
                format_args!("touched {seed}, unknowns"),
                outcome.unknowns(),
            )?;
            let of_robot = RobotOutcome::from(&outcome.of_robot());
            accepted(out, format_args!("touched {seed}"), &of_robot)
        }
    }
}
