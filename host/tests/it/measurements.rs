//! `delta-cal plan --measure` and `--compare`: plans for plates, bars, callipers and cameras, and whether
//! calibrations from them achieve what was predicted.

use crate::support::{Folder, TO_MEASURE};
use delta_cal::calibration::Solver;
use delta_cal::frame::RigidTransform;
use delta_cal::simulate::standard_normal;
use delta_cal::{Noise, Robot, Tolerance};
use delta_cal_host::files::samples_file::{Reading, ReadingFrom};
use delta_cal_host::fit::observations::calibrate;
use delta_cal_host::planning::measurements::{
    Kind, MeasurementPlan, MeasurementRequest, Planned, Wishes, plan_measurements,
};
use delta_cal_host::planning::poses::PlanError;
use delta_cal_host::{Frame, InputText, ObservationsFile, RobotFile, Row};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, perturbed, size};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;

/// The noise is that of the plan.
fn robot_toml() -> &'static str {
    let (robot, _) = TO_MEASURE.split_once("[noise]").unwrap();
    robot
}

fn file_of(robot: &Robot<f64>) -> RobotFile {
    let mut file = RobotFile::read(&InputText::new("robot.toml", robot_toml())).unwrap();
    file.robot = *robot;
    file
}

fn normal(rng: &mut Pcg32) -> f64 {
    standard_normal::<f64, _>(rng)
}

fn somewhere(size: f64, rng: &mut Pcg32) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * normal(rng))
}

/// What is read of a robot that was built with errors, by instruments that stand a little elsewhere and tilted.
fn measured(
    plan: &MeasurementPlan,
    built: &Robot<f64>,
    rng: &mut Pcg32,
) -> Option<ObservationsFile> {
    let setup = &plan.setup;
    let facts = &setup.robot.instruments;
    let joint_sigma = setup.robot.noise.unwrap().joint();
    let position_sigma = setup.robot.noise.unwrap().position();
    let (height_sigma, distance_sigma) =
        (facts.height_noise.unwrap(), facts.distance_noise.unwrap());
    let slopes = (0.005 * normal(rng), 0.005 * normal(rng));
    let level = setup.plane + 3.0 * normal(rng);
    let places: Vec<_> = setup
        .points
        .iter()
        .map(|(_, place)| place + somewhere(5.0, rng))
        .collect();
    let turn = Rotation3::from_scaled_axis(somewhere(0.5, rng));
    let shift = somewhere(300.0, rng);
    let mut joints_read = |joints: [f64; 3]| joints.map(|q| q + joint_sigma * normal(rng));
    let read: Vec<_> = plan
        .measurements
        .iter()
        .map(|own| {
            (
                joints_read(own.pose.joints),
                own.other.map(|o| joints_read(o.joints)),
            )
        })
        .collect();
    let mut rows = Vec::new();
    let mut used: Vec<usize> = Vec::new();
    for (line, (own, (joints, other))) in (2..).zip(plan.measurements.iter().zip(read)) {
        let at = built.forward(&own.pose.joints).ok()?;
        let mut reading = Reading {
            joints,
            position: [None; 3],
            height: None,
            distance: None,
        };
        match own.kind {
            Kind::Plane => {
                let up = Vector3::new(-slopes.0, -slopes.1, 1.0);
                let height = (up.dot(&at) - level) / up.norm();
                reading.height = Some((0, height + height_sigma * normal(rng)));
            }
            Kind::Distance => {
                let there = built.forward(&own.other?.joints).ok()?;
                let distance = (at - there).norm() + distance_sigma * normal(rng);
                reading.distance = Some((ReadingFrom::Pose(other?), distance));
            }
            Kind::Point => {
                let point = own.point?;
                let index = used.iter().position(|known| *known == point);
                let index = index.unwrap_or_else(|| {
                    used.push(point);
                    used.len() - 1
                });
                let distance = (at - places[point]).norm() + distance_sigma * normal(rng);
                reading.distance = Some((ReadingFrom::Point(index), distance));
            }
            Kind::Xy | Kind::Z | Kind::Xyz => {
                let x = match setup.frame {
                    Frame::Base => at,
                    Frame::Sensor => turn * at + shift,
                };
                for axis in 0..3 {
                    let wanted = match own.kind {
                        Kind::Xy => axis < 2,
                        Kind::Z => axis == 2,
                        _ => true,
                    };
                    reading.position[axis] = wanted.then(|| x[axis] + position_sigma * normal(rng));
                }
            }
        }
        rows.push(Row {
            line,
            value: reading,
        });
    }
    let planes = plan.measurements.iter().any(|own| own.kind == Kind::Plane);
    let names = used.iter().map(|index| setup.points[*index].0.clone());
    Some(ObservationsFile {
        name: "measured.csv".to_owned(),
        rows,
        planes: planes.then(|| "plane".to_owned()).into_iter().collect(),
        points: names.collect(),
    })
}

/// Mean square of a robot's position error over poses, after the best rigid motion.
fn relative_error(found: &Robot<f64>, built: &Robot<f64>, poses: &[[f64; 3]]) -> f64 {
    let pairs: Vec<_> = poses
        .iter()
        .filter_map(|joints| Some((found.forward(joints).ok()?, built.forward(joints).ok()?)))
        .collect();
    let motion = RigidTransform::align(pairs.iter().copied()).unwrap();
    let squares = pairs
        .iter()
        .map(|(found, built)| (motion.apply(found) - built).norm_squared());
    let count = u32::try_from(pairs.len()).unwrap();
    squares.sum::<f64>() / f64::from(count)
}

/// Joint angles all over the workspace, clear of singularities.
fn all_over(file: &RobotFile) -> Vec<[f64; 3]> {
    let reach = file.reach();
    let steps = || (0..12).map(|step| file.limits.at((f64::from(step) + 0.5) / 12.0));
    let mut poses = Vec::new();
    for a in steps() {
        for b in steps() {
            for c in steps() {
                if reach.clear_position(&file.robot, &[a, b, c]).is_ok() {
                    poses.push([a, b, c]);
                }
            }
        }
    }
    poses
}

/// Calibrations from planned measurements achieve what the plan predicts, and the plan betters random
/// measurements.
#[test]
fn what_a_plan_predicts_is_achieved() {
    let robots = geometries();
    let kinds: [(&str, Frame); 8] = [
        ("plane", Frame::Base),
        ("distance", Frame::Base),
        ("point", Frame::Base),
        ("xy", Frame::Sensor),
        ("plane,distance=8", Frame::Base),
        ("xyz", Frame::Sensor),
        ("xyz", Frame::Base),
        ("z", Frame::Base),
    ];
    let counts = size(vec![24], vec![12, 24, 40]);
    for (index, (kinds, frame)) in kinds.into_iter().enumerate() {
        // Each kind on another robot; all on all in the long run.
        let chosen = size(vec![index % robots.len()], (0..robots.len()).collect());
        for (robot, count) in chosen
            .iter()
            .flat_map(|robot| counts.iter().map(move |c| (*robot, *c)))
        {
            let (name, nominal) = &robots[robot];
            let file = file_of(nominal);
            let request = MeasurementRequest {
                frame,
                ..MeasurementRequest::new(&file, kinds.parse().unwrap(), count)
            };
            let plan = plan_measurements(&request).unwrap();
            let (before, random) = (plan.before.unwrap(), plan.random.unwrap());
            let case = format!(
                "{count} {kinds}, {name}: {:?} {before:?} {random:?}",
                plan.after
            );
            assert!(plan.after.intrinsic < random.intrinsic, "{case}");
            assert!(plan.after.intrinsic < before.intrinsic, "{case}");
            let limit = kinds
                .split_once('=')
                .map_or(count, |(_, most)| most.parse().unwrap());
            let distances = plan
                .measurements
                .iter()
                .filter(|own| own.kind == Kind::Distance);
            assert!(distances.count() <= limit, "{case}");

            let poses = all_over(&file);
            let (mut sum, mut number) = (0.0, 0.0);
            for own in 0..u64::from(size(40_u32, 200)) {
                let mut rng = generator(700 + index as u64, own);
                let built = perturbed(nominal, 0.5, 0.2f64.to_radians(), Spread::Normal, &mut rng);
                // A robot that does not reach a planned pose is one in many thousands.
                let samples = measured(&plan, &built, &mut rng).expect("reached");
                let known = RobotFile {
                    noise: plan.setup.robot.noise,
                    instruments: plan.setup.robot.instruments.clone(),
                    ..file.clone()
                };
                let fit = calibrate(&known, &samples, frame, Solver::LevenbergMarquardt)
                    .unwrap_or_else(|error| panic!("{case}: {error:?}"));
                sum += relative_error(&fit.outcome.fit.robot, &built, &poses);
                number += 1.0;
            }
            let ratio = (sum / number).sqrt() / plan.after.intrinsic;
            eprintln!("{case}: achieved/predicted {ratio:.3}");
            // Three σ of an rms over 40 robots, each worth some six independent errors, and 3 % of the
            // prediction, which is a mean over 64 robots.
            assert!((0.8..1.2).contains(&ratio), "{case}: {ratio}");
        }
    }
}

#[test]
fn a_plan_keeps_to_the_instruments() {
    let (_, robot) = &geometries()[0];
    let file = file_of(robot);
    let kinds: Wishes = "plane,point".parse().unwrap();
    let request = MeasurementRequest {
        plane: Some(-420.0),
        blocks: vec![0.0, 50.0],
        lengths: Some((250.0, 250.0)),
        ..MeasurementRequest::new(&file, kinds, 16)
    };
    let plan = plan_measurements(&request).unwrap();
    assert_eq!(plan.measurements.len(), 16);
    let setup = &plan.setup;
    for Planned {
        kind,
        pose,
        point,
        block,
        ..
    } in &plan.measurements
    {
        // Joint angles are rounded to 0.001°: 0.005 mm at the end of the upper arm, some times that at the
        // platform where the forearms are steep.
        if *kind == Kind::Plane {
            let height = pose.position.z + 420.0 - request.blocks[block.unwrap()];
            assert!(height.abs() < 0.05, "{height}");
        } else {
            let (_, place) = &setup.points[point.unwrap()];
            let length = (pose.position - place).norm();
            assert!((length - 250.0).abs() < 0.05, "{length}");
        }
    }
    let unreachable = MeasurementRequest {
        plane: Some(-2000.0),
        ..MeasurementRequest::new(&file, Wishes::only(Kind::Plane), 16)
    };
    assert!(matches!(
        plan_measurements(&unreachable),
        Err(PlanError::NoMeasurement(_))
    ));
    // Without a tolerance, 12 heights cannot determine 24 parameters and a plane.
    let unknown = RobotFile {
        tolerance: None::<Tolerance<f64>>,
        noise: None::<Noise<f64>>,
        ..file.clone()
    };
    let request = MeasurementRequest::new(&unknown, Wishes::only(Kind::Plane), 12);
    assert!(matches!(
        plan_measurements(&request),
        Err(PlanError::NotDetermined { .. })
    ));
}

#[test]
fn the_file_of_a_plan_has_the_columns_to_fill_in_and_they_are_empty() {
    let folder = Folder::new();
    folder.write("robot.toml", robot_toml());
    let run = folder
        .run(
            "plan robot.toml --measure plane,distance=4 --count 8 --output plan.csv --json plan.json",
        )
        .ok();
    assert!(
        run.stdout.contains("8 measurements for robot.toml"),
        "{}",
        run.stdout
    );
    let text = folder.read("plan.csv");
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "q1_deg,q2_deg,q3_deg,height_mm,plane,distance_mm,to_q1_deg,to_q2_deg,to_q3_deg,\
         _nominal_x_mm,_nominal_y_mm,_nominal_z_mm,_block_mm,_nominal_distance_mm"
    );
    for line in lines.by_ref() {
        let cells: Vec<_> = line.split(',').collect();
        assert_eq!((cells[3], cells[5]), ("", ""), "{line}");
        // A distance names its other pose, a height its plane and block.
        assert_ne!(cells[6].is_empty(), cells[12].is_empty(), "{line}");
        assert_eq!(cells[4] == "plane", !cells[12].is_empty(), "{line}");
    }
    let plan: serde_json::Value = serde_json::from_str(&folder.read("plan.json")).unwrap();
    assert_eq!(plan["measurements"].as_array().unwrap().len(), 8);
    let figure = |of: &str| plan[of]["intrinsic_rms_mm"].as_f64().unwrap();
    assert!(figure("planned") < figure("random") && figure("random") < figure("before"));

    // Nothing is measured: it may be planned again, and not calibrated.
    folder
        .run("plan robot.toml --measure plane,distance=4 --count 8 --output plan.csv")
        .ok();
    let run = folder.run("calibrate robot.toml plan.csv --output found.toml");
    assert_eq!(run.code, 3, "{}", run.stdout);
    assert!(run.stderr.contains("plan.csv:2:"), "{}", run.stderr);
    assert!(!folder.names().contains(&"found.toml".to_owned()));
}

#[test]
fn instruments_are_compared() {
    let folder = Folder::new();
    folder.write("robot.toml", robot_toml());
    let run = folder
        .run("plan robot.toml --compare --sigma camera=0.04 --json c.json --report c.html")
        .ok();
    for words in ["bar300", "laser tracker", "before"] {
        assert!(run.stdout.contains(words), "{words}: {}", run.stdout);
    }
    let compared: serde_json::Value = serde_json::from_str(&folder.read("c.json")).unwrap();
    let instruments = compared["instruments"].as_array().unwrap();
    let of = |name: &str, index: usize| {
        let own = instruments.iter().find(|own| own["name"] == name).unwrap();
        own["after"][index]["expected"]["intrinsic_rms_mm"]
            .as_f64()
            .unwrap()
    };
    for own in instruments {
        let name = own["name"].as_str().unwrap();
        let before = own["before"]["intrinsic_rms_mm"].as_f64().unwrap();
        assert!(of(name, 3) < of(name, 1) && of(name, 1) < before, "{name}");
    }
    // A bare plate says nothing of the scale; gauge blocks do.
    assert!(of("blocks", 3) < 0.7 * of("plate", 3));
    assert!(of("tracker", 3) < of("blocks", 3));
    let camera = instruments
        .iter()
        .find(|own| own["name"] == "camera")
        .unwrap();
    assert_eq!(camera["sigma_mm"], 0.04);
    let page = folder.read("c.html");
    assert!(page.contains("<svg") && page.contains("bar300"));
}

#[test]
fn wrong_options_are_refused_with_their_cause() {
    let folder = Folder::new();
    folder.write("robot.toml", robot_toml());
    for (options, cause) in [
        ("--measure plate --count 12", "no kind of measurement"),
        ("--measure plane,plane --count 12", "given twice"),
        ("--measure plane=0 --count 12", "whole number above 0"),
        ("--measure plane", "--count"),
        ("--measure plane --count 2", "fewer than 4"),
        (
            "--measure plane=3,distance=2 --count 8",
            "only 5 measurements",
        ),
        (
            "--measure plane --count 12 --frame sensor",
            "for coordinates",
        ),
        ("--measure plane --count 12 --blocks -5", "gauge blocks"),
        (
            "--measure point --count 12 --length 300..100",
            "a length in mm",
        ),
        ("--measure plane --count 12 --method ikm", "--method"),
        ("--compare --sigma laser=1", "bar300"),
        ("--count 12 --length 300", "--measure"),
    ] {
        let run = folder.run(&format!("plan robot.toml {options} --output plan.csv"));
        let run = if options.starts_with("--compare") {
            folder.run(&format!("plan robot.toml {options}"))
        } else {
            run
        };
        assert_eq!(run.code, 2, "{options}: {}", run.stderr);
        assert!(run.stderr.contains(cause), "{options}: {}", run.stderr);
        assert_eq!(folder.names(), ["robot.toml"], "{options}");
    }
}
