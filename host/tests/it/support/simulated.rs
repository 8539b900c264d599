//! Robots as they were made, and what instruments read of them; how far a robot that was found is from the one that was made.

use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;
use delta_cal::simulate::{made_robot, random_pose, standard_normal};
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Tolerance};
use delta_cal_host::files::robot_file::Target;
use delta_cal_host::geometry::{Reach, Region};
use delta_cal_host::{InstrumentFacts, Reading, ReadingFrom, Readings, Report, RobotFile, Row};
use delta_cal_tests::geometries::{geometries, linear_geometries};
use nalgebra::{Rotation3, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// One σ of a coordinate, mm, of a joint, degrees or mm, of a height and of a distance, mm.
pub(crate) const SIGMAS: [f64; 4] = [0.02, 0.002, 0.02, 0.05];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Instrument {
    Positions,
    /// The same with an uncertainty in each row, of every other one five times as large.
    Uncertain,
    /// In a frame that stands anywhere.
    Tracker,
    /// A plate with gauge blocks of 0, 60 and 120 mm.
    Plate,
    /// Touches and distances between poses.
    PlateAndCalliper,
    /// x and y of half of the rows, x, y and z of the others.
    Camera,
    /// Distances from three points below that stand still, a forearm and a half away.
    Wires,
}

/// One σ of a joint, radians or mm.
fn joint_sigma(drive: Drive) -> f64 {
    match drive {
        Drive::Rotary => SIGMAS[1].to_radians(),
        Drive::Linear => SIGMAS[1],
    }
}

/// A robot with a tolerance of 0.5 mm and 0.2°; limits in radians or mm.
pub(crate) fn file_of(robot: &Robot<f64>, [low, high]: [f64; 2], noise: bool) -> RobotFile {
    let [position, _, height, distance] = SIGMAS;
    let tolerance = Tolerance::new(0.5, 0.2_f64.to_radians()).unwrap();
    let (tolerance, limits) = match robot.drive() {
        Drive::Rotary => (tolerance, JointLimits::new(low, high)),
        Drive::Linear => (
            (tolerance.with(Parameter::Zero, 1.0))
                .and_then(|own| own.with(Parameter::Scale, 0.001))
                .unwrap(),
            JointLimits::travel(low, high),
        ),
    };
    let instruments = InstrumentFacts {
        height_noise: noise.then_some(height),
        distance_noise: noise.then_some(distance),
        ..InstrumentFacts::default()
    };
    let stated = Noise::new(position, joint_sigma(robot.drive())).unwrap();
    RobotFile {
        tolerance: Some(tolerance),
        noise: noise.then_some(stated),
        instruments,
        ..RobotFile::of("robot.toml", robot.clone(), limits.unwrap())
    }
}

/// The paper's, large, tall, platform larger than base, short, tiny, asymmetric arms, tilted axes.
pub(crate) fn rotary(noise: bool) -> Vec<RobotFile> {
    let limits = [-60.0, 75.0].map(f64::to_radians);
    let files = geometries()
        .into_iter()
        .map(|(_, robot)| file_of(&robot, limits, noise));
    files.collect()
}

/// And four with towers.
pub(crate) fn twelve(noise: bool) -> Vec<RobotFile> {
    let towers = linear_geometries()
        .into_iter()
        .map(|(_, robot, travels)| file_of(&robot, travels, noise));
    rotary(noise).into_iter().chain(towers).collect()
}

/// A robot made to the tolerance, and what an instrument reads of it.
pub(crate) fn measured(
    file: &RobotFile,
    instrument: Instrument,
    rows: usize,
    seed: u64,
) -> (Robot<f64>, Readings) {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = made_robot(&file.robot, file.tolerance.as_ref().unwrap(), &mut rng).unwrap();
    let readings = readings(file, &truth, instrument, rows, &mut rng);
    (truth, readings)
}

/// What an instrument reads of a robot at random poses.
pub(crate) fn readings(
    file: &RobotFile,
    truth: &Robot<f64>,
    instrument: Instrument,
    rows: usize,
    rng: &mut Pcg32,
) -> Readings {
    let frame = somewhere(1.0, 500.0, rng);
    let [position, _, height, distance] = SIGMAS;
    let joint = joint_sigma(truth.drive());
    let mut readings = Readings::of_name("samples.csv");
    if matches!(instrument, Instrument::Plate | Instrument::PlateAndCalliper) {
        readings.planes = vec!["p0".to_owned()];
    }
    if instrument == Instrument::Wires {
        readings.points = ["A", "B", "C"].map(str::to_owned).to_vec();
    }
    let mut before = [0.0; 3];
    for index in 0..rows {
        let joints = match file.within {
            None => random_pose(truth, &file.limits, rng).unwrap().joints,
            Some(_) => worked(file, truth, rng),
        };
        let x = truth.forward(&joints).unwrap();
        let uncertain = instrument == Instrument::Uncertain;
        let position = position
            * if uncertain && index % 2 == 1 {
                5.0
            } else {
                1.0
            };
        let mut normal = |sigma: f64| sigma * standard_normal::<f64, _>(rng);
        let reported = joints.map(|q| q + normal(joint));
        let mut own = Reading::at(reported);
        own.sigma = uncertain.then_some(position);
        match instrument {
            Instrument::Positions
            | Instrument::Uncertain
            | Instrument::Tracker
            | Instrument::Camera => {
                let seen = match instrument {
                    Instrument::Tracker => frame.apply(&x),
                    _ => x,
                };
                own.position = seen.data.0[0].map(|value| Some(value + normal(position)));
                if instrument == Instrument::Camera && index % 2 == 0 {
                    own.position[2] = None;
                }
            }
            Instrument::Plate | Instrument::PlateAndCalliper => {
                // The plate lies somewhere below, nearly level; what is touched of it is its height above the block.
                let plate = -900.0 + 0.01 * x.x - 0.02 * x.y;
                let apart = (x.z - plate) / (1.0 + 0.01_f64.powi(2) + 0.02_f64.powi(2)).sqrt();
                own.height = Some((0, apart + normal(height)));
                if instrument == Instrument::PlateAndCalliper && index % 3 == 2 {
                    let other = truth.forward(&before).unwrap();
                    let read = (x - other).norm() + normal(distance);
                    own.distance = Some((ReadingFrom::Pose(before), read));
                }
            }
            Instrument::Wires => {
                let point = anchor(truth, index % 3);
                let read = (x - point).norm() + normal(distance);
                own.distance = Some((ReadingFrom::Point(index % 3), read));
            }
        }
        before = joints;
        push(&mut readings, &own);
    }
    readings
}

/// Another row at the end.
pub(crate) fn push(readings: &mut Readings, value: &Reading) {
    let line = readings.rows.len() as u64 + 2;
    let value = *value;
    readings.rows.push(Row { line, value });
}

/// Adds reflectors at these places, with this σ, mm.
pub(crate) fn mount(
    file: &mut RobotFile,
    readings: &mut Readings,
    places: &[Vector3<f64>],
    sigma: f64,
) {
    for (index, place) in places.iter().enumerate() {
        let name = match places {
            [_] => "target".to_owned(),
            _ => format!("T{index}"),
        };
        readings.targets.push(name.clone());
        file.instruments.targets.push(Target {
            name,
            place: *place,
            sigma: Vector3::repeat(sigma),
        });
    }
}

/// A pose where the robot works that was made, and the one of its file.
pub(crate) fn worked(file: &RobotFile, truth: &Robot<f64>, rng: &mut Pcg32) -> [f64; 3] {
    loop {
        let pose = random_pose(truth, &file.limits, rng).unwrap();
        let clear = [&file.robot, truth].map(|own| file.reach().clear_position(own, &pose.joints));
        let within = |own: Region| own.contains(&pose.position);
        if clear.iter().all(Result::is_ok) && file.within.is_none_or(within) {
            return pose.joints;
        }
    }
}

/// Where a robot of this file works: a cylinder around the z axis, half a forearm wide, below the motors.
pub(crate) fn working(file: &RobotFile) -> Region {
    let mut down = [0.35, 0.7, 1.0, 0.0, -0.4].into_iter();
    let middle = down.find_map(|q| file.robot.forward(&[q; 3]).ok());
    let middle = middle.unwrap().z;
    let [radius, low, high] = [0.45, -0.2, 0.2].map(|own| own * file.robot.arms()[0].lb());
    let region = format!("r={radius},z={}..{}", middle + low, middle + high);
    region.parse().unwrap()
}

/// Where a wire begins.
pub(crate) fn anchor(truth: &Robot<f64>, point: usize) -> Vector3<f64> {
    let away = 1.5 * truth.arm(ArmIndex::First).lb();
    let azimuth = [0.3_f64, 2.5, 4.4][point];
    Vector3::new(azimuth.cos(), azimuth.sin(), -0.5) * away
}

/// Into a frame that is turned about any axis by so many radians, and so far away, mm; one σ each.
pub(crate) fn somewhere(turned: f64, away: f64, rng: &mut Pcg32) -> RigidTransform<f64> {
    let mut vector = |size: f64| Vector3::from_fn(|_, _| size * standard_normal::<f64, _>(rng));
    RigidTransform {
        rotation: *Rotation3::from_scaled_axis(vector(turned)).matrix(),
        translation: vector(away),
    }
}

/// 200 random poses of a robot.
pub(crate) fn judged(reach: &Reach, robot: &Robot<f64>, seed: u64) -> Vec<[f64; 3]> {
    let mut rng = Pcg32::seed_from_u64(seed ^ 0xacc0_0acc);
    let pose = |_| random_pose(robot, &reach.limits, &mut rng).unwrap().joints;
    (0..200).map(pose).collect()
}

/// Mean squares of the position errors over these poses: in the frame of the base, and after the best rigid motion.
pub(crate) fn position_errors(
    reach: &Reach,
    poses: &[[f64; 3]],
    found: &Robot<f64>,
    truth: &Robot<f64>,
) -> [f64; 2] {
    let all = position_lengths(reach, poses, found, truth);
    let count = all.len() as f64;
    [0, 1].map(|kind| all.iter().map(|own| own[kind].powi(2)).sum::<f64>() / count)
}

/// Of calibrations that were accepted: what came of them over what is stated.
#[derive(Default)]
pub(crate) struct Promise {
    /// Of each: mean squares of the errors and of what is stated, absolute and relative, mm².
    squares: Vec<[[f64; 2]; 2]>,
    /// Of each: the share of the positions within the expanded uncertainty.
    covered: Vec<f64>,
    /// Robots that are further off than before.
    pub(crate) worse: usize,
}

impl Promise {
    pub(crate) fn add(&mut self, file: &RobotFile, truth: &Robot<f64>, report: &Report, seed: u64) {
        let (reach, found) = (file.reach(), &report.after.robot);
        let poses = judged(&reach, truth, seed);
        let stated = report.expected_error.unwrap();
        let stated = [stated.absolute_rms_mm, stated.relative_rms_mm];
        let errors = position_errors(&reach, &poses, found, truth);
        self.squares
            .push([0, 1].map(|kind| [errors[kind], stated[kind].powi(2)]));
        let [before, _] = position_errors(&reach, &poses, &file.robot, truth);
        self.worse += usize::from(report.solution.is_absolute() && errors[0] > before);
        if let Some(expanded) = &report.expanded_uncertainty {
            let kind = usize::from(expanded.of == "relative");
            let lengths = position_lengths(&reach, &poses, found, truth);
            let within = |own: &&[f64; 2]| own[kind] <= expanded.workspace_mm;
            let within = lengths.iter().filter(within).count();
            self.covered.push(within as f64 / lengths.len() as f64);
        }
    }

    pub(crate) fn accepted(&self) -> usize {
        self.squares.len()
    }

    /// Achieved over stated errors, absolute and relative: every robot counts alike.
    pub(crate) fn ratios(&self) -> [f64; 2] {
        let ratio = |kind: usize| {
            self.squares
                .iter()
                .map(move |own| own[kind][0] / own[kind][1])
        };
        [0, 1].map(|kind| (ratio(kind).sum::<f64>() / self.accepted() as f64).sqrt())
    }

    /// The same where the errors of all are one.
    pub(crate) fn pooled(&self) -> [f64; 2] {
        let sum = |kind: usize, part: usize| -> f64 {
            self.squares.iter().map(|own| own[kind][part]).sum()
        };
        [0, 1].map(|kind| (sum(kind, 0) / sum(kind, 1)).sqrt())
    }

    /// The share of all positions that are within the expanded uncertainty.
    pub(crate) fn covered(&self) -> f64 {
        self.covered.iter().sum::<f64>() / self.covered.len() as f64
    }
}

/// The length of each of these errors.
pub(crate) fn position_lengths(
    reach: &Reach,
    poses: &[[f64; 3]],
    found: &Robot<f64>,
    truth: &Robot<f64>,
) -> Vec<[f64; 2]> {
    let [arm, ..] = truth.arms();
    let pairs: Vec<_> = poses
        .iter()
        .filter_map(|q| Some((reach.clear_position(found, q).ok()?, truth.forward(q).ok()?)))
        // Where both assemblies are equally low, one model may take the other one.
        .filter(|(found, truth)| (found - truth).norm() < 0.1 * arm.lb())
        .collect();
    assert!(10 * pairs.len() > 9 * poses.len(), "{} poses", pairs.len());
    let motion = RigidTransform::align(pairs.iter().copied()).unwrap();
    let lengths = pairs
        .iter()
        .map(|(found, truth)| [(found - truth).norm(), (motion.apply(found) - truth).norm()]);
    lengths.collect()
}
