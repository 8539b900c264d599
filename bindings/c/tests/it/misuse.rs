//! What C can do wrong: NULL, memory that is misaligned, too small, never initialised or of another kind, and numbers
//! that mean nothing. Every call is refused with its status, and writes nothing. Also run under Miri, which sees every
//! access to memory: `cargo verify miri`.

use crate::place::{Place, at, in_c, input, noise_alone, null, ok, output, robot};
use core::ptr::null_mut;
use delta_cal::Robot;
use delta_cal_c::double::robot::*;
use delta_cal_c::double::sample::{Sample, Settings};
use delta_cal_c::double::{fkm, gate, ikm, joint, joint_gate};
use delta_cal_c::kind::{Ikm, Joint};
use delta_cal_c::{error::Error, single, status};
use delta_cal_target_tests::samples;
use std::collections::BTreeSet;

/// Memory that is larger than every object.
const ROOM: usize = 65_536;

/// Every argument as a pointer to the same place.
fn every_function(place: *mut u8) -> Vec<(String, i32)> {
    macro_rules! p {
        () => {
            at(place)
        };
    }
    let mut found: Vec<(String, i32)> = Vec::new();
    macro_rules! tried {
        ($prefix:literal: $($name:ident ($($argument:expr),*))+) => {
            $(found.push((format!("{}{}", $prefix, stringify!($name)), $name($($argument),*)));)+
        };
    }
    macro_rules! calibrator {
        ($family:ident $prefix:literal: $($name:ident ($($argument:expr),*))*) => {{
            use $family::*;
            tried! { $prefix:
                samples(p!(), p!())
                solve(p!(), null())
                step(p!())
                solving(p!())
                finished(p!())
                stop(p!())
                reset(p!())
                finish(p!(), p!(), ROOM, null())
                arm(p!(), 0, p!())
                deviations(p!(), p!())
                covariance(p!(), p!())
                snapshot(p!(), p!(), ROOM, p!())
                restore(p!(), p!(), ROOM)
                $($name($($argument),*))*
            }
        }};
    }
    macro_rules! of_positions {
        ($family:ident $prefix:literal) => {
            calibrator! { $family $prefix:
                init(p!(), ROOM, p!(), p!(), null())
                add(p!(), p!(), null())
                flush(p!())
                merge(p!(), p!())
                forget(p!(), 0.5)
            }
        };
    }
    macro_rules! gated {
        ($family:ident $prefix:literal) => {
            calibrator! { $family $prefix:
                init(p!(), ROOM, p!(), p!(), 0.0, 0.0, null())
                add(p!(), p!(), p!(), null())
                state(p!(), p!())
                acknowledge(p!())
            }
        };
    }
    of_positions!(ikm "ikm_");
    of_positions!(joint "joint_");
    gated!(gate "gate_");
    gated!(joint_gate "joint_gate_");
    calibrator! { fkm "fkm_":
        init(p!(), ROOM, p!(), p!(), p!(), null())
        add(p!(), p!(), null())
        plane(p!(), 0, p!())
        point(p!(), 0, p!())
        frame(p!(), p!(), p!())
    }
    tried! { "":
        robot_parameters(p!(), p!())
        robot_set_transmissions(p!(), p!(), null())
        robot_transmissions(p!(), p!())
        robot_forward(p!(), p!(), p!(), null())
        robot_inverse(p!(), p!(), p!(), null())
        // Last: they may make an object.
        robot_from_dimensions(p!(), ROOM, p!(), null())
        robot_from_parameters(p!(), ROOM, p!(), null())
    }
    found
}

/// The functions that only make an object from plain numbers.
fn makes_a_robot(function: &str) -> bool {
    function.starts_with("robot_from_")
}

/// Of the header's functions in double precision none is missing above.
#[test]
fn every_function_is_tried() {
    let header = include_str!("../../include/delta_cal.h");
    let of_double = |line: &str| {
        let line = line.strip_prefix("dcal_status dcal_")?;
        Some(line.split_once("_f64(")?.0.to_owned())
    };
    let declared: BTreeSet<String> = header.lines().filter_map(of_double).collect();
    let tried = every_function(null_mut()).into_iter();
    let tried: BTreeSet<String> = tried.map(|(name, _)| name).collect();
    assert_eq!(declared, tried);
}

#[test]
fn null_is_refused_by_every_function() {
    for (function, found) in every_function(null_mut()) {
        assert_eq!(found, status::NULL_POINTER, "{function}");
    }
}

#[test]
fn misaligned_memory_is_refused_by_every_function() {
    let mut memory = vec![0_u64; ROOM / 8];
    // Each as far as the strictest alignment can be missed: numbers need less than objects.
    for offset in [1, 2, 3] {
        let place = memory.as_mut_ptr().cast::<u8>().wrapping_add(offset);
        for (function, found) in every_function(place) {
            assert_eq!(found, status::MISALIGNED, "{function} at {offset}");
        }
    }
    assert!(memory.iter().all(|word| *word == 0));
}

#[test]
fn memory_without_an_object_is_refused_by_every_function() {
    for byte in [0, 0xa5, 0xff] {
        let mut memory = vec![u64::from_ne_bytes([byte; 8]); ROOM / 8];
        for (function, found) in every_function(memory.as_mut_ptr().cast()) {
            if !makes_a_robot(&function) {
                assert_eq!(found, status::NOT_INITIALIZED, "{function}, {byte:#x}");
            }
        }
    }
}

#[test]
fn an_object_of_another_kind_is_refused_by_every_function() {
    // In single precision, which none of the functions in double precision takes.
    let mut memory = vec![0_u64; ROOM / 8];
    let place: *mut u8 = memory.as_mut_ptr().cast();
    let dimensions = [194.0_f32, 30.0, 260.0, 480.0, 0.0];
    let from = at((&raw const dimensions).cast_mut().cast());
    ok(single::robot::robot_from_dimensions(
        at(place),
        ROOM,
        from,
        null(),
    ));
    for (function, found) in every_function(place) {
        if !makes_a_robot(&function) {
            assert_eq!(found, status::WRONG_KIND, "{function}");
        }
    }
}

/// Memory that outlasts an update of the firmware holds an object of the library before.
#[test]
fn an_object_of_another_version_is_refused() {
    let mut robot = robot();
    let good = robot.words()[0];
    for bit in 0..64 {
        robot.words()[0] = good ^ (1 << bit);
        let found = robot_parameters(robot.held(), output(&mut [[0.0; 8]; 3]));
        assert_eq!(found, status::NOT_INITIALIZED, "bit {bit}");
    }
    robot.words()[0] = good;
    ok(robot_parameters(robot.held(), output(&mut [[0.0; 8]; 3])));
}

#[test]
fn a_size_that_is_too_small_is_refused() {
    let mut memory = Place::<Robot<f64>>::filled_with(0x5a);
    let dimensions = [194.0, 30.0, 260.0, 480.0, 0.0];
    for wrong in [0, 8, memory.size() - 1] {
        let from = at((&raw const dimensions).cast_mut().cast());
        let made = robot_from_dimensions(memory.new_object(), wrong, from, null());
        assert_eq!(made, status::WRONG_SIZE);
        assert!(memory.is_filled_with(0x5a), "something was written");
    }
}

fn calibrator() -> Place<Ikm<f64>> {
    let (mut robot, mut calibrator) = (robot(), Place::new());
    let (new, size) = (calibrator.new_object(), calibrator.size());
    let settings = noise_alone();
    ok(ikm::init(new, size, robot.held(), input(&settings), null()));
    calibrator
}

#[test]
fn two_calibrators_in_one_place_are_refused() {
    let mut calibrator = calibrator();
    let place = calibrator.start();
    assert_eq!(ikm::merge(at(place), at(place)), status::OVERLAP);
    // The object is as usable as before.
    let sample = in_c(&samples()[0]);
    ok(ikm::add(calibrator.held_mut(), input(&sample), null()));
}

/// The numbers are read before the robot is changed, so that they may lie in it.
#[test]
fn transmissions_within_the_robot_are_read_first() {
    let mut robot = robot();
    let (mut before, mut after) = ([[0.0; 8]; 3], [[0.0; 8]; 3]);
    ok(robot_parameters(robot.held(), output(&mut before)));
    let within = at(robot.start().wrapping_add(8));
    let found = robot_set_transmissions(robot.held_mut(), within, null());
    assert_eq!(found, status::GEOMETRY_TRANSMISSION);
    ok(robot_parameters(robot.held(), output(&mut after)));
    assert_eq!(before, after);
}

/// Every number of the settings that means nothing, and those that mean something else.
#[test]
fn settings_that_mean_nothing_are_refused() {
    use delta_cal_c::plain::{GAUSS_NEWTON, START_FREE};
    let mut robot = robot();
    let mut refused = |expected: i32, change: &dyn Fn(&mut Settings)| {
        let mut settings = Settings::default();
        change(&mut settings);
        let mut memory = Place::<Joint<f64>>::filled_with(0x5a);
        let mut error = Error::from(status::OK);
        let (new, size) = (memory.new_object(), memory.size());
        let (from, why) = (input(&settings), output(&mut error));
        let found = joint::init(new, size, robot.held(), from, why);
        assert_eq!((found, error.status), (expected, expected), "{settings:?}");
        assert!(memory.is_filled_with(0x5a), "something was written");
    };
    refused(status::NOISE_OF_POSITION, &|s| s.joint_noise = 1e-3);
    refused(status::NOISE_OF_POSITION, &|s| {
        s.position_noise = [0.02, 0.02, 0.0];
    });
    refused(status::NOISE_OF_POSITION, &|s| {
        s.position_noise = [f64::NAN; 3];
    });
    refused(status::NOISE_OF_JOINT, &|s| {
        s.position_noise = [0.02; 3];
        s.joint_noise = -1.0;
    });
    refused(status::TOLERANCE_OF_LENGTH, &|s| s.angle_tolerance = 1e-3);
    refused(status::TOLERANCE_OF_ANGLE, &|s| s.length_tolerance = 0.5);
    refused(status::TOLERANCE_OF_LENGTH, &|s| {
        s.joint_zero_tolerance = 0.1;
    });
    refused(status::TOLERANCE_OF_JOINT_ZERO, &|s| {
        (s.length_tolerance, s.angle_tolerance) = (0.5, 1e-3);
        s.joint_zero_tolerance = -0.1;
    });
    // A start is no solver, and a solver no start.
    for solver in [-1, START_FREE, 3] {
        refused(status::NO_SUCH_CHOICE, &|s| s.solver = solver);
    }
    for start in [-1, GAUSS_NEWTON, 3] {
        refused(status::NO_SUCH_CHOICE, &|s| s.start = start);
    }
    refused(status::NO_SUCH_CHOICE, &|s| s.iteration_limit = 65_536);
    refused(status::NO_SUCH_CHOICE, &|s| s.reserved = 1);
}

/// The error names arm and cause, and the calibrator holds what it held.
#[test]
fn a_faulty_sample_is_refused_with_its_arm() {
    let mut calibrator = calibrator();
    let good = in_c(&samples()[0]);
    let [q1, q2, q3] = good.joints;
    let at_joints = |joints| Sample { joints, ..good };
    let far_away = Sample {
        position: [f64::INFINITY; 3],
        ..good
    };
    for (expected, arm, faulty) in [
        (
            status::SAMPLE_JOINT_NOT_FINITE,
            1,
            at_joints([q1, f64::NAN, q3]),
        ),
        (status::SAMPLE_JOINT_TOO_LARGE, 2, at_joints([q1, q2, 45.0])),
        (status::SAMPLE_POSITION_NOT_FINITE, -1, far_away),
    ] {
        let mut error = Error::from(status::OK);
        let found = ikm::add(calibrator.held_mut(), input(&faulty), output(&mut error));
        assert_eq!((found, error.status, error.arm), (expected, expected, arm));
    }
    let mut count = 7;
    ok(ikm::samples(calibrator.held(), output(&mut count)));
    assert_eq!(count, 0);
}
