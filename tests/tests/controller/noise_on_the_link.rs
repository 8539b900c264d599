use crate::controller::driver::{Driver, Flash, begin, crc_32, message, read_answer, samples};
use delta_cal::ArmIndex;
use delta_cal_protocol::{
    Counters, Direction, Fault, ParameterSet, Reader, Request, Response, RevertTo,
    UNKNOWN_SEQUENCE, VERSION, Wire, Writer, encode,
};
use delta_cal_tests::generator;
use rand_core::Rng;

fn identify(sequence: u16) -> Vec<u8> {
    encode(Direction::Request, sequence, &Request::<f32>::Identify)
        .unwrap()
        .to_vec()
}

/// A frame around any content: what `encode` makes of it.
fn framed(sequence: u16, content: &[u8]) -> Vec<u8> {
    struct Raw<'a>(&'a [u8]);
    impl Wire for Raw<'_> {
        fn put(&self, to: &mut Writer<'_>) {
            to.bytes(self.0);
        }
        fn get(_: &mut Reader<'_>) -> Option<Self> {
            None
        }
    }
    encode(Direction::Request, sequence, &Raw(content))
        .unwrap()
        .to_vec()
}

#[test]
fn lost_and_repeated_sequence_numbers_are_counted() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    for (sequence, lost, repeated) in [
        // The first number is anybody's.
        (30, 0, 0),
        (31, 0, 0),
        (31, 0, 1),
        (31, 0, 2),
        (34, 2, 2),
        // A new driver begins anywhere.
        (1, 2, 2),
        (2, 2, 2),
        (40_000, 2, 2),
        // 0 is no number: 65535 is followed by 1.
        (65_534, 2, 2),
        (65_535, 2, 2),
        (1, 2, 2),
        (3, 3, 2),
    ] {
        let (answered, _) = driver.answer(&identify(sequence));
        assert_eq!(answered, sequence);
        driver.sequence = sequence;
        let reception = driver.controller_counters();
        assert_eq!(
            (reception.lost, reception.repeated),
            (lost, repeated),
            "{sequence}"
        );
    }
}

impl Driver<f32, Flash> {
    /// The counters without a trace: asked with the sequence number that is not counted.
    fn controller_counters(&mut self) -> Counters {
        let frame = encode(
            Direction::Request,
            UNKNOWN_SEQUENCE,
            &Request::<f32>::Counters,
        )
        .unwrap();
        match self.answer(&frame) {
            (UNKNOWN_SEQUENCE, Response::Counters(counters)) => counters,
            answer => panic!("{answer:?}"),
        }
    }
}

#[test]
fn every_kind_of_wrong_frame_is_answered_and_counted() {
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let damaged = (UNKNOWN_SEQUENCE, Response::<f32>::Fault(Fault::Damaged));

    let mut broken = identify(1);
    broken[2] ^= 0x40;
    assert_eq!(driver.answer(&broken), damaged);
    assert_eq!(driver.answer(&[0, 5, 0]), damaged);
    let too_long: Vec<u8> = [vec![0], vec![9; 2000], vec![0]].concat();
    assert_eq!(driver.answer(&too_long), damaged);
    // An echo is not answered: the answer would come back, too.
    let echo = encode(Direction::Response, 1, &Response::<f32>::Fault(Fault::Busy)).unwrap();
    assert!(driver.send(&echo).is_empty());
    assert_eq!(
        driver.controller_counters(),
        Counters {
            received: 1,
            damaged: 4,
            ..Counters::default()
        }
    );

    for content in [&[200][..], &[], &[0, 0]] {
        assert_eq!(
            driver.answer(&framed(7, content)),
            (7, Response::Fault(Fault::UnknownRequest))
        );
    }
    // The next protocol version, its checksum as it must be.
    let mut content = identify_content();
    content[0] = VERSION + 1;
    let newer = with_checksum(&content);
    assert_eq!(
        driver.answer(&newer),
        (
            9,
            Response::Fault(Fault::UnknownVersion { spoken: VERSION })
        )
    );
    let solve = Request::Solve {
        session: 1,
        samples: 0,
    };
    driver.sequence = 9;
    assert_eq!(driver.fault(&solve), Fault::NoSession);
    driver.controller.set_overrun(17);
    let counted = driver.controller_counters();
    assert_eq!(
        counted,
        Counters {
            received: 1 + 3 + 1 + 1 + 1,
            damaged: 4,
            unknown_version: 1,
            unknown_request: 3,
            repeated: 2,
            lost: counted.lost,
            refused: 1,
            overrun: 17,
        }
    );
}

/// `Identify` with sequence number 9, unstuffed.
fn identify_content() -> Vec<u8> {
    vec![VERSION, 9, 0, 0]
}

/// The checksum, then COBS: as the protocol's documentation says.
fn with_checksum(content: &[u8]) -> Vec<u8> {
    let content = [content, &crc_32(content).to_le_bytes()].concat();
    let mut frame = vec![0];
    for run in content.split(|byte| *byte == 0) {
        assert!(run.len() < 254);
        frame.push(u8::try_from(run.len()).unwrap() + 1);
        frame.extend(run);
    }
    frame.push(0);
    frame
}
