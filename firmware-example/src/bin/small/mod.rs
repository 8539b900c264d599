//! Shared by both small programs: the control loop in an interrupt, a parameter store, a display.

#![allow(dead_code)] // each program uses a part

pub(crate) mod plant;

#[path = "../../emulated.rs"]
mod emulated;
#[path = "../../faults.rs"]
mod faults;

pub(crate) use faults::fail;

use core::cell::RefCell;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m_rt::exception;
use cortex_m_semihosting::debug::{self, EXIT_SUCCESS};
use cortex_m_semihosting::hio;
use critical_section::Mutex;
use delta_cal::nalgebra::Vector3;
use delta_cal::{Real, Refusal, Robot};
use delta_cal_controller::{Halves, Limiter, Limits, ParameterFlash, Path};
use delta_cal_firmware_example::{TURNS_A_SECOND, nominal};
use emulated::TICKS_A_TURN;
use plant::Plant;

/// The simulated drives are at full speed within a turn. State the limits of yours.
const LIMITS: Limits<f32> = Limits {
    turns_a_second: TURNS_A_SECOND,
    blend_turns: 0,
    speed: 5.0,
    acceleration: 5000.0,
};

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
        let length = way.norm_squared().square_root();
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
    line: Line,
    robot: Robot<f32>,
    limiter: Limiter<f32>,
    pub(crate) plant: Plant,
    /// Whether the probe touches, if it stops the platform, and where it did. A function: `arms` contains none.
    probe: Option<fn(&Plant, &[f32; 3]) -> bool>,
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
        let line = &mut machine.line;
        let wanted = machine.robot.inverse(&line.next_point());
        if !wanted.is_ok_and(|joints| machine.limiter.follow(&joints)) {
            fail("out of reach, or too fast")
        }
        let joints = machine.limiter.joints;
        if (machine.probe).is_some_and(|touches| touches(&machine.plant, &joints)) {
            machine.probe = None;
            line.target = line.point;
            machine.touched = Some((joints, line.point.z));
        }
        let late = TICKS_A_TURN - 1 - SYST::get_current();
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
fn start(timer: &mut SYST, robot: &Robot<f32>, plant: Plant) {
    let home = Vector3::new(0.0, 0.0, -350.0);
    let line = Line {
        point: home,
        target: home,
        step: 0.0,
    };
    // Here the joints are at home. A real board reads where they are, and begins there.
    let Ok(joints) = robot.inverse(&home) else {
        fail("home is out of reach")
    };
    let machine = Machine {
        line,
        robot: robot.clone(),
        limiter: Limiter::new(&LIMITS, joints),
        plant,
        probe: None,
        touched: None,
        longest: 0,
    };
    critical_section::with(|section| *MACHINE.borrow_ref_mut(section) = Slot::Running(machine));
    emulated::start_turns(timer);
}

/// Moves in a straight line at a speed (mm/s), and returns when the platform is there.
pub(crate) fn go([x, y, z]: [f32; 3], speed: f32) {
    with(|machine| {
        let line = &mut machine.line;
        line.target = Vector3::new(x, y, z);
        line.step = speed / 1000.0;
    });
    while !with(|machine| {
        let line = &mut machine.line;
        line.point.as_slice() == line.target.as_slice()
    }) {
        cortex_m::asm::wfi();
    }
}

/// Moves until the probe touches: the joint angles and the height of the touch. `None` without a touch.
pub(crate) fn probe(to: [f32; 3], speed: f32) -> Option<([f32; 3], f32)> {
    with(|machine| {
        machine.touched = None;
        machine.probe = Some(Plant::touches);
    });
    go(to, speed);
    with(|machine| {
        machine.probe = None;
        machine.touched
    })
}

/// The joint angles at the current position.
pub(crate) fn joints() -> [f32; 3] {
    with(|machine| machine.limiter.joints)
}

/// Stores new parameters, for the next start.
fn take_over(store: &mut Store, robot: &Robot<f32>) {
    let mut bytes = [0; size_of::<Parameters>()];
    let parameters = robot.parameters();
    let places = bytes.as_chunks_mut().0.iter_mut();
    for (place, number) in places.zip(parameters.as_flattened()) {
        *place = number.to_le_bytes();
    }
    if store.save(&bytes).is_err() {
        fail("not stored");
    }
    show("calibrated and stored", 0);
}

pub(crate) type Store = Halves<&'static mut ParameterFlash>;
type Parameters = [[f32; 8]; 3];

/// Mark of a parameter record: program and version. Change it with the designed robot.
const RECORD: u32 = 0x64_63_00_01;

/// The stored parameters.
fn load(store: &mut Store) -> Option<Robot<f32>> {
    let mut bytes = [0; size_of::<Parameters>()];
    let content = store.load(&mut bytes).ok()??;
    let mut parameters = Parameters::default();
    let numbers = parameters.as_flattened_mut().iter_mut();
    for (number, bytes) in numbers.zip(content.as_chunks().0) {
        *number = f32::from_le_bytes(*bytes);
    }
    Robot::from_parameters(parameters).ok()
}

/// Displays a line: a text and a number. Replace by your display.
fn show(text: &str, number: u32) {
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

/// Takes over the result of a calibration, or displays why it is refused, with the arm at fault: 1, 2, 3, or 0 for none.
#[allow(clippy::cast_possible_truncation)] // 0, 1, 2
pub(crate) fn conclude(store: &mut Store, result: &Result<Robot<f32>, Refusal>) {
    match result {
        Ok(robot) => take_over(store, robot),
        Err(refusal) => {
            show("refused, status:", refusal.code().into());
            let arm = refusal.arm().map_or(0, |arm| arm.index() as u32 + 1);
            show("arm:", arm);
        }
    }
}

/// Calibrates, and restarts as after a power cut; with stored parameters displays the largest error of the designed and
/// of the calibrated robot, mm, and ends the emulation.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // far below a kilometre, not negative
pub(crate) fn run(
    calibrate: impl FnOnce(&Robot<f32>, &mut Store),
    errors: impl FnOnce([&Robot<f32>; 2]) -> [f32; 2],
) -> ! {
    let (mut core, flash) = emulated::take();
    let mut store = Halves::new(&mut flash.parameters, RECORD, size_of::<Parameters>());
    let Ok(drawn) = nominal() else {
        fail("no robot")
    };
    let stored = load(&mut store);
    let robot = stored.as_ref().unwrap_or(&drawn);
    start(&mut core.SYST, robot, Plant::new(&drawn));
    match &stored {
        None => calibrate(&drawn, &mut store),
        Some(calibrated) => {
            let [as_drawn, calibrated] = errors([&drawn, calibrated]);
            show("micrometres off as drawn:", (1000.0 * as_drawn) as u32);
            show("micrometres off calibrated:", (1000.0 * calibrated) as u32);
        }
    }
    let longest = with(|machine| machine.longest);
    show("longest turn, ticks of 25000:", longest);
    if stored.is_none() {
        SCB::sys_reset()
    }
    loop {
        debug::exit(EXIT_SUCCESS);
    }
}
