//! `delta-cal device`: against the firmware's controller in this process, behind a TCP port, and
//! against wrong input.

mod commands;
mod interrupted;
mod refusals;
use crate::support::{Folder, NOMINAL, Run, TOLERANCE, csv, noisy, true_arms};
use delta_cal_firmware_example::{
    Controller, Handover, ParameterFlash, StreamFlash, Timer, nominal,
};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;
use std::sync::mpsc::Sender;
use std::time::Duration;

struct Still;

impl Timer for Still {
    const TICKS_A_SECOND: u32 = 1_000_000;
    const MASK: u32 = 0x00ff_ffff;
    fn now(&self) -> u32 {
        0
    }
}

/// What a controller does once it has changed its parameters.
enum Change {
    /// It answers.
    Answered,
    /// It closes the link without an answer.
    HungUp,
    /// It says nothing more on this link, and tells the test.
    Silent(Sender<()>),
}

/// A controller at a TCP port that serves one command after the other; it keeps its state.
fn controller() -> String {
    controller_with(Vec::new())
}

/// At its first changes it does this; it answers the others.
fn controller_with(changes: Vec<Change>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let flash = ParameterFlash::new();
        let mut controller = Controller::new(
            nominal::<f32>().unwrap(),
            flash,
            StreamFlash::new(),
            0x410f_c241,
        );
        let mut handover = Handover::new();
        let mut changes = changes.into_iter();
        let (mut background, mut foreground) = handover.split(&controller.current());
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            stream
                .set_read_timeout(Some(Duration::from_millis(1)))
                .unwrap();
            let mut buffer = [0; 64];
            let mut silent = false;
            'link: loop {
                let count = match stream.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => count,
                    Err(error) if error.kind() == ErrorKind::WouldBlock => 0,
                    Err(_) => break,
                };
                for byte in &buffer[..count] {
                    let before = controller.current();
                    let Some(answer) = controller.receive(*byte) else {
                        continue;
                    };
                    if controller.current() != before {
                        match changes.next() {
                            None | Some(Change::Answered) => {}
                            Some(Change::HungUp) => break 'link,
                            Some(Change::Silent(told)) => {
                                silent = true;
                                told.send(()).unwrap();
                            }
                        }
                    }
                    if !silent && stream.write_all(&answer).is_err() {
                        break;
                    }
                }
                for _ in 0..100 {
                    foreground.turn(&Still, |_| {});
                    if let Some(state) = background.state() {
                        controller.set_control(state);
                    }
                    if background.ready()
                        && let Some(parameters) = controller.take_switch()
                    {
                        background.hand_over(parameters).unwrap();
                    }
                    controller.idle();
                }
            }
        }
    });
    port
}

const NOISE: &str = "\n[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";

fn robot() -> String {
    format!("{NOMINAL}{TOLERANCE}{NOISE}")
}

/// A folder with the controller's robot and good samples of another one.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot());
    folder.write("samples.csv", csv(&noisy(&true_arms(), 40, 0.02)));
    folder
}

fn run(folder: &Folder, port: &str, arguments: &str) -> Run {
    folder.run(&format!("device --port {port} {arguments}"))
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}
