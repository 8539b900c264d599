//! The stream with everything in it, and snapshots.

use core::mem::MaybeUninit;
use delta_cal::calibration::JointCalibrator;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{
    AddError, Added, Alarm, Gate, GateCounts, HeldOutRefusal, Innovation, StreamCalibrator,
    StreamOptions, StreamOutcome, StreamRefusal, Validation, Verdict,
};
use delta_cal::{ArmIndex, Calibrator, Progress, Robot, Sample, Settings};

/// Any number of bytes.
const BYTES: usize = 20_000;

macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident, $other:ident) => {
        mod $module {
            use super::*;

            symbols! { $prefix;
                fn stream_new(
                    robot: &Robot<$t>,
                    settings: &Settings<$t>,
                    options: &StreamOptions<$t>,
                ) -> Result<StreamCalibrator<$t>, HeldOutRefusal> {
                    StreamCalibrator::new(robot, settings, options)
                }
                fn stream_add(
                    stream: &mut StreamCalibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<Added<$t>, AddError> {
                    stream.add(sample)
                }
                fn stream_solve(stream: &mut StreamCalibrator<$t>) -> () { stream.solve(); }
                fn stream_step(stream: &mut StreamCalibrator<$t>) -> Progress { stream.step() }
                fn stream_solving(stream: &StreamCalibrator<$t>) -> bool { stream.solving() }
                fn stream_arm(stream: &StreamCalibrator<$t>) -> Option<ArmIndex> { stream.arm() }
                fn stream_result(
                    stream: &StreamCalibrator<$t>,
                ) -> Option<Result<StreamOutcome<$t>, StreamRefusal>> {
                    stream.result().map(|result| result.copied())
                }
                fn stream_robot(outcome: &StreamOutcome<$t>) -> Robot<$t> { *outcome.robot() }
                fn stream_validations(
                    stream: &StreamCalibrator<$t>,
                ) -> Option<[Validation<$t>; 3]> {
                    stream.validations().copied()
                }
                fn stream_options(stream: &StreamCalibrator<$t>) -> StreamOptions<$t> {
                    *stream.options()
                }
                fn stream_settings(stream: &StreamCalibrator<$t>) -> Settings<$t> {
                    *stream.settings()
                }
                fn stream_samples(stream: &StreamCalibrator<$t>) -> u64 { stream.samples() }
                fn stream_gate_counts(stream: &StreamCalibrator<$t>) -> Option<GateCounts> {
                    stream.gate_counts().copied()
                }
                fn stream_alarm(stream: &StreamCalibrator<$t>) -> Option<Alarm> { stream.alarm() }
                fn stream_snapshot(
                    stream: &StreamCalibrator<$t>,
                    bytes: &mut [u8; BYTES],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    let bytes = bytes.get_mut(..length).unwrap_or_default();
                    stream.snapshot(bytes).map(|written| written.len())
                }
                fn stream_restore(
                    stream: &mut StreamCalibrator<$t>,
                    bytes: &[u8; BYTES],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    stream.restore(bytes.get(..length).unwrap_or_default())
                }
                fn calibrator_snapshot(
                    calibrator: &Calibrator<$t>,
                    bytes: &mut [u8; BYTES],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    let bytes = bytes.get_mut(..length).unwrap_or_default();
                    calibrator.snapshot(bytes).map(|written| written.len())
                }
                fn calibrator_restore(
                    calibrator: &mut Calibrator<$t>,
                    bytes: &[u8; BYTES],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    calibrator.restore(bytes.get(..length).unwrap_or_default())
                }
                fn joint_calibrator_snapshot(
                    calibrator: &JointCalibrator<$t>,
                    bytes: &mut [u8; BYTES],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    let bytes = bytes.get_mut(..length).unwrap_or_default();
                    calibrator.snapshot(bytes).map(|written| written.len())
                }
                fn joint_calibrator_restore(
                    calibrator: &mut JointCalibrator<$t>,
                    bytes: &[u8; BYTES],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    calibrator.restore(bytes.get(..length).unwrap_or_default())
                }
                fn gate_snapshot(
                    gate: &Gate<$t>,
                    calibrator: &Calibrator<$t>,
                    bytes: &mut [u8; BYTES],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    let bytes = bytes.get_mut(..length).unwrap_or_default();
                    gate.snapshot(calibrator, bytes).map(|written| written.len())
                }
                fn gate_restore(
                    gate: &mut Gate<$t>,
                    calibrator: &Calibrator<$t>,
                    bytes: &[u8; BYTES],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    gate.restore(calibrator, bytes.get(..length).unwrap_or_default())
                }
                fn innovation_cast(innovation: &Innovation<$t>) -> Innovation<$other> {
                    innovation.cast()
                }
                fn verdict_cast(verdict: &Verdict<$t>) -> Verdict<$other> { verdict.cast() }
                fn added_cast(added: &Added<$t>) -> Added<$other> { added.cast() }
                fn validation_cast(validation: &Validation<$t>) -> Validation<$other> {
                    validation.cast()
                }
            }
        }
    };
}

of_scalar!(single, "f32_", f32, f64);
of_scalar!(double, "f64_", f64, f32);
