//! `delta-cal simulate`.

use super::failure::Failure;
use super::output::{self, Progress, deliver, print};
use crate::campaign::{self, CaseSummary, EXAMPLE, Plan, paper, summarize};
use crate::report;
use crate::{InputError, InputText};
use clap::Args;
use serde::Serialize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

const MOST: u64 = 1_000_000_000;

#[derive(Debug, Args)]
pub(crate) struct SimulateArguments {
    /// The campaign file; without it the built-in campaign
    #[arg(value_name = "CAMPAIGN.toml")]
    campaign: Option<PathBuf>,
    /// Simulate these robots of each case [default: all that the campaign file asks for]
    #[arg(long, alias = "robots", value_name = "FROM..TO", value_parser = range)]
    count: Option<Range<u64>>,
    /// Write one row for each robot and case; with --paper one for each case
    #[arg(long, value_name = "ROWS.csv")]
    output: Option<PathBuf>,
    /// Summarise the rows of these files, which earlier runs have written
    #[arg(long, value_name = "ROWS.csv", num_args = 1.., conflicts_with_all = ["campaign", "count", "paper", "output"])]
    summary: Vec<PathBuf>,
    /// Run the simulations of the paper, and print its figures beside those found
    #[arg(long, conflicts_with = "campaign")]
    paper: bool,
    /// Write the summary as JSON to this file, or with - to standard output in place of the table
    #[arg(long, value_name = "SUMMARY.json")]
    json: Option<PathBuf>,
    /// Print the built-in campaign file, which shows every key
    #[arg(long, exclusive = true)]
    example: bool,
}

fn range(text: &str) -> Result<Range<u64>, String> {
    let ends = text.split_once("..");
    let ends = ends.and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
    match ends {
        Some(range) if range.start < range.end && range.end <= MOST => Ok(range),
        Some(_) => Err("empty range, or a robot number above 1 000 000 000".to_owned()),
        None => Err("write a range of robots as 0..1000".to_owned()),
    }
}

pub(crate) fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    if arguments.example {
        return print(EXAMPLE);
    }
    // A campaign can take long: its results must not be lost in the end.
    for path in [&arguments.output, &arguments.json].into_iter().flatten() {
        output::check_writable(path)?;
    }
    if !arguments.summary.is_empty() {
        let summaries = of_files(&arguments.summary)?;
        let text = report::campaign::render(&summaries);
        return publish(arguments, &summaries, text, Ok(String::new()));
    }
    if arguments.paper {
        let count = arguments.count.as_ref();
        let experiments = with_bar(|progress| paper::simulate(count, progress))?;
        let rows = paper::comparisons(&experiments).map_err(|error| unwritten(&error))?;
        let text = report::campaign::render_paper(&rows);
        return publish(arguments, &rows, text, paper::results_csv(&experiments));
    }
    let (plan, note) = plan(arguments.campaign.as_deref())?;
    let robots = arguments.count.clone().unwrap_or(0..plan.robots);
    let begin = Instant::now();
    let rows = with_bar(|progress| campaign::run(&plan, &robots, progress))?;
    let seconds = begin.elapsed().as_secs_f64();
    let summaries = summarize(&rows);
    let table = report::campaign::render(&summaries);
    let text = format!(
        "{note}{table}{} calibrations in {seconds:.1} s.\n",
        rows.len()
    );
    publish(arguments, &summaries, text, campaign::rows_csv(&rows))
}

fn of_files(paths: &[PathBuf]) -> Result<Vec<CaseSummary>, Failure> {
    let bar = Progress::bar("files");
    let mut files = Vec::with_capacity(paths.len());
    for path in paths {
        bar.show(files.len() as u64, paths.len() as u64);
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|error| InputError::new(&name, format!("cannot be read: {error}")))?;
        let rows = campaign::read_rows(&name, &text)?;
        files.push((name, rows));
    }
    drop(bar);
    Ok(summarize(&campaign::join(files)?))
}

fn with_bar<T>(work: impl FnOnce(&mut dyn FnMut(u64, u64)) -> T) -> T {
    let bar = Progress::bar("robots");
    work(&mut |finished, robots| bar.show(finished, robots))
}

fn plan(campaign: Option<&Path>) -> Result<(Plan, &'static str), Failure> {
    let folder = campaign.and_then(Path::parent).unwrap_or(Path::new("."));
    let robot_file = |name: &str| InputText::from_file(&folder.join(name));
    let (text, note) = match campaign {
        Some(path) => (InputText::from_file(path)?, ""),
        None => (
            InputText::new("built-in campaign.toml", EXAMPLE),
            "The built-in campaign. For your own: delta-cal simulate --example > campaign.toml, edit it,\n\
             and delta-cal simulate campaign.toml\n\n",
        ),
    };
    Ok((Plan::read(&text, &robot_file)?, note))
}

/// Writes all files or none, and prints the table or, in its place, the output meant for standard output.
fn publish<T: Serialize>(
    arguments: &SimulateArguments,
    summary: &T,
    text: String,
    csv: Result<String, csv::Error>,
) -> Result<(), Failure> {
    let csv = csv.map_err(|error| unwritten(&error))?;
    let json = report::json(summary);
    let (output, to) = (arguments.output.as_deref(), arguments.json.as_deref());
    deliver(&[(output, &csv), (to, &json)], text)
}

fn unwritten(error: &dyn std::error::Error) -> Failure {
    Failure::output(format!("the results: {error}"))
}
