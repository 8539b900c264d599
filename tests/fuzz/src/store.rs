//! The controller's store: whatever the flash contains, a start finds a valid robot and the next calibration is kept.

use crate::controller::Bench;
use crate::numbers::{Bits, Source, finite_robot};
use crc::{CRC_32_ISO_HDLC, Crc};
use delta_cal_controller::{PAGE, ParameterFlash};
use delta_cal_firmware_example::nominal;
use delta_cal_protocol::{
    Geometry, Origin, ParameterSet, Request, Response, RevertTo, SampleMessage, Wire, Writer,
};

in_either_precision!(store, starts);

fn starts<T: Bits>(source: &mut Source<'_>) {
    let mut flash = ParameterFlash::new();
    while !source.is_empty() && source.byte() < 0xf0 {
        change::<T>(&mut flash, source);
    }
    let mut bench = Bench::<T>::start(flash.clone());
    let found = bench.controller.current();
    finite_robot(&found.robot);
    assert_eq!(Bench::<T>::start(flash).controller.current(), found);
    let nominal = drawn::<T>().fingerprint();
    if let Response::Parameters(parameters) = bench.ask(&Request::Parameters(ParameterSet::Current))
    {
        let as_drawn = matches!(
            parameters.origin,
            Origin::Nominal | Origin::NominalStoreDamaged
        );
        assert!(!as_drawn || found.fingerprint == nominal);
        assert_eq!(parameters.geometry, Geometry::of(&found.robot));
    }

    let samples: Vec<_> = source.samples::<T>(14).iter().map(message).collect();
    if bench.calibrated(&samples) {
        let applied = bench.controller.current();
        bench = restarted(bench);
        let after = bench.controller.current();
        assert_eq!(
            after, applied,
            "what was stored is not what a restart finds"
        );
    }
    let before = bench.controller.current();
    let to = [RevertTo::Previous, RevertTo::Nominal][source.below(2)];
    let from = bench.generation();
    let answer = bench.ask(&Request::Revert { from, to });
    let wanted = bench.controller.current();
    if matches!(answer, Response::Fault(_)) {
        assert_eq!(wanted, before);
    }
    bench = restarted(bench);
    assert_eq!(bench.controller.current(), wanted, "{to:?}: {answer:?}");
}

fn restarted<T: Bits>(bench: Bench<T>) -> Bench<T> {
    Bench::start_with(bench.controller.into_flash())
}

fn drawn<T: Bits>() -> Geometry<T> {
    Geometry::of(&nominal().expect("the robot as drawn is a robot"))
}

fn message<T: Bits>(sample: &delta_cal::Sample<T>) -> SampleMessage<T> {
    SampleMessage {
        session: 0,
        index: 0,
        joints: sample.joints,
        position: sample.position.into(),
    }
}

/// Changes part of the flash.
fn change<T: Bits>(flash: &mut ParameterFlash, source: &mut Source<'_>) {
    let place = usize::from(source.word()) % (2 * PAGE);
    match source.byte() % 8 {
        0 | 1 => {
            let content = source.bytes();
            for (byte, new) in flash.bytes[place..].iter_mut().zip(content) {
                *byte = *new;
            }
        }
        2 => {
            let (count, value) = (usize::from(source.word()), source.byte());
            for byte in flash.bytes[place..].iter_mut().take(count) {
                *byte = value;
            }
        }
        3 => flash.bytes[place] ^= source.byte(),
        4 => {
            // Changes made by the controller itself.
            let mut bench = Bench::<T>::start(flash.clone());
            let samples: Vec<_> = source.samples::<T>(14).iter().map(message).collect();
            bench.calibrated(&samples);
            *flash = bench.controller.into_flash().0;
        }
        _ => write::<T>(flash, source),
    }
}

/// A record with arbitrary generation and numbers and a valid checksum: mark, generation, length and content.
fn record<T: Bits>(source: &mut Source<'_>) -> Vec<u8> {
    let drawn = drawn::<T>();
    let kind = source.byte();
    let mut set = |bit: u8| {
        (kind & bit != 0).then(|| Geometry {
            arms: source.geometry::<T>().unwrap_or(drawn.arms),
            transmissions: (kind & 8 != 0)
                .then(|| [[(); 5]; 3].map(|own| own.map(|()| source.number(0.0, 1e-3)))),
        })
    };
    let mut content = vec![0; 2 * PAGE];
    let mut writer = Writer::new(&mut content);
    (set(1), set(2)).put(&mut writer);
    let length = writer.finish().unwrap_or_default();
    content.truncate(length);
    let version = 5 + u8::from(kind & 0xf0 == 0xf0);
    let number = if size_of::<T>() == 4 { 4 } else { 8 };
    let nominal = drawn
        .fingerprint()
        .wrapping_add(u32::from(kind & 0xf0 == 0xe0));
    let mark = nominal.rotate_left(8) ^ u32::from_le_bytes([b'd', version, number, b'c']);
    let generation = if kind & 4 == 0 {
        u32::from(source.byte())
    } else {
        source.wide()
    };
    let length = u32::try_from(content.len()).unwrap_or_default();
    let mut bytes = Vec::new();
    for word in [mark, generation, length] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(content);
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// Writes a record where the firmware would, in either half.
fn write<T: Bits>(flash: &mut ParameterFlash, source: &mut Source<'_>) {
    let start = usize::from(source.byte() & 1) * PAGE;
    let half = &mut flash.bytes[start..start + PAGE];
    let record = record::<T>(source);
    half.fill(0xff);
    half[..record.len()].copy_from_slice(&record);
}
