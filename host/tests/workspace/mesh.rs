use super::robots::{cases, workspace};
use delta_cal_host::workspace::Mesh;
use nalgebra::Vector3;
use std::collections::HashMap;

/// For each edge: how often it is run along one way less the other, and how often at all.
fn edges(mesh: &Mesh) -> HashMap<(usize, usize), (i32, u32)> {
    let mut edges: HashMap<(usize, usize), (i32, u32)> = HashMap::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            let edge = edges.entry((a.min(b), a.max(b))).or_default();
            edge.0 += if a < b { 1 } else { -1 };
            edge.1 += 1;
        }
    }
    edges
}

#[test]
fn the_mesh_is_closed_and_turned_outwards() {
    for case in cases() {
        let workspace = workspace(&case, 40.0);
        let mesh = Mesh::of(&workspace);
        let edges = edges(&mesh);
        assert!(edges.values().all(|(sum, _)| *sum == 0), "{}", case.name);
        // Where two sheets come nearer than the spacing, an edge may have four triangles.
        let pinched = edges.values().filter(|(_, uses)| *uses != 2).count();
        assert!(pinched * 1000 <= edges.len(), "{}: {pinched}", case.name);
        // What is cut off at edges that two singularities make falls with the spacing.
        let (inside, volume) = (mesh.volume(), workspace.volume().volume);
        assert!(
            (inside / volume - 1.0).abs() < 0.02,
            "{}: {inside} {volume}",
            case.name
        );
    }
}

#[test]
fn corners_of_the_mesh_are_on_the_boundary_where_the_joints_limit_it() {
    let case = &cases()[0];
    let workspace = workspace(case, 80.0);
    let mesh = Mesh::of(&workspace);
    let edges = edges(&mesh);
    assert!(edges.values().all(|(_, uses)| *uses == 2));
    let (inside, volume) = (mesh.volume(), workspace.volume().volume);
    assert!((inside / volume - 1.0).abs() < 5e-4, "{inside} {volume}");
    // Moved by a thousandth of the spacing to all sides, a corner is both inside and outside.
    let step = 1e-3 * workspace.grid.spacing;
    let mut off = 0;
    for vertex in &mesh.vertices {
        let around = (0..6).map(|way| {
            let sign = if way % 2 == 0 { step } else { -step };
            workspace.contains(&(vertex + Vector3::ith(way / 2, sign)))
        });
        let inside = around.filter(|inside| *inside).count();
        off += usize::from(inside == 0 || inside == 6);
    }
    println!("{off} of {} corners off the boundary", mesh.vertices.len());
    assert!(off * 50 <= mesh.vertices.len());
}

#[test]
fn the_stl_says_what_the_mesh_says() {
    let mesh = Mesh::of(&workspace(&cases()[0], 20.0));
    let stl = mesh.to_stl();
    assert_eq!(stl.len(), 84 + 50 * mesh.triangles.len());
    assert!(!stl.starts_with(b"solid"), "that is how ASCII files begin");
    let number = |at: usize| f64::from(f32::from_le_bytes(stl[at..at + 4].try_into().unwrap()));
    let mut volume = 0.0;
    for triangle in 0..mesh.triangles.len() {
        let at = 84 + 50 * triangle;
        let vector = |k: usize| {
            let at = at + 12 * k;
            Vector3::new(number(at), number(at + 4), number(at + 8))
        };
        let [normal, a, b, c] = [0, 1, 2, 3].map(vector);
        let across = (b - a).cross(&(c - a));
        // Slivers lose their direction in single precision.
        assert!(across.norm() < 5.0 || (across.normalize() - normal).norm() < 2e-3);
        volume += a.dot(&b.cross(&c)) / 6.0;
    }
    // Coordinates of up to 700 mm in single precision, 4e-5 mm, over 1.3 m².
    assert!((volume - mesh.volume()).abs() < 100.0);
}
