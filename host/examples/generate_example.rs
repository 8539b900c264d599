//! Writes the simulated example that is built into `delta-cal`, always the same numbers:
//! `cargo run -p delta-cal-host --example generate_example`.

use delta_cal::Parameter;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Arm, ParameterKind};
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Robot, SymmetricRobot};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use std::error::Error;
use std::fmt::Write;
use std::path::Path;

const ROBOT_TOML: &str = "\
# The robot of Bentaleb and Iqbal (2020), as its data sheet gives it.

[nominal]
base_radius_mm = 194
platform_radius_mm = 30
upper_arm_mm = 260
forearm_mm = 480

[joints]
min_deg = -60
max_deg = 90

# One standard deviation of every length and angle about its nominal value.
[tolerance]
length_mm = 0.5
angle_deg = 0.2

# One standard deviation of a measured coordinate and of a joint angle.
[noise]
position_mm = 0.02
joint_deg = 0.002
";

const SAMPLES_HEADER: &str = "\
# Simulated, not measured: the robot of robot.toml with every parameter off by a random amount
# (0.5 mm and 0.2 deg, one sigma), at 40 random poses, with 0.02 mm and 0.002 deg of noise.
q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm
";

fn main() -> Result<(), Box<dyn Error>> {
    let mut rng = Pcg32::seed_from_u64(24);
    let nominal = SymmetricRobot {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
    }
    .robot()?;
    let limits = JointLimits::new(-60f64.to_radians(), 90f64.to_radians())?;
    let noise = Noise::new(0.02, 0.002f64.to_radians())?;

    let [first, second, third] = nominal.arms().map(|arm| {
        let mut parameters = arm.parameters();
        for (value, parameter) in parameters.iter_mut().zip(Parameter::ROTARY) {
            let sigma = match parameter.kind() {
                ParameterKind::Length => 0.5,
                ParameterKind::Angle | ParameterKind::Ratio => 0.2f64.to_radians(),
            };
            *value += sigma * standard_normal::<f64, _>(&mut rng);
        }
        Arm::new(parameters)
    });
    let truth = Robot::new([first?, second?, third?])?;

    let mut csv = SAMPLES_HEADER.to_owned();
    for _ in 0..40 {
        let pose = random_pose(&truth, &limits, &mut rng)?;
        let sample = simulate_sample(&truth, &pose.joints, Some(&noise), &mut rng)?;
        let [q1, q2, q3] = sample.joints.map(f64::to_degrees);
        let [x, y, z] = sample.position.data.0[0];
        writeln!(csv, "{q1:.5},{q2:.5},{q3:.5},{x:.4},{y:.4},{z:.4}")?;
    }

    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/paper-robot");
    std::fs::write(folder.join("robot.toml"), ROBOT_TOML)?;
    std::fs::write(folder.join("samples.csv"), csv)?;
    Ok(())
}
