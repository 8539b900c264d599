//! The frames in `docs/protocol.md` are the frames of this crate, both ways, and none is missing.
//!
//! What the page describes is written down here a second time, from the page and without the crate's
//! functions: stuffing, checksum, varints, and the fields of every message in their order.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cases;
mod described;
mod observed;
mod parts;
mod pieces;
mod reasons;
mod requests;
mod responses;
mod streams;
mod values;
mod variants;

use crate::{Direction, Geometry, LARGEST_FRAME, Receiver, UNKNOWN_SEQUENCE, VERSION, encode};
use cases::{Case, SEQUENCE, cases};
use described::Message;
use parts::parts;
use pieces::{Bits, Piece, Pieces};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::borrow::ToOwned;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{Debug, Write};
use std::format;
use std::path::Path;
use std::string::String;
use std::vec::Vec;
use variants::variants;

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/protocol.md");
    std::fs::read_to_string(path).unwrap()
}

/// A vector as the page shows it: `name: bytes`, in as many lines as it takes, and below it, indented,
/// the bytes before stuffing with what they mean.
#[derive(Debug, Default, PartialEq, Eq)]
struct Vector {
    bytes: Vec<u8>,
    pieces: Vec<Piece>,
}

fn hex(text: &str) -> Option<Vec<u8>> {
    text.split(' ')
        .map(|byte| match byte.len() {
            2 => u8::from_str_radix(byte, 16).ok(),
            _ => None,
        })
        .collect()
}

fn vectors(page: &str) -> BTreeMap<String, Vector> {
    let mut vectors: BTreeMap<String, Vector> = BTreeMap::new();
    let mut inside = false;
    let mut last = None;
    for line in page.lines() {
        if line.starts_with("```") {
            inside = line == "```text";
            last = None;
        } else if !inside {
        } else if let Some(line) = line.strip_prefix("  ") {
            let Some(name) = &last else { continue };
            let vector = vectors.get_mut(name).unwrap();
            let (bytes, meaning) = line.split_once("  ").unwrap_or((line, ""));
            let bytes = hex(bytes).unwrap_or_else(|| panic!("{name}: no bytes: {line}"));
            if meaning.is_empty() {
                vector.pieces.last_mut().unwrap().bytes.extend(bytes);
            } else {
                let meaning = meaning.trim_start().to_owned();
                vector.pieces.push(Piece { bytes, meaning });
            }
        } else if let Some((name, bytes)) = line.split_once(": ")
            && let Some(bytes) = hex(bytes)
        {
            vectors
                .entry(name.to_owned())
                .or_default()
                .bytes
                .extend(bytes);
            last = Some(name.to_owned());
        }
    }
    vectors
}

/// As the page is to show it.
fn shown(name: &str, vector: &Vector) -> String {
    let text = |bytes: &[u8]| {
        let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        bytes.join(" ")
    };
    let mut shown = String::new();
    for bytes in vector.bytes.chunks(32) {
        writeln!(shown, "{name}: {}", text(bytes)).unwrap();
    }
    for piece in &vector.pieces {
        for (index, bytes) in piece.bytes.chunks(12).enumerate() {
            let meaning = if index == 0 { &*piece.meaning } else { "" };
            let line = format!("  {:35}  {meaning}", text(bytes));
            writeln!(shown, "{}", line.trim_end()).unwrap();
        }
    }
    shown
}

/// COBS as the page describes it; without the delimiters.
fn unstuffed(stuffed: &[u8]) -> Vec<u8> {
    let mut content = Vec::new();
    let mut at = 0;
    while at < stuffed.len() {
        let code = usize::from(stuffed[at]);
        assert!(code > 0 && at + code <= stuffed.len(), "stuffed wrongly");
        content.extend(&stuffed[at + 1..at + code]);
        at += code;
        if code < 0xff && at < stuffed.len() {
            content.push(0);
        }
    }
    content
}

/// CRC-32 as the page describes it.
fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = 0xffff_ffff;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 {
                crc >> 1 ^ 0xedb8_8320
            } else {
                crc >> 1
            };
        }
    }
    !crc
}

/// The content of a frame, checksum taken off, and the checksum.
fn opened(frame: &[u8]) -> (Vec<u8>, u32) {
    let [0, stuffed @ .., 0] = frame else {
        panic!("no delimiters")
    };
    assert!(!stuffed.contains(&0), "a zero inside of a frame");
    let mut content = unstuffed(stuffed);
    let sent = content.split_off(content.len() - 4);
    (content, u32::from_le_bytes(sent.try_into().unwrap()))
}

/// The frame that the crate makes, checked in every way that needs no page, and the same from the
/// page's description.
fn vector<T>(case: &Case<T>) -> Vector
where
    T: Bits + Serialize + DeserializeOwned + PartialEq + Debug,
{
    let name = case.name;
    let sequence = case.sequence();
    let (bytes, direction) = match &case.message {
        Message::Request(request) => (
            encode(Direction::Request, sequence, request).unwrap(),
            Direction::Request,
        ),
        Message::Response(response) => (
            encode(Direction::Response, sequence, response).unwrap(),
            Direction::Response,
        ),
    };

    let mut receiver = Receiver::<LARGEST_FRAME>::new(direction);
    let mut received = 0;
    for byte in &bytes {
        let Some(frame) = receiver.push(*byte) else {
            continue;
        };
        let frame = frame.unwrap();
        received += 1;
        assert_eq!(frame.sequence, sequence, "{name}");
        match &case.message {
            Message::Request(request) => assert_eq!(frame.message().as_ref(), Some(request)),
            Message::Response(response) => assert_eq!(frame.message().as_ref(), Some(response)),
        }
    }
    assert_eq!(received, 1, "{name}");

    let mut pieces = Pieces::default();
    pieces.message(sequence, &case.message);
    let (content, sent) = opened(&bytes);
    assert_eq!(pieces.bytes(), content, "{name}: not as described");
    assert_eq!(checksum(&content), sent, "{name}");
    pieces.add(&sent.to_le_bytes(), "CRC-32");
    Vector {
        bytes: bytes.to_vec(),
        pieces: pieces.pieces,
    }
}

/// Every vector that the page is to show.
fn expected() -> BTreeMap<String, Vector> {
    let mut expected = BTreeMap::new();
    for (single, double) in cases::<f32>().iter().zip(&cases::<f64>()) {
        let name = single.name;
        let (of_single, of_double) = (vector(single), vector(double));
        if of_single == of_double {
            expected.insert(name.to_owned(), of_single);
        } else {
            expected.insert(format!("{name}-f32"), of_single);
            expected.insert(format!("{name}-f64"), of_double);
        }
    }
    for (name, pieces) in parts() {
        let bytes = pieces.bytes();
        let pieces = pieces.pieces;
        expected.insert(name.to_owned(), Vector { bytes, pieces });
    }
    expected
}

#[test]
fn every_vector_of_the_page_is_what_the_crate_sends_and_reads() {
    let mut there = vectors(&page());
    let mut wrong = String::new();
    for (name, expected) in expected() {
        match there.remove(&name) {
            Some(vector) if vector == expected => {}
            // The same fields as in `f32`, annotated there.
            Some(vector)
                if name.ends_with("-f64")
                    && vector.pieces.is_empty()
                    && vector.bytes == expected.bytes => {}
            _ => writeln!(wrong, "{}", shown(&name, &expected)).unwrap(),
        }
    }
    assert!(
        wrong.is_empty(),
        "docs/protocol.md does not state these:\n{wrong}"
    );
    assert!(there.is_empty(), "no message has these vectors: {there:?}");
}

/// Enums whose variants have no fields.
const NUMBERS: [&str; 8] = [
    "Scalar",
    "Origin",
    "ArmIndex",
    "Parameter",
    "Termination",
    "StartUsed",
    "Estimator",
    "Untested",
];

#[test]
fn every_variant_has_a_vector_and_its_number_on_the_page() {
    let mut written = BTreeSet::new();
    for case in cases::<f32>() {
        let mut pieces = Pieces::default();
        pieces.message(SEQUENCE, &case.message);
        written.append(&mut pieces.variants);
    }
    for (_, mut pieces) in parts() {
        written.append(&mut pieces.variants);
    }
    let page = page();
    for (name, all) in variants() {
        for (number, variant) in all.iter().enumerate() {
            // Without fields there is nothing to show but the number.
            assert!(
                NUMBERS.contains(&name) || written.contains(&(name, number, *variant)),
                "{name}::{variant} has no vector"
            );
        }
        let table = format!("| number | `{name}` |");
        let (_, table) = page
            .split_once(&table)
            .unwrap_or_else(|| panic!("no table of {name}"));
        let rows: Vec<&str> = table
            .lines()
            .skip(2)
            .take_while(|line| line.starts_with('|'))
            .collect();
        assert_eq!(rows.len(), all.len(), "{name}");
        for ((number, variant), row) in all.iter().enumerate().zip(rows) {
            let start = format!("| {number} | `{variant}` |");
            assert!(row.starts_with(&start), "{name}: {row}, and not {start}");
        }
    }
}

#[test]
fn the_page_states_the_limits() {
    let vectors = expected();
    let longest = |name: &str, longer: usize| {
        let pieces = vectors[name].pieces.iter();
        let content = pieces.map(|piece| piece.bytes.len()).sum::<usize>() + longer;
        content + content.div_ceil(254) + 2
    };
    let page = page();
    for row in [
        format!("| version | {VERSION} |"),
        format!("| sequence number of no request | {UNKNOWN_SEQUENCE} |"),
        format!("| largest frame, delimiters included | {LARGEST_FRAME} bytes |"),
        format!(
            "| largest frame that `f64` needs | {} bytes |",
            longest("outcome-f64", LONGER_OUTCOME)
        ),
        format!("| largest request | {} bytes |", largest_request()),
    ] {
        assert!(page.contains(&row), "docs/protocol.md does not state {row}");
    }
}

/// A geometry with transmissions, or the beginning of observations with everything known of every plane and point: no other
/// request is as long.
fn largest_request() -> usize {
    let mut begin = requests::begin_observations::<f64>();
    begin.session = u32::MAX;
    begin.planes = [begin.planes[0]; 4];
    begin.points = [begin.points[0]; 4];
    let longest = |message| {
        let mut pieces = Pieces::default();
        pieces.message(SEQUENCE, &Message::Request(message));
        let content = pieces.bytes().len() + 4;
        content + content.div_ceil(254) + 2
    };
    let adopt = crate::Adopt {
        from: u32::MAX,
        geometry: values::geometry(true),
    };
    longest(crate::Request::BeginObservations(begin)).max(longest(crate::Request::Adopt(adopt)))
}

/// Bytes by which the longest outcome is longer than the vector's: samples in 64 bits, iterations in 16, a transmission.
const LONGER_OUTCOME: usize = 9 + 2 + 40;
#[test]
fn the_checksum_is_the_one_that_the_page_names() {
    let row = format!(
        "| of the nine characters `123456789` | `{:08x}` |",
        checksum(b"123456789")
    );
    assert!(
        page().contains(&row),
        "docs/protocol.md does not state {row}"
    );
}

#[test]
fn the_fingerprint_is_computed_as_described() {
    let page = page();
    for (vector, with_transmissions) in [("parameters", false), ("parameters-transmissions", true)]
    {
        let single = values::geometry::<f32>(with_transmissions);
        let double = values::geometry::<f64>(with_transmissions);
        let rounded: Geometry<f64> = Geometry {
            arms: single.arms.map(|arm| arm.map(f64::from)),
            transmissions: single
                .transmissions
                .map(|all| all.map(|own| own.map(f64::from))),
        };
        for (name, numbers, computed) in [
            ("f32", rounded, single.fingerprint()),
            ("f64", double, double.fingerprint()),
        ] {
            let transmissions = numbers.transmissions.iter().flatten().flatten();
            let values = numbers.arms.iter().flatten().chain(transmissions);
            let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
            assert_eq!(checksum(&bytes), computed, "{vector} {name}");
            let row = format!("| `{vector}-{name}` | `{computed:08x}` |");
            assert!(page.contains(&row), "docs/protocol.md does not state {row}");
        }
    }
}

/// Contents of every length about one block and about two, with a zero anywhere or nowhere: a block of 254 bytes at
/// the very end is among them.
#[test]
fn frames_of_every_length_end_with_a_delimiter_and_are_received() {
    let mut full_at_the_end = 0;
    for length in (230..270).chain(480..530) {
        for round in 0..40_u8 {
            let mut message: Vec<u8> = (0..length)
                .map(|place: u32| u8::try_from(place % 251 + 1).unwrap())
                .collect();
            message[0] = round + 1;
            if round >= 20 {
                message[usize::from(round) * 5] = 0;
            }
            // As postcard writes an array: no length before it.
            let frame = encode(Direction::Request, SEQUENCE, &Array(&message)).unwrap();
            let (content, sent) = opened(&frame);
            assert_eq!(checksum(&content), sent);
            assert_eq!(content[3..], message);
            let stuffed = content.len() + 4;
            let blocks = frame.len() - 2 - stuffed;
            full_at_the_end += usize::from(stuffed.is_multiple_of(254) && blocks == stuffed / 254);
            let mut receiver = Receiver::<LARGEST_FRAME>::new(Direction::Request);
            let whole = frame
                .iter()
                .filter(|byte| receiver.push(**byte).is_some_and(|frame| frame.is_ok()));
            assert_eq!(whole.count(), 1, "{length} bytes");
        }
    }
    assert!(full_at_the_end > 10, "{full_at_the_end}");
}

struct Array<'a>(&'a [u8]);

impl Serialize for Array<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}
