//! `include/delta_cal.h` is what the Rust source makes of it, documentation included. After a change of the interface:
//!
//! ```text
//! DELTA_CAL_HEADER=write cargo test --package delta-cal-c --test it header
//! ```

use delta_cal_c::{kind, plain, status};
use std::collections::BTreeMap;
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

/// A structure, a function or a constant with what is said of it.
struct Item {
    name: String,
    about: Vec<String>,
    /// Fields or arguments; of a constant none.
    parts: Vec<Part>,
    /// The type of a function's result, the value of a constant.
    result: String,
}

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
    constants: Vec<Item>,
}

impl Source {
    fn of_file(file: &str) -> Self {
        Self::read(&text(file), file)
    }

    fn read(text: &str, file: &str) -> Self {
        let mut found = Self::default();
        let mut about = Vec::new();
        let (mut exported, mut in_c) = (String::new(), false);
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            if let Some(line) = line.strip_prefix("///") {
                about.push(line.trim().to_owned());
            } else if let Some(name) = line.strip_prefix("#[unsafe(export_name = ") {
                name.trim_end_matches(")]").clone_into(&mut exported);
            } else if line.starts_with("#[") {
                in_c |= line == "#[repr(C)]";
            } else if let Some(rest) = line.strip_prefix("pub const ")
                && let Some((name, value)) = rest.split_once(": ")
                && let Some((_, value)) = value.split_once(" = ")
                && !about.is_empty()
            {
                found.constants.push(Item {
                    name: name.to_owned(),
                    about: std::mem::take(&mut about),
                    parts: Vec::new(),
                    result: value.trim_end_matches(';').to_owned(),
                });
            } else if let Some(name) = line.strip_prefix("pub struct ") {
                let name = name.trim_end_matches(" {").to_owned();
                assert!(in_c, "{file}: {name} has not C's layout");
                in_c = false;
                let (mut parts, mut of_field) = (Vec::new(), Vec::new());
                for line in lines.by_ref().take_while(|line| *line != "}") {
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
                assert!(
                    exported.contains(&format!("{name}\"")),
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

/// Each calibrator: its prefix, what makes and fills it, and the object and outcome in Rust; then what several share.
const CALIBRATORS: [(&str, &str, [&str; 2], &[&str]); 4] = [
    (
        "ikm",
        "positions",
        ["Ikm", "RobotOutcome"],
        &["family", "stored", "outcomes"],
    ),
    (
        "joint",
        "positions",
        ["Joint", "JointOutcome"],
        &["family", "stored", "outcomes"],
    ),
    (
        "gate",
        "gate",
        ["Gate", "RobotOutcome"],
        &["family", "stored"],
    ),
    ("fkm", "fkm", ["Fkm", "FkmOutcome"], &["family", "outcomes"]),
];

/// Everything of one scalar: what calibrators share once for each, with its names and types.
fn of_scalar() -> Source {
    let mut all = Source::default();
    for file in ["robot", "sample", "outcome"] {
        all.append(Source::of_file(&format!("scalar/{file}")));
    }
    for (prefix, first, [own, outcome], shared) in CALIBRATORS {
        for file in [&[first], shared].concat() {
            let mut text = text(&format!("scalar/{file}"))
                .replace("<Own>", &format!("<{own}>"))
                .replace("<Outcome>", &format!("<{outcome}>"))
                .replace("family!(\"", &format!("family!(\"{prefix}_"))
                .replace("extern \"C\" fn ", &format!("extern \"C\" fn {prefix}_"));
            for name in [
                "init", "solve", "step", "stop", "reset", "finish", "restore",
            ] {
                text = text.replace(&format!("`{name}`"), &format!("`{prefix}_{name}`"));
            }
            all.append(Source::read(&text, file));
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

    /// A number in C, with its bytes; `None` if it is a structure.
    fn number(self, of: &str) -> Option<(&'static str, usize)> {
        Some(match (of, self) {
            ("Real", Self::Double) => ("double", 8),
            ("Real", Self::Single) | ("f32", _) => ("float", 4),
            ("u8", _) => ("uint8_t", 1),
            ("i32", _) => ("int32_t", 4),
            ("u32", _) => ("uint32_t", 4),
            ("u64", _) => ("uint64_t", 8),
            ("usize", _) => ("size_t", size_of::<usize>()),
            ("Status", _) => ("dcal_status", 4),
            _ => return None,
        })
    }

    fn value(self, of: &str) -> String {
        self.number(of)
            .map_or_else(|| self.structure(of), |(name, _)| name.to_owned())
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
            "Held" | "In" | "Many" => "const ",
            _ => "",
        };
        match (outer, array(inner)) {
            ("In" | "Out", Some((element, _, number))) => {
                format!("{constant}{} {name}[{number}]", self.value(element))
            }
            ("Held" | "HeldMut" | "New", None) => {
                format!("{constant}{} *{name}", self.object(inner))
            }
            ("In" | "Many" | "Out", None) => format!("{constant}{} *{name}", self.value(inner)),
            _ => panic!("{outer} is no type of the interface"),
        }
    }

    /// The bytes of a field; `known` are those of the structures before.
    fn bytes(self, of: &str, known: &BTreeMap<String, usize>) -> usize {
        match (array(of), self.number(of)) {
            (Some((element, _, number)), _) => number * self.bytes(element, known),
            (None, Some((_, bytes))) => bytes,
            (None, None) => known[&self.structure(of)],
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

/// The structures of both scalars, with their sizes in Rust.
fn sizes() -> BTreeMap<String, usize> {
    use delta_cal_c::{double, single};
    macro_rules! sizes {
        ($($module:ident $structure:ident)+) => {
            [$(
                (Scalar::Single.structure(stringify!($structure)), size_of::<single::$module::$structure>()),
                (Scalar::Double.structure(stringify!($structure)), size_of::<double::$module::$structure>())
            ),+]
        };
    }
    let error = size_of::<delta_cal_c::error::Error>();
    sizes! {
        robot Dimensions
        sample Sample
        sample Settings
        outcome ArmSummary
        gate Verdict
        gate GateCounts
        fkm Observation
        fkm Plane
        fkm Point
        fkm Instruments
    }
    .into_iter()
    .chain([("dcal_error".to_owned(), error)])
    .collect()
}

/// Padding is not allowed: its bytes would hold what was there before.
#[test]
fn no_structure_has_padding() {
    let (sizes, all) = (sizes(), of_scalar());
    let error = &Source::of_file("error").structures[0];
    let mut seen = 0;
    for scalar in [Scalar::Single, Scalar::Double] {
        for item in all.structures.iter().chain([error]) {
            let fields = item.parts.iter().map(|part| scalar.bytes(&part.of, &sizes));
            let name = scalar.structure(&item.name);
            assert_eq!(fields.sum::<usize>(), sizes[&name], "{name}");
            seen += usize::from(item.name != "Error");
        }
    }
    assert_eq!(seen + 1, sizes.len());
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
    let page = Page {
        names: all
            .functions
            .iter()
            .map(|function| &*function.name)
            .collect(),
    };
    let version = kind::VERSION;
    writeln!(
        text,
        "\n/** The version of this header: major << 16 | minor << 8 | patch. */\n\
         #define DCAL_VERSION UINT32_C({version})"
    )
    .unwrap();

    text.push_str("\n/** What a call came to. The numbers never change. */\ntypedef int32_t dcal_status;\n\nenum {\n");
    for (name, number) in status::ALL {
        let about = status::text(*number).to_str().unwrap().trim();
        writeln!(text, "    /** {about} */\n    DCAL_{name} = {number},").unwrap();
    }
    close(&mut text);
    text.push_str("\nenum {\n");
    for Item {
        name,
        about,
        result,
        ..
    } in &Source::of_file("plain").constants
    {
        page.comment(&mut text, "    ", about, Scalar::Single);
        writeln!(text, "    DCAL_{name} = {result},").unwrap();
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

    page.structure(
        &mut text,
        &Source::of_file("error").structures[0],
        Scalar::Single,
    );
    for function in &Source::of_file("library").functions {
        page.function(&mut text, function, Scalar::Single, "");
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
        for structure in &all.structures {
            page.structure(&mut text, structure, scalar);
        }
        for function in &all.functions {
            page.function(&mut text, function, scalar, scalar.suffix());
        }
    }
    text.push_str("\n/* ---- What this compiler makes of it ---- */\n\n");
    for (name, size) in sizes() {
        writeln!(
            text,
            "DCAL_ASSERT(sizeof({name}) == {size}, \"the size of a structure\");"
        )
        .unwrap();
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

struct Page<'a> {
    names: Vec<&'a str>,
}

impl Page<'_> {
    fn structure(&self, text: &mut String, item: &Item, scalar: Scalar) {
        let name = scalar.structure(&item.name);
        text.push('\n');
        self.comment(text, "", &item.about, scalar);
        writeln!(text, "typedef struct {name} {{").unwrap();
        for field in &item.parts {
            self.comment(text, "    ", &field.about, scalar);
            writeln!(text, "    {};", scalar.declared(field)).unwrap();
        }
        writeln!(text, "}} {name};").unwrap();
    }

    fn function(&self, text: &mut String, function: &Item, scalar: Scalar, suffix: &str) {
        text.push('\n');
        self.comment(text, "", &function.about, scalar);
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

    fn comment(&self, text: &mut String, indent: &str, about: &[String], scalar: Scalar) {
        let mut lines = Vec::new();
        for paragraph in about.split(String::is_empty) {
            if !lines.is_empty() {
                lines.push(String::new());
            }
            let mut line = String::new();
            for word in paragraph.iter().flat_map(|line| line.split(' ')) {
                let word = self.word(word, scalar);
                if !line.is_empty() && indent.len() + line.len() + word.len() + 8 > WIDTH {
                    lines.push(std::mem::take(&mut line));
                }
                if !line.is_empty() {
                    line.push(' ');
                }
                line.push_str(&word);
            }
            lines.push(line);
        }
        let last = lines.len() - 1;
        for (index, line) in lines.iter().enumerate() {
            let begin = if index == 0 { "/**" } else { " *" };
            let gap = if line.is_empty() { "" } else { " " };
            let end = if index == last { " */" } else { "" };
            writeln!(text, "{indent}{begin}{gap}{line}{end}").unwrap();
        }
    }

    /// A word without backticks; of a function its name in C.
    fn word(&self, word: &str, scalar: Scalar) -> String {
        let mut parts = word.split('`');
        if let (Some(before), Some(name), Some(after)) = (parts.next(), parts.next(), parts.next())
            && self.names.contains(&name)
        {
            return format!("{before}dcal_{name}{}{after}", scalar.suffix());
        }
        word.replace('`', "")
    }
}
