//! `delta-cal plan`, as a user runs it.

use crate::support::{Folder, distance, platform, rows_of};

const ROBOT: &str = "[nominal]\nbase_radius_mm = 194\nplatform_radius_mm = 30\nupper_arm_mm = 260\n\
                     forearm_mm = 480\n[joints]\nmin_deg = -60\nmax_deg = 90\n";
const KNOWN: &str = "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n[noise]\nposition_mm = 0.02\n\
                     joint_deg = 0.002\n";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{ROBOT}{KNOWN}"));
    folder.write("bare.toml", ROBOT);
    folder
}

/// Joint angles and nominal positions of a plan, whose cells to fill in are empty.
fn planned(csv: &str) -> Vec<Vec<f64>> {
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,_nominal_x_mm,_nominal_y_mm,_nominal_z_mm")
    );
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        assert_eq!(cells[3..6], ["", "", ""], "{line}");
        let numbers = cells[..3].iter().chain(&cells[6..]);
        numbers.map(|cell| cell.parse().unwrap()).collect()
    };
    lines.map(row).collect()
}

#[test]
fn the_poses_are_a_samples_file_of_the_nominal_robot() {
    let folder = folder();
    let run = folder
        .run("plan robot.toml --count 12 --output poses.csv")
        .ok();
    assert!(run.stdout.contains("Written: poses.csv"), "{}", run.stdout);
    let rows = planned(&folder.read("poses.csv"));
    assert_eq!(rows.len(), 12);
    for row in &rows {
        let joints = [row[0], row[1], row[2]];
        // Positions are written to the nanometre: half of one in each coordinate.
        let off = distance(
            platform(&crate::support::nominal_arms(), joints),
            [row[3], row[4], row[5]],
        );
        assert!(off < 1e-6, "{row:?}: {off}");
        assert!(joints.iter().all(|q| (-59.0..=89.0).contains(q)), "{row:?}");
    }
    // What is measured at these positions calibrates the robot to what it is, and nothing was measured yet.
    let run = folder.run("calibrate robot.toml poses.csv");
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(
        run.stderr
            .contains("poses.csv:2: nothing was measured in this row"),
        "{}",
        run.stderr
    );
    let exact = folder.run("forward robot.toml poses.csv").ok().stdout;
    folder.write("exact.csv", exact);
    folder
        .run("calibrate robot.toml exact.csv --output calibrated.toml")
        .ok();
    folder.run("check robot.toml poses.csv").ok();
}

#[test]
fn every_number_reads_back_as_it_is_in_the_json() {
    let folder = folder();
    folder
        .run("plan robot.toml --count 20 --output poses.csv --json plan.json")
        .ok();
    let json: serde_json::Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    let rows = planned(&folder.read("poses.csv"));
    for (row, pose) in rows.iter().zip(json["poses"].as_array().unwrap()) {
        for (index, value) in row.iter().enumerate() {
            let key = if index < 3 {
                "joints_deg"
            } else {
                "position_mm"
            };
            let stated = pose[key][index % 3].as_f64().unwrap();
            assert_eq!(stated.to_bits(), (value + 0.0).to_bits(), "{key} {index}");
        }
    }
    // And the next program computes the same position from the same angles.
    let forward = folder.run("forward robot.toml poses.csv").ok().stdout;
    for (row, again) in rows.iter().zip(rows_of(&forward)) {
        assert!(row.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}

#[test]
fn the_same_seed_gives_the_same_poses_on_any_number_of_threads() {
    let folder = folder();
    let poses = |arguments: &str| {
        let arguments = format!("plan robot.toml --count 10 --output - {arguments}");
        folder.run(&arguments).ok().stdout
    };
    let first = poses("");
    assert_eq!(first, poses("--seed 1"));
    assert_ne!(first, poses("--seed 2"));
    for threads in ["1", "2", "5"] {
        let again = folder.run_where(
            "plan robot.toml --count 10 --output -",
            "",
            &[("RAYON_NUM_THREADS", threads)],
        );
        assert_eq!(first, again.ok().stdout, "{threads} threads");
    }
}

#[test]
fn poses_stay_within_a_box_and_within_a_cylinder() {
    let folder = folder();
    let box_ = "x=-100..80,y=-50..100,z=-500..-400";
    let poses = folder.run(&format!(
        "plan robot.toml --count 12 --within {box_} --output -"
    ));
    for row in planned(&poses.ok().stdout) {
        assert!((-100.0..=80.0).contains(&row[3]), "{row:?}");
        assert!((-50.0..=100.0).contains(&row[4]), "{row:?}");
        assert!((-500.0..=-400.0).contains(&row[5]), "{row:?}");
    }
    let poses = folder.run("plan robot.toml --count 12 --within r=90,z=-450..-350 --output -");
    for row in planned(&poses.ok().stdout) {
        assert!(row[3].hypot(row[4]) <= 90.0, "{row:?}");
        assert!((-450.0..=-350.0).contains(&row[5]), "{row:?}");
    }
}

/// However large it is: only what the arms can reach is searched.
#[test]
fn a_region_may_be_far_larger_than_the_workspace() {
    let folder = folder();
    for region in ["r=1e5,z=-1e9..1e9", "x=-1e6..1e6,y=-1e6..1e6,z=-1e6..1e6"] {
        let run = folder.run(&format!("plan robot.toml --count 12 --within {region}"));
        run.ok();
    }
}

/// What was planned may be planned again; what was measured is not written over.
#[test]
fn measured_positions_are_replaced_only_by_force() {
    let folder = folder();
    let plan = "plan robot.toml --count 12 --output poses.csv";
    folder.write("poses.csv", "");
    folder.run(plan).ok();
    folder.run(&format!("{plan} --seed 2")).ok();
    let planned = folder.read("poses.csv");
    // A row that is measured, and one that is not finished.
    let (header, rows) = planned.split_once('\n').unwrap();
    let measured = planned.replacen(",,,,", ",1.5,2.5,-450.5,", 1);
    assert_ne!(measured, planned);
    assert!(!rows.is_empty());
    for text in [
        measured,
        format!("{header}\n10,20,30,5,,,1,2,3\n"),
        "notes".to_owned(),
    ] {
        folder.write("poses.csv", &text);
        let run = folder.run(plan);
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains("--force"), "{}", run.stderr);
        assert_eq!(folder.read("poses.csv"), text);
        folder.run(&format!("{plan} --seed 2 --force")).ok();
        assert_eq!(folder.read("poses.csv"), planned);
    }
}

#[test]
fn it_is_said_where_the_tolerance_decides() {
    let folder = folder();
    let words = "do not determine every parameter by themselves";
    // Within a tenth of a millimetre all poses are one.
    for (within, decides) in [
        ("", false),
        ("--within x=0..0.1,y=0..0.1,z=-400..-399.9", true),
    ] {
        let plan = format!("plan robot.toml --count 12 {within}");
        let run = folder.run(&plan).ok();
        assert_eq!(run.stdout.contains(words), decides, "{}", run.stdout);
        let run = folder
            .run(&format!("{plan} --output poses.csv --json -"))
            .ok();
        let json: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(json["determined_without_tolerance"], !decides);
        let check = folder.run("check robot.toml poses.csv");
        assert_eq!(check.code, i32::from(decides), "{}", check.stderr);
    }
}

#[test]
fn a_forearm_limit_is_kept_with_a_margin() {
    let folder = folder();
    folder.write(
        "limited.toml",
        format!("{ROBOT}forearm_max_deg = 25\n{KNOWN}"),
    );
    let run = folder
        .run("plan limited.toml --count 12 --output poses.csv")
        .ok();
    let words: Vec<_> = run.stdout.split_whitespace().collect();
    let words = words.join(" ");
    assert!(words.contains("from the forearms' limit"), "{words}");
    for row in planned(&folder.read("poses.csv")) {
        for (arm, azimuth) in [0_f64, 120.0, 240.0].into_iter().enumerate() {
            // Out of the arm's plane the forearm reaches what the platform does.
            let (sin, cos) = azimuth.to_radians().sin_cos();
            let out = (row[4] * cos - row[3] * sin) / 480.0;
            assert!(out.abs().asin().to_degrees() <= 24.0, "arm {arm}: {row:?}");
        }
    }
}

#[test]
fn what_is_assumed_is_said() {
    let folder = folder();
    let run = folder.run("plan bare.toml --count 12").ok();
    assert!(
        run.stdout.contains("0.02 mm, 0.002° (assumed"),
        "{}",
        run.stdout
    );
    assert!(
        run.stdout.contains("Tolerance: none stated"),
        "{}",
        run.stdout
    );
    assert!(run.stdout.contains("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm"));
    let run = folder.run("plan robot.toml --count 12").ok();
    assert!(
        run.stdout.contains("0.02 mm, 0.002° (stated)"),
        "{}",
        run.stdout
    );
}

#[test]
fn a_wanted_accuracy_is_reached_by_as_many_poses_as_stated_and_not_by_fewer() {
    let folder = folder();
    let json = |arguments: &str| -> serde_json::Value {
        let run = folder
            .run(&format!("plan robot.toml {arguments} --json -"))
            .ok();
        serde_json::from_str(&run.stdout).unwrap()
    };
    let rms = |json: &serde_json::Value| {
        json["planned"]["position_workspace"]["rms_mm"]
            .as_f64()
            .unwrap()
    };
    let found = json("--accuracy 0.02mm");
    assert!(rms(&found) <= 0.02);
    let count = found["accuracy"]["poses_rms"].as_u64().unwrap();
    assert_eq!(found["poses"].as_array().unwrap().len() as u64, count);
    assert!(found["accuracy"]["poses_everywhere"].as_u64().unwrap() >= count);
    let fewer = json(&format!("--count {}", count - 1));
    assert!(rms(&fewer) > 0.02);
    // 20 µm is the same length.
    assert_eq!(
        found["accuracy"],
        json("--accuracy 20um --count 8")["accuracy"]
    );
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_cause() {
    let folder = folder();
    folder.write(
        "narrow.toml",
        ROBOT.replace("-60", "120").replace("90", "130"),
    );
    folder.write("ball.toml", format!("{ROBOT}forearm_max_deg = 0.001\n"));
    let cases = [
        (
            "robot.toml --count 7",
            2,
            "7 poses cannot determine a robot",
        ),
        ("robot.toml --count 0", 2, "0 poses cannot determine"),
        ("robot.toml --count 5000", 2, "more than 500"),
        ("robot.toml", 2, "--count"),
        ("robot.toml --count -3", 2, "a whole number is needed"),
        ("robot.toml --count 12.5", 2, "a whole number is needed"),
        ("robot.toml --accuracy 1e-9mm", 2, "more than 500"),
        ("robot.toml --accuracy -1mm", 2, "a length greater than 0"),
        // The platform's lowest point and next to nothing else.
        (
            "robot.toml --count 12 --within r=500,z=-710..-705",
            2,
            "or next to none",
        ),
        (
            "robot.toml --count 12 --within x=900..950,y=0..10,z=-400..-300",
            2,
            "the robot reaches x",
        ),
        ("robot.toml --count 12 --within z=-500..-400", 2, "x and y"),
        ("robot.toml --count 12 --within r=10", 2, "has r and z"),
        (
            "robot.toml --count 12 --within r=-10,z=-500..-400",
            2,
            "greater than 0",
        ),
        (
            "robot.toml --count 12 --within x=5..1,y=0..1,z=-5..-4",
            2,
            "the smaller number comes first",
        ),
        (
            "robot.toml --count 12 --within r=10,z=-500..abc",
            2,
            "'abc' is not a number",
        ),
        (
            "robot.toml --count 12 --within r=10,r=10,z=-500..-400",
            2,
            "r is given twice",
        ),
        (
            "robot.toml --count 12 --within q=10,z=-500..-400",
            2,
            "'q' is not one of",
        ),
        (
            "robot.toml --count 12 --accuracy 0mm",
            2,
            "a length greater than 0",
        ),
        (
            "robot.toml --count 12 --accuracy 5kg",
            2,
            "a length greater than 0",
        ),
        (
            "bare.toml --count 12 --within x=0..1,y=0..1,z=-401..-400",
            1,
            "do not determine",
        ),
        ("narrow.toml --count 12", 3, "no usable pose"),
        ("ball.toml --count 12", 3, "no usable pose"),
        (
            "robot.toml --count 12 --output robot.toml",
            2,
            "the same file",
        ),
        ("missing.toml --count 12", 3, "missing.toml"),
        (
            "robot.toml --count 12 --output no/such/folder.csv",
            4,
            "no folder",
        ),
    ];
    for (arguments, code, cause) in cases {
        let mut arguments = arguments.to_owned();
        if !arguments.contains("--output") {
            arguments.push_str(" --output poses.csv");
        }
        let run = folder.run(&format!("plan {arguments}"));
        assert_eq!(run.code, code, "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains(cause), "{arguments}: {}", run.stderr);
        assert!(
            !folder.names().contains(&"poses.csv".to_owned()),
            "{arguments}"
        );
    }
}
