//! A calibration over a link that loses, damages and repeats bytes, between ends that restart: every
//! session must come out as the undisturbed one did, to the bit.

mod stubborn;

use crate::controller::streams::ALWAYS;
use delta_cal::Sample;
use delta_cal_controller::{
    Background, Controller, Foreground, Handover, ParameterFlash, StreamFlash, StreamPace, Timer,
};
use delta_cal_firmware_example::{Circle, limits, machine};
use delta_cal_host::device::{
    Client, DeviceError, Patience, Transport, apply, begin, calibrate, check_nominal, samples,
};
use delta_cal_host::files::example;
use delta_cal_protocol::{Begin, Estimator, Geometry, Origin, ParameterSet, Phase, RevertTo};
use delta_cal_tests::{generator, size};
use rand_core::Rng;
use rand_pcg::Pcg32;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, Read};
use std::rc::Rc;
use std::time::Duration;

/// A damaged link needs many attempts, and nothing here takes time.
const PATIENCE: Patience = Patience {
    timeout: Duration::from_secs(3600),
    deadline: Duration::from_secs(3600),
    silent_attempts: 50,
    attempts: 2000,
    pause: Duration::ZERO,
    looks: 5000,
};

const SAMPLES: usize = 16;

/// All that a session brought about.
#[derive(Debug, Clone, PartialEq)]
struct Outcome {
    /// Every figure of the three arms; Rust prints a number so that it reads back as the same bits.
    arms: String,
    /// Fingerprint of the parameters that were applied.
    applied: u32,
    /// Of those that the control loop computed with after that.
    in_loop: u32,
    /// The parameters before: from these, the arms and the files follows all that the report says.
    before: String,
    /// Samples of the session.
    samples: u32,
    /// Fingerprint and origin after going back.
    reverted: (u32, Origin),
}

/// Sixteen positions, as they are sent.
fn positions() -> (Begin<f32>, Vec<Sample<f32>>) {
    let (robot, file) = example::load().unwrap();
    let mut samples = samples(&file);
    samples.truncate(SAMPLES);
    (begin(&robot, Estimator::Joint), samples)
}

/// The calibration of the example from the first request to the last: looked at, applied, read
/// back, and reverted.
fn session(client: &mut Client<Link>, bench: &Rc<RefCell<Bench>>) -> Result<Outcome, DeviceError> {
    client.identity()?;
    let nominal = client.parameters::<f32>(ParameterSet::Nominal)?;
    check_nominal(&example::load().unwrap().0, &nominal.geometry).unwrap();
    let (begin, samples) = positions();
    let finished = calibrate(client, &begin, &samples, &mut |_| {})?;
    let applied = apply(client, &begin, &samples, &finished)?;
    let in_loop = bench.borrow().in_loop();
    let Phase::Solved { samples, .. } = finished.status_after.phase else {
        panic!("{:?}", finished.status_after.phase)
    };
    client.counters::<f32>()?;
    client.revert::<f32>(applied.generation, RevertTo::Previous)?;
    let applied = applied.geometry.fingerprint();
    let reverted = client.parameters::<f32>(ParameterSet::Current)?;
    Ok(Outcome {
        arms: format!("{:?}", finished.result.unwrap()),
        applied,
        in_loop,
        before: format!("{:?}", finished.parameters_before.geometry),
        samples,
        reverted: (reverted.geometry.fingerprint(), reverted.origin),
    })
}

/// A session of a fresh client with this controller.
fn run(bench: Bench, seed: u64) -> (Result<Outcome, DeviceError>, Rc<RefCell<Bench>>) {
    let bench = Rc::new(RefCell::new(bench));
    let mut client = Client::new(Link::new(&bench), PATIENCE, seed);
    let outcome = session(&mut client, &bench);
    (outcome, bench)
}

/// A session that must come out as the undisturbed one did; the bytes harmed, and the requests answered.
fn comes_out(bench: Bench, seed: u64, expected: &Outcome, what: &str) -> [usize; 2] {
    let (outcome, bench) = run(bench, seed);
    let outcome = outcome.unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(outcome, *expected, "{what}");
    assert_nothing_else_used(&bench, expected);
    let bench = bench.borrow();
    [bench.harmed, bench.answered]
}

/// The undisturbed session, the bytes that went each way, and the requests.
fn undisturbed() -> (Outcome, [usize; 2], usize) {
    let (outcome, bench) = run(Bench::new(Harms::None), 1);
    let outcome = outcome.unwrap();
    let bench = bench.borrow();
    assert_eq!(outcome.samples as usize, SAMPLES);
    assert_eq!(
        bench.used,
        [outcome.reverted.0, outcome.applied, outcome.reverted.0]
    );
    assert_eq!(outcome.reverted.1, Origin::Nominal);
    assert_ne!(outcome.applied, outcome.reverted.0);
    assert_eq!(outcome.applied, outcome.in_loop);
    (outcome, bench.sent, bench.answered)
}

/// Nothing but these two sets of parameters was ever in use.
fn assert_nothing_else_used(bench: &Rc<RefCell<Bench>>, expected: &Outcome) {
    let bench = bench.borrow();
    let known = [expected.applied, expected.reverted.0];
    let used = &bench.used;
    assert!(used.iter().all(|set| known.contains(set)), "{used:?}");
}

/// What becomes of a byte.
const HARMS: [Harm; 8] = [
    Harm::Dropped,
    Harm::Duplicated,
    Harm::Flipped(0x01),
    Harm::Flipped(0x80),
    Harm::Flipped(0x5a),
    Harm::Flipped(0xff),
    Harm::Preceded(0),
    Harm::Preceded(0x80),
];

/// One byte in 29 is harmed in each of the ways: the frames of samples are more, and have the same bytes, so that each of
/// these is harmed in half of them. The long campaign harms every byte in every way.
fn every_byte(harms: &[Harm]) {
    let (expected, bytes, _) = undisturbed();
    let ways = size(29, 1);
    let mut faults = 0;
    for (way, count) in WAYS.into_iter().zip(bytes) {
        for harm in harms {
            let number = HARMS.iter().position(|other| other == harm).unwrap();
            for index in (number % ways..count).step_by(ways) {
                let bench = Bench::new(Harms::One(way, index, *harm));
                let what = format!("{harm:?}, byte {index} {way:?}");
                let [harmed, _] = comes_out(bench, 1, &expected, &what);
                assert_eq!(harmed, 1, "{what}");
                faults += 1;
            }
        }
    }
    let [to_device, to_client] = bytes;
    println!(
        "{harms:?}: {faults} sessions, each with one fault, in one of {to_device} bytes to the \
         controller and {to_client} from it; all came out the same"
    );
    assert!(faults * ways + 2 * ways * harms.len() >= (to_device + to_client) * harms.len());
}

#[test]
fn every_byte_dropped_or_duplicated_once() {
    every_byte(&HARMS[..2]);
}

#[test]
fn every_byte_flipped_once() {
    every_byte(&HARMS[2..6]);
}

#[test]
fn every_byte_turned_into_a_delimiter_or_preceded_by_one() {
    every_byte(&HARMS[6..]);
}

/// It stores every sample, or none before a minute has passed.
#[test]
fn controller_restarted_at_every_request() {
    let (expected, _, requests) = undisturbed();
    let mut restarts = 0;
    for index in 0..2 * requests {
        let (pace, index) = ([StreamPace::default(), ALWAYS][index % 2], index / 2);
        for cut in [Cut::BeforeTheAnswer, Cut::AfterTheAnswer] {
            let bench = Bench::with(Harms::None, pace, Some((index, cut)));
            let what = format!("restarted at request {index}, {cut:?}");
            let [_, answered] = comes_out(bench, 1, &expected, &what);
            // Identity, nominal, beginning, status and current parameters come before the samples; the first is not stored
            // before it is answered.
            if pace == ALWAYS && (6..SAMPLES).contains(&index) {
                // No sample is sent again but the one that was not stored yet.
                assert!(answered <= requests + 4, "{answered} of {requests}");
            }
            restarts += 1;
        }
    }
    println!("{restarts} sessions, each with one restart of the controller; all came out the same");
}

#[test]
fn client_restarted_at_every_request() {
    let (expected, _, requests) = undisturbed();
    let mut unconfirmed = 0;
    for index in 0..requests {
        let bench = Rc::new(RefCell::new(Bench::new(Harms::None)));
        let mut link = Link::new(&bench);
        link.ends_at = Some(index);
        let mut first = Client::new(link, PATIENCE, 1);
        let ended = session(&mut first, &bench);
        match ended {
            Err(DeviceError::Link(_)) => {}
            Err(DeviceError::Unconfirmed(_)) => unconfirmed += 1,
            ended => panic!("request {index}: {ended:?}"),
        }
        let mut second = Client::new(Link::new(&bench), PATIENCE, 2);
        let mut outcome = session(&mut second, &bench).unwrap();
        // A first client that got to apply its result has left the second one with it.
        outcome.before.clone_from(&expected.before);
        assert_eq!(outcome, expected, "request {index}");
        assert_nothing_else_used(&bench, &expected);
    }
    println!("{requests} sessions, each after a client that ended; all came out the same");
    // The requests to apply and to go back, the look at the parameters, and up to 50 at the control loop.
    assert!((4..=53).contains(&unconfirmed), "{unconfirmed}");
}

#[test]
fn random_faults_at_several_rates() {
    let (expected, ..) = undisturbed();
    let sessions = size(25, 100);
    for parts_per_million in [300, 1000, 3000, 6000] {
        let mut faults = 0;
        for seed in 0..sessions {
            let bench = Bench::new(Harms::random(parts_per_million, seed));
            let what = format!("{parts_per_million} in a million, seed {seed}");
            let [harmed, _] = comes_out(bench, seed, &expected, &what);
            faults += harmed;
        }
        println!(
            "{parts_per_million} faults in a million bytes: {sessions} sessions, {faults} faults; all \
             came out the same"
        );
    }
}

/// The tests above would pass on a link that harms nothing.
#[test]
fn a_harmed_link_loses_requests() {
    let silent = Patience {
        silent_attempts: 3,
        ..PATIENCE
    };
    let bench = Rc::new(RefCell::new(Bench::new(Harms::random(400_000, 1))));
    let mut client = Client::new(Link::new(&bench), silent, 1);
    assert!(session(&mut client, &bench).is_err());
    let harm = Harms::One(Way::ToDevice, 5, Harm::Dropped);
    let bench = Rc::new(RefCell::new(Bench::new(harm)));
    let mut client = Client::new(Link::new(&bench), PATIENCE, 1);
    session(&mut client, &bench).unwrap();
    assert_eq!(client.repetitions(), 1);
}

/// Turns of the control loop between two looks at the link.
const TURNS: u32 = 20;

/// Every turn is punctual: nothing here depends on time.
struct Turns(u32);

impl Timer for Turns {
    const TICKS_A_SECOND: u32 = 1_000_000;
    const MASK: u32 = u32::MAX;
    fn now(&self) -> u32 {
        self.0.wrapping_mul(1000)
    }
}

/// A controller that is switched on.
struct On {
    controller: Controller<f32, ParameterFlash, StreamFlash>,
    background: Background<'static, f32>,
    foreground: Foreground<'static, f32, Circle<f32>>,
}

impl On {
    fn start(flash: ParameterFlash, stream_flash: StreamFlash, pace: StreamPace) -> Self {
        let mut controller = Controller::new(machine(0).unwrap(), flash, stream_flash);
        controller.set_stream_pace(pace);
        controller.resume();
        // Static memory on a controller; here a kilobyte that stays allocated after each start.
        let handover = Box::leak(Box::new(Handover::default()));
        let (background, foreground) = handover.split(
            &controller.current(),
            Circle::default(),
            &limits(),
            [0.0; 3],
        );
        Self {
            controller,
            background,
            foreground,
        }
    }
}

/// When a controller loses its supply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cut {
    /// It has acted on the request, and its answer is lost.
    BeforeTheAnswer,
    /// The answer has left.
    AfterTheAnswer,
}

/// What happens to a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Harm {
    Dropped,
    /// Exclusive or with this.
    Flipped(u8),
    Duplicated,
    /// Another byte comes before it.
    Preceded(u8),
}

/// Which way a byte goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    ToDevice,
    ToClient,
}

const WAYS: [Way; 2] = [Way::ToDevice, Way::ToClient];

/// Which bytes are harmed.
enum Harms {
    None,
    /// This byte of that direction, counted from 0.
    One(Way, usize, Harm),
    /// So many of a million, in random ways.
    Random(u32, Box<Pcg32>),
}

impl Harms {
    fn random(parts_per_million: u32, seed: u64) -> Self {
        Self::Random(parts_per_million, Box::new(generator(301, seed)))
    }

    fn of(&mut self, way: Way, index: usize) -> Option<Harm> {
        match self {
            Self::None => None,
            Self::One(harmed, at, harm) => (*harmed == way && *at == index).then_some(*harm),
            Self::Random(parts_per_million, rng) => {
                (rng.next_u32() % 1_000_000 < *parts_per_million).then(|| {
                    let [kind, value, ..] = rng.next_u32().to_le_bytes();
                    match kind % 4 {
                        0 => Harm::Dropped,
                        1 => Harm::Flipped(value.max(1)),
                        2 => Harm::Duplicated,
                        _ => Harm::Preceded(value),
                    }
                })
            }
        }
    }
}

/// A controller at the end of a cable, which can be restarted.
struct Bench {
    on: Option<On>,
    /// How often its samples are stored.
    pace: StreamPace,
    /// Whole frames that were answered so far.
    answered: usize,
    /// Restarts at the frame of this number.
    restart_at: Option<(usize, Cut)>,
    /// Fingerprints of all parameters that were ever in use, in their order.
    used: Vec<u32>,
    harms: Harms,
    /// Bytes that were sent so far, each way.
    sent: [usize; 2],
    /// How many of them were harmed.
    harmed: usize,
    on_the_way: VecDeque<u8>,
}

impl Bench {
    fn new(harms: Harms) -> Self {
        Self::with(harms, StreamPace::default(), None)
    }

    fn with(harms: Harms, pace: StreamPace, restart_at: Option<(usize, Cut)>) -> Self {
        let on = On::start(ParameterFlash::new(), StreamFlash::new(), pace);
        Self {
            used: vec![on.controller.current().fingerprint],
            on: Some(on),
            pace,
            answered: 0,
            restart_at,
            harms,
            sent: [0; 2],
            harmed: 0,
            on_the_way: VecDeque::new(),
        }
    }

    /// Takes in a byte; the bytes that it answers with.
    fn receive(&mut self, byte: u8) -> Vec<u8> {
        let Some(answer) = self.on.as_mut().unwrap().controller.receive(byte) else {
            return Vec::new();
        };
        let cut = self.restart_at.filter(|(at, _)| *at == self.answered);
        self.answered += 1;
        if cut.is_some() {
            let (flash, stream_flash) = self.on.take().unwrap().controller.into_flash();
            self.on = Some(On::start(flash, stream_flash, self.pace));
        }
        self.look();
        match cut {
            Some((_, Cut::BeforeTheAnswer)) => Vec::new(),
            _ => answer.to_vec(),
        }
    }

    /// Turns of the control loop, and one step in the background: what the firmware's idle loop does.
    fn run(&mut self) {
        let on = self.on.as_mut().unwrap();
        for _ in 0..TURNS {
            let now = Turns(on.foreground.control_loop.state.turns);
            on.foreground.turn(&now, |_| {});
            on.background.exchange(&mut on.controller);
        }
        on.controller.idle();
        self.look();
    }

    /// The parameters that the control loop computes with.
    fn in_loop(&self) -> u32 {
        let on = self.on.as_ref().unwrap();
        Geometry::of(&on.foreground.control_loop.robot).fingerprint()
    }

    fn look(&mut self) {
        let now = self.on.as_ref().unwrap().controller.current().fingerprint;
        if self.used.last() != Some(&now) {
            self.used.push(now);
        }
    }

    /// What arrives of a byte.
    fn carried(&mut self, way: Way, byte: u8) -> Vec<u8> {
        let count = &mut self.sent[way as usize];
        let index = *count;
        *count += 1;
        let harm = self.harms.of(way, index);
        self.harmed += usize::from(harm.is_some());
        match harm {
            None => vec![byte],
            Some(Harm::Dropped) => vec![],
            Some(Harm::Flipped(mask)) => vec![byte ^ mask],
            Some(Harm::Duplicated) => vec![byte; 2],
            Some(Harm::Preceded(other)) => vec![other, byte],
        }
    }

    fn send(&mut self, byte: u8) {
        for arrived in self.carried(Way::ToDevice, byte) {
            for answer in self.receive(arrived) {
                let arrived = self.carried(Way::ToClient, answer);
                self.on_the_way.extend(arrived);
            }
        }
    }
}

/// The client's end. Waiting takes no time: what does not come at once never will.
struct Link {
    bench: Rc<RefCell<Bench>>,
    /// The client is ended in place of sending the request of this number.
    ends_at: Option<usize>,
    requests: usize,
}

impl Link {
    fn new(bench: &Rc<RefCell<Bench>>) -> Self {
        Self {
            bench: Rc::clone(bench),
            ends_at: None,
            requests: 0,
        }
    }
}

impl Transport for Link {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.ends_at == Some(self.requests) {
            return Err(io::ErrorKind::Interrupted.into());
        }
        self.requests += 1;
        let mut bench = self.bench.borrow_mut();
        for byte in bytes {
            bench.send(*byte);
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], _timeout: Duration) -> io::Result<usize> {
        let mut bench = self.bench.borrow_mut();
        bench.run();
        bench.on_the_way.read(buffer)
    }
}
