//! The other end of the link.

use delta_cal::{IkmCalibrator, Noise, Robot, Sample};
pub(crate) use delta_cal_controller::ParameterFlash as Flash;
use delta_cal_controller::{Controller, NewParameters, Number, PAGE, RamFlash, StreamFlash, WORD};
use delta_cal_firmware_example::machine;
use delta_cal_protocol::{
    Begin, Direction, Estimator, Fault, Geometry, LARGEST_FRAME, ParameterSet, Parameters, Phase,
    Receiver, Request, Response, RevertTo, SampleMessage, Status, encode,
};
use delta_cal_tests::{Spread, converted, generator, measurements, paper_robot, perturbed};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::ops::Range;

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
        let mut controller = Controller::new(machine(0).expect("a robot"), flash, stream_flash);
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
        accepted(self.ask(&Request::Parameters(ParameterSet::Current)))
    }
}

/// The parameters that are in use after a request.
pub(crate) fn accepted<T: Number>(answer: Response<T>) -> Parameters<T> {
    match answer {
        Response::Parameters(parameters) => parameters,
        answer => panic!("{answer:?}"),
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
        joint_zero: None,
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
    converted(&measurements(&truth, count, Some(&noise), &mut rng))
}

/// What the core makes of the same samples without a controller around it.
pub(crate) fn on_the_host<T: Number>(samples: &[Sample<T>]) -> IkmCalibrator<T> {
    let (settings, _) = begin(1).calibrator().unwrap();
    let mut calibrator = IkmCalibrator::new(&paper_robot::<T>(), &settings);
    for sample in samples {
        calibrator.add(sample).expect("a sample");
    }
    calibrator
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
        robot: robot.clone(),
    }
}

/// Bytes of the flash of the parameters.
const PARAMETERS: usize = 2 * PAGE;

/// How much of a write or an erase is done when the power fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Nothing.
    Before,
    /// The first half.
    FirstHalf,
    /// The second half.
    LastHalf,
    /// Half of the bits, anywhere.
    SomeBits,
    /// Everything, but nobody is told.
    After,
}

impl Cut {
    pub(crate) const ALL: [Self; 5] = [
        Self::Before,
        Self::FirstHalf,
        Self::LastHalf,
        Self::SomeBits,
        Self::After,
    ];
}

/// Flash that fails at one write or erase, and from then on altogether.
#[derive(Debug, Clone)]
pub(crate) struct FailingFlash<const N: usize = PARAMETERS> {
    pub(crate) flash: RamFlash<N>,
    /// Writes and erases so far.
    pub(crate) operations: u32,
    /// Of them, those that erased.
    pub(crate) erasures: u32,
    /// At which of them the power fails.
    pub(crate) cut: Option<(u32, Cut)>,
    dead: bool,
    /// Words that were written a second time without an erase between.
    pub(crate) rewritten: u32,
    /// Reads so far.
    pub(crate) reads: u32,
    /// Reads that fail, by their numbers.
    pub(crate) failing_reads: Range<u32>,
    /// Bytes that none of those reads may touch.
    pub(crate) unreadable: Range<u32>,
    /// Bits of its first byte that such a read has wrong, in place of failing.
    pub(crate) wrong: u8,
}

impl<const N: usize> FailingFlash<N> {
    pub(crate) fn new(flash: RamFlash<N>) -> Self {
        Self {
            flash,
            operations: 0,
            erasures: 0,
            cut: None,
            dead: false,
            rewritten: 0,
            reads: 0,
            failing_reads: 0..0,
            unreadable: 0..u32::MAX,
            wrong: 0,
        }
    }

    /// Reads within these bytes fail for good.
    pub(crate) fn unreadable(flash: RamFlash<N>, bytes: Range<u32>) -> Self {
        Self {
            failing_reads: 0..u32::MAX,
            unreadable: bytes,
            ..Self::new(flash)
        }
    }

    /// Reads of these numbers fail, wherever they are.
    pub(crate) fn failing_reads(flash: RamFlash<N>, reads: Range<u32>) -> Self {
        Self {
            failing_reads: reads,
            ..Self::new(flash)
        }
    }

    /// Counts from here, and fails at the `at`th operation.
    pub(crate) fn fail(flash: RamFlash<N>, at: u32, cut: Cut) -> Self {
        Self {
            cut: Some((at, cut)),
            ..Self::new(flash)
        }
    }

    /// What is left to do of an operation on `length` bytes, in place of which it fails.
    fn failing(&mut self, length: usize) -> Result<Option<Vec<u8>>, Failure> {
        if self.dead {
            return Err(Failure::NoPower);
        }
        let at = self.operations;
        self.operations += 1;
        let Some((_, cut)) = self.cut.filter(|(cut, _)| *cut == at) else {
            return Ok(None);
        };
        self.dead = true;
        let mut rng = Pcg32::seed_from_u64(u64::from(at));
        let half = (length / 2).next_multiple_of(WORD);
        let masks = (0..length).map(|index| match cut {
            Cut::Before => 0x00,
            Cut::FirstHalf => u8::from(index < half) * 0xff,
            Cut::LastHalf => u8::from(index >= half) * 0xff,
            Cut::SomeBits => rng.next_u32().to_le_bytes()[0],
            Cut::After => 0xff,
        });
        Ok(Some(masks.collect()))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Failure {
    NoPower,
    Unreadable,
    Access(NorFlashErrorKind),
}

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const N: usize> ErrorType for FailingFlash<N> {
    type Error = Failure;
}

impl<const N: usize> ReadNorFlash for FailingFlash<N> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        if self.dead {
            return Err(Failure::NoPower);
        }
        let (number, end) = (self.reads, offset + u32::try_from(bytes.len()).unwrap());
        self.reads += 1;
        let touched = offset < self.unreadable.end && self.unreadable.start < end;
        let fails = touched && self.failing_reads.contains(&number);
        if fails && self.wrong == 0 {
            return Err(Failure::Unreadable);
        }
        self.flash.read(offset, bytes).map_err(Failure::Access)?;
        bytes[0] ^= u8::from(fails) * self.wrong;
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<const N: usize> NorFlash for FailingFlash<N> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        let range = from as usize..to as usize;
        let failing = self.failing(range.len())?;
        self.erasures += 1;
        if let Some(mask) = failing {
            for (byte, set) in self.flash.bytes[range].iter_mut().zip(mask) {
                *byte |= set;
            }
            return Err(Failure::NoPower);
        }
        self.flash.erase(from, to).map_err(Failure::Access)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let start = offset as usize;
        if let Some(mask) = self.failing(bytes.len())? {
            let place = &mut self.flash.bytes[start..start + bytes.len()];
            for ((place, byte), clear) in place.iter_mut().zip(bytes).zip(mask) {
                *place &= byte | !clear;
            }
            return Err(Failure::NoPower);
        }
        for word in self.flash.bytes[start..start + bytes.len()].chunks(WORD) {
            self.rewritten += u32::from(word.iter().any(|byte| *byte != 0xff));
        }
        self.flash.write(offset, bytes).map_err(Failure::Access)
    }
}
