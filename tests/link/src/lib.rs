//! The panic-free proof: what a controller calls, as symbols `core_<scalar>_<function>`. The panic handler calls a function
//! that exists nowhere: what links has no path to it. The test `budgets` links all symbols, and on failure each alone;
//! `panics_on_purpose` must not link, or the proof would prove nothing.
//!
//! Not among them: `Display`, `Debug` and the like (the formatting of `core::fmt` has panic paths), and the features that
//! add foreign traits.

#![cfg_attr(target_os = "none", no_std)]
#![allow(unsafe_code)] // naming a symbol, and calling one that nobody defines
#![allow(improper_ctypes_definitions)] // nobody calls them

#[cfg(target_os = "none")]
mod handler {
    use core::panic::PanicInfo;

    unsafe extern "C" {
        fn a_panic_path_survives() -> !;
    }

    #[panic_handler]
    fn panicked(_: &PanicInfo<'_>) -> ! {
        unsafe { a_panic_path_survives() }
    }

    /// Has a panic path: an index that the optimiser cannot know.
    #[unsafe(no_mangle)]
    extern "C" fn panics_on_purpose(numbers: &[u32; 4], index: usize) -> u32 {
        numbers[index]
    }
}

/// Results are written through a pointer.
#[cfg(target_os = "none")]
macro_rules! symbols {
    ($prefix:literal; $(
        fn $name:ident($($argument:ident: $kind:ty),* $(,)?) -> $result:ty $body:block
    )*) => {$(
        #[unsafe(export_name = concat!("core_", $prefix, stringify!($name)))]
        extern "C" fn $name(out: &mut MaybeUninit<$result>, $($argument: $kind),*) {
            out.write($body);
        }
    )*};
}

#[cfg(target_os = "none")]
macro_rules! of_scalar {
    ($module:ident, $prefix:literal, $t:ident) => {
        mod $module {
            use core::mem::MaybeUninit;
            use delta_cal::calibration::{JointCalibrator, JointOutcome, JointSolver};
            use delta_cal::kinematics::{KinematicsError, PlatformJacobian, SingularityDistance};
            use delta_cal::observations::{
                Instruments, Observation, ObservationError, ObservationOutcome, ObservationRow,
                ObservationSolver,
            };
            use delta_cal::robot::{GeometryError, SymmetricLinearRobot, Transmission};
            use delta_cal::samples::{MergeError, NoiseError, SampleError};
            use delta_cal::snapshot::SnapshotError;
            use delta_cal::stream::{
                AddError, Added, Forgetting, Gate, Innovation, StreamCalibrator, StreamOutcome,
                StreamRefusal, Untested, Verdict,
            };
            use delta_cal::{
                Calibrator, Noise, Progress, Refusal, Robot, RobotOutcome, RobotSolver, Sample,
                Settings, SymmetricRobot,
            };
            use nalgebra::Vector3;

            /// With twelve unknowns of instruments.
            type Solver = ObservationSolver<$t, 36, 37, 703>;

            symbols! { $prefix;
                // Robot and kinematics
                fn from_parameters(own: &[[$t; 8]; 3]) -> Result<Robot<$t>, GeometryError> {
                    Robot::from_parameters(*own)
                }
                fn with_parameters(
                    robot: &Robot<$t>,
                    own: &[[$t; 8]; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    robot.with_parameters(*own)
                }
                fn with_transmissions(
                    robot: &Robot<$t>,
                    own: &[Transmission<$t>; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    robot.with_transmissions(*own)
                }
                fn rotary(own: &SymmetricRobot<$t>) -> Result<Robot<$t>, GeometryError> {
                    own.robot()
                }
                fn linear(own: &SymmetricLinearRobot<$t>) -> Result<Robot<$t>, GeometryError> {
                    own.robot()
                }
                fn forward(
                    robot: &Robot<$t>,
                    q: &[$t; 3],
                ) -> Result<Vector3<$t>, KinematicsError> {
                    robot.forward(q)
                }
                fn inverse(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                ) -> Result<[$t; 3], KinematicsError> {
                    robot.inverse(x)
                }
                fn jacobian(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                    q: &[$t; 3],
                ) -> Result<PlatformJacobian<$t>, KinematicsError> {
                    robot.platform_jacobian(x, q)
                }
                fn singularity(
                    robot: &Robot<$t>,
                    x: &Vector3<$t>,
                    q: &[$t; 3],
                ) -> SingularityDistance<$t> {
                    robot.singularity_distance(x, q)
                }
                fn noise(position: &[$t; 3], joint: $t) -> Result<Noise<$t>, NoiseError> {
                    Noise::by_axis(*position, joint)
                }

                // Each arm
                fn arms_new(robot: &Robot<$t>, settings: &Settings<$t>) -> Calibrator<$t> {
                    Calibrator::new(robot, settings)
                }
                fn arms_add(
                    own: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    own.add(sample)
                }
                fn arms_add_many(
                    own: &mut Calibrator<$t>,
                    samples: &[Sample<$t>; 40],
                ) -> Result<(), (usize, SampleError)> {
                    own.add_many(samples)
                }
                fn arms_add_forgetting(
                    own: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                    memory: &Forgetting<$t>,
                ) -> Result<(), SampleError> {
                    own.add_forgetting(sample, memory)
                }
                fn arms_merge(
                    own: &mut Calibrator<$t>,
                    other: &Calibrator<$t>,
                ) -> Result<(), MergeError> {
                    own.merge(other)
                }
                fn arms_begin(
                    own: &mut Calibrator<$t>,
                ) -> Result<RobotSolver<$t>, Refusal> {
                    RobotSolver::new(own)
                }
                fn arms_step(
                    solver: &mut RobotSolver<$t>,
                    own: &Calibrator<$t>,
                ) -> Result<Progress, Refusal> {
                    solver.step(own)
                }
                fn arms_outcome(
                    solver: &RobotSolver<$t>,
                ) -> Result<RobotOutcome<$t>, Refusal> {
                    solver.outcome()
                }
                fn arms_snapshot(
                    own: &Calibrator<$t>,
                    bytes: &mut [u8; 20_000],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    own.snapshot(bytes.get_mut(..length).unwrap_or_default()).map(|it| it.len())
                }
                fn arms_restore(
                    own: &mut Calibrator<$t>,
                    bytes: &[u8; 20_000],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    own.restore(bytes.get(..length).unwrap_or_default())
                }

                // All arms together
                fn joint_new(robot: &Robot<$t>, settings: &Settings<$t>) -> JointCalibrator<$t> {
                    JointCalibrator::new(robot, settings)
                }
                fn joint_add(
                    own: &mut JointCalibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<(), SampleError> {
                    own.add(sample)
                }
                fn joint_begin(
                    own: &mut JointCalibrator<$t>,
                ) -> Result<JointSolver<$t>, Refusal> {
                    JointSolver::new(own)
                }
                fn joint_step(
                    solver: &mut JointSolver<$t>,
                    own: &JointCalibrator<$t>,
                ) -> Progress {
                    solver.step(own)
                }
                fn joint_outcome(
                    solver: &JointSolver<$t>,
                    own: &JointCalibrator<$t>,
                ) -> Result<JointOutcome<$t>, Refusal> {
                    solver.outcome(own)
                }
                fn joint_snapshot(
                    own: &JointCalibrator<$t>,
                    bytes: &mut [u8; 20_000],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    own.snapshot(bytes.get_mut(..length).unwrap_or_default()).map(|it| it.len())
                }
                fn joint_restore(
                    own: &mut JointCalibrator<$t>,
                    bytes: &[u8; 20_000],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    own.restore(bytes.get(..length).unwrap_or_default())
                }

                // Any readings
                fn row(
                    observation: &Observation<$t>,
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                ) -> Result<ObservationRow<$t>, ObservationError> {
                    ObservationRow::checked(*observation, robot, instruments)
                }
                fn readings_new() -> Solver { Solver::new() }
                fn readings_step(
                    solver: &mut Solver,
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                    rows: &mut [ObservationRow<$t>],
                    settings: &Settings<$t>,
                ) -> Option<Result<ObservationOutcome<$t, 36>, Refusal>> {
                    solver.step(robot, instruments, rows, settings)
                }
                fn readings_outcome(
                    outcome: &ObservationOutcome<$t, 36>,
                    instruments: &Instruments<'_, $t>,
                    place: u8,
                ) -> ([$t; 3], [$t; 4], JointOutcome<$t>) {
                    (
                        outcome.plane(instruments, place),
                        outcome.point(instruments, place),
                        outcome.of_robot(),
                    )
                }

                // Samples one after the other
                fn gate_new(own: &mut Calibrator<$t>) -> Gate<$t> { Gate::new(own) }
                fn gate_add(
                    gate: &mut Gate<$t>,
                    own: &mut Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<Verdict<$t>, SampleError> {
                    gate.add(own, sample)
                }
                fn gate_adopt(
                    gate: &mut Gate<$t>,
                    own: &mut Calibrator<$t>,
                    outcome: &RobotOutcome<$t>,
                ) -> () {
                    gate.adopt(own, outcome);
                }
                fn gate_innovations(
                    gate: &Gate<$t>,
                    own: &Calibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<[Innovation<$t>; 3], Untested> {
                    gate.innovations(own, sample)
                }
                fn stream_add(
                    stream: &mut StreamCalibrator<$t>,
                    sample: &Sample<$t>,
                ) -> Result<Added<$t>, AddError> {
                    stream.add(sample)
                }
                fn stream_solve(stream: &mut StreamCalibrator<$t>) -> () { stream.solve(); }
                fn stream_step(stream: &mut StreamCalibrator<$t>) -> Progress { stream.step() }
                fn stream_result(
                    stream: &StreamCalibrator<$t>,
                ) -> Option<Result<StreamOutcome<$t>, StreamRefusal>> {
                    stream.result().map(|result| result.copied())
                }
                fn stream_snapshot(
                    stream: &StreamCalibrator<$t>,
                    bytes: &mut [u8; 20_000],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    stream.snapshot(bytes.get_mut(..length).unwrap_or_default()).map(|it| it.len())
                }
                fn stream_restore(
                    stream: &mut StreamCalibrator<$t>,
                    bytes: &[u8; 20_000],
                    length: usize,
                ) -> Result<(), SnapshotError> {
                    stream.restore(bytes.get(..length).unwrap_or_default())
                }
            }
        }
    };
}

#[cfg(target_os = "none")]
of_scalar!(single, "f32_", f32);
#[cfg(target_os = "none")]
of_scalar!(double, "f64_", f64);
