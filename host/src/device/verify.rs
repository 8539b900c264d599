//! The controller's result against the same calculation here, bit by bit.

use super::convert;
use super::error::DeviceError;
use super::number::Number;
use super::session::{ACROSS, Measurement, Solution};
use delta_cal::stream::{AddError, Added, StreamOutcome, StreamRefusal, Validation};
use delta_cal::{ArmIndex, Parameter, Progress, Refusal, RobotOutcome, Sample};
use delta_cal_protocol::{ArmReport, Begin, CovarianceBlock, Fault};
use nalgebra::Vector3;

/// What a calibration ends with: what became of each sample, and the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended<T> {
    /// `None` where a controller restarted before it could say so.
    pub added: Vec<Option<Added<T>>>,
    /// The result.
    pub result: Result<Solution<T>, StreamRefusal>,
}

/// Calibrates here as a controller does: one sample after the other, then solved step by step.
///
/// # Errors
/// A nominal geometry that is none, settings or a sample that a controller would not take.
pub fn solve_here<T: Number>(
    nominal: &[[T; 8]; 3],
    begin: &Begin<T>,
    measurements: &[Measurement<T>],
) -> Result<Ended<T>, DeviceError> {
    // Any session will do.
    let begin = Begin {
        session: 1,
        ..*begin
    };
    let robot = convert::robot(nominal)?;
    let mut stream = begin.calibrator(&robot).map_err(DeviceError::Fault)?;
    let mut added = Vec::new();
    for (index, measurement) in measurements.iter().enumerate() {
        let sample = Sample {
            joints: measurement.joints,
            position: Vector3::from(measurement.position),
        };
        added.push(Some(stream.add(&sample).map_err(|error| match error {
            AddError::Sample(error) => DeviceError::Sample { index, error },
            AddError::Busy => DeviceError::Fault(Fault::Busy),
        })?));
        while stream.step() == Progress::Working {}
    }
    stream.solve();
    while stream.step() == Progress::Working {}
    let result = match stream.result() {
        Some(Ok(outcome)) => Ok(solution(outcome, stream.validations())),
        Some(Err(refusal)) => Err(refusal),
        None => Err(Refusal::Unfinished.into()),
    };
    Ok(Ended { added, result })
}

fn solution<T: Number>(
    outcome: &StreamOutcome<T>,
    validations: Option<&[Validation<T>; 3]>,
) -> Solution<T> {
    let (robot, across) = match outcome {
        StreamOutcome::Arms(outcome) => (*outcome, None),
        StreamOutcome::Joint(outcome) => {
            let block = |(rows, columns)| CovarianceBlock::new(outcome, rows, columns);
            (RobotOutcome::from(outcome), Some(ACROSS.map(block)))
        }
    };
    let [first, second, third] = &robot.arms;
    let [one, two, three] = ArmIndex::ALL;
    Solution {
        arms: [
            ArmReport::new(one, first, validations),
            ArmReport::new(two, second, validations),
            ArmReport::new(three, third, validations),
        ],
        across,
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
pub fn compare<T: Number>(device: &Ended<T>, here: &Ended<T>) -> Comparison {
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
fn figures<T: Number>(ended: &Ended<T>) -> Vec<(String, String)> {
    let mut figures: Vec<_> = (1..)
        .zip(&ended.added)
        .filter(|(_, added)| **added != Some(Added::Taken))
        .map(|(number, added): (u32, _)| (format!("sample {number}"), format!("{added:?}")))
        .collect();
    let solution = match &ended.result {
        Ok(solution) => solution,
        Err(refusal) => {
            figures.push(("refusal".to_owned(), format!("{refusal:?}")));
            return figures;
        }
    };
    for block in solution.across.iter().flatten() {
        let name = format!("covariance of {} with {}", block.rows, block.columns);
        figures.push((name, format!("{:?}", block.covariance)));
    }
    for report in &solution.arms {
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
        if let Some(validation) = report.held_out {
            add("held-out samples", format!("{validation:?}"));
        }
    }
    figures
}
