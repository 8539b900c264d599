//! The bytes of a message and what they mean, written from the page alone.
//!
//! The enums of this crate are matched without a wildcard: a new message does not compile before it is
//! described.

use super::pieces::{Bits, Pieces};
use crate::{
    Adopt, ArmReport, Begin, ControlLoop, Counters, CovarianceBlock, Geometry, Identity, Origin,
    ParameterSet, Parameters, Request, Response, RevertTo, SampleMessage, Scalar, Status,
};
use delta_cal::calibration::{StartUsed, Termination};
use delta_cal::stream::Estimator;
use std::format;
use std::vec::Vec;

#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // a test
pub(super) enum Message<T> {
    Request(Request<T>),
    Response(Response<T>),
}

impl Pieces {
    /// Up to the checksum.
    pub(super) fn message<T: Bits>(&mut self, sequence: u16, message: &Message<T>) {
        let (first, meaning) = match message {
            Message::Request(_) => (0x04, "version 4, request"),
            Message::Response(_) => (0x84, "version 4, answer"),
        };
        self.add(&[first], meaning);
        let bytes = sequence.to_le_bytes();
        self.add(&bytes, &format!("sequence number 0x{sequence:04x}"));
        match message {
            Message::Request(request) => self.request(request),
            Message::Response(response) => self.response(response),
        }
    }

    #[allow(clippy::too_many_lines)] // a table
    fn request<T: Bits>(&mut self, request: &Request<T>) {
        const OF: &str = "Request";
        match request {
            Request::Identify => self.variant(OF, 0, "Identify"),
            Request::Parameters(set) => {
                self.variant(OF, 1, "Parameters");
                match set {
                    ParameterSet::Current => self.variant("ParameterSet", 0, "Current"),
                    ParameterSet::Nominal => self.variant("ParameterSet", 1, "Nominal"),
                }
            }
            Request::Begin(begin) => {
                let Begin {
                    session,
                    tolerance,
                    noise,
                    without_guess,
                    estimator,
                    gate,
                    held_out,
                    forgetting,
                } = begin;
                self.variant(OF, 2, "Begin");
                self.varint("session", *session);
                self.pair("tolerance", *tolerance);
                self.option("noise", noise.is_some());
                if let Some((position, joint)) = noise {
                    self.numbers("position", position);
                    self.number("joint", *joint);
                }
                let meaning = format!("without_guess = {without_guess}");
                self.add(&[(*without_guess).into()], &meaning);
                match estimator {
                    Estimator::Arms => self.variant("Estimator", 0, "Arms"),
                    Estimator::Joint => self.variant("Estimator", 1, "Joint"),
                }
                self.add(&[(*gate).into()], &format!("gate = {gate}"));
                self.option("held_out", held_out.is_some());
                if let Some(every) = held_out {
                    self.varint("held_out", *every);
                }
                self.option("forgetting", forgetting.is_some());
                if let Some(samples) = forgetting {
                    self.number("forgetting", *samples);
                }
            }
            Request::Sample(sample) => {
                let SampleMessage {
                    session,
                    index,
                    joints,
                    position,
                } = sample;
                self.variant(OF, 3, "Sample");
                self.varint("session", *session);
                self.varint("index", *index);
                self.numbers("joints", joints);
                self.numbers("position", position);
            }
            Request::Solve { session, samples } => {
                self.variant(OF, 4, "Solve");
                self.varint("session", *session);
                self.varint("samples", *samples);
            }
            Request::Status => self.variant(OF, 5, "Status"),
            Request::Outcome { session, arm } => {
                self.variant(OF, 6, "Outcome");
                self.varint("session", *session);
                self.arm(*arm);
            }
            Request::Apply {
                session,
                fingerprint,
                from,
            } => {
                self.variant(OF, 7, "Apply");
                self.varint("session", *session);
                self.hexadecimal("fingerprint", *fingerprint);
                self.varint("from", *from);
            }
            Request::Revert { from, to } => {
                self.variant(OF, 8, "Revert");
                self.varint("from", *from);
                match to {
                    RevertTo::Previous => self.variant("RevertTo", 0, "Previous"),
                    RevertTo::Nominal => self.variant("RevertTo", 1, "Nominal"),
                }
            }
            Request::Counters => self.variant(OF, 9, "Counters"),
            Request::Covariance {
                session,
                rows,
                columns,
            } => {
                self.variant(OF, 10, "Covariance");
                self.varint("session", *session);
                self.arm(*rows);
                self.arm(*columns);
            }
            Request::BeginObservations(begin) => {
                self.variant(OF, 11, "BeginObservations");
                self.begin_observations(begin);
            }
            Request::Observation(observation) => {
                self.variant(OF, 12, "Observation");
                self.observation(observation);
            }
            Request::Places { session } => {
                self.variant(OF, 13, "Places");
                self.varint("session", *session);
            }
            Request::Adopt(Adopt { from, geometry }) => {
                self.variant(OF, 14, "Adopt");
                self.varint("from", *from);
                self.geometry(geometry);
            }
        }
    }

    fn response<T: Bits>(&mut self, response: &Response<T>) {
        const OF: &str = "Response";
        match response {
            Response::Fault(fault) => {
                self.variant(OF, 0, "Fault");
                self.fault(*fault);
            }
            Response::Identity(identity) => {
                self.variant(OF, 1, "Identity");
                self.identity(identity);
            }
            Response::Parameters(parameters) => {
                self.variant(OF, 2, "Parameters");
                self.parameters(parameters);
            }
            Response::Taken {
                session,
                next,
                last,
            } => {
                self.variant(OF, 3, "Taken");
                self.varint("session", *session);
                self.varint("next", *next);
                self.option("last", last.is_some());
                if let Some(last) = last {
                    self.added(last);
                }
            }
            Response::Status(status) => {
                self.variant(OF, 4, "Status");
                self.status(status);
            }
            Response::Outcome(report) => {
                self.variant(OF, 5, "Outcome");
                self.report(report);
            }
            Response::Counters(counters) => {
                self.variant(OF, 6, "Counters");
                self.counters(counters);
            }
            Response::Covariance(block) => {
                let CovarianceBlock {
                    rows,
                    columns,
                    covariance,
                } = block;
                self.variant(OF, 7, "Covariance");
                self.arm(*rows);
                self.arm(*columns);
                self.covariance(covariance.as_ref());
            }
            Response::Places(places) => {
                self.variant(OF, 8, "Places");
                self.places(places);
            }
        }
    }

    fn identity(&mut self, identity: &Identity) {
        let Identity {
            firmware,
            scalar,
            processor,
            nominal,
        } = identity;
        for (name, part) in ["major", "minor", "patch"].into_iter().zip(firmware) {
            self.varint(name, *part);
        }
        match scalar {
            Scalar::Single => self.variant("Scalar", 0, "Single"),
            Scalar::Double => self.variant("Scalar", 1, "Double"),
        }
        self.hexadecimal("processor", *processor);
        self.hexadecimal("nominal", *nominal);
    }

    fn parameters<T: Bits>(&mut self, parameters: &Parameters<T>) {
        const OF: &str = "Origin";
        let Parameters {
            origin,
            generation,
            geometry,
        } = parameters;
        match origin {
            Origin::Nominal => self.variant(OF, 0, "Nominal"),
            Origin::NominalStoreDamaged => self.variant(OF, 1, "NominalStoreDamaged"),
            Origin::Calibration => self.variant(OF, 2, "Calibration"),
            Origin::CalibrationStoreDamaged => self.variant(OF, 3, "CalibrationStoreDamaged"),
        }
        self.varint("generation", *generation);
        self.geometry(geometry);
    }

    fn geometry<T: Bits>(&mut self, geometry: &Geometry<T>) {
        let Geometry {
            arms,
            transmissions,
        } = geometry;
        for (index, arm) in (1..).zip(arms) {
            self.numbers(&format!("arm {index}"), arm);
        }
        self.option("transmissions", transmissions.is_some());
        for (index, numbers) in (1..).zip(transmissions.iter().flatten()) {
            self.numbers(&format!("transmission {index}"), numbers);
        }
    }

    fn status<T: Bits>(&mut self, status: &Status<T>) {
        let Status {
            session,
            phase,
            gate,
            control,
        } = status;
        self.varint("session", *session);
        self.phase(phase);
        self.option("gate", gate.is_some());
        if let Some(gate) = gate {
            self.gate(gate);
        }
        let ControlLoop {
            turns,
            longest_ticks,
            longest_ticks_calibrating,
            ticks_a_second,
            late,
            unreachable,
            switches,
            fingerprint,
            point,
            joints,
        } = control;
        self.varint("turns", *turns);
        self.varint("longest_ticks", *longest_ticks);
        self.varint("longest_ticks_calibrating", *longest_ticks_calibrating);
        self.varint("ticks_a_second", *ticks_a_second);
        self.varint("late", *late);
        self.varint("unreachable", *unreachable);
        self.varint("switches", *switches);
        self.hexadecimal("fingerprint", *fingerprint);
        self.numbers("point", point);
        self.numbers("joints", joints);
    }

    fn report<T: Bits>(&mut self, report: &ArmReport<T>) {
        let ArmReport {
            arm,
            parameters,
            transmission,
            covariance,
            residual_rms,
            estimated_noise,
            degrees_of_freedom,
            samples,
            iterations,
            termination,
            start,
            condition,
            prior_share,
            held_out,
        } = report;
        self.arm(*arm);
        self.numbers("parameters", parameters);
        self.option("transmission", transmission.is_some());
        if let Some(numbers) = transmission {
            self.numbers("transmission", numbers);
        }
        self.covariance(covariance.as_ref());
        self.number("residual_rms", *residual_rms);
        self.option("estimated_noise", estimated_noise.is_some());
        if let Some(noise) = estimated_noise {
            self.number("estimated_noise", *noise);
        }
        self.number("degrees_of_freedom", *degrees_of_freedom);
        self.varint("samples", *samples);
        self.varint("iterations", *iterations);
        match termination {
            Termination::GradientVanished => self.variant("Termination", 0, "GradientVanished"),
            Termination::RoundingReached => self.variant("Termination", 1, "RoundingReached"),
        }
        match start {
            StartUsed::Nominal => self.variant("StartUsed", 0, "Nominal"),
            StartUsed::Free => self.variant("StartUsed", 1, "Free"),
            StartUsed::Search => self.variant("StartUsed", 2, "Search"),
            StartUsed::Joint => self.variant("StartUsed", 3, "Joint"),
        }
        self.number("condition", *condition);
        self.numbers("prior_share", prior_share);
        self.option("held_out", held_out.is_some());
        if let Some(validation) = held_out {
            self.validation(validation);
        }
    }

    fn covariance<T: Bits>(&mut self, covariance: Option<&[[T; 8]; 8]>) {
        self.option("covariance", covariance.is_some());
        for (index, column) in (1..).zip(covariance.into_iter().flatten()) {
            let bytes: Vec<Vec<u8>> = column.iter().map(|value| value.bits()).collect();
            self.add(
                &bytes.concat(),
                &format!("column {index} of the covariance"),
            );
        }
    }

    fn counters(&mut self, counters: &Counters) {
        let Counters {
            received,
            damaged,
            unknown_version,
            unknown_request,
            repeated,
            lost,
            refused,
            overrun,
        } = counters;
        self.varint("received", *received);
        self.varint("damaged", *damaged);
        self.varint("unknown_version", *unknown_version);
        self.varint("unknown_request", *unknown_request);
        self.varint("repeated", *repeated);
        self.varint("lost", *lost);
        self.varint("refused", *refused);
        self.varint("overrun", *overrun);
    }
}
