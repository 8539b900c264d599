//! Sample files with heights, distances and single coordinates, measured on a robot that differs from the paper's.

use crate::{Spread, generator, paper_limits, paper_robot, perturbed};
use delta_cal::simulate::{random_pose, standard_normal};
use std::fmt::Write;

/// The paper's nominal robot and its instruments. The table is known to a few millimetres; the sensor at the anchor has
/// an unknown positive offset.
pub const OBSERVED_ROBOT: &str = "\
[nominal]
base_radius_mm = 194
platform_radius_mm = 30
upper_arm_mm = 260
forearm_mm = 480
[joints]
min_deg = -60
max_deg = 90
[tolerance]
length_mm = 0.5
angle_deg = 0.2
[noise]
position_mm = 0.05
joint_deg = 0.002
height_mm = 0.02
distance_mm = 0.02
[planes.table]
z_mm = -560
sigma_mm = 3
[points.anchor]
offset = \"unknown\"
";

/// Cycles through four kinds of rows: a touch on a table; one on a shelf with a distance from an anchor; the length of
/// a ball bar between two poses; z alone.
///
/// # Panics
/// Never: the paper's robot has such poses.
#[allow(clippy::expect_used)]
pub fn observed_rows(seed: u64, rows: u32) -> String {
    let mut rng = generator(seed, 0);
    let angle = 0.2_f64.to_radians();
    let robot = perturbed(&paper_robot(), 0.5, angle, Spread::Normal, &mut rng);
    let mut text = String::from(
        "q1_deg,q2_deg,q3_deg,z_mm,height_mm,plane,distance_mm,point,to_q1_deg,to_q2_deg,to_q3_deg\n",
    );
    for row in 0..rows {
        let mut pose = || random_pose(&robot, &paper_limits(), &mut rng).expect("a pose");
        let (own, other) = (pose(), pose());
        let (x, y) = (own.position, other.position);
        let mut noisy = |sigma: f64| sigma * standard_normal::<f64, _>(&mut rng);
        let mut degrees = |joints: [f64; 3]| joints.map(|q| (q.to_degrees()) + noisy(0.002));
        let [a, b, c] = degrees(own.joints);
        let [d, e, f] = degrees(other.joints);
        let table = x.z + 559.0 - 0.004 * x.x;
        let shelf = x.z + 600.0 + 0.003 * x.y;
        let anchor = [x.x - 700.0, x.y + 150.0, x.z + 400.0];
        let anchor = anchor.iter().map(|own| own * own).sum::<f64>().sqrt() + 1.5;
        let bar = (x - y).dot(&(x - y)).sqrt() + noisy(0.02);
        let (table, shelf, anchor) = (
            table + noisy(0.02),
            shelf + noisy(0.02),
            anchor + noisy(0.02),
        );
        let rest = match row % 4 {
            0 => format!(",{table},table,,,,,"),
            1 => format!(",{shelf},shelf,{anchor},anchor,,,"),
            2 => format!(",,,{bar},,{d},{e},{f}"),
            _ => format!("{},,,,,,,", x.z + noisy(0.05)),
        };
        let _ = writeln!(text, "{a},{b},{c},{rest}");
    }
    text
}
