#![allow(clippy::unwrap_used)]

use super::{Instruments, ObservationNoise, Plane, Point, PositionFrame};
use crate::calibration::Instrument;
use crate::robot::{ArmIndex, TransmissionTolerance};
use crate::samples::Noise;

/// With everything: after the robot's 24 parameters 15 numbers of the transmissions, 6 of the frame, 3 of each of
/// two planes, 4 of a point with an offset, 3 of one without.
fn instruments() -> Instruments<'static, f64> {
    Instruments {
        frame: PositionFrame::Sensor,
        planes: &[Plane {
            known: None,
            level: None,
        }; 2],
        points: &[
            Point {
                known: None,
                offset: true,
            },
            Point {
                known: None,
                offset: false,
            },
        ],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.05).unwrap(),
        transmission: Some(TransmissionTolerance::new(1e-3).unwrap()),
    }
}

#[test]
fn every_place_belongs_to_its_instrument() {
    let [first, second, third] = ArmIndex::ALL.map(Instrument::Transmission);
    let layout = [
        (24, None),
        (5, Some(first)),
        (5, Some(second)),
        (5, Some(third)),
        (6, Some(Instrument::Frame)),
        (3, Some(Instrument::Plane(0))),
        (3, Some(Instrument::Plane(1))),
        (4, Some(Instrument::Point(0))),
        (3, Some(Instrument::Point(1))),
        (5, None),
    ];
    let mut place = 0;
    for (count, expected) in layout {
        for _ in 0..count {
            assert_eq!(instruments().instrument_of(place), expected, "{place}");
            place += 1;
        }
    }
    assert_eq!(instruments().unknowns(), place - 24 - 5);

    // The frame's own, and exact joints: the planes come first.
    let few = Instruments {
        frame: PositionFrame::Base,
        transmission: None,
        ..instruments()
    };
    assert_eq!(few.instrument_of(23), None);
    assert_eq!(few.instrument_of(24), Some(Instrument::Plane(0)));
    assert_eq!(few.instrument_of(30), Some(Instrument::Point(0)));
}

#[test]
fn unknowns_are_put_where_they_belong() {
    let found: [f64; 60] = instruments().unknowns_at(
        &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        &[[7.0, 8.0, 9.0, 10.0], [11.0, 12.0, 13.0, 14.0]],
    );
    let mut expected = [0.0; 60];
    // A point without an offset has three numbers.
    for (place, value) in (45..58).zip(1..) {
        expected[place] = f64::from(value);
    }
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < f64::MIN_POSITIVE);
    }
}
