//! Files that cannot be right as a whole: what is injected is what is named, and nothing else is.

mod case;
mod faults;

use case::case;
use delta_cal_tests::documents::print_campaign;
use delta_cal_tests::{is_long, size};
use faults::{Change, FAULTS, Fault, OTHERS, RIGHT};

/// Robots, and every way to calibrate them: numbers of samples, frames, methods, with and without a
/// guess, a tolerance and a noise.
const ROBOTS: u64 = 240;

/// The robots for each fault.
fn some() -> u64 {
    size(12, 48)
}

/// The robots `0, 7, 14, …`: few of them still meet every way to calibrate. Where few are few indeed,
/// the next fault gets the next ones.
fn robots(count: u64, fault: usize) -> impl Iterator<Item = u64> {
    let first = if is_long() { 0 } else { count * fault as u64 };
    (first..first + count).map(|index| 7 * index % ROBOTS)
}

/// The faults that are named for less than 95 % of the robots.
fn unnamed(count: u64) -> Vec<&'static str> {
    println!("fault of the file                  robots   named");
    let total = std::cell::Cell::new(0);
    let unnamed = |(place, fault): &(usize, &Fault)| {
        let (name, frame, change, expected) = fault;
        let mut named = 0;
        for robot in robots(count, *place) {
            let (mut case, mut rng) = case(robot, *frame);
            change(&mut case, &mut rng);
            let said = case.diagnosis();
            let right = said
                .as_ref()
                .is_some_and(|said| expected.iter().all(|part| said.contains(part)));
            named += u64::from(right);
            if !right && std::env::var_os("SHOW").is_some() {
                println!("  {robot} {} {:?}: {said:?}", case.rows.len(), case.options);
            }
        }
        println!("{name:<34} {count:>6} {named:>7}");
        total.set(total.get() + named);
        100 * named < 95 * count
    };
    let faults = FAULTS.iter().enumerate().filter(unnamed);
    let unnamed = faults.map(|(_, fault)| fault.0).collect();
    if count == some() {
        let faults = FAULTS.len();
        let files = faults as u64 * count;
        print_campaign(
            "docs/diagnosis.md",
            &format!(
                "{faults} such faults in {count} files each: {} of the {files} files",
                total.get()
            ),
        );
    }
    unnamed
}

/// The other files of which anything is said, for any robot.
fn accused(others: &[(&'static str, Change)], count: u64) -> Vec<&'static str> {
    println!("other file                         robots   given a diagnosis");
    let accused = |(place, (name, change)): &(usize, &(&str, Change))| {
        let mut given = 0;
        for robot in robots(count, *place) {
            let (mut case, mut rng) = case(robot, None);
            change(&mut case, &mut rng);
            if let Some(said) = case.diagnosis() {
                given += 1;
                if std::env::var_os("SHOW").is_some() {
                    println!("  {robot} {} {:?}: {said}", case.rows.len(), case.options);
                }
            }
        }
        println!("{name:<34} {count:>6} {given:>7}");
        given > 0
    };
    let accused = others.iter().enumerate().filter(accused);
    accused.map(|(_, other)| other.0).collect()
}

#[test]
fn faults_of_whole_files_are_named() {
    assert_eq!(unnamed(some()), <[&str; 0]>::default());
}

#[test]
fn files_that_are_wrong_in_another_way_are_not_explained() {
    assert_eq!(accused(OTHERS, some()), <[&str; 0]>::default());
}

#[test]
fn right_files_are_not_accused() {
    assert_eq!(accused(RIGHT, size(60, ROBOTS)), <[&str; 0]>::default());
}
