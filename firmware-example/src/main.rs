//! The firmware: a controller whose control loop never stops while it recalibrates its robot.
//!
//! ```text
//! cargo build --release -p delta-cal-firmware-example --target thumbv7em-none-eabihf
//! ```
//!
//! One program for a Cortex-M4F and a Cortex-M7; `board.rs` is all that another board changes. For
//! a host there is only the library.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
use {
    board::{Board, Flash},
    delta_cal_firmware_example::{Controller, Handover, nominal},
    heapless::spsc::Queue,
};

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("The firmware is built with --target thumbv7em-none-eabihf.");
}

/// What the firmware computes in.
#[cfg(all(target_os = "none", not(feature = "double")))]
type Number = f32;
#[cfg(all(target_os = "none", feature = "double"))]
type Number = f64;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    static mut CONTROLLER: Option<Controller<Number, &'static mut Flash>> = None;
    static mut HANDOVER: Handover<Number> = Handover::new();
    static mut RECEIVED: Queue<u8, 1024> = Queue::new();

    let (Some(board), Ok(nominal)) = (Board::take(), nominal()) else {
        board::fail(format_args!("no board, or no robot"))
    };
    let (flash, mut link) = board.split();
    let controller = CONTROLLER.insert(Controller::new(nominal, flash, board::processor()));
    let (mut control_loop, foreground) = HANDOVER.split(&controller.current());
    let (received_in, mut received) = RECEIVED.split();
    link.start(foreground, received_in);

    loop {
        if let Some(state) = control_loop.state() {
            controller.set_control(state);
        }
        if control_loop.ready()
            && let Some(parameters) = controller.take_switch()
        {
            // There is room: nobody else fills the queue.
            let _ = control_loop.hand_over(parameters);
        }
        let busy = if let Some(byte) = received.dequeue() {
            controller.set_overrun(board::overrun());
            if let Some(answer) = controller.receive(byte) {
                link.send(&answer);
            }
            true
        } else {
            controller.idle()
        };
        control_loop.set_calibrating(controller.calibrating());
        if !busy {
            // A byte that came since the queue was found empty waits for the next turn at most.
            board::wait();
        }
    }
}
