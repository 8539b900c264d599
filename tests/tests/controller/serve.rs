//! The controller behind a link of the ecosystem's traits.

use crate::controller::driver::{Driver, Flash, begin, message, read_answer, samples};
use core::convert::Infallible;
use delta_cal_protocol::{Direction, Phase, Request, Response, Status, encode};
use embedded_io_async::{ErrorType, Read, ReadReady, Write};
use std::collections::VecDeque;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// Delivers requests, one after the other answer, a few bytes at a time and not always.
struct Link {
    requests: VecDeque<Vec<u8>>,
    bytes: VecDeque<u8>,
    looks: u32,
    answers: Vec<Vec<u8>>,
}

impl ErrorType for Link {
    type Error = Infallible;
}

impl ReadReady for Link {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.looks += 1;
        // Between two bytes now and then nothing comes; at the end the link ends.
        Ok(self.looks.is_multiple_of(3) || (self.bytes.is_empty() && self.requests.is_empty()))
    }
}

impl Read for Link {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if self.bytes.is_empty() {
            self.bytes
                .extend(self.requests.pop_front().unwrap_or_default());
        }
        let count = buffer.len().min(self.bytes.len()).min(7);
        for (place, byte) in buffer.iter_mut().zip(self.bytes.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}

impl Write for Link {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.answers.push(bytes.to_vec());
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A session over the link ends with the result of the same session byte by byte.
#[test]
fn a_link_of_the_ecosystems_traits_is_served_to_its_end() {
    let samples = samples::<f32>(4, 20);
    let mut expected = Driver::<f32, _>::start(Flash::new());
    let Phase::Solved { fingerprint, .. } = expected.calibrate(1, &samples) else {
        panic!("not solved")
    };

    let mut requests = vec![Request::Begin(begin(1))];
    requests.extend(
        (0..)
            .zip(&samples)
            .map(|(index, sample)| message(1, index, sample)),
    );
    requests.push(Request::Solve {
        session: 1,
        samples: 20,
    });
    // Looks at the status while it solves.
    requests.resize(requests.len() + 40, Request::Status);
    let count = requests.len();
    let frames = (1..).zip(&requests);
    let frames = frames.map(|(sequence, request)| {
        encode(Direction::Request, sequence, request)
            .unwrap()
            .to_vec()
    });
    let mut link = Link {
        requests: frames.collect(),
        bytes: VecDeque::new(),
        looks: 0,
        answers: Vec::new(),
    };
    let mut driver = Driver::<f32, _>::start(Flash::new());
    let mut between = 0_u32;
    {
        let mut served = pin!(driver.controller.serve(&mut link, |_| between += 1));
        let mut context = Context::from_waker(Waker::noop());
        let mut polls = 0;
        while served.as_mut().poll(&mut context) != Poll::Ready(Ok(())) {
            polls += 1;
            assert!(polls < 100_000, "it does not end");
        }
        // It lets other tasks run while it has nothing to read.
        assert!(polls > 100);
    }
    assert!(between > 1000);
    assert_eq!(link.answers.len(), count);
    let (_, last) = read_answer::<f32>(link.answers.last().unwrap());
    let Response::Status(Status { phase, .. }) = last else {
        panic!("{last:?}")
    };
    assert_eq!(
        phase,
        Phase::Solved {
            samples: 20,
            fingerprint
        }
    );
}
