//! The programs of `tests/target` under QEMU and on this machine: the same bits.

use delta_cal_target_tests::{cases, fixture, linear};
use delta_cal_verify::{Board, Clock, PACKAGE, TARGET, build_for_target, emulate, have};
use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};

/// Double precision in hardware, where the default code of the target computes it in software.
const FOR_M7: &str = "target.thumbv7em-none-eabihf.rustflags=['-Ctarget-cpu=cortex-m7']";
const PROGRAMS: [&str; 4] = ["--bin", PACKAGE, "--bin", "cases"];

/// Without the core's features, which this machine's have: what a feature adds changes nothing else.
#[test]
fn same_bits_as_on_the_host() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let target = build_for_target(&directory("firmware"), &PROGRAMS).expect("the build");
    let on_host = on_host(fixture::write);
    let expected = only("BITS ", &on_host);
    for scalar in ["f32", "f64"] {
        let lines = expected.iter().filter(|line| line.starts_with(scalar));
        let lines = lines.count();
        assert!(
            lines > 500,
            "only {lines} lines of {scalar}: the fixture was cut short"
        );
    }
    for board in [Board::M4, Board::M7] {
        let output = emulate(board, Clock::Free, &target.join(PACKAGE)).expect("the run");
        let lines = only("BITS ", &output);
        assert_same_lines(&lines, &expected);
        println!("{board:?}: the host's bits in {} lines", lines.len());
    }
}

#[test]
fn same_bits_with_double_precision_in_hardware() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let arguments = [&PROGRAMS[..], &["--config", FOR_M7]].concat();
    let target = build_for_target(&directory("firmware/cortex-m7"), &arguments).expect("the build");
    let fixture = emulate(Board::M7, Clock::Free, &target.join(PACKAGE)).expect("the run");
    let cases = emulate(Board::M7, Clock::Free, &target.join("cases")).expect("the run");
    let fails_on_m4 = emulate(Board::M4, Clock::Free, &target.join(PACKAGE));
    assert!(
        fails_on_m4.is_err(),
        "the Cortex-M4F has no double precision: the build did not use it"
    );
    assert_same_lines(
        &only("BITS ", &fixture),
        &only("BITS ", &on_host(fixture::write)),
    );
    assert_same_lines(
        &only("CASE ", &cases),
        &only("CASE ", &on_host(cases::write)),
    );
}

/// A thousand random robots in single precision and a hundred in double.
#[test]
fn same_bits_of_random_calibrations() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let target = build_for_target(&directory("firmware"), &PROGRAMS).expect("the build");
    let on_host = on_host(cases::write);
    let expected = only("CASE ", &on_host);
    for board in [Board::M4, Board::M7] {
        let output = emulate(board, Clock::Free, &target.join("cases")).expect("the run");
        let cases = only("CASE ", &output);
        assert_same_lines(&cases, &expected);
        println!("{board:?}: the host's bits in {} calibrations", cases.len());
    }

    let results = results(&expected);
    for (scalar, number) in [("f32", 1000), ("f64", 100)] {
        let results = &results[scalar];
        println!("{scalar}: {results:?}");
        assert_eq!(results.values().sum::<usize>(), number, "{scalar}");
        // A generator that drifts no longer tests what it should.
        for (result, least) in [
            ("accepted", number / 4),
            ("TooFewSamples", number / 20),
            ("Undetermined", number / 50),
            ("Uncertain", number / 50),
            ("NotConverged", number / 50),
            ("ResidualContradictsNoise", number / 50),
            ("FarFromNominal", number / 50),
            ("WrongSide", number / 50),
        ] {
            let found = results.get(result).copied().unwrap_or(0);
            assert!(
                found >= least,
                "{scalar}: {found} are {result}, not {least}"
            );
        }
    }
}

/// Kinematics, calibrations of arms, joint ones and observations of robots with linear drives.
#[test]
fn same_bits_of_linear_drives() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let arguments = ["--bin", "linear", "--features", "linear"];
    let target = build_for_target(&directory("firmware"), &arguments).expect("the build");
    let on_host = on_host(linear::write);
    let expected = only("BITS ", &on_host);
    for scalar in ["f32", "f64"] {
        let lines = expected.iter().filter(|line| line.starts_with(scalar));
        let calibrated =
            |line: &&&str| line.contains("joint towers") && line.contains("arm 3 parameters");
        let joint = lines.filter(calibrated).count();
        assert!(
            joint >= 15,
            "only {joint} joint calibrations of {scalar}: the fixture was cut short"
        );
    }
    for board in [Board::M4, Board::M7] {
        let output = emulate(board, Clock::Free, &target.join("linear")).expect("the run");
        let lines = only("BITS ", &output);
        assert_same_lines(&lines, &expected);
        println!("{board:?}: the host's bits in {} lines", lines.len());
    }
}

/// How often each result occurs, by scalar.
fn results<'a>(lines: &[&'a str]) -> BTreeMap<&'a str, BTreeMap<&'a str, usize>> {
    let mut results: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
    for line in lines {
        let mut words = line.split(' ');
        let scalar = words.next().expect("the scalar");
        let result = words.nth(4).expect("the result");
        *results
            .entry(scalar)
            .or_default()
            .entry(result)
            .or_default() += 1;
    }
    results
}

fn on_host(write: fn(&mut dyn Write) -> fmt::Result) -> String {
    let mut lines = String::new();
    write(&mut lines).expect("a string takes every line");
    lines
}

fn only<'a>(prefix: &str, output: &'a str) -> Vec<&'a str> {
    output
        .lines()
        .filter_map(|line| line.strip_prefix(prefix))
        .collect()
}

fn assert_same_lines(target: &[&str], host: &[&str]) {
    assert!(!host.is_empty(), "the host wrote nothing");
    for (number, (target, host)) in target.iter().zip(host).enumerate() {
        assert_eq!(
            target, host,
            "line {number} differs: target left, host right"
        );
    }
    assert_eq!(
        target.len(),
        host.len(),
        "number of lines on target and host"
    );
}

/// A target directory beside that of the tests.
pub(crate) fn directory(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .expect("the temporary directory is in the target directory")
        .join(name)
}
