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
mod side_by_side;
mod stages;
mod structure;
mod summary;
mod versions;

use check::Check;
use clock::Start;
use stages::{BY_HAND, FIRST, QUICK, SIDE_BY_SIDE, Stage};
use std::process::ExitCode;
use summary::Finished;

const USAGE: &str = "\
Runs every check, in stages, two at a time; all failures are collected and summed up at the end.

Usage: cargo verify [quick | STAGE... | mutants FILE...]

  quick       a minute: format, structure, links, clippy on the host, unit tests
  STAGE...    run only these, one after the other, in the order given
  FILE...     only the mutants of these files, by their paths from the repository's root
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
    let begin = Start::now();
    if arguments.is_empty() {
        return match run_all() {
            Ok(finished) => summary::print(&finished, begin),
            Err(error) => {
                eprintln!("This program does not find itself, to run each stage: {error}");
                ExitCode::FAILURE
            }
        };
    }
    let (files, names): (Vec<_>, Vec<_>) = arguments.into_iter().partition(|a| a.contains('/'));
    if !files.is_empty() && names != ["mutants"] {
        eprintln!("Only the stage mutants takes files.");
        return ExitCode::from(2);
    }
    match chosen(&names) {
        Ok(stages) => summary::print(&run(&stages, &files), begin),
        Err(unknown) => {
            eprintln!("There is no stage {unknown:?}; cargo verify --list lists them.");
            ExitCode::from(2)
        }
    }
}

fn print_stages() {
    for (heading, stages) in [
        ("All, first:", FIRST),
        ("then:", SIDE_BY_SIDE[0]),
        ("side by side with:", SIDE_BY_SIDE[1]),
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

/// The stages of these names, or the name that is none.
fn chosen(names: &[String]) -> Result<Vec<&'static Stage>, &str> {
    let mut stages = Vec::new();
    for name in names {
        if name == "quick" {
            stages.extend(QUICK);
            continue;
        }
        let mut all = [FIRST, SIDE_BY_SIDE[0], SIDE_BY_SIDE[1], QUICK, BY_HAND]
            .into_iter()
            .flatten();
        stages.push(all.find(|stage| stage.name == name).ok_or(name.as_str())?);
    }
    Ok(stages)
}

/// Runs stages one after the other, of these files if there are any.
fn run(stages: &[&Stage], files: &[String]) -> Vec<Finished> {
    let run = |stage: &&Stage| {
        println!("\n=== {}: {}", stage.name, stage.about);
        let start = Start::now();
        let mut check = Check::of(files);
        (stage.run)(&mut check);
        Finished::new(stage.name, check, start)
    };
    stages.iter().map(run).collect()
}

/// Runs all of them, most of them side by side.
fn run_all() -> std::io::Result<Vec<Finished>> {
    let first: Vec<&Stage> = FIRST.iter().collect();
    let mut finished = run(&first, &[]);
    finished.extend(side_by_side::run(SIDE_BY_SIDE)?);
    Ok(finished)
}
