//! Faults, phases and refusals: the bytes and what they mean, written from the page alone.
//!
//! The enums of this crate are matched without a wildcard: a new fault or phase does not compile before it is
//! described.

use super::pieces::Pieces;
use crate::{Fault, Phase};
use delta_cal::calibration::Instrument;
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Parameter, Refusal};
use std::format;

impl Pieces {
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
            Fault::Observation(error) => {
                self.variant(OF, 11, "Observation");
                self.observation_error(error);
            }
            Fault::TooManyObservations { capacity } => {
                self.variant(OF, 12, "TooManyObservations");
                self.varint("capacity", capacity);
            }
            Fault::TooManyUnknowns { capacity } => {
                self.variant(OF, 13, "TooManyUnknowns");
                self.varint("capacity", capacity);
            }
            Fault::OtherKind => self.variant(OF, 14, "OtherKind"),
            Fault::Geometry(error) => {
                self.variant(OF, 15, "Geometry");
                self.geometry_error(error);
            }
        }
    }

    pub(super) fn sample_error(&mut self, error: SampleError) {
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
                self.option("arm", arm.is_some());
                if let Some(arm) = arm {
                    self.arm(*arm);
                }
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
                self.stream_refusal(refusal);
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
            GeometryError::LeanTooLarge => self.variant(OF, 6, "LeanTooLarge"),
            GeometryError::MixedDrives => self.variant(OF, 7, "MixedDrives"),
            GeometryError::TransmissionTooLarge => self.variant(OF, 8, "TransmissionTooLarge"),
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
            Instrument::Transmission(arm) => {
                self.variant(OF, 3, "Transmission");
                self.arm(arm);
            }
        }
    }

    pub(super) fn arm(&mut self, arm: ArmIndex) {
        match arm {
            ArmIndex::First => self.variant("ArmIndex", 0, "First"),
            ArmIndex::Second => self.variant("ArmIndex", 1, "Second"),
            ArmIndex::Third => self.variant("ArmIndex", 2, "Third"),
        }
    }

    pub(super) fn parameter(&mut self, parameter: Parameter) {
        let (number, name) = match parameter {
            Parameter::Dx => (0, "Dx"),
            Parameter::Dy => (1, "Dy"),
            Parameter::Dz => (2, "Dz"),
            Parameter::Theta => (3, "Theta"),
            Parameter::Alpha => (4, "Alpha"),
            Parameter::LaX => (5, "LaX"),
            Parameter::LaY => (6, "LaY"),
            Parameter::Lb => (7, "Lb"),
            Parameter::Zero => (8, "Zero"),
            Parameter::LeanX => (9, "LeanX"),
            Parameter::LeanY => (10, "LeanY"),
            Parameter::Scale => (11, "Scale"),
        };
        self.variant("Parameter", number, name);
    }
}
