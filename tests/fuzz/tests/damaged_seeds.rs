//! Every seed as it is, and with some bytes changed: what `cargo fuzz` does with far more inputs.

#![allow(clippy::unwrap_used, clippy::panic)] // in tests a panic is the failure

use delta_cal_fuzz as fuzz;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::TestRunner;
use std::fs;
use std::path::Path;

/// One change of an input.
#[derive(Debug, Clone)]
enum Change {
    Replace(Index, u8),
    Insert(Index, u8),
    Remove(Index),
    Cut(Index),
    /// What stands at one place comes again at another.
    Repeat(Index, Index, usize),
}

fn change() -> impl Strategy<Value = Change> {
    let at = any::<Index>;
    prop_oneof![
        4 => (at(), any::<u8>()).prop_map(|(place, byte)| Change::Replace(place, byte)),
        // What numbers and files consist of: such changes are more often read.
        4 => (at(), select(b"0123456789-.,eE\n \"=[]#".to_vec())).prop_map(|(place, byte)| Change::Replace(place, byte)),
        2 => (at(), any::<u8>()).prop_map(|(place, byte)| Change::Insert(place, byte)),
        2 => at().prop_map(Change::Remove),
        1 => at().prop_map(Change::Cut),
        2 => (at(), at(), 1..40_usize).prop_map(|(from, to, length)| Change::Repeat(from, to, length)),
    ]
}

fn changed(seed: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for change in changes {
        let length = bytes.len();
        if length == 0 {
            break;
        }
        match change {
            Change::Replace(at, byte) => bytes[at.index(length)] = *byte,
            Change::Insert(at, byte) => bytes.insert(at.index(length), *byte),
            Change::Remove(at) => drop(bytes.remove(at.index(length))),
            Change::Cut(at) => bytes.truncate(at.index(length)),
            Change::Repeat(from, to, many) => {
                let from = from.index(length);
                let part = bytes[from..length.min(from + many)].to_vec();
                let to = to.index(length);
                bytes.splice(to..to, part);
            }
        }
    }
    bytes
}

/// A panic is the failure; proptest then looks for the fewest changes that lead to it, and shows them.
fn no_promise_is_broken(name: &str, target: fn(&[u8]), inputs: u32) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("seeds")
        .join(name);
    let seeds: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|seed| seed.unwrap().path())
        .collect();
    assert!(!seeds.is_empty());
    for seed in &seeds {
        target(&fs::read(seed).unwrap());
    }
    let config = ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(inputs)
    };
    let inputs = (select(seeds), vec(change(), 1..8));
    let result = TestRunner::new(config).run(&inputs, |(seed, changes)| {
        target(&changed(&fs::read(seed).unwrap(), &changes));
        Ok(())
    });
    if let Err(failure) = result {
        panic!("{failure}");
    }
}

/// A test for each target, with as many inputs as some seconds allow.
macro_rules! targets {
    ($($name:ident $inputs:literal,)*) => {
        $(
            #[test]
            fn $name() {
                no_promise_is_broken(stringify!($name), fuzz::$name, $inputs);
            }
        )*

        #[test]
        fn every_folder_of_seeds_has_a_test() {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds");
            let mut seeds: Vec<_> = fs::read_dir(folder).unwrap().map(|it| it.unwrap().file_name()).collect();
            seeds.sort_unstable();
            assert_eq!(seeds, [$(stringify!($name)),*]);
        }
    };
}

targets! {
    calibration 80,
    campaign_file 2000,
    controller 500,
    driver 100,
    kinematics 2000,
    robot_file 2000,
    samples_file 1000,
    solver 300,
    store 300,
}
