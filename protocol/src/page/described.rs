//! The bytes of a message and what they mean, written from the page alone.
//!
//! The enums of this crate are matched without a wildcard: a new message, fault or phase does not
//! compile before it is described.

use super::cases::Message;
use crate::{
    ArmReport, Begin, ControlLoop, Counters, Fault, Identity, Origin, ParameterSet, Parameters,
    Phase, Request, Response, RevertTo, SampleMessage, Scalar, Status,
};
use delta_cal::calibration::{Instrument, StartUsed, Termination};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Parameter, Real, Refusal};
use std::borrow::ToOwned;
use std::collections::BTreeSet;
use std::format;
use std::string::String;
use std::vec::Vec;

/// Bytes and what they mean.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) bytes: Vec<u8>,
    pub(super) meaning: String,
}

/// A number as its bits.
pub(super) trait Bits: Real {
    fn bits(self) -> Vec<u8>;
}

impl Bits for f32 {
    fn bits(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

impl Bits for f64 {
    fn bits(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

/// Seven bits a byte, the lowest first; the highest bit says that more follow.
fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    loop {
        let [low, ..] = value.to_le_bytes();
        value >>= 7;
        if value == 0 {
            bytes.push(low & 0x7f);
            return bytes;
        }
        bytes.push(low | 0x80);
    }
}

#[derive(Debug, Default)]
pub(super) struct Pieces {
    pub(super) pieces: Vec<Piece>,
    /// The variants in it: enum, number, name.
    pub(super) variants: BTreeSet<(&'static str, usize, &'static str)>,
}

impl Pieces {
    pub(super) fn bytes(&self) -> Vec<u8> {
        let bytes = self.pieces.iter().map(|piece| &*piece.bytes);
        bytes.collect::<Vec<_>>().concat()
    }

    pub(super) fn add(&mut self, bytes: &[u8], meaning: &str) {
        self.pieces.push(Piece {
            bytes: bytes.to_vec(),
            meaning: meaning.to_owned(),
        });
    }

    fn varint(&mut self, name: &str, value: impl Into<u64>) {
        let value = value.into();
        self.add(&varint(value), &format!("{name} = {value}"));
    }

    /// A varint that is read in hexadecimal: a checksum, or a register.
    fn hexadecimal(&mut self, name: &str, value: u32) {
        self.add(&varint(value.into()), &format!("{name} = 0x{value:08x}"));
    }

    fn variant(&mut self, of: &'static str, number: usize, name: &'static str) {
        self.variants.insert((of, number, name));
        self.add(&varint(number as u64), &format!("{of}: {name}"));
    }

    fn number<T: Bits>(&mut self, name: &str, value: T) {
        self.add(&value.bits(), &format!("{name} = {}", value.to_f64()));
    }

    fn numbers<T: Bits>(&mut self, name: &str, values: &[T]) {
        let bytes: Vec<Vec<u8>> = values.iter().map(|value| value.bits()).collect();
        let values: Vec<String> = values
            .iter()
            .map(|value| format!("{}", value.to_f64()))
            .collect();
        let meaning = format!("{name} = {}", values.join(", "));
        self.add(&bytes.concat(), &meaning);
    }

    fn option(&mut self, name: &str, there: bool) {
        let text = if there { "follows" } else { "none" };
        self.add(&[there.into()], &format!("{name}: {text}"));
    }

    fn pair<T: Bits>(&mut self, name: &str, pair: Option<(T, T)>) {
        self.option(name, pair.is_some());
        if let Some((length, angle)) = pair {
            self.numbers(name, &[length, angle]);
        }
    }

    /// Up to the checksum.
    pub(super) fn message<T: Bits>(&mut self, sequence: u16, message: &Message<T>) {
        let (first, meaning) = match message {
            Message::Request(_) => (0x02, "version 2, request"),
            Message::Response(_) => (0x82, "version 2, answer"),
        };
        self.add(&[first], meaning);
        let bytes = sequence.to_le_bytes();
        self.add(&bytes, &format!("sequence number 0x{sequence:04x}"));
        match message {
            Message::Request(request) => self.request(request),
            Message::Response(response) => self.response(response),
        }
    }

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
                } = begin;
                self.variant(OF, 2, "Begin");
                self.varint("session", *session);
                self.pair("tolerance", *tolerance);
                self.pair("noise", *noise);
                let meaning = format!("without_guess = {without_guess}");
                self.add(&[(*without_guess).into()], &meaning);
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
            Response::Taken { session, next } => {
                self.variant(OF, 3, "Taken");
                self.varint("session", *session);
                self.varint("next", *next);
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
        }
    }

    pub(super) fn fault(&mut self, fault: Fault) {
        const OF: &str = "Fault";
        match fault {
            Fault::Damaged => self.variant(OF, 0, "Damaged"),
            Fault::UnknownVersion { spoken } => {
                self.variant(OF, 1, "UnknownVersion");
                self.add(&[spoken], &format!("spoken = {spoken}"));
            }
            Fault::UnknownRequest => self.variant(OF, 2, "UnknownRequest"),
            Fault::NoSession => self.variant(OF, 3, "NoSession"),
            Fault::OutOfOrder { next } => {
                self.variant(OF, 4, "OutOfOrder");
                self.varint("next", next);
            }
            Fault::Sample(error) => {
                self.variant(OF, 5, "Sample");
                self.sample_error(error);
            }
            Fault::Settings => self.variant(OF, 6, "Settings"),
            Fault::Busy => self.variant(OF, 7, "Busy"),
            Fault::NoOutcome => self.variant(OF, 8, "NoOutcome"),
            Fault::OtherParameters { there } => {
                self.variant(OF, 9, "OtherParameters");
                self.hexadecimal("there", there);
            }
            Fault::Store => self.variant(OF, 10, "Store"),
        }
    }

    fn sample_error(&mut self, error: SampleError) {
        const OF: &str = "SampleError";
        match error {
            SampleError::PositionNonFinite => self.variant(OF, 0, "PositionNonFinite"),
            SampleError::PositionTooFar(arm) => {
                self.variant(OF, 1, "PositionTooFar");
                self.arm(arm);
            }
            SampleError::JointNonFinite(arm) => {
                self.variant(OF, 2, "JointNonFinite");
                self.arm(arm);
            }
            SampleError::JointTooLarge(arm) => {
                self.variant(OF, 3, "JointTooLarge");
                self.arm(arm);
            }
            other => panic!("{other:?} is not described"),
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
            arms,
        } = parameters;
        match origin {
            Origin::Nominal => self.variant(OF, 0, "Nominal"),
            Origin::NominalStoreDamaged => self.variant(OF, 1, "NominalStoreDamaged"),
            Origin::Calibration => self.variant(OF, 2, "Calibration"),
            Origin::CalibrationStoreDamaged => self.variant(OF, 3, "CalibrationStoreDamaged"),
        }
        self.varint("generation", *generation);
        for (index, arm) in (1..).zip(arms) {
            self.numbers(&format!("arm {index}"), arm);
        }
    }

    fn status<T: Bits>(&mut self, status: &Status<T>) {
        let Status {
            session,
            phase,
            control,
        } = status;
        self.varint("session", *session);
        self.phase(phase);
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

    pub(super) fn phase(&mut self, phase: &Phase) {
        const OF: &str = "Phase";
        match phase {
            Phase::Idle => self.variant(OF, 0, "Idle"),
            Phase::Collecting { samples } => {
                self.variant(OF, 1, "Collecting");
                self.varint("samples", *samples);
            }
            Phase::Solving { arm } => {
                self.variant(OF, 2, "Solving");
                self.arm(*arm);
            }
            Phase::Solved {
                samples,
                fingerprint,
            } => {
                self.variant(OF, 3, "Solved");
                self.varint("samples", *samples);
                self.hexadecimal("fingerprint", *fingerprint);
            }
            Phase::CalibrationRefused { samples, refusal } => {
                self.variant(OF, 4, "CalibrationRefused");
                self.varint("samples", *samples);
                self.refusal(refusal);
            }
        }
    }

    #[allow(clippy::too_many_lines)] // a table
    pub(super) fn refusal(&mut self, refusal: &Refusal) {
        const OF: &str = "Refusal";
        match *refusal {
            Refusal::TooFewSamples {
                arm,
                samples,
                needed,
            } => {
                self.variant(OF, 0, "TooFewSamples");
                self.arm(arm);
                self.varint("samples", samples);
                self.varint("needed", needed);
            }
            Refusal::Undetermined {
                arm,
                parameter,
                condition,
            } => {
                self.variant(OF, 1, "Undetermined");
                self.arm(arm);
                self.parameter(parameter);
                self.number("condition (f32)", condition);
            }
            Refusal::Uncertain {
                arm,
                parameter,
                sigma,
            } => {
                self.variant(OF, 2, "Uncertain");
                self.arm(arm);
                self.parameter(parameter);
                self.number("sigma (f32)", sigma);
            }
            Refusal::NotConverged { arm, iterations } => {
                self.variant(OF, 3, "NotConverged");
                self.arm(arm);
                self.varint("iterations", iterations);
            }
            Refusal::ResidualContradictsNoise { arm, ratio } => {
                self.variant(OF, 4, "ResidualContradictsNoise");
                self.option("arm", arm.is_some());
                if let Some(arm) = arm {
                    self.arm(arm);
                }
                self.number("ratio (f32)", ratio);
            }
            Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances,
            } => {
                self.variant(OF, 5, "FarFromNominal");
                self.arm(arm);
                self.parameter(parameter);
                self.number("tolerances (f32)", tolerances);
            }
            Refusal::ImpossibleGeometry { arm, error } => {
                self.variant(OF, 6, "ImpossibleGeometry");
                self.arm(arm);
                self.geometry_error(error);
            }
            Refusal::ImpossibleRobot(error) => {
                self.variant(OF, 7, "ImpossibleRobot");
                self.geometry_error(error);
            }
            Refusal::WrongSide => self.variant(OF, 8, "WrongSide"),
            Refusal::TooFewObservations {
                instrument,
                observations,
                needed,
            } => {
                self.variant(OF, 9, "TooFewObservations");
                self.instrument(instrument);
                self.varint("observations", observations);
                self.varint("needed", needed);
            }
            Refusal::UndeterminedInstrument(instrument) => {
                self.variant(OF, 10, "UndeterminedInstrument");
                self.instrument(instrument);
            }
            Refusal::NonFinite { arm } => {
                self.variant(OF, 11, "NonFinite");
                self.arm(arm);
            }
            Refusal::Unfinished => self.variant(OF, 12, "Unfinished"),
            ref other => panic!("{other:?} is not described"),
        }
    }

    fn geometry_error(&mut self, error: GeometryError) {
        const OF: &str = "GeometryError";
        match error {
            GeometryError::NonFinite(parameter) => {
                self.variant(OF, 0, "NonFinite");
                self.parameter(parameter);
            }
            GeometryError::NotPositive(parameter) => {
                self.variant(OF, 1, "NotPositive");
                self.parameter(parameter);
            }
            GeometryError::TiltTooLarge => self.variant(OF, 2, "TiltTooLarge"),
            GeometryError::AzimuthTooLarge => self.variant(OF, 3, "AzimuthTooLarge"),
            GeometryError::RadiusInvalid => self.variant(OF, 4, "RadiusInvalid"),
            GeometryError::NoCommonUp => self.variant(OF, 5, "NoCommonUp"),
            other => panic!("{other:?} is not described"),
        }
    }

    fn instrument(&mut self, instrument: Instrument) {
        const OF: &str = "Instrument";
        match instrument {
            Instrument::Frame => self.variant(OF, 0, "Frame"),
            Instrument::Plane(index) => {
                self.variant(OF, 1, "Plane");
                self.add(&[index], &format!("index = {index}"));
            }
            Instrument::Point(index) => {
                self.variant(OF, 2, "Point");
                self.add(&[index], &format!("index = {index}"));
            }
        }
    }

    fn arm(&mut self, arm: ArmIndex) {
        match arm {
            ArmIndex::First => self.variant("ArmIndex", 0, "First"),
            ArmIndex::Second => self.variant("ArmIndex", 1, "Second"),
            ArmIndex::Third => self.variant("ArmIndex", 2, "Third"),
        }
    }

    fn parameter(&mut self, parameter: Parameter) {
        let (number, name) = match parameter {
            Parameter::Dx => (0, "Dx"),
            Parameter::Dy => (1, "Dy"),
            Parameter::Dz => (2, "Dz"),
            Parameter::Theta => (3, "Theta"),
            Parameter::Alpha => (4, "Alpha"),
            Parameter::LaX => (5, "LaX"),
            Parameter::LaY => (6, "LaY"),
            Parameter::Lb => (7, "Lb"),
        };
        self.variant("Parameter", number, name);
    }

    fn report<T: Bits>(&mut self, report: &ArmReport<T>) {
        let ArmReport {
            arm,
            parameters,
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
        } = report;
        self.arm(*arm);
        self.numbers("parameters", parameters);
        self.option("covariance", covariance.is_some());
        for (index, column) in (1..).zip(covariance.iter().flatten()) {
            let bytes: Vec<Vec<u8>> = column.iter().map(|value| value.bits()).collect();
            self.add(
                &bytes.concat(),
                &format!("column {index} of the covariance"),
            );
        }
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
