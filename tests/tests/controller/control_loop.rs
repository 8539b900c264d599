//! Which turns of the control loop count as late, and how long they take.

use crate::controller::driver::{Driver, Flash, named};
use core::cell::Cell;
use delta_cal::Robot;
use delta_cal_controller::{Background, Foreground, Handover, Timer};
use delta_cal_firmware_example::{Circle, limits};
use delta_cal_tests::{Spread, generator, paper_robot, perturbed};
use std::sync::atomic::{AtomicBool, Ordering};

fn robot(number: u64) -> Robot<f32> {
    let mut rng = generator(0x00c0_0100, number);
    perturbed(&paper_robot(), 0.5, 0.0035, Spread::Uniform, &mut rng)
        .cast()
        .unwrap()
}

/// The two sides on two threads: a queue that handed over anything but whole values would show as
/// parameters that are not those of their fingerprint.
#[test]
fn parameters_are_handed_over_whole() {
    const SWITCHES: u32 = 100;
    let sets: Vec<_> = (0..SWITCHES).map(|n| named(&robot(n.into()))).collect();
    let mut handover = Handover::default();
    let (mut background, mut foreground) = handover.split(
        &named(&paper_robot()),
        Circle::default(),
        &limits(),
        [0.0; 3],
    );
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let turning = scope.spawn(|| {
            let clock = <Clock>::default();
            let mut seen = 0;
            while !done.load(Ordering::Relaxed) {
                clock.0.set(clock.0.get().wrapping_add(PERIOD));
                foreground.turn(&clock, |joints| {
                    assert!(joints.iter().all(|q| q.is_finite()));
                });
                let control = &foreground.control_loop;
                if control.state.switches > seen {
                    seen = control.state.switches;
                    assert_eq!(control.robot, sets[seen as usize - 1].robot);
                }
            }
            seen
        });
        let mut waiting = sets.iter();
        let mut next = waiting.next();
        let mut last = None;
        while last != Some(SWITCHES) {
            if let Some(set) = next
                && background.hand_over(set.clone()).is_ok()
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

/// A timer that stands still, or is set by hand; 25 MHz unless it says otherwise.
#[derive(Default)]
struct Clock<const HERTZ: u32 = 25_000_000>(Cell<u32>);

impl<const HERTZ: u32> Timer for Clock<HERTZ> {
    const TICKS_A_SECOND: u32 = HERTZ;
    const MASK: u32 = 0x00ff_ffff;

    fn now(&self) -> u32 {
        self.0.get() & Self::MASK
    }
}

const TURNS: u32 = 1000;
const PERIOD: u32 = <Clock>::TICKS_A_SECOND / TURNS;

fn split(handover: &mut Handover<f32>) -> (Background<'_, f32>, Foreground<'_, f32, Circle<f32>>) {
    handover.split(
        &named(&paper_robot()),
        Circle::default(),
        &limits(),
        [0.0; 3],
    )
}

/// Late turns after turns that began at these ticks.
fn late<const HERTZ: u32>(began: impl Iterator<Item = u64>) -> u32 {
    let clock = Clock::<HERTZ>::default();
    let mut handover = Handover::default();
    let (_, mut foreground) = split(&mut handover);
    for ticks in began {
        #[allow(clippy::cast_possible_truncation)]
        clock.0.set(ticks as u32);
        foreground.turn(&clock, |_| ());
    }
    foreground.control_loop.state.late
}

/// Whole ticks of a timer that counts `hertz` when a turn begins that is punctual.
fn punctual(hertz: u32, turns: u64) -> impl Iterator<Item = u64> {
    (0..turns).map(move |turn| turn * u64::from(hertz) / u64::from(TURNS))
}

/// A turn of 33,333.333 ticks or of 32.768 is no whole number of them.
#[test]
fn punctual_turns_are_punctual_at_any_rate_of_the_timer() {
    const MINUTE: u64 = 60_000;
    assert_eq!(late::<33_333_333>(punctual(33_333_333, 5 * MINUTE)), 0);
    assert_eq!(late::<168_000_000>(punctual(168_000_000, MINUTE)), 0);
    assert_eq!(late::<999_999>(punctual(999_999, 2 * MINUTE)), 0);
    assert_eq!(late::<32_768>(punctual(32_768, 2 * MINUTE)), 0);
    assert_eq!(late::<10_000>(punctual(10_000, 2 * MINUTE)), 0);
}

/// A minute, with one turn late and two left out in the middle: three, and no others.
#[test]
fn turns_are_counted_right_with_clocks_that_differ() {
    const ALL: u64 = 60_000;
    for millionths in [-200, 0, 1, 200_i64] {
        let hertz = u64::try_from(33_333_333 * (1_000_000 + millionths) / 1_000_000).unwrap();
        let tick = |turn: u64| turn * hertz / u64::from(TURNS);
        for at in [30_000, 30_037] {
            let began = (0..ALL)
                .filter(|turn| !(at + 200..at + 202).contains(turn))
                .map(|turn| tick(turn) + u64::from(turn == at) * 33_333 / 5);
            let what = format!("{millionths} millionths, at turn {at}");
            assert_eq!(late::<33_333_333>(began), 3, "{what}");
        }
    }
}

#[test]
fn late_and_left_out_turns_are_counted() {
    let clock = <Clock>::default();
    let mut handover = Handover::default();
    let (_, mut foreground) = split(&mut handover);
    let mut late_after = |at: u32| {
        clock.0.set(at);
        foreground.turn(&clock, |_| ());
        foreground.control_loop.state.late
    };
    // The timer comes around after 671 turns.
    let mut at = 0x00ff_0000;
    assert_eq!(late_after(at), 0);
    for _ in 0..2000 {
        at += PERIOD;
        assert_eq!(late_after(at), 0);
    }
    for (turn, ticks, expected) in [
        // A little early or late is on time.
        (1, 0_u32.wrapping_sub(3), 0),
        (2, PERIOD / 11, 0),
        (3, PERIOD / 8, 1),
        (4, 0, 1),
        // Two left out.
        (7, 0, 3),
        (8, 0, 3),
        // And 399, as erasing a page of single-bank flash stops a processor: 400 ms of the 671 that the timer can tell.
        // Then two.
        (408, 0, 402),
        (409, 0, 402),
        (412, 0, 404),
    ] {
        let at = (at + turn * PERIOD).wrapping_add(ticks);
        assert_eq!(late_after(at), expected, "{turn}");
    }
}

#[test]
fn the_longest_turn_is_kept_apart_while_a_calibration_is_at_work() {
    let clock = <Clock>::default();
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let mut handover = Handover::default();
    let current = driver.controller.current();
    let (mut background, mut foreground) =
        handover.split(&current, Circle::default(), &limits(), [0.0; 3]);
    for (session, ticks, expected) in [
        (None, 900, (900, 0)),
        (Some(1), 700, (900, 700)),
        (Some(1), 1100, (1100, 1100)),
        (Some(2), 500, (1100, 1100)),
    ] {
        if let Some(session) = session {
            driver.begin(session);
        }
        background.exchange(&mut driver.controller);
        clock.0.set(clock.0.get() + PERIOD);
        foreground.turn(&clock, |_| clock.0.set(clock.0.get() + ticks));
        let state = foreground.control_loop.state;
        assert_eq!(
            (state.longest_ticks, state.longest_ticks_calibrating),
            expected
        );
    }
}
