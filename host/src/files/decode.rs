//! From the bytes of a text file to text: UTF-8, UTF-16, or one byte a letter.

/// Why bytes are no text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum NotText {
    /// A control character, as programs and images have them.
    Control,
    /// It looks like UTF-16, and this line has half a character.
    DamagedUtf16(u64),
}

/// Windows-1252 from 0x80 to 0x9F, what it lacks as in Latin-1; both agree on all other letters.
const WINDOWS: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}',
    '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

const ENCODED: [&[u8]; 3] = [b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff"];

/// The text, without byte order mark. What is no UTF-8 and no UTF-16 has one byte a letter: numbers
/// and units are the same in all such encodings, and letters are taken for those of Windows-1252.
pub(super) fn decode(mut bytes: Vec<u8>) -> Result<String, NotText> {
    if let Some(unit) = unit_of_utf16(&bytes) {
        return utf16(&bytes, unit);
    }
    bytes.drain(..bytes.len() - without_mark(&bytes).len());
    if bytes.iter().copied().any(|byte| is_control(byte.into())) {
        return Err(NotText::Control);
    }
    Ok(String::from_utf8(bytes).unwrap_or_else(|error| letters(error.as_bytes())))
}

/// One byte a letter.
pub(super) fn letters(bytes: &[u8]) -> String {
    let letter = |byte: &u8| match byte {
        0x80..=0x9f => WINDOWS[usize::from(byte - 0x80)],
        byte => char::from(*byte),
    };
    bytes.iter().map(letter).collect()
}

/// Without the byte order mark of UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    let [utf8, ..] = ENCODED;
    bytes.strip_prefix(utf8).unwrap_or(bytes)
}

/// Whether a text that begins with these bytes has two bytes a letter.
pub(super) fn is_utf16(start: &[u8]) -> bool {
    unit_of_utf16(start).is_some()
}

/// How two bytes make a unit of UTF-16, if the text is in it.
fn unit_of_utf16(start: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    let [_, little, big] = ENCODED.map(|mark| start.starts_with(mark));
    match start {
        _ if little => Some(u16::from_le_bytes),
        _ if big => Some(u16::from_be_bytes),
        [first, 0, ..] if *first != 0 => Some(u16::from_le_bytes),
        [0, second, ..] if *second != 0 => Some(u16::from_be_bytes),
        _ => None,
    }
}

/// Whether a file that begins with these bytes is certainly no text, whatever follows.
pub(super) fn is_no_text(start: &[u8]) -> bool {
    let start = &start[..start.len() & !1];
    matches!(decode(start.to_vec()), Err(NotText::Control))
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String, NotText> {
    let (pairs, rest) = bytes.as_chunks();
    let units = pairs.iter().map(|pair| unit(*pair));
    let mut text = String::with_capacity(bytes.len() / 2);
    let mut lines = 1;
    for decoded in char::decode_utf16(units) {
        match decoded {
            Ok('\u{feff}') if text.is_empty() => {}
            Ok(letter) if is_control(letter) => return Err(NotText::Control),
            Ok(letter) => {
                lines += u64::from(letter == '\n');
                text.push(letter);
            }
            Err(_) => return Err(NotText::DamagedUtf16(lines)),
        }
    }
    if rest.is_empty() {
        Ok(text)
    } else {
        Err(NotText::DamagedUtf16(lines))
    }
}

/// Characters that no text has, other than the ends of lines and pages and tabs.
pub(super) fn is_control(letter: char) -> bool {
    letter < ' ' && !matches!(letter, '\t' | '\n' | '\r' | '\u{c}')
}

#[cfg(test)]
mod tests {
    use super::{NotText, decode};

    #[test]
    fn the_same_text_in_every_encoding() {
        let text = "q1 [°],ä\n1,2\n";
        let utf16: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = utf16.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = utf16.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            b"q1 [\xb0],\xe4\n1,2\n".to_vec(),
            [b"\xff\xfe", &little[..]].concat(),
            [b"\xfe\xff", &big[..]].concat(),
            little.clone(),
            big,
        ] {
            assert_eq!(decode(bytes.clone()).as_deref(), Ok(text), "{bytes:x?}");
        }
        assert_eq!(
            decode(b"\x93a\x94 5 \x80".to_vec()).as_deref(),
            Ok("“a” 5 €")
        );
        assert_eq!(decode(Vec::new()).as_deref(), Ok(""));
        // Cut in the middle of the end of line 2, and of a letter of two units in line 2.
        let cut = little[..little.len() - 1].to_vec();
        assert_eq!(decode(cut), Err(NotText::DamagedUtf16(2)));
        let half = b"\xff\xfea\0\n\0\x00\xd8b\0".to_vec();
        assert_eq!(decode(half), Err(NotText::DamagedUtf16(2)));
        for bytes in [&b"\0\0"[..], b"a\0\0\0", b"ab\0", b"\x89PNG\x1a", b"\0"] {
            assert_eq!(decode(bytes.to_vec()), Err(NotText::Control), "{bytes:x?}");
        }
    }
}
