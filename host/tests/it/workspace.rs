//! The reachable workspace: every claim is checked against the forward model, closed forms, or a count.

use crate::support::{Folder, NOMINAL, TOLERANCE, number};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{Parameter, Robot, Tolerance};
use delta_cal_host::RobotFile;
use delta_cal_host::files::convention::Convention;
use delta_cal_host::geometry::Reach;
use delta_cal_host::report::workspace::NAMES;
use delta_cal_host::workspace::{Analysis, Influence, Mesh, Options, Workspace, cylinders};
use delta_cal_tests::geometries::{geometries, linear_geometries, symmetric};
use delta_cal_tests::{Spread, perturbed, size, uniform};
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};
use std::sync::{LazyLock, OnceLock};

struct Case {
    name: &'static str,
    robot: Robot<f64>,
    reach: Reach,
    workspaces: [OnceLock<Workspace>; 2],
}

/// Several tests share what takes seconds.
static CASES: LazyLock<Vec<Case>> = LazyLock::new(cases);
static BUILT: LazyLock<Vec<Case>> = LazyLock::new(built);

impl Case {
    const fn new((name, robot, reach): (&'static str, Robot<f64>, Reach)) -> Self {
        Self {
            name,
            robot,
            reach,
            workspaces: [const { OnceLock::new() }; 2],
        }
    }

    /// The workspace from about 30 lines across its longest side.
    fn coarse(&self) -> &Workspace {
        self.workspaces[0].get_or_init(|| self.workspace(30.0))
    }

    /// From 60.
    fn fine(&self) -> &Workspace {
        self.workspaces[1].get_or_init(|| self.workspace(60.0))
    }

    fn workspace(&self, lines: f64) -> Workspace {
        let coarse = Options {
            tolerance: 1.0,
            spacing: None,
        };
        let coarse = Workspace::compute(&self.robot, &self.reach, &coarse).unwrap();
        let options = Options {
            spacing: Some(coarse.grid.spacing * 80.0 / lines),
            ..Options::default()
        };
        Workspace::compute(&self.robot, &self.reach, &options).unwrap()
    }
}

fn paper() -> Robot<f64> {
    symmetric([164.0, 0.0, 260.0, 480.0])
}

fn reach(low: f64, high: f64, forearm: Option<f64>) -> Reach {
    Reach {
        limits: JointLimits::new(low.to_radians(), high.to_radians()).unwrap(),
        forearm_limit: forearm.map(f64::to_radians),
        within: None,
    }
}

/// Robots whose boundaries have faces of every kind.
fn cases() -> Vec<Case> {
    let mut rng = Pcg32::seed_from_u64(7);
    let long = symmetric([100.0, 0.0, 400.0, 450.0]);
    let mut cases = vec![
        ("paper", paper(), reach(-60.0, 90.0, None)),
        ("ball joints", paper(), reach(-60.0, 90.0, Some(30.0))),
        ("wide", paper(), reach(-90.0, 180.0, None)),
        ("whole turn", paper(), reach(-180.0, 180.0, None)),
        ("long arms", long, reach(-60.0, 150.0, None)),
        ("narrow", paper(), reach(20.0, 20.5, None)),
    ];
    for number in 0..size(2, 12) {
        let robot = perturbed(&paper(), 30.0, 8f64.to_radians(), Spread::Uniform, &mut rng);
        let (low, high) = (uniform(&mut rng), uniform(&mut rng));
        let forearm = (number % 2 == 0).then(|| 40.0 + 15.0 * uniform(&mut rng));
        let limits = reach(-90.0 + 40.0 * low, 90.0 + 60.0 * high, forearm);
        cases.push(("uneven", robot, limits));
    }
    cases.into_iter().map(Case::new).collect()
}

/// Realistic robots: five with arms, and some with towers, the last of which lean and cross above the robot.
fn built() -> Vec<Case> {
    let arms = geometries().into_iter().take(5);
    let arms = arms.map(|(name, robot)| (name, robot, reach(-60.0, 90.0, None)));
    let mut towers = linear_geometries();
    towers.truncate(2);
    let (_, upright, travel) = towers[0].clone();
    let mut leaning = upright.parameters();
    for parameters in &mut leaning {
        let [x, y, ..] = *parameters;
        parameters[Parameter::LeanX.index()] = -0.3 * x / x.hypot(y);
        parameters[Parameter::LeanY.index()] = -0.3 * y / x.hypot(y);
    }
    let leaning = upright.with_parameters(leaning).unwrap();
    towers.push(("leaning towers", leaning, travel));
    let towers = towers.into_iter().map(|(name, robot, [low, high])| {
        let reach = Reach {
            limits: JointLimits::travel(low, high).unwrap(),
            forearm_limit: None,
            within: None,
        };
        (name, robot, reach)
    });
    arms.chain(towers).map(Case::new).collect()
}

/// Below rounding there is nothing to bisect.
#[test]
fn a_tolerance_below_rounding_ends() {
    let reach = reach(-60.0, 90.0, Some(40.0));
    let robot = RobotFile {
        forearm_limit: reach.forearm_limit,
        ..RobotFile::of("robot.toml", paper(), reach.limits)
    };
    let analyse = |tolerance: f64| {
        let options = Options {
            tolerance,
            spacing: Some(60.0),
        };
        Analysis::compute(&robot, &options, &mut |_| ()).unwrap()
    };
    let (fine, usual) = (analyse(1e-13), analyse(0.01));
    assert!((fine.extent_mm.z.0 - usual.extent_mm.z.0).abs() < 0.02);
}

/// Inside there are joint angles that lead to the position; outside there are none.
#[test]
fn points_are_reachable_inwards_and_not_outwards_by_twice_the_tolerance() {
    let (mut points, mut kinds) = (0, BTreeSet::new());
    for case in CASES.iter().chain(&BUILT[5..]) {
        let workspace = case.workspace(40.0);
        let leads_to = |x: &Vector3<f64>| {
            let joints = case.reach.any_joints(&case.robot, x);
            let there = joints.and_then(|q| case.reach.position(&case.robot, &q));
            there.is_ok_and(|there| (there - x).norm() < 1e-4)
        };
        let mut at_an_edge = 0;
        for point in &workspace.points {
            kinds.insert(point.limit.name());
            let step = point.outward * (2.0 * workspace.tolerance);
            let (inwards, outwards) = (point.position - step, point.position + step);
            // The normal belongs to one face; within some tolerances of an edge it may cross another.
            at_an_edge += usize::from(workspace.contains(&outwards));
            at_an_edge += usize::from(!workspace.contains(&inwards));
            at_an_edge += usize::from(!leads_to(&inwards));
        }
        let (name, all) = (&case.name, workspace.points.len());
        assert!(at_an_edge * 500 <= all, "{name}: {at_an_edge} of {all}");
        points += all;
    }
    assert!(points > 50_000);
    // Five kinds for each of three arms, and the plane of the elbows.
    assert_eq!(kinds.len(), 16, "{kinds:?}");
}

/// The boundary of a property that holds at `a` but not at `b`.
fn bisected(holds: impl Fn(f64) -> bool, mut a: f64, mut b: f64) -> f64 {
    for _ in 0..40 {
        let middle = f64::midpoint(a, b);
        if holds(middle) {
            a = middle;
        } else {
            b = middle;
        }
    }
    a
}

#[test]
fn every_position_of_the_forward_model_is_reachable_and_joints_lead_back_to_it() {
    let mut rng = Pcg32::seed_from_u64(1);
    let beyond = Case::new(("beyond a half turn", paper(), reach(90.0, 400.0, None)));
    let all = CASES.iter().chain([&beyond]).chain(&BUILT[5..]);
    for (name, robot, reach) in all.map(|own| (own.name, &own.robot, &own.reach)) {
        let mut reached = 0;
        while reached < 5_000 {
            let q = [(); 3].map(|()| reach.limits.at(f64::from(rng.next_u32()) / 2f64.powi(32)));
            if let Ok(x) = reach.position(robot, &q) {
                reached += 1;
                let joints = reach.any_joints(robot, &x);
                let back = joints.and_then(|q| reach.position(robot, &q)).unwrap();
                assert!((back - x).norm() < 1e-5, "{name}: {x:?} {back:?}");
            }
        }
    }
}

/// ∫ |det ∂X/∂q| dq over the joints' range, with its σ: the volume swept by the forward model, where no position is
/// reached twice. It uses neither the inverse nor the boundary.
fn swept(case: &Case, draws: u32, rng: &mut Pcg32) -> (f64, f64) {
    let limits = &case.reach.limits;
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..draws {
        let q = [(); 3].map(|()| limits.at(f64::from(rng.next_u32()) / 2f64.powi(32)));
        let value = case.reach.position(&case.robot, &q).map_or(0.0, |x| {
            let jacobian = case.robot.platform_jacobian(&x, &q).unwrap();
            jacobian.by_joints.determinant().abs()
        });
        sum += value;
        squares += value * value;
    }
    let n = f64::from(draws);
    let (mean, cube) = (sum / n, (limits.maximum() - limits.minimum()).powi(3));
    let litres = cube * 1e-6;
    (
        litres * mean,
        litres * ((squares / n - mean * mean) / n).sqrt(),
    )
}

#[test]
fn the_volume_is_that_of_the_forward_sweep() {
    let mut rng = Pcg32::seed_from_u64(11);
    for (robot, forearm) in [
        (paper(), None),
        (paper(), Some(30.0)),
        (symmetric([100.0, 0.0, 200.0, 520.0]), None),
        (
            perturbed(&paper(), 20.0, 0.1, Spread::Uniform, &mut rng),
            Some(45.0),
        ),
    ] {
        let case = Case::new(("swept", robot, reach(-50.0, 80.0, forearm)));
        let volume = case.fine().volume();
        let (expected, sigma) = swept(&case, size(150_000, 400_000), &mut rng);
        let off = (volume.litres - expected).abs();
        // Four σ: a chance of 6e-5 per robot.
        assert!(off <= 4.0 * sigma + volume.uncertainty_litres, "{off}");
        // The count is precise enough to be meaningful.
        assert!(sigma < 0.003 * expected);
    }
}

#[test]
fn the_stated_uncertainty_is_what_a_finer_grid_changes() {
    for case in CASES.iter() {
        let [coarse, fine] = [case.coarse(), case.fine()].map(Workspace::volume);
        let off = (coarse.litres - fine.litres).abs();
        let stated = 2.0 * coarse.uncertainty_litres + fine.uncertainty_litres;
        assert!(off <= stated, "{}: {off}", case.name);
    }
}

/// Points of a solid cylinder, including its surface.
fn solid(diameter: f64, bottom: f64, top: f64) -> impl Iterator<Item = Vector3<f64>> {
    (0..180 * 4 * 21).map(move |number| {
        let part = |count: u32, number: u32| f64::from(number) / f64::from(count);
        let (sin, cos) = (TAU * part(180, number / 84)).sin_cos();
        let r = 0.5 * diameter * part(3, number / 21 % 4);
        Vector3::new(
            r * cos,
            r * sin,
            bottom + (top - bottom) * part(20, number % 21),
        )
    })
}

#[test]
fn every_point_of_a_cylinder_is_inside_and_a_larger_one_is_not() {
    for case in CASES.iter() {
        let (workspace, name) = (case.fine(), &case.name);
        let cylinders = cylinders(workspace);
        let size = workspace.grid.spacing * 60.0;
        assert!(!cylinders.is_empty(), "{name}");
        for cylinder in cylinders[..1]
            .iter()
            .chain(cylinders[1..].iter().step_by(9))
        {
            let (d, low, high) = (cylinder.diameter_mm, cylinder.bottom_mm, cylinder.top_mm);
            let outside = solid(d, low, high)
                .filter(|x| !workspace.contains(x))
                .count();
            assert_eq!(outside, 0, "{name}: {cylinder:?}");
            // Larger by a thousandth of the workspace's size and three tolerances at both ends.
            let more = 1e-3 * size + 3.0 * workspace.tolerance;
            let mut higher = solid(d, low - more, high + more);
            assert!(
                higher.any(|x| !workspace.contains(&x)),
                "{name}: {cylinder:?}"
            );
        }
        assert!(
            cylinders
                .iter()
                .all(|cylinder| cylinder.litres <= cylinders[0].litres)
        );
    }
}

/// Errors of predicted displacements, grouped by kind of surface. The reference is the boundary of a robot with one
/// parameter changed, found by bisection along the normals.
fn note_errors(case: &Case, all: &mut BTreeMap<String, Vec<f64>>) {
    let workspace = case.coarse();
    let influence = Influence::of(workspace);
    let places = case.robot.drive().places();
    let stride = (workspace.points.len() / 60).max(1);
    let (mut tried, mut at_an_edge) = (0, 0);
    let points = workspace.points.iter().zip(&influence.0);
    for (point, predicted) in points.step_by(stride) {
        let predicted = predicted.unwrap();
        for index in 0..24 {
            let Some(parameter) = places[index % 8] else {
                continue;
            };
            let by = match parameter.kind() {
                ParameterKind::Length => 1e-3,
                ParameterKind::Angle | ParameterKind::Ratio => 1e-5,
            };
            let rate = predicted[index];
            let range = 0.02 + 2.0 * (rate * by).abs();
            let along = |by: f64| {
                let mut parameters = case.robot.parameters();
                parameters[index / 8][index % 8] += by;
                let robot = case.robot.with_parameters(parameters).unwrap();
                let inside = |way: f64| {
                    let x = point.position + point.outward * way;
                    case.reach.any_joints(&robot, &x).is_ok()
                };
                (inside(-range) && !inside(range)).then(|| bisected(inside, -range, range))
            };
            // At an edge of the workspace the boundary may be on another face.
            let [Some(out), Some(here), Some(back)] = [by, 0.0, -by].map(along) else {
                continue;
            };
            // If it moves differently outwards and inwards, there is an edge in between.
            if (out + back - 2.0 * here).abs() > 0.05 * (out - back).abs() + 1e-6 {
                at_an_edge += 1;
                continue;
            }
            let found = (out - back) / (2.0 * by);
            tried += 1;
            // Curvature of the face and rounding of the inverse, relative to lengths of 500 mm per radian; steep near a
            // parallel singularity, where the boundary moves far.
            let off = (found - rate).abs() / (1.0 + rate.abs());
            let name = point.limit.name();
            let kind = name.split('_').next().unwrap();
            all.entry(kind.to_owned()).or_default().push(off);
        }
    }
    assert!(
        at_an_edge * 50 <= tried,
        "{}: {at_an_edge} of {tried}",
        case.name
    );
}

#[test]
fn predicted_displacements_are_those_of_recomputed_boundaries() {
    let mut all = BTreeMap::new();
    for case in CASES.iter().chain(&BUILT[5..]) {
        note_errors(case, &mut all);
    }
    for (kind, offs) in &mut all {
        offs.sort_by(f64::total_cmp);
        let (most, worst) = (offs[offs.len() * 99 / 100], offs[offs.len() - 1]);
        assert!(offs.len() > 200, "{kind}");
        assert!(most < 1e-3 && worst < 2e-2, "{kind}: {most} {worst}");
    }
    assert_eq!(all.len(), 5);
}

#[test]
fn the_tolerance_band_is_that_of_robots_drawn_from_it() {
    let case = &CASES[0];
    let workspace = case.coarse();
    let influence = Influence::of(workspace);
    let tolerance = Tolerance::new(0.5, 0.2_f64.to_radians()).unwrap();
    let band = influence.within(workspace, &tolerance);
    let mut rng = Pcg32::seed_from_u64(3);
    let options = Options {
        tolerance: 1e-3,
        spacing: Some(workspace.grid.spacing),
    };
    let draws = size(60, 400);
    let squares = (0..draws).map(|_| {
        let robot = delta_cal::simulate::made_robot(&case.robot, &tolerance, &mut rng).unwrap();
        let drawn = Workspace::compute(&robot, &case.reach, &options).unwrap();
        (drawn.volume().litres - workspace.volume().litres).powi(2)
    });
    let sigma = (squares.sum::<f64>() / f64::from(draws)).sqrt();
    // Three σ of a standard deviation of n draws, 1/√(2n).
    let within = 3.0 / (2.0 * f64::from(draws)).sqrt();
    assert!((sigma / band.volume_sigma_litres - 1.0).abs() < within);
    assert!(band.sigma_mm < band.largest_sigma_mm);
}

/// The volume, mm³, inside the triangles of a binary STL file, by the divergence theorem.
fn volume_of_stl(stl: &[u8]) -> f64 {
    let word = |at: usize| u32::from_le_bytes(stl[at..at + 4].try_into().unwrap());
    let volumes = (0..word(80) as usize).map(|triangle| {
        let [a, b, c] = [0, 1, 2].map(|corner| {
            let at = 84 + 50 * triangle + 12 * (corner + 1);
            Vector3::from([at, at + 4, at + 8].map(|at| f64::from(f32::from_bits(word(at)))))
        });
        a.dot(&b.cross(&c)) / 6.0
    });
    volumes.sum()
}

#[test]
fn the_mesh_is_closed_without_branches_and_holds_the_volume() {
    let thin_or_wide = CASES.iter().map(|case| (case, false));
    let built = BUILT.iter().map(|case| (case, true));
    for (case, usual) in thin_or_wide.chain(built) {
        let (workspace, name) = (case.coarse(), &case.name);
        let mesh = Mesh::of(workspace);
        let mut edges: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for [a, b, c] in &mesh.0 {
            for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                *edges.entry(edge).or_default() += 1;
            }
        }
        let back = |(a, b): &(usize, usize)| edges.get(&(*b, *a));
        assert!(
            edges.iter().all(|(edge, uses)| back(edge) == Some(uses)),
            "{name}: open"
        );
        // Parts thinner than a cell may have edges shared by four triangles.
        assert!(
            !usual || edges.values().all(|uses| *uses == 1),
            "{name}: branches"
        );
        let stl = mesh.to_stl(workspace, &Convention::usual(Drive::Rotary));
        assert_eq!(stl.len(), 84 + 50 * mesh.0.len());
        assert!(!stl.starts_with(b"solid"), "that is how ASCII files begin");
        let (inside, volume) = (volume_of_stl(&stl) * 1e-6, workspace.volume());
        // Rims are cut off within a cell: a wedge of half a cell's section along each of a dozen circles around the
        // workspace; chords of a sphere with the forearms' radius cut off spacing²/(8 Lb).
        let (spacing, forearm) = (workspace.grid.spacing, case.robot.arms()[0].lb());
        let rims = 12.0 * PI * 40.0 * spacing * 0.5 * spacing * spacing * 1e-6;
        let chords = spacing.powi(2) / (4.0 * forearm) * volume.boundary_m2;
        let off = volume.litres - inside;
        assert!(
            off.abs() <= volume.uncertainty_litres + chords + rims,
            "{name}: {off}"
        );
    }
}

#[test]
fn all_files_are_written_and_the_same_for_any_number_of_threads() {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{TOLERANCE}"));
    for threads in ["1", "4"] {
        let command =
            format!("workspace robot.toml --spacing 20mm --output {threads} --json {threads}.json");
        let run = folder.run_where(&command, "", &[("RAYON_NUM_THREADS", threads)]);
        assert_eq!(run.code, 0, "{}", run.stderr);
    }
    let files = std::fs::read_dir(folder.path("1")).unwrap();
    let names = files.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let names: BTreeSet<_> = names.collect();
    assert_eq!(names, NAMES.map(str::to_owned).into());
    for name in names {
        let [one, four] =
            ["1", "4"].map(|run| std::fs::read(folder.path(run).join(&name)).unwrap());
        assert!(one == four, "{name}");
    }
    let csv = folder.read("1/boundary.csv");
    assert!(csv.starts_with("x_mm,y_mm,z_mm,kind\n"), "{csv:.80}");
    let json = folder.json("1.json");
    assert_eq!(json["boundary_points"], csv.lines().count() - 1);
    assert!(number(&json, "largest_cylinder/litres") > 40.0);
    assert_eq!(json["influence"].as_array().unwrap().len(), 24);
    assert!(number(&json, "tolerance_band/sigma_mm") > 0.0);
    // The lowest point, with all joints at 90°; and motor, platform and elbow in line, folded, on the z axis.
    let [bottom, top] = ["extent_mm/z/0", "extent_mm/z/1"].map(|end| number(&json, end));
    let below = |reach: f64| -f64::sqrt(reach * reach - 164.0 * 164.0);
    assert!((bottom - (below(480.0) - 260.0)).abs() < 0.05, "{bottom}");
    assert!((top - below(480.0 - 260.0)).abs() < 0.05, "{top}");
    let section = folder.read("1/section.svg");
    roxmltree::Document::parse(&section).unwrap();
    for name in ["largest cylinder", "joint maximum", "joint minimum"] {
        assert!(section.contains(name), "{name}");
    }
}
