//! The board: Arm's MPS2 with a Cortex-M4F (AN386) or a Cortex-M7 (AN500), under QEMU. All board-specific code is in
//! this file; replace it for another board.
//!
//! A timer interrupts a thousand times a second for the control loop, with the highest priority. The UART's interrupt
//! only moves bytes. SysTick runs freely for measurements.

use crate::Number;
use core::cell::Cell;
use core::mem::MaybeUninit;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{CPUID, NVIC, SYST};
use critical_section::Mutex;
use defmt_semihosting as _;
use delta_cal::Real;
use delta_cal_firmware_example::{Foreground, ParameterFlash, StreamFlash, TURNS_A_SECOND, Timer};
use heapless::spsc::Producer;

/// Clock frequency of the core, its timers and its UARTs.
const CLOCK: u32 = 25_000_000;
const BAUD: u32 = 115_200;

/// Takes the board, once: the flash for parameters, the flash for samples, and the serial link.
pub(crate) fn take() -> Option<(&'static mut ParameterFlash, &'static mut StreamFlash, Link)> {
    let mut core = cortex_m::Peripherals::take()?;
    let timer = &mut core.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(SysTick::MASK);
    timer.clear_current();
    timer.enable_counter();
    let retained = retained();
    let link = Link { nvic: core.NVIC };
    Some((&mut retained.flash, &mut retained.stream_flash, link))
}

/// CPUID of the core, which distinguishes the two boards.
pub(crate) fn processor() -> u32 {
    // SAFETY: the register is read-only and reading it has no side effects.
    #[allow(unsafe_code)]
    let identification = unsafe { &*CPUID::PTR };
    identification.base.read()
}

/// Called when idle until the next interrupt.
///
/// A real board would sleep here: `cortex_m::asm::wfi()`. QEMU's instruction-counting clock runs too far ahead when the
/// processor sleeps (by a whole turn with `sleep=off`), so turns would appear late.
pub(crate) fn wait() {
    cortex_m::asm::nop();
}

/// Stands for two regions of flash: memory that survives a reset.
#[repr(C)] // the next firmware finds it in the same place
struct Retained {
    mark: u32,
    flash: ParameterFlash,
    stream_flash: StreamFlash,
}

/// Marks memory initialised since power-on.
const MARK: u32 = 0x64_63_61_6c;

#[allow(unsafe_code)] // attribute that places it
#[unsafe(link_section = ".uninit.flash")]
static mut RETAINED: MaybeUninit<Retained> = MaybeUninit::uninit();

fn retained() -> &'static mut Retained {
    // SAFETY: called only by `take`, which succeeds once. Any bits are a valid `Retained`.
    #[allow(unsafe_code)]
    let retained = unsafe { &mut *(&raw mut RETAINED).cast::<Retained>() };
    if retained.mark != MARK {
        retained.flash.bytes.fill(0xff);
        retained.stream_flash.bytes.fill(0xff);
        retained.mark = MARK;
    }
    retained
}

/// The free-running timer.
pub(crate) struct SysTick;

impl Timer for SysTick {
    const TICKS_A_SECOND: u32 = CLOCK;
    const MASK: u32 = 0x00ff_ffff;

    fn now(&self) -> u32 {
        // It counts down.
        Self::MASK - SYST::get_current()
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
const TIMER_INTERRUPT: usize = 0x4000_000c;
const TIMER_ENABLE: u32 = 1;
const TIMER_INTERRUPT_ENABLE: u32 = 1 << 3;

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

/// The interrupts used, with their numbers.
#[derive(Clone, Copy)]
#[allow(non_camel_case_types, clippy::upper_case_acronyms)] // as in the device manual
pub(crate) enum Interrupt {
    UART0_RX = 0,
    TIMER0 = 8,
}
use Interrupt as interrupt;

// SAFETY: the numbers are the board's.
#[allow(unsafe_code)]
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

#[allow(unsafe_code, missing_docs)]
mod vectors {
    unsafe extern "C" {
        fn UART0_RX();
        fn TIMER0();
        fn DefaultHandler();
    }

    /// The board's part of the vector table; `cortex-m-rt` puts its own before it.
    #[unsafe(link_section = ".vector_table.interrupts")]
    #[unsafe(no_mangle)]
    pub(super) static __INTERRUPTS: [unsafe extern "C" fn(); 32] = {
        let mut table: [unsafe extern "C" fn(); 32] = [DefaultHandler; 32];
        table[super::Interrupt::UART0_RX as usize] = UART0_RX;
        table[super::Interrupt::TIMER0 as usize] = TIMER0;
        table
    };
}

/// Hands each interrupt its data once.
fn taken<'a, T>(own: &'a mut Option<T>, handed: &Mutex<Cell<Option<T>>>) -> Option<&'a mut T> {
    if own.is_none() {
        *own = critical_section::with(|section| handed.borrow(section).take());
    }
    own.as_mut()
}

static CONTROL: Mutex<Cell<Option<Foreground<'static, Number>>>> = Mutex::new(Cell::new(None));
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
    nvic: NVIC,
}

impl Link {
    /// Enables the interrupts: the control loop runs and bytes are received from now on.
    pub(crate) fn start(
        &mut self,
        control_loop: Foreground<'static, Number>,
        received: Producer<'static, u8>,
    ) {
        critical_section::with(|section| {
            CONTROL.borrow(section).set(Some(control_loop));
            RECEIVED.borrow(section).set(Some(received));
        });
        write(UART_DIVIDER, CLOCK / BAUD);
        write(
            UART_CONTROL,
            TRANSMIT_ENABLE | RECEIVE_ENABLE | RECEIVE_INTERRUPT_ENABLE,
        );
        write(TIMER_RELOAD, CLOCK / TURNS_A_SECOND - 1);
        write(TIMER_VALUE, CLOCK / TURNS_A_SECOND - 1);
        write(TIMER_CONTROL, TIMER_ENABLE | TIMER_INTERRUPT_ENABLE);
        // SAFETY: everything the interrupts use is set up, and no critical section depends on their priorities.
        #[allow(unsafe_code)]
        unsafe {
            self.nvic.set_priority(Interrupt::TIMER0, 0x00);
            self.nvic.set_priority(Interrupt::UART0_RX, 0x40);
            NVIC::unmask(Interrupt::UART0_RX);
            NVIC::unmask(Interrupt::TIMER0);
        }
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

#[cortex_m_rt::interrupt]
fn TIMER0() {
    static mut CONTROL_LOOP: Option<Foreground<'static, Number>> = None;
    write(TIMER_INTERRUPT, 1);
    if let Some(control_loop) = taken(CONTROL_LOOP, &CONTROL) {
        control_loop.turn(&SysTick, drive);
    }
}

#[cortex_m_rt::interrupt]
fn UART0_RX() {
    static mut QUEUE: Option<Producer<'static, u8>> = None;
    let mut queue = taken(QUEUE, &RECEIVED);
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
    OVERRUN.fetch_add(lost, Ordering::Relaxed);
}
