//! What came of the stages, at the end of a run.

use crate::check::Check;
use crate::clock::Start;
use std::process::ExitCode;

/// The line above it.
const HEADING: &str = "=== summary";
const FAILED: &str = "failed";
const SKIPPED: &str = "skipped";

/// A stage that has ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Finished {
    verdict: String,
    /// Name, verdict and cost, and below them why.
    lines: Vec<String>,
}

impl Finished {
    pub(crate) fn new(name: &str, mut check: Check, start: Start) -> Self {
        let skipped = check.take_skipped();
        let failures = check.into_failures();
        let verdict = match &skipped {
            _ if !failures.is_empty() => FAILED,
            Some(_) => SKIPPED,
            None => "ok",
        };
        let mut lines = vec![format!("{name:<10}  {verdict:<7}  {}", start.cost())];
        for why in skipped.iter().chain(&failures) {
            lines.extend(why.lines().map(|line| format!("    {line}")));
        }
        Self {
            verdict: verdict.to_owned(),
            lines,
        }
    }

    /// The one stage of another process's run, from what [`print`](fn@print) showed.
    pub(crate) fn read(output: &str) -> Option<Self> {
        let (_, summary) = output.rsplit_once(&format!("\n{HEADING}\n"))?;
        let mut lines: Vec<String> = summary.lines().map(str::to_owned).collect();
        lines.pop()?;
        let verdict = lines.first()?.split_whitespace().nth(1)?.to_owned();
        Some(Self { verdict, lines })
    }
}

/// Shows all of them; what a run since then ends with.
pub(crate) fn print(finished: &[Finished], begin: Start) -> ExitCode {
    println!("\n{HEADING}");
    for line in finished.iter().flat_map(|stage| &stage.lines) {
        println!("{line}");
    }
    let count = |verdict: &str| finished.iter().filter(|it| it.verdict == verdict).count();
    let (failed, skipped) = (count(FAILED), count(SKIPPED));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_processs_summary_is_read() {
        let finished = Finished::read(
            "=== c: …\n=== summary\n\n=== summary\nc           failed     1.0 s\n    a\n    b\n0 passed, 1 failed, 0 skipped, 1.0 s\n",
        );
        assert_eq!(
            finished,
            Some(Finished {
                verdict: FAILED.to_owned(),
                lines: vec![
                    "c           failed     1.0 s".to_owned(),
                    "    a".to_owned(),
                    "    b".to_owned()
                ],
            })
        );
        assert_eq!(Finished::read("=== c: …\nkilled"), None);
    }

    #[test]
    fn a_failure_outweighs_that_a_stage_was_skipped() {
        let mut check = Check::default();
        check.skip("nothing is here");
        check.fail("first\nsecond".to_owned());
        let finished = Finished::new("c", check, Start::now());
        assert_eq!(finished.verdict, FAILED);
        assert_eq!(
            finished.lines[1..],
            ["    nothing is here", "    first", "    second"]
        );
    }
}
