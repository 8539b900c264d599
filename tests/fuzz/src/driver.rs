//! The driver: whatever the controller answers, it returns an error or a result without NaN.

use crate::controller::{Bench, Raw, frame, messages};
use crate::numbers::{Bits, Source, finite_robot};
use delta_cal_controller::ParameterFlash;
use delta_cal_host::device::{self, Client, DeviceError, Patience, Transport, apply, calibrate};
use delta_cal_host::files::example;
use delta_cal_host::{InputText, Readings, RobotFile};
use delta_cal_protocol::Estimator;
use delta_cal_protocol::{
    ControlLoop, Direction, LARGEST_FRAME, Request, Response, RevertTo, Wire, Writer,
};
use std::collections::VecDeque;
use std::io::{self, Read};
use std::sync::LazyLock;
use std::time::Duration;

/// Background steps of the controller between polls of the link.
const STEPS: u32 = 500;
/// Number of rows from the example: enough for a result, few enough for thousands of sessions per minute.
const ROWS: usize = 14;

static FILES: LazyLock<(RobotFile, Readings)> = LazyLock::new(|| {
    let robot = RobotFile::read(&InputText::new("robot.toml", example::ROBOT_TOML))
        .expect("the example's robot is one");
    let mut samples = Readings::read(&InputText::new("samples.csv", example::SAMPLES_CSV), &robot)
        .expect("the example's samples are some");
    samples.rows.truncate(ROWS);
    (robot, samples)
});

/// A controller whose answers are altered in transit, as the input bytes say.
struct Link<'a, T: Bits> {
    bench: Bench<T>,
    control: ControlLoop<T>,
    source: Source<'a>,
    on_the_way: VecDeque<u8>,
}

impl<T: Bits> Link<'_, T> {
    fn changed(&mut self, answer: &[u8]) -> Vec<u8> {
        let Some((sequence, response)) = messages::<Response<T>>(Direction::Response, answer).pop()
        else {
            return answer.to_vec();
        };
        match self.source.byte() {
            0..0xa0 => answer.to_vec(),
            0xa0..0xb0 => Vec::new(),
            0xb0..0xc0 => self.source.bytes().to_vec(),
            0xc0..0xd0 => {
                let content = self.source.bytes();
                frame(Direction::Response, sequence, &Raw(content))
            }
            0xd0..0xf0 => {
                // An intact frame with one field changed.
                let mut content = vec![0; LARGEST_FRAME];
                let mut writer = Writer::new(&mut content);
                response.put(&mut writer);
                let length = writer.finish().unwrap_or_default();
                content.truncate(length);
                for _ in 0..=self.source.below(9) {
                    let place = usize::from(self.source.word()) % content.len().max(1);
                    if let Some(byte) = content.get_mut(place) {
                        *byte = self.source.byte();
                    }
                }
                frame(Direction::Response, sequence, &Raw(&content))
            }
            0xf0.. => {
                let mut damaged = answer.to_vec();
                let place = usize::from(self.source.word()) % damaged.len().max(1);
                if let Some(byte) = damaged.get_mut(place) {
                    *byte ^= self.source.byte();
                }
                damaged
            }
        }
    }
}

impl<T: Bits> Transport for Link<'_, T> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            if let Some(answer) = self.bench.controller.receive(*byte) {
                let arrived = self.changed(&answer);
                self.on_the_way.extend(arrived);
            }
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], _timeout: Duration) -> io::Result<usize> {
        for _ in 0..STEPS {
            if !self.bench.controller.idle() {
                break;
            }
        }
        self.bench.switch(&mut self.control);
        self.on_the_way.read(buffer)
    }
}

in_either_precision!(driver, session);

fn session<T: Bits>(source: &mut Source<'_>) {
    let (robot_file, samples) = &*FILES;
    let bench = Bench::<T>::start(ParameterFlash::new());
    let control = ControlLoop::new(bench.controller.current().fingerprint);
    let link = Link {
        bench,
        control,
        source: std::mem::replace(source, Source::new(&[])),
        on_the_way: VecDeque::new(),
    };
    let patience = Patience {
        timeout: Duration::from_secs(3600),
        deadline: Duration::from_secs(3600),
        silent_attempts: 3,
        attempts: 6,
        pause: Duration::ZERO,
        looks: 100,
    };
    let mut client = Client::new(link, patience, 1);
    let _ = explained(client.identity());
    let _ = explained(client.counters::<T>());
    let begin = device::begin::<T>(robot_file, Estimator::Joint);
    let samples = device::samples::<T>(samples);
    let finished = calibrate(&mut client, &begin, &samples, &mut |_| {});
    if let Some(finished) = explained(finished) {
        let applied = apply(&mut client, &begin, &samples, &finished);
        if let Some(parameters) = explained(applied) {
            let robot = parameters.geometry.robot();
            assert!(robot.is_ok(), "{parameters:?}");
        }
    }
    let from = client.transport_mut().bench.generation();
    if let Some(parameters) = explained(client.revert::<T>(from, RevertTo::Previous))
        && let Ok(robot) = parameters.geometry.robot()
    {
        finite_robot(&robot);
    }
    let _ = explained(client.ask::<T>(&Request::Status));
}

fn explained<R>(answer: Result<R, DeviceError>) -> Option<R> {
    match answer {
        Ok(answer) => Some(answer),
        Err(error) => {
            assert!(!error.to_string().is_empty() && !error.remedy().is_empty());
            None
        }
    }
}
