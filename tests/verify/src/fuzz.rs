//! The fuzz targets of `tests/fuzz/programs`: built as `cargo fuzz` builds them, each run for a minute.

use crate::check::{Check, at_root, command, directory, output};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Instant;

const MANIFEST: &str = include_str!("../../fuzz/programs/Cargo.toml");

/// What `cargo fuzz build -s none` passes to the compiler, of which the stable one takes everything:
/// coverage for libFuzzer, and the checks of a debug build. The core and everything around it have no
/// `unsafe` code, so that a sanitizer, which needs the nightly compiler, would find nothing. The single
/// codegen unit is left out: it keeps all cores but one waiting.
const FLAGS: &[&str] = &[
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "--cfg",
    "fuzzing",
    "-Cllvm-args=-simplifycfg-branch-fold-threshold=0",
    "-Cllvm-args=-sanitizer-coverage-stack-depth",
    "-Cdebug-assertions",
];

/// Seconds for each target.
const SECONDS: u32 = 60;
/// Targets that run at the same time.
const AT_ONCE: usize = 2;
/// An input that takes longer than this many seconds counts as an endless loop. The longest takes one
/// second; the machine may be busy.
const TIMEOUT: u32 = 60;
/// Lines of a finding that are shown.
const SHOWN: usize = 40;

pub(crate) fn check(check: &mut Check) {
    let targets = targets(MANIFEST);
    if targets.is_empty() {
        return check.fail("tests/fuzz/programs/Cargo.toml names no target".to_owned());
    }
    let directory = directory("fuzz");
    let programs = match build(&directory) {
        Ok(programs) => programs,
        Err(error) => return check.fail(error),
    };
    println!("{:<15}  {:>9}  {:>7}", "target", "inputs", "seconds");
    let mut inputs = 0;
    for some in targets.chunks(AT_ONCE) {
        let (programs, directory) = (&programs, &directory);
        let runs = std::thread::scope(|scope| {
            let running: Vec<_> = some
                .iter()
                .map(|target| scope.spawn(move || run(target, programs, directory)))
                .collect();
            let runs = running.into_iter().map(std::thread::ScopedJoinHandle::join);
            runs.collect::<Vec<_>>()
        });
        for run in runs {
            match run.unwrap_or_else(|_| Err("a fuzz target could not be watched".to_owned())) {
                Ok(count) => inputs += count,
                Err(error) => check.fail(error),
            }
        }
    }
    println!("{:<15}  {inputs:>9}", "together");
}

/// The names of the programs.
fn targets(manifest: &str) -> Vec<String> {
    let table: toml::Table = manifest.parse().unwrap_or_default();
    let programs = table.get("bin").and_then(toml::Value::as_array);
    let names = programs.into_iter().flatten();
    let names = names.filter_map(|program| program.get("name")?.as_str());
    names.map(str::to_owned).collect()
}

/// Builds all targets; where their programs are.
fn build(directory: &Path) -> Result<PathBuf, String> {
    let version = output("rustc -vV").ok_or("rustc does not run")?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.ok_or("rustc does not name the host")?;
    // For a named target the flags are those of the programs alone, not of the build's own.
    let line = format!(
        "cargo build --quiet --release --bins --locked --manifest-path tests/fuzz/programs/Cargo.toml --target {host}"
    );
    println!("$ {line}");
    let status = command(&line)
        .arg("--target-dir")
        .arg(directory)
        .env("RUSTFLAGS", FLAGS.join(" "))
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .status();
    match status {
        Ok(status) if status.success() => Ok(directory.join(host).join("release")),
        Ok(status) => Err(format!("{line}: {status}")),
        Err(error) => Err(format!("{line}: {error}")),
    }
}

/// Runs a target from its seeds; how many inputs it tried.
fn run(target: &str, programs: &Path, directory: &Path) -> Result<u64, String> {
    let corpus = directory.join("corpus").join(target);
    let artifacts = directory.join("artifacts").join(target);
    // From the same seeds every time.
    let _ = std::fs::remove_dir_all(&corpus);
    for folder in [&corpus, &artifacts] {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let start = Instant::now();
    let finished = at_root(programs.join(target))
        .arg("-seed=1")
        .arg(format!("-max_total_time={SECONDS}"))
        .arg(format!("-timeout={TIMEOUT}"))
        .arg("-print_final_stats=1")
        .arg(format!("-artifact_prefix={}/", artifacts.display()))
        .arg(&corpus)
        .arg(format!("tests/fuzz/seeds/{target}"))
        .stdout(Stdio::null())
        .output()
        .map_err(|error| format!("{target}: {error}"))?;
    let text = String::from_utf8_lossy(&finished.stderr);
    if !finished.status.success() {
        let lines: Vec<&str> = text.lines().collect();
        for line in &lines[lines.len().saturating_sub(SHOWN)..] {
            println!("{line}");
        }
        return Err(format!(
            "fuzz target {target}: {}; the input is in {}, and \
             `cargo fuzz run --fuzz-dir tests/fuzz/programs -s none {target} FILE` runs it again",
            finished.status,
            artifacts.display()
        ));
    }
    let count = text.lines().find_map(executed).unwrap_or(0);
    println!(
        "{target:<15}  {count:>9}  {:>7.1}",
        start.elapsed().as_secs_f64()
    );
    if count == 0 {
        return Err(format!("fuzz target {target} tried no input"));
    }
    Ok(count)
}

/// `stat::number_of_executed_units: 12345`
fn executed(line: &str) -> Option<u64> {
    let count = line.strip_prefix("stat::number_of_executed_units:")?;
    count.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_read_from_the_statistics() {
        let line = "stat::number_of_executed_units: 217348";
        assert_eq!(executed(line), Some(217_348));
        assert_eq!(executed("stat::peak_rss_mb: 48"), None);
    }

    #[test]
    fn every_target_has_seeds() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds");
        for target in targets(MANIFEST) {
            let mut seeds = std::fs::read_dir(root.join(&target));
            let any = seeds.as_mut().is_ok_and(|seeds| seeds.next().is_some());
            assert!(any, "{target:?} has no seeds");
        }
    }
}
