//! The joint calibration: all 24 parameters together from the closures of all three arms, whitened by
//! the covariance that they share. The calibration itself is the core's.

use crate::fit::ikm;
use crate::fit::options::Frame;
use crate::fit::outcome::Outcome;
use crate::fit::samples::Samples;
use crate::fit::weights::Weights;
use delta_cal::calibration::{
    Estimate, FreeFrame, JointCalibrator, JointOutcome, Minimizer, Motion, Problem, Progress,
    Start, StartUsed, TolerancePrior,
};
use delta_cal::samples::{JointFactor, SampleError};
use delta_cal::{ArmIndex, Refusal, Robot, Sample, Settings, Tolerance};

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration.
///
/// # Errors
/// Every [`Refusal`] of the core's joint calibration.
///
/// ```
/// use delta_cal::{Sample, Settings, SymmetricRobot};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..nominal }.robot()?;
/// let mut samples = Vec::new();
/// for k in 0..20 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     samples.push(Sample { joints, position: truth.forward(&joints)? });
/// }
/// let outcome = delta_cal_host::fit::joint::calibrate(&nominal.robot()?, &samples, &Settings::default())?;
/// assert!((outcome.fit.robot.arms()[2].lb() - 479.1).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub fn calibrate(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<Outcome, Refusal> {
    calibrate_weighted(robot, samples.into(), None, settings, Frame::Base)
}

/// The same of samples that count as a robust fit or a stream has them. In the sensor's frame the samples
/// are in the frame in which the robot nearly stands, and its place is estimated as well.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_weighted(
    robot: &Robot<f64>,
    samples: Samples<'_>,
    weights: Option<&Weights>,
    settings: &Settings<f64>,
    frame: Frame,
) -> Result<Outcome, Refusal> {
    let collected = factor(robot, samples, weights, settings)?;
    let solved = solve(&collected, robot, settings, frame);
    if settings.start == Start::Free
        && let Err(Refusal::Undetermined { .. }) = solved
    {
        return from_arms(samples, weights, settings, frame, robot);
    }
    Ok(Outcome::from(solved?))
}

/// Few distinct joint angles determine the 24 parameters and not the 36 coefficients of the linear start:
/// each arm by itself has other starts, and the arms are a start for all.
fn from_arms(
    samples: Samples<'_>,
    weights: Option<&Weights>,
    settings: &Settings<f64>,
    frame: Frame,
    robot: &Robot<f64>,
) -> Result<Outcome, Refusal> {
    let arms = ikm::calibrate_weighted(robot, samples, weights, settings)?;
    let found = arms.fit.robot;
    let settings = settings.with_start(Start::Nominal);
    let factor = factor(&found, samples, weights, &settings)?;
    let mut outcome = solve(&factor, &found, &settings, frame)?;
    outcome.estimate.start = StartUsed::Free;
    Ok(Outcome::from(outcome))
}

/// By how much the frame of the samples is off the one in which the robot's parameters are nearest to
/// nominal.
///
/// # Errors
/// As [`calibrate`].
pub fn frame_motion(
    robot: &Robot<f64>,
    samples: Samples<'_>,
    weights: Option<&Weights>,
    settings: &Settings<f64>,
) -> Result<Motion<f64>, Refusal> {
    let factor = factor(robot, samples, weights, settings)?;
    let outcome = solve(&factor, robot, settings, Frame::Sensor)?;
    Ok(free_frame(&factor, robot, settings).motion(&outcome.estimate.correction))
}

fn factor(
    robot: &Robot<f64>,
    samples: Samples<'_>,
    weights: Option<&Weights>,
    settings: &Settings<f64>,
) -> Result<JointFactor<f64>, Refusal> {
    let empty = *JointCalibrator::new(robot, settings).factor();
    let factor = match samples {
        Samples::InMemory(samples) => with_samples(empty, (0, samples), weights),
        Samples::OnDisk(samples) => {
            let mut halves = [empty; 2];
            let taken = samples.each_part(|first, part| {
                halves = with_part(halves, (first, part), weights)?;
                Ok(())
            });
            taken.and_then(|()| of_halves(halves, weights))
        }
    };
    factor.map_err(|_| Refusal::NonFinite {
        arm: ArmIndex::First,
    })
}

/// A sample's place and its fault.
type Fault = (usize, SampleError);

fn with_samples(
    mut factor: JointFactor<f64>,
    (first, samples): (usize, &[Sample<f64>]),
    weights: Option<&Weights>,
) -> Result<JointFactor<f64>, Fault> {
    let faulty = |(index, error)| (first + index, error);
    match weights {
        None => factor.add_many(samples),
        Some(weights) => {
            let factors = weights.factors.iter().copied().skip(first);
            factor.add_weighted(samples.iter().zip(factors), weights.effective_samples)
        }
    }
    .map_err(faulty)?;
    Ok(factor)
}

/// Two factors with the two halves of some samples, by two threads. `first`: the place of the first of them.
pub(super) fn with_part(
    [one, other]: [JointFactor<f64>; 2],
    (first, samples): (usize, &[Sample<f64>]),
    weights: Option<&Weights>,
) -> Result<[JointFactor<f64>; 2], Fault> {
    let (before, after) = samples.split_at(samples.len() / 2);
    let (one, other) = rayon::join(
        || with_samples(one, (first, before), weights),
        || with_samples(other, (first + before.len(), after), weights),
    );
    Ok([one?, other?])
}

/// All samples of both.
pub(super) fn of_halves(
    [mut one, other]: [JointFactor<f64>; 2],
    weights: Option<&Weights>,
) -> Result<JointFactor<f64>, Fault> {
    // Both are of the same robot and noise.
    let _ = one.merge(&other);
    if let Some(weights) = weights {
        one.add_weighted(std::iter::empty(), weights.effective_samples)?;
    }
    Ok(one)
}

fn solve(
    factor: &JointFactor<f64>,
    robot: &Robot<f64>,
    settings: &Settings<f64>,
    frame: Frame,
) -> Result<JointOutcome<f64>, Refusal> {
    match frame {
        Frame::Base => JointCalibrator::of_factor(*factor, settings).solve(),
        Frame::Sensor => JointOutcome::new(factor, &estimate(factor, robot, settings, frame)?),
    }
}

fn free_frame<P: Problem<f64, 24, 25, 325>>(
    problem: &P,
    robot: &Robot<f64>,
    settings: &Settings<f64>,
) -> FreeFrame<f64> {
    FreeFrame::new(robot, &units(problem), settings.tolerance.as_ref())
}

/// What a tolerance says, in the problem's units.
pub(crate) fn tolerance_prior<P: Problem<f64, 24, 25, 325>>(
    problem: &P,
    robot: &Robot<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> TolerancePrior<f64, 24> {
    TolerancePrior::new(robot, &units(problem), tolerance)
}

fn units<P: Problem<f64, 24, 25, 325>>(problem: &P) -> [f64; 24] {
    std::array::from_fn(|parameter| problem.unit_of(parameter))
}

/// Minimises a problem of all 24 parameters under the tolerance, with the robot's place known or not.
pub(crate) fn estimate<P: Problem<f64, 24, 25, 325>>(
    problem: &P,
    robot: &Robot<f64>,
    settings: &Settings<f64>,
    frame: Frame,
) -> Result<Estimate<f64, 24>, Refusal> {
    let first = ArmIndex::First;
    match frame {
        Frame::Base => {
            let prior = tolerance_prior(problem, robot, settings.tolerance.as_ref());
            let mut minimizer = Minimizer::with_prior(problem, first, prior, settings)?;
            while minimizer.step(problem) == Progress::Working {}
            minimizer.estimate(problem)
        }
        Frame::Sensor => {
            let prior = free_frame(problem, robot, settings);
            let mut minimizer = Minimizer::with_prior(problem, first, prior, settings)?;
            while minimizer.step(problem) == Progress::Working {}
            minimizer.estimate(problem)
        }
    }
}
