//! `delta-cal plan`. Whether calibrations achieve the stated accuracy is tested in `pipeline` and `simulate`.

use crate::support::simulated::twelve;
use crate::support::{
    Cells, Folder, NOMINAL, Point, TO_MEASURE, assert_refused, cells_of, distance, nominal_arms,
    number, platform, true_arms,
};
use delta_cal::simulate::made_robot;
use delta_cal_host::ReadingFrom;
use delta_cal_host::planning::{Kind, PlanRequest, plan};
use delta_cal_tests::generator;
use serde_json::Value;
use std::fmt::Write as _;

const KNOWN: &str = "[tolerance]\nlength_mm = 0.5\nangle_deg = 0.2\n[noise]\nposition_mm = 0.02\n\
                     joint_deg = 0.002\n";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{KNOWN}"));
    folder.write("bare.toml", NOMINAL);
    folder.write("touched.toml", TO_MEASURE);
    let measured = TO_MEASURE.replace("[noise]", "[noise]\nposition_mm = 0.02");
    folder.write("measured.toml", measured);
    folder
}

fn numbers(row: &Cells, names: [&str; 3]) -> Point {
    names.map(|name| row[name].parse().unwrap())
}

fn pose(row: &Cells) -> Point {
    numbers(row, ["q1_deg", "q2_deg", "q3_deg"])
}

fn nominal(row: &Cells) -> Point {
    numbers(row, ["_nominal_x_mm", "_nominal_y_mm", "_nominal_z_mm"])
}

/// Joint angles and nominal positions of a plan; the cells to fill in are empty.
fn planned(csv: &str) -> Vec<[Point; 2]> {
    let row = |row: Cells| {
        assert_eq!(["x_mm", "y_mm", "z_mm"].map(|name| &row[name]), [""; 3]);
        [pose(&row), nominal(&row)]
    };
    cells_of(csv).into_iter().map(row).collect()
}

fn json(folder: &Folder, arguments: &str) -> Value {
    let run = folder.run(&format!("plan {arguments} --json -"));
    run.json()
}

#[test]
fn the_poses_are_a_samples_file_of_the_nominal_robot() {
    let folder = folder();
    folder
        .run("plan robot.toml --count 12 --output poses.csv")
        .ends(0, "Written: poses.csv");
    let rows = planned(&folder.read("poses.csv"));
    // The last row repeats the first.
    assert_eq!(rows.len(), 13);
    assert_eq!(format!("{:?}", rows[0]), format!("{:?}", rows[12]));
    for [joints, at] in rows {
        // Positions are rounded to the nanometre, so each coordinate is off by half of that at most.
        let off = distance(platform(&nominal_arms(), joints), at);
        assert!(off < 1e-6, "{off}");
        assert!(joints.iter().all(|q| (-59.0..=89.0).contains(q)));
    }
    // Nothing is measured yet.
    let table = "poses.csv ⇒ 3 ⇒ poses.csv:2: nothing was measured";
    assert_refused(&folder, "calibrate robot.toml", table);
    // Measurements exactly at these positions leave the robot unchanged.
    let exact = folder.run("forward robot.toml poses.csv").ok().stdout;
    folder.write("exact.csv", exact);
    folder
        .run("calibrate robot.toml exact.csv --output calibrated.toml")
        .ok();
}

/// If poses follow the shortest way, a drift looks like a parameter; in random order it does not. The number of threads does
/// not matter.
#[test]
fn the_order_is_random_or_the_shortest() {
    let folder = folder();
    let travel = |rows: &[[Point; 2]]| -> f64 {
        let step = |pair: &[[Point; 2]]| {
            let moves = (0..3).map(|joint| (pair[1][0][joint] - pair[0][0][joint]).abs());
            moves.fold(0.0, f64::max)
        };
        rows.windows(2).map(step).sum()
    };
    let of = |order: &str| {
        let plan = format!("plan robot.toml --count 16 --order {order} --output -");
        let [one, five] = ["1", "5"].map(|threads| {
            let run = folder.run_where(&plan, "", &[("RAYON_NUM_THREADS", threads)]);
            run.ok().stdout
        });
        assert_eq!(one, five);
        planned(&one)
    };
    let (mut random, mut shortest) = (of("random"), of("shortest"));
    assert_eq!((random.len(), shortest.len()), (17, 16));
    assert!(travel(&shortest) < 0.7 * travel(&random));
    random.truncate(16);
    for rows in [&mut random, &mut shortest] {
        rows.sort_by(|a, b| a.partial_cmp(b).unwrap());
    }
    assert_eq!(random, shortest);
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
    for [_, [x, y, z]] in poses("x=-100..80,y=-5cm..10cm,z=-500mm..-400mm") {
        assert!((-100.0..=80.0).contains(&x) && (-50.0..=100.0).contains(&y));
        assert!((-500.0..=-400.0).contains(&z));
    }
    for [_, [x, y, z]] in poses("r=90,z=-450..-350") {
        assert!(x.hypot(y) <= 90.0 && (-450.0..=-350.0).contains(&z));
    }
    // A plate of unknown height is put in the region, with its gauge blocks.
    let plate = "robot.toml --count 12 --measure plane --within r=200,z=-600..-400";
    let plate = number(&json(&folder, plate), "planes/0/1");
    assert!((-600.0..=-520.0).contains(&plate), "{plate}");
    // The region's size does not matter: only the part within reach is searched.
    poses("r=1e5,z=-1e9..1e9");
}

/// Planned poses may be planned again; measurements are not overwritten.
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
        folder.run(plan).ends(2, "--force");
        assert_eq!(folder.read("poses.csv"), text);
        folder.run(&format!("{plan} --force")).ok();
        assert_eq!(folder.read("poses.csv"), planned);
    }
}

#[test]
fn an_accuracy_is_reached_by_as_many_as_stated_and_not_by_fewer() {
    let folder = folder();
    let rms = |json: &Value| number(json, "planned/relative_rms_mm");
    // The best heights are at more places than twenty can be.
    for (kinds, accuracy) in [("xyz", 0.014), ("plane", 0.055)] {
        let plan = format!("robot.toml --measure {kinds}");
        let found = json(&folder, &format!("{plan} --limit {accuracy}mm"));
        assert!(rms(&found) <= accuracy);
        let count = found["count"].as_u64().unwrap();
        let fewer = json(&folder, &format!("{plan} --count {}", count - 1));
        assert!(rms(&fewer) > accuracy, "{count}: {fewer}");
    }
}

/// Planes, gauge blocks, points and lengths come from the robot file; the plan can be read back, whatever its planes are called.
#[test]
fn instruments_come_from_the_robot_file() {
    let folder = folder();
    let instruments = "[planes.\"left, \\\"near\\\"\"]\nz_mm = -520\nsigma_mm = 5\nblocks_mm = [0, 50]\n\
                       [points.A]\nlength_mm = [250, 250]\n[points.B]\n[distances]\nlength_mm = [80, 150]\n";
    folder.write("robot.toml", format!("{TO_MEASURE}{instruments}"));
    let measures = "plane=8,point=10,distance=6";
    let plan = format!("plan robot.toml --measure {measures} --count 24");
    folder
        .run(&format!("{plan} --output plan.csv --json plan.json"))
        .ends(0, "Put left, \"near\" at z = -520 mm");
    let csv = folder.read("plan.csv");
    let header =
        "q1_deg,q2_deg,q3_deg,height_mm,plane,distance_mm,point,to_q1_deg,to_q2_deg,to_q3_deg,";
    assert_eq!(csv.get(..header.len()), Some(header));
    let json = folder.json("plan.json");
    let point = |value: &Value| [0, 1, 2].map(|axis| value[axis].as_f64().unwrap());
    let all = json["measurements"].as_array().unwrap();
    for own in all {
        let at = point(&own["position_mm"]);
        let (length, shortest, longest) = match own["measure"].as_str().unwrap() {
            "plane" => {
                let block = own["block_mm"].as_f64().unwrap();
                assert!([0.0, 50.0].contains(&block) && own["plane"] == "left, \"near\"");
                (at[2] + 520.0, block, block)
            }
            "point" => {
                let mut points = json["points"].as_array().unwrap().iter();
                let place = points.find(|place| place[0] == own["point"]).unwrap();
                let [shortest, longest] = if own["point"] == "A" {
                    [250.0; 2]
                } else {
                    [50.0, f64::INFINITY]
                };
                (distance(at, point(&place[1])), shortest, longest)
            }
            _ => {
                let from = platform(&nominal_arms(), point(&own["to_joints"]));
                (distance(at, from), 80.0, 150.0)
            }
        };
        // Joint angles are rounded to 0.001°: 0.005 mm at the end of the upper arm, and several times that at the
        // platform where the forearms are steep.
        assert!(length > shortest - 0.05 && length < longest + 0.05, "{own}");
    }
    // Six, one of them repeated.
    let distances = all.iter().filter(|own| own["measure"] == "distance");
    assert_eq!(distances.count(), 7);
    assert_eq!(json["count"], 24);
    // One repeated measurement per instrument: the plane, each point, and distances.
    assert!((26..=28).contains(&all.len()), "{}", all.len());
    let again = folder.run("plan robot.toml --samples plan.csv --json -");
    let unmeasured = &again.json()["unmeasured_lines"];
    assert_eq!(unmeasured.as_array().unwrap().len(), all.len());
}

/// z points downwards: the plane, the region and the positions are below the base at a positive z.
#[test]
fn a_plan_is_in_the_axes_of_its_robot_file() {
    let folder = Folder::new();
    // Seen along the reversed z, the arms are numbered the other way round.
    let turned = TO_MEASURE.replace("forearm_mm", "azimuth_deg = [0, -120, -240]\nforearm_mm");
    let table = "[planes.table]\nz_mm = 520\nsigma_mm = 5\nblocks_mm = [0]\n";
    let convention = "[convention]\nz_axis = \"down\"\n";
    folder.write("robot.toml", format!("{turned}{table}{convention}"));
    let plan = "robot.toml --measure plane --count 12 --within";
    let json = json(&folder, &format!("{plan} r=200,z=400..600"));
    assert_eq!(json["planes"], serde_json::json!([["table", 520.0]]));
    for own in json["measurements"].as_array().unwrap() {
        assert!((number(own, "position_mm/2") - 520.0).abs() < 0.05, "{own}");
    }
    let worst = number(&json, "expected_error/absolute_worst_at_mm/2");
    assert!((400.0..=600.0).contains(&worst), "{worst}");
    let table = "r=200,z=-600..-400 ⇒ 2 ⇒ within r=200,z=-600..-400 | z 1";
    assert_refused(&folder, &format!("plan {plan}"), table);
}

/// In an unknown frame only the tolerance locates the robot: no measurement there halves the absolute error that it
/// allows, 1.7 mm, while relative positions are known to hundredths.
#[test]
fn an_unknown_frame_leaves_absolute_positions_to_the_tolerance() {
    let folder = folder();
    let sensor = json(&folder, "robot.toml --count 20 --frame sensor");
    let base = json(&folder, "robot.toml --count 20");
    let of = |json: &Value, key: &str| number(json, &format!("planned/{key}"));
    assert!(of(&sensor, "absolute_rms_mm") > 0.5 * number(&sensor, "before/absolute_rms_mm"));
    assert!(of(&sensor, "relative_rms_mm") < 2.0 * of(&base, "relative_rms_mm"));
    assert!(of(&sensor, "relative_rms_mm") > of(&base, "relative_rms_mm"));
    let absolute = json(&folder, "robot.toml --count 20 --absolute");
    assert!(of(&absolute, "absolute_rms_mm") < of(&base, "absolute_rms_mm"));
}

/// A plan filled in with readings from a plate at z = -600 mm and a bar, for a robot with errors.
fn filled(plan: &str) -> String {
    let header = plan.lines().next().unwrap();
    let fill = |row: &Cells| {
        let there = |joint: &str| {
            let joints = [1, 2, 3].map(|number| format!("{joint}{number}_deg"));
            platform(&true_arms(), joints.map(|name| row[&name].parse().unwrap()))
        };
        let at = there("q");
        let cells = header.split(',').map(|name| match name {
            "x_mm" => format!("{:.4}", at[0]),
            "y_mm" => format!("{:.4}", at[1]),
            "z_mm" => format!("{:.4}", at[2]),
            "height_mm" => format!("{:.4}", at[2] + 600.0),
            "distance_mm" => format!("{:.4}", distance(at, there("to_q"))),
            _ => row[name].clone(),
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    format!(
        "{header}\n{}",
        cells_of(plan).iter().map(fill).collect::<String>()
    )
}

/// The same rows in a plan, a file and a calibration give the same expected error, wherever the instruments are, and
/// added rows improve it.
#[test]
fn a_file_of_rows_is_judged_as_the_plan_that_it_was_and_as_its_calibration() {
    let folder = folder();
    let rms = |json: &Value, of: &str| number(json, &format!("{of}/relative_rms_mm"));
    for kinds in ["xyz", "plane", "distance", "plane,xy=6"] {
        let plan =
            format!("plan measured.toml --measure {kinds} --count 24 --output rows.csv --force");
        folder.run(&format!("{plan} --json plan.json")).ok();
        let planned = folder.json("plan.json");
        let samples = "measured.toml --samples rows.csv --count 6 --output more.csv";
        let found = json(&folder, samples);
        let given = folder.read("rows.csv");
        let unmeasured = found["unmeasured_lines"].as_array().unwrap();
        assert_eq!(unmeasured.len(), given.lines().count() - 1);
        let expected = rms(&planned, "expected_error");
        let ratio = rms(&found, "expected_error") / expected;
        assert!((ratio - 1.0).abs() < 1e-3, "{kinds}: {found}");
        let with_next = rms(&found, "expected_error_with_next");
        assert!(with_next < expected, "{kinds}");
        // The proposed rows are a file to fill in and deliver the predicted accuracy.
        let more = folder.read("more.csv");
        let (header, added) = more.split_once('\n').unwrap();
        assert_eq!(added.lines().count(), 6);
        if given.starts_with(header) {
            folder.write("all.csv", format!("{given}{added}"));
            let all = json(&folder, "measured.toml --samples all.csv --count 0");
            let ratio = rms(&all, "expected_error") / with_next;
            assert!((ratio - 1.0).abs() < 1e-3, "{kinds}: {all}");
        }
        if kinds != "plane,xy=6" {
            folder.write("filled.csv", filled(&given));
            let found = json(&folder, "measured.toml --samples filled.csv");
            assert_eq!(found["unmeasured_lines"], serde_json::json!([]));
            let run = folder
                .run("calibrate measured.toml filled.csv --json -")
                .ok();
            for own in [found, run.json()] {
                // Derivatives are taken at different places of the plate.
                let ratio = rms(&own, "expected_error") / expected;
                assert!((ratio - 1.0).abs() < 0.1, "{kinds}: {ratio}: {own}");
            }
        }
    }
}

/// Planned poses keep five σ of the tolerance's effect from every limit, and so do the other ends of planned distances.
#[test]
fn robots_made_to_the_tolerance_reach_every_planned_pose() {
    for (index, mut file) in twelve(true).into_iter().enumerate().step_by(3) {
        // Every other robot also has tight ball joints.
        if index % 2 == 1 {
            file.forearm_limit = Some(40f64.to_radians());
        }
        let request = PlanRequest::new(&file, "xyz,distance".parse().unwrap(), 12);
        let plan = plan(&request).unwrap();
        for robot in 0..200 {
            let tolerance = file.tolerance.as_ref().unwrap();
            let built = made_robot(&file.robot, tolerance, &mut generator(73, robot)).unwrap();
            let reach = file.reach();
            for own in &plan.measurements {
                assert!(matches!(own.kind, Kind::Position(_) | Kind::Distance));
                let other = match own.reading.distance {
                    Some((ReadingFrom::Pose(other), _)) => Some(other),
                    _ => None,
                };
                for joints in std::iter::once(own.reading.joints).chain(other) {
                    assert!(
                        reach.clear_position(&built, &joints).is_ok(),
                        "{index} {robot}"
                    );
                }
            }
        }
    }
}

/// The tip touches the plate and its blocks, not the platform point, and at other poses it is above the plate.
#[test]
fn no_plan_drives_a_tip_into_its_plate() {
    let folder = folder();
    let tip = "[target]\nx_mm = 5\ny_mm = 0\nz_mm = -50\n";
    let table = "[planes.table]\nz_mm = -560\nsigma_mm = 5\nblocks_mm = [0, 60]\n";
    folder.write("known.toml", format!("{TO_MEASURE}{tip}{table}"));
    folder.write("unknown.toml", format!("{TO_MEASURE}{tip}"));
    for (robot, kinds) in [("known", "plane,distance=6"), ("unknown", "plane")] {
        let plan =
            format!("plan {robot}.toml --measure {kinds} --count 14 --json plan.json --output -");
        folder.write("plan.json", "");
        let csv = folder.run(&plan).ok().stdout;
        let plate = number(&folder.json("plan.json"), "planes/0/1");
        assert!(
            robot == "unknown" || (plate + 560.0).abs() < 1e-9,
            "{plate}"
        );
        let rows = cells_of(&csv);
        for row in &rows {
            let [x, y, z] = platform(&nominal_arms(), pose(row));
            let tip = [x + 5.0, y, z - 50.0];
            assert!(distance(tip, nominal(row)) < 1e-5, "{tip:?} {row:?}");
            if row["_block_mm"].is_empty() {
                let other = numbers(row, ["to_q1_deg", "to_q2_deg", "to_q3_deg"]);
                let [.., other] = platform(&nominal_arms(), other);
                assert!(tip[2].min(other - 50.0) > plate + 14.9, "{row:?}");
            } else {
                let block: f64 = row["_block_mm"].parse().unwrap();
                assert!((tip[2] - plate - block).abs() < 0.02, "{row:?}");
            }
        }
    }
}

/// Datum points say where the sensor stands: what is read is in its frame, and the absolute error is known.
#[test]
fn datum_points_locate_the_sensor_of_a_plan() {
    let folder = folder();
    let mut datum = String::from("[target]\nx_mm = 10\ny_mm = 0\nz_mm = -20\n");
    for (name, [x, y, z]) in [
        ("A", [400, 0, -700]),
        ("B", [-300, 300, -700]),
        ("C", [-300, -300, -500]),
    ] {
        let _ = write!(
            datum,
            "[datum.{name}]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nsensor_mm = [{}, {}, {}]\n",
            700 - y,
            x + 10,
            z - 5
        );
    }
    folder.write("datum.toml", format!("{NOMINAL}{KNOWN}{datum}"));
    let absolute = |robot: &str| {
        let plan = json(&folder, &format!("{robot}.toml --count 16 --frame sensor"));
        number(&plan, "planned/absolute_rms_mm")
    };
    let [unknown, known] = [absolute("robot"), absolute("datum")];
    assert!(unknown > 0.5 && known < 0.1, "{unknown} {known}");
    let csv = folder
        .run("plan datum.toml --count 8 --frame sensor --output -")
        .ok()
        .stdout;
    for row in &cells_of(&csv) {
        let [x, y, z] = platform(&nominal_arms(), pose(row));
        let seen = [700.0 - y, x + 20.0, z - 25.0];
        assert!(distance(seen, nominal(row)) < 1e-5, "{seen:?} {row:?}");
    }
    let table = "⇒ 3 ⇒ [datum] | --frame sensor";
    assert_refused(&folder, "plan datum.toml --count 8", table);
}
