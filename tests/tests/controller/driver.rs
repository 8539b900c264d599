//! The other end of the link.

use delta_cal::stream::Estimator;
use delta_cal::{Calibrator, Noise, Robot, Sample, Settings, Tolerance};
use delta_cal_firmware_example::{Controller, NewParameters, Number, StreamFlash, nominal};
use delta_cal_protocol::{
    Begin, Direction, Fault, Geometry, LARGEST_FRAME, ParameterSet, Parameters, Phase, Receiver,
    Request, Response, RevertTo, SampleMessage, Status, encode,
};
use delta_cal_tests::{Spread, generator, measurements, paper_robot, perturbed};
use embedded_storage::nor_flash::NorFlash;

pub(crate) use delta_cal_firmware_example::ParameterFlash as Flash;

/// A controller and the sequence numbers of whoever talks to it.
pub(crate) struct Driver<T: Number, F, S = StreamFlash> {
    pub(crate) controller: Controller<T, F, S>,
    pub(crate) sequence: u16,
}

impl<T: Number, F: NorFlash> Driver<T, F> {
    /// With no samples stored.
    pub(crate) fn start(flash: F) -> Self {
        Self::start_with(flash, StreamFlash::new())
    }

    /// The flash of the parameters.
    pub(crate) fn into_flash(self) -> F {
        self.controller.into_flash().0
    }
}

impl<T: Number, F: NorFlash, S: NorFlash> Driver<T, F, S> {
    pub(crate) fn start_with(flash: F, stream_flash: S) -> Self {
        let mut controller = Controller::new(nominal().expect("a robot"), flash, stream_flash, 0);
        controller.resume();
        Self {
            controller,
            sequence: 0,
        }
    }

    /// Sends bytes; the answers' frames.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        bytes
            .iter()
            .filter_map(|byte| self.controller.receive(*byte))
            .map(|answer| answer.to_vec())
            .collect()
    }

    /// Sends one request in a frame with the next sequence number; its one answer.
    pub(crate) fn ask(&mut self, request: &Request<T>) -> Response<T> {
        self.sequence += 1;
        let frame = encode(Direction::Request, self.sequence, request).expect("it fits");
        let (sequence, response) = self.answer(&frame);
        assert_eq!(sequence, self.sequence);
        response
    }

    /// Sends bytes that have exactly one answer.
    pub(crate) fn answer(&mut self, bytes: &[u8]) -> (u16, Response<T>) {
        let answers = self.send(bytes);
        let [answer] = answers.as_slice() else {
            panic!("{} answers", answers.len())
        };
        read_answer(answer)
    }

    pub(crate) fn fault(&mut self, request: &Request<T>) -> Fault {
        match self.ask(request) {
            Response::Fault(fault) => fault,
            response => panic!("no fault: {response:?}"),
        }
    }

    pub(crate) fn begin(&mut self, session: u32) -> u32 {
        self.begin_with(begin(session))
    }

    pub(crate) fn begin_with(&mut self, begin: Begin<T>) -> u32 {
        match self.ask(&Request::Begin(begin)) {
            Response::Taken { session, next, .. } if session == begin.session => next,
            response => panic!("{response:?}"),
        }
    }

    pub(crate) fn sample(&mut self, session: u32, index: u32, sample: &Sample<T>) -> Response<T> {
        self.ask(&message(session, index, sample))
    }

    pub(crate) fn status(&mut self) -> Status<T> {
        match self.ask(&Request::Status) {
            Response::Status(status) => status,
            response => panic!("{response:?}"),
        }
    }

    pub(crate) fn solve(&mut self, session: u32, samples: u32) -> Phase {
        match self.ask(&Request::Solve { session, samples }) {
            Response::Status(status) => status.phase,
            response => panic!("{response:?}"),
        }
    }

    /// Lets the controller work until there is nothing left to do.
    pub(crate) fn rest(&mut self) {
        let mut steps = 0;
        while self.controller.idle() {
            steps += 1;
            assert!(steps < 100_000, "the solver does not end");
        }
    }

    /// A session from its beginning to its result.
    pub(crate) fn calibrate(&mut self, session: u32, samples: &[Sample<T>]) -> Phase {
        assert_eq!(self.begin(session), 0);
        self.calibrate_on(session, samples)
    }

    /// The samples of a session that has begun, and its result.
    pub(crate) fn calibrate_on(&mut self, session: u32, samples: &[Sample<T>]) -> Phase {
        for (index, sample) in (0..).zip(samples) {
            assert_eq!(
                self.sample(session, index, sample),
                taken(session, index + 1)
            );
        }
        self.solve(session, u32::try_from(samples.len()).unwrap());
        self.rest();
        self.status().phase
    }

    /// A session that must succeed; the fingerprint of the result.
    pub(crate) fn solved(&mut self, session: u32, samples: &[Sample<T>]) -> u32 {
        match self.calibrate(session, samples) {
            Phase::Solved { fingerprint, .. } => fingerprint,
            phase => panic!("{phase:?}"),
        }
    }

    /// In place of what is in use.
    pub(crate) fn apply(&mut self, session: u32, fingerprint: u32) -> Response<T> {
        let from = self.parameters().generation;
        self.ask(&Request::Apply {
            session,
            fingerprint,
            from,
        })
    }

    /// From what is in use.
    pub(crate) fn revert(&mut self, to: RevertTo) -> Response<T> {
        let from = self.parameters().generation;
        self.ask(&Request::Revert { from, to })
    }

    pub(crate) fn parameters(&mut self) -> Parameters<T> {
        match self.ask(&Request::Parameters(ParameterSet::Current)) {
            Response::Parameters(parameters) => parameters,
            response => panic!("{response:?}"),
        }
    }
}

/// An answer's sequence number and content.
pub(crate) fn read_answer<T: Number>(bytes: &[u8]) -> (u16, Response<T>) {
    let mut receiver = Receiver::<LARGEST_FRAME>::new(Direction::Response);
    let mut answers = bytes.iter().filter_map(|byte| {
        receiver.push(*byte).map(|frame| {
            let frame = frame.expect("an answer is a frame");
            (
                frame.sequence,
                frame.message().expect("an answer is a response"),
            )
        })
    });
    let answer = answers
        .next()
        .unwrap_or_else(|| panic!("no answer: {bytes:02x?}"));
    assert!(answers.next().is_none());
    answer
}

pub(crate) fn message<T: Number>(session: u32, index: u32, sample: &Sample<T>) -> Request<T> {
    Request::Sample(SampleMessage {
        session,
        index,
        joints: sample.joints,
        position: sample.position.into(),
    })
}

/// A session that states the noise of [`samples`] and a tolerance.
pub(crate) fn begin<T: Number>(session: u32) -> Begin<T> {
    let pair = |(length, angle): (f64, f64)| (T::from_f64(length), T::from_f64(angle));
    let (position, joint) = pair(NOISE);
    Begin {
        session,
        tolerance: Some(pair(TOLERANCE)),
        noise: Some(([position; 3], joint)),
        estimator: Estimator::Arms,
        gate: false,
        forgetting: None,
    }
}

/// The answer to a sample, or to the beginning.
pub(crate) fn taken<T: Number>(session: u32, next: u32) -> Response<T> {
    Response::Taken { session, next }
}

const TOLERANCE: (f64, f64) = (0.5, 0.0035);
const NOISE: (f64, f64) = (0.02, 0.000_035);

/// Measurements of one of many random robots.
pub(crate) fn samples<T: Number>(robot: u64, count: usize) -> Vec<Sample<T>> {
    let mut rng = generator(0x00c0_ffee, robot);
    let truth = perturbed(&paper_robot(), 0.5, 0.0035, Spread::Uniform, &mut rng);
    let noise = Noise::new(NOISE.0, NOISE.1).unwrap();
    measurements(&truth, count, Some(&noise), &mut rng)
        .iter()
        .map(|sample| Sample {
            joints: sample.joints.map(T::from_f64),
            position: sample.position.map(T::from_f64),
        })
        .collect()
}

/// What the core makes of the same samples without a controller around it.
pub(crate) fn on_the_host<T: Number>(samples: &[Sample<T>]) -> Calibrator<T> {
    let (length, angle) = TOLERANCE;
    let (position, joint) = NOISE;
    let settings = Settings::default()
        .with_tolerance(Tolerance::new(T::from_f64(length), T::from_f64(angle)).unwrap())
        .with_noise(Noise::new(T::from_f64(position), T::from_f64(joint)).unwrap());
    let mut calibrator = Calibrator::new(&paper_robot::<T>(), &settings);
    for sample in samples {
        calibrator.add(sample).expect("a sample");
    }
    calibrator
}

/// CRC-32 (IEEE 802.3), bit by bit.
pub(crate) fn crc_32(content: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in content {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & 0_u32.wrapping_sub(crc & 1));
        }
    }
    !crc
}

/// So many calibrations stored, one after the other; their fingerprints.
pub(crate) fn stored(count: u64) -> (Flash, Vec<u32>) {
    let mut flash = Flash::new();
    let mut driver = Driver::<f32, _>::start(&mut flash);
    let fingerprints = (1..=count).map(|robot| {
        let session = u32::try_from(robot).unwrap();
        let fingerprint = driver.solved(session, &samples(robot, 12));
        driver.apply(session, fingerprint);
        fingerprint
    });
    let fingerprints = fingerprints.collect();
    (flash, fingerprints)
}

pub(crate) fn named(robot: &Robot<f32>) -> NewParameters<f32> {
    NewParameters {
        fingerprint: Geometry::of(robot).fingerprint(),
        robot: *robot,
    }
}
