use super::robots::{Case, cases, geometries, paper, reach, workspace};
use delta_cal_host::workspace::{Options, Workspace};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI};

/// Whether the forward model leads to a position from joint angles within the limits. Each arm's
/// joint angles are sought by bisecting its constraint, which goes with the sine and cosine of the joint angle,
/// between its extremes; the inverse is not asked.
pub(super) fn forward_reaches(case: &Case, x: &Vector3<f64>) -> bool {
    let roots = |arm: &delta_cal::robot::Arm<f64>| {
        let (low, high) = (case.reach.limits.minimum(), case.reach.limits.maximum());
        let f = |q: f64| arm.constraint(x, q);
        let [start, quarter, half] = [0.0, FRAC_PI_2, PI].map(f);
        let extreme = (quarter - f64::midpoint(start, half)).atan2(0.5 * (start - half));
        let mut ends = vec![low, high];
        let extremes = (-3..=3).map(|turn| extreme + PI * f64::from(turn));
        ends.extend(extremes.filter(|q| *q > low && *q < high));
        ends.sort_by(f64::total_cmp);
        let mut roots = Vec::new();
        for piece in ends.windows(2) {
            let (mut a, mut b) = (piece[0], piece[1]);
            if (f(a) > 0.0) == (f(b) > 0.0) {
                continue;
            }
            for _ in 0..60 {
                let middle = f64::midpoint(a, b);
                if (f(a) > 0.0) == (f(middle) > 0.0) {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            roots.push(f64::midpoint(a, b));
        }
        roots
    };
    let [first, second, third] = case.robot.arms().each_ref().map(roots);
    for &q1 in &first {
        for &q2 in &second {
            for &q3 in &third {
                let there = case.reach.position(&case.robot, &[q1, q2, q3]);
                if there.is_ok_and(|there| (there - x).norm() < 1e-4) {
                    return true;
                }
            }
        }
    }
    false
}

/// The outward normal is one face's; within this many tolerances of an edge, the way along it may
/// pass another face. Of 10,000 points on lines 17 mm apart, a few are that near.
const AT_AN_EDGE: usize = 1000;

#[test]
fn points_are_reachable_inwards_and_not_outwards_by_twice_the_tolerance() {
    let (mut points, mut kinds) = (0, BTreeSet::new());
    let towers = geometries().into_iter();
    let towers = towers.filter(|case| case.name.starts_with("towers"));
    for case in cases().into_iter().chain(towers) {
        let workspace = workspace(&case, 40.0);
        let mut at_an_edge = 0;
        for point in &workspace.points {
            kinds.insert(point.limit.name());
            let step = point.outward * (2.0 * workspace.tolerance);
            let inwards = workspace
                .reach
                .any_joints(&case.robot, &(point.position - step));
            let limit = point.limit.name();
            assert!(
                !workspace.contains(&(point.position + step)),
                "{}: {limit} at {:?} is reachable outwards",
                case.name,
                point.position
            );
            if let Err(other) = inwards {
                assert_ne!(other, point.limit, "{}: {:?}", case.name, point.position);
                at_an_edge += 1;
            }
        }
        assert!(
            at_an_edge * AT_AN_EDGE <= workspace.points.len(),
            "{}: {at_an_edge} of {}",
            case.name,
            workspace.points.len()
        );
        points += workspace.points.len();
    }
    println!("{points} points, {kinds:?}");
    assert!(points > 50_000);
    // Each of five kinds for each of three arms, and the elbows' plane.
    assert_eq!(kinds.len(), 16);
}

#[test]
fn being_inside_means_that_the_forward_model_leads_there() {
    for case in cases() {
        let workspace = workspace(&case, 20.0);
        // Some thousand points of each.
        for point in workspace.points.iter().step_by(29) {
            for part in [-1.0, -0.05, 0.05, 1.0] {
                let x = point.position + point.outward * (part * workspace.grid.spacing);
                let expected = forward_reaches(&case, &x);
                assert_eq!(workspace.contains(&x), expected, "{}: {x:?}", case.name);
            }
        }
    }
}

#[test]
fn the_z_axis_of_a_symmetric_robot_ends_where_closed_forms_say() {
    let limits = reach(-60.0, 90.0, None);
    let options = Options {
        tolerance: 1e-6,
        spacing: Some(30.0),
    };
    let workspace = Workspace::compute(&paper(), &limits, &options).unwrap();
    let end = |mut inside: f64, mut outside: f64| {
        for _ in 0..50 {
            let middle = f64::midpoint(inside, outside);
            if workspace.contains(&Vector3::new(0.0, 0.0, middle)) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    };
    // Below, the upper arms hang straight down; above, the arms are folded.
    let lowest = -260.0 - (480f64.powi(2) - 164f64.powi(2)).sqrt();
    let highest = -((480f64 - 260.0).powi(2) - 164f64.powi(2)).sqrt();
    assert!((end(-400.0, -800.0) - lowest).abs() < 1e-6);
    assert!((end(-400.0, -100.0) - highest).abs() < 1e-6);
    // A tenth of the way from joint to joint the radius is where the elbow's sphere ends: along −x
    // at the height of arm 1's, its largest angle holds the platform at 164 + 480 from the elbow.
    let x = |way: f64| Vector3::new(-way, 0.0, -260.0);
    let furthest = 480.0 - 164.0;
    assert!(workspace.contains(&x(furthest - 1e-6)));
    assert!(!workspace.contains(&x(furthest + 1e-6)));
}

#[test]
fn points_are_as_near_as_asked_for() {
    for tolerance in [1.0, 0.01, 1e-5] {
        let options = Options {
            tolerance,
            spacing: Some(30.0),
        };
        let limits = reach(-60.0, 90.0, None);
        let workspace = Workspace::compute(&paper(), &limits, &options).unwrap();
        for point in &workspace.points {
            let face = point.face(&workspace.robot, &workspace.reach);
            let (distance, _) = face.distance(&point.position).unwrap();
            assert!(distance.abs() <= tolerance, "{distance}");
        }
    }
}
