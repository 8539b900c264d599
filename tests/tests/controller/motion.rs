//! No jump: whatever the path, the parameters, the clock and the requests do, no turn moves a joint further than its
//! limits, and no turn is made up for.

use crate::controller::driver::{Driver, Flash, named};
use core::cell::Cell;
use delta_cal::{Real, Robot};
use delta_cal_controller::{ControlLoop, Handover, Limits, NewParameters, Number, Path, Timer};
use delta_cal_firmware_example::{Circle, limits};
use delta_cal_protocol::{Geometry, Motion, Request};
use delta_cal_tests::geometries::symmetric;
use delta_cal_tests::{Spread, generator, paper_robot, perturbed, size, uniform};
use nalgebra::Vector3;
use rand_core::Rng;
use rand_pcg::Pcg32;

/// Nanoseconds.
struct Clock(Cell<u32>);

impl Timer for Clock {
    const TICKS_A_SECOND: u32 = 1_000_000_000;
    const MASK: u32 = u32::MAX;

    fn now(&self) -> u32 {
        self.0.get()
    }
}

/// Waves that leave the work space, at times faster than the drives; now and then it stands still (input that is stale)
/// or is somewhere else.
struct Wild {
    rng: Pcg32,
    size: [f64; 3],
    /// Radians in a turn.
    speed: [f64; 3],
    phase: f64,
    /// How much of its speed it has after a stop.
    pace: f64,
    stale: u32,
    /// Turns between two mishaps.
    rare: u32,
}

impl Wild {
    fn new(rng: &mut Pcg32, rate: u32) -> Self {
        let random = |rng: &mut Pcg32, most: f64| most * uniform(rng).abs();
        Self {
            size: [300.0, 300.0, 150.0].map(|most| random(rng, most)),
            speed: [(); 3].map(|()| random(rng, 6.0) / f64::from(rate)),
            phase: 1000.0 * uniform(rng),
            pace: 0.0,
            stale: 0,
            rare: 300 + rng.next_u32() % 3000,
            rng: generator(0x00c0_0500, rng.next_u32().into()),
        }
    }
}

impl<T: Real> Path<T> for Wild {
    fn next_point(&mut self) -> Vector3<T> {
        let mishap = self.rng.next_u32() % self.rare;
        match mishap {
            0 => self.stale = self.rng.next_u32() % 100,
            1 => self.phase += 300.0 * uniform(&mut self.rng),
            _ => {}
        }
        self.stale = self.stale.saturating_sub(1);
        if self.stale == 0 {
            self.pace = (self.pace + 0.005).min(1.0);
            self.phase += self.pace;
        }
        let at = |axis: usize| self.size[axis] * (self.speed[axis] * self.phase).sin();
        Vector3::new(at(0), at(1), at(2) - 450.0).map(T::from_f64)
    }

    fn stopped(&mut self) {
        // Some planners do not listen.
        self.pace = f64::from(self.rng.next_u32() % 2);
    }
}

fn random_robot<T: Real>(rng: &mut Pcg32) -> NewParameters<T> {
    let robot = match rng.next_u32() % 4 {
        // It reaches half of the paths.
        0 => {
            let [upper_arm, forearm] =
                [150.0, 380.0].map(|least| least + 100.0 * uniform(rng).abs());
            symmetric([194.0, 30.0, upper_arm, forearm])
        }
        1 => perturbed(&paper_robot(), 20.0, 0.1, Spread::Uniform, rng),
        _ => perturbed(&paper_robot(), 0.5, 0.0035, Spread::Uniform, rng),
    };
    let robot: Robot<T> = robot.cast().unwrap();
    NewParameters {
        fingerprint: Geometry::of(&robot).fingerprint(),
        robot,
    }
}

/// What happened: turns, stops out of reach and too fast, switches while following, calls left out.
#[derive(Debug, Default)]
struct Counts {
    following: u64,
    stops: u32,
    too_fast: u32,
    switches: u32,
    left_out: u32,
    /// Largest move of a turn and change of a move, in parts of what is allowed.
    moved: f64,
    changed: f64,
}

/// A robot with a random path and clock, for so many turns.
fn runs<T: Number>(seed: u64, counts: &mut Counts) {
    let mut rng = generator(0x00c0_0600, seed);
    let rate = [50, 100, 250, 1000, 4000, 20_000][rng.next_u32() as usize % 6];
    let limits = Limits::<T> {
        turns_a_second: rate,
        blend_turns: rate / 2,
        ..limits()
    };
    let start = [(); 3].map(|()| T::from_f64(uniform(&mut rng)));
    let mut handover = Handover::default();
    let path = Wild::new(&mut rng, rate);
    let first = random_robot(&mut rng);
    let (mut background, mut foreground) = handover.split(&first, path, &limits, start);
    let (clock, period) = (Clock(Cell::new(0)), 1_000_000_000 / rate);
    let turns = f64::from(rate);
    // The angles themselves are rounded, and so are differences of theirs.
    let rounding = 40.0 * T::EPSILON.to_f64();
    let most = limits.speed.to_f64() / turns + rounding;
    let change = limits.acceleration.to_f64() / (turns * turns) + rounding;
    let (mut joints, mut moves) = (start.map(T::to_f64), [0.0; 3]);
    let mut driven = None;
    for _ in 0..4000 {
        let jitter = f64::from(period) * 0.3 * uniform(&mut rng).abs();
        // Once in a while an erase stalls the processor; a ticker may then make up for what it missed.
        let (missed, burst) = match rng.next_u32() % 400 {
            0 => (rng.next_u32() % 50, 0),
            1 => (rng.next_u32() % 50, rng.next_u32() % 50),
            _ => (0, 0),
        };
        clock.0.set(clock.0.get().wrapping_add(period * missed));
        for call in 0..=burst {
            let late = if call == 0 { jitter as u32 } else { 0 };
            let now = clock.0.get().wrapping_add(late);
            let own = Clock(Cell::new(now));
            let mut new = None;
            foreground.turn(&own, |joints| new = Some(joints.map(T::to_f64)));
            let Some(new) = new else {
                counts.left_out += 1;
                continue;
            };
            if let Some(driven) = driven.replace(now) {
                assert!(
                    now.wrapping_sub(driven) >= period / 2,
                    "seed {seed}: made up for"
                );
            }
            for arm in 0..3 {
                let step = new[arm] - joints[arm];
                counts.moved = counts.moved.max(step.abs() / most);
                counts.changed = counts.changed.max((step - moves[arm]).abs() / change);
                let what = format!(
                    "seed {seed}, {rate} Hz: {} deg in a turn",
                    step.to_degrees()
                );
                assert!(step.abs() <= most, "{what}, {} allowed", most.to_degrees());
                assert!((step - moves[arm]).abs() <= change, "{what}: acceleration");
                moves[arm] = step;
            }
            joints = new;
        }
        clock.0.set(clock.0.get().wrapping_add(period));
        let state = foreground.control_loop.state;
        counts.following += u64::from(state.motion == Motion::Following);
        if rng.next_u32().is_multiple_of(700) {
            let _ = background.hand_over(random_robot(&mut rng));
        }
        if rng.next_u32().is_multiple_of(100) {
            // Of the last stop, or a late one.
            let late = u32::from(rng.next_u32().is_multiple_of(4));
            background.let_resume(state.stopped.saturating_sub(late));
        }
        let stop = state.stopped == state.turns;
        counts.too_fast += u32::from(stop && state.motion == Motion::TooFast);
    }
    counts.switches += foreground.control_loop.state.switches;
    counts.stops += foreground.control_loop.state.stops;
}

#[test]
fn no_turn_moves_a_joint_further_than_its_limits() {
    let mut counts = Counts::default();
    for seed in 0..size(60, 3000) {
        runs::<f32>(seed, &mut counts);
        runs::<f64>(seed, &mut counts);
    }
    println!("{counts:?}");
    // All of it happened.
    assert!(counts.following > 20_000 && counts.switches > 50 && counts.left_out > 50);
    assert!(counts.too_fast > 50 && counts.stops - counts.too_fast > 50);
    // And the limits were used.
    assert!(counts.moved > 0.9 && counts.changed > 0.9);
}

/// A control loop that follows the circle with this robot.
fn following(robot: &Robot<f32>) -> ControlLoop<f32, Circle<f32>> {
    let mut control = ControlLoop::new(&named(robot), Circle::default(), &limits(), [0.0; 3]);
    while control.state.motion != Motion::Following {
        control.turn();
        assert!(control.state.turns < 500, "{:?}", control.state);
    }
    control
}

fn short() -> Robot<f32> {
    symmetric([194.0, 30.0, 130.0, 370.0]).cast().unwrap()
}

#[test]
fn the_whole_path_is_reached() {
    let mut rng = generator(0x00c0_0100, 1);
    for _ in 0..4 {
        let robot = perturbed(&paper_robot(), 0.5, 0.0035, Spread::Uniform, &mut rng);
        let robot = robot.cast().unwrap();
        let mut control = following(&robot);
        for _ in 0..5000 {
            let joints = *control.turn();
            let point = control.state.point.into();
            assert_eq!(joints, robot.inverse(&point).expect("reachable"));
            let there = robot.forward(&joints).expect("a pose");
            assert!((there - point).norm() < 1e-3, "{there} instead of {point}");
        }
        assert_eq!(control.state.stopped, 0);
    }
}

/// The difference of the two robots comes in with a cubic blend, whose steepest slope is 3/2 of the mean one.
#[test]
fn parameters_blend_over() {
    let old = paper_robot::<f32>();
    let mut rng = generator(0x00c0_0100, 3);
    let new = perturbed(&paper_robot(), 0.5, 0.0035, Spread::Uniform, &mut rng);
    let new = new.cast().unwrap();
    let mut control = following(&old);
    assert!(control.switch_to(&named(&new)));
    let (turns, mut before) = (limits::<f32>().blend_turns, [0.0; 3]);
    for turn in 1..=turns {
        assert!(control.switching() && control.robot == old);
        assert!(!control.switch_to(&named(&old)), "two blends at once");
        let joints = *control.turn();
        let point = control.state.point.into();
        let (from, to) = (old.inverse(&point).unwrap(), new.inverse(&point).unwrap());
        for arm in 0..3 {
            let share = (joints[arm] - from[arm]) / (to[arm] - from[arm]);
            // Where they differ by little, the share is rounded the more.
            let rounding = 8.0 * f32::EPSILON / (to[arm] - from[arm]).abs();
            #[allow(clippy::cast_precision_loss)]
            let step = share - before[arm] - 1.5 / turns as f32;
            assert!(step <= rounding, "turn {turn}: {step}, {rounding}");
            before[arm] = share;
        }
    }
    assert!(!control.switching());
    assert_eq!(control.state.switches, 1);
    let joints = *control.turn();
    assert_eq!(joints, new.inverse(&control.state.point.into()).unwrap());
}

#[test]
fn a_point_out_of_reach_stops_the_joints_until_they_are_let_go() {
    let (good, short) = (paper_robot(), short());
    let mut control = ControlLoop::new(&named(&short), Circle::default(), &limits(), [0.0; 3]);
    let turns = |control: &mut ControlLoop<f32, Circle<f32>>, count| {
        for _ in 0..count {
            control.turn();
        }
        control.state
    };
    let stopped = turns(&mut control, 4000);
    assert_eq!((stopped.motion, stopped.stops), (Motion::Unreachable, 1));
    assert_eq!(turns(&mut control, 1000).joints, stopped.joints);
    // A request for another stop, such as a late one, lets nothing go; one for this stop lets the next point be tried.
    control.resume(stopped.stopped - 1);
    assert_eq!(turns(&mut control, 1).motion, Motion::Unreachable);
    control.resume(stopped.stopped);
    assert_eq!(turns(&mut control, 1).stops, 2);
    // With other parameters, which move nothing, the path goes on where it was.
    assert!(control.switch_to(&named(&good)));
    let switched = turns(&mut control, 1000);
    assert_eq!((switched.switches, switched.joints), (1, stopped.joints));
    control.resume(switched.stopped);
    assert_eq!(turns(&mut control, 1000).motion, Motion::Following);
    // Parameters of a robot that cannot be where it is are not taken.
    while short.inverse(&control.state.point.into()).is_ok() {
        control.turn();
    }
    assert_eq!(control.state.motion, Motion::Following);
    assert!(!control.switch_to(&named(&short)));
}

/// From the request to the drives, as the firmware runs it; a request for another stop, such as a late one, does nothing.
#[test]
fn joints_that_stopped_move_again_when_asked() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let mut handover = Handover::default();
    let path = Wild::new(&mut generator(0x00c0_0700, 1), 1000);
    let current = driver.controller.current();
    let (mut background, mut foreground) = handover.split(&current, path, &limits(), [0.0; 3]);
    let clock = Clock(Cell::new(0));
    let mut turns = |driver: &mut Driver<f32, _>, count: u32| {
        for _ in 0..count {
            clock.0.set(clock.0.get().wrapping_add(1_000_000));
            foreground.turn(&clock, |_| ());
            background.exchange(&mut driver.controller);
        }
        driver.status().control
    };
    let mut state = turns(&mut driver, 100);
    while !matches!(state.motion, Motion::Unreachable | Motion::TooFast) {
        state = turns(&mut driver, 100);
    }
    for (stopped, moves) in [(state.stopped - 1, false), (state.stopped, true)] {
        driver.ask(&Request::Resume { stopped });
        let after = turns(&mut driver, 100);
        // At once or after another stop.
        let moved = (after.motion, after.stopped) != (state.motion, state.stopped);
        assert_eq!(moved, moves, "{after:?}");
    }
}
