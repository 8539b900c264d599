//! What the core costs on a Cortex-M4F under QEMU, against `tests/target/budgets.toml`; and that no panic path survives
//! in what a controller calls.

use crate::target::directory;
use delta_cal_verify::{
    Board, Clock, PROFILE, TARGET, build_for_target, cargo, emulate, have, run,
};
use object::read::archive::ArchiveFile;
use object::{Object, ObjectSection, ObjectSymbol};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const BUDGETS: &str = include_str!("../target/budgets.toml");

#[test]
fn every_budget_is_kept() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let programs = ["--bin", "measure", "--bin", "flash"];
    let programs = build_for_target(&directory("firmware"), &programs).expect("the build");
    let output =
        emulate(Board::M4, Clock::Instructions, &programs.join("measure")).expect("the run");
    let mut figures: BTreeMap<&str, u64> = output.lines().filter_map(figure).collect();
    figures.insert("f32/flash", flash(&programs.join("flash")));

    let budgets: toml::Table = BUDGETS.parse().expect("budgets.toml");
    let mut over = Vec::new();
    for (item, value) in &figures {
        let limit = budgets.get(*item).and_then(toml::Value::as_integer);
        let limit = limit.map(|it| u64::try_from(it).expect("a count"));
        let row = match limit {
            Some(limit) => format!("{item:<36} {value:>10} of {limit:>10}"),
            None => format!("{item:<36} {value:>10}"),
        };
        println!("{row}");
        over.extend(limit.is_some_and(|limit| *value > limit).then_some(row));
    }
    let unmeasured: Vec<_> = budgets
        .keys()
        .filter(|item| !figures.contains_key(&***item))
        .collect();
    assert!(unmeasured.is_empty(), "not measured: {unmeasured:?}");
    assert!(over.is_empty(), "{}", over.join("\n"));
}

/// `MEASURED <item> <value>`
fn figure(line: &str) -> Option<(&str, u64)> {
    let mut words = line.strip_prefix("MEASURED ")?.split(' ');
    Some((words.next()?, words.next()?.parse().ok()?))
}

/// What every firmware has: the start of `cortex-m-rt` and its default handlers.
const STARTUP: [&str; 6] = [
    "Reset",
    "main",
    "DefaultPreInit",
    "DefaultHandler_",
    "HardFault_",
    "HardFaultTrampoline",
];

/// Bytes of code, constants and initial values, without vector table and startup.
fn flash(program: &Path) -> u64 {
    let bytes = std::fs::read(program).expect("the program");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let section = |name| file.section_by_name(name).map_or(0, |it| it.size());
    let startup = file
        .symbols()
        .filter(|it| it.name().is_ok_and(|name| STARTUP.contains(&name)));
    section(".text") + section(".rodata") + section(".data")
        - startup.map(|it| it.size()).sum::<u64>()
}

/// What each function's symbol in the archive begins with.
const PREFIX: &str = "core_";
/// Must not link.
const PANICS: &str = "panics_on_purpose";

/// The panic handler of `tests/link` calls a function that exists nowhere: what links has no path to it.
#[test]
fn no_panic_path_survives() {
    if !have(&[TARGET]) {
        return;
    }
    let directory = directory("firmware");
    let build = [
        "build",
        "--profile",
        PROFILE,
        "--package",
        "delta-cal-link-tests",
    ];
    cargo(&directory, &[&build[..], &["--target", TARGET]].concat()).expect("the build");
    let archive = directory
        .join(TARGET)
        .join(PROFILE)
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
    assert!(names.len() >= 20, "{names:?}");
    if !links(&names) {
        let culprits: Vec<_> = names.iter().filter(|name| !links(&[name])).collect();
        panic!("a panic path survives in {culprits:?}");
    }
    println!("no panic path in {} functions", names.len());
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
