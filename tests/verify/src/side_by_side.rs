//! Lists of stages side by side: a stage alone leaves a processor idle whenever one of its programs is being linked,
//! or one of its tests is the last.

use crate::check::{Check, at_root};
use crate::clock::Start;
use crate::stages::Stage;
use crate::summary::Finished;
use std::io::{Read, pipe};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Runs the stages of each list one after the other. Each is a process of its own, a run of this program, whose output
/// is shown as a whole once it has ended.
pub(crate) fn run(lists: [&'static [Stage]; 2]) -> std::io::Result<Vec<Finished>> {
    // Found before anything is built: what takes this program's place meanwhile has the same name.
    let program = std::env::current_exe()?;
    let all = Mutex::new(Vec::new());
    let (program, finished) = (&program, &all);
    thread::scope(|scope| {
        for list in lists {
            scope.spawn(move || {
                for stage in list {
                    println!("{} begins", stage.name);
                    let start = Start::now();
                    let (output, status) = match output(program, stage.name) {
                        Ok((output, status)) => (output, status.to_string()),
                        Err(error) => (String::new(), error.to_string()),
                    };
                    let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
                    println!("{output}");
                    finished.push(Finished::read(&output).unwrap_or_else(|| {
                        let mut check = Check::default();
                        check.fail(format!("its process ended before its summary: {status}"));
                        Finished::new(stage.name, check, start)
                    }));
                }
            });
        }
    });
    Ok(all.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// All that a process writes, in the order in which it is written.
fn output(program: &Path, stage: &str) -> std::io::Result<(String, std::process::ExitStatus)> {
    let (mut reader, writer) = pipe()?;
    let mut child = {
        let mut command = at_root(program);
        command
            .arg(stage)
            .stdout(writer.try_clone()?)
            .stderr(writer);
        command.spawn()?
    };
    let mut bytes = Vec::new();
    let read = reader.read_to_end(&mut bytes);
    let status = child.wait()?;
    read?;
    Ok((String::from_utf8_lossy(&bytes).into_owned(), status))
}
