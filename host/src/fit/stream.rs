//! Samples calibrated in the order in which they came: the gate, held-out validation, forgetting. Every
//! decision is the core's, as firmware would make it.

use crate::fit::options::Streaming;
use crate::fit::outcome::Outcome;
use crate::fit::samples::Samples;
use crate::fit::weights::Weights;
use delta_cal::samples::SampleError;
use delta_cal::stream::{
    AddError, Added, Estimator, Forgetting, GateCounts, Innovation, Selection, StreamCalibrator,
    StreamOptions, StreamOutcome, StreamRefusal, Validation, Verdict,
};
use delta_cal::{Progress, Real, Refusal, Robot, Settings};

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
pub enum Unweighed {
    /// A sample that cannot be taken in, by its index.
    Sample(usize, SampleError),
    /// What the stream was refused for.
    Refused {
        /// The reason.
        refusal: StreamRefusal,
        /// Samples that the gate took in before an alarm.
        before: u64,
        /// The samples rejected one after the other that raised it.
        run: u64,
    },
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

/// What became of samples, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Record {
    tested_from: Option<u64>,
    rejected: Vec<RejectedSample>,
    marks: Vec<bool>,
    /// Samples that the gate took in before it raised an alarm.
    pub before: u64,
}

impl Record {
    /// Adds a sample, with its line; `alarmed` says whether the gate has raised an alarm.
    pub fn note(&mut self, added: &Added<f64>, alarmed: bool, line: impl Fn() -> u64) {
        let Added::Tested(verdict) = added else {
            self.marks.push(false);
            return;
        };
        if !matches!(verdict, Verdict::Untested(_)) {
            self.tested_from = self.tested_from.or_else(|| Some(line()));
        }
        if let Verdict::Rejected(innovation) = *verdict {
            let line = line();
            self.rejected.push(RejectedSample { line, innovation });
        } else if !alarmed {
            self.before += 1;
        }
        self.marks.push(matches!(verdict, Verdict::Rejected(_)));
    }

    /// What there is to say.
    pub fn report(
        &self,
        asked: Streaming,
        counts: Option<GateCounts>,
        held_out: Option<[Validation<f64>; 3]>,
    ) -> StreamReport {
        StreamReport {
            asked,
            gate: counts.map(|counts| GateReport {
                counts,
                tested_from: self.tested_from,
                rejected: self.rejected.clone(),
            }),
            held_out,
        }
    }

    /// Each sample's weight after forgetting; 0 for one that the gate rejected.
    pub fn weights(&self, asked: Streaming) -> Weights {
        Weights::of(faded(&self.marks, forgetting(asked).as_ref()))
    }

    /// Of each sample, whether the gate rejected it.
    pub fn rejected(&self) -> &[bool] {
        &self.marks
    }
}

fn forgetting<T: Real>(asked: Streaming) -> Option<Forgetting<T>> {
    let samples = f64::from(asked.forget?.get());
    Forgetting::new(T::from_f64(samples)).ok()
}

/// Which samples are taken in.
pub(crate) fn selection<T: Real>(asked: Streaming) -> Selection<T> {
    let forgetting = forgetting(asked);
    match asked.held_out {
        Some(every) => Selection::HeldOut {
            every: u64::from(every.get()),
        },
        None if asked.gate => Selection::Gated { forgetting },
        None => Selection::All { forgetting },
    }
}

/// Decides, in the order of the samples, which of them count, and what. Gate and validation are the core's,
/// of the three arms' calibration.
pub(crate) fn weigh(
    robot: &Robot<f64>,
    settings: &Settings<f64>,
    samples: Samples<'_>,
    line_of: impl Fn(usize) -> u64,
    asked: Streaming,
) -> Result<Streamed, Unweighed> {
    let options = StreamOptions {
        estimator: Estimator::Arms,
        selection: selection(asked),
    };
    let mut record = Record::default();
    let refused = |refusal: StreamRefusal, before, run| Unweighed::Refused {
        refusal,
        before,
        run,
    };
    let mut stream = StreamCalibrator::new(robot, settings, &options)
        .map_err(|refusal| refused(refusal.into(), 0, 0))?;
    samples.each_part(|first, samples| {
        for (index, sample) in (first..).zip(samples) {
            match stream.add(sample) {
                Ok(added) => record.note(&added, stream.alarm().is_some(), || line_of(index)),
                Err(AddError::Sample(error)) => return Err(Unweighed::Sample(index, error)),
                // It was stepped to the end of what there was to solve.
                Err(AddError::Busy) => {}
            }
            while stream.step() == Progress::Working {}
        }
        Ok(())
    })?;
    stream.solve();
    while stream.step() == Progress::Working {}
    let counts = stream.gate_counts().copied();
    let run = counts.map_or(0, |counts| counts.longest_run);
    let arms = match stream.result() {
        Some(Ok(StreamOutcome::Arms(outcome))) => Outcome::from(*outcome),
        Some(Ok(StreamOutcome::Joint(outcome))) => Outcome::from(*outcome),
        Some(Err(refusal)) => return Err(refused(refusal, record.before, run)),
        None => return Err(refused(Refusal::Unfinished.into(), record.before, run)),
    };
    Ok(Streamed {
        weights: record.weights(asked),
        report: record.report(asked, counts, stream.validations().copied()),
        rejected: record.rejected().to_vec(),
        arms,
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
