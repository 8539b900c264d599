//! The firmware: a controller whose control loop never stops while it recalibrates its robot. The README says how to
//! build it and to run it under QEMU.
//!
//! One program for a Cortex-M4F (`mps2-an386`) and a Cortex-M7 (`mps2-an500`). The log is in `defmt` format. For
//! another board, only `board.rs`, `emulated.rs` and `faults.rs` change.

#![no_std]
#![no_main]

mod board;
mod emulated;
mod faults;

use board::Link;
use delta_cal_controller::{Background, Controller, Handover, ParameterFlash, StreamFlash};
use delta_cal_firmware_example::{Circle, limits, machine};
use emulated::Flash;
use faults::fail;
use heapless::spsc::{Producer, Queue};
use static_cell::StaticCell;

/// The firmware's scalar type.
#[cfg(not(feature = "double"))]
type Number = f32;
#[cfg(feature = "double")]
type Number = f64;

type Firmware = Controller<Number, &'static mut ParameterFlash, &'static mut StreamFlash>;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut RECEIVED: Queue<u8, 1024> = Queue::new();

    let (received_in, mut received) = RECEIVED.split();
    let (controller, mut background, mut link) = start(received_in);
    loop {
        if let Some(byte) = received.dequeue() {
            take_in(controller, &mut link, byte);
        } else if !controller.idle() {
            // A byte that arrives now waits at most until the next turn of the control loop.
            board::wait();
        }
        background.exchange(controller);
    }
}

// Not inlined, all three: what is moved into place would take 2,000 bytes of stack for ever, and the temporaries of a
// request 2,500. With `start` inlined the program has 6,800 bytes more.
#[inline(never)]
fn start(
    received: Producer<'static, u8>,
) -> (&'static mut Firmware, Background<'static, Number>, Link) {
    static HANDOVER: StaticCell<Handover<Number>> = StaticCell::new();
    let (flash, mut link, processor) = board::take();
    let controller = place(flash, processor);
    if controller.check().is_err() {
        fail("impossible flash regions or work points")
    }
    controller.resume();
    let handover = HANDOVER.init(Handover::default());
    // A real board reads where its joints are: they approach the path from there.
    let joints = [0.0; 3];
    let (background, foreground) =
        handover.split(&controller.current(), Circle::default(), &limits(), joints);
    link.start(foreground, received);
    (controller, background, link)
}

#[inline(never)]
fn place(flash: &'static mut Flash, processor: u32) -> &'static mut Firmware {
    static CONTROLLER: StaticCell<Firmware> = StaticCell::new();
    let (parameters, samples) = (&mut flash.parameters, &mut flash.samples);
    let Ok(machine) = machine(processor) else {
        fail("no robot")
    };
    CONTROLLER.init_with(|| Controller::new(machine, parameters, samples))
}

#[inline(never)]
fn take_in(controller: &mut Firmware, link: &mut Link, byte: u8) {
    controller.counters.overrun = board::overrun();
    if let Some(answer) = controller.receive(byte) {
        link.send(&answer);
    }
}
