//! A program for a Raspberry Pi Pico 2 as the file that its boot loader takes.

use std::collections::BTreeMap;
use std::fs;

/// <https://github.com/microsoft/uf2>; a block of 512 bytes carries 256.
const MAGIC: [u32; 2] = [0x0A32_4655, 0x9E5D_5157];
const MAGIC_END: u32 = 0x0AB1_6F30;
const FAMILY_PRESENT: u32 = 0x2000;
/// RP2350, Arm, secure: its data sheet, "UF2 targeting rules".
const FAMILY: u32 = 0xE48B_FF59;
const PAGE: usize = 256;

/// Reads an ELF file and writes its blocks.
///
/// # Errors
/// What could not be read or written.
pub(crate) fn write(program: &str, into: &str) -> Result<(), String> {
    let elf = fs::read(program).map_err(|error| format!("{program}: {error}"))?;
    let blocks = from_elf(&elf).ok_or(format!("{program} is not a program for a 32-bit Arm"))?;
    fs::write(into, blocks).map_err(|error| format!("{into}: {error}"))
}

/// The blocks of a 32-bit little-endian ELF program's loadable segments.
fn from_elf(elf: &[u8]) -> Option<Vec<u8>> {
    let half = |at: usize| Some(u16::from_le_bytes(*elf.get(at..)?.first_chunk()?));
    let word = |at: usize| Some(u32::from_le_bytes(*elf.get(at..)?.first_chunk()?));
    if elf.get(..6)? != b"\x7fELF\x01\x01" {
        return None;
    }
    let (table, size, count) = (word(28)?, half(42)?, half(44)?);
    let mut pages = BTreeMap::<u32, [u8; PAGE]>::new();
    for header in (0..count).map(|it| table as usize + usize::from(it) * usize::from(size)) {
        let [kind, offset, _, address, length] = [0, 4, 8, 12, 16].map(|at| word(header + at));
        let (offset, length) = (offset? as usize, length? as usize);
        if kind? != 1 {
            continue;
        }
        for (at, byte) in (address?..).zip(elf.get(offset..offset + length)?) {
            let page = pages.entry(at - at % 256).or_insert([0; PAGE]);
            page[at as usize % PAGE] = *byte;
        }
    }
    let total = u32::try_from(pages.len()).ok()?;
    let mut blocks = Vec::new();
    for (number, (address, page)) in (0..).zip(&pages) {
        let head = [
            MAGIC[0],
            MAGIC[1],
            FAMILY_PRESENT,
            *address,
            256,
            number,
            total,
            FAMILY,
        ];
        blocks.extend(head.iter().flat_map(|it| it.to_le_bytes()));
        blocks.extend(page);
        blocks.extend([0; 476 - PAGE]);
        blocks.extend(MAGIC_END.to_le_bytes());
    }
    Some(blocks)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::from_elf;

    /// A program of two segments, the second in RAM but stored right after the first; and one that is not loaded.
    #[test]
    fn blocks_hold_what_is_stored_in_flash() {
        let mut elf = b"\x7fELF\x01\x01".to_vec();
        elf.resize(52, 0);
        elf[28] = 52;
        elf[42] = 32;
        elf[44] = 3;
        for [kind, offset, place, address, length] in [
            [1, 148, 0x1000_0000, 0x1000_0000, 300],
            [1, 448, 0x2000_0000, 0x1000_012C, 4],
            [4, 0, 0, 0, 148],
        ] {
            let header = [kind, offset, place, address, length, length, 0, 0_u32];
            elf.extend(header.iter().flat_map(|it| it.to_le_bytes()));
        }
        elf.extend([0xAA; 300]);
        elf.extend([0xBB; 4]);
        let blocks = from_elf(&elf).unwrap();
        assert_eq!(blocks.len(), 2 * 512);
        let word = |at: usize| u32::from_le_bytes(blocks[at..at + 4].try_into().unwrap());
        let head: Vec<u32> = (0..8).map(|it| word(512 + 4 * it)).collect();
        let expected = [
            0x0A32_4655,
            0x9E5D_5157,
            0x2000,
            0x1000_0100,
            256,
            1,
            2,
            0xE48B_FF59,
        ];
        assert_eq!(head, expected);
        assert_eq!(word(1020), 0x0AB1_6F30);
        assert_eq!(blocks[32..32 + 256], [0xAA; 256]);
        assert_eq!(blocks[544..544 + 44], [0xAA; 44]);
        assert_eq!(blocks[588..592], [0xBB; 4]);
        assert_eq!(blocks[592..1020], [0; 428]);
        assert!(from_elf(b"\x7fELF\x02\x01").is_none());
    }
}
