//! `delta-cal reproduce`.

use super::failure::Failure;
use super::print::print;
use super::progress::{Bar, interruption};
use super::simulate;
use crate::campaign::RunOptions;
use crate::files::output;
use crate::reproduce;
use crate::reproduce::{NamedFigure, Reproduction, comparisons, figures, results_csv};
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(crate) const HELP: &str = "\
The paper is T. Bentaleb, J. Iqbal, \"On the improvement of calibration accuracy of parallel robots \
- modeling and optimization\", JTAM 58(1), 2020, doi 10.15632/jtam-pl/115863.

The program writes to DIR:
  report.html   the report with its figures, one file that opens in any browser
  results.csv   one row for each case
  figures/      the figures as SVG
  campaigns/    each simulation with one row for each robot; its plan.toml is a
                campaign file for delta-cal simulate

After Ctrl-C the finished part is kept, and the same command continues. Everything but the times is \
the same to the bit in every run.

Examples:
  delta-cal reproduce
  delta-cal reproduce --output paper --robots 100

Exit codes:
  0  done
  2  the command line is wrong, or the folder holds something else
  4  a file could not be written
  130  interrupted; what is finished is kept in DIR";

#[derive(Debug, Args)]
pub(crate) struct ReproduceArguments {
    /// Write report.html, results.csv, the figures and the campaigns to this folder
    #[arg(long, value_name = "DIR", default_value = "reproduction")]
    output: PathBuf,
    /// The number of robots of each case [default: 200]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    robots: Option<u64>,
    /// The number of threads [default: one for each processor]. The results are the same to the bit
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    threads: Option<u16>,
    /// Delete other campaigns in DIR and start from the beginning
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &ReproduceArguments) -> Result<(), Failure> {
    let interrupted = interruption();
    let options = RunOptions {
        threads: arguments.threads.map_or(0, usize::from),
        force: arguments.force,
        interrupted: &interrupted,
    };
    let folder = &arguments.output;
    let (bar, begin) = (Bar::new("robots"), Instant::now());
    let result = reproduce::run(
        folder,
        arguments.robots,
        &options,
        &mut |finished, robots| {
            bar.show(finished, robots);
        },
    );
    bar.finish();
    let reproduction = result.map_err(|error| simulate::failure(error, Some(folder)))?;
    write(folder, &reproduction)?;
    let mut text = reproduce::table(&comparisons(&reproduction));
    let _ = writeln!(
        text,
        "\n{} calibrations in {} cases, {:.0} s. Written: {}",
        reproduction.calibrations(),
        reproduction
            .experiments
            .iter()
            .map(|results| results.cases.len())
            .sum::<usize>(),
        begin.elapsed().as_secs_f64(),
        folder.join("report.html").display()
    );
    print(&text)
}

fn write(folder: &Path, reproduction: &Reproduction) -> Result<(), Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::Output(error.to_string());
    let results = results_csv(reproduction).map_err(|error| failed(&error))?;
    let figures = figures(reproduction);
    let report = reproduce::render(reproduction, &figures)?;
    let pictures = folder.join("figures");
    std::fs::create_dir_all(&pictures)
        .map_err(|error| failed(&format!("{}: {error}", pictures.display())))?;
    for NamedFigure { name, figure, .. } in &figures {
        let svg = figure.to_svg()?;
        output::write_all(&[(&pictures.join(format!("{name}.svg")), &svg)])?;
    }
    output::write_all(&[
        (&folder.join("results.csv"), &results),
        (&folder.join("report.html"), &report),
    ])?;
    Ok(())
}
