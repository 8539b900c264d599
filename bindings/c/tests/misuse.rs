//! What C can do wrong: NULL, memory that is misaligned, too small, never initialised or of another kind, and numbers
//! that mean nothing. Every call is refused with its status, and writes nothing. Also run under Miri, which sees every
//! access to memory: `cargo verify miri`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(unsafe_code)] // the tests are in the place of C

mod support;

use core::ptr::{null, null_mut};
use delta_cal_c::single::sample::{Sample, Settings};
use delta_cal_c::single::{
    calibrator::*, gate::*, joint::*, observations::*, outcome::*, robot::*, snapshot::*,
};
use delta_cal_c::{Held, HeldMut, In, Many, New, Out, Workspace, double, error::Error, status};
use support::{Memory, dimensions, no_error, sample};

/// Every argument as a pointer to the same place.
macro_rules! every_function {
    ($place:expr) => {{
        let place: *mut u8 = $place;
        macro_rules! p {
            () => {
                unsafe { New::from_c(place) }
            };
        }
        macro_rules! m {
            () => {
                unsafe { HeldMut::from_c(place) }
            };
        }
        macro_rules! c {
            () => {
                unsafe { Held::from_c(place) }
            };
        }
        macro_rules! i {
            () => {
                unsafe { In::from_c(place) }
            };
        }
        macro_rules! o {
            () => {
                unsafe { Out::from_c(place) }
            };
        }
        macro_rules! b {
            () => {
                unsafe { Many::from_c(place) }
            };
        }
        [
            ("robot_parameters", robot_parameters(c!(), o!())),
            (
                "robot_set_transmissions",
                robot_set_transmissions(m!(), i!(), no_error()),
            ),
            ("robot_transmissions", robot_transmissions(c!(), o!())),
            ("robot_forward", robot_forward(c!(), i!(), o!(), no_error())),
            ("robot_inverse", robot_inverse(c!(), i!(), o!(), no_error())),
            (
                "calibrator_init",
                calibrator_init(p!(), 9999, c!(), i!(), no_error()),
            ),
            ("calibrator_add", calibrator_add(m!(), i!(), no_error())),
            ("calibrator_samples", calibrator_samples(c!(), o!())),
            ("calibrator_merge", calibrator_merge(m!(), c!())),
            ("calibrator_forget", calibrator_forget(m!(), 0.5)),
            ("solver_init", solver_init(p!(), 9999, m!(), no_error())),
            ("solver_step", solver_step(m!(), c!(), no_error())),
            (
                "solver_outcome",
                solver_outcome(c!(), p!(), 9999, no_error()),
            ),
            (
                "joint_calibrator_init",
                joint_calibrator_init(p!(), 9999, c!(), i!(), no_error()),
            ),
            (
                "joint_calibrator_add",
                joint_calibrator_add(m!(), i!(), no_error()),
            ),
            (
                "joint_calibrator_samples",
                joint_calibrator_samples(c!(), o!()),
            ),
            ("joint_calibrator_flush", joint_calibrator_flush(m!())),
            ("joint_calibrator_merge", joint_calibrator_merge(m!(), c!())),
            (
                "joint_calibrator_forget",
                joint_calibrator_forget(m!(), 0.5),
            ),
            (
                "joint_solver_init",
                joint_solver_init(p!(), 9999, m!(), no_error()),
            ),
            (
                "joint_solver_step",
                joint_solver_step(m!(), c!(), no_error()),
            ),
            (
                "joint_solver_outcome",
                joint_solver_outcome(c!(), c!(), p!(), 9999, no_error()),
            ),
            ("outcome_robot", outcome_robot(c!(), p!(), 9999)),
            ("outcome_arm", outcome_arm(c!(), 0, o!())),
            ("outcome_deviations", outcome_deviations(c!(), o!())),
            ("outcome_covariance", outcome_covariance(c!(), 0, o!())),
            ("joint_outcome_robot", joint_outcome_robot(c!(), p!(), 9999)),
            ("joint_outcome_arm", joint_outcome_arm(c!(), 0, o!())),
            (
                "joint_outcome_deviations",
                joint_outcome_deviations(c!(), o!()),
            ),
            (
                "joint_outcome_covariance",
                joint_outcome_covariance(c!(), o!()),
            ),
            ("joint_outcome_arms", joint_outcome_arms(c!(), p!(), 9999)),
            ("gate_init", gate_init(p!(), 9999, m!(), 0.0)),
            ("gate_add", gate_add(m!(), m!(), i!(), o!(), no_error())),
            ("gate_state", gate_state(c!(), o!())),
            ("gate_adopt", gate_adopt(m!(), m!(), c!())),
            (
                "calibrator_snapshot",
                calibrator_snapshot(c!(), o!(), 9999, o!()),
            ),
            ("calibrator_restore", calibrator_restore(m!(), b!(), 9999)),
            (
                "joint_calibrator_snapshot",
                joint_calibrator_snapshot(c!(), o!(), 9999, o!()),
            ),
            (
                "joint_calibrator_restore",
                joint_calibrator_restore(m!(), b!(), 9999),
            ),
            ("gate_snapshot", gate_snapshot(c!(), c!(), o!(), 9999, o!())),
            ("gate_restore", gate_restore(m!(), c!(), b!(), 9999)),
            (
                "observations_solve",
                observations_solve(
                    c!(),
                    unsafe { Many::from_c(place) },
                    1,
                    i!(),
                    i!(),
                    unsafe { Workspace::from_c(place) },
                    9999,
                    p!(),
                    9999,
                    no_error(),
                ),
            ),
            (
                "observation_outcome_joint",
                observation_outcome_joint(c!(), p!(), 9999),
            ),
            (
                "observation_outcome_plane",
                observation_outcome_plane(c!(), 0, o!()),
            ),
            (
                "observation_outcome_point",
                observation_outcome_point(c!(), 0, o!()),
            ),
            (
                "observation_outcome_frame",
                observation_outcome_frame(c!(), o!(), o!()),
            ),
            // Last: they may make an object.
            (
                "robot_from_dimensions",
                robot_from_dimensions(p!(), 9999, i!(), no_error()),
            ),
            (
                "robot_from_parameters",
                robot_from_parameters(p!(), 9999, i!(), no_error()),
            ),
        ]
    }};
}

/// The functions that only make an object from plain numbers.
const MAKERS: [&str; 2] = ["robot_from_dimensions", "robot_from_parameters"];

/// Of the header's functions in single precision none is missing above.
#[test]
fn every_function_is_tried() {
    let header = include_str!("../include/delta_cal.h");
    let mut declared: Vec<&str> = header
        .lines()
        .filter_map(|line| line.strip_prefix("delta_cal_status delta_cal_"))
        .filter_map(|line| line.split_once("_f32("))
        .map(|(name, _)| name)
        .collect();
    let mut tried = every_function!(null_mut()).map(|(name, _)| name);
    declared.sort_unstable();
    tried.sort_unstable();
    assert_eq!(declared, tried);
}

#[test]
fn null_is_refused_by_every_function() {
    for (function, found) in every_function!(null_mut()) {
        assert_eq!(found, status::NULL_POINTER, "{function}");
    }
}

#[test]
fn misaligned_memory_is_refused_by_every_function() {
    let mut memory = Memory::<2048>::zeroed();
    // Each as far as the strictest alignment can be missed: numbers need less than objects.
    for offset in [1, 2, 3] {
        let place = unsafe { memory.place().add(offset) };
        for (function, found) in every_function!(place) {
            assert_eq!(found, status::MISALIGNED, "{function} at {offset}");
        }
    }
    assert!(memory.is_filled_with(0));
}

#[test]
fn memory_without_an_object_is_refused_by_every_function() {
    for byte in [0, 0xa5, 0xff] {
        let mut memory = Memory::<2048>::filled_with(byte);
        let place = memory.place();
        for (function, found) in every_function!(place) {
            if !MAKERS.contains(&function) {
                assert_eq!(found, status::NOT_INITIALIZED, "{function}, {byte:#x}");
            }
        }
    }
}

#[test]
fn an_object_of_another_kind_is_refused_by_every_function() {
    // In double precision, which none of the functions in single precision takes.
    let mut robot = Memory::<2048>::zeroed();
    let dimensions = double::robot::Dimensions {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
        azimuth: 0.0,
    };
    let made = unsafe {
        double::robot::robot_from_dimensions(
            New::from_c(robot.place()),
            2048,
            In::from_c((&raw const dimensions).cast()),
            no_error(),
        )
    };
    assert_eq!(made, status::OK);
    for (function, found) in every_function!(robot.place()) {
        if !MAKERS.contains(&function) {
            assert_eq!(found, status::WRONG_KIND, "{function}");
        }
    }
}

#[test]
fn a_size_that_is_too_small_is_refused() {
    let size = delta_cal_c::kind::ALL[0].scalars[0].1;
    for wrong in [0, 8, size - 1] {
        let mut memory = Memory::<2048>::filled_with(0x5a);
        let made = unsafe {
            robot_from_dimensions(
                New::from_c(memory.place()),
                wrong,
                In::from_c((&raw const *dimensions()).cast()),
                no_error(),
            )
        };
        assert_eq!(made, status::WRONG_SIZE);
        assert!(memory.is_filled_with(0x5a), "something was written");
    }
}

#[test]
fn two_calibrators_in_one_place_are_refused() {
    let mut robot = Memory::<2048>::robot();
    let mut calibrator = Memory::<2048>::calibrator(&mut robot, &Settings::default());
    let place = calibrator.place();
    let found = unsafe { calibrator_merge(HeldMut::from_c(place), Held::from_c(place)) };
    assert_eq!(found, status::OVERLAP);
    // The object is as usable as before.
    let sample = sample(&mut robot, [0.1, 0.2, 0.3]);
    let found = unsafe {
        calibrator_add(
            HeldMut::from_c(place),
            In::from_c((&raw const sample).cast()),
            no_error(),
        )
    };
    assert_eq!(found, status::OK);
}

/// Every number of the settings that means nothing.
#[test]
fn settings_that_mean_nothing_are_refused() {
    let mut robot = Memory::<2048>::robot();
    let plain = Settings::default();
    let mut wrong = vec![];
    let mut case = |expected: i32, change: &dyn Fn(&mut Settings)| {
        let mut settings = plain;
        change(&mut settings);
        wrong.push((expected, settings));
    };
    case(status::NOISE_OF_POSITION, &|s| s.joint_noise = 1e-3);
    case(status::NOISE_OF_POSITION, &|s| {
        s.position_noise = [0.02, 0.02, 0.0];
    });
    case(status::NOISE_OF_POSITION, &|s| {
        s.position_noise = [f32::NAN; 3];
    });
    case(status::NOISE_OF_JOINT, &|s| {
        s.position_noise = [0.02; 3];
        s.joint_noise = -1.0;
    });
    case(status::TOLERANCE_OF_LENGTH, &|s| s.angle_tolerance = 1e-3);
    case(status::TOLERANCE_OF_ANGLE, &|s| s.length_tolerance = 0.5);
    case(status::NO_SUCH_CHOICE, &|s| s.solver = 2);
    case(status::NO_SUCH_CHOICE, &|s| s.start = -1);
    case(status::NO_SUCH_CHOICE, &|s| s.iteration_limit = 65_536);
    for (expected, settings) in wrong {
        let mut memory = Memory::<8192>::filled_with(0x5a);
        let mut error = Error::from(status::OK);
        let found = unsafe {
            joint_calibrator_init(
                New::from_c(memory.place()),
                8192,
                Held::from_c(robot.place()),
                In::from_c((&raw const settings).cast()),
                Out::from_c((&raw mut error).cast()),
            )
        };
        assert_eq!(found, expected, "{settings:?}");
        assert_eq!(error.status, expected);
        assert!(memory.is_filled_with(0x5a), "something was written");
    }
}

/// The error names arm and cause, and the calibrator holds what it held.
#[test]
fn a_faulty_sample_is_refused_with_its_arm() {
    let mut robot = Memory::<2048>::robot();
    let mut calibrator = Memory::<2048>::calibrator(&mut robot, &Settings::default());
    let good = sample(&mut robot, [0.1, 0.2, 0.3]);
    let [q1, _, q3] = good.joints;
    for (expected, arm, faulty) in [
        (
            status::SAMPLE_JOINT_NOT_FINITE,
            1,
            Sample {
                joints: [q1, f32::NAN, q3],
                ..good
            },
        ),
        (
            status::SAMPLE_JOINT_TOO_LARGE,
            2,
            Sample {
                joints: [q1, q3, 45.0],
                ..good
            },
        ),
        (
            status::SAMPLE_POSITION_NOT_FINITE,
            -1,
            Sample {
                position: [f32::INFINITY; 3],
                ..good
            },
        ),
    ] {
        let mut error = Error::from(status::OK);
        let found = unsafe {
            calibrator_add(
                HeldMut::from_c(calibrator.place()),
                In::from_c((&raw const faulty).cast()),
                Out::from_c((&raw mut error).cast()),
            )
        };
        assert_eq!((found, error.status, error.arm), (expected, expected, arm));
    }
    let mut count = 7_u64;
    let found = unsafe {
        calibrator_samples(
            Held::from_c(calibrator.place()),
            Out::from_c((&raw mut count).cast()),
        )
    };
    assert_eq!((found, count), (status::OK, 0));
}

#[test]
fn every_number_has_a_text() {
    for number in [-1, 0, 13, 127, 9999] {
        let text = delta_cal_c::library::status_text(number);
        assert_ne!(text, null());
        let text = unsafe { core::ffi::CStr::from_ptr(text) };
        assert!(!text.to_bytes().starts_with(b" ") && text.to_bytes().ends_with(b"."));
    }
}
