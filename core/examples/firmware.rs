//! A calibration in a robot's own controller, interleaved with its control loop. Everything except `main` is `no_std`
//! and needs neither allocation nor an operating system; the same code runs on a Cortex-M. `main` simulates the robot
//! and its measuring device.
//!
//! ```text
//! cargo run -p delta-cal --example firmware
//! ```
//!
//! In the firmware's `Cargo.toml`:
//!
//! ```toml
//! [dependencies]
//! delta-cal = "0.1"
//!
//! [profile.release]
//! opt-level = 3
//! lto = "fat"
//! codegen-units = 1
//! ```
#![allow(clippy::print_stdout)]

use delta_cal::kinematics::KinematicsError;
use delta_cal::nalgebra::Vector3;
use delta_cal::robot::GeometryError;
use delta_cal::samples::AddError;
use delta_cal::{IkmCalibrator, Progress, Refusal, Robot, Sample, Settings};

/// The robot as designed, in flash: Dx, Dy, Dz, θ, α, La_x, La_y, Lb of each arm in mm and radians.
const DRAWN: [[f32; 8]; 3] = [
    [164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0],
    [-82.0, 142.028_17, 0.0, 2.094_395_2, 0.0, 260.0, 0.0, 480.0],
    [-82.0, -142.028_17, 0.0, 4.188_790_3, 0.0, 260.0, 0.0, 480.0],
];

/// Limits the linearisations per start, which bounds the time to a result.
const SETTINGS: Settings<f32> = Settings::new().with_iteration_limit(30);

/// The controller's static memory. The calibrator is the largest part, about 5 kB in `f32`.
struct Controller {
    /// The robot model used by the control loop.
    robot: Robot<f32>,
    calibrator: IkmCalibrator<f32>,
    /// The platform's target position.
    target: Vector3<f32>,
}

/// What a cycle of the control loop reports.
enum Report {
    /// Nothing: the control loop continues.
    Nothing,
    /// The robot was calibrated; the control loop uses the result from the next cycle on.
    Calibrated,
    /// The calibration was refused, with the reason. The robot keeps its parameters; more samples may help.
    Refused(Refusal),
}

impl Controller {
    fn new() -> Result<Self, GeometryError> {
        let robot = Robot::from_parameters(DRAWN)?;
        Ok(Self {
            robot,
            calibrator: IkmCalibrator::new(&robot, &SETTINGS),
            target: Vector3::new(0.0, 0.0, -450.0),
        })
    }

    /// Adds one measurement: joint angles in radians, platform position in mm.
    ///
    /// # Errors
    /// A non-finite number, an angle beyond two turns, or a position far outside: nothing has changed, and the next
    /// sample is welcome. During a calibration, [`AddError::Busy`].
    fn measured(&mut self, joints: [f32; 3], position: [f32; 3]) -> Result<(), AddError> {
        let position = Vector3::from(position);
        self.calibrator.add(&Sample { joints, position })
    }

    /// Starts a calibration from the samples so far.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    fn calibrate(&mut self) -> Result<(), Refusal> {
        self.calibrator.solve()
    }

    /// One cycle of the control loop, then one bounded step of the calibration.
    ///
    /// # Errors
    /// The target is unreachable: the drives keep their last angles.
    fn turn(&mut self) -> Result<([f32; 3], Report), KinematicsError> {
        let joints = self.robot.inverse(&self.target)?;
        Ok((joints, self.step()))
    }

    fn step(&mut self) -> Report {
        if !self.calibrator.solving() || self.calibrator.step() == Progress::Working {
            return Report::Nothing;
        }
        match self.calibrator.outcome() {
            Ok(outcome) => {
                self.robot = outcome.robot;
                Report::Calibrated
            }
            Err(refusal) => Report::Refused(refusal),
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The robot as built: the first forearm is 0.3 mm longer than designed.
    let mut built = DRAWN;
    built[0][7] += 0.3;
    let built = Robot::from_parameters(built)?;

    let mut controller = Controller::new()?;
    // A measuring device that lost its reflector: the sample is refused and nothing changes.
    if let Err(fault) = controller.measured([0.0; 3], [f32::NAN; 3]) {
        println!("sample refused: {fault}");
    }
    for k in 0..20_u8 {
        let t = f32::from(k);
        let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
        controller.measured(joints, built.forward(&joints)?.into())?;
        if k == 2 {
            // Too early: the robot keeps its parameters.
            if let Err(refusal) = controller.calibrate() {
                println!("calibration refused: {refusal}");
            }
        }
    }

    controller.calibrate()?;
    for turn in 1.. {
        match controller.turn()?.1 {
            Report::Nothing => {}
            Report::Refused(refusal) => return Err(refusal.into()),
            Report::Calibrated => {
                let [first, ..] = controller.robot.arms();
                println!(
                    "calibrated after {turn} turns: forearm 1 is {:.3} mm",
                    first.lb()
                );
                break;
            }
        }
    }
    Ok(())
}
