//! The controller's result against the same calculation here, bit by bit.

use super::convert::{self, Measurement};
use super::error::{DeviceError, RowError};
use super::number::Number;
use super::sending::Sending;
use super::solution::{ACROSS, Solution};
use delta_cal::observations::ObservationRow;
use delta_cal::stream::{AddError, Added, StreamOutcome, StreamRefusal, Validation};
use delta_cal::{ArmIndex, Parameter, Progress, Refusal, Robot, RobotOutcome, Sample};
use delta_cal_protocol::{
    ArmReport, Begin, BeginObservations, CovarianceBlock, Fault, Geometry, ObservationMessage,
    Places, Solver,
};
use nalgebra::Vector3;

/// What a calibration ends with: what became of each sample, and the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended<T> {
    /// `None` where a controller restarted before it could say so.
    pub added: Vec<Option<Added<T>>>,
    /// The result.
    pub result: Result<Solution<T>, StreamRefusal>,
}

/// Calibrates here as a controller does: one row after the other, then solved step by step.
///
/// # Errors
/// A nominal geometry that is none, settings or a row that a controller would not take.
pub fn solve_here<T: Number>(
    nominal: &Geometry<T>,
    sending: &Sending<T>,
) -> Result<Ended<T>, DeviceError> {
    let robot = convert::robot(nominal)?;
    match sending {
        Sending::Samples { begin, rows } => samples(&robot, begin, rows),
        Sending::Observations { begin, rows } => observations(&robot, begin, rows),
    }
}

/// Any session will do.
const SESSION: u32 = 1;

fn samples<T: Number>(
    robot: &Robot<T>,
    begin: &Begin<T>,
    measurements: &[Measurement<T>],
) -> Result<Ended<T>, DeviceError> {
    let begin = Begin {
        session: SESSION,
        ..*begin
    };
    let mut stream = begin.calibrator(robot).map_err(DeviceError::Fault)?;
    let mut added = Vec::new();
    for (index, measurement) in measurements.iter().enumerate() {
        let sample = Sample {
            joints: measurement.joints,
            position: Vector3::from(measurement.position),
        };
        added.push(Some(stream.add(&sample).map_err(|error| match error {
            AddError::Sample(error) => DeviceError::Row {
                index,
                error: RowError::Sample(error),
            },
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

fn observations<T: Number>(
    robot: &Robot<T>,
    begin: &BeginObservations<T>,
    measurements: &[ObservationMessage<T>],
) -> Result<Ended<T>, DeviceError> {
    let begin = BeginObservations {
        session: SESSION,
        ..*begin
    };
    let setup = begin.setup().map_err(DeviceError::Fault)?;
    let instruments = setup.instruments();
    let mut rows = Vec::new();
    for (index, measurement) in measurements.iter().enumerate() {
        let row = ObservationRow::checked(measurement.observation(), robot, &instruments);
        rows.push(row.map_err(|error| DeviceError::Row {
            index,
            error: RowError::Observation(error),
        })?);
    }
    let mut solver = Box::new(Solver::new());
    let result = loop {
        if let Some(result) = solver.step(robot, &instruments, &mut rows, &setup.settings) {
            break result;
        }
    };
    let result = result.map(|outcome| Solution {
        places: Some(Places::new(&outcome, &instruments)),
        ..solution(&StreamOutcome::Joint(outcome.of_robot()), None)
    });
    Ok(Ended {
        added: vec![Some(Added::Taken); rows.len()],
        result: result.map_err(StreamRefusal::from),
    })
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
        places: None,
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
    if let Some(places) = &solution.places {
        for (number, plane) in (1..).zip(&places.planes) {
            figures.push((format!("plane {number}"), format!("{plane:?}")));
        }
        for (number, point) in (1..).zip(&places.points) {
            figures.push((format!("point {number}"), format!("{point:?}")));
        }
    }
    for report in &solution.arms {
        let mut add = |name: &str, value: String| {
            figures.push((format!("{name} of {}", report.arm), value));
        };
        for (parameter, value) in Parameter::ROTARY.into_iter().zip(report.parameters) {
            add(parameter.symbol(), format!("{value:?}"));
        }
        add("transmission", format!("{:?}", report.transmission));
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
