//! Samples calibrated in the order in which they came: the gate, held-out validation, forgetting. Every
//! decision is the core's, as firmware would make it.

use crate::files::samples_file::Row;
use crate::fit::options::Streaming;
use crate::fit::outcome::Outcome;
use crate::fit::weights::Weights;
use delta_cal::samples::SampleError;
use delta_cal::stream::{
    Alarm, Forgetting, Gate, GateCounts, HeldOut, HeldOutRefusal, Innovation, Validation, Verdict,
};
use delta_cal::{Calibrator, Refusal, Robot, RobotOutcome, Sample, Settings};
use std::num::NonZeroU32;

/// One sample in so many may be wrong by accident. Where the gate rejects more, it is the model that does
/// not hold, or the stated noise, and the samples that it took are those that happen to agree.
const MOST_REJECTED: u64 = 5;

/// A sample that the gate did not take in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RejectedSample {
    /// Its line in the samples file.
    pub line: u64,
    /// How far it is off; lengths in millimetres.
    pub innovation: Innovation<f64>,
}

/// What the gate made of the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct GateReport {
    /// How many samples came to what.
    pub counts: GateCounts,
    /// The line of the first sample that could be tested; `None` if none could.
    pub tested_from: Option<u64>,
    /// In the order in which they came.
    pub rejected: Vec<RejectedSample>,
}

/// What there is to say besides the calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamReport {
    /// What was asked for.
    pub asked: Streaming,
    /// If there was one.
    pub gate: Option<GateReport>,
    /// Of each arm, if there was one.
    pub held_out: Option<[Validation<f64>; 3]>,
}

/// Why there is no calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StreamRefusal {
    Sample(usize, SampleError),
    Fit(Refusal),
    HeldOut(HeldOutRefusal),
    /// The gate rejected so many of all samples that it is not known which are wrong.
    TooManyRejected {
        rejected: u64,
        samples: u64,
    },
    /// A run of rejections, and how many samples were taken in before.
    Alarm {
        alarm: Alarm,
        before: u64,
        run: u64,
    },
}

impl From<Refusal> for StreamRefusal {
    fn from(refusal: Refusal) -> Self {
        Self::Fit(refusal)
    }
}

impl From<HeldOutRefusal> for StreamRefusal {
    fn from(refusal: HeldOutRefusal) -> Self {
        Self::HeldOut(refusal)
    }
}

/// What the samples count because of their order, and what there is to say of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Streamed {
    pub(crate) weights: Weights,
    pub(crate) report: StreamReport,
    /// Of each sample, whether the gate rejected it.
    pub(crate) rejected: Vec<bool>,
    /// The three arms' calibration that the decisions come from, as firmware has it.
    pub(crate) arms: Outcome,
}

/// Decides, in the order of the samples, which of them count, and what. Gate and validation are the core's,
/// of the three arms' calibration.
pub(crate) fn weigh(
    robot: &Robot<f64>,
    settings: &Settings<f64>,
    measured: &[Sample<f64>],
    rows: &[Row<Sample<f64>>],
    asked: Streaming,
) -> Result<Streamed, StreamRefusal> {
    let mut calibrator = Calibrator::new(robot, settings);
    let memory = asked
        .forget
        .and_then(|samples| Forgetting::new(f64::from(samples.get())).ok());
    let mut rejected = vec![false; measured.len()];
    let mut report = StreamReport {
        asked,
        gate: None,
        held_out: None,
    };
    let outcome = if let Some(every) = asked.held_out {
        let (outcome, arms) = validated(&mut calibrator, measured, every)?;
        report.held_out = Some(arms);
        outcome
    } else if asked.gate {
        let gate = gated(&mut calibrator, measured, rows, memory, &mut rejected)?;
        report.gate = Some(gate);
        calibrator.solve()?
    } else {
        for (index, sample) in measured.iter().enumerate() {
            match &memory {
                Some(memory) => calibrator.add_forgetting(sample, memory),
                None => calibrator.add(sample),
            }
            .map_err(|error| StreamRefusal::Sample(index, error))?;
        }
        calibrator.solve()?
    };
    Ok(Streamed {
        weights: Weights::of(faded(&rejected, memory.as_ref())),
        report,
        rejected,
        arms: Outcome::from(outcome),
    })
}

/// λ to the power of the samples that came after each and were taken in; 0 for one that was not.
fn faded(rejected: &[bool], memory: Option<&Forgetting<f64>>) -> Vec<f64> {
    let mut factors = vec![0.0; rejected.len()];
    let mut factor = 1.0;
    for (target, rejected) in factors.iter_mut().zip(rejected).rev() {
        if !rejected {
            *target = factor;
            factor *= memory.map_or(1.0, Forgetting::factor);
        }
    }
    factors
}

fn validated(
    calibrator: &mut Calibrator<f64>,
    measured: &[Sample<f64>],
    every: NonZeroU32,
) -> Result<(RobotOutcome<f64>, [Validation<f64>; 3]), StreamRefusal> {
    let mut held_out = HeldOut::new(calibrator, u64::from(every.get()))?;
    for (index, sample) in measured.iter().enumerate() {
        held_out
            .add(calibrator, sample)
            .map_err(|error| StreamRefusal::Sample(index, error))?;
    }
    let fitted = calibrator.solve()?;
    let arms = held_out.validate(calibrator, &fitted)?;
    // Both are of the same robot and noise: they merge.
    let _ = held_out.merge_into(calibrator);
    Ok((calibrator.solve()?, arms))
}

fn gated(
    calibrator: &mut Calibrator<f64>,
    measured: &[Sample<f64>],
    rows: &[Row<Sample<f64>>],
    memory: Option<Forgetting<f64>>,
    marks: &mut [bool],
) -> Result<GateReport, StreamRefusal> {
    let mut gate = Gate::new(calibrator);
    if let Some(memory) = memory {
        gate = gate.with_forgetting(memory);
    }
    let (mut tested_from, mut rejected) = (None, Vec::new());
    let mut before = 0;
    for (index, ((sample, row), mark)) in measured.iter().zip(rows).zip(marks).enumerate() {
        let verdict = gate
            .add(calibrator, sample)
            .map_err(|error| StreamRefusal::Sample(index, error))?;
        if !matches!(verdict, Verdict::Untested(_)) {
            tested_from = tested_from.or(Some(row.line));
        }
        if let Verdict::Rejected(innovation) = verdict {
            *mark = true;
            rejected.push(RejectedSample {
                line: row.line,
                innovation,
            });
        } else if gate.alarm().is_none() {
            before = gate.counts().taken;
        }
        if gate.wants_estimate()
            && let Ok(outcome) = calibrator.solve()
        {
            gate.adopt(calibrator, &outcome);
        }
    }
    let counts = *gate.counts();
    if gate.alarm().is_none() && counts.rejected * MOST_REJECTED > counts.taken + counts.rejected {
        return Err(StreamRefusal::TooManyRejected {
            rejected: counts.rejected,
            samples: counts.taken + counts.rejected,
        });
    }
    match gate.alarm() {
        None => Ok(GateReport {
            counts,
            tested_from,
            rejected,
        }),
        Some(alarm) => Err(StreamRefusal::Alarm {
            alarm,
            before,
            run: counts.longest_run,
        }),
    }
}
