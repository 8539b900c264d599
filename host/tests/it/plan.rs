//! `delta-cal plan`: as a user runs it, and whether calibrations achieve what it states.

use crate::support::{
    Folder, NOMINAL, TO_MEASURE, TOWERS, assert_refused, distance, nominal_arms, number, platform,
    true_arms,
};
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{DistanceFrom, Observation};
use delta_cal::simulate::standard_normal;
use delta_cal_host::accuracy::uncertainty::WorkspacePoses;
use delta_cal_host::planning::{Kind, Order, Plan, PlanRequest, Planned, Setup, plan};
use delta_cal_host::{
    Frame, InputText, Options, PositionUnit, Reading, ReadingFrom, Readings, RobotFile, Row,
    calibrate,
};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, perturbed, size};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;
use serde_json::Value;

const KNOWN: &str = "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n[noise]\nposition_mm = 0.02\n\
                     joint_deg = 0.002\n";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{KNOWN}"));
    folder.write("bare.toml", NOMINAL);
    folder.write("touched.toml", TO_MEASURE);
    folder
}

/// Joint angles and nominal positions of a plan, whose cells to fill in are empty.
fn planned(csv: &str) -> Vec<[f64; 6]> {
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,_nominal_x_mm,_nominal_y_mm,_nominal_z_mm")
    );
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        assert_eq!(cells[3..6], ["", "", ""], "{line}");
        [0, 1, 2, 6, 7, 8].map(|cell| cells[cell].parse().unwrap())
    };
    lines.map(row).collect()
}

fn json(folder: &Folder, arguments: &str) -> (i32, Value) {
    let run = folder.run(&format!("plan {arguments} --json -"));
    let json = serde_json::from_str(&run.stdout);
    (
        run.code,
        json.unwrap_or_else(|_| panic!("{}{}", run.stdout, run.stderr)),
    )
}

#[test]
fn the_poses_are_a_samples_file_of_the_nominal_robot() {
    let folder = folder();
    let plan = "plan robot.toml --count 12 --output poses.csv --json plan.json";
    let run = folder.run(plan).ok();
    assert!(run.stdout.contains("Written: poses.csv"), "{}", run.stdout);
    let rows = planned(&folder.read("poses.csv"));
    // The first once more at the end.
    assert_eq!(rows.len(), 13);
    assert_eq!(format!("{:?}", rows[0]), format!("{:?}", rows[12]));
    let json: Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    for (row, stated) in rows.iter().zip(json["measurements"].as_array().unwrap()) {
        let [a, b, c, x, y, z] = *row;
        // Positions are written to the nanometre: half of one in each coordinate.
        let off = distance(platform(&nominal_arms(), [a, b, c]), [x, y, z]);
        assert!(off < 1e-6, "{row:?}: {off}");
        assert!(
            [a, b, c].iter().all(|q| (-59.0..=89.0).contains(q)),
            "{row:?}"
        );
        for (index, value) in row.iter().enumerate() {
            let key = if index < 3 { "joints" } else { "position_mm" };
            assert_eq!(
                stated[key][index % 3].as_f64(),
                Some(*value + 0.0),
                "{key} {index}"
            );
        }
    }
    // Nothing is measured yet.
    let run = folder.run("calibrate robot.toml poses.csv");
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(
        run.stderr.contains("poses.csv:2: nothing was measured"),
        "{}",
        run.stderr
    );
    // What is measured at these positions calibrates the robot to what it is.
    let exact = folder.run("forward robot.toml poses.csv").ok().stdout;
    folder.write("exact.csv", exact);
    folder
        .run("calibrate robot.toml exact.csv --output calibrated.toml")
        .ok();
}

#[test]
fn the_plan_is_the_same_on_any_number_of_threads() {
    let folder = folder();
    let plan = "plan robot.toml --count 10 --output -";
    let first = folder.run(plan).ok().stdout;
    for threads in ["1", "5"] {
        let again = folder.run_where(plan, "", &[("RAYON_NUM_THREADS", threads)]);
        assert_eq!(first, again.ok().stdout, "{threads} threads");
    }
}

/// Sorted along the shortest way a drift looks like a parameter; at random it does not.
#[test]
fn the_order_is_random_or_the_shortest() {
    let folder = folder();
    let travel = |rows: &[[f64; 6]]| -> f64 {
        let step = |pair: &[[f64; 6]]| {
            let moves = (0..3).map(|joint| (pair[1][joint] - pair[0][joint]).abs());
            moves.fold(0.0, f64::max)
        };
        rows.windows(2).map(step).sum()
    };
    let random = planned(
        &folder
            .run("plan robot.toml --count 16 --output -")
            .ok()
            .stdout,
    );
    let plan = "plan robot.toml --count 16 --order shortest --output -";
    let shortest = planned(&folder.run(plan).ok().stdout);
    assert_eq!((random.len(), shortest.len()), (17, 16));
    assert!(travel(&shortest) < 0.7 * travel(&random));
    let sorted = |rows: &[[f64; 6]]| {
        let mut rows: Vec<_> = rows.iter().map(|row| format!("{row:?}")).collect();
        rows.sort();
        rows
    };
    assert_eq!(sorted(&random[..16]), sorted(&shortest));
}

#[test]
fn poses_stay_within_a_box_and_within_a_cylinder() {
    let folder = folder();
    let poses = |within: &str| {
        let run = folder.run(&format!(
            "plan robot.toml --count 12 --within {within} --output -"
        ));
        planned(&run.ok().stdout)
    };
    for [_, _, _, x, y, z] in poses("x=-100..80,y=-5cm..10cm,z=-500mm..-400mm") {
        assert!((-100.0..=80.0).contains(&x) && (-50.0..=100.0).contains(&y));
        assert!((-500.0..=-400.0).contains(&z));
    }
    for [_, _, _, x, y, z] in poses("r=90,z=-450..-350") {
        assert!(x.hypot(y) <= 90.0 && (-450.0..=-350.0).contains(&z));
    }
    // However large the region is: only what the arms can reach is searched.
    poses("r=1e5,z=-1e9..1e9");
}

/// What was planned may be planned again; what was measured is not written over.
#[test]
fn measured_positions_are_replaced_only_by_force() {
    let folder = folder();
    let plan = "plan robot.toml --count 12 --output poses.csv";
    folder.write("poses.csv", "");
    folder.run(plan).ok();
    folder.run(plan).ok();
    let planned = folder.read("poses.csv");
    let (header, _) = planned.split_once('\n').unwrap();
    for text in [
        planned.replacen(",,,,", ",1.5,2.5,-450.5,", 1),
        format!("{header}\n10,20,30,5,,,1,2,3\n"),
        "notes".to_owned(),
    ] {
        folder.write("poses.csv", &text);
        let run = folder.run(plan);
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains("--force"), "{}", run.stderr);
        assert_eq!(folder.read("poses.csv"), text);
        folder.run(&format!("{plan} --force")).ok();
        assert_eq!(folder.read("poses.csv"), planned);
    }
}

#[test]
fn what_is_assumed_is_said() {
    let folder = folder();
    let said = |robot: &str| {
        let run = folder
            .run(&format!("plan {robot} --count 30 --measure xyz"))
            .ok();
        let words: Vec<_> = run.stdout.split_whitespace().collect();
        words.join(" ")
    };
    let bare = said("bare.toml");
    for words in [
        "0.02 mm",
        "0.002°",
        "assumed",
        "Tolerance: none stated",
        "random (seed 1)",
    ] {
        assert!(bare.contains(words), "{words}: {bare}");
    }
    assert!(!said("robot.toml").contains("assumed"));
}

#[test]
fn an_accuracy_is_reached_by_as_many_as_stated_and_not_by_fewer() {
    let folder = folder();
    let rms = |json: &Value| number(json, "planned/relative_rms_mm");
    let (_, found) = json(&folder, "robot.toml --accuracy 0.014mm");
    assert!(rms(&found) <= 0.014);
    let count = found["count"].as_u64().unwrap();
    let (_, fewer) = json(&folder, &format!("robot.toml --count {}", count - 1));
    assert!(rms(&fewer) > 0.014, "{count}: {fewer}");
    // No number of poses does it.
    let run = folder.run("plan robot.toml --accuracy 1e-12mm");
    assert_eq!(run.code, 2);
    assert!(
        run.stderr.contains("no number of measurements up to 500"),
        "{}",
        run.stderr
    );
}

#[test]
fn regions_that_make_no_sense_are_refused_with_their_cause() {
    let folder = folder();
    let table = "
        r=500,z=-710..-705 ⇒ 2 ⇒ or next to none
        x=900..950,y=0..10,z=-400..-300 ⇒ 2 ⇒ the robot reaches x
        z=-500..-400 ⇒ 2 ⇒ x and y
        r=10 ⇒ 2 ⇒ has r and z
        r=-10,z=-500..-400 ⇒ 2 ⇒ greater than 0
        x=5..1,y=0..1,z=-5..-4 ⇒ 2 ⇒ the smaller number comes first
        r=10,z=-500..abc ⇒ 2 ⇒ 'abc' is not a number
        r=10,r=10,z=-500..-400 ⇒ 2 ⇒ r is given twice
        q=10,z=-500..-400 ⇒ 2 ⇒ 'q' is not one of
        ";
    assert_refused(&folder, "plan robot.toml --count 12 --within", table);
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_cause() {
    let folder = folder();
    folder.write(
        "narrow.toml",
        NOMINAL.replace("-60", "120").replace("90", "130"),
    );
    let deep = "[planes.table]\nz_mm = -2000\nsigma_mm = 5\n";
    folder.write("deep.toml", format!("{NOMINAL}{KNOWN}{deep}"));
    let blocks = "[planes.table]\nz_mm = -500\nsigma_mm = 5\nblocks_mm = [0, -5]\n";
    folder.write("blocks.toml", format!("{NOMINAL}{KNOWN}{blocks}"));
    let lengths = "[points.A]\nlength_mm = [300, 100]\n";
    folder.write("lengths.toml", format!("{NOMINAL}{KNOWN}{lengths}"));
    let table = "
        robot.toml --count 3 ⇒ 2 ⇒ only 4 to 500
        robot.toml --count 5000 ⇒ 2 ⇒ only 4 to 500
        robot.toml ⇒ 2 ⇒ --count
        robot.toml --count -3 ⇒ 2 ⇒ a whole number is needed
        robot.toml --accuracy -1mm ⇒ 2 ⇒ length
        robot.toml --accuracy 1mm --count 12 ⇒ 2 ⇒ cannot be used with
        robot.toml --count 12 --measure plate ⇒ 2 ⇒ 'plate' is not
        robot.toml --count 12 --measure plane,plane ⇒ 2 ⇒ given twice
        robot.toml --count 12 --measure plane=0 ⇒ 2 ⇒ whole number above 0
        robot.toml --count 8 --measure plane=3,distance=2 ⇒ 2 ⇒ only 5 measurements
        robot.toml --count 12 --measure plane --frame sensor ⇒ 2 ⇒ for coordinates
        deep.toml --count 12 --measure plane ⇒ 2 ⇒ no reachable pose
        blocks.toml --count 12 ⇒ 3 ⇒ a gauge block is 0 mm
        lengths.toml --count 12 ⇒ 3 ⇒ length_mm
        bare.toml --count 12 --within x=0..1,y=0..1,z=-401..-400 ⇒ 1 ⇒ do not determine
        bare.toml --count 12 --measure plane ⇒ 1 ⇒ do not determine
        narrow.toml --count 12 ⇒ 3 ⇒ no usable pose
        missing.toml --count 12 ⇒ 3 ⇒ missing.toml
        ";
    assert_refused(&folder, "plan --output poses.csv", table);
    let table = "
        robot.toml ⇒ 2 ⇒ the same file
        no/such/folder.csv ⇒ 4 ⇒ no folder
        ";
    assert_refused(&folder, "plan robot.toml --count 12 --output", table);
}

/// Planes, gauge blocks, points and lengths are those of the robot file.
#[test]
fn instruments_come_from_the_robot_file() {
    let folder = folder();
    let instruments = "[planes.table]\nz_mm = -520\nsigma_mm = 5\nblocks_mm = [0, 50]\n\
                       [points.A]\nlength_mm = [250, 250]\n[points.B]\n[distances]\nlength_mm = [80, 150]\n";
    folder.write("robot.toml", format!("{TO_MEASURE}{instruments}"));
    let run = folder
        .run("plan robot.toml --measure plane --count 24 --output touches.csv")
        .ok();
    assert!(
        run.stdout.contains("Put table at z = -520 mm"),
        "{}",
        run.stdout
    );
    let plan = "plan robot.toml --measure plane,point,distance=6 --count 24 --output plan.csv --json plan.json";
    folder.run(plan).ok();
    assert_eq!(
        folder.read("plan.csv").lines().next(),
        Some(
            "q1_deg,q2_deg,q3_deg,distance_mm,point,to_q1_deg,to_q2_deg,to_q3_deg,\
             _nominal_x_mm,_nominal_y_mm,_nominal_z_mm,_nominal_distance_mm"
        )
    );
    let json: Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    let point = |value: &Value| [0, 1, 2].map(|axis| value[axis].as_f64().unwrap());
    let all = json["measurements"].as_array().unwrap();
    let mut distances = 0;
    for own in all {
        let at = point(&own["position_mm"]);
        // Joint angles are rounded to 0.001°: 0.005 mm at the end of the upper arm, some times that at the
        // platform where the forearms are steep.
        match own["measure"].as_str().unwrap() {
            "plane" => {
                let block = own["block_mm"].as_f64().unwrap();
                assert!([0.0, 50.0].contains(&block) && own["plane"] == "table");
                assert!((at[2] + 520.0 - block).abs() < 0.05, "{own}");
            }
            "point" => {
                let mut points = json["points"].as_array().unwrap().iter();
                let place = points.find(|place| place[0] == own["point"]).unwrap();
                let length = distance(at, point(&place[1]));
                let expected = if own["point"] == "A" {
                    250.0..=250.0
                } else {
                    50.0..=2000.0
                };
                assert!(
                    length > expected.start() - 0.05 && length < expected.end() + 0.05,
                    "{own}"
                );
            }
            _ => {
                distances += 1;
                let length = distance(at, platform(&nominal_arms(), point(&own["to_joints"])));
                assert!((79.95..=150.05).contains(&length), "{length}");
            }
        }
    }
    // Six, and the first of them once more.
    assert!(distances <= 7, "{distances}");
    assert_eq!(json["count"], 24);
    // One repeated measurement of each instrument: the plane, each point, distances.
    assert!((26..=28).contains(&all.len()), "{}", all.len());
}

/// In a frame that is unknown nothing but the tolerance says where the robot stands: what the tolerance allows,
/// 1.7 mm, is not reduced by half, whatever is measured there; relative positions are known to hundredths.
#[test]
fn an_unknown_frame_leaves_absolute_positions_to_the_tolerance() {
    let folder = folder();
    let (_, sensor) = json(&folder, "robot.toml --count 20 --frame sensor");
    let (_, base) = json(&folder, "robot.toml --count 20");
    let of = |json: &Value, key: &str| number(json, &format!("planned/{key}"));
    assert!(of(&sensor, "absolute_rms_mm") > 0.5 * number(&sensor, "before/absolute_rms_mm"));
    assert!(of(&sensor, "relative_rms_mm") < 2.0 * of(&base, "relative_rms_mm"));
    assert!(of(&sensor, "relative_rms_mm") > of(&base, "relative_rms_mm"));
    let (_, absolute) = json(&folder, "robot.toml --count 20 --absolute");
    assert!(of(&absolute, "absolute_rms_mm") < of(&base, "absolute_rms_mm"));
}

/// The same rows in a plan and in a file: the same expected error, and additions better it.
#[test]
fn a_file_of_rows_is_judged_as_the_plan_that_it_was() {
    let folder = folder();
    for kinds in ["xyz", "plane", "distance", "plane,xy=6"] {
        let plan =
            format!("plan touched.toml --measure {kinds} --count 16 --output rows.csv --force");
        folder.run(&format!("{plan} --json plan.json")).ok();
        let planned: Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
        let (code, found) = json(
            &folder,
            "touched.toml --samples rows.csv --count 6 --output more.csv",
        );
        assert_eq!(code, 0, "{kinds}");
        assert_eq!(
            found["unmeasured_lines"].as_array().unwrap().len(),
            rows(&folder, "rows.csv")
        );
        let rms = |json: &Value, of: &str| number(json, &format!("{of}/relative_rms_mm"));
        let expected = rms(&planned, "expected_error");
        assert!(
            (rms(&found, "expected_error") / expected - 1.0).abs() < 1e-3,
            "{kinds}: {found}"
        );
        let with_next = rms(&found, "expected_error_with_next");
        assert!(with_next < rms(&found, "expected_error"), "{kinds}");
        // What is proposed is a file to fill in, and brings what is promised.
        assert_eq!(rows(&folder, "more.csv"), 6);
        let more = folder.read("more.csv");
        let (header, added) = more.split_once('\n').unwrap();
        let given = folder.read("rows.csv");
        if given.starts_with(header) {
            folder.write("all.csv", format!("{given}{added}"));
            let (_, all) = json(&folder, "touched.toml --samples all.csv --count 0");
            assert!(
                (rms(&all, "expected_error") / with_next - 1.0).abs() < 1e-3,
                "{kinds}: {all}"
            );
        }
    }
}

fn rows(folder: &Folder, name: &str) -> usize {
    folder.read(name).lines().count() - 1
}

#[test]
fn measured_rows_are_judged_wherever_the_instruments_stand() {
    let folder = folder();
    folder
        .run("plan touched.toml --measure plane --count 20 --output rows.csv")
        .ok();
    let empty = folder.read("rows.csv");
    // A plate 40 mm lower, tilted by 0.3°, under a robot that was made with errors.
    let measured = empty.lines().enumerate().map(|(index, line)| {
        let cells: Vec<_> = line.split(',').collect();
        if index == 0 {
            return cells[..4].join(",");
        }
        let joints = [0, 1, 2].map(|joint| cells[joint].parse().unwrap());
        let [x, y, z] = platform(&true_arms(), joints);
        let height = (z + 600.0 - 0.005 * x + 0.002 * y) / f64::sqrt(1.000_029);
        format!("{},{height:.4}", cells[..3].join(","))
    });
    let measured: Vec<_> = measured.collect();
    folder.write("touches.csv", measured.join("\n") + "\n");
    let rms = |json: &Value| number(json, "expected_error/relative_rms_mm");
    let (code, found) = json(&folder, "touched.toml --samples touches.csv");
    let (_, planned) = json(&folder, "touched.toml --samples rows.csv");
    assert_eq!(
        (code, &found["unmeasured_lines"]),
        (0, &serde_json::json!([]))
    );
    // The derivatives are those at other places of the plate.
    assert!(
        (rms(&found) / rms(&planned) - 1.0).abs() < 0.1,
        "{found} {planned}"
    );
    assert_eq!(found["next"].as_array().unwrap().len(), 4);

    // Too little is said to be too little.
    folder.write("few.csv", measured[..5].join("\n") + "\n");
    let run = folder.run("plan touched.toml --samples few.csv");
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(
        run.stderr.contains("not expected to halve"),
        "{}",
        run.stderr
    );
    // Heights of one plane say nothing of the scale.
    let bare = "[planes.plane]\nz_mm = -560\nsigma_mm = 10\nblocks_mm = [0]\n";
    folder.write("plate.toml", format!("{TO_MEASURE}{bare}"));
    folder
        .run("plan plate.toml --measure plane --count 30 --output plate.csv")
        .ok();
    let (_, found) = json(&folder, "plate.toml --samples plate.csv");
    assert!(
        found["verdict"].as_str().unwrap().contains("not the scale"),
        "{found}"
    );
    // A row that says nothing of what to measure is no row.
    folder.write(
        "wrong.csv",
        "q1_deg,q2_deg,q3_deg,distance_mm,point\n1,2,3,400,A\n4,5,6,,\n",
    );
    let run = folder.run("plan touched.toml --samples wrong.csv");
    assert_eq!(run.code, 3);
    assert!(run.stderr.contains("wrong.csv:3"), "{}", run.stderr);
}

/// All proportions, and a robot with towers; with a noise of everything.
fn robots() -> Vec<(String, RobotFile)> {
    let read = |text: &str| RobotFile::read(&InputText::new("robot.toml", text)).unwrap();
    let noise = "height_mm = 0.02\ndistance_mm = 0.05\n";
    let all = geometries().into_iter().map(|(name, robot)| {
        let mut file = read(&format!("{NOMINAL}{KNOWN}{noise}"));
        file.robot = robot;
        (name.to_owned(), file)
    });
    let towers = ("towers".to_owned(), read(TOWERS));
    all.chain([towers]).collect()
}

fn normal(rng: &mut Pcg32) -> f64 {
    standard_normal::<f64, _>(rng)
}

fn somewhere(size: f64, rng: &mut Pcg32) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * normal(rng))
}

/// What is read of a robot that was built with errors, by instruments that stand a little elsewhere and tilted.
fn measured(plan: &Plan, built: &Robot<f64>, rng: &mut Pcg32) -> Vec<Observation<f64>> {
    let robot = &plan.setup.robot;
    let noise = robot.noise.unwrap();
    let facts = &robot.instruments;
    let mut elsewhere: Setup = plan.setup.clone();
    for plane in &mut elsewhere.planes {
        let tilted = Vector3::new(0.005 * normal(rng), 0.005 * normal(rng), 1.0);
        plane.normal = tilted.normalize();
        plane.offset += 3.0 * normal(rng);
    }
    for point in &mut elsewhere.points {
        point.place += somewhere(5.0, rng);
    }
    if elsewhere.frame == Frame::Sensor {
        elsewhere.to_frame = RigidTransform {
            rotation: *Rotation3::from_scaled_axis(somewhere(0.5, rng)).matrix(),
            translation: somewhere(300.0, rng),
        };
    }
    let read = |own: &Planned| {
        assert!(
            built.forward(&own.pose.joints).is_ok(),
            "one robot in many thousands"
        );
        let mut row = elsewhere.read(built, &elsewhere.row(own));
        let mut off = |joints: [f64; 3]| joints.map(|q| q + noise.joint() * normal(rng));
        row.joints = off(row.joints);
        if let Some(distance) = &mut row.distance {
            if let DistanceFrom::Pose(joints) = &mut distance.from {
                *joints = off(*joints);
            }
            distance.distance += facts.distance_noise.unwrap() * normal(rng);
        }
        if let Some(height) = &mut row.height {
            height.height += facts.height_noise.unwrap() * normal(rng);
        }
        row.position = row
            .position
            .map(|own| own.map(|x| x + noise.position() * normal(rng)));
        row
    };
    plan.measurements.iter().map(read).collect()
}

/// The calibration of what was read; `None` if it is refused.
fn calibrated(plan: &Plan, rows: &[Observation<f64>]) -> Option<Robot<f64>> {
    let setup = &plan.setup;
    // A file does not name a point that the plan does without.
    let used: Vec<_> = (0..setup.points.len())
        .filter(|point| {
            plan.measurements
                .iter()
                .any(|own| own.point == Some(*point))
        })
        .collect();
    let place = |point: u8| used.iter().position(|own| *own == usize::from(point));
    let row = |(line, own): (u64, &Observation<f64>)| Row {
        line,
        value: Reading {
            joints: own.joints,
            position: own.position,
            height: own.height.map(|own| (usize::from(own.plane), own.height)),
            distance: own.distance.map(|own| {
                let from = match own.from {
                    DistanceFrom::Point(point) => ReadingFrom::Point(place(point).unwrap()),
                    DistanceFrom::Pose(joints) => ReadingFrom::Pose(joints),
                };
                (from, own.distance)
            }),
            sigma: None,
        },
    };
    let readings = Readings {
        name: "measured.csv".to_owned(),
        rows: (2..).zip(rows).map(row).collect(),
        planes: setup.planes.iter().map(|own| own.name.clone()).collect(),
        points: used
            .iter()
            .map(|own| setup.points[*own].name.clone())
            .collect(),
        copies: Vec::new(),
        joined: None,
        in_degrees: true,
        positions_in: PositionUnit::Millimetre,
    };
    let options = Options {
        frame: setup.frame,
        ..Options::default()
    };
    let report = calibrate(&setup.robot, &readings, &options);
    report.ok().map(|report| report.after.robot)
}

/// Mean squares of a robot's position error over its workspace: after the best rigid motion, and absolute.
fn errors(file: &RobotFile, built: &Robot<f64>, found: &Robot<f64>) -> [f64; 2] {
    let there = WorkspacePoses::within(built, &file.reach()).inside;
    let [arm, ..] = built.arms();
    let pairs: Vec<_> = there
        .iter()
        .filter_map(|pose| Some((found.forward(&pose.joints).ok()?, pose.position)))
        // Where both assemblies are equally low, one model may take the other one.
        .filter(|(found, built)| (found - built).norm() < 0.1 * arm.lb())
        .collect();
    assert!(1000 * pairs.len() > 999 * there.len() - 1000);
    let motion = RigidTransform::align(pairs.iter().copied()).unwrap();
    let count = f64::from(u32::try_from(pairs.len()).unwrap());
    let relative = pairs
        .iter()
        .map(|(found, built)| (motion.apply(found) - built).norm_squared());
    let absolute = pairs
        .iter()
        .map(|(found, built)| (found - built).norm_squared());
    [relative.sum::<f64>() / count, absolute.sum::<f64>() / count]
}

/// Robots that are drawn from the tolerance, measured as planned and calibrated: their position errors,
/// relative and absolute, are what the plan says. Every kind on another robot; x, y and z on all in the long run.
#[test]
fn what_a_plan_states_is_achieved() {
    let robots = robots();
    let kinds: [(&str, Frame); 8] = [
        ("xyz", Frame::Base),
        ("plane", Frame::Base),
        ("distance", Frame::Base),
        ("point", Frame::Base),
        ("xy", Frame::Sensor),
        ("plane,distance=8", Frame::Base),
        ("xyz", Frame::Sensor),
        ("xyz", Frame::Base),
    ];
    let trials = size(40_u32, 100);
    for (index, (kinds, frame)) in kinds.into_iter().enumerate() {
        let all = kinds == "xyz" && size(false, true);
        let chosen = if all {
            (0..robots.len()).collect()
        } else {
            vec![(index + robots.len() - 1) % robots.len()]
        };
        for (robot, count) in chosen.iter().flat_map(|own| {
            size(vec![24], vec![12, 20])
                .into_iter()
                .map(move |count| (*own, count))
        }) {
            let (name, file) = &robots[robot];
            let request = PlanRequest {
                frame,
                order: Order::Random,
                ..PlanRequest::new(file, kinds.parse().unwrap(), count)
            };
            let plan = plan(&request).unwrap();
            let case = format!("{count} {kinds} {frame:?}, {name}: {:?}", plan.after);
            let before = plan.before.unwrap();
            assert!(plan.after.relative < before.relative, "{case}");
            let (mut sums, mut refused) = ([0.0; 2], 0);
            for own in 0..trials {
                let mut rng = generator(700 + index as u64, u64::from(own));
                let tolerance = file.tolerance.unwrap();
                let built = match name.as_str() {
                    "towers" => {
                        delta_cal::simulate::made_robot(&file.robot, &tolerance, &mut rng).unwrap()
                    }
                    _ => perturbed(
                        &file.robot,
                        0.5,
                        0.2f64.to_radians(),
                        Spread::Normal,
                        &mut rng,
                    ),
                };
                let Some(found) = calibrated(&plan, &measured(&plan, &built, &mut rng)) else {
                    refused += 1;
                    continue;
                };
                let errors = errors(file, &built, &found);
                for (sum, error) in sums.iter_mut().zip(errors) {
                    *sum += error;
                }
            }
            assert!(10 * refused <= trials, "{case}: {refused} of {trials}");
            let [relative, absolute] = sums.map(|sum| (sum / f64::from(trials - refused)).sqrt());
            let ratios = [
                relative / plan.after.relative,
                absolute / plan.after.absolute,
            ];
            eprintln!(
                "{case}: achieved/stated relative {:.3} absolute {:.3}, {refused} refused",
                ratios[0], ratios[1]
            );
            // Three σ of an rms over 40 robots, each worth some six independent errors, and 3 % of the
            // statement, which is a mean over 64 robots.
            let allowed = size(0.2, 0.12);
            assert!((ratios[0] - 1.0).abs() < allowed, "{case}: {ratios:?}");
            // A place in space that the tolerance decides has six independent errors a robot.
            assert!(
                (ratios[1] - 1.0).abs() < 1.5 * allowed,
                "{case}: {ratios:?}"
            );
        }
    }
}

/// A planned pose is five σ of what the tolerance does inside every limit, and so are planned distances' other ends.
#[test]
fn robots_made_to_the_tolerance_reach_every_planned_pose() {
    for (index, (name, mut file)) in robots().into_iter().enumerate().step_by(3) {
        // Of every other robot the ball joints end early, too.
        if index % 2 == 1 {
            file.forearm_limit = Some(40f64.to_radians());
        }
        let request = PlanRequest::new(&file, "xyz,distance".parse().unwrap(), 12);
        let plan = plan(&request).unwrap();
        for robot in 0..200 {
            let built = perturbed(
                &file.robot,
                0.5,
                0.2f64.to_radians(),
                Spread::Normal,
                &mut generator(73, robot),
            );
            let reach = file.reach();
            for own in &plan.measurements {
                assert!(matches!(own.kind, Kind::Position(_) | Kind::Distance));
                let poses = std::iter::once(own.pose.joints).chain(own.other.map(|own| own.joints));
                for joints in poses {
                    assert!(
                        reach.clear_position(&built, &joints).is_ok(),
                        "{name} {robot}"
                    );
                }
            }
        }
    }
}
