//! `delta-cal simulate`.

use super::failure::Failure;
use super::paths::{is_stream, refuse_same};
use super::print::print;
use super::progress::{Bar, interruption};
use crate::InputText;
use crate::campaign;
use crate::campaign::{CampaignError, CaseSummary, EXAMPLE, PLAN, Plan, RunOptions, Shard};
use crate::files::output;
use crate::report;
use clap::{Args, Subcommand};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

const HELP: &str = "\
The program writes to DIR:
  robots.csv    one row for each robot and each way of calibrating it
  summary.csv   one row for each case, with quantiles
  timing.csv    wall-clock times, which differ from run to run
  plan.toml     what was computed, as a campaign file, with plan-robot.toml
  run.json      how far the campaign has come

After Ctrl-C the finished part is kept, and the same command continues the campaign. The rows are the \
same to the bit for any number of threads, in one run or several, on one machine or cut into shards.

Examples:
  delta-cal simulate
      the built-in campaign
  delta-cal simulate --example > campaign.toml
  delta-cal simulate campaign.toml --output results
  delta-cal simulate campaign.toml --output part2 --shard 2/8
  delta-cal simulate merge part1 part2 ... part8 --output results

Exit codes:
  0  done
  2  the command line is wrong, or a folder holds something else
  3  the campaign file is wrong
  4  a file could not be written
  130  interrupted; what is finished is kept in DIR";

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct SimulateArguments {
    #[command(subcommand)]
    command: Option<SimulateCommand>,
    #[command(flatten)]
    run: RunArguments,
}

#[derive(Debug, Subcommand)]
enum SimulateCommand {
    /// Join the folders of all shards of a campaign
    Merge(MergeArguments),
}

#[derive(Debug, Args)]
struct RunArguments {
    /// The campaign; without it the program runs a small built-in one
    #[arg(value_name = "CAMPAIGN.toml")]
    campaign: Option<PathBuf>,
    /// Write robots.csv (one row for each robot) and summary.csv (one row for each case) to this
    /// folder, and continue a campaign that was interrupted there
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Compute only the K-th of N equal parts, counted from 1
    #[arg(long, value_name = "K/N", requires = "output")]
    shard: Option<Shard>,
    /// The number of threads [default: one for each processor]. The results are the same to the bit
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    threads: Option<u16>,
    /// Write the summary as JSON to this file, or with - to standard output in place of the table
    #[arg(long, value_name = "SUMMARY.json")]
    json: Option<PathBuf>,
    /// Delete another campaign in DIR and start from the beginning
    #[arg(long, requires = "output")]
    force: bool,
    /// Print the built-in campaign file, which shows every key
    #[arg(long, exclusive = true)]
    example: bool,
}

#[derive(Debug, Args)]
struct MergeArguments {
    /// The folders of all shards, in any order
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// The folder to which the whole campaign is written
    #[arg(long, value_name = "DIR")]
    output: PathBuf,
    /// Write the summary as JSON to this file, or with - to standard output in place of the table
    #[arg(long, value_name = "SUMMARY.json")]
    json: Option<PathBuf>,
    /// Delete another campaign in the output folder
    #[arg(long)]
    force: bool,
}

/// The example campaign, and how the command is used.
pub(crate) fn help() -> String {
    let campaign: Vec<_> = EXAMPLE.lines().collect();
    let campaign = campaign.join(
        "
  ",
    );
    format!("CAMPAIGN.toml (--example prints it):\n  {campaign}\n\n{HELP}")
}

pub(crate) fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    match &arguments.command {
        Some(SimulateCommand::Merge(arguments)) => merge(arguments),
        None if arguments.run.example => print(EXAMPLE),
        None => simulate(&arguments.run),
    }
}

fn simulate(arguments: &RunArguments) -> Result<(), Failure> {
    let json = arguments.json.as_deref();
    refuse_same(
        "--json",
        json,
        ("the campaign file", arguments.campaign.as_deref()),
        "give the output another name",
    )?;
    let (plan, note) = plan(arguments.campaign.as_deref())?;
    if let (Some(folder), true) = (&arguments.output, arguments.force) {
        refuse_same(
            "--output",
            Some(&folder.join(PLAN)),
            ("the campaign file", arguments.campaign.as_deref()),
            "--force would delete it: give another folder",
        )?;
    }
    check_json(json)?;
    // Deleted at the end.
    let temporary = tempfile::tempdir()
        .map_err(|error| Failure::Output(format!("a temporary folder: {error}")))?;
    let folder = arguments.output.as_deref().unwrap_or(temporary.path());

    let interrupted = interruption();
    let options = RunOptions {
        threads: arguments.threads.map_or(0, usize::from),
        force: arguments.force,
        interrupted: &interrupted,
    };
    let bar = Bar::new("robots");
    let begin = Instant::now();
    let mut computed = Computed::default();
    let result = campaign::run(
        &plan,
        arguments.shard.unwrap_or(Shard::WHOLE),
        folder,
        &options,
        &mut |finished, robots| {
            bar.show(finished, robots);
            computed.show(finished);
        },
    );
    bar.finish();
    let summaries = result.map_err(|error| failure(error, arguments.output.as_deref()))?;
    let rate = computed.sentence(begin);
    let text = format!("{note}{}{rate}", report::campaign::render(&summaries));
    publish(&summaries, json, arguments.output.as_deref(), &text)
}

fn merge(arguments: &MergeArguments) -> Result<(), Failure> {
    let json = arguments.json.as_deref();
    check_json(json)?;
    let (_, summaries) = campaign::merge(&arguments.folders, &arguments.output, arguments.force)
        .map_err(|error| failure(error, None))?;
    let text = report::campaign::render(&summaries);
    publish(&summaries, json, Some(&arguments.output), &text)
}

fn plan(campaign: Option<&Path>) -> Result<(Plan, &'static str), Failure> {
    let Some(path) = campaign else {
        let text = InputText::new("built-in campaign.toml", EXAMPLE);
        let note = "The built-in campaign. For your own: delta-cal simulate --example > \
                    campaign.toml, edit it,\nand delta-cal simulate campaign.toml --output DIR\n\n";
        return Ok((Plan::read(&text, Path::new("."))?, note));
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    Ok((Plan::read(&InputText::from_file(path)?, folder)?, ""))
}

/// A campaign can take long: it is not begun if its JSON could not be written.
fn check_json(json: Option<&Path>) -> Result<(), Failure> {
    match json.filter(|path| !is_stream(path)) {
        Some(path) => Ok(output::check(path)?),
        None => Ok(()),
    }
}

fn publish(
    summaries: &[CaseSummary],
    json: Option<&Path>,
    folder: Option<&Path>,
    text: &str,
) -> Result<(), Failure> {
    let mut text = text.to_owned();
    if let Some(folder) = folder {
        let _ = writeln!(text, "Written: {}", folder.display());
    }
    if let Some(path) = json {
        let json = serde_json::to_string_pretty(summaries)
            .map_err(|error| Failure::Output(format!("the JSON summary: {error}")))?
            + "\n";
        if is_stream(path) {
            return print(&json);
        }
        output::write_all(&[(path, &json)])?;
        let _ = writeln!(text, "Written: {}", path.display());
    }
    print(&text)
}

pub(super) fn failure(error: CampaignError, output: Option<&Path>) -> Failure {
    match error {
        CampaignError::Input(error) => error.into(),
        CampaignError::Folder { .. } => Failure::Usage {
            cause: error.to_string(),
            remedy: match error {
                CampaignError::Folder { remedy, .. } => remedy,
                _ => String::new(),
            },
        },
        CampaignError::Interrupted { finished, robots } => {
            let kept = match output {
                Some(folder) => format!(
                    "{finished} of {robots} robots are kept in {}; the same command continues",
                    folder.display()
                ),
                None => "nothing is kept without --output".to_owned(),
            };
            let _ = writeln!(anstream::stderr(), "{kept}");
            Failure::Interrupted {
                remedy: String::new(),
            }
        }
        error => Failure::Output(error.to_string()),
    }
}

/// How many robots this run computed; others may have been there before.
#[derive(Default)]
struct Computed {
    first: Option<u64>,
    last: u64,
}

impl Computed {
    fn show(&mut self, finished: u64) {
        self.first.get_or_insert(finished);
        self.last = finished;
    }

    fn sentence(&self, begin: Instant) -> String {
        let Some(first) = self.first.filter(|first| *first < self.last) else {
            return "Nothing was left to compute.\n".to_owned();
        };
        let seconds = begin.elapsed().as_secs_f64();
        let robots = self.last - first;
        #[allow(clippy::cast_precision_loss)] // for people
        let rate = robots as f64 / seconds;
        format!("{robots} robots in {seconds:.1} s, {rate:.0} robots/s.\n")
    }
}
