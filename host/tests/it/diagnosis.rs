//! Files that cannot be right as a whole: what is injected is what is named, and nothing else is.

mod case;
mod faults;

use case::case;
use faults::{Change, FAULTS, OTHERS, RIGHT};

/// Robots with every way to calibrate: numbers of samples, frames, with and without a tolerance and a noise.
const ROBOTS: u64 = 240;
/// For each fault.
const SOME: u64 = 12;

/// The robots `0, 7, 14, …`: few of them still meet every way to calibrate; the next fault gets the next ones.
fn robots(fault: usize) -> impl Iterator<Item = u64> {
    let first = SOME * fault as u64;
    (first..first + SOME).map(|index| 7 * index % ROBOTS)
}

#[test]
fn faults_of_whole_files_are_named() {
    let mut unnamed = Vec::new();
    for (place, (name, frame, change, expected)) in FAULTS.iter().enumerate() {
        let named = robots(place).filter(|robot| {
            let (mut case, mut rng) = case(*robot, *frame);
            change(&mut case, &mut rng);
            let said = case.diagnosis();
            said.is_some_and(|said| expected.iter().all(|part| said.contains(part)))
        });
        let named = named.count() as u64;
        if 100 * named < 90 * SOME {
            unnamed.push(format!("{name}: {named} of {SOME}"));
        }
    }
    assert!(unnamed.is_empty(), "{unnamed:#?}");
}

fn accused(others: &[(&'static str, Change)]) -> Vec<String> {
    let mut accused = Vec::new();
    for (place, (name, change)) in others.iter().enumerate() {
        let given = robots(place).filter(|robot| {
            let (mut case, mut rng) = case(*robot, None);
            change(&mut case, &mut rng);
            case.diagnosis().is_some()
        });
        let given = given.count();
        if given > 0 {
            accused.push(format!("{name}: {given} of {SOME}"));
        }
    }
    accused
}

#[test]
fn nothing_is_said_of_files_that_are_right_or_wrong_otherwise() {
    assert_eq!(accused(RIGHT), Vec::<String>::new());
    assert_eq!(accused(OTHERS), Vec::<String>::new());
}
