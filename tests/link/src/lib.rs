//! The proof of freedom from panics: the functions that a controller calls besides those of the C library, whose own
//! test links them, as symbols `core_<scalar>_<function>`. The panic handler calls a function that does not exist, so
//! whatever links has no path to it. The test `target::no_panic_path_survives` links all symbols together, and on
//! failure each one separately; `panics_on_purpose` must not link, or the proof would prove nothing.
//!
//! Excluded: `Display`, `Debug` and the like (the formatting in `core::fmt` has panic paths), and features that add
//! foreign traits.

#![cfg_attr(target_os = "none", no_std)]
#![allow(unsafe_code)] // exports symbols, and calls an undefined one
#![allow(improper_ctypes_definitions)] // never called

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

    /// Contains a panic path: an index unknown to the optimiser.
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
            use delta_cal::calibration::{Joint, JointOutcome};
            use delta_cal::kinematics::{KinematicsError, PlatformJacobian, SingularityDistance};
            use delta_cal::observations::{
                FkmCalibrator, Instruments, Observation, ObservationError, ObservationOutcome,
            };
            use delta_cal::robot::GeometryError;
            use delta_cal::samples::SampleError;
            use delta_cal::snapshot::SnapshotError;
            use delta_cal::stream::{Forgetting, Innovation, StreamCalibrator, Verdict};
            use delta_cal::{
                IkmCalibrator, Noise, Progress, Refusal, Robot, Sample, SettingError, Settings,
            };
            use nalgebra::Vector3;

            /// With twelve instrument unknowns.
            type Readings = FkmCalibrator<$t, 40, 36>;
            type Stream = StreamCalibrator<$t, Joint>;

            symbols! { $prefix;
                // Robot and kinematics
                fn with_parameters(
                    robot: &Robot<$t>,
                    own: &[[$t; 8]; 3],
                ) -> Result<Robot<$t>, GeometryError> {
                    robot.with_parameters(*own)
                }
                fn linear(radius: $t, forearm: $t) -> Result<Robot<$t>, GeometryError> {
                    Robot::linear(radius, forearm, None)
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
                fn noise(position: &[$t; 3], joint: $t) -> Result<Noise<$t>, SettingError> {
                    Noise::by_axis(*position, joint)
                }

                // Each arm
                fn arms_add_many(
                    own: &mut IkmCalibrator<$t>,
                    samples: &[Sample<$t>; 40],
                ) -> Result<(), (usize, SampleError)> {
                    own.add_many(samples)
                }
                fn arms_add_forgetting(
                    own: &mut IkmCalibrator<$t>,
                    sample: &Sample<$t>,
                    memory: &Forgetting<$t>,
                ) -> Result<(), SampleError> {
                    own.add_forgetting(sample, memory)
                }

                // Any readings
                fn readings_new(
                    robot: &Robot<$t>,
                    instruments: &Instruments<'_, $t>,
                    settings: &Settings<$t>,
                ) -> Result<Readings, Refusal> {
                    Readings::new(robot, instruments, settings)
                }
                fn readings_add(
                    own: &mut Readings,
                    observation: &Observation<$t>,
                ) -> Result<(), ObservationError> {
                    own.add(observation)
                }
                fn readings_solve(own: &mut Readings) -> Result<(), Refusal> { own.solve() }
                fn readings_step(own: &mut Readings) -> Progress { own.step() }
                fn readings_found(
                    own: &Readings,
                ) -> Result<ObservationOutcome<$t, 36>, Refusal> {
                    own.outcome().cloned()
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

                // Samples one at a time
                fn stream_innovations(
                    stream: &Stream,
                    sample: &Sample<$t>,
                ) -> Result<[Innovation<$t>; 3], Verdict<$t>> {
                    stream.innovations(sample)
                }
                fn stream_add(
                    stream: &mut Stream,
                    sample: &Sample<$t>,
                ) -> Result<Verdict<$t>, SampleError> {
                    stream.add(sample)
                }
                fn stream_solve(stream: &mut Stream) -> Result<(), Refusal> { stream.solve() }
                fn stream_step(stream: &mut Stream) -> Progress { stream.step() }
                fn stream_reset(stream: &mut Stream) -> () { stream.reset(); }
                fn stream_outcome(
                    stream: &Stream,
                ) -> Result<JointOutcome<$t>, Refusal> {
                    stream.outcome().cloned()
                }
                fn stream_snapshot(
                    stream: &Stream,
                    bytes: &mut [u8; 20_000],
                    length: usize,
                ) -> Result<usize, SnapshotError> {
                    stream.snapshot(bytes.get_mut(..length).unwrap_or_default()).map(|it| it.len())
                }
                fn stream_restore(
                    stream: &mut Stream,
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
