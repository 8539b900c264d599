//! The panic-free proof: what a controller calls beside the functions of the C library, whose own test links them, as
//! symbols `core_<scalar>_<function>`. The panic handler calls a function
//! that exists nowhere: what links has no path to it. The test `target::no_panic_path_survives` links all symbols, and on failure each alone;
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
            use delta_cal::calibration::JointOutcome;
            use delta_cal::kinematics::{KinematicsError, PlatformJacobian, SingularityDistance};
            use delta_cal::observations::{
                Instruments, Observation, ObservationError, ObservationOutcome, ObservationRow,
                ObservationSolver,
            };
            use delta_cal::robot::{GeometryError, SymmetricLinearRobot};
            use delta_cal::samples::{NoiseError, SampleError};
            use delta_cal::snapshot::SnapshotError;
            use delta_cal::stream::{
                AddError, Added, Forgetting, Gate, Innovation, StreamCalibrator, StreamOutcome,
                StreamRefusal, Untested,
            };
            use delta_cal::{Calibrator, Noise, Progress, Refusal, Robot, Sample, Settings};
            use nalgebra::Vector3;

            /// With twelve unknowns of instruments.
            type Solver = ObservationSolver<$t, 36, 37, 703>;

            symbols! { $prefix;
                // Robot and kinematics
                fn with_parameters(
                    robot: &Robot<$t>,
                    own: &[[$t; 8]; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    robot.with_parameters(*own)
                }
                fn linear(own: &SymmetricLinearRobot<$t>) -> Result<Robot<$t>, GeometryError> {
                    own.robot()
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
