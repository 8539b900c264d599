//! What the Rust source says: structures, constants and functions, with their documentation.

use syn::{Attribute, Expr, ExprLit, Fields, FnArg, Item, Lit, Meta, Pat, ReturnType, Type};

/// The files with functions, in the header's order.
const SCALAR: [&str; 6] = [
    "robot",
    "sample",
    "family",
    "outcome",
    "gate",
    "observations",
];
/// The families of `family`: prefix, calibrator and outcome.
const FAMILIES: [(&str, &str, &str); 2] = [
    ("arms", "Arms", "RobotOutcome"),
    ("joint", "Joint", "JointOutcome"),
];

/// A name with its type and what is said of it.
pub(crate) struct Place {
    pub(crate) name: String,
    pub(crate) kind: Type,
    pub(crate) about: Vec<String>,
}

pub(crate) struct Structure {
    pub(crate) name: String,
    pub(crate) about: Vec<String>,
    pub(crate) fields: Vec<Place>,
}

pub(crate) struct Function {
    pub(crate) name: String,
    pub(crate) about: Vec<String>,
    pub(crate) arguments: Vec<Place>,
    pub(crate) result: Type,
}

pub(crate) struct Constant {
    pub(crate) name: String,
    pub(crate) about: Vec<String>,
    pub(crate) value: u64,
    pub(crate) negative: bool,
}

/// Everything that the header shows.
pub(crate) struct Source {
    pub(crate) constants: Vec<Constant>,
    pub(crate) error: Structure,
    pub(crate) structures: Vec<Structure>,
    pub(crate) functions: Vec<Function>,
    pub(crate) library: Vec<Function>,
}

impl Source {
    pub(crate) fn read() -> Self {
        let mut source = Self {
            constants: Vec::new(),
            error: structures(&items("error")).remove(0),
            structures: Vec::new(),
            functions: Vec::new(),
            library: functions(&items("library"), |name| format!("\"dcal_{name}\"")),
        };
        for item in items("plain") {
            if let Item::Const(item) = item {
                let (value, negative) = number(&item.expr);
                source.constants.push(Constant {
                    name: item.ident.to_string(),
                    about: documentation(&item.attrs),
                    value,
                    negative,
                });
            }
        }
        for file in SCALAR {
            let text = text(&format!("scalar/{file}"));
            let texts = match file {
                "family" => FAMILIES.map(|family| of_family(&text, family)).to_vec(),
                _ => vec![text],
            };
            for text in texts {
                let items = syn::parse_file(&text).unwrap().items;
                source.structures.extend(structures(&items));
                let named = |name: &str| format!("name ! (\"{name}\")");
                source.functions.extend(functions(&items, named));
            }
        }
        source
    }
}

fn text(file: &str) -> String {
    let path = format!("{}/src/{file}.rs", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

fn items(file: &str) -> Vec<Item> {
    syn::parse_file(&text(file)).unwrap().items
}

/// The functions that every calibrator has, with the names and types of one.
fn of_family(text: &str, (prefix, own, outcome): (&str, &str, &str)) -> String {
    let mut text = text
        .replace("<Own>", &format!("<{own}>"))
        .replace("<Outcome>", &format!("<{outcome}>"))
        .replace("family!(\"", &format!("name!(\"{prefix}_"))
        .replace("extern \"C\" fn ", &format!("extern \"C\" fn {prefix}_"));
    for name in ["solve", "step", "stop", "finish", "restore"] {
        text = text.replace(&format!("`{name}`"), &format!("`{prefix}_{name}`"));
    }
    text
}

/// The structures in C's layout.
fn structures(items: &[Item]) -> Vec<Structure> {
    let mut found = Vec::new();
    for item in items {
        let Item::Struct(item) = item else { continue };
        let in_c = item.attrs.iter().any(|attribute| {
            attribute.path().is_ident("repr")
                && matches!(&attribute.meta, Meta::List(list) if list.tokens.to_string() == "C")
        });
        let Fields::Named(fields) = &item.fields else {
            panic!("{}: fields without names", item.ident)
        };
        assert!(in_c, "{} has not C's layout", item.ident);
        found.push(Structure {
            name: item.ident.to_string(),
            about: documentation(&item.attrs),
            fields: fields
                .named
                .iter()
                .map(|field| Place {
                    name: field.ident.as_ref().unwrap().to_string(),
                    kind: field.ty.clone(),
                    about: documentation(&field.attrs),
                })
                .collect(),
        });
    }
    found
}

/// The functions that C can call. Each must be exported under its own name.
fn functions(items: &[Item], exported_as: impl Fn(&str) -> String) -> Vec<Function> {
    let mut found = Vec::new();
    for item in items {
        let Item::Fn(item) = item else { continue };
        if item.sig.abi.is_none() {
            continue;
        }
        let name = item.sig.ident.to_string();
        let wanted = format!("export_name = {}", exported_as(&name));
        assert!(
            item.attrs.iter().any(|attribute| matches!(
                &attribute.meta,
                Meta::List(list) if list.path.is_ident("unsafe") && list.tokens.to_string() == wanted
            )),
            "{name} is not exported by {wanted}"
        );
        let arguments = item.sig.inputs.iter().map(|argument| {
            let FnArg::Typed(argument) = argument else {
                panic!("{name}: self")
            };
            let Pat::Ident(pattern) = &*argument.pat else {
                panic!("{name}: a pattern")
            };
            Place {
                name: pattern.ident.to_string(),
                kind: (*argument.ty).clone(),
                about: Vec::new(),
            }
        });
        let ReturnType::Type(_, result) = &item.sig.output else {
            panic!("{name} returns nothing")
        };
        found.push(Function {
            about: documentation(&item.attrs),
            arguments: arguments.collect(),
            result: (**result).clone(),
            name,
        });
    }
    found
}

/// The lines of the documentation; an empty one ends a paragraph.
fn documentation(attributes: &[Attribute]) -> Vec<String> {
    let lines: Vec<String> = attributes
        .iter()
        .filter_map(|attribute| match &attribute.meta {
            Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
                Expr::Lit(ExprLit {
                    lit: Lit::Str(text),
                    ..
                }) => Some(text.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        })
        .collect();
    assert!(!lines.is_empty(), "something is not documented");
    lines
}

fn number(value: &Expr) -> (u64, bool) {
    match value {
        Expr::Lit(ExprLit {
            lit: Lit::Int(digits),
            ..
        }) => (digits.base10_parse().unwrap(), false),
        Expr::Unary(negated) => (number(&negated.expr).0, true),
        _ => panic!("a constant that is no number"),
    }
}
