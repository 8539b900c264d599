//! Shared by both small programs: the control loop in an interrupt, a parameter store, a display.

#![allow(dead_code)] // each program uses a part

pub(crate) mod plant;

use core::cell::RefCell;
use core::mem::MaybeUninit;
use cortex_m::peripheral::SCB;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio;
use critical_section::Mutex;
use delta_cal::nalgebra::Vector3;
use delta_cal::{Refusal, Robot};
use delta_cal_firmware_example::{ControlLoop, Halves, Path, RamFlash, TURNS_A_SECOND};
use plant::Plant;

/// Core clock. Hertz.
const CLOCK: u32 = 25_000_000;
const TICKS_A_TURN: u32 = CLOCK / TURNS_A_SECOND;

/// Straight to a target, at most `step` per turn. Replace by your motion planner.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    point: Vector3<f32>,
    target: Vector3<f32>,
    step: f32,
}

impl Path<f32> for Line {
    fn next_point(&mut self) -> Vector3<f32> {
        let way = self.target - self.point;
        let length = way.norm();
        self.point = if length > self.step {
            self.point + way * (self.step / length)
        } else {
            self.target
        };
        self.point
    }
}

/// Data of the interrupt.
pub(crate) struct Machine {
    control_loop: ControlLoop<f32, Line>,
    pub(crate) plant: Plant,
    /// Whether the probe stops the platform, and where it did.
    armed: bool,
    touched: Option<([f32; 3], f32)>,
    /// The longest time from a turn's due time to its end. Ticks.
    longest: u32,
}

/// Zero-initialised, unlike an `Option`, so it takes no flash.
#[repr(u8)]
#[allow(clippy::large_enum_variant)] // a single one, in static memory
enum Slot {
    Vacant = 0,
    Running(Machine),
}

static MACHINE: Mutex<RefCell<Slot>> = Mutex::new(RefCell::new(Slot::Vacant));

/// Only the processor's own interrupts are used: the vector table ends here.
#[allow(unsafe_code)] // attributes that place it
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [usize; 1] = [0];

/// A turn of the control loop.
#[exception]
fn SysTick() {
    with(|machine| {
        let joints = *machine.control_loop.turn();
        if machine.armed && machine.plant.touches(&joints) {
            machine.armed = false;
            let line = machine.control_loop.path_mut();
            line.target = line.point;
            machine.touched = Some((joints, line.point.z));
        }
        let late = TICKS_A_TURN - 1 - cortex_m::peripheral::SYST::get_current();
        machine.longest = machine.longest.max(late);
    });
}

/// Runs something the interrupt must not see half done; a few instructions.
pub(crate) fn with<R: Default>(work: impl FnOnce(&mut Machine) -> R) -> R {
    critical_section::with(|section| match &mut *MACHINE.borrow_ref_mut(section) {
        Slot::Vacant => R::default(),
        Slot::Running(machine) => work(machine),
    })
}

/// Starts the control loop.
pub(crate) fn start(robot: &Robot<f32>, plant: Plant) {
    let home = Vector3::new(0.0, 0.0, -350.0);
    let line = Line {
        point: home,
        target: home,
        step: 0.0,
    };
    let machine = Machine {
        control_loop: ControlLoop::with_path(robot, line),
        plant,
        armed: false,
        touched: None,
        longest: 0,
    };
    critical_section::with(|section| *MACHINE.borrow_ref_mut(section) = Slot::Running(machine));
    let Some(core) = cortex_m::Peripherals::take() else {
        fail("started twice")
    };
    let mut timer = core.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS_A_TURN - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Moves in a straight line at a speed (mm/s), and returns when the platform is there.
pub(crate) fn go([x, y, z]: [f32; 3], speed: f32) {
    with(|machine| {
        let line = machine.control_loop.path_mut();
        line.target = Vector3::new(x, y, z);
        line.step = speed / 1000.0;
    });
    while !with(|machine| {
        let line = machine.control_loop.path_mut();
        line.point == line.target
    }) {
        cortex_m::asm::wfi();
    }
}

/// Moves until the probe touches: the joint angles and the height of the touch. `None` without a touch.
pub(crate) fn probe(to: [f32; 3], speed: f32) -> Option<([f32; 3], f32)> {
    with(|machine| {
        machine.touched = None;
        machine.armed = true;
    });
    go(to, speed);
    with(|machine| {
        machine.armed = false;
        machine.touched
    })
}

/// The joint angles at the current position.
pub(crate) fn joints() -> [f32; 3] {
    with(|machine| *machine.control_loop.joints())
}

/// Stores new parameters and hands them to the control loop, which blends over within half a second.
pub(crate) fn take_over(store: &mut Store, robot: &Robot<f32>) {
    if !save(store, robot) {
        fail("not stored");
    }
    show("calibrated and stored", 0);
    while !with(|machine| machine.control_loop.switch_to(robot)) {}
    while with(|machine| machine.control_loop.switching()) {
        cortex_m::asm::wfi();
    }
}

/// Stands for two pages of flash: memory that survives a reset.
pub(crate) type Store = Halves<&'static mut RamFlash<4096>>;

#[repr(C)]
struct Retained {
    mark: u32,
    flash: RamFlash<4096>,
}

const MARK: u32 = 0x64_63_73_6d;
/// Mark of a parameter record: program and version. Change it with the designed robot.
const RECORD: u32 = 0x64_63_00_01;
const NUMBERS: usize = 24;

/// The store, once.
pub(crate) fn store() -> Store {
    #[allow(unsafe_code)] // the attribute that places it
    #[unsafe(link_section = ".storage")]
    static mut RETAINED: MaybeUninit<Retained> = MaybeUninit::uninit();
    // SAFETY: both programs call this once, before anything else. Any bits are a valid `Retained`.
    #[allow(unsafe_code)]
    let retained = unsafe { &mut *(&raw mut RETAINED).cast::<Retained>() };
    if retained.mark != MARK {
        retained.flash = RamFlash::new();
        retained.mark = MARK;
    }
    Halves::new(&mut retained.flash, RECORD, 4 * NUMBERS)
}

/// The stored parameters.
pub(crate) fn load(store: &mut Store) -> Option<Robot<f32>> {
    let mut bytes = [0; 4 * NUMBERS];
    let content = store.load(&mut bytes).ok()??;
    let mut parameters = [[0.0; 8]; 3];
    for (number, bytes) in parameters
        .as_flattened_mut()
        .iter_mut()
        .zip(content.as_chunks().0)
    {
        *number = f32::from_le_bytes(*bytes);
    }
    Robot::from_parameters(parameters).ok()
}

/// Stores parameters; returns whether they are certainly stored.
fn save(store: &mut Store, robot: &Robot<f32>) -> bool {
    let mut bytes = [0; 4 * NUMBERS];
    for (place, number) in bytes
        .as_chunks_mut()
        .0
        .iter_mut()
        .zip(robot.parameters().as_flattened())
    {
        *place = number.to_le_bytes();
    }
    store.save(&bytes).is_ok()
}

/// Displays a line: a text and a number. Replace by your display.
pub(crate) fn show(text: &str, number: u32) {
    let mut digits = [b'0'; 12];
    let (mut rest, mut first) = (number, digits.len() - 1);
    digits[first] = b'\n';
    loop {
        first -= 1;
        let [digit, ..] = (rest % 10).to_le_bytes();
        digits[first] += digit;
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    if let Ok(mut console) = hio::hstdout() {
        let _ = console.write_all(text.as_bytes());
        let _ = console.write_all(b" ");
        let _ = console.write_all(&digits[first..]);
    }
}

/// Displays the error of a robot.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // far below a kilometre, not negative
pub(crate) fn show_error(text: &str, millimetres: f32) {
    show(text, (1000.0 * millimetres) as u32);
}

/// Displays why a calibration is refused, and the arm at fault: 1, 2, 3, or 0 for none.
#[allow(clippy::cast_possible_truncation)] // 0, 1, 2
pub(crate) fn show_refusal(refusal: Refusal) {
    show("refused, status:", refusal.code().into());
    show(
        "arm:",
        refusal.arm().map_or(0, |arm| arm.index() as u32 + 1),
    );
}

/// Displays the longest turn of the control loop, and ends the emulation.
pub(crate) fn end() -> ! {
    show_longest_turn();
    loop {
        debug::exit(EXIT_SUCCESS);
    }
}

/// The same, then power-cycles.
pub(crate) fn restart() -> ! {
    show_longest_turn();
    SCB::sys_reset()
}

/// One of 25,000 ticks is missed.
fn show_longest_turn() {
    let longest = with(|machine| machine.longest);
    show("longest turn, ticks of 25000:", longest);
}

pub(crate) fn fail(why: &str) -> ! {
    show(why, 0);
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo<'_>) -> ! {
    fail("panic")
}

// `cortex-m-rt` requires these two to be `unsafe fn`; neither does anything unsafe.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    fail("hard fault: the stack is full?")
}
