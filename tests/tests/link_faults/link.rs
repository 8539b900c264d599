//! A link in memory that loses, damages and repeats bytes.

use crate::link_faults::device::Device;
use delta_cal_firmware_example::Number;
use delta_cal_host::device::Transport;
use delta_cal_tests::generator;
use rand_core::Rng;
use rand_pcg::Pcg32;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;
use std::rc::Rc;
use std::time::Duration;

/// What happens to a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Harm {
    Dropped,
    /// Exclusive or with this.
    Flipped(u8),
    Duplicated,
    /// Another byte comes before it.
    Preceded(u8),
}

/// Which way a byte goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    ToDevice,
    ToClient,
}

pub(crate) const WAYS: [Way; 2] = [Way::ToDevice, Way::ToClient];

/// Which bytes are harmed.
pub(crate) enum Harms {
    None,
    /// This byte of that direction, counted from 0.
    One(Way, usize, Harm),
    /// So many of a million, in random ways.
    Random(u32, Box<Pcg32>),
}

impl Harms {
    pub(crate) fn random(parts_per_million: u32, seed: u64) -> Self {
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

/// A controller at the end of a cable.
pub(crate) struct Bench<T: Number> {
    pub(crate) device: Device<T>,
    pub(crate) harms: Harms,
    /// Bytes that were sent so far, each way.
    pub(crate) sent: [usize; 2],
    /// How many of them were harmed.
    pub(crate) harmed: usize,
    on_the_way: VecDeque<u8>,
}

impl<T: Number> Bench<T> {
    pub(crate) fn new(harms: Harms) -> Self {
        Self {
            device: Device::new(),
            harms,
            sent: [0; 2],
            harmed: 0,
            on_the_way: VecDeque::new(),
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
            for answer in self.device.receive(arrived) {
                let arrived = self.carried(Way::ToClient, answer);
                self.on_the_way.extend(arrived);
            }
        }
    }
}

/// The client's end. Waiting takes no time: what does not come at once never will.
pub(crate) struct Link<T: Number> {
    pub(crate) bench: Rc<RefCell<Bench<T>>>,
    /// The client is ended in place of sending the request of this number.
    pub(crate) ends_at: Option<usize>,
    requests: usize,
}

impl<T: Number> Link<T> {
    pub(crate) fn new(bench: &Rc<RefCell<Bench<T>>>) -> Self {
        Self {
            bench: Rc::clone(bench),
            ends_at: None,
            requests: 0,
        }
    }
}

impl<T: Number> Transport for Link<T> {
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
        bench.device.run();
        let count = buffer.len().min(bench.on_the_way.len());
        for (place, byte) in buffer.iter_mut().zip(bench.on_the_way.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}
