//! The targets that hold everything: the model for simulators, and LinuxCNC's component.

use crate::export::robots::{example, one_arm_longer};
use crate::support::{Folder, Point, arms_of, distance, platform};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace()
        .map(|n| n.parse().unwrap())
        .collect()
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Node<'a, 'a> {
    node.children()
        .find(|child| child.has_tag_name(name))
        .unwrap()
}

fn first_three(text: &str) -> Point {
    let [x, y, z] = numbers(text)[..3] else {
        panic!("{text}")
    };
    [x, y, z].map(|metres| 1000.0 * metres)
}

/// Rodrigues' formula.
fn turned(v: Point, axis: Point, angle: f64) -> Point {
    let (sin, cos) = angle.sin_cos();
    let dot = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
    let cross = [
        axis[1] * v[2] - axis[2] * v[1],
        axis[2] * v[0] - axis[0] * v[2],
        axis[0] * v[1] - axis[1] * v[0],
    ];
    [0, 1, 2].map(|k| v[k] * cos + cross[k] * sin + axis[k] * dot * (1.0 - cos))
}

fn difference(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] - b[k])
}

#[test]
fn the_model_for_simulators_has_the_calibrated_robots_loops() {
    for prepare in [example, one_arm_longer] {
        let folder = Folder::new();
        prepare(&folder);
        folder
            .run("export calibrated.toml --for sdf --output robot.sdf")
            .ok();
        let text = folder.read("robot.sdf");
        let document = Document::parse(&text).unwrap();
        let root = document.root_element();
        assert!(root.has_tag_name("sdf") && root.attribute("version") == Some("1.8"));
        let model = child(root, "model");
        let place = |name: &str| {
            let node = model
                .children()
                .find(|node| node.attribute("name") == Some(name))
                .unwrap();
            first_three(child(node, "pose").text().unwrap())
        };
        let joints: BTreeMap<_, _> = model
            .children()
            .filter(|node| node.has_tag_name("joint"))
            .map(|node| (node.attribute("name").unwrap(), node))
            .collect();
        // Every joint joins links that are there, and three of them hold the platform.
        let links: Vec<_> = model
            .children()
            .filter(|node| node.has_tag_name("link"))
            .map(|node| node.attribute("name").unwrap())
            .collect();
        for joint in joints.values() {
            for end in ["parent", "child"] {
                let link = child(*joint, end).text().unwrap();
                assert!(link == "world" || links.contains(&link), "{link}");
            }
        }
        let holds = |node: &&Node| child(**node, "child").text() == Some("platform");
        assert_eq!(joints.values().filter(holds).count(), 3);

        let calibrated = arms_of(&folder.read("calibrated.toml"));
        let home = place("platform");
        for q in [[0.0; 3], [10.0, -20.0, 30.0], [55.0, 40.0, 60.0]] {
            let is = platform(&calibrated, q);
            for (number, q) in (1..).zip(q) {
                let motor = place(&format!("motor_{number}"));
                let axis = child(joints[format!("motor_{number}").as_str()], "axis");
                let axis = numbers(child(axis, "xyz").text().unwrap());
                let axis = [axis[0], axis[1], axis[2]];
                let elbow = place(&format!("elbow_{number}"));
                let upper = turned(difference(elbow, motor), axis, f64::to_radians(q));
                let elbow_there = [0, 1, 2].map(|k| motor[k] + upper[k]);
                // The rod is as long as in the model's own pose: the loop closes where the robot is.
                let rod = distance(home, elbow);
                assert!((distance(is, elbow_there) - rod).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn the_pins_of_linuxcncs_component_are_the_calibrated_robot() {
    for prepare in [example, one_arm_longer] {
        let folder = Folder::new();
        prepare(&folder);
        let export = |name: &str| {
            let command = format!(
                "export {name} --for linuxcnc-component --home-deg -40,-41,-42 --output robot.hal --json report.json"
            );
            folder.run(&command).ok();
            folder.read("robot.hal")
        };
        let lines = export("calibrated.toml");
        let pin = |name: &str| -> f64 {
            let start = format!("setp deltacalkins.{name} ");
            let value = lines.lines().find_map(|line| line.strip_prefix(&start));
            value.unwrap().parse().unwrap()
        };
        let written: [[f64; 8]; 3] = [1, 2, 3].map(|arm| {
            let keys = ["dx", "dy", "dz", "theta", "alpha", "la-x", "la-y", "lb"];
            keys.map(|key| pin(&format!("arm{arm}.{key}")))
        });
        let calibrated = arms_of(&folder.read("calibrated.toml"));
        for q in [[0.0; 3], [10.0, -20.0, 30.0], [55.0, 40.0, 60.0]] {
            // 24 numbers are written to 1e-9 mm and degrees.
            let off = distance(platform(&written, q), platform(&calibrated, q));
            assert!(off < 1e-6, "{off}");
        }
        // The last of the pins, and another one for another robot.
        let setp = |line: &&str| line.starts_with("setp");
        let last = lines.lines().rfind(setp).unwrap();
        assert!(last.contains("deltacalkins.revision "), "{last}");
        assert!(pin("revision") >= 1.0);
        assert_ne!(last, export("robot.toml").lines().rfind(setp).unwrap());
        assert!(lines.contains("# [JOINT_2]") && lines.contains("# HOME_OFFSET = -42.0000"));
        let report: serde_json::Value = serde_json::from_str(&folder.read("report.json")).unwrap();
        assert!(report["loss"]["worst_mm"].as_f64().unwrap() < 1e-6);
        assert_eq!(report["parameters"].as_array().unwrap().len(), 24);
    }
}
