use crate::controller::driver::{Driver, Flash, named, samples};
use crate::controller::pace::{Clock, PERIOD};
use delta_cal::{Robot, SymmetricRobot};
use delta_cal_firmware_example::{BLEND_TURNS, Circle, ControlLoop, Handover, Path};
use delta_cal_protocol::{Geometry, Response};
use delta_cal_tests::{Spread, generator, paper_robot, perturbed};
use std::sync::atomic::{AtomicBool, Ordering};

fn robot(number: u64) -> Robot<f32> {
    let mut rng = generator(0x00c0_0100, number);
    perturbed(&paper_robot(), 0.5, 0.0035, Spread::Uniform, &mut rng)
        .cast()
        .unwrap()
}

#[test]
fn the_whole_path_is_reached() {
    for robot in [paper_robot(), robot(1), robot(2)] {
        let mut control = ControlLoop::new(&robot);
        let mut path = Circle::default();
        for _ in 0..5000 {
            let joints = *control.turn();
            let point = path.next_point();
            assert_eq!(joints, robot.inverse(&point).expect("reachable"));
            let there = robot.forward(&joints).expect("a pose");
            assert!((there - point).norm() < 1e-3, "{there} instead of {point}");
        }
        assert_eq!(control.unreachable(), 0);
        assert_eq!(control.turns(), 5000);
    }
}

/// Between two turns the targets move by no more than the path and a cubic blend of the difference
/// ask for: its steepest slope is 3/2 of the mean one.
#[test]
fn joint_targets_do_not_jump_when_the_parameters_change() {
    let (old, new) = (paper_robot::<f32>(), robot(3));
    let mut control = ControlLoop::new(&old);
    let mut path = Circle::default();
    for _ in 0..777 {
        control.turn();
        path.next_point();
    }
    assert!(control.switch_to(&new));
    let mut before = *control.joints();
    let mut old_before = before;
    let mut new_before = None;
    let mut largest: f32 = 0.0;
    for turn in 1..=BLEND_TURNS {
        assert!(control.switching());
        assert!(!control.switch_to(&old), "two blends at once");
        let joints = *control.turn();
        let point = path.next_point();
        let (from, to) = (old.inverse(&point).unwrap(), new.inverse(&point).unwrap());
        for arm in 0..3 {
            let difference = (to[arm] - from[arm]).abs();
            let path_step = (from[arm] - old_before[arm])
                .abs()
                .max(new_before.map_or(0.0, |before: [f32; 3]| (to[arm] - before[arm]).abs()));
            let step = (joints[arm] - before[arm]).abs();
            let rounding = 8.0 * f32::EPSILON;
            #[allow(clippy::cast_precision_loss)]
            let allowed = path_step + 1.5 * difference / BLEND_TURNS as f32 + rounding;
            assert!(
                step <= allowed,
                "turn {turn}: {step} rad, {allowed} allowed"
            );
            largest = largest.max(difference);
        }
        (before, old_before, new_before) = (joints, from, Some(to));
    }
    assert!(largest > 1e-3, "the two robots hardly differ");
    assert!(!control.switching());
    assert_eq!(control.switches(), 1);
    let joints = *control.turn();
    assert_eq!(joints, new.inverse(&path.next_point()).unwrap());
}

#[test]
fn an_unreachable_point_leaves_the_joints_where_they_are() {
    let short = SymmetricRobot {
        base_radius: 194.0_f32,
        platform_radius: 30.0,
        upper_arm: 130.0,
        forearm: 370.0,
    };
    let mut control = ControlLoop::new(&short.robot().unwrap());
    let (mut missed, mut last) = (0, [0.0; 3]);
    for _ in 0..4000 {
        let joints = *control.turn();
        if let Ok(reached) = short.robot().unwrap().inverse(control.point()) {
            assert_eq!(joints, reached);
        } else {
            missed += 1;
            assert_eq!(joints, last);
        }
        last = joints;
    }
    assert!(missed > 0 && missed < 4000, "{missed} of 4000");
    assert_eq!(control.unreachable(), missed);
}

#[test]
fn the_loop_takes_over_what_was_applied() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let mut handover = Handover::new();
    let (mut background, mut foreground) = handover.split(&driver.controller.current());
    let applied = driver.solved(1, &samples(1, 20));
    driver.apply(1, applied);
    let clock = <Clock>::default();
    let mut used = Vec::new();
    for _ in 0..2 * BLEND_TURNS {
        if background.ready()
            && let Some(parameters) = driver.controller.take_switch()
        {
            background.hand_over(parameters).unwrap();
        }
        clock.0.set(clock.0.get() + PERIOD);
        foreground.turn(&clock, |_| ());
        driver
            .controller
            .set_control(background.state().expect("a state"));
        let control = driver.status().control;
        used.push((control.fingerprint, control.switches));
    }
    let Response::Parameters(parameters) = driver.apply(1, applied) else {
        panic!("not applied")
    };
    assert_eq!(
        Geometry::of(foreground.control_loop().robot()),
        parameters.geometry
    );
    let nominal = Geometry::of(&paper_robot::<f32>()).fingerprint();
    used.dedup();
    assert_eq!(used, [(nominal, 0), (applied, 1)]);
}

/// The two sides on two threads: a queue that handed over anything but whole values would show as
/// parameters that are not those of their fingerprint.
#[test]
fn parameters_are_handed_over_whole() {
    const SWITCHES: u32 = 100;
    let sets: Vec<_> = (0..SWITCHES).map(|n| named(&robot(n.into()))).collect();
    let mut handover = Handover::new();
    let (mut background, mut foreground) = handover.split(&named(&paper_robot()));
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let turning = scope.spawn(|| {
            let clock = <Clock>::default();
            let mut seen = 0;
            while !done.load(Ordering::Relaxed) {
                foreground.turn(&clock, |joints| {
                    assert!(joints.iter().all(|q| q.is_finite()));
                });
                let control = foreground.control_loop();
                if control.switches() > seen {
                    seen = control.switches();
                    assert_eq!(control.robot(), &sets[seen as usize - 1].robot);
                }
            }
            seen
        });
        let mut waiting = sets.iter();
        let mut next = waiting.next();
        let mut last = None;
        while last != Some(SWITCHES) {
            if let Some(set) = next
                && background.hand_over(*set).is_ok()
            {
                next = waiting.next();
            }
            if let Some(state) = background.state() {
                last = Some(state.switches);
                if let Some(before) = state.switches.checked_sub(1) {
                    assert_eq!(state.fingerprint, sets[before as usize].fingerprint);
                }
            }
            std::hint::spin_loop();
        }
        done.store(true, Ordering::Relaxed);
        assert_eq!(turning.join().expect("no panic"), SWITCHES);
    });
}
