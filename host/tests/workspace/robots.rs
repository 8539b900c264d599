//! The robots of these tests.

use delta_cal::kinematics::JointLimits;
use delta_cal::{Robot, SymmetricRobot};
use delta_cal_host::geometry::reach::Reach;
use delta_cal_host::workspace::{Options, Workspace};
use delta_cal_tests::Spread;
pub(super) use delta_cal_tests::uniform;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

pub(super) struct Case {
    pub name: String,
    pub robot: Robot<f64>,
    pub reach: Reach,
}

pub(super) fn symmetric(base: f64, upper: f64, fore: f64) -> Robot<f64> {
    let symmetric = SymmetricRobot {
        base_radius: base,
        platform_radius: 0.0,
        upper_arm: upper,
        forearm: fore,
    };
    symmetric.robot().unwrap()
}

pub(super) fn paper() -> Robot<f64> {
    symmetric(164.0, 260.0, 480.0)
}

pub(super) fn reach(low: f64, high: f64, forearm: Option<f64>) -> Reach {
    Reach {
        limits: JointLimits::new(f64::to_radians(low), f64::to_radians(high)).unwrap(),
        forearm_limit: forearm.map(f64::to_radians),
    }
}

/// Each parameter evenly off by up to this many mm or degrees.
pub(super) fn perturbed(
    robot: &Robot<f64>,
    rng: &mut Pcg32,
    length: f64,
    degrees: f64,
) -> Robot<f64> {
    delta_cal_tests::perturbed(robot, length, degrees.to_radians(), Spread::Uniform, rng)
}

/// Robots whose boundaries have faces of every kind.
pub(super) fn cases() -> Vec<Case> {
    let mut rng = Pcg32::seed_from_u64(7);
    let mut cases = Vec::new();
    let mut add = |name: &str, robot, reach| {
        cases.push(Case {
            name: name.to_owned(),
            robot,
            reach,
        });
    };
    add("paper", paper(), reach(-60.0, 90.0, None));
    add("ball joints", paper(), reach(-60.0, 90.0, Some(30.0)));
    add("wide", paper(), reach(-90.0, 180.0, None));
    add("whole turn", paper(), reach(-180.0, 180.0, None));
    add(
        "long arms",
        symmetric(100.0, 400.0, 450.0),
        reach(-60.0, 150.0, None),
    );
    add("narrow", paper(), reach(20.0, 20.5, None));
    for number in 0..12 {
        let robot = perturbed(&paper(), &mut rng, 30.0, 8.0);
        let low = -90.0 + 40.0 * uniform(&mut rng);
        let high = 90.0 + 60.0 * uniform(&mut rng);
        let forearm = (number % 2 == 0).then(|| 40.0 + 15.0 * uniform(&mut rng));
        add(
            &format!("random {number}"),
            robot,
            reach(low, high, forearm),
        );
    }
    cases
}

pub(super) fn workspace(case: &Case, lines: f64) -> Workspace {
    let coarse = Workspace::compute(&case.robot, &case.reach, &Options::default()).unwrap();
    let options = Options {
        spacing: Some(coarse.grid.spacing * 80.0 / lines),
        ..Options::default()
    };
    Workspace::compute(&case.robot, &case.reach, &options).unwrap()
}
