//! The firmware: a controller whose control loop never stops while it recalibrates its robot.
//!
//! ```text
//! cargo build --profile firmware -p delta-cal-firmware-example --features board --target thumbv7em-none-eabihf
//! qemu-system-arm -machine mps2-an386 -nographic -monitor none \
//!     -serial tcp:127.0.0.1:PORT,server=on,wait=on,nodelay=on \
//!     -semihosting-config enable=on,target=native -icount shift=6 \
//!     -kernel target/thumbv7em-none-eabihf/firmware/delta-cal-firmware-example > LOG
//! ```
//!
//! One program for a Cortex-M4F (`mps2-an386`) and a Cortex-M7 (`mps2-an500`). The log is in `defmt` format. For
//! another board, only `board.rs` changes.

#![no_std]
#![no_main]

mod board;
mod faults;

use board::Link;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE};
use cortex_m_semihosting::hio;
use delta_cal::Robot;
use delta_cal_firmware_example::{
    Background, Circle, Controller, Handover, ParameterFlash, StreamFlash, nominal,
};
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
    static CONTROLLER: StaticCell<Firmware> = StaticCell::new();
    static mut HANDOVER: Handover<Number> = Handover::new();
    static mut RECEIVED: Queue<u8, 1024> = Queue::new();

    let (received_in, mut received) = RECEIVED.split();
    let (controller, mut background, mut link) = start(&CONTROLLER, HANDOVER, received_in);
    loop {
        let more = match received.dequeue() {
            Some(byte) => {
                take_in(controller, &mut link, byte);
                true
            }
            None => controller.idle(),
        };
        background.exchange(controller);
        if !more {
            // A byte that arrives now waits at most until the next turn of the control loop.
            board::wait();
        }
    }
}

/// Not inlined: temporaries moved into place here would occupy the stack permanently.
#[inline(never)]
fn start(
    memory: &'static StaticCell<Firmware>,
    handover: &'static mut Handover<Number>,
    received: Producer<'static, u8>,
) -> (&'static mut Firmware, Background<'static, Number>, Link) {
    let (Some((flash, stream_flash, mut link)), Ok(nominal)) = (board::take(), nominal()) else {
        fail("started twice, or without a robot")
    };
    let controller = place(memory, &nominal, flash, stream_flash);
    controller.resume();
    let (background, foreground) = handover.split(&controller.current(), Circle::default());
    link.start(foreground, received);
    (controller, background, link)
}

#[inline(never)]
fn place(
    memory: &'static StaticCell<Firmware>,
    nominal: &Robot<Number>,
    flash: &'static mut ParameterFlash,
    stream_flash: &'static mut StreamFlash,
) -> &'static mut Firmware {
    memory.init_with(|| Controller::new(*nominal, flash, stream_flash, board::processor()))
}

#[inline(never)]
fn take_in(controller: &mut Firmware, link: &mut Link, byte: u8) {
    controller.set_overrun(board::overrun());
    if let Some(answer) = controller.receive(byte) {
        link.send(&answer);
    }
}

// `cortex-m-rt` requires it to be `unsafe fn`; it does nothing unsafe.
#[allow(unsafe_code)]
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    fail("an exception without a handler")
}

/// Reports the cause, as far as that still works, and ends with a failure: a fault must not hang the run. Bypasses the
/// log, which a fault may have interrupted.
fn fail(why: &str) -> ! {
    if let Ok(mut stream) = hio::hstderr() {
        let _ = stream.write_all(b"\nFAILED ");
        let _ = stream.write_all(why.as_bytes());
    }
    loop {
        debug::exit(EXIT_FAILURE);
    }
}
