//! A controller that calibrates its robot arm by arm from measured positions: any number of samples in constant memory.
//! A tracker or a camera measures the platform's position in the robot's frame.
//!
//! See `docs/controller.md`. Adapt the constants, `small/mod.rs` (board) and `small/plant.rs` (the machine).

#![no_std]
#![no_main]

#[path = "small/mod.rs"]
mod small;

use delta_cal::{
    IkmCalibrator, Noise, Progress, Real, Refusal, Robot, Sample, Settings, Tolerance,
};
use small::{Store, conclude, fail, go, joints, with};

const SAMPLES: u8 = 40;
/// Slip of the tracker's reflector at each attempt, mm: at the first attempt it is loose.
const SLIPS: [f32; 2] = [0.4, 0.0];
const CHECKS: u8 = 10;
/// Speed, mm/s.
const SPEED: f32 = 400.0;

#[cortex_m_rt::entry]
fn main() -> ! {
    small::run(attempt, errors)
}

/// Calibrates until nothing slips. The calibrator is constructed in place on the stack.
fn attempt(drawn: &Robot<f32>, store: &mut Store) {
    let Some(settings) = settings() else {
        fail("settings")
    };
    let mut calibrator = IkmCalibrator::new(drawn, &settings);
    for slip in SLIPS {
        with(|machine| machine.plant.slip = slip);
        calibrator.reset();
        conclude(store, &calibrate(&mut calibrator));
    }
}

/// Prior knowledge: measurement noise and manufacturing tolerance. Without the tolerance, swapped joints or wrong units
/// would go unnoticed.
fn settings() -> Option<Settings<f32>> {
    let noise = Noise::new(0.02, 0.0).ok()?;
    let tolerance = Tolerance::new(0.5, 0.0035).ok()?;
    Some(Settings::new().with_noise(noise).with_tolerance(tolerance))
}

/// Moves to one of many poses and measures there.
fn measure(pose: u8) -> Sample<f32> {
    let turn = 2.4 * f32::from(pose);
    let (sine, cosine) = turn.sine_cosine();
    let (radius, _) = (1.7 * turn).sine_cosine();
    let height = -440.0 + 60.0 * (0.3 * turn).sine_cosine().0;
    go(
        [130.0 * radius * cosine, 130.0 * radius * sine, height],
        SPEED,
    );
    let joints = joints();
    match with(|machine| machine.plant.position(&joints)) {
        Some(position) => Sample { joints, position },
        None => fail("no samples"),
    }
}

/// In bounded steps, while the control loop runs in its interrupt.
fn calibrate(calibrator: &mut IkmCalibrator<f32>) -> Result<Robot<f32>, Refusal> {
    for pose in 0..SAMPLES {
        if calibrator.add(&measure(pose)).is_err() {
            fail("bad sample");
        }
    }
    calibrator.solve()?;
    while calibrator.step() == Progress::Working {}
    Ok(calibrator.outcome()?.robot.clone())
}

/// The largest error of each robot at positions not used for calibration.
fn errors(robots: [&Robot<f32>; 2]) -> [f32; 2] {
    let mut worst = [0.0; 2];
    for pose in 100..100 + CHECKS {
        let Sample { joints, position } = measure(pose);
        for (worst, robot) in worst.iter_mut().zip(robots) {
            if let Ok(computed) = robot.forward(&joints) {
                let off = (computed - position).norm_squared().square_root();
                *worst = worst.larger(off);
            }
        }
    }
    worst
}
