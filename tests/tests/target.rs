//! The programs of `tests/target` under QEMU and on this machine: the same bits. Double precision in hardware is compared
//! through the C library, and over the link.

use delta_cal_target_tests::{cases, fixture, linear};
use delta_cal_tests::size;
use delta_cal_verify::{Board, Clock, PACKAGE, PROFILE, TARGET, cargo, emulate, have, run};
use object::read::archive::ArchiveFile;
use object::{Object, ObjectSymbol};
use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const PROGRAMS: [&str; 4] = ["--bin", PACKAGE, "--bin", "cases"];

/// Without the core's features, which this machine's have: what a feature adds changes nothing else.
#[test]
fn same_bits_as_on_the_host() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let on_host = same_bits(PACKAGE, &PROGRAMS, fixture::write);
    let expected = only("BITS ", &on_host);
    for scalar in ["f32", "f64"] {
        let lines = expected.iter().filter(|line| line.starts_with(scalar));
        let lines = lines.count();
        assert!(
            lines > 500,
            "only {lines} lines of {scalar}: the fixture was cut short"
        );
    }
}

/// A thousand random robots in single precision and fifty in double, arm by arm; a tenth of them jointly.
#[test]
fn same_bits_of_random_calibrations() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let on_host = same_bits("cases", &PROGRAMS, cases::write);
    let expected = only("CASE ", &on_host);
    let results = results(&expected);
    for (scalar, number) in [("f32-ikm", 1000), ("f64-ikm", 50)] {
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
    for (scalar, number) in [("f32-joint", 100), ("f64-joint", 10)] {
        let results = &results[scalar];
        println!("{scalar}: {results:?}");
        assert_eq!(results.values().sum::<usize>(), number, "{scalar}");
        assert!(results["accepted"] >= number / 4, "{scalar}");
    }
}

/// Kinematics, calibrations of arms, joint ones and observations of robots with linear drives.
#[test]
fn same_bits_of_linear_drives() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let arguments = ["--bin", "linear", "--features", "linear"];
    let on_host = same_bits("linear", &arguments, linear::write);
    let expected = only("BITS ", &on_host);
    for scalar in ["f32", "f64"] {
        let lines = expected.iter().filter(|line| line.starts_with(scalar));
        let calibrated =
            |line: &&&str| line.contains("joint, towers") && line.contains("arm 3 parameters");
        let joint = lines.filter(calibrated).count();
        assert!(
            joint >= 15,
            "only {joint} joint calibrations of {scalar}: the fixture was cut short"
        );
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

/// What this machine writes, after a comparison with what a program does on an M4.
fn same_bits(program: &str, build: &[&str], write: fn(&mut dyn Write) -> fmt::Result) -> String {
    let mut expected = String::new();
    write(&mut expected).expect("a string takes every line");
    let program = compiled_for_m4(build).join(program);
    let found = emulate(Board::M4, Clock::Free, &program).expect("the run");
    for (number, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "line {number}: target left, host right");
    }
    assert_eq!(found.lines().count(), expected.lines().count());
    expected
}

fn only<'a>(prefix: &str, output: &'a str) -> Vec<&'a str> {
    output
        .lines()
        .filter_map(|line| line.strip_prefix(prefix))
        .collect()
}

/// Programs whose bits are compared are compiled as the tests are, in a third of the time that what ships takes. The bits
/// of that are compared through the C library.
fn compiled_for_m4(arguments: &[&str]) -> PathBuf {
    let (build, directory) = (
        ["build", "--profile", "test", "--package", PACKAGE],
        directory(""),
    );
    let build = [&build[..], &["--target", TARGET], arguments].concat();
    cargo(&directory, &build).expect("the build");
    directory.join(TARGET).join("debug")
}

/// A target directory beside that of the tests; without a name, that itself.
pub(crate) fn directory(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .expect("the temporary directory is in the target directory")
        .join(name)
}

/// What each function's symbol in the archive begins with.
const PREFIX: &str = "core_";
/// Must not link.
const PANICS: &str = "panics_on_purpose";

/// The panic handler of `tests/link` calls a function that exists nowhere: what links has no path to it. In both profiles
/// for a Cortex-M; the long campaign also at `z`.
#[test]
fn no_panic_path_survives() {
    if !have(&[TARGET]) {
        return;
    }
    let at_z = ["--config", "profile.small.opt-level='z'"];
    let levels = [(PROFILE, &[][..]), ("small", &[]), ("small", &at_z)];
    for (profile, level) in levels.into_iter().take(size(2, 3)) {
        no_panic_path_survives_in(&directory("firmware"), profile, level);
    }
}

fn no_panic_path_survives_in(directory: &Path, profile: &str, level: &[&str]) {
    let build = ["build", "--profile", profile, "--target", TARGET];
    let package = ["--package", "delta-cal-link-tests"];
    cargo(directory, &[&build[..], &package, level].concat()).expect("the build");
    let archive = directory
        .join(TARGET)
        .join(profile)
        .join("libdelta_cal_link_tests.a");
    let linker = linker();
    let links = |symbols: &[&str]| {
        Command::new(&linker)
            .args(["-flavor", "gnu", "--gc-sections", "--entry=0", "--output"])
            .arg(directory.join("panic-free.elf"))
            .args(symbols.iter().map(|symbol| format!("--undefined={symbol}")))
            .arg(&archive)
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success())
    };
    assert!(
        !links(&[PANICS]),
        "{PANICS} links: the proof proves nothing"
    );
    let bytes = std::fs::read(&archive).expect("the archive");
    let functions = functions(&bytes);
    let names: Vec<&str> = functions.iter().map(String::as_str).collect();
    assert!(names.len() >= 30, "{names:?}");
    if !links(&names) {
        let culprits: Vec<_> = names.iter().filter(|name| !links(&[name])).collect();
        panic!("{profile} {level:?}: a panic path survives in {culprits:?}");
    }
    println!(
        "{profile} {level:?}: no panic path in {} functions",
        names.len()
    );
}

/// rustc's own linker, there wherever the bare target can be built.
fn linker() -> PathBuf {
    let mut rustc = Command::new("rustc");
    rustc
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["--print", "target-libdir"]);
    let libraries = PathBuf::from(run(rustc).expect("rustc").trim());
    libraries
        .with_file_name("bin")
        .join(format!("rust-lld{}", std::env::consts::EXE_SUFFIX))
}

/// The symbols that the archive defines.
fn functions(archive: &[u8]) -> Vec<String> {
    let mut functions = Vec::new();
    for member in ArchiveFile::parse(archive).expect("an archive").members() {
        let data = member.and_then(|it| it.data(archive)).expect("a member");
        // An archive may hold other things than objects.
        let Ok(file) = object::File::parse(data) else {
            continue;
        };
        let defined = file.symbols().filter(ObjectSymbol::is_definition);
        let names = defined.filter_map(|it| it.name().ok().map(str::to_owned));
        functions.extend(names.filter(|name| name.starts_with(PREFIX)));
    }
    functions
}
