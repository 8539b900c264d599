//! Every check of the project, one command: `cargo verify`.

mod budgets;
mod check;
mod clock;
mod docs;
mod features;
mod fuzz;
mod licences;
mod linuxcnc;
mod mutants;
mod package;
mod programs;
mod setup;
mod stages;
mod structure;
mod versions;

use check::Check;
use clock::{Cost, Start};
use stages::{BY_HAND, QUICK, STAGES, Stage};
use std::process::ExitCode;

const USAGE: &str = "\
Runs every check, in stages; all failures are collected and summed up at the end.

Usage: cargo verify [quick | STAGE...]

  quick       a minute: format, structure, links, clippy on the host, unit tests
  STAGE...    run only these, in the order given
  --list      list the stages
  --help      print this
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let asked = |flags: &[&str]| arguments.iter().any(|a| flags.contains(&a.as_str()));
    if asked(&["-h", "--help"]) {
        println!("{USAGE}");
        print_stages();
        return ExitCode::SUCCESS;
    }
    if asked(&["--list"]) {
        print_stages();
        return ExitCode::SUCCESS;
    }
    match chosen(&arguments) {
        Ok(stages) => run(&stages),
        Err(unknown) => {
            eprintln!("There is no stage {unknown:?}; cargo verify --list lists them.");
            ExitCode::from(2)
        }
    }
}

fn print_stages() {
    for (heading, stages) in [
        ("All, in this order:", STAGES),
        ("Quick:", QUICK),
        ("Only if asked for:", BY_HAND),
    ] {
        println!("{heading}\n");
        for stage in stages {
            println!("  {:<10}  {}", stage.name, stage.about);
        }
        println!();
    }
}

/// The stages of these names, all of them without names; or the name that is none.
fn chosen(names: &[String]) -> Result<Vec<&'static Stage>, &str> {
    if names.is_empty() {
        return Ok(STAGES.iter().collect());
    }
    let mut stages = Vec::new();
    for name in names {
        if name == "quick" {
            stages.extend(QUICK);
            continue;
        }
        let mut all = STAGES.iter().chain(QUICK).chain(BY_HAND);
        stages.push(all.find(|stage| stage.name == name).ok_or(name.as_str())?);
    }
    Ok(stages)
}

struct Finished {
    name: &'static str,
    failures: Vec<String>,
    skipped: Option<String>,
    cost: Cost,
}

fn run(stages: &[&Stage]) -> ExitCode {
    let begin = Start::now();
    let mut finished = Vec::new();
    for stage in stages {
        println!("\n=== {}: {}", stage.name, stage.about);
        let start = Start::now();
        let mut check = Check::default();
        (stage.run)(&mut check);
        finished.push(Finished {
            name: stage.name,
            skipped: check.take_skipped(),
            failures: check.into_failures(),
            cost: start.cost(),
        });
    }

    println!("\n=== summary");
    for stage in &finished {
        let verdict = match &stage.skipped {
            _ if !stage.failures.is_empty() => "failed",
            Some(_) => "skipped",
            None => "ok",
        };
        println!("{:<10}  {verdict:<7}  {}", stage.name, stage.cost);
        for failure in stage.skipped.iter().chain(&stage.failures) {
            println!("    {}", failure.replace('\n', "\n    "));
        }
    }
    let failed = finished
        .iter()
        .filter(|stage| !stage.failures.is_empty())
        .count();
    let skipped = finished.iter().filter(|stage| stage.skipped.is_some());
    let skipped = skipped.count();
    println!(
        "{} passed, {failed} failed, {skipped} skipped, {}",
        finished.len() - failed - skipped,
        begin.cost().to_string().trim_start()
    );
    if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
