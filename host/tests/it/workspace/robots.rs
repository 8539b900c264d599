//! The robots of these tests.

use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Arm, SymmetricLinearRobot};
use delta_cal::{Robot, SymmetricRobot};
use delta_cal_host::geometry::reach::Reach;
use delta_cal_host::workspace::{Options, Workspace};
pub(super) use delta_cal_tests::uniform;
use delta_cal_tests::{Spread, size};
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
    for number in 0..size(4, 12) {
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

/// Robots as they are built, and some at the ends of what can be: name, robot, limits.
pub(super) fn geometries() -> Vec<Case> {
    let mut geometries = Vec::new();
    let mut add = |name: &str, robot, reach| {
        geometries.push(Case {
            name: name.to_owned(),
            robot,
            reach,
        });
    };
    let usual = || reach(-60.0, 90.0, None);
    for (name, [base, platform, upper, fore]) in [
        ("194/30/260/480", [194.0, 30.0, 260.0, 480.0]),
        ("200/45/235/800", [200.0, 45.0, 235.0, 800.0]),
        ("small", [40.0, 15.0, 50.0, 110.0]),
        ("large", [600.0, 100.0, 800.0, 1800.0]),
        ("tall", [120.0, 30.0, 200.0, 900.0]),
        ("short forearms", [194.0, 30.0, 250.0, 300.0]),
    ] {
        add(name, symmetric(base - platform, upper, fore), usual());
    }
    let wide_platform = Robot::new([0.0, 120.0, 240.0].map(|azimuth: f64| {
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let at = [-60.0 * cos, -60.0 * sin, 0.0];
        rotary(at, [azimuth, 0.0], [200.0, 0.0, 400.0])
    }));
    add(
        "platform wider than the base",
        wide_platform.unwrap(),
        usual(),
    );
    add("ball joints", paper(), reach(-60.0, 90.0, Some(30.0)));
    add("narrow limits", paper(), reach(20.0, 40.0, None));
    let uneven = Robot::new([
        rotary([170.0, 0.0, 0.0], [0.0, 0.0], [240.0, 0.0, 500.0]),
        rotary([-70.4, 132.4, 5.0], [118.0, 0.0], [280.0, 0.0, 470.0]),
        rotary([-84.0, -164.8, -8.0], [243.0, 0.0], [260.0, 0.0, 450.0]),
    ]);
    add("uneven arms", uneven.unwrap(), usual());
    let tilted = Robot::new([
        rotary([170.0, 0.0, 0.0], [2.0, 6.0], [240.0, 3.0, 500.0]),
        rotary([-80.0, 138.6, 0.0], [117.0, -8.0], [260.0, -5.0, 480.0]),
        rotary([-82.5, -142.9, 4.0], [244.0, 5.0], [250.0, 0.0, 490.0]),
    ]);
    add("tilted axes", tilted.unwrap(), usual());
    for (name, tower_radius, forearm, low, high) in [
        ("towers 140/330", 140.0, 330.0, 100.0, 600.0),
        ("towers 80/180", 80.0, 180.0, 0.0, 200.0),
        ("towers 120/700", 120.0, 700.0, 0.0, 400.0),
    ] {
        let towers = SymmetricLinearRobot {
            tower_radius,
            forearm,
        };
        let reach = Reach {
            limits: JointLimits::travel(low, high).unwrap(),
            forearm_limit: None,
        };
        add(name, towers.robot().unwrap(), reach);
    }
    geometries
}

/// D in mm, azimuth and tilt in degrees, La and Lb in mm.
fn rotary(
    [dx, dy, dz]: [f64; 3],
    [theta, alpha]: [f64; 2],
    [la_x, la_y, lb]: [f64; 3],
) -> Arm<f64> {
    let [theta, alpha] = [theta, alpha].map(f64::to_radians);
    Arm::new([dx, dy, dz, theta, alpha, la_x, la_y, lb]).unwrap()
}

pub(super) fn workspace(case: &Case, lines: f64) -> Workspace {
    let coarse = Workspace::compute(&case.robot, &case.reach, &Options::default()).unwrap();
    let options = Options {
        spacing: Some(coarse.grid.spacing * 80.0 / lines),
        ..Options::default()
    };
    Workspace::compute(&case.robot, &case.reach, &options).unwrap()
}
