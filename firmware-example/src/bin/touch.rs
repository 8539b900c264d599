//! A controller that calibrates its robot by itself: a touch probe replaces the tool, and someone puts gauge blocks on
//! the plate below it. No computer is needed, and no position is measured.
//!
//! See `docs/controller.md`. Adapt the constants, `small/mod.rs` (board) and `small/plant.rs` (the machine).

#![no_std]
#![no_main]

#[path = "small/mod.rs"]
mod small;

use delta_cal::observations::{
    FkmCalibrator, Height, Instruments, Observation, ObservationNoise, Plane,
};
use delta_cal::{Noise, Progress, Refusal, Robot, Settings, Tolerance};
use small::{Store, conclude, fail, go, probe, with};
use static_cell::StaticCell;

/// The heights of the gauge blocks; the plate itself is the first. Millimetres.
const BLOCKS: [f32; 3] = [0.0, 50.0, 100.0];
/// Actual heights at the first attempt: a chip is under the second block.
const WITH_CHIP: [f32; 3] = [0.0, 50.8, 100.0];
/// Positions of the blocks, one after the other, mm.
const X: [f32; 12] = [
    0.0, 60.0, -50.0, 10.0, 120.0, 85.0, 0.0, -85.0, -120.0, -85.0, 0.0, 85.0,
];
const Y: [f32; 12] = [
    0.0, 0.0, 20.0, -70.0, 0.0, 85.0, 120.0, 85.0, 0.0, -85.0, -120.0, -85.0,
];
const TOUCHES: usize = BLOCKS.len() * X.len();
/// Other positions and another block, to check the result.
const CHECKS: [[f32; 2]; 3] = [[70.0, 45.0], [-95.0, 20.0], [30.0, -100.0]];
const CHECK_BLOCK: f32 = 75.0;

/// The height of the plate, mm, and the combined uncertainty of plate and robot: the probe starts this far above the
/// block, and gives up this far below.
const PLATE: f32 = -500.0;
const SEARCH: f32 = 4.0;
/// Retraction of the probe after the first touch, mm.
const BACK: f32 = 0.1;
/// Speeds, mm/s: to the block, to the first touch, and to the second, which the loop's turns resolve to 1 µm.
const FAST: f32 = 200.0;
const SLOW: f32 = 10.0;
const CREEP: f32 = 1.0;
/// σ of a touch, mm.
const REPEATABILITY: f32 = 0.005;

/// Touches and solver, for the robot's 24 parameters and the plate's three.
type Calibrator = FkmCalibrator<f32, TOUCHES, 27>;

#[cortex_m_rt::entry]
fn main() -> ! {
    small::run(attempt, errors)
}

/// Calibrates until no chip is in the way.
fn attempt(drawn: &Robot<f32>, store: &mut Store) {
    static CALIBRATOR: StaticCell<Calibrator> = StaticCell::new();
    let calibrator = prepare(&CALIBRATOR, drawn);
    for blocks in [WITH_CHIP, BLOCKS] {
        calibrator.reset();
        measure(calibrator, &blocks);
        conclude(store, &calibrate(calibrator));
    }
}

/// In place. Inlined, what is moved there would take 3,000 bytes of stack for ever.
#[inline(never)]
fn prepare(place: &'static StaticCell<Calibrator>, drawn: &Robot<f32>) -> &'static mut Calibrator {
    let Some((instruments, settings)) = known() else {
        fail("no noise or tolerance")
    };
    place.init_with(|| match Calibrator::new(drawn, &instruments, &settings) {
        Ok(made) => made,
        Err(_) => fail("no room for the instruments"),
    })
}

/// Prior knowledge: the probe's repeatability and the manufacturing tolerance.
fn known() -> Option<(Instruments<'static, f32>, Settings<f32>)> {
    let positions = Noise::new(REPEATABILITY, 0.0).ok()?;
    let noise = ObservationNoise::new(positions, REPEATABILITY, REPEATABILITY).ok()?;
    let instruments = Instruments {
        planes: &[Plane {
            known: None,
            level: None,
        }],
        ..Instruments::new(noise)
    };
    let tolerance = Tolerance::new(0.5, 0.0035).ok()?;
    Some((instruments, Settings::new().with_tolerance(tolerance)))
}

/// The joint angles at which the probe touches a block of this height.
fn touch([x, y]: [f32; 2], block: f32) -> [f32; 3] {
    let top = PLATE + block;
    go([x, y, top + SEARCH], FAST);
    let end = [x, y, top - SEARCH];
    let touched = probe(end, SLOW).and_then(|(_, z)| {
        go([x, y, z + BACK], SLOW);
        probe(end, CREEP)
    });
    go([x, y, top + 10.0 * SEARCH], FAST);
    touched.map_or_else(|| fail("the probe touched nothing"), |(joints, _)| joints)
}

/// Touches every block at every position.
fn measure(calibrator: &mut Calibrator, standing: &[f32; 3]) {
    for (height, stands) in BLOCKS.iter().zip(standing) {
        with(|machine| machine.plant.block = *stands);
        for (x, y) in X.into_iter().zip(Y) {
            let height = Some(Height {
                plane: 0,
                height: *height,
            });
            let observation = Observation {
                height,
                ..Observation::at(touch([x, y], *stands))
            };
            if calibrator.add(&observation).is_err() {
                fail("a touch is not usable");
            }
        }
    }
}

/// In bounded steps, while the control loop runs in its interrupt. Inlined, it takes 850 bytes more of stack.
#[inline(never)]
fn calibrate(calibrator: &mut Calibrator) -> Result<Robot<f32>, Refusal> {
    calibrator.solve()?;
    while calibrator.step() == Progress::Working {}
    Ok(calibrator.outcome()?.robot.clone())
}

/// The largest error of each robot: the height of a block is known.
fn errors(robots: [&Robot<f32>; 2]) -> [f32; 2] {
    let mut worst = [0.0; 2];
    for place in CHECKS {
        let [low, high] = [0.0, CHECK_BLOCK].map(|block| {
            with(|machine| machine.plant.block = block);
            touch(place, block)
        });
        for (worst, robot) in worst.iter_mut().zip(robots) {
            if let (Ok(low), Ok(high)) = (robot.forward(&low), robot.forward(&high)) {
                *worst = (high.z - low.z - CHECK_BLOCK).abs().max(*worst);
            }
        }
    }
    worst
}
