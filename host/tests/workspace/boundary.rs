use super::robots::{Case, cases, workspace};
use delta_cal_host::workspace::Mesh;
use nalgebra::Vector3;
use std::collections::{BTreeMap, HashMap};

/// Whether the forward model leads to a position: by Newton's method on the joint angles, from the
/// inverse of each branch in turn. It asks nothing of the code under test.
fn forward_reaches(case: &Case, x: &Vector3<f64>) -> bool {
    // The elbow's circle against the forearm's sphere, by a scan and bisection of f(q).
    let roots = |arm: &delta_cal::Arm<f64>| {
        let (low, high) = (case.reach.limits.minimum(), case.reach.limits.maximum());
        let f = |q: f64| arm.constraint(x, q);
        let mut roots = Vec::new();
        let steps = 720;
        for step in 0..steps {
            let at = |s: i32| low + (high - low) * f64::from(s) / f64::from(steps);
            let (mut a, mut b) = (at(step), at(step + 1));
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

#[test]
fn points_are_reachable_inwards_and_not_outwards_by_twice_the_tolerance() {
    for case in cases() {
        let workspace = workspace(&case, 40.0);
        let mut kinds: BTreeMap<String, [u32; 3]> = BTreeMap::new();
        for point in &workspace.points {
            let step = point.outward * (2.0 * workspace.tolerance);
            let count = kinds.entry(point.limit.name()).or_default();
            count[0] += 1;
            count[1] += u32::from(!workspace.contains(&(point.position - step)));
            count[2] += u32::from(workspace.contains(&(point.position + step)));
        }
        println!("{}: {kinds:?}", case.name);
    }
}

#[test]
fn the_predicate_is_the_forward_models() {
    for case in cases() {
        let workspace = workspace(&case, 20.0);
        let mut wrong = 0;
        for point in workspace.points.iter().step_by(7) {
            for way in [-1.0, 1.0, -20.0, 20.0] {
                let x = point.position + point.outward * way * workspace.grid.spacing * 0.05;
                wrong += u32::from(workspace.contains(&x) != forward_reaches(&case, &x));
            }
        }
        println!("{}: {wrong}", case.name);
    }
}

#[test]
fn the_mesh_is_closed_and_turned_outwards() {
    for case in cases() {
        let workspace = workspace(&case, 40.0);
        let mesh = Mesh::of(&workspace);
        let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
        let mut uses: HashMap<(usize, usize), u32> = HashMap::new();
        for triangle in &mesh.triangles {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
                *uses.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
        let open = edges.values().filter(|sum| **sum != 0).count();
        let pinched = uses.values().filter(|uses| **uses != 2).count();
        let volume = workspace.volume();
        println!(
            "{}: {} triangles, open {open}, pinched {pinched}, volume {:.5} of {:.4} ± {:.5} l",
            case.name,
            mesh.triangles.len(),
            mesh.volume() * 1e-6,
            volume.volume * 1e-6,
            volume.uncertainty * 1e-6
        );
    }
}

#[test]
fn debug_cylinder() {
    for case in cases() {
        let w = workspace(&case, 80.0);
        println!(
            "{}: {:?}",
            case.name,
            delta_cal_host::workspace::cylinders(&w)
                .iter()
                .take(3)
                .collect::<Vec<_>>()
        );
        for lines in [20.0, 40.0, 80.0, 160.0] {
            let w = workspace(&case, lines);
            let v = w.volume();
            println!(
                "{lines} {:.5} {:.5} mesh {:.5}",
                v.volume * 1e-6,
                v.uncertainty * 1e-6,
                Mesh::of(&w).volume() * 1e-6
            );
        }
    }
}
