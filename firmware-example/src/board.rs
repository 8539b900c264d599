//! The board: Arm's MPS2 with a Cortex-M4F (AN386) or a Cortex-M7 (AN500), under QEMU. All board-specific code is in
//! this file and in `emulated.rs`; replace them for another board.
//!
//! SysTick interrupts a thousand times a second for the control loop, with the highest priority. The UART's interrupt
//! only moves bytes. A timer runs freely for measurements.

use crate::Number;
use crate::emulated::{self, CLOCK, Flash};
use core::cell::Cell;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use defmt_semihosting as _;
use delta_cal::Real;
use delta_cal_controller::{Foreground, Timer};
use delta_cal_firmware_example::Circle;
use heapless::spsc::Producer;

const BAUD: u32 = 115_200;

/// Takes the board, once: the flash, the serial link, and CPUID of the core, which distinguishes the two boards.
pub(crate) fn take() -> (&'static mut Flash, Link, u32) {
    let (core, flash) = emulated::take();
    let processor = core.CPUID.base.read();
    (flash, Link { core }, processor)
}

/// Called when idle until the next interrupt.
///
/// A real board would sleep here: `cortex_m::asm::wfi()`. QEMU's instruction-counting clock runs too far ahead when the
/// processor sleeps (by a whole turn with `sleep=off`), so turns would appear late.
pub(crate) fn wait() {
    cortex_m::asm::nop();
}

/// The free-running timer.
struct Ticks;

impl Timer for Ticks {
    const TICKS_A_SECOND: u32 = CLOCK;
    const MASK: u32 = u32::MAX;

    fn now(&self) -> u32 {
        // It counts down.
        Self::MASK - read(TIMER_VALUE)
    }
}

/// Registers of the Arm CMSDK UART, 32 bits each.
const UART_DATA: usize = 0x4000_4000;
const UART_STATE: usize = 0x4000_4004;
const UART_CONTROL: usize = 0x4000_4008;
const UART_INTERRUPT: usize = 0x4000_400c;
const UART_DIVIDER: usize = 0x4000_4010;
const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 1 << 1;
const RECEIVE_OVERRUN: u32 = 1 << 3;
const TRANSMIT_ENABLE: u32 = 1;
const RECEIVE_ENABLE: u32 = 1 << 1;
const RECEIVE_INTERRUPT_ENABLE: u32 = 1 << 3;
const RECEIVE_INTERRUPT: u32 = 1 << 1;

/// Registers of the CMSDK timer.
const TIMER_CONTROL: usize = 0x4000_0000;
const TIMER_VALUE: usize = 0x4000_0004;
const TIMER_RELOAD: usize = 0x4000_0008;
const TIMER_ENABLE: u32 = 1;

fn read(register: usize) -> u32 {
    // SAFETY: the addresses are those of the board's peripherals, aligned, and not memory.
    #[allow(unsafe_code)]
    unsafe {
        ptr::with_exposed_provenance::<u32>(register).read_volatile()
    }
}

fn write(register: usize, value: u32) {
    // SAFETY: as for `read`.
    #[allow(unsafe_code)]
    unsafe {
        ptr::with_exposed_provenance_mut::<u32>(register).write_volatile(value);
    }
}

/// The UART's interrupt, the only one of the board in use: number 0.
#[derive(Clone, Copy)]
struct Received;

// SAFETY: the number is the board's.
#[allow(unsafe_code)]
unsafe impl InterruptNumber for Received {
    fn number(self) -> u16 {
        0
    }
}

/// The board's part of the vector table; `cortex-m-rt` puts the processor's before it.
#[allow(unsafe_code)] // attributes that place it
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [extern "C" fn(); 1] = [receive];

type Control = Foreground<'static, Number, Circle<Number>>;

static CONTROL: Mutex<Cell<Option<Control>>> = Mutex::new(Cell::new(None));
static RECEIVED: Mutex<Cell<Option<Producer<'static, u8>>>> = Mutex::new(Cell::new(None));

static OVERRUN: AtomicU32 = AtomicU32::new(0);

/// The joint targets for the drives, as bits of `f32`. A real board writes them to its motor controllers.
static TARGETS: [AtomicU32; 3] = [const { AtomicU32::new(0) }; 3];

fn drive(joints: &[Number; 3]) {
    for (target, joint) in TARGETS.iter().zip(joints) {
        target.store(f32::from_f64(joint.to_f64()).to_bits(), Ordering::Relaxed);
    }
}

/// Bytes lost because the UART or the queue behind it was full.
pub(crate) fn overrun() -> u32 {
    OVERRUN.load(Ordering::Relaxed)
}

/// The serial link.
pub(crate) struct Link {
    core: cortex_m::Peripherals,
}

impl Link {
    /// Enables the interrupts: the control loop runs and bytes are received from now on.
    pub(crate) fn start(&mut self, control_loop: Control, received: Producer<'static, u8>) {
        critical_section::with(|section| {
            CONTROL.borrow(section).set(Some(control_loop));
            RECEIVED.borrow(section).set(Some(received));
        });
        write(UART_DIVIDER, CLOCK / BAUD);
        write(
            UART_CONTROL,
            TRANSMIT_ENABLE | RECEIVE_ENABLE | RECEIVE_INTERRUPT_ENABLE,
        );
        write(TIMER_RELOAD, u32::MAX);
        write(TIMER_VALUE, u32::MAX);
        write(TIMER_CONTROL, TIMER_ENABLE);
        // SAFETY: everything the interrupt uses is set up, and no critical section depends on its priority, which is
        // below that of the control loop.
        #[allow(unsafe_code)]
        unsafe {
            self.core.NVIC.set_priority(Received, 0x40);
            NVIC::unmask(Received);
        }
        emulated::start_turns(&mut self.core.SYST);
    }

    /// Sends bytes, waiting for the UART; only the background waits here.
    #[allow(clippy::unused_self)] // proof of being the only sender
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            while read(UART_STATE) & TRANSMIT_FULL != 0 {}
            write(UART_DATA, u32::from(*byte));
        }
    }
}

#[cortex_m_rt::exception]
fn SysTick() {
    static mut CONTROL_LOOP: Option<Control> = None;
    if CONTROL_LOOP.is_none() {
        *CONTROL_LOOP = critical_section::with(|section| CONTROL.borrow(section).take());
    }
    if let Some(control_loop) = CONTROL_LOOP {
        control_loop.turn(&Ticks, drive);
    }
}

/// The UART's interrupt.
extern "C" fn receive() {
    let mut queue = critical_section::with(|section| RECEIVED.borrow(section).take());
    write(UART_INTERRUPT, RECEIVE_INTERRUPT);
    let mut lost = 0;
    while read(UART_STATE) & RECEIVE_FULL != 0 {
        let [byte, ..] = read(UART_DATA).to_le_bytes();
        if let Some(queue) = &mut queue
            && queue.enqueue(byte).is_err()
        {
            lost += 1;
        }
    }
    if read(UART_STATE) & RECEIVE_OVERRUN != 0 {
        write(UART_STATE, RECEIVE_OVERRUN);
        lost += 1;
    }
    critical_section::with(|section| RECEIVED.borrow(section).set(queue));
    OVERRUN.fetch_add(lost, Ordering::Relaxed);
}
