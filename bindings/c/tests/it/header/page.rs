//! The header's text.

use super::source::{Function, Source, Structure};
use super::types::{Scalar, declared, layout, object, structure};
use delta_cal_c::{kind, library, plain, status};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Comments are wrapped before this column.
const WIDTH: usize = 110;

const BEGIN: &str = "\
/** delta_cal.h: kinematic calibration of Delta parallel robots, for C99 and C++11.
 *
 * Made from the library's source; do not edit it. The manual is docs/c.md.
 *
 * Angles are in radians, lengths in any one unit that you choose. Names end in _f32 or _f64, the type of all numbers.
 *
 * Objects lie in memory that you provide: a variable of the object's type, wherever you like, static or on the stack.
 * Nothing is allocated, nothing is released, and an object holds no pointer, so that you may copy one by assignment.
 * Functions that make an object take its size (sizeof object) and refuse less than they need. An object is of this
 * version of the library: after an update of the firmware, make it anew from a snapshot.
 *
 * Every function but four returns DCAL_OK (0), DCAL_WORKING (1), or why nothing was done. A call that
 * fails writes nothing but its error. An argument `error` may be NULL. What every function can return beside the
 * errors that stand with it: DCAL_NULL_POINTER, DCAL_MISALIGNED, DCAL_WRONG_SIZE,
 * DCAL_NOT_INITIALIZED, DCAL_WRONG_KIND and DCAL_OVERLAP.
 *
 * What you promise: a pointer is NULL or leads to memory of its type, and nobody else uses that memory during the
 * call. Different objects may be used at the same time, from interrupts and threads too.
 */
#ifndef DELTA_CAL_H
#define DELTA_CAL_H

#include <stddef.h>
#include <stdint.h>

#if defined(__cplusplus)
#define DCAL_ASSERT(condition, text) static_assert(condition, text)
#define DCAL_ALIGNED alignas(8)
extern \"C\" {
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define DCAL_ASSERT(condition, text) _Static_assert(condition, text)
#define DCAL_ALIGNED _Alignas(8)
#else
#define DCAL_ASSERT(condition, text) extern int dcal_asserted[(condition) ? 1 : -1]
#ifdef __GNUC__
#define DCAL_ALIGNED __attribute__((aligned(8)))
#else
#define DCAL_ALIGNED /* Align objects to 8 bytes yourself: DCAL_MISALIGNED says where they are not. */
#endif
#endif
#define DCAL_OBJECT(type, size) DCAL_ASSERT(sizeof(type) == size, \"the size of an object\")
";

const END: &str = "
#ifdef __cplusplus
}
#endif

#endif
";

pub(crate) fn header(source: &Source) -> String {
    let mut text = String::from(BEGIN);
    let names: Vec<&str> = source
        .functions
        .iter()
        .map(|function| &*function.name)
        .collect();
    let page = Page { names };

    let version = library::VERSION;
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
    close(&mut text, "};\n");

    text.push_str("\nenum {\n");
    for constant in &source.constants {
        page.comment(&mut text, "    ", &constant.about, Scalar::Single);
        let sign = if constant.negative { "-" } else { "" };
        writeln!(
            text,
            "    DCAL_{} = {sign}{},",
            constant.name, constant.value
        )
        .unwrap();
    }
    close(&mut text, "};\n");

    text.push_str(
        "\n/** The kinds of object, for dcal_size. The numbers never change. */\nenum {\n",
    );
    for (index, scalar) in [(0, Scalar::Single), (1, Scalar::Double)] {
        for kind in kind::ALL {
            let name = object(kind.name, scalar).to_uppercase();
            writeln!(text, "    {name} = {},", kind.scalars[index].0).unwrap();
        }
    }
    close(&mut text, "};\n");

    page.structure(&mut text, &source.error, Scalar::Single);
    for function in &source.library {
        page.function(&mut text, function, Scalar::Single, "dcal_", "");
    }

    let sizes: BTreeMap<String, usize> = structures(source).into_iter().collect();
    for (index, scalar, words) in [
        (0, Scalar::Single, "Single precision"),
        (1, Scalar::Double, "Double precision"),
    ] {
        writeln!(text, "\n/* ---- {words} ---- */").unwrap();
        for kind in kind::ALL {
            opaque(
                &mut text,
                &object(kind.name, scalar),
                kind.about,
                kind.scalars[index].1,
            );
        }
        let row = format!("dcal_observation_row{}", scalar.suffix());
        let size = [kind::OBSERVATION_ROW_F32, kind::OBSERVATION_ROW_F64][index];
        opaque(&mut text, &row, "Workspace for one observation.", size);
        text.push_str("\n/** The bytes of a snapshot. */\n");
        for (of, sizes) in kind::SNAPSHOTS {
            let name = format!("DCAL_{of}_SNAPSHOT{}_SIZE", scalar.suffix());
            writeln!(text, "#define {} {}", name.to_uppercase(), sizes[index]).unwrap();
        }
        for structure in &source.structures {
            page.structure(&mut text, structure, scalar);
        }
        for function in &source.functions {
            page.function(&mut text, function, scalar, "dcal_", scalar.suffix());
        }
    }

    text.push_str("\n/* ---- What this compiler makes of it ---- */\n\n");
    for (name, size) in sizes {
        writeln!(
            text,
            "DCAL_ASSERT(sizeof({name}) == {size}, \"the size of a structure\");"
        )
        .unwrap();
    }
    text.push_str(END);
    assert_eq!(plain::UNKNOWNS, 12, "the comment on it says so");
    text
}

/// The structures of both scalars, with their sizes in C.
pub(crate) fn structures(source: &Source) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    found.push((
        "dcal_error".to_owned(),
        size(&source.error, Scalar::Single, &BTreeMap::new()).0,
    ));
    for scalar in [Scalar::Single, Scalar::Double] {
        let mut known = BTreeMap::new();
        for item in &source.structures {
            let layout = size(item, scalar, &known);
            known.insert(item.name.clone(), layout);
            found.push((structure(&item.name, scalar), layout.0));
        }
    }
    found
}

/// Size and alignment. Padding is not allowed: its bytes would hold what was there before.
fn size(
    item: &Structure,
    scalar: Scalar,
    known: &BTreeMap<String, (usize, usize)>,
) -> (usize, usize) {
    let (mut end, mut largest) = (0_usize, 1);
    for field in &item.fields {
        let (size, alignment) = layout(&field.kind, scalar, &|name| known[name]);
        assert!(
            end.is_multiple_of(alignment),
            "padding before {}.{}",
            item.name,
            field.name
        );
        end += size;
        largest = largest.max(alignment);
    }
    assert!(
        end.is_multiple_of(largest),
        "padding at the end of {}",
        item.name
    );
    (end, largest)
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
fn close(text: &mut String, end: &str) {
    text.truncate(text.trim_end_matches(",\n").len());
    text.push('\n');
    text.push_str(end);
}

struct Page<'a> {
    names: Vec<&'a str>,
}

impl Page<'_> {
    fn structure(&self, text: &mut String, item: &Structure, scalar: Scalar) {
        let name = structure(&item.name, scalar);
        text.push('\n');
        self.comment(text, "", &item.about, scalar);
        writeln!(text, "typedef struct {name} {{").unwrap();
        for field in &item.fields {
            self.comment(text, "    ", &field.about, scalar);
            writeln!(text, "    {};", declared(&field.kind, &field.name, scalar)).unwrap();
        }
        writeln!(text, "}} {name};").unwrap();
    }

    fn function(
        &self,
        text: &mut String,
        function: &Function,
        scalar: Scalar,
        prefix: &str,
        suffix: &str,
    ) {
        text.push('\n');
        self.comment(text, "", &function.about, scalar);
        let result = declared(&function.result, "", scalar);
        let gap = if result.ends_with('*') { "" } else { " " };
        let arguments: Vec<String> = function
            .arguments
            .iter()
            .map(|argument| declared(&argument.kind, &argument.name, scalar))
            .collect();
        let start = format!("{result}{gap}{prefix}{}{suffix}(", function.name);
        let arguments = match arguments.len() {
            0 => "void".to_owned(),
            _ => arguments.join(", "),
        };
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
