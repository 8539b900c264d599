//! What one source file declares and names.

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::iter::Peekable;
use std::vec::IntoIter;

/// A module, as far as one file holds it: the file's own, or one written inside it.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct Scope {
    /// Names of the modules around it in the same file and its own; empty for the file's own.
    pub(super) path: Vec<String>,
    /// Its children in files of their own, and where those are if that is stated (`#[path]`).
    pub(super) files: Vec<(String, Option<String>)>,
    /// The same of children for tests alone.
    pub(super) test_files: Vec<String>,
    /// The items that it defines.
    pub(super) items: BTreeSet<String>,
    pub(super) uses: Vec<Use>,
    /// Paths other than those of `use`.
    pub(super) paths: Vec<Named>,
}

/// One name that a `use` brings in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Use {
    pub(super) path: Named,
    /// Under which name; `None` of `*`.
    pub(super) name: Option<String>,
    /// `pub`, also within limits.
    pub(super) public: bool,
}

/// A path as it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Named {
    pub(super) segments: Vec<String>,
    pub(super) line: usize,
}

/// The scopes of a source text, the file's own first.
pub(super) fn scopes(text: &str) -> Result<Vec<Scope>, String> {
    let tokens: TokenStream = text.parse().map_err(|error| format!("{error}"))?;
    let mut scopes = vec![Scope::default()];
    read(tokens, 0, true, &mut scopes);
    Ok(scopes)
}

type Tokens = Peekable<IntoIter<TokenTree>>;

/// Reads tokens of a scope; `outside` of any item, where items are the module's.
fn read(tokens: TokenStream, scope: usize, outside: bool, scopes: &mut Vec<Scope>) {
    let mut tokens = tokens
        .into_iter()
        .collect::<Vec<_>>()
        .into_iter()
        .peekable();
    let mut public = false;
    let mut after_colons = false;
    let mut place = None;
    while let Some(token) = tokens.next() {
        let continues = std::mem::take(&mut after_colons);
        match token {
            TokenTree::Punct(punct) if punct.as_char() == '#' => match tokens.next() {
                Some(TokenTree::Group(group)) if for_tests_alone(&group) => {
                    scopes[scope].test_files.extend(skip_item(&mut tokens));
                }
                Some(TokenTree::Group(group)) => {
                    place = path_of(&group).or(place);
                    read(group.stream(), scope, false, scopes);
                }
                _ => {}
            },
            TokenTree::Punct(punct) => {
                after_colons = punct.as_char() == ':' && next_is(&mut tokens, ':');
                if after_colons {
                    tokens.next();
                }
                if punct.as_char() == ';' {
                    public = false;
                }
            }
            TokenTree::Group(group) => {
                // Not that of `pub(crate)`.
                if group.delimiter() == Delimiter::Brace {
                    public = false;
                }
                read(group.stream(), scope, false, scopes);
            }
            TokenTree::Literal(_) => {}
            TokenTree::Ident(ident) => {
                let line = ident.span().start().line;
                match ident.to_string().as_str() {
                    "pub" => public = true,
                    // Not the `use<…>` of a bound.
                    "use" if !next_is(&mut tokens, '<') => {
                        let public = std::mem::take(&mut public);
                        let uses = use_tree(&mut tokens, &[], line, public);
                        scopes[scope].uses.extend(uses);
                    }
                    "mod" => module(&mut tokens, place.take(), scope, scopes),
                    keyword @ ("struct" | "enum" | "union" | "trait" | "type" | "fn" | "const"
                    | "static" | "macro_rules")
                        if outside =>
                    {
                        while matches!(tokens.peek(), Some(TokenTree::Ident(word)) if word == "mut")
                            || keyword == "macro_rules" && next_is(&mut tokens, '!')
                        {
                            tokens.next();
                        }
                        if let Some(TokenTree::Ident(name)) = tokens.peek()
                            && name != "fn"
                            && name != "unsafe"
                            && name != "extern"
                        {
                            scopes[scope].items.insert(name.to_string());
                            tokens.next();
                        }
                    }
                    first => {
                        let mut segments = vec![first.to_owned()];
                        while let Some(segment) = continued(&mut tokens) {
                            segments.push(segment);
                        }
                        if segments.len() > 1 && !continues {
                            scopes[scope].paths.push(Named { segments, line });
                        }
                    }
                }
            }
        }
    }
}

/// `mod name;` or `mod name { … }`
fn module(tokens: &mut Tokens, place: Option<String>, scope: usize, scopes: &mut Vec<Scope>) {
    let Some(TokenTree::Ident(name)) = tokens.next() else {
        return;
    };
    if let Some(TokenTree::Group(group)) = tokens.peek() {
        let stream = group.stream();
        tokens.next();
        let path = [&scopes[scope].path[..], &[name.to_string()]].concat();
        scopes.push(Scope {
            path,
            ..Scope::default()
        });
        read(stream, scopes.len() - 1, true, scopes);
    } else {
        scopes[scope].files.push((name.to_string(), place));
    }
}

/// What stands after `use` or in its braces, up to a semicolon, a comma or the end.
fn use_tree(tokens: &mut Tokens, before: &[String], line: usize, public: bool) -> Vec<Use> {
    let mut segments = before.to_vec();
    let mut line = line;
    let mut uses = Vec::new();
    let mut name = None;
    let mut whole = true;
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Punct(punct) if matches!(punct.as_char(), ';' | ',') => break,
            TokenTree::Punct(punct) if punct.as_char() == '*' => {
                whole = false;
                let path = Named {
                    segments: segments.clone(),
                    line,
                };
                uses.push(Use {
                    path,
                    name: None,
                    public,
                });
            }
            TokenTree::Ident(word) if word == "as" => {
                if let Some(TokenTree::Ident(alias)) = tokens.next() {
                    name = Some(alias.to_string());
                }
            }
            TokenTree::Ident(word) => {
                line = word.span().start().line;
                // `a::{self}` is `a`.
                if word != "self" || segments.is_empty() {
                    segments.push(word.to_string());
                }
            }
            TokenTree::Group(group) => {
                whole = false;
                let stream = group.stream().into_iter().collect::<Vec<_>>();
                let mut inner = stream.into_iter().peekable();
                while inner.peek().is_some() {
                    uses.extend(use_tree(&mut inner, &segments, line, public));
                }
            }
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
    if whole && !segments.is_empty() {
        let name = name.or_else(|| segments.last().cloned());
        let path = Named { segments, line };
        uses.push(Use { path, name, public });
    }
    uses
}

/// The next segment of a path: `::` and a name.
fn continued(tokens: &mut Tokens) -> Option<String> {
    if !next_is(tokens, ':') {
        return None;
    }
    let mut ahead = tokens.clone();
    ahead.next();
    if !next_is(&mut ahead, ':') {
        return None;
    }
    ahead.next();
    let Some(TokenTree::Ident(name)) = ahead.next() else {
        return None;
    };
    *tokens = ahead;
    Some(name.to_string())
}

fn next_is(tokens: &mut Tokens, sign: char) -> bool {
    matches!(tokens.peek(), Some(TokenTree::Punct(punct)) if punct.as_char() == sign)
}

/// `#[path = "…"]`
fn path_of(attribute: &Group) -> Option<String> {
    let text = attribute.stream().to_string();
    let path = text.strip_prefix("path = \"")?.strip_suffix('"')?;
    Some(path.to_owned())
}

/// `#[cfg(test)]` and `#[cfg(all(test, …))]`
fn for_tests_alone(attribute: &Group) -> bool {
    let text: String = attribute.stream().to_string().split_whitespace().collect();
    text.starts_with("cfg(test") || text.starts_with("cfg(all(test")
}

/// Up to the semicolon or the braces that end it; those of `use` do not. The name of a module in a file of
/// its own.
fn skip_item(tokens: &mut Tokens) -> Option<String> {
    let (mut is_use, mut module) = (false, None);
    let mut after_mod = false;
    for token in tokens.by_ref() {
        match token {
            TokenTree::Ident(word) if std::mem::take(&mut after_mod) => {
                module = Some(word.to_string());
            }
            TokenTree::Ident(word) => {
                is_use |= word == "use";
                after_mod = word == "mod";
            }
            TokenTree::Punct(punct) if punct.as_char() == ';' => return module,
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace && !is_use => {
                return None;
            }
            _ => {}
        }
    }
    None
}
