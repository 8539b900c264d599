//! No panic path survives in any public function of the core: `tests/link` links.

use crate::check::{Check, root};
use delta_cal_verify::firmware::{PROFILE, TARGET, cargo, require_target, run};
use object::read::archive::ArchiveFile;
use object::{Object, ObjectSymbol};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const PACKAGE: &str = "delta-cal-link-tests";
const ARCHIVE: &str = "libdelta_cal_link_tests.a";
/// Must not link.
const PANICS: &str = "panics_on_purpose";
/// What each function's symbol begins with.
const PREFIX: &str = "core_";

pub(super) fn check(check: &mut Check, directory: &Path) {
    for function in unnamed_functions() {
        check.fail(format!(
            "tests/link/src/functions does not call the core's {function}"
        ));
    }
    match prove(directory, &[]) {
        Err(error) => check.fail(error),
        Ok((functions, culprits)) => {
            println!(
                "panic-free: {} of {functions} functions",
                functions - culprits.len()
            );
            for culprit in culprits {
                check.fail(format!("a panic path survives in {culprit}"));
            }
        }
    }
}

/// How many functions there are, and which of them do not link, of a build with these further arguments of cargo.
pub(super) fn prove(directory: &Path, arguments: &[&str]) -> Result<(usize, Vec<String>), String> {
    require_target()?;
    let build = ["build", "--profile", PROFILE, "--package", PACKAGE];
    let build = [&build[..], &["--target", TARGET]].concat();
    cargo(directory, &[&build[..], arguments].concat())?;
    let archive = directory.join(TARGET).join(PROFILE).join(ARCHIVE);
    let linker = linker()?;
    // What does not link is named below; the linker's own words would only alarm.
    let links = |symbols: &[String]| {
        Command::new(&linker)
            .args(["-flavor", "gnu", "--gc-sections", "--entry=0", "--output"])
            .arg(directory.join("panic-free.elf"))
            .args(symbols.iter().map(|symbol| format!("--undefined={symbol}")))
            .arg(&archive)
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success())
    };

    let functions = functions(&archive)?;
    if functions.is_empty() {
        return Err(format!("{ARCHIVE} defines no function"));
    }
    if links(&[PANICS.to_owned()]) {
        return Err(format!("{PANICS} links: the proof proves nothing"));
    }
    if links(&functions) {
        return Ok((functions.len(), Vec::new()));
    }
    let culprits: Vec<String> = functions
        .iter()
        .filter(|function| !links(std::slice::from_ref(function)))
        .cloned()
        .collect();
    if culprits.is_empty() {
        return Err("each function links alone, and all together do not".to_owned());
    }
    Ok((functions.len(), culprits))
}

/// rustc's own linker, there wherever the bare target can be built.
fn linker() -> Result<PathBuf, String> {
    let mut rustc = Command::new("rustc");
    rustc
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["--print", "target-libdir"]);
    let libraries = PathBuf::from(run(rustc)?.trim());
    let linker = libraries.with_file_name("bin").join("rust-lld");
    if linker
        .with_extension(std::env::consts::EXE_EXTENSION)
        .is_file()
    {
        Ok(linker)
    } else {
        Err(format!("{} is missing", linker.display()))
    }
}

/// The symbols that the archive defines.
fn functions(archive: &Path) -> Result<Vec<String>, String> {
    let fault = |error: &dyn std::fmt::Display| format!("{}: {error}", archive.display());
    let bytes = std::fs::read(archive).map_err(|error| fault(&error))?;
    let members = ArchiveFile::parse(&*bytes).map_err(|error| fault(&error))?;
    let mut functions = Vec::new();
    for member in members.members() {
        let data = member
            .and_then(|member| member.data(&*bytes))
            .map_err(|error| fault(&error))?;
        // An archive may hold other things than objects.
        let Ok(file) = object::File::parse(data) else {
            continue;
        };
        functions.extend(
            file.symbols()
                .filter(ObjectSymbol::is_definition)
                .filter_map(|symbol| symbol.name().ok())
                .filter(|name| name.starts_with(PREFIX))
                .map(str::to_owned),
        );
    }
    functions.sort_unstable();
    functions.dedup();
    Ok(functions)
}

/// Public functions of the core that `tests/link` does not call.
fn unnamed_functions() -> Vec<String> {
    let root = root();
    let read = |path: PathBuf| std::fs::read_to_string(path).unwrap_or_default();
    let mut callers = Vec::new();
    collect_sources(&root.join("tests/link/src"), &mut callers);
    let calls: String = callers.into_iter().map(read).collect();
    let mut sources = Vec::new();
    collect_sources(&root.join("core/src"), &mut sources);
    let functions = sources
        .into_iter()
        .flat_map(|path| public_functions(&read(path)));
    let with_types = |call: &str| call.replace('(', "::<");
    let mut unnamed: Vec<String> = functions
        .filter(|call| !calls.contains(call.as_str()) && !calls.contains(&with_types(call)))
        .collect();
    unnamed.sort_unstable();
    unnamed
}

fn collect_sources(directory: &Path, sources: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect_sources(&path, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.push(path);
        }
    }
}

/// How the public functions of a source file are called: `.method(`, `Type::function(` or
/// `function(`.
fn public_functions(source: &str) -> Vec<String> {
    let mut of_type = None;
    let mut functions = Vec::new();
    let mut lines = source.lines().peekable();
    while let Some(line) = lines.next() {
        if let Some(header) = line.strip_prefix("impl") {
            // An empty body ends on its own line.
            of_type = (!header.ends_with("{}")).then(|| type_of(header));
        } else if line == "}" {
            of_type = None;
        }
        let declaration = line.trim_start();
        let Some(rest) = declaration
            .strip_prefix("pub fn ")
            .or_else(|| declaration.strip_prefix("pub const fn "))
        else {
            continue;
        };
        let name: String = rest
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect();
        // A long declaration has its first argument on the next line.
        let next = lines.peek().filter(|_| rest.ends_with('('));
        let arguments = format!("{rest}{}", next.map_or("", |next| next.trim()));
        let takes_self = ["(&self", "(&mut self", "(self", "(mut self"]
            .iter()
            .any(|first| arguments.contains(first));
        functions.push(match &of_type {
            Some(_) if takes_self => format!(".{name}("),
            Some(of_type) => format!("{of_type}::{name}("),
            None => format!("{name}("),
        });
    }
    functions
}

/// The type's name in what follows `impl`.
fn type_of(header: &str) -> String {
    let mut depth = 0;
    let after_generics = header
        .char_indices()
        .find(|(_, c)| {
            match c {
                '<' => depth += 1,
                '>' => depth -= 1,
                _ => {}
            }
            depth == 0 && *c == ' '
        })
        .map_or(0, |(index, _)| index);
    header
        .split_at(after_generics)
        .1
        .trim_start()
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_are_derived_from_declarations() {
        let source = "
impl<T: Real, const N: usize> Store<T, N> {
    pub const fn new(x: T) -> Self {}
    pub(crate) fn hidden(&self) {}
    pub fn add<I>(
        &mut self,
        items: I,
    ) {
    }
}
impl Plain {
    pub fn get(&self) {}
}
impl Error for Plain {}
pub fn free() {}
";
        assert_eq!(
            public_functions(source),
            ["Store::new(", ".add(", ".get(", "free("]
        );
    }

    #[test]
    fn the_core_is_found() {
        let mut sources = Vec::new();
        collect_sources(&root().join("core/src"), &mut sources);
        assert!(sources.len() > 20);
    }
}
