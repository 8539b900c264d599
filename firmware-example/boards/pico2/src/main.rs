//! The controller on a Raspberry Pi Pico 2 (RP2350): its UART, its flash, and the control loop in an interrupt above
//! everything but the clock.
//!
//! ```text
//! cd firmware-example/boards/pico2
//! cargo build --release
//! picotool load -u -v -x -t elf target/thumbv8m.main-none-eabihf/release/delta-cal-pico2
//! delta-cal device --port /dev/ttyUSB0 status
//! ```
//!
//! UART 0 on GPIO 0 (transmit) and GPIO 1 (receive), 115,200 bits per second. The last 24 KiB of the first 2 MiB of flash hold
//! the parameters and the samples of a session.

#![no_std]
#![no_main]

use core::cell::RefCell;
use cortex_m_rt as _;
use delta_cal_controller::{Controller, Foreground, Handover, Timer};
use delta_cal_firmware_example::{Circle, TURNS_A_SECOND, limits, machine};
use embassy_embedded_hal::flash::partition::BlockingPartition;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embassy_rp::bind_interrupts;
use embassy_rp::flash::{Blocking, ERASE_SIZE, Flash};
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::peripherals::{FLASH, UART0};
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUart, Config, Error};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_time::{Duration, Instant};
use embedded_io_async::{Read, Write};
use panic_halt as _;
use static_cell::{ConstStaticCell, StaticCell};

/// As much of the flash as is used.
const FLASH_SIZE: usize = 2 * 1024 * 1024;
/// Two halves of a page.
const PARAMETERS: u32 = 2 * ERASE_SIZE as u32;
/// Two halves of 8 KiB.
const SAMPLES: u32 = 2 * 8 * 1024;

type Chip = RefCell<Flash<'static, FLASH, Blocking, FLASH_SIZE>>;
type Region = BlockingPartition<'static, NoopRawMutex, Flash<'static, FLASH, Blocking, FLASH_SIZE>>;

bind_interrupts!(struct Irqs {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
});

/// Microseconds since the start.
struct Clock;

impl Timer for Clock {
    const TICKS_A_SECOND: u32 = 1_000_000;
    const MASK: u32 = u32::MAX;

    #[allow(clippy::cast_possible_truncation)] // it runs around
    fn now(&self) -> u32 {
        Instant::now().as_micros() as u32
    }
}

static CONTROL: InterruptExecutor = InterruptExecutor::new();

#[embassy_rp::interrupt]
#[allow(unsafe_code, non_snake_case)]
unsafe fn SWI_IRQ_1() {
    // SAFETY: this is the interrupt that the executor was started with.
    unsafe { CONTROL.on_interrupt() }
}

/// The control loop. Its targets would go to the drives.
#[embassy_executor::task]
async fn control_loop(mut foreground: Foreground<'static, f32, Circle<f32>>) {
    let period = Duration::from_hz(TURNS_A_SECOND.into());
    let mut due = Instant::now();
    loop {
        // A `Ticker` makes up at once for what it missed while the flash was erased.
        while due <= Instant::now() {
            due += period;
        }
        embassy_time::Timer::at(due).await;
        foreground.turn(&Clock, |_joints| {});
    }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    static CHIP: StaticCell<Mutex<NoopRawMutex, Chip>> = StaticCell::new();
    static CONTROLLER: StaticCell<Controller<f32, Region, Region>> = StaticCell::new();
    static HANDOVER: StaticCell<Handover<f32>> = StaticCell::new();
    static RECEIVED: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
    static SENT: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

    let board = embassy_rp::init(embassy_rp::config::Config::default());
    let flash = Flash::new_blocking(board.FLASH);
    let chip = CHIP.init(Mutex::new(RefCell::new(flash)));
    let end = FLASH_SIZE as u32;
    let parameters = BlockingPartition::new(chip, end - PARAMETERS, PARAMETERS);
    let samples = BlockingPartition::new(chip, end - PARAMETERS - SAMPLES, SAMPLES);

    // CPUID, which tells processors apart.
    let processor = cortex_m::Peripherals::take().map_or(0, |core| core.CPUID.base.read());
    // The robot of the example is one.
    let Ok(machine) = machine(processor) else {
        return;
    };
    let controller = CONTROLLER.init_with(|| Controller::new(machine, parameters, samples));
    controller.resume();
    let handover = HANDOVER.init(Handover::default());
    // Where the joints are, which encoders would say.
    let (mut background, foreground) = handover.split(
        &controller.current(),
        Circle::default(),
        &limits(),
        [0.0; 3],
    );

    // Above the loop is only the clock, which wakes it.
    interrupt::UART0_IRQ.set_priority(Priority::P3);
    interrupt::SWI_IRQ_1.set_priority(Priority::P1);
    let control = CONTROL.start(interrupt::SWI_IRQ_1);
    if let Ok(task) = control_loop(foreground) {
        control.spawn(task);
    }

    let (sent, received) = (SENT.take(), RECEIVED.take());
    let mut uart = BufferedUart::new(
        board.UART0,
        board.PIN_0,
        board.PIN_1,
        Irqs,
        sent,
        received,
        Config::default(),
    );
    let mut buffer = [0; 64];
    loop {
        // Only `read` turns the receiver on again after an error of the line, such as a break: it is always asked.
        let count = match select(uart.read(&mut buffer), yield_now()).await {
            Either::First(Ok(count)) => count,
            Either::First(Err(Error::Overrun)) => {
                let lost = &mut controller.counters.overrun;
                *lost = lost.wrapping_add(1);
                0
            }
            _ => 0,
        };
        for byte in &buffer[..count] {
            if let Some(answer) = controller.receive(*byte) {
                let _ = uart.write_all(&answer).await;
            }
            background.exchange(controller);
        }
        if count == 0 {
            controller.idle();
            background.exchange(controller);
        }
    }
}
