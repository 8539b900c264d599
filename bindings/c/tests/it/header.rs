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

/// A structure or a function with what is said of it.
struct Item {
    name: String,
    about: Vec<String>,
    /// Fields or arguments.
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

/// The structures, functions and constants of a source that rustfmt has formatted.
#[derive(Default)]
struct Source {
    structures: Vec<Item>,
    functions: Vec<Item>,
    constants: Vec<Part>,
}

impl Source {
    fn of_file(file: &str) -> Self {
        Self::read(&text(file), file)
    }

    fn read(text: &str, file: &str) -> Self {
        let mut found = Self::default();
        let mut about = Vec::new();
        let mut exported = String::new();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            // Indented in the macros that several calibrators share.
            let line = line.trim_start();
            if let Some(line) = line.strip_prefix("///") {
                about.push(line.trim().to_owned());
            } else if let Some(name) = line.strip_prefix("#[unsafe(export_name = ") {
                name.trim_end_matches(")]").clone_into(&mut exported);
            } else if line.starts_with("#[") {
            } else if let Some(rest) = line.strip_prefix("pub const ")
                && let Some((name, value)) = rest.split_once(": ")
                && let Some((_, value)) = value.split_once(" = ")
                && !about.is_empty()
            {
                found.constants.push(Part {
                    name: name.to_owned(),
                    of: value.trim_end_matches(';').to_owned(),
                    about: std::mem::take(&mut about),
                });
            } else if let Some(name) = line.strip_prefix("pub struct ") {
                let name = name.trim_end_matches(" {").to_owned();
                let (mut parts, mut of_field) = (Vec::new(), Vec::new());
                for line in lines.by_ref().take_while(|line| line.trim() != "}") {
                    match line.trim().strip_prefix("///") {
                        Some(line) => of_field.push(line.trim().to_owned()),
                        None => parts.push(part(
                            line.trim().trim_start_matches("pub ").trim_end_matches(','),
                            std::mem::take(&mut of_field),
                        )),
                    }
                }
                found.structures.push(Item {
                    name,
                    about: std::mem::take(&mut about),
                    parts,
                    result: String::new(),
                });
            } else if let Some(start) = line.strip_prefix("pub extern \"C\" fn ") {
                let mut signature = start.to_owned();
                while !signature.ends_with('{') {
                    signature += lines.next().unwrap().trim();
                }
                let (name, rest) = signature.split_once('(').unwrap();
                let (arguments, result) = rest.split_once(") -> ").unwrap();
                let symbol = exported.rsplit('"').nth(1).unwrap();
                assert!(
                    symbol.ends_with(name) || name.ends_with(symbol),
                    "{name}: {exported}"
                );
                found.functions.push(Item {
                    name: name.to_owned(),
                    about: std::mem::take(&mut about),
                    parts: at_depth_0(arguments)
                        .into_iter()
                        .map(|argument| part(argument.trim_start_matches("mut "), Vec::new()))
                        .collect(),
                    result: result.trim_end_matches(" {").to_owned(),
                });
            } else {
                about.clear();
            }
        }
        let mut all = found.structures.iter().chain(&found.functions);
        assert!(
            all.all(|item| !item.about.is_empty()),
            "{file}: not documented"
        );
        found
    }

    fn append(&mut self, other: Self) {
        self.structures.extend(other.structures);
        self.functions.extend(other.functions);
    }
}

fn text(file: &str) -> String {
    let path = format!("{}/src/{file}.rs", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

fn part(text: &str, about: Vec<String>) -> Part {
    let (name, of) = text.split_once(": ").unwrap();
    Part {
        name: name.to_owned(),
        of: of.to_owned(),
        about,
    }
}

/// What stands between commas that are in no brackets.
fn at_depth_0(text: &str) -> Vec<&str> {
    let mut depth = 0;
    text.split(|letter| {
        depth += i32::from("<[".contains(letter)) - i32::from(">]".contains(letter));
        letter == ',' && depth == 0
    })
    .map(str::trim)
    .filter(|part| !part.is_empty())
    .collect()
}

/// Each calibrator: its prefix, its type in Rust, and the files and macros with its functions.
const CALIBRATORS: [(&str, &str, &[&str]); 4] = [
    ("ikm", "Ikm", &["of_positions", "calibrator", "stored"]),
    ("joint", "Joint", &["of_positions", "calibrator", "stored"]),
    ("gate", "Gate", &["gate", "calibrator", "stored"]),
    ("fkm", "Fkm", &["fkm", "calibrator"]),
];

/// Everything of one scalar: what calibrators share once for each, with its names and types. In the comments `@` stands
/// for the scalar's suffix.
fn of_scalar() -> Source {
    let mut all = Source::default();
    for file in ["robot", "sample", "outcome"] {
        all.append(Source::of_file(&format!("scalar/{file}")));
    }
    let family = text("scalar/family");
    let macros = family.split("macro_rules! ").skip(1);
    let shared: Vec<_> = macros.filter_map(|own| own.split_once(" {")).collect();
    for (prefix, own, places) in CALIBRATORS {
        for place in places {
            let shared = shared.iter().find(|(name, _)| name == place);
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
            all.append(Source::read(&text, place));
        }
    }
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

    /// The type of an object of this kind.
    fn object(self, of: &str) -> String {
        let (name, _) = of.split_once('<').unwrap_or((of, ""));
        let kind = kind::ALL.iter().find(|kind| kind.name == name);
        let kind = kind.unwrap_or_else(|| panic!("{name} is no kind of object"));
        format!("dcal_{}{}", kind.in_c, self.suffix())
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
            ("Held" | "HeldMut" | "New", None) => {
                format!("{constant}{} *{name}", self.object(inner))
            }
            ("In" | "Out", None) => format!("{constant}{} *{name}", self.value(inner)),
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
    for (number, (found, made)) in (1..).zip(found.lines().zip(made.lines())) {
        assert_eq!(
            found, made,
            "line {number} of delta_cal.h; write it again with DELTA_CAL_HEADER=write"
        );
    }
    assert_eq!(found, made, "write it again with DELTA_CAL_HEADER=write");
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

    text.push_str("\n/** The result of a call. The numbers never change. */\ntypedef int32_t dcal_status;\n\nenum {\n");
    for (name, number) in status::ALL {
        let about = status::text(*number).to_str().unwrap().trim();
        writeln!(text, "    /** {about} */\n    DCAL_{name} = {number},").unwrap();
    }
    close(&mut text);
    text.push_str("\nenum {\n");
    for Part { name, of, about } in &Source::of_file("plain").constants {
        comment(&mut text, "    ", about, Scalar::Single);
        writeln!(text, "    DCAL_{name} = {of},").unwrap();
    }
    close(&mut text);
    text.push_str(
        "\n/** The kinds of object, for dcal_size. The numbers never change. */\nenum {\n",
    );
    for (index, scalar) in [(0, Scalar::Single), (1, Scalar::Double)] {
        for kind in kind::ALL {
            let name = scalar.object(kind.name).to_uppercase();
            writeln!(text, "    {name} = {},", kind.scalars[index].0).unwrap();
        }
    }
    close(&mut text);

    let error = &Source::of_file("error").structures[0];
    structure(&mut text, error, Scalar::Single);
    for item in &Source::of_file("library").functions {
        function(&mut text, item, Scalar::Single, "");
    }
    for (index, scalar, words) in [
        (0, Scalar::Single, "Single precision"),
        (1, Scalar::Double, "Double precision"),
    ] {
        writeln!(text, "\n/* ---- {words} ---- */").unwrap();
        for kind in kind::ALL {
            let size = kind.scalars[index].1;
            opaque(&mut text, &scalar.object(kind.name), kind.about, size);
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

/// Without the comma after the last constant.
fn close(text: &mut String) {
    text.truncate(text.trim_end_matches(",\n").len());
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
