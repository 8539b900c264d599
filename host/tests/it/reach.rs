//! Which poses a robot may take: the inverse must agree with the forward model.

#![allow(clippy::unwrap_used, clippy::float_cmp)]

use delta_cal::kinematics::JointLimits;
use delta_cal::{Robot, SymmetricRobot};
use delta_cal_host::geometry::reach::Reach;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

fn robot(base: f64, upper: f64, fore: f64) -> Robot<f64> {
    let symmetric = SymmetricRobot {
        base_radius: base,
        platform_radius: 0.0,
        upper_arm: upper,
        forearm: fore,
    };
    symmetric.robot().unwrap()
}

fn reach(low: f64, high: f64, forearm: Option<f64>) -> Reach {
    Reach {
        limits: JointLimits::new(f64::to_radians(low), f64::to_radians(high)).unwrap(),
        forearm_limit: forearm.map(f64::to_radians),
    }
}

#[test]
fn every_position_of_the_forward_model_is_reachable_and_joints_lead_back_to_it() {
    let mut rng = Pcg32::seed_from_u64(1);
    let cases = [
        (164.0, 260.0, 480.0, -60.0, 90.0, None),
        (164.0, 260.0, 480.0, -60.0, 90.0, Some(40.0)),
        (164.0, 260.0, 480.0, -90.0, 180.0, None),
        (164.0, 260.0, 480.0, -180.0, 180.0, None),
        (164.0, 260.0, 480.0, 90.0, 400.0, None),
        (100.0, 400.0, 450.0, -60.0, 150.0, None),
    ];
    for (base, upper, fore, low, high, forearm) in cases {
        let robot = robot(base, upper, fore);
        let reach = reach(low, high, forearm);
        let (mut reached, mut elbows_in, mut found) = (0, 0, 0);
        while reached < 20_000 {
            let q = [(); 3].map(|()| {
                reach
                    .limits
                    .at(f64::from(rng.next_u32()) / f64::from(u32::MAX))
            });
            let Ok(x) = reach.position(&robot, &q) else {
                continue;
            };
            reached += 1;
            elbows_in += u32::from(reach.joints(&robot, &x).is_err());
            if let Ok(joints) = reach.any_joints(&robot, &x) {
                found += 1;
                assert!((reach.position(&robot, &joints).unwrap() - x).norm() < 1e-5);
            }
        }
        if low == -180.0 {
            delta_cal_tests::documents::print_documented(
                "docs/workspace.md",
                &format!("{elbows_in} of {reached} drawn positions"),
            );
        }
        assert_eq!(found, reached, "{low} to {high}");
    }
}
