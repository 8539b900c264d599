//! Rust's types in C.

use delta_cal_c::{kind, plain};
use syn::{Expr, ExprLit, GenericArgument, Lit, PathArguments, Type};

/// `f32` or `f64`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scalar {
    Single,
    Double,
}

impl Scalar {
    pub(crate) fn suffix(self) -> &'static str {
        match self {
            Self::Single => "_f32",
            Self::Double => "_f64",
        }
    }

    fn real(self) -> &'static str {
        match self {
            Self::Single => "float",
            Self::Double => "double",
        }
    }
}

/// A declaration of this name and type.
pub(crate) fn declared(kind: &Type, name: &str, scalar: Scalar) -> String {
    if let Type::Ptr(_) = kind {
        return format!("const char *{name}");
    }
    if let Some((element, length)) = array(kind) {
        return format!("{} {name}[{}]", value(&element, scalar), length.0);
    }
    let (outer, inner) = path(kind);
    let Some(inner) = inner else {
        let gap = if name.is_empty() { "" } else { " " };
        return format!("{}{gap}{name}", value(kind, scalar));
    };
    let constant = if matches!(&*outer, "Held" | "In" | "Many") {
        "const "
    } else {
        ""
    };
    match (&*outer, array(&inner)) {
        ("In" | "Out", Some((element, length))) => {
            format!("{constant}{} {name}[{}]", value(&element, scalar), length.1)
        }
        ("Held" | "HeldMut" | "New", None) => {
            format!("{constant}{} *{name}", object(&path(&inner).0, scalar))
        }
        ("In" | "Many" | "Out", None) => format!("{constant}{} *{name}", value(&inner, scalar)),
        ("Workspace", None) => format!("dcal_observation_row{} *{name}", scalar.suffix()),
        _ => panic!("{outer} is no type of the interface"),
    }
}

/// The type of an object of this kind.
pub(crate) fn object(name: &str, scalar: Scalar) -> String {
    let kind = kind::ALL.iter().find(|kind| kind.name == name);
    let kind = kind.unwrap_or_else(|| panic!("{name} is no kind of object"));
    format!("dcal_{}{}", kind.in_c, scalar.suffix())
}

/// The type of a structure.
pub(crate) fn structure(name: &str, scalar: Scalar) -> String {
    let mut text = String::from("dcal");
    for letter in name.chars() {
        if letter.is_uppercase() {
            text.push('_');
        }
        text.extend(letter.to_lowercase());
    }
    if name == "Error" {
        return text;
    }
    text + scalar.suffix()
}

fn value(kind: &Type, scalar: Scalar) -> String {
    match &*path(kind).0 {
        "Real" => scalar.real().to_owned(),
        "f32" => "float".to_owned(),
        "u8" => "uint8_t".to_owned(),
        "i32" => "int32_t".to_owned(),
        "u32" => "uint32_t".to_owned(),
        "u64" => "uint64_t".to_owned(),
        "usize" => "size_t".to_owned(),
        "Status" => "dcal_status".to_owned(),
        name => structure(name, scalar),
    }
}

/// Size and alignment of a field; `of_structure` knows those that came before.
pub(crate) fn layout(
    kind: &Type,
    scalar: Scalar,
    of_structure: &dyn Fn(&str) -> (usize, usize),
) -> (usize, usize) {
    if let Some((element, length)) = array(kind) {
        let (size, alignment) = layout(&element, scalar, of_structure);
        return (size * length.1, alignment);
    }
    let own = match (&*path(kind).0, scalar) {
        ("Real", Scalar::Double) | ("u64", _) => 8,
        ("Real", Scalar::Single) | ("f32" | "i32" | "u32" | "Status", _) => 4,
        (name, _) => return of_structure(name),
    };
    (own, own)
}

/// The last segment of a type's path, and its first argument.
fn path(kind: &Type) -> (String, Option<Type>) {
    let Type::Path(path) = kind else {
        panic!("a type that the interface has not")
    };
    let last = path.path.segments.last().unwrap();
    let inner = match &last.arguments {
        PathArguments::AngleBracketed(arguments) => arguments.args.first(),
        _ => None,
    };
    let inner = inner.map(|inner| match inner {
        GenericArgument::Type(kind) => kind.clone(),
        _ => panic!("an argument that is no type"),
    });
    (last.ident.to_string(), inner)
}

/// Of an array the innermost element, and the length in words and as a number.
fn array(kind: &Type) -> Option<(Type, (String, usize))> {
    let Type::Array(array_type) = kind else {
        return None;
    };
    let (words, number) = match &array_type.len {
        Expr::Lit(ExprLit {
            lit: Lit::Int(digits),
            ..
        }) => (digits.to_string(), digits.base10_parse().unwrap()),
        Expr::Path(path) if path.path.is_ident("PLANES") => {
            ("DCAL_PLANES".to_owned(), plain::PLANES)
        }
        Expr::Path(path) if path.path.is_ident("POINTS") => {
            ("DCAL_POINTS".to_owned(), plain::POINTS)
        }
        _ => panic!("a length that is no number"),
    };
    Some(match array(&array_type.elem) {
        Some((element, (_, inner))) => {
            let length = number * inner;
            (element, (length.to_string(), length))
        }
        None => ((*array_type.elem).clone(), (words, number)),
    })
}
