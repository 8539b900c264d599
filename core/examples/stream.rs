//! A continuous stream of measurements, some of them wrong: the gate rejects those before they are added, and reports
//! when the robot itself has changed.
//!
//! ```text
//! cargo run -p delta-cal --features simulate --example stream
//! ```
#![allow(clippy::print_stdout)]

use delta_cal::calibration::Ikm;
use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::stream::{Added, Alarm, Selection, StreamCalibrator, Verdict};
use delta_cal::{Noise, Progress, Settings, SymmetricRobot, Tolerance};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let drawn = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
    };
    let built = SymmetricRobot {
        upper_arm: 260.4,
        ..drawn
    }
    .robot()?;
    // After a collision.
    let bent = SymmetricRobot {
        upper_arm: 261.4,
        ..drawn
    }
    .robot()?;
    let drawn = drawn.robot()?;

    // With both stated, the gate tests from the first sample.
    let noise = Noise::new(0.02, 0.0)?;
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance(Tolerance::new(0.5, 0.003)?);
    let gated = Selection::Gated { forgetting: None };
    let mut stream = StreamCalibrator::<_, Ikm>::new(&drawn, &settings, &gated);

    let limits = JointLimits::new(-60_f64.to_radians(), 90_f64.to_radians())?;
    let mut rng = Pcg32::seed_from_u64(1);
    for number in 0..120 {
        let robot = if number < 100 { &built } else { &bent };
        let pose = random_pose(&drawn, &limits, &mut rng)?;
        let mut sample = simulate_sample(robot, &pose.joints, Some(&noise), &mut rng)?;
        if number % 30 == 29 {
            sample.position.x += 5.0; // the reflector slipped
        }
        if let Added::Tested(Verdict::Rejected(innovation)) = stream.add(&sample)? {
            println!(
                "sample {number} rejected: {} is {:.3} mm off, {:.0} sigma",
                innovation.arm, innovation.distance, innovation.normalized
            );
        }
        if let Some(Alarm::RobotChanged { first }) = stream.alarm() {
            println!("the robot has changed before sample {first}: calibrate it anew");
            break;
        }
    }

    if let Some(counts) = stream.gate_counts() {
        println!(
            "{} samples taken in, {} rejected",
            counts.taken, counts.rejected
        );
    }
    // Keeps what came before the change.
    stream.acknowledge();
    stream.solve()?;
    while stream.step() == Progress::Working {}
    let outcome = stream.outcome()?;
    println!(
        "upper arms: {:.3} mm",
        outcome.robot.arms()[0].upper_arm_length()
    );
    Ok(())
}
