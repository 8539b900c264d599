//! Calibrates a simulated robot from 20 measured poses and prints the result.
//!
//! ```text
//! cargo run -p delta-cal --features simulate --example calibrate
//! ```
#![allow(clippy::print_stdout)]

use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{ArmIndex, IkmCalibrator, Noise, Parameter, Settings, SymmetricRobot};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Lengths in mm. The robot as designed, and as built: its forearms are 0.4 mm short.
    let drawn = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
    };
    let built = SymmetricRobot {
        forearm: 479.6,
        ..drawn
    }
    .robot()?;
    let drawn = drawn.robot()?;

    // Measurement noise (σ): 0.02 mm in each coordinate, 0.001° at each joint.
    let noise = Noise::new(0.02, 0.001_f64.to_radians())?;
    let settings = Settings::default().with_noise(noise);
    let mut calibrator = IkmCalibrator::new(&drawn, &settings);

    let limits = JointLimits::new(-60_f64.to_radians(), 90_f64.to_radians())?;
    let mut rng = Pcg32::seed_from_u64(1);
    for _ in 0..20 {
        let pose = random_pose(&drawn, &limits, &mut rng)?;
        // On a real robot: move to `pose.joints` and measure the platform's position.
        calibrator.add(&simulate_sample(
            &built,
            &pose.joints,
            Some(&noise),
            &mut rng,
        )?)?;
    }

    // A refusal gives the reason; the robot then keeps its parameters.
    let outcome = calibrator.calibrate()?;
    for (index, arm) in ArmIndex::ALL.into_iter().zip(&outcome.arms) {
        println!("{index}: residuals {:.2} sigma", arm.residual_rms);
        for parameter in Parameter::ROTARY {
            let sigma = arm.standard_deviation(parameter).unwrap_or(f64::NAN);
            let change = arm.arm.get(parameter) - drawn.arm(index).get(parameter);
            println!("  {:6} {change:+9.4} ± {sigma:.4}", parameter.symbol());
        }
    }

    let joints = [0.3, -0.2, 0.5];
    let error = |robot: &delta_cal::Robot<f64>| -> Result<f64, Box<dyn std::error::Error>> {
        Ok((robot.forward(&joints)? - built.forward(&joints)?).norm())
    };
    println!(
        "position error at one pose: {:.3} mm as drawn, {:.3} mm calibrated",
        error(&drawn)?,
        error(&outcome.robot)?
    );
    Ok(())
}
