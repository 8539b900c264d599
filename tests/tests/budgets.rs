//! What the core costs on a Cortex-M4F, against `budgets.toml` and against what the pages say.

use crate::target::directory;
use delta_cal_tests::{is_long, size};
use delta_cal_verify::{Board, Clock, PACKAGE, TARGET, cargo, check_page, emulate, have};
use object::{Object, ObjectSection, ObjectSymbol};
use std::collections::BTreeMap;
use std::path::Path;

const BUDGETS: &str = include_str!("../target/budgets.toml");

/// Numbers by the name of what was measured.
pub(crate) type Figures = BTreeMap<String, u64>;

/// How a firmware is built: the name in front of its figures, the profile, further arguments, the programs.
type Build = (
    &'static str,
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
);

const FLASH: [&str; 2] = ["flash", "joint-flash"];
const BUILDS: [Build; 4] = [
    ("", "firmware", &[], &["measure", "flash", "joint-flash"]),
    ("linear-", "firmware", &["--features", "linear"], &FLASH),
    // As most firmware is built, with the core at level 3 and, in the long campaign, without.
    ("small-", "small", &[], &["measure", "flash", "joint-flash"]),
    (
        WITHOUT,
        "small",
        &[
            "--features",
            "usual-alone",
            "--config",
            "profile.small.package.delta-cal.opt-level='s'",
        ],
        &["measure", "joint-flash"],
    ),
];
const WITHOUT: &str = "s-";

/// What takes at most 12 % longer in a program built for `s` with the core at 3.
const NO_SLOWER: [&str; 5] = [
    "f32/solve-20-mean",
    "f32/joint-solve-20-mean",
    "f32/gated-add-mean",
    "f32/gated-joint-add-mean",
    "f32/observations",
];

#[test]
fn every_budget_is_kept() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let mut figures = Figures::new();
    std::thread::scope(|scope| {
        let mut runs = Vec::new();
        for (name, profile, arguments, programs) in BUILDS.into_iter().take(size(3, 4)) {
            let build = ["build", "--profile", profile, "--package", PACKAGE];
            let programs_of = programs.iter().flat_map(|program| ["--bin", *program]);
            let of_target = ["--target", TARGET].into_iter().chain(programs_of);
            let arguments: Vec<_> = [&build[..], arguments].concat();
            let arguments: Vec<_> = arguments.into_iter().chain(of_target).collect();
            cargo(&directory("firmware"), &arguments).expect("the build");
            let place = directory("firmware").join(TARGET).join(profile);
            for program in programs {
                let file = place.join(program);
                if FLASH.contains(program) {
                    figures.insert(format!("{name}f32/{program}"), flash(&file));
                    continue;
                }
                // The next build may replace it.
                let own = place.join(format!("{name}{program}.measured"));
                std::fs::copy(file, &own).expect("a copy");
                let run = move || emulate(Board::M4, Clock::Instructions, &own).expect("the run");
                runs.push((name, scope.spawn(run)));
            }
        }
        for (name, run) in runs {
            let output = run.join().expect("the run");
            let measured = output.lines().filter_map(figure);
            figures.extend(measured.map(|(item, value)| (format!("{name}{item}"), value)));
        }
    });

    let budgets: toml::Table = BUDGETS.parse().expect("budgets.toml");
    let mut over = Vec::new();
    for (item, value) in &figures {
        let limit = budgets.get(item).and_then(toml::Value::as_integer);
        let limit = limit.map(|it| u64::try_from(it).expect("a count"));
        let row = match limit {
            Some(limit) => format!("{item:<42} {value:>10} of {limit:>10}"),
            None => format!("{item:<42} {value:>10}"),
        };
        println!("{row}");
        over.extend(limit.is_some_and(|limit| *value > limit).then_some(row));
    }
    let unmeasured: Vec<_> = budgets
        .keys()
        .filter(|item| !figures.contains_key(*item))
        .collect();
    assert!(unmeasured.is_empty(), "not measured: {unmeasured:?}");
    for item in NO_SLOWER {
        let [small, fast] = ["small-", ""].map(|build| figures[&format!("{build}{item}")]);
        if 25 * small > 28 * fast {
            over.push(format!(
                "{item}: {small} in a program built for size, {fast} otherwise"
            ));
        }
    }
    assert!(over.is_empty(), "{}", over.join("\n"));
    check_pages("f32/", &figures);
}

/// `MEASURED <item> <value>`
fn figure(line: &str) -> Option<(String, u64)> {
    let mut words = line.strip_prefix("MEASURED ")?.split(' ');
    Some((words.next()?.to_owned(), words.next()?.parse().ok()?))
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

/// Where figures stand; with decimals they are in thousands.
const PAGES: [&str; 5] = [
    "README.md",
    "core/README.md",
    "docs/benchmarks.md",
    "docs/board.md",
    "docs/controller.md",
];
/// A part of each: compilers change.
const OFF: f64 = 0.02;

/// Checks the figures on the pages whose names contain a text.
pub(crate) fn check_pages(of: &str, figures: &Figures) {
    for page in PAGES {
        check_page(page, |name, decimals| {
            let is_measured = name.contains(of) && (is_long() || !name.starts_with(WITHOUT));
            let measured = is_measured.then(|| figures[name] as f64)?;
            let shown = measured / if decimals > 0 { 1000.0 } else { 1.0 };
            Some((shown, OFF * shown))
        });
    }
}
