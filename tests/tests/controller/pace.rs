//! Which turns of the control loop count as late, and how long they take.

use crate::controller::driver::named;
use core::cell::Cell;
use delta_cal_firmware_example::{Handover, TURNS_A_SECOND, Timer};
use delta_cal_tests::paper_robot;

/// A timer that stands still, or is set by hand; 25 MHz unless it says otherwise.
#[derive(Default)]
pub(crate) struct Clock<const HERTZ: u32 = 25_000_000>(pub(crate) Cell<u32>);

impl<const HERTZ: u32> Timer for Clock<HERTZ> {
    const TICKS_A_SECOND: u32 = HERTZ;
    const MASK: u32 = 0x00ff_ffff;

    fn now(&self) -> u32 {
        self.0.get() & Self::MASK
    }
}

pub(crate) const PERIOD: u32 = <Clock>::TICKS_A_SECOND / TURNS_A_SECOND;

/// Late turns after turns that began at these ticks.
fn late<const HERTZ: u32>(began: impl Iterator<Item = u64>) -> u32 {
    let clock = Clock::<HERTZ>::default();
    let mut handover = Handover::new();
    let (mut background, mut foreground) = handover.split(&named(&paper_robot()));
    let mut late = 0;
    for ticks in began {
        #[allow(clippy::cast_possible_truncation)]
        clock.0.set(ticks as u32);
        foreground.turn(&clock, |_| ());
        late = background.state().expect("a state").late;
    }
    late
}

/// Whole ticks of a timer that counts `hertz` when a turn begins that is punctual.
fn punctual(hertz: u32, turns: u64) -> impl Iterator<Item = u64> {
    (0..turns).map(move |turn| turn * u64::from(hertz) / u64::from(TURNS_A_SECOND))
}

/// A turn of 33,333.333 ticks or of 32.768 is no whole number of them.
#[test]
fn punctual_turns_are_punctual_at_any_rate_of_the_timer() {
    const MINUTE: u64 = 60_000;
    assert_eq!(late::<33_333_333>(punctual(33_333_333, 60 * MINUTE)), 0);
    assert_eq!(late::<168_000_000>(punctual(168_000_000, MINUTE)), 0);
    assert_eq!(late::<999_999>(punctual(999_999, 10 * MINUTE)), 0);
    assert_eq!(late::<32_768>(punctual(32_768, 10 * MINUTE)), 0);
    assert_eq!(late::<10_000>(punctual(10_000, 10 * MINUTE)), 0);
}

/// Ten minutes, with one turn late and two left out in the middle: three, and no others.
#[test]
fn turns_are_counted_right_with_clocks_that_differ() {
    const TURNS: u64 = 600_000;
    for millionths in [-200, -20, -1, 0, 1, 20, 200_i64] {
        let hertz = u64::try_from(33_333_333 * (1_000_000 + millionths) / 1_000_000).unwrap();
        let tick = |turn: u64| turn * hertz / u64::from(TURNS_A_SECOND);
        for at in [300_000, 300_001, 300_037, 300_063] {
            let began = (0..TURNS)
                .filter(|turn| !(at + 200..at + 202).contains(turn))
                .map(|turn| tick(turn) + u64::from(turn == at) * 33_333 / 5);
            let what = format!("{millionths} millionths, at turn {at}");
            assert_eq!(late::<33_333_333>(began), 3, "{what}");
        }
    }
}

/// Turns that are all late by the same are so for some time only: that is then when they are due. One
/// that was late for some time hides none that is left out later.
#[test]
fn the_due_time_is_found_again() {
    let period = u64::from(PERIOD);
    let began = (0..2000_u64).map(|turn| turn * period + u64::from(turn >= 500) * period / 2);
    let counted = late::<25_000_000>(began);
    assert!((1..=128).contains(&counted), "{counted}");
    let began = (0..2000_u64)
        .filter(|turn| !(1500..1503).contains(turn))
        .map(|turn| turn * period + u64::from((500..1000).contains(&turn)) * period / 2);
    assert_eq!(late::<25_000_000>(began), counted + 3);
}

#[test]
fn late_and_left_out_turns_are_counted() {
    let clock = <Clock>::default();
    let mut handover = Handover::new();
    let (mut background, mut foreground) = handover.split(&named(&paper_robot()));
    let mut late_after = |at: u32| {
        clock.0.set(at);
        foreground.turn(&clock, |_| ());
        background.state().expect("a state").late
    };
    // The timer comes around after 671 turns.
    let mut at = 0x00ff_0000;
    assert_eq!(late_after(at), 0);
    for _ in 0..2000 {
        at += PERIOD;
        assert_eq!(late_after(at), 0);
    }
    // A little early or late is on time.
    assert_eq!(late_after(at + PERIOD - 3), 0);
    assert_eq!(late_after(at + 2 * PERIOD + PERIOD / 10), 0);
    assert_eq!(late_after(at + 3 * PERIOD + PERIOD / 10 + 1), 1);
    assert_eq!(late_after(at + 4 * PERIOD), 1);
    // Two left out.
    assert_eq!(late_after(at + 7 * PERIOD), 3);
    assert_eq!(late_after(at + 8 * PERIOD), 3);
}

/// As erasing a page of single-bank flash stops a processor. The timer comes around after 671 ms, so
/// that 400 are well within what it can tell.
#[test]
fn turns_left_out_in_a_long_stop_are_counted() {
    let clock = <Clock>::default();
    let mut handover = Handover::new();
    let (mut background, mut foreground) = handover.split(&named(&paper_robot()));
    let mut late_after = |at: u32| {
        clock.0.set(at);
        foreground.turn(&clock, |_| ());
        background.state().expect("a state").late
    };
    assert_eq!(late_after(0), 0);
    assert_eq!(late_after(PERIOD), 0);
    assert_eq!(late_after(401 * PERIOD), 399);
    // And a short one after it.
    assert_eq!(late_after(402 * PERIOD), 399);
    assert_eq!(late_after(405 * PERIOD), 401);
}

#[test]
fn the_longest_turn_is_kept_apart_while_a_calibration_is_at_work() {
    let clock = <Clock>::default();
    let mut handover = Handover::new();
    let (mut background, mut foreground) = handover.split(&named(&paper_robot()));
    let mut turns = 0;
    let mut turn = |calibrating, ticks| {
        background.set_calibrating(calibrating);
        turns += 1;
        clock.0.set(turns * PERIOD);
        foreground.turn(&clock, |_| clock.0.set(clock.0.get() + ticks));
        background.state();
        // A turn says how long the ones before took.
        turns += 1;
        clock.0.set(turns * PERIOD);
        foreground.turn(&clock, |_| ());
        let state = background.state().expect("a state");
        (state.longest_ticks, state.longest_ticks_calibrating)
    };
    assert_eq!(turn(false, 900), (900, 0));
    assert_eq!(turn(true, 700), (900, 700));
    assert_eq!(turn(false, 1000), (1000, 700));
    assert_eq!(turn(true, 1100), (1100, 1100));
}
