//! `defmt::Format` for the public types that contain matrices, which do not implement it. Other types derive it.

use crate::Real;
use crate::calibration::{ArmOutcome, Calibrator, Estimator, RobotOutcome};
use crate::robot::{Arm, Parameter, Robot};
use crate::samples::Sample;
use defmt::{Format, Formatter, write};

impl<T: Real + Format> Format for Arm<T> {
    fn format(&self, formatter: Formatter<'_>) {
        write!(formatter, "Arm {}", self.parameters());
    }
}

impl<T: Real + Format> Format for Robot<T> {
    fn format(&self, formatter: Formatter<'_>) {
        write!(formatter, "Robot {}", self.arms());
    }
}

impl<T: Real + Format> Format for Sample<T> {
    fn format(&self, formatter: Formatter<'_>) {
        write!(formatter, "{} at {}", self.position.data.0, self.joints);
    }
}

impl<T: Real + Format, E: Estimator> Format for Calibrator<T, E> {
    fn format(&self, formatter: Formatter<'_>) {
        write!(
            formatter,
            "calibrator of {}, {} samples, {}",
            self.robot(),
            self.samples(),
            self.settings()
        );
    }
}

impl<T: Real + Format> Format for ArmOutcome<T> {
    fn format(&self, formatter: Formatter<'_>) {
        write!(
            formatter,
            "{}; {} samples, {} iterations ({}), residual {}, condition {}, sigma {}",
            self.arm,
            self.samples,
            self.iterations,
            self.termination,
            self.residual_rms,
            self.condition,
            Parameter::ROTARY.map(|parameter| self.standard_deviation(parameter))
        );
    }
}

impl<T: Real + Format> Format for RobotOutcome<T> {
    fn format(&self, formatter: Formatter<'_>) {
        write!(formatter, "{}", self.arms);
    }
}
