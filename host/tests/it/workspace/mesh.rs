use super::robots::{Case, cases, geometries, symmetric, uniform, workspace};
use delta_cal_host::geometry::reach::Reach;
use delta_cal_host::workspace::{Mesh, Workspace};
use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// A robot, its workspace and the mesh; whether it is one of [`geometries`].
struct Meshed {
    case: Case,
    workspace: Workspace,
    mesh: Mesh,
    usual: bool,
}

/// All of them, on 40 lines across the longest side.
static MESHES: LazyLock<Vec<Meshed>> = LazyLock::new(|| {
    let usual = geometries().into_iter().map(|case| (case, true));
    let wild = cases().into_iter().map(|case| (case, false));
    let meshes = usual.chain(wild).map(|(case, usual)| {
        let workspace = workspace(&case, 40.0);
        let mesh = Mesh::of(&workspace);
        Meshed {
            case,
            workspace,
            mesh,
            usual,
        }
    });
    meshes.collect()
});

/// The triangles of a file of binary STL; corners with the same numbers are one, as other programs read it.
fn read_stl(stl: &[u8], flags: TriMeshFlags) -> TriMesh {
    let word = |at: usize| u32::from_le_bytes(stl[at..at + 4].try_into().unwrap());
    let (mut numbers, mut vertices) = (BTreeMap::new(), Vec::new());
    let triangles = (0..word(80) as usize).map(|triangle| {
        [0, 1, 2].map(|corner| {
            let at = 84 + 50 * triangle + 12 * (corner + 1);
            let bits = [at, at + 4, at + 8].map(word);
            *numbers.entry(bits).or_insert_with(|| {
                let [x, y, z] = bits.map(|bits| f64::from(f32::from_bits(bits)));
                vertices.push(Vector::new(x, y, z));
                u32::try_from(vertices.len() - 1).unwrap()
            })
        })
    });
    let triangles: Vec<[u32; 3]> = triangles.collect();
    TriMesh::with_flags(vertices, triangles, flags).unwrap()
}

/// V − E + F of a mesh that is closed, without branches and in one piece; parry3d has built its half-edges, which
/// fails where an edge has two triangles on one side.
fn euler_number(name: &str, mesh: &TriMesh) -> i64 {
    let topology = mesh
        .topology()
        .unwrap_or_else(|| panic!("{name}: branches"));
    let edges = &topology.half_edges;
    assert!(
        edges.iter().all(|edge| edge.twin != u32::MAX),
        "{name}: open"
    );
    let components = mesh.connected_components().unwrap();
    assert_eq!(components.num_connected_components(), 1, "{name}");
    // Around each vertex from one triangle to the next: all of its triangles are in one fan.
    let mut uses = vec![0; topology.vertices.len()];
    for edge in edges {
        uses[edge.vertex as usize] += 1;
    }
    for (vertex, uses) in topology.vertices.iter().zip(uses) {
        let (mut edge, mut fan) = (vertex.half_edge, 0);
        loop {
            edge = edges[edges[edge as usize].twin as usize].next;
            fan += 1;
            if edge == vertex.half_edge {
                break;
            }
        }
        assert_eq!(fan, uses, "{name}: a vertex with two fans");
    }
    let count = |number: usize| i64::try_from(number).unwrap();
    count(topology.vertices.len()) + count(topology.faces.len()) - count(edges.len() / 2)
}

#[test]
fn the_mesh_is_one_closed_surface_without_branches() {
    let flags = TriMeshFlags::HALF_EDGE_TOPOLOGY | TriMeshFlags::CONNECTED_COMPONENTS;
    for meshed in MESHES.iter() {
        let name = &meshed.case.name;
        let read = read_stl(&meshed.mesh.to_stl(), flags);
        let euler = euler_number(name, &read);
        let triangles = meshed.mesh.triangles.len();
        println!("{name}: {triangles} triangles, V - E + F {euler}");
        // A platform wider than the base and limits beyond a whole turn make windows: no number is known.
        let known = meshed.usual && !name.starts_with("platform");
        assert!(!known || euler == 2, "{name}: {euler}");
    }
}

#[test]
fn every_vertex_is_within_the_tolerance_of_the_boundary() {
    let mut rng = Pcg32::seed_from_u64(21);
    for Meshed {
        case,
        workspace,
        mesh,
        ..
    } in MESHES.iter()
    {
        for vertex in &mesh.vertices {
            // Reachable and other positions within the tolerance: the boundary is between them.
            let (mut inside, mut outside) = (false, false);
            for tried in 0..20_000 {
                let mut to = [(); 3].map(|()| uniform(&mut rng)).into();
                if tried < 2 {
                    to = vertex.outward * if tried == 0 { 0.9 } else { -0.9 };
                }
                let reached =
                    workspace.contains(&(vertex.position + to * workspace.tolerance / 1.7321));
                inside |= reached;
                outside |= !reached;
                if inside && outside {
                    break;
                }
            }
            assert!(inside && outside, "{}: {:?}", case.name, vertex.position);
        }
    }
}

#[test]
fn what_the_mesh_holds_and_leaves_out_is_the_volume() {
    for Meshed {
        case,
        workspace,
        mesh,
        ..
    } in MESHES.iter()
    {
        let left_out: f64 = mesh.left_out.iter().map(|piece| piece.volume).sum();
        let (inside, volume) = (mesh.volume() + left_out, workspace.volume());
        println!(
            "{}: mesh {:.4}, left out {:.4}, lines {:.4} ± {:.4}",
            case.name,
            mesh.volume() * 1e-6,
            left_out * 1e-6,
            volume.volume * 1e-6,
            volume.uncertainty * 1e-6
        );
        // Chords of a sphere of the forearms' radius cut off spacing²/(8 Lb), on either side.
        let forearm = case.robot.arms()[0].lb();
        let chords = workspace.grid.spacing.powi(2) / (4.0 * forearm) * volume.area;
        let off = (inside - volume.volume).abs();
        assert!(
            off <= 2.0 * volume.uncertainty + chords,
            "{}: {off}",
            case.name
        );
    }
}

#[test]
fn positions_inside_the_mesh_are_those_that_are_reachable() {
    let mut rng = Pcg32::seed_from_u64(22);
    for meshed in MESHES.iter().filter(|meshed| meshed.usual) {
        let (case, workspace) = (&meshed.case, &meshed.workspace);
        let mesh = read_stl(&meshed.mesh.to_stl(), TriMeshFlags::ORIENTED);
        let (grid, mut far) = (&workspace.grid, 0);
        let (low, high) = (
            grid.node([0; 3]),
            grid.node(grid.counts.map(|count| count - 1)),
        );
        for _ in 0..2000 {
            let at = Vector3::from_fn(|_, _| 0.5 + 0.5 * uniform(&mut rng));
            let x = low + (high - low).component_mul(&at);
            let point = Vector::new(x.x, x.y, x.z);
            // Nearer than a chord's height the mesh need not tell; pieces that it leaves out are far.
            let left_out = workspace.contains(&x) && x.z > 0.0 && case.name == "short forearms";
            if mesh.distance_to_local_point(point, false) > 0.1 * grid.spacing && !left_out {
                far += 1;
                let expected = workspace.contains(&x);
                assert_eq!(
                    mesh.contains_local_point(point),
                    expected,
                    "{}: {x:?}",
                    case.name
                );
            }
        }
        assert!(far > 1000, "{far}");
    }
}

/// Places on the sharp rim of a symmetric robot, on circles where the sphere of one arm at its least angle meets
/// that of another at its largest; each within this many mm of both reachable positions and others.
fn rim(case: &Case, within: f64) -> Vec<Vector3<f64>> {
    let Reach { limits, .. } = case.reach;
    let (arms, mut rim) = (case.robot.arms(), Vec::new());
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let (a, b) = (
            arms[i].elbow(limits.minimum()),
            arms[j].elbow(limits.maximum()),
        );
        let half = (b - a) / 2.0;
        let radius = (arms[i].lb().powi(2) - half.norm_squared()).sqrt();
        let across = half.cross(&Vector3::new(0.3, 0.4, 0.5)).normalize();
        let other = half.normalize().cross(&across);
        for degrees in 0..3600 {
            let (sin, cos) = (f64::from(degrees) * 0.1).to_radians().sin_cos();
            let x = a + half + (across * cos + other * sin) * radius;
            // Inwards is away from one elbow and towards the other.
            let inwards = ((x - a).normalize() - (x - b).normalize()).normalize() * within;
            let reach = |x: &Vector3<f64>| case.reach.any_joints(&case.robot, x).is_ok();
            if reach(&(x + inwards)) && !reach(&(x - inwards)) {
                rim.push(x);
            }
        }
    }
    rim
}

#[test]
fn a_sharp_rim_is_an_edge_of_the_mesh_and_not_a_saw() {
    for (base, upper, fore) in [(155.0, 235.0, 800.0), (90.0, 200.0, 900.0)] {
        let case = Case {
            name: format!("{base}/{upper}/{fore}"),
            robot: symmetric(base, upper, fore),
            reach: super::robots::reach(-60.0, 90.0, None),
        };
        let workspace = workspace(&case, 60.0);
        let mesh = read_stl(&Mesh::of(&workspace).to_stl(), TriMeshFlags::empty());
        let rim = rim(&case, 0.02);
        let off =
            |x: &Vector3<f64>| mesh.distance_to_local_point(Vector::new(x.x, x.y, x.z), false);
        let most = rim.iter().map(off).fold(0.0, f64::max);
        println!(
            "{}: {} places of the rim, {most:.3} mm off at most, lines {:.1} mm apart",
            case.name,
            rim.len(),
            workspace.grid.spacing
        );
        assert!(rim.len() > 1000, "{}", rim.len());
        // The height of a chord of twice the spacing on a circle of half the forearm.
        assert!(most <= workspace.grid.spacing.powi(2) / fore, "{most}");
    }
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
