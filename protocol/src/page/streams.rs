//! What streams add: the bytes and what they mean, written from the page alone.

use super::pieces::{Bits, Pieces};
use crate::GateStatus;
use delta_cal::stream::{
    Added, Alarm, HeldOutRefusal, Innovation, StreamRefusal, Untested, Validation, Verdict,
};

impl Pieces {
    pub(super) fn added<T: Bits>(&mut self, added: &Added<T>) {
        const OF: &str = "Added";
        match added {
            Added::Taken => self.variant(OF, 0, "Taken"),
            Added::HeldOut => self.variant(OF, 1, "HeldOut"),
            Added::Tested(verdict) => {
                self.variant(OF, 2, "Tested");
                self.verdict(verdict);
            }
        }
    }

    fn verdict<T: Bits>(&mut self, verdict: &Verdict<T>) {
        const OF: &str = "Verdict";
        match verdict {
            Verdict::Taken(innovation) => {
                self.variant(OF, 0, "Taken");
                self.innovation(innovation);
            }
            Verdict::Untested(untested) => {
                self.variant(OF, 1, "Untested");
                match untested {
                    Untested::NoEstimate => self.variant("Untested", 0, "NoEstimate"),
                    Untested::NoNoise => self.variant("Untested", 1, "NoNoise"),
                    other => panic!("{other:?} is not described"),
                }
            }
            Verdict::Rejected(innovation) => {
                self.variant(OF, 2, "Rejected");
                self.innovation(innovation);
            }
        }
    }

    fn innovation<T: Bits>(&mut self, innovation: &Innovation<T>) {
        self.arm(innovation.arm);
        self.number("distance", innovation.distance);
        self.number("normalized", innovation.normalized);
    }

    pub(super) fn gate(&mut self, gate: &GateStatus) {
        let counts = &gate.counts;
        self.varint("taken", counts.taken);
        self.varint("untested", counts.untested);
        self.varint("rejected", counts.rejected);
        for (arm, rejected) in (1..).zip(counts.rejected_by_arm) {
            self.varint(&std::format!("rejected_by_arm {arm}"), rejected);
        }
        self.varint("run", counts.run);
        self.varint("longest_run", counts.longest_run);
        self.option("alarm", gate.alarm.is_some());
        if let Some(alarm) = &gate.alarm {
            self.alarm(alarm);
        }
    }

    fn alarm(&mut self, alarm: &Alarm) {
        const OF: &str = "Alarm";
        match alarm {
            Alarm::RobotChanged { first } => {
                self.variant(OF, 0, "RobotChanged");
                self.varint("first", *first);
            }
            Alarm::EarlySamplesWrong { first } => {
                self.variant(OF, 1, "EarlySamplesWrong");
                self.varint("first", *first);
            }
            other => panic!("{other:?} is not described"),
        }
    }

    pub(super) fn validation<T: Bits>(&mut self, validation: &Validation<T>) {
        self.number("samples", validation.samples);
        self.number("residual_rms", validation.residual_rms);
        self.number("expected_rms", validation.expected_rms);
        self.number("statistic", validation.statistic);
        self.number("limit", validation.limit);
    }

    pub(super) fn stream_refusal(&mut self, refusal: &StreamRefusal) {
        const OF: &str = "StreamRefusal";
        match refusal {
            StreamRefusal::Calibration(refusal) => {
                self.variant(OF, 0, "Calibration");
                self.refusal(refusal);
            }
            StreamRefusal::HeldOut(refusal) => {
                self.variant(OF, 1, "HeldOut");
                self.held_out_refusal(*refusal);
            }
            StreamRefusal::Alarm(alarm) => {
                self.variant(OF, 2, "Alarm");
                self.alarm(alarm);
            }
            StreamRefusal::TooManyRejected { rejected, samples } => {
                self.variant(OF, 3, "TooManyRejected");
                self.varint("rejected", *rejected);
                self.varint("samples", *samples);
            }
            other => panic!("{other:?} is not described"),
        }
    }

    fn held_out_refusal(&mut self, refusal: HeldOutRefusal) {
        const OF: &str = "HeldOutRefusal";
        match refusal {
            HeldOutRefusal::Every => self.variant(OF, 0, "Every"),
            HeldOutRefusal::NoSamples { arm } => {
                self.variant(OF, 1, "NoSamples");
                self.arm(arm);
            }
            HeldOutRefusal::NoNoise { arm } => {
                self.variant(OF, 2, "NoNoise");
                self.arm(arm);
            }
            HeldOutRefusal::Contradicted { arm, ratio } => {
                self.variant(OF, 3, "Contradicted");
                self.arm(arm);
                self.number("ratio (f32)", ratio);
            }
            HeldOutRefusal::Overfitted { arm, ratio } => {
                self.variant(OF, 4, "Overfitted");
                self.arm(arm);
                self.number("ratio (f32)", ratio);
            }
            other => panic!("{other:?} is not described"),
        }
    }
}
