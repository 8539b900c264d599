//! Calibrates one simulated robot with the settings of one case.

use super::plan::{CampaignSolver, Case};
use crate::accuracy::information::units;
use crate::accuracy::uncertainty::Sensitivities;
use crate::files::{Reading, Readings, RobotFile, Row, Tool};
use crate::fit::solution::{RobotCovariance, Unsolved};
use crate::fit::{Method, Options, by_arms, solve};
use delta_cal::calibration::{JointCalibrator, JointOutcome, Start};
use delta_cal::observations::{
    Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow, PrepareError,
};
use delta_cal::{IkmCalibrator, Noise, Refusal, Robot, RobotOutcome, Sample, Settings};
use nalgebra::{SMatrix, Vector3};

/// Covariance of the 24 parameters, in mm, radians and their products.
type Covariance = SMatrix<f64, 24, 24>;

/// First estimate of an unknown noise for the FKM method, mm: smaller than any residual other than rounding.
const FIRST_SIGMA: f64 = 1e-6;
/// With a tolerance: first estimate as a fraction of its length.
const FIRST_PART: f64 = 0.01;
/// Most noise estimates, and the relative change at which they have converged.
const ESTIMATES: usize = 12;
const SETTLED: f64 = 0.02;

/// The outcome of a calibration as one word.
pub(super) type Status = &'static str;
pub(super) const ACCEPTED: Status = "accepted";
/// No robot to measure: the start error yields no valid robot, or one without usable poses.
pub(super) const NO_ROBOT: Status = "no_robot";
const FAULTY_SAMPLE: Status = "faulty_sample";

#[derive(Debug)]
pub(super) struct Calibrated {
    pub(super) robot: Robot<f64>,
    pub(super) tool: Tool,
    /// Covariance with that of the rods, where the platform tilts.
    with_rods: Option<Box<RobotCovariance>>,
    /// `None` without redundant readings to estimate the noise from.
    covariance: Option<Covariance>,
    /// Whether `covariance` includes the correlation between arms.
    whole: bool,
    /// Whether the nominal robot sufficed as starting point for every arm.
    pub(super) from_nominal: bool,
}

pub(super) fn calibrate(
    file: &RobotFile,
    case: &Case,
    samples: &[Sample<f64>],
    turns: &[Vector3<f64>],
) -> Result<Calibrated, Status> {
    if file.parallelograms.is_some() {
        return tilting(file, case, samples, turns);
    }
    let nominal = &file.robot;
    let settings = Settings::default()
        .with_noise(case.noise().filter(|_| case.weights))
        .with_tolerance(case.tolerance(file).filter(|_| case.prior))
        .with_damping(case.solver == CampaignSolver::Lm);
    let outcome = match case.method {
        Method::Ikm => {
            let mut calibrator = IkmCalibrator::new(nominal, &settings);
            calibrator.add_many(samples).map_err(|_| FAULTY_SAMPLE)?;
            let outcome = calibrator.calibrate().map_err(|own| status(&own))?;
            return Ok(of_arms(&outcome, None));
        }
        Method::Joint => {
            let mut calibrator = JointCalibrator::new(nominal, &settings);
            calibrator.add_many(samples).map_err(|_| FAULTY_SAMPLE)?;
            calibrator.calibrate()
        }
        Method::Fkm => fkm(nominal, samples, &settings),
    };
    let outcome = outcome.map_err(|own| status(&own))?;
    let covariance = outcome.estimate.covariance.as_ref();
    Ok(of_arms(&RobotOutcome::from(&outcome), covariance))
}

/// Where the platform tilts, of each target in turn.
fn tilting(
    file: &RobotFile,
    case: &Case,
    samples: &[Sample<f64>],
    turns: &[Vector3<f64>],
) -> Result<Calibrated, Status> {
    let robot = RobotFile {
        noise: case.noise().filter(|_| case.weights),
        tolerance: case.tolerance(file).filter(|_| case.prior),
        ..file.clone()
    };
    let targets = file.instruments.targets.iter();
    let mut readings = Readings::of_name(&file.name);
    readings.targets = targets.map(|own| own.name.clone()).collect();
    let count = readings.targets.len().max(1);
    let rows = samples.iter().enumerate().map(|(index, sample)| Row {
        line: 0,
        value: Reading {
            target: index % count,
            turn: turns.get(index).copied(),
            ..Reading::of(sample)
        },
    });
    readings.rows = rows.collect();
    let options = Options {
        method: Some(case.method),
        ..Options::default()
    };
    let solution = solve(&robot, &readings, &options).map_err(|own| match own {
        Unsolved::Refused(refusal) => status(&refusal),
        _ => "refused",
    })?;
    let rods = file.parallelograms.zip(solution.tilt());
    Ok(Calibrated {
        tool: Tool {
            parallelograms: rods.map(|(own, found)| own.with_numbers(&found.by)),
            ..file.tool()
        },
        with_rods: Some(Box::new(solution.expected_of_robot())),
        covariance: Some(solution.of_parameters()),
        whole: true,
        from_nominal: solution.start == Start::Nominal,
        robot: solution.robot,
    })
}

/// The paper's FKM method: the core's observation problem, where each row reads all three coordinates in the robot's
/// frame. It needs a noise; an unknown noise is estimated from the residuals.
fn fkm(
    nominal: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<JointOutcome<f64>, Refusal> {
    let mut rows: Vec<_> = samples
        .iter()
        .map(|sample| {
            let [x, y, z]: [f64; 3] = sample.position.into();
            ObservationRow::new(Observation {
                position: [Some(x), Some(y), Some(z)],
                ..Observation::at(sample.joints)
            })
        })
        .collect();
    let mut solve = |noise: Noise<f64>| {
        let noise = ObservationNoise::new(noise, 1.0, 1.0).map_err(|_| Refusal::Unfinished)?;
        let instruments = Instruments::new(noise);
        let problem = ObservationProblem::<f64, 24>::prepare(nominal, &instruments, &mut rows);
        let problem = problem.map_err(|error| match error {
            PrepareError::Refused(refusal) => refusal,
            _ => Refusal::Unfinished,
        })?;
        Ok(problem.solve(settings)?.of_robot())
    };
    if let Some(noise) = settings.noise {
        return solve(noise);
    }
    let tolerance = settings.tolerance.as_ref();
    let mut sigma = tolerance.map_or(FIRST_SIGMA, |own| FIRST_PART * own.length());
    for _ in 0..ESTIMATES {
        let noise = Noise::new(sigma, 0.0).map_err(|_| Refusal::Unfinished)?;
        match solve(noise) {
            Err(Refusal::ResidualContradictsNoise { ratio, .. }) => sigma *= f64::from(ratio),
            Err(refusal) => return Err(refusal),
            Ok(mut outcome) => {
                let estimate = &mut outcome.estimate;
                let residuals = 3.0 * estimate.effective_samples;
                let freedom = estimate.degrees_of_freedom.max(1.0);
                let factor = estimate.residual_rms * (residuals / freedom).sqrt();
                if tolerance.is_none() || (factor - 1.0).abs() < SETTLED {
                    // The residuals are mere rounding and do not show the noise.
                    estimate.covariance.take_if(|_| sigma <= FIRST_SIGMA);
                    return Ok(outcome);
                }
                sigma = (sigma * factor).max(FIRST_SIGMA);
            }
        }
    }
    Err(Refusal::Unfinished)
}

/// Takes `covariance` of all parameters if given, otherwise the arms' own.
fn of_arms(outcome: &RobotOutcome<f64>, covariance: Option<&Covariance>) -> Calibrated {
    let mut arms = outcome.arms.iter();
    Calibrated {
        robot: outcome.robot.clone(),
        tool: Tool::default(),
        with_rods: None,
        covariance: covariance.copied().or_else(|| by_arms(&outcome.arms)),
        whole: covariance.is_some(),
        from_nominal: arms.all(|arm| arm.start == Start::Nominal),
    }
}

impl Calibrated {
    /// The stated error (σ) of the parameters, and of absolute and relative positions at the held-out poses. If the
    /// arms were calibrated separately, only that of the parameters: position errors depend on the correlation between
    /// arms.
    pub(super) fn stated(&self, held_out: &[[f64; 3]]) -> [Option<f64>; 3] {
        let Some(covariance) = &self.covariance else {
            return [None; 3];
        };
        let parameters = Some(error_of(covariance, &self.robot));
        if !self.whole {
            return [parameters, None, None];
        }
        let [absolute, relative] = match &self.with_rods {
            None => self.of_positions(covariance, held_out),
            Some(covariance) => self.of_positions(covariance, held_out),
        };
        [parameters, absolute, relative]
    }

    fn of_positions<const P: usize>(
        &self,
        covariance: &SMatrix<f64, P, P>,
        held_out: &[[f64; 3]],
    ) -> [Option<f64>; 2] {
        let robot = &self.robot;
        let reached = held_out.iter().filter_map(|joints| {
            let position = robot.forward(joints).ok()?;
            Some(Sample {
                joints: *joints,
                position,
            })
        });
        let absolute = Sensitivities::of(robot, &self.tool, reached);
        let rms = |own: &Sensitivities<P>| {
            let rows = own.0.iter().map(|(_, row)| row);
            let variances = rows.map(|row| (row * covariance * row.transpose()).trace());
            let sigma = (variances.sum::<f64>() / own.0.len() as f64).sqrt();
            sigma.is_finite().then_some(sigma)
        };
        let relative = absolute.relative();
        [rms(&absolute), relative.as_ref().and_then(rms)]
    }
}

/// Square root of the trace, with angles times the upper arm's length.
fn error_of(covariance: &Covariance, robot: &Robot<f64>) -> f64 {
    let units = units(robot);
    covariance
        .diagonal()
        .component_mul(&units.component_mul(&units))
        .sum()
        .sqrt()
}

const fn status(refusal: &Refusal) -> Status {
    match refusal {
        Refusal::TooFewSamples { .. } => "too_few_samples",
        Refusal::Undetermined { .. } => "undetermined",
        Refusal::Uncertain { .. } => "uncertain",
        Refusal::NotConverged { .. } => "not_converged",
        Refusal::ResidualContradictsNoise { .. } => "residual_contradicts_noise",
        Refusal::FarFromNominal { .. } => "far_from_nominal",
        Refusal::ImpossibleGeometry { .. } => "impossible_geometry",
        Refusal::ImpossibleRobot(_) => "impossible_robot",
        Refusal::WrongSide => "wrong_side",
        Refusal::NonFinite { .. } => "non_finite",
        Refusal::TooFewObservations { .. } => "too_few_observations",
        _ => "refused",
    }
}
