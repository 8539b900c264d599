//! Bytes with what they mean: varints, numbers as their bits, options.

use delta_cal::Real;
use std::borrow::ToOwned;
use std::collections::BTreeSet;
use std::format;
use std::string::String;
use std::vec::Vec;

/// Bytes and what they mean.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) bytes: Vec<u8>,
    pub(super) meaning: String,
}

/// A number as its bits.
pub(super) trait Bits: Real {
    fn bits(self) -> Vec<u8>;
}

impl Bits for f32 {
    fn bits(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

impl Bits for f64 {
    fn bits(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

/// Seven bits a byte, the lowest first; the highest bit says that more follow.
fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    loop {
        let [low, ..] = value.to_le_bytes();
        value >>= 7;
        if value == 0 {
            bytes.push(low & 0x7f);
            return bytes;
        }
        bytes.push(low | 0x80);
    }
}

#[derive(Debug, Default)]
pub(super) struct Pieces {
    pub(super) pieces: Vec<Piece>,
    /// The variants in it: enum, number, name.
    pub(super) variants: BTreeSet<(&'static str, usize, &'static str)>,
}

impl Pieces {
    pub(super) fn bytes(&self) -> Vec<u8> {
        let bytes = self.pieces.iter().map(|piece| &*piece.bytes);
        bytes.collect::<Vec<_>>().concat()
    }

    pub(super) fn add(&mut self, bytes: &[u8], meaning: &str) {
        self.pieces.push(Piece {
            bytes: bytes.to_vec(),
            meaning: meaning.to_owned(),
        });
    }

    pub(super) fn varint(&mut self, name: &str, value: impl Into<u64>) {
        let value = value.into();
        self.add(&varint(value), &format!("{name} = {value}"));
    }

    /// A varint that is read in hexadecimal: a checksum, or a register.
    pub(super) fn hexadecimal(&mut self, name: &str, value: u32) {
        self.add(&varint(value.into()), &format!("{name} = 0x{value:08x}"));
    }

    pub(super) fn variant(&mut self, of: &'static str, number: usize, name: &'static str) {
        self.variants.insert((of, number, name));
        self.add(&varint(number as u64), &format!("{of}: {name}"));
    }

    pub(super) fn number<T: Bits>(&mut self, name: &str, value: T) {
        self.add(&value.bits(), &format!("{name} = {}", value.to_f64()));
    }

    pub(super) fn numbers<T: Bits>(&mut self, name: &str, values: &[T]) {
        let bytes: Vec<Vec<u8>> = values.iter().map(|value| value.bits()).collect();
        let values: Vec<String> = values
            .iter()
            .map(|value| format!("{}", value.to_f64()))
            .collect();
        let meaning = format!("{name} = {}", values.join(", "));
        self.add(&bytes.concat(), &meaning);
    }

    pub(super) fn option(&mut self, name: &str, there: bool) {
        let text = if there { "follows" } else { "none" };
        self.add(&[there.into()], &format!("{name}: {text}"));
    }

    pub(super) fn pair<T: Bits>(&mut self, name: &str, pair: Option<(T, T)>) {
        self.option(name, pair.is_some());
        if let Some((length, angle)) = pair {
            self.numbers(name, &[length, angle]);
        }
    }
}
