//! The controller's result against the same calculation here, bit by bit.

use super::convert;
use super::error::DeviceError;
use super::number::Number;
use super::session::{Assumptions, Measurement};
use delta_cal::calibration::{ArmOutcome, Start};
use delta_cal::{
    ArmIndex, Calibrator, Noise, Parameter, Progress, Real, Refusal, RobotSolver, Sample, Settings,
    Tolerance,
};
use delta_cal_protocol::{ArmReport, Fault};
use nalgebra::Vector3;

/// What a calibration ends with.
pub type Result3<T> = Result<[ArmReport<T>; 3], Refusal>;

/// Calibrates here as a controller does: one sample after the other, then solved step by step.
///
/// # Errors
/// A nominal geometry that is none, settings or a sample that a controller would not take.
pub fn solve_here<T: Number>(
    nominal: &[[T; 8]; 3],
    assumptions: &Assumptions<T>,
    measurements: &[Measurement<T>],
) -> Result<Result3<T>, DeviceError> {
    let settings = settings(assumptions).ok_or(DeviceError::Fault(Fault::Settings))?;
    let mut calibrator = Calibrator::new(&convert::robot(nominal)?, &settings);
    for (index, measurement) in measurements.iter().enumerate() {
        calibrator
            .add(&Sample {
                joints: measurement.joints,
                position: Vector3::from(measurement.position),
            })
            .map_err(|error| DeviceError::Sample { index, error })?;
    }
    Ok(solve(&mut calibrator))
}

fn settings<T: Number>(assumptions: &Assumptions<T>) -> Option<Settings<T>> {
    let tolerance = match assumptions.tolerance {
        Some((length, angle)) => Some(Tolerance::new(length, angle).ok()?),
        None => None,
    };
    let noise = match assumptions.noise {
        Some((position, joint)) => Some(Noise::new(position, joint).ok()?),
        None => None,
    };
    Some(
        Settings::default()
            .with_noise(noise)
            .with_tolerance(tolerance)
            .with_start(if assumptions.without_guess {
                Start::Free
            } else {
                Start::Nominal
            }),
    )
}

fn solve<T: Number>(calibrator: &mut Calibrator<T>) -> Result3<T> {
    let mut solver = RobotSolver::new(calibrator)?;
    while solver.step(calibrator)? == Progress::Working {}
    let outcome = solver.outcome()?;
    let [first, second, third] = &outcome.arms;
    let [one, two, three] = ArmIndex::ALL;
    Ok([
        arm_report(one, first),
        arm_report(two, second),
        arm_report(three, third),
    ])
}

fn arm_report<T: Real>(arm: ArmIndex, outcome: &ArmOutcome<T>) -> ArmReport<T> {
    ArmReport {
        arm,
        parameters: outcome.arm.parameters(),
        covariance: outcome.covariance.map(|matrix| matrix.data.0),
        residual_rms: outcome.residual_rms,
        estimated_noise: outcome.estimated_noise,
        degrees_of_freedom: outcome.degrees_of_freedom,
        samples: outcome.samples,
        iterations: outcome.iterations,
        termination: outcome.termination,
        start: outcome.start,
        condition: outcome.condition,
        prior_share: outcome.prior_share.data.0[0],
    }
}

/// One figure that is not the same on both sides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Which, in words.
    pub figure: String,
    /// What the controller has.
    pub device: String,
    /// What comes out here.
    pub here: String,
}

/// Two results, figure by figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Comparison {
    /// How many figures were compared.
    pub figures: usize,
    /// Those that differ.
    pub differences: Vec<Difference>,
}

/// Compares every bit of two results; a refusal counts as one figure.
pub fn compare<T: Number>(device: &Result3<T>, here: &Result3<T>) -> Comparison {
    let (device, here) = (figures(device), figures(here));
    let figures = device.len().max(here.len());
    let missing = || ("nothing".to_owned(), "nothing".to_owned());
    let differences = (0..figures)
        .filter_map(|index| {
            let (name, device) = device.get(index).cloned().unwrap_or_else(missing);
            let (other_name, here) = here.get(index).cloned().unwrap_or_else(missing);
            (device != here || name != other_name).then_some(Difference {
                figure: name,
                device,
                here,
            })
        })
        .collect();
    Comparison {
        figures,
        differences,
    }
}

/// Every figure with its name; Rust prints a number so that it reads back as the same bits.
fn figures<T: Number>(result: &Result3<T>) -> Vec<(String, String)> {
    let arms = match result {
        Ok(arms) => arms,
        Err(refusal) => return vec![("refusal".to_owned(), format!("{refusal:?}"))],
    };
    let mut figures = Vec::new();
    for report in arms {
        let mut add = |name: &str, value: String| {
            figures.push((format!("{name} of {}", report.arm), value));
        };
        for (parameter, value) in Parameter::ROTARY.into_iter().zip(report.parameters) {
            add(parameter.symbol(), format!("{value:?}"));
        }
        match &report.covariance {
            None => add("covariance", "unknown".to_owned()),
            Some(columns) => {
                for (from, column) in Parameter::ROTARY.into_iter().zip(columns) {
                    for (to, value) in Parameter::ROTARY.into_iter().zip(column) {
                        add(&format!("covariance {from}, {to}"), format!("{value:?}"));
                    }
                }
            }
        }
        for (parameter, share) in Parameter::ROTARY.into_iter().zip(report.prior_share) {
            add(&format!("prior share of {parameter}"), format!("{share:?}"));
        }
        add("residual", format!("{:?}", report.residual_rms));
        add("estimated noise", format!("{:?}", report.estimated_noise));
        add(
            "degrees of freedom",
            format!("{:?}", report.degrees_of_freedom),
        );
        add("samples", report.samples.to_string());
        add("iterations", report.iterations.to_string());
        add("termination", format!("{:?}", report.termination));
        add("start", format!("{:?}", report.start));
        add("condition", format!("{:?}", report.condition));
    }
    figures
}
