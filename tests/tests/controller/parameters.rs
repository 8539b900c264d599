//! What is in use: applied, gone back from, and kept over restarts.

use crate::controller::driver::{Driver, Flash, accepted, samples};
use delta_cal::robot::{GeometryError, Transmission};
use delta_cal_controller::{ControlLoop, Path};
use delta_cal_firmware_example::{Circle, limits};
use delta_cal_protocol::{Fault, Geometry, Motion, Origin, Phase, Request, Response, RevertTo};
use delta_cal_tests::{Spread, generator, paper_robot, perturbed};

#[test]
fn only_the_result_that_is_meant_is_applied() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let nominal = Geometry::of(&paper_robot::<f32>());
    let fingerprint = driver.solved(9, &samples(8, 20));
    let other = Request::Apply {
        session: 9,
        fingerprint: fingerprint ^ 1,
        from: 0,
    };
    assert_eq!(
        driver.fault(&other),
        Fault::OtherParameters { there: fingerprint }
    );
    assert_eq!(driver.parameters().geometry, nominal);
    assert_eq!(driver.parameters().origin, Origin::Nominal);
    assert!(driver.controller.take_switch().is_none());

    let applied = driver.apply(9, fingerprint);
    let parameters = accepted(applied);
    assert_eq!(parameters.origin, Origin::Calibration);
    assert_eq!(parameters.geometry.fingerprint(), fingerprint);
    let switch = driver.controller.take_switch().expect("new parameters");
    assert_eq!(switch.fingerprint, fingerprint);
    assert_eq!(Geometry::of(&switch.robot), parameters.geometry);
    assert_eq!(driver.parameters(), parameters);

    // Again: the same answer, and nothing happens.
    assert_eq!(driver.apply(9, fingerprint), applied);
    assert!(driver.controller.take_switch().is_none());
    // A link may hold the request back and deliver it when the parameters that it was to replace are in use again.
    let late = Request::Apply {
        session: 9,
        fingerprint,
        from: 0,
    };
    driver.revert(RevertTo::Previous);
    let there = nominal.fingerprint();
    assert_eq!(driver.fault(&late), Fault::OtherParameters { there });
    assert_eq!(driver.parameters().origin, Origin::Nominal);
}

#[test]
fn a_refused_calibration_changes_nothing() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let fingerprint = driver.solved(9, &samples(8, 20));
    driver.apply(9, fingerprint);
    let before = driver.parameters();
    driver.controller.take_switch();
    let mut reversed = samples::<f32>(12, 40);
    for sample in &mut reversed {
        sample.joints[0] = -sample.joints[0];
    }
    assert!(matches!(
        driver.calibrate(10, &reversed),
        Phase::CalibrationRefused { samples: 40, .. }
    ));
    for fingerprint in [0, fingerprint] {
        let apply = Request::Apply {
            session: 10,
            fingerprint,
            from: before.generation,
        };
        assert_eq!(driver.fault(&apply), Fault::NoOutcome);
    }
    assert_eq!(driver.parameters(), before);
    assert!(driver.controller.take_switch().is_none());
}

/// Two calibrations, one applied after the other; their fingerprints.
fn applied_twice() -> (Driver<f32, Flash>, [u32; 2]) {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let fingerprints = [(1, 8), (2, 9)].map(|(session, robot)| {
        let fingerprint = driver.solved(session, &samples(robot, 20));
        driver.apply(session, fingerprint);
        fingerprint
    });
    (driver, fingerprints)
}

#[test]
fn going_back_needs_the_number_of_what_is_there() {
    let (mut driver, [first, second]) = applied_twice();
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    let mut in_use = second;
    for (to, there, origin) in [
        (RevertTo::Previous, first, Origin::Calibration),
        (RevertTo::Nominal, nominal, Origin::Nominal),
        // What was in use before the last calibration was applied.
        (RevertTo::Previous, first, Origin::Calibration),
    ] {
        let from = driver.parameters().generation;
        for wrong in [from.wrapping_sub(1), from + 1] {
            let fault = driver.fault(&Request::Revert { from: wrong, to });
            assert_eq!(fault, Fault::OtherParameters { there: in_use });
        }
        driver.controller.take_switch();
        let reverted = driver.ask(&Request::Revert { from, to });
        let parameters = accepted(reverted);
        assert_eq!(parameters.geometry.fingerprint(), there);
        assert_eq!(parameters.origin, origin);
        let switch = driver.controller.take_switch().expect("new parameters");
        assert_eq!(switch.fingerprint, there);
        in_use = there;
    }
}

/// The help says so, and after a broken link the advice is to start again.
#[test]
fn going_back_twice_is_going_back_once() {
    for to in [RevertTo::Previous, RevertTo::Nominal] {
        let (mut driver, [_, second]) = applied_twice();
        let from = driver.parameters().generation;
        let once = driver.revert(to);
        accepted(once);
        assert_ne!(driver.controller.current().fingerprint, second);
        driver.controller.take_switch();
        // Asked for once more, and the same request again whose answer was lost.
        assert_eq!(driver.revert(to), once);
        assert_eq!(driver.ask(&Request::Revert { from, to }), once);
        assert!(driver.controller.take_switch().is_none());
        let mut driver = Driver::<f32, _>::start(driver.into_flash());
        assert_eq!(driver.revert(to), once);
    }
}

/// A robot that was calibrated elsewhere, with gears that are not exact: stored, used by the control loop, there after
/// a restart, and left by a revert.
#[test]
fn a_geometry_from_elsewhere_is_stored_and_used() {
    let transmissions = [
        Transmission::new([1e-3, 5e-4, -2e-4, 1e-4, 3e-4]).unwrap(),
        Transmission::EXACT,
        Transmission::new([0.0, -8e-4, 6e-4, 0.0, -1e-4]).unwrap(),
    ];
    let robot = perturbed(
        &paper_robot(),
        0.3,
        1e-3,
        Spread::Uniform,
        &mut generator(71, 0),
    );
    let robot = robot.with_transmissions(transmissions).unwrap();
    let robot = robot.cast::<f32>().unwrap();
    let geometry = Geometry::of(&robot);
    assert!(geometry.transmissions.is_some());
    // The core and the protocol name parameters alike.
    assert_eq!(robot.fingerprint(), geometry.fingerprint());
    assert_eq!(
        paper_robot::<f32>().fingerprint(),
        Geometry::of(&paper_robot::<f32>()).fingerprint()
    );

    let mut flash = Flash::new();
    let mut driver = Driver::<f32, _>::start(&mut flash);
    let adopt = |from, geometry| Request::Adopt { from, geometry };
    // Numbers that are no robot's, and a generation that is not the current one.
    let mut impossible = geometry;
    impossible.transmissions = Some([[0.05; 5]; 3]);
    assert_eq!(
        driver.fault(&adopt(0, impossible)),
        Fault::Geometry(GeometryError::TransmissionTooLarge)
    );
    let there = Geometry::of(&paper_robot::<f32>()).fingerprint();
    let stale = driver.fault(&adopt(7, geometry));
    assert_eq!(stale, Fault::OtherParameters { there });
    assert!(driver.controller.take_switch().is_none());

    let adopted = driver.ask(&adopt(0, geometry));
    let parameters = accepted(adopted);
    assert_eq!(
        (parameters.origin, parameters.geometry),
        (Origin::Calibration, geometry)
    );
    // Again: the same answer, and nothing happens.
    let switch = driver.controller.take_switch().expect("new parameters");
    assert_eq!(driver.ask(&adopt(0, geometry)), adopted);
    assert!(driver.controller.take_switch().is_none());

    // The joint targets of the control loop are those of the robot with its gears.
    let joints = robot.inverse(&Circle::default().next_point()).unwrap();
    let mut control_loop = ControlLoop::new(&switch, Circle::default(), &limits(), joints);
    assert_eq!(*control_loop.turn(), joints);
    let point = control_loop.state.point.into();
    let parameters = robot.parameters();
    let exact = delta_cal::Robot::from_parameters(parameters).unwrap();
    assert_ne!(joints, exact.inverse(&point).unwrap());

    let mut restarted = Driver::<f32, _>::start(flash);
    assert_eq!(restarted.parameters().geometry, geometry);
    let before = accepted(restarted.revert(RevertTo::Previous));
    assert_eq!(before.geometry.fingerprint(), there);
}

/// A robot that differs from the nominal one in one number of each arm: the lengths and the place of the upper arm in
/// them, mm.
fn changed(index: usize, by: f32) -> Geometry<f32> {
    let mut geometry = Geometry::of(&paper_robot::<f32>());
    for arm in &mut geometry.arms {
        arm[index] += by;
    }
    geometry
}

/// Whoever asks, and whatever that computer checked.
#[test]
fn only_the_controllers_robot_is_adopted() {
    const DZ: usize = 2;
    const UPPER_ARM: usize = 5;
    const FOREARM: usize = 7;
    for (index, by, adopted) in [
        (UPPER_ARM, -80.0, false),
        (UPPER_ARM, -265.0, false),
        (UPPER_ARM, -520.0, false),
        (FOREARM, 1e6, false),
        (FOREARM, -130.0, false),
        // A twentieth of the forearm is 24 mm.
        (DZ, 25.0, false),
        (DZ, 23.0, true),
        (UPPER_ARM, 2.0, true),
        (FOREARM, -2.0, true),
    ] {
        let mut driver = Driver::<f32, _>::start(Flash::new());
        let geometry = changed(index, by);
        let answer = driver.ask(&Request::Adopt { from: 0, geometry });
        if adopted {
            accepted(answer);
        } else {
            assert_eq!(answer, Response::Fault(Fault::OtherRobot), "{index} {by}");
            assert!(driver.controller.take_switch().is_none());
            assert_eq!(driver.into_flash(), Flash::new());
        }
    }
}

/// While the joints follow the path they would have to jump; while they stand still they do not move.
#[test]
fn a_robot_that_cannot_be_where_the_platform_is_is_refused() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let geometry = changed(7, -10.0);
    let (robot, nominal) = (geometry.robot().unwrap(), paper_robot::<f32>());
    let heights = (0..400_u16).map(|mm| [0.0, 0.0, -450.0 - f32::from(mm)]);
    let mut edge = heights.filter(|point| robot.inverse(&(*point).into()).is_err());
    let mut control = driver.status().control;
    control.point = edge.next().expect("an edge");
    assert!(nominal.inverse(&control.point.into()).is_ok());
    control.motion = Motion::Following;
    driver.controller.set_control(control);
    let adopt = Request::Adopt { from: 0, geometry };
    assert_eq!(driver.fault(&adopt), Fault::Unreachable);
    assert_eq!(driver.parameters().origin, Origin::Nominal);
    control.motion = Motion::Unreachable;
    driver.controller.set_control(control);
    accepted(driver.ask(&adopt));
}

#[test]
fn changes_are_as_rare_as_the_flash_lasts() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let change = |driver: &mut Driver<f32, _>, number: u16| {
        let geometry = changed(7, 0.01 * f32::from(number));
        let from = driver.parameters().generation;
        driver.ask(&Request::Adopt { from, geometry })
    };
    for number in 1..=60 {
        accepted(change(&mut driver, number));
    }
    assert_eq!(change(&mut driver, 61), Response::Fault(Fault::TooOften));
    // The same again wears nothing.
    accepted(change(&mut driver, 60));
    let mut control = driver.status().control;
    (control.turns_a_second, control.turns) = (50, 60 * 50);
    driver.controller.set_control(control);
    accepted(change(&mut driver, 61));
    assert_eq!(change(&mut driver, 62), Response::Fault(Fault::TooOften));
}
