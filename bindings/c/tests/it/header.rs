//! `include/delta_cal.h` is what the Rust source makes of it, documentation included. After a change of the interface:
//!
//! ```text
//! DELTA_CAL_HEADER=write cargo test --package delta-cal-c --test it header
//! ```

use delta_cal_c::{kind, plain, status};
use std::fmt::Write;

const HEADER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/include/delta_cal.h");

/// Comments are wrapped before this column.
const WIDTH: usize = 110;

/// What stands before the first constant.
const BEGIN: &str = include_str!("header_begin.h");
const END: &str = "
#ifdef __cplusplus
}
#endif

#endif
";

/// An enumeration, a structure or a function, with what is said of it.
#[derive(Default)]
struct Item {
    name: String,
    about: Vec<String>,
    /// Constants, fields or arguments.
    parts: Vec<Part>,
    /// The type of a function's result.
    result: String,
}

/// A field or argument with its type, or a constant with its value.
struct Part {
    name: String,
    of: String,
    about: Vec<String>,
}

impl Part {
    /// From `name: type` or `name: type = value`.
    fn new(text: &str, about: Vec<String>) -> Self {
        let (name, of) = text.split_once(": ").unwrap();
        let of = of.split_once(" = ").map_or(of, |(_, value)| value);
        Self {
            name: name.to_owned(),
            of: of.to_owned(),
            about,
        }
    }
}

/// What a source that rustfmt has formatted has for the header.
#[derive(Default)]
struct Source {
    enumerations: Vec<Item>,
    structures: Vec<Item>,
    functions: Vec<Item>,
}

impl Source {
    fn read(text: &str) -> Self {
        let mut found = Self::default();
        let mut about = Vec::new();
        let mut exported = "";
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            // Indented in the macros that several calibrators share.
            let line = line.trim_start();
            let item = |name: &str, about: &mut Vec<String>| Item {
                name: name.to_owned(),
                about: std::mem::take(about),
                ..Item::default()
            };
            if let Some(line) = line.strip_prefix("///") {
                about.push(line.trim().to_owned());
            } else if let Some(name) = line.strip_prefix("#[unsafe(export_name = ") {
                exported = name.rsplit('"').nth(1).unwrap();
            } else if line.starts_with("#[") {
            } else if let Some(name) = line.strip_prefix("// enum ") {
                found.enumerations.push(item(name, &mut about));
            } else if let Some(constant) = line.strip_prefix("pub const ")
                && let Some(last) = found.enumerations.last_mut()
            {
                let constant = constant.trim_end_matches(';');
                last.parts
                    .push(Part::new(constant, std::mem::take(&mut about)));
            } else if let Some(name) = line.strip_prefix("pub struct ") {
                let own = item(name.trim_end_matches(" {"), &mut about);
                found.structures.push(own);
            } else if let Some(field) = line.strip_prefix("pub ")
                && let (Some(field), Some(last)) =
                    (field.strip_suffix(','), found.structures.last_mut())
            {
                last.parts
                    .push(Part::new(field, std::mem::take(&mut about)));
            } else if let Some(start) = line.strip_prefix("pub extern \"C\" fn ") {
                let mut signature = start.to_owned();
                while !signature.ends_with('{') {
                    signature += lines.next().unwrap().trim();
                }
                let (name, rest) = signature.split_once('(').unwrap();
                let (arguments, result) = rest.split_once(") -> ").unwrap();
                assert!(
                    exported.ends_with(name) || name.ends_with(exported),
                    "{name}"
                );
                let mut own = item(name, &mut about);
                let arguments = arguments
                    .split(',')
                    .map(str::trim)
                    .filter(|own| !own.is_empty());
                let arguments = arguments.map(|own| own.trim_start_matches("mut "));
                own.parts = arguments.map(|own| Part::new(own, Vec::new())).collect();
                result.trim_end_matches(" {").clone_into(&mut own.result);
                found.functions.push(own);
            } else {
                about.clear();
            }
        }
        for Item { name, about, .. } in found.structures.iter().chain(&found.functions) {
            assert!(!about.is_empty(), "{name} is not documented");
        }
        found
    }
}

fn text(file: &str) -> String {
    let path = format!("{}/src/{file}.rs", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// Everything of one scalar: what calibrators share once for each, with its names and types. In the comments `@` stands
/// for the scalar's suffix.
fn of_scalar() -> Source {
    let mut all: String = ["robot", "sample", "outcome", "verdict"]
        .map(|file| text(&format!("scalar/{file}")))
        .concat();
    let (families, macros) = (text("scalar/mod"), text("scalar/family"));
    let macros = macros.split("macro_rules! ").skip(1);
    let shared: Vec<_> = macros.filter_map(|own| own.split_once(" {")).collect();
    // As in the source: `ikm Ikm: of_positions calibrator;`.
    let families = families
        .lines()
        .filter_map(|line| line.trim().strip_suffix(';')?.split_once(": "));
    for (family, places) in families.chain([("fkm Fkm", "fkm calibrator")]) {
        let (prefix, own) = family.split_once(' ').unwrap();
        for place in places.split(' ') {
            let shared = shared.iter().find(|(name, _)| *name == place);
            let text =
                shared.map_or_else(|| text(&format!("scalar/{place}")), |own| own.1.to_owned());
            let mut text = text
                .replace("<Own>", &format!("<{own}>"))
                .replace("extern \"C\" fn ", &format!("extern \"C\" fn {prefix}_"));
            for name in [
                "init", "solve", "step", "stop", "reset", "finish", "restore",
            ] {
                text = text.replace(&format!("`{name}`"), &format!("`{prefix}_{name}`"));
            }
            all += &text;
        }
    }
    let mut all = Source::read(&all);
    let names: Vec<String> = all.functions.iter().map(|own| own.name.clone()).collect();
    let items = all.structures.iter_mut().chain(&mut all.functions);
    for line in items.flat_map(|item| &mut item.about) {
        for name in &names {
            *line = line.replace(&format!("`{name}`"), &format!("dcal_{name}@"));
        }
    }
    all
}

/// `f32` or `f64`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scalar {
    Single,
    Double,
}

impl Scalar {
    fn suffix(self) -> &'static str {
        match self {
            Self::Single => "_f32",
            Self::Double => "_f64",
        }
    }

    /// A number or a structure in C.
    fn value(self, of: &str) -> String {
        let number = match (of, self) {
            ("Real", Self::Double) => "double",
            ("Real", Self::Single) | ("f32", _) => "float",
            ("u8", _) => "uint8_t",
            ("i32", _) => "int32_t",
            ("u32", _) => "uint32_t",
            ("u64", _) => "uint64_t",
            ("usize", _) => "size_t",
            ("Status", _) => "dcal_status",
            _ => return self.structure(of),
        };
        number.to_owned()
    }

    /// The type of a structure.
    fn structure(self, name: &str) -> String {
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
        text + self.suffix()
    }

    /// A declaration of this name and type.
    fn declared(self, Part { name, of, .. }: &Part) -> String {
        let Some((outer, inner)) = of.split_once('<').filter(|_| !of.starts_with('[')) else {
            return match array(of) {
                Some((element, words, _)) => format!("{} {name}[{words}]", self.value(element)),
                None => format!("{} {name}", self.value(of)),
            };
        };
        let inner = inner.strip_suffix('>').unwrap();
        let constant = match outer {
            "Held" | "In" => "const ",
            _ => "",
        };
        match (outer, array(inner)) {
            ("In" | "Out", Some((element, _, number))) => {
                format!("{constant}{} {name}[{number}]", self.value(element))
            }
            ("Held" | "HeldMut" | "New" | "In" | "Out", None) => {
                let (own, _) = inner.split_once('<').unwrap_or((inner, ""));
                format!("{constant}{} *{name}", self.value(own))
            }
            _ => panic!("{outer} is no type of the interface"),
        }
    }

    /// The bytes of a field in C.
    fn bytes(self, of: &str) -> String {
        match array(of) {
            Some((element, words, _)) => format!("{words} * sizeof({})", self.value(element)),
            None => format!("sizeof({})", self.value(of)),
        }
    }
}

/// Of an array the innermost element, and the length in words and as a number.
fn array(of: &str) -> Option<(&str, String, usize)> {
    let (element, length) = of.strip_prefix('[')?.strip_suffix(']')?.rsplit_once("; ")?;
    let (words, number) = match length {
        "PLANES" => ("DCAL_PLANES".to_owned(), plain::PLANES),
        "POINTS" => ("DCAL_POINTS".to_owned(), plain::POINTS),
        digits => (digits.to_owned(), digits.parse().unwrap()),
    };
    Some(match array(element) {
        Some((element, _, inner)) => (element, (number * inner).to_string(), number * inner),
        None => (element, words, number),
    })
}

#[test]
fn the_header_is_that_of_the_source() {
    let made = header();
    if std::env::var("DELTA_CAL_HEADER").is_ok_and(|value| value == "write") {
        std::fs::write(HEADER, &made).unwrap();
    }
    let found = std::fs::read_to_string(HEADER).unwrap_or_default();
    let mut lines = found.lines().zip(made.lines());
    let first = lines.find(|(found, made)| found != made);
    assert!(
        found == made,
        "write it again with DELTA_CAL_HEADER=write: {first:?}"
    );
}

fn header() -> String {
    let all = of_scalar();
    let mut text = String::from(BEGIN);
    let version = kind::VERSION;
    writeln!(
        text,
        "\n/** The version of this header: major << 16 | minor << 8 | patch. */\n\
         #define DCAL_VERSION UINT32_C({version})"
    )
    .unwrap();

    text.push_str(
        "\n/** The result of a call. The numbers never change. */\ntypedef int32_t dcal_status;\n",
    );
    let statuses = status::ALL.iter().map(|(name, number)| Part {
        name: (*name).to_owned(),
        of: number.to_string(),
        about: vec![status::text(*number).to_str().unwrap().trim().to_owned()],
    });
    enumeration(&mut text, "status_code", statuses);
    for own in Source::read(&self::text("plain")).enumerations {
        enumeration(&mut text, &own.name, own.parts);
    }
    text.push_str("\n/** For dcal_size. The numbers never change. */");
    let kinds = [(0, Scalar::Single), (1, Scalar::Double)].map(|(index, scalar)| {
        kind::ALL.iter().map(move |kind| Part {
            name: scalar
                .structure(kind.name)
                .to_uppercase()
                .replace("DCAL_", ""),
            of: kind.scalars[index].0.to_string(),
            about: Vec::new(),
        })
    });
    enumeration(&mut text, "kind", kinds.into_iter().flatten());

    let error = &Source::read(&self::text("error")).structures[0];
    structure(&mut text, error, Scalar::Single);
    for item in &Source::read(&self::text("library")).functions {
        function(&mut text, item, Scalar::Single, "");
    }
    for (index, scalar, words) in [
        (0, Scalar::Single, "Single precision"),
        (1, Scalar::Double, "Double precision"),
    ] {
        writeln!(text, "\n/* ---- {words} ---- */").unwrap();
        for kind in kind::ALL {
            let size = kind.scalars[index].1;
            opaque(&mut text, &scalar.structure(kind.name), kind.about, size);
        }
        text.push_str("\n/** The bytes of a snapshot. */\n");
        for (of, sizes) in kind::SNAPSHOTS {
            let name = format!("DCAL_{of}_SNAPSHOT{}_SIZE", scalar.suffix());
            writeln!(text, "#define {} {}", name.to_uppercase(), sizes[index]).unwrap();
        }
        for item in &all.structures {
            structure(&mut text, item, scalar);
        }
        for item in &all.functions {
            function(&mut text, item, scalar, scalar.suffix());
        }
    }
    assert_eq!(plain::UNKNOWNS, 12, "the comment on it says so");
    text + END
}

fn opaque(text: &mut String, name: &str, about: &str, size: usize) {
    let macro_name = format!("{}_SIZE", name.to_uppercase());
    writeln!(
        text,
        "\n/** {about} */\n#define {macro_name} {size}\n\
         typedef struct {name} {{\n    DCAL_ALIGNED unsigned char memory[{macro_name}];\n}} {name};\n\
         DCAL_OBJECT({name}, {macro_name});"
    )
    .unwrap();
}

fn enumeration(text: &mut String, name: &str, constants: impl IntoIterator<Item = Part>) {
    write!(text, "\nenum dcal_{name} {{").unwrap();
    for (index, Part { name, of, about }) in constants.into_iter().enumerate() {
        text.push_str(if index == 0 { "\n" } else { ",\n" });
        if !about.is_empty() {
            comment(text, "    ", &about, Scalar::Single);
        }
        write!(text, "    DCAL_{name} = {of}").unwrap();
    }
    text.push_str("\n};\n");
}

fn structure(text: &mut String, item: &Item, scalar: Scalar) {
    let name = scalar.structure(&item.name);
    text.push('\n');
    comment(text, "", &item.about, scalar);
    writeln!(text, "typedef struct {name} {{").unwrap();
    for field in &item.parts {
        comment(text, "    ", &field.about, scalar);
        writeln!(text, "    {};", scalar.declared(field)).unwrap();
    }
    let fields = item.parts.iter().map(|field| scalar.bytes(&field.of));
    let size = fields.collect::<Vec<_>>().join("\n    + ");
    writeln!(
        text,
        "}} {name};\nDCAL_ASSERT(sizeof({name}) == {size}, \"no padding\");"
    )
    .unwrap();
}

fn function(text: &mut String, function: &Item, scalar: Scalar, suffix: &str) {
    text.push('\n');
    comment(text, "", &function.about, scalar);
    let result = match &*function.result {
        "*const c_char" => "const char *".to_owned(),
        of => scalar.value(of) + " ",
    };
    let start = format!("{result}dcal_{}{suffix}(", function.name);
    let declared = function.parts.iter().map(|part| scalar.declared(part));
    let mut arguments = declared.collect::<Vec<_>>().join(", ");
    if arguments.is_empty() {
        "void".clone_into(&mut arguments);
    }
    if start.len() + arguments.len() + 2 <= WIDTH {
        writeln!(text, "{start}{arguments});").unwrap();
    } else {
        let lines = arguments.replace(", ", ",\n    ");
        writeln!(text, "{start}\n    {lines});").unwrap();
    }
}

fn comment(text: &mut String, indent: &str, about: &[String], scalar: Scalar) {
    let mut lines = vec![String::new()];
    for paragraph in about.split(String::is_empty) {
        for word in paragraph.iter().flat_map(|line| line.split(' ')) {
            let word = word.replace('@', scalar.suffix()).replace('`', "");
            let last = lines.last_mut().unwrap();
            if !last.is_empty() && indent.len() + last.len() + word.len() + 7 > WIDTH {
                lines.push(format!(" {word}"));
            } else {
                write!(last, " {word}").unwrap();
            }
        }
        lines.extend([String::new(), String::new()]);
    }
    // The next paragraph that does not follow, and the empty line before it.
    lines.truncate(lines.len() - 2);
    let text_of_all = lines.join(&format!("\n{indent} *"));
    writeln!(text, "{indent}/**{text_of_all} */").unwrap();
}
