//! Records that the flash delivers whole, and that are not this robot's parameters.

use crate::controller::driver::{Driver, Flash, crc_32, samples};
use delta_cal_protocol::{Origin, Parameters};

/// The stored f32 parameters: behind mark, generation, length and the mark that there are any. They are the last 96 bytes but for "no
/// transmissions", "no previous ones" and the checksum.
const NUMBERS: usize = 96;

/// A record as the controller stored it first: at the beginning of the flash, up to its checksum.
fn record() -> Vec<u8> {
    let mut flash = Flash::new();
    let mut driver = Driver::<f32, _>::start(&mut flash);
    let fingerprint = driver.solved(1, &samples(1, 12));
    driver.apply(1, fingerprint);
    let bytes = flash.bytes();
    let length = (NUMBERS..bytes.len())
        .find(|length| bytes[*length..].starts_with(&crc_32(&bytes[..*length]).to_le_bytes()))
        .expect("a checksum");
    bytes[..length + 4].to_vec()
}

/// What a controller makes of it.
fn started_with(record: &[u8]) -> Parameters<f32> {
    Driver::<f32, _>::start(flash_with(record)).parameters()
}

/// It alone, in the lower half.
fn flash_with(record: &[u8]) -> Flash {
    let mut flash = Flash::new();
    flash.bytes_mut()[..record.len()].copy_from_slice(record);
    flash
}

/// The record changed, with the checksum that goes with it.
fn signed(record: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let (content, _) = record.split_last_chunk::<4>().expect("a checksum");
    let mut content = content.to_vec();
    change(&mut content);
    let checksum = crc_32(&content);
    content.extend(checksum.to_le_bytes());
    content
}

#[test]
fn another_version_or_impossible_parameters_are_not_taken() {
    let record = record();
    let first = record.len() - 4 - 2 - NUMBERS;
    let number = |place: usize| first + 4 * place..first + 4 * place + 4;
    let lb = f32::from_le_bytes(record[number(7)].try_into().unwrap());
    assert!((479.0..481.0).contains(&lb), "not where Lb is: {lb}");

    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let parameters = started_with(&signed(&record, |content| change(content)));
        assert_eq!(parameters.origin, Origin::NominalStoreDamaged);
        assert_eq!(parameters.geometry.arms[0][7].to_bits(), 480_f32.to_bits());
    };
    // Each byte of the mark: version, size of a number and robot. Another length; more bytes than there should be.
    for place in 0..4 {
        refused(&|content| content[place] ^= 1);
    }
    refused(&|content| content[8] ^= 1);
    refused(&|content| content[9] ^= 0xff);
    refused(&|content| content.push(0));
    for (place, value) in [
        (7, -480.0),
        (7, 0.0),
        (0, f32::NAN),
        (12, 2.0),
        (8, f32::INFINITY),
    ] {
        refused(&|content| content[number(place)].copy_from_slice(&value.to_le_bytes()));
    }
    // And the test itself changes what it means to.
    let longer = signed(&record, |content| {
        content[number(7)].copy_from_slice(&481.5_f32.to_le_bytes());
    });
    let parameters = started_with(&longer);
    assert_eq!(parameters.origin, Origin::Calibration);
    assert_eq!(
        parameters.geometry.arms[0][7].to_bits(),
        481.5_f32.to_bits()
    );
}

/// The fuzz target `store` asserts it too. The generation behind the highest is 0.
#[test]
fn what_is_stored_after_the_highest_generation_is_the_newest() {
    let record = record();
    // The generation stands behind the mark.
    let highest = signed(&record, |content| content[4..8].fill(0xff));
    let mut flash = flash_with(&highest);
    let mut stored = Vec::new();
    for robot in [2, 3] {
        let mut driver = Driver::<f32, _>::start(&mut flash);
        assert_eq!(driver.parameters().origin, Origin::Calibration);
        let fingerprint = driver.solved(1, &samples(robot, 12));
        driver.apply(1, fingerprint);
        stored.push(fingerprint);
        let driver = Driver::<f32, _>::start(&mut flash);
        assert_eq!(driver.controller.current().fingerprint, fingerprint);
    }
    assert_ne!(stored[0], stored[1]);
}
