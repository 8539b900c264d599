use super::robots::{Case, cases, workspace};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{ParameterKind, SymmetricLinearRobot};
use delta_cal::{Parameter, Robot, Tolerance};
use delta_cal_host::geometry::reach::Reach;
use delta_cal_host::workspace::{BandOptions, Options, Workspace, band, compare, influence};
use std::collections::BTreeMap;

/// The robot with one parameter off by this much, mm or radians.
fn moved(robot: &Robot<f64>, index: usize, by: f64) -> Robot<f64> {
    let mut arms = *robot.arms();
    let arm = &mut arms[index / 8];
    let mut parameters = arm.parameters();
    parameters[index % 8] += by;
    *arm = arm.with_parameters(parameters).unwrap();
    Robot::new(arms).unwrap()
}

/// How far out along a point's normal the boundary of another robot is, by bisecting; `None` if it
/// is not within this range.
fn boundary_along(
    case: &Case,
    robot: &Robot<f64>,
    point: &delta_cal_host::workspace::BoundaryPoint,
    range: f64,
) -> Option<f64> {
    let inside = |way: f64| {
        let x = point.position + point.outward * way;
        case.reach.any_joints(robot, &x).is_ok()
    };
    let (mut low, mut high) = (-range, range);
    if !inside(low) || inside(high) {
        return None;
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if inside(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// By how much predicted displacements are off those found by bisecting, by the kind of the surface.
fn note_errors(case: &Case, all: &mut BTreeMap<&'static str, Vec<f64>>) {
    let mut workspace = workspace(case, 30.0);
    workspace.points.retain(|point| point.area > 0.0);
    let stride = workspace.points.len() / 60;
    let places = case.robot.drive().places();
    for point in workspace.points.iter().step_by(stride.max(1)) {
        let predicted = point.displacement(&case.robot, &case.reach).unwrap();
        for index in 0..24 {
            let Some(parameter) = places[index % 8] else {
                continue;
            };
            let by = match parameter.kind() {
                ParameterKind::Length => 1e-3,
                ParameterKind::Angle | ParameterKind::Ratio => 1e-5,
            };
            let rate = predicted[index / 8][index % 8];
            let range = 0.02 + 2.0 * (rate * by).abs();
            let ends = [by, -by]
                .map(|by| boundary_along(case, &moved(&case.robot, index, by), point, range));
            // At an edge of the workspace there may be another face.
            let [Some(out), Some(back)] = ends else {
                continue;
            };
            let found = (out - back) / (2.0 * by);
            // A face's curvature and the inverse's rounding, against lengths of 500 mm per
            // radian; steep near a parallel singularity, where the boundary moves far.
            let off = (found - rate).abs() / (1.0 + rate.abs());
            all.entry(kind(&point.limit.name())).or_default().push(off);
        }
    }
}

#[test]
fn predicted_displacements_are_those_of_recomputed_boundaries() {
    let mut all: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for case in cases() {
        note_errors(&case, &mut all);
    }
    for (kind, offs) in &mut all {
        offs.sort_by(f64::total_cmp);
        let (most, worst) = (offs[offs.len() * 99 / 100], offs[offs.len() - 1]);
        println!(
            "{kind}: {} displacements, 99 % within {most:.1e}, all {worst:.1e}",
            offs.len()
        );
        assert!(offs.len() > 200, "{kind}");
        assert!(most < 1e-3 && worst < 2e-2, "{kind}: {most} {worst}");
    }
    assert_eq!(all.len(), 6);
}

/// Towers that lean inwards and cross above the robot: there the plane of the elbows stands upright.
#[test]
fn predicted_displacements_of_towers_are_those_of_recomputed_boundaries() {
    let towers = SymmetricLinearRobot {
        tower_radius: 100.0,
        forearm: 300.0,
    };
    let arms = towers.robot().unwrap().arms().map(|arm| {
        let mut parameters = arm.parameters();
        let [x, y, ..] = parameters;
        parameters[Parameter::LeanX.index()] = -0.3 * x / 100.0;
        parameters[Parameter::LeanY.index()] = -0.3 * y / 100.0;
        arm.with_parameters(parameters).unwrap()
    });
    let case = Case {
        name: "towers that cross".to_owned(),
        robot: Robot::new(arms).unwrap(),
        reach: Reach {
            limits: JointLimits::travel(0.0, 500.0).unwrap(),
            forearm_limit: None,
        },
    };
    let mut all = BTreeMap::new();
    note_errors(&case, &mut all);
    for (kind, offs) in &all {
        let worst = offs.iter().copied().fold(0.0, f64::max);
        println!("{kind}: {} displacements within {worst:.1e}", offs.len());
        assert!(worst < 2e-2, "{kind}: {worst}");
    }
    assert!(all["elbows"].len() > 20);
}

fn kind(name: &str) -> &'static str {
    [
        "joint_minimum",
        "joint_maximum",
        "forearm",
        "serial",
        "parallel",
        "elbows",
    ]
    .into_iter()
    .find(|kind| name.starts_with(kind))
    .unwrap()
}

#[test]
fn the_volumes_derivatives_are_those_of_recomputed_volumes() {
    let case = &cases()[0];
    let workspace = workspace(case, 80.0);
    let influences = influence(&workspace);
    let options = Options {
        tolerance: 1e-4,
        spacing: Some(workspace.grid.spacing),
    };
    for index in [0, 5, 7, 9, 14, 23] {
        let volume = |by: f64| {
            let robot = moved(&case.robot, index, by);
            Workspace::compute(&robot, &case.reach, &options)
                .unwrap()
                .volume()
                .volume
        };
        let found = (volume(2.0) - volume(-2.0)) / 4.0;
        let predicted = influences[index].volume;
        println!("{} {predicted:.0} {found:.0}", influences[index].parameter);
        // What the lines' spacing does to the difference of two volumes of 112 l, some 5 ml.
        assert!((found - predicted).abs() < 6000.0, "{predicted} {found}");
    }
}

#[test]
fn the_band_is_that_of_first_order_for_a_small_tolerance_and_the_seeds() {
    let case = &cases()[0];
    let workspace = workspace(case, 30.0);
    let tolerance = Tolerance::new(0.05, 0.02_f64.to_radians()).unwrap();
    let options = BandOptions {
        robots: 400,
        points: 150,
        seed: 3,
    };
    let drawn = band(&workspace, &tolerance, &options);
    assert_eq!(drawn, band(&workspace, &tolerance, &options));
    assert_ne!(
        drawn,
        band(&workspace, &tolerance, &BandOptions { seed: 4, ..options })
    );
    let mut ratios = Vec::new();
    for point in &drawn.points {
        // 5 % and 95 % of a normal distribution are 2 · 1.645 σ apart.
        ratios.push((point.high - point.low) / (2.0 * 1.644_85 * point.sigma));
    }
    let mean = ratios.iter().sum::<f64>() / f64::from(u32::try_from(ratios.len()).unwrap());
    // A range of quantiles of 400 draws has a standard deviation of some 5 %, and points share them.
    assert!((mean - 1.0).abs() < 0.08, "{mean}");
    assert!(
        ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.3),
        "{ratios:?}"
    );
}

#[test]
fn a_robot_compared_with_itself_does_not_differ_and_with_another_by_what_is_predicted() {
    let case = &cases()[0];
    let first = workspace(case, 40.0);
    let same = compare(&first, &first);
    assert!(same.rms < first.tolerance);
    assert!(same.displacements.iter().all(Option::is_some));
    let robot = moved(&moved(&case.robot, 7, 0.3), 12, 2e-3);
    let options = Options {
        spacing: Some(first.grid.spacing),
        ..Options::default()
    };
    let second = Workspace::compute(&robot, &case.reach, &options).unwrap();
    let other = compare(&first, &second);
    assert!(other.rms > 0.1);
    let pairs = other.displacements.iter().zip(&other.predicted);
    let (mut found, mut off) = (0, 0);
    for (moved, predicted) in pairs {
        let (Some(moved), Some(predicted)) = (moved, predicted) else {
            continue;
        };
        found += 1;
        // Second order: (1 mm)² over lengths of 480 mm, and the tolerance.
        off += usize::from((moved - predicted).abs() > 0.015);
    }
    assert!(found * 100 > first.points.len() * 99);
    // At edges the normal meets another face.
    assert!(off * 100 < found, "{off} of {found}");
}
