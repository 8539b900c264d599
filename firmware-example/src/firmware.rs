//! Starts the control loop and does everything else in the background.

use crate::Number;
use crate::board::{self, Board, Flash, Link};
use crate::faults::fail;
use delta_cal::Robot;
use delta_cal_firmware_example::{Background, Controller, Handover, StreamFlash, nominal};
use heapless::spsc::{Consumer, Queue};
use static_cell::StaticCell;

type Firmware = Controller<Number, &'static mut Flash, &'static mut StreamFlash>;

/// The state of the background.
struct Idle {
    controller: &'static mut Firmware,
    control_loop: Background<'static, Number>,
    received: Consumer<'static, u8>,
    link: Link,
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static CONTROLLER: StaticCell<Firmware> = StaticCell::new();
    static mut HANDOVER: Handover<Number> = Handover::new();
    static mut RECEIVED: Queue<u8, 1024> = Queue::new();

    let mut idle = start(&CONTROLLER, HANDOVER, RECEIVED);
    loop {
        if !idle.step() {
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
    received: &'static mut Queue<u8, 1024>,
) -> Idle {
    let (Some(board), Ok(nominal)) = (Board::take(), nominal()) else {
        fail(format_args!("started twice, or without a robot"))
    };
    let (flash, stream_flash, mut link) = board.split();
    let controller = place(memory, &nominal, flash, stream_flash);
    controller.resume();
    let (control_loop, foreground) = handover.split(&controller.current());
    let (received_in, received) = received.split();
    link.start(foreground, received_in);
    Idle {
        controller,
        control_loop,
        received,
        link,
    }
}

#[inline(never)]
fn place(
    memory: &'static StaticCell<Firmware>,
    nominal: &Robot<Number>,
    flash: &'static mut Flash,
    stream_flash: &'static mut StreamFlash,
) -> &'static mut Firmware {
    memory.init_with(|| Controller::new(*nominal, flash, stream_flash, board::processor()))
}

impl Idle {
    /// Processes one byte or does one step of background work; returns whether there is more.
    fn step(&mut self) -> bool {
        if let Some(state) = self.control_loop.state() {
            self.controller.set_control(state);
        }
        if self.control_loop.ready()
            && let Some(parameters) = self.controller.take_switch()
        {
            // There is room: nothing else fills the queue.
            let _ = self.control_loop.hand_over(parameters);
        }
        let more = match self.received.dequeue() {
            Some(byte) => {
                self.take_in(byte);
                true
            }
            None => self.controller.idle(),
        };
        self.control_loop
            .set_calibrating(self.controller.calibrating());
        more
    }

    #[inline(never)]
    fn take_in(&mut self, byte: u8) {
        self.controller.set_overrun(board::overrun());
        if let Some(answer) = self.controller.receive(byte) {
            self.link.send(&answer);
        }
    }
}
