//! The modules of a crate, and which file names what of which other.

use super::source::{Named, Scope, Use, scopes};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Re-exports that are followed before a name counts as not found.
const LONGEST_CHAIN: usize = 16;

/// A crate: its root first, each module after its parent.
#[derive(Debug, Default)]
pub(super) struct Crate {
    modules: Vec<Module>,
    edges: Vec<Edge>,
    /// Whether it is part of a crate, whose paths lead out of it.
    is_part: bool,
}

#[derive(Debug)]
struct Module {
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    file: PathBuf,
    scope: Scope,
}

/// One file names an item of another, first in this line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: PathBuf,
    pub(super) line: usize,
    pub(super) name: String,
    pub(super) to: PathBuf,
}

/// What a path leads to in this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    Module(usize),
    /// An item that this module defines.
    Item(usize),
}

impl Crate {
    /// Reads a crate from its root file on.
    pub(super) fn read(
        root: &Path,
        text_of: &dyn Fn(&Path) -> Option<String>,
    ) -> Result<Self, String> {
        let mut found = Self::default();
        let folder = root.parent().unwrap_or(Path::new("")).to_owned();
        found.read_file(root, &folder, None, text_of)?;
        found.edges = found.find_edges();
        Ok(found)
    }

    /// Reads modules for tests alone: each by itself, for nothing else depends on them.
    pub(super) fn read_tests(
        &self,
        text_of: &dyn Fn(&Path) -> Option<String>,
    ) -> Result<Vec<Self>, String> {
        let mut parts = Vec::new();
        for module in &self.modules {
            let file = module.file.as_path();
            let around = file.parent().unwrap_or(Path::new(""));
            let below = if module.parent.is_none() || file.ends_with("mod.rs") {
                around.to_owned()
            } else {
                file.with_extension("")
            };
            for name in &module.scope.test_files {
                let root = below.join(format!("{name}.rs"));
                let mut part = Self {
                    is_part: true,
                    ..Self::default()
                };
                if text_of(&root).is_some() {
                    part.read_file(&root, &below.join(name), None, text_of)?;
                    part.edges = part.find_edges();
                    parts.push(part);
                }
            }
        }
        Ok(parts)
    }

    /// Reads a module's file; its children's files are in `folder`. Returns the module.
    fn read_file(
        &mut self,
        file: &Path,
        folder: &Path,
        parent: Option<usize>,
        text_of: &dyn Fn(&Path) -> Option<String>,
    ) -> Result<usize, String> {
        let fault = |what: &str| format!("{}: {what}", file.display());
        let text = text_of(file).ok_or_else(|| fault("cannot be read"))?;
        let first = self.modules.len();
        let mut of_path: BTreeMap<Vec<String>, usize> = BTreeMap::new();
        let scopes = scopes(&text).map_err(|error| fault(&error))?;
        for scope in &scopes {
            let index = self.modules.len();
            let parent = match scope.path.split_last() {
                None => parent,
                Some((name, around)) => {
                    let parent = of_path[around];
                    self.modules[parent].children.insert(name.clone(), index);
                    Some(parent)
                }
            };
            of_path.insert(scope.path.clone(), index);
            self.modules.push(Module {
                parent,
                children: BTreeMap::new(),
                file: file.to_owned(),
                scope: scope.clone(),
            });
        }
        for (offset, scope) in scopes.iter().enumerate() {
            let inner = scope.path.iter().fold(folder.to_owned(), |f, n| f.join(n));
            for (name, place) in &scope.files {
                let below = inner.join(name);
                let [flat, nested] = [inner.join(format!("{name}.rs")), below.join("mod.rs")];
                let child = match place {
                    Some(place) => file.parent().unwrap_or(Path::new("")).join(place),
                    None if text_of(&flat).is_some() => flat,
                    None => nested,
                };
                let module = self.read_file(&child, &below, Some(first + offset), text_of)?;
                self.modules[first + offset]
                    .children
                    .insert(name.clone(), module);
            }
        }
        Ok(first)
    }

    /// The file of each module, in the order of their numbers.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        self.modules.iter().map(|module| module.file.as_path())
    }

    pub(super) fn file(&self, module: usize) -> &Path {
        &self.modules[module].file
    }

    pub(super) fn children(&self, module: usize) -> impl Iterator<Item = usize> {
        self.modules[module].children.values().copied()
    }

    /// The files of a module and of all below it.
    pub(super) fn files_within(&self, above: usize) -> BTreeSet<&Path> {
        let within = |module: &usize| self.is_within(*module, above);
        let modules = (0..self.modules.len()).filter(within);
        modules.map(|module| self.file(module)).collect()
    }

    pub(super) fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Whether a module is another's, or below it.
    fn is_within(&self, module: usize, above: usize) -> bool {
        std::iter::successors(Some(module), |module| self.modules[*module].parent)
            .any(|module| module == above)
    }

    fn find_edges(&self) -> Vec<Edge> {
        let mut edges: BTreeMap<(&Path, &Path), Edge> = BTreeMap::new();
        for (index, module) in self.modules.iter().enumerate() {
            let paths = module.scope.paths.iter();
            let mut named: Vec<(&Named, usize)> = paths
                .filter_map(|path| match self.resolve(index, &path.segments, 0)? {
                    Found::Item(item) => Some((path, item)),
                    Found::Module(_) => None,
                })
                .collect();
            for used in &module.scope.uses {
                let items = self.brought_in(index, used).into_iter();
                named.extend(
                    items
                        .filter(|item| !(used.public && self.is_within(*item, index)))
                        .map(|item| (&used.path, item)),
                );
            }
            for (path, item) in named {
                let [from, to] = [index, item].map(|module| self.modules[module].file.as_path());
                let edge = Edge {
                    from: from.to_owned(),
                    line: path.line,
                    name: path.segments.join("::"),
                    to: to.to_owned(),
                };
                if from != to {
                    let first = edges.entry((from, to)).or_insert_with(|| edge.clone());
                    if edge.line < first.line {
                        *first = edge;
                    }
                }
            }
        }
        edges.into_values().collect()
    }

    /// The modules whose items a `use` brings in. A module itself is none: what counts is what is then
    /// named in it.
    fn brought_in(&self, module: usize, used: &Use) -> Vec<usize> {
        match self.resolve(module, &used.path.segments, 0) {
            None => Vec::new(),
            Some(Found::Item(item)) => vec![item],
            Some(Found::Module(_)) if used.name.is_some() => Vec::new(),
            Some(Found::Module(all_of)) => {
                let Module { scope, .. } = &self.modules[all_of];
                let own = (!scope.items.is_empty()).then_some(all_of);
                let others = scope.uses.iter().filter(|other| other.public);
                let others = others.filter_map(|other| {
                    match self.resolve(all_of, &other.path.segments, 0)? {
                        Found::Item(item) => Some(item),
                        Found::Module(_) => None,
                    }
                });
                own.into_iter().chain(others).collect()
            }
        }
    }

    /// A path as written in a module; `None` if it leads out of the crate.
    fn resolve(&self, module: usize, path: &[String], chain: usize) -> Option<Found> {
        let (first, rest) = path.split_first()?;
        let here = &self.modules[module];
        match first.as_str() {
            "crate" if self.is_part => None,
            "crate" => self.below(0, rest, chain),
            "self" => self.below(module, rest, chain),
            "super" => {
                let parent = here.parent?;
                match rest.first() {
                    Some(next) if next == "super" => self.resolve(parent, rest, chain),
                    _ => self.below(parent, rest, chain),
                }
            }
            name if here.children.contains_key(name) => self.below(module, path, chain),
            name => {
                let named = |used: &&Use| used.name.as_deref() == Some(name);
                let used = here.scope.uses.iter().find(named)?;
                self.through(module, used, rest, chain)
            }
        }
    }

    /// What a path leads to that begins in a module.
    fn below(&self, module: usize, path: &[String], chain: usize) -> Option<Found> {
        let Some((first, rest)) = path.split_first() else {
            return Some(Found::Module(module));
        };
        let here = &self.modules[module];
        let is_item = here.scope.items.contains(first);
        if let Some(child) = here.children.get(first)
            && !(is_item && rest.is_empty())
        {
            return self.below(*child, rest, chain);
        }
        if is_item {
            return Some(Found::Item(module));
        }
        let mut uses = here.scope.uses.iter();
        let through = uses
            .clone()
            .find(|used| used.name.as_ref() == Some(first))
            .and_then(|used| self.through(module, used, rest, chain));
        let from_all = || {
            uses.find_map(|used| {
                let all = used.name.is_none() && chain < LONGEST_CHAIN;
                let path = all.then_some(&used.path.segments)?;
                match self.resolve(module, path, chain + 1)? {
                    Found::Module(other) if self.has(other, first) => {
                        self.below(other, std::slice::from_ref(first), chain + 1)
                    }
                    _ => None,
                }
            })
        };
        // A macro, or what comes from another crate: this module is where it is found.
        through.or_else(from_all).or(Some(Found::Item(module)))
    }

    /// What a path leads to whose first segment a `use` has brought in.
    fn through(&self, module: usize, used: &Use, rest: &[String], chain: usize) -> Option<Found> {
        // `use x::x` of another crate names itself.
        if chain == LONGEST_CHAIN || used.path.segments.first() == used.name.as_ref() {
            return None;
        }
        match self.resolve(module, &used.path.segments, chain + 1)? {
            Found::Module(other) => self.below(other, rest, chain),
            item @ Found::Item(_) => Some(item),
        }
    }

    fn has(&self, module: usize, name: &String) -> bool {
        let Module {
            scope, children, ..
        } = &self.modules[module];
        scope.items.contains(name)
            || children.contains_key(name)
            || scope
                .uses
                .iter()
                .any(|used| used.name.as_ref() == Some(name))
    }
}

#[cfg(test)]
mod tests;
