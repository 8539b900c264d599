//! Whether what a validation states with 95 % confidence is so: robots of eight proportions, made with errors, and
//! files of measurements with noise.

use delta_cal::frame::RigidTransform;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Robot, Sample};
use delta_cal_host::validation::{Request, Validation, Verdict, validate};
use delta_cal_host::{Frame, Readings, RobotFile};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{
    Spread, generator, measurements, noise, paper_limits, perturbed, size, uniform,
};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;

/// Robots are made with these parts of the tolerance: errors far below the noise, like it, and far above.
const FACTORS: [f64; 3] = [0.02, 0.1, 1.0];
const ROWS: [usize; 4] = [10, 20, 40, 100];

#[derive(Debug, Default, Clone, Copy)]
struct Counts {
    files: u32,
    /// The true rms error is within the interval.
    within: u32,
    /// The true largest error is within its interval.
    largest: u32,
    /// Of robots whose error is the limit: passed although it is not below, failed although it is not above.
    passed: u32,
    failed: u32,
}

impl Counts {
    fn add(&mut self, robot: &Made, frame: Frame, limit: f64, found: &Validation) {
        let upper = found.rms_error.error.interval.1.unwrap();
        self.files += 1;
        self.within += u32::from((found.rms_error.error.interval.0..=upper).contains(&limit));
        self.passed += u32::from(found.verdict == Verdict::Pass);
        self.failed += u32::from(found.verdict == Verdict::Fail);
        // Without an upper limit where the noise was taken to be stated too large.
        let worst = largest(robot, frame);
        let holds = found.largest_error.interval.0 <= worst
            && found
                .largest_error
                .interval
                .1
                .is_none_or(|upper| worst <= upper);
        self.largest += u32::from(holds);
    }

    fn percent(&self, of: u32) -> f64 {
        100.0 * f64::from(of) / f64::from(self.files)
    }
}

/// Files of `rows` poses of robots of all proportions in turn.
fn campaign(
    counts: &mut Counts,
    (frame, edges): (Frame, bool),
    rows: usize,
    factor: f64,
    files: u64,
) {
    let geometries = geometries();
    for number in 0..files {
        let index = usize::try_from(number).unwrap() % geometries.len();
        let (_, nominal): &(_, Robot<f64>) = &geometries[index];
        let mut rng = generator(173, number);
        let robot = made(nominal, factor, rows, edges, &mut rng);
        let truth = match frame {
            Frame::Base if edges => {
                let mut all = anywhere(&robot, 4000, &mut rng);
                // Where both assemblies are equally low, one model may take the other one.
                all.retain(|(is, said)| (is - said).norm() < 0.1 * nominal.arms()[0].lb());
                rms(&all)
            }
            Frame::Base => rms(&held_out(&robot)),
            Frame::Sensor => rms(&moved(held_out(&robot))),
        };
        let request = Request {
            limit: truth,
            frame,
            stored: false,
        };
        let found = validate(&robot_file(nominal), &samples_file(&robot, frame), request);
        counts.add(&robot, frame, truth, &found.unwrap());
    }
}

/// Near a singularity the joints' noise moves the platform far: such a row is no more wrong than others. A robot as its
/// file says, measured anywhere: one file in a hundred may doubt a row, and four standard deviations of so few. And
/// whichever row deviates most, the largest error is not below the rms.
#[test]
fn a_row_that_is_noise_is_not_called_wrong_nor_the_largest_error() {
    // A platform larger than the base: many poses are near a singularity.
    let nominal = &geometries()[3].1;
    let files = 400_u32;
    let mut doubted = 0;
    for number in 0..files {
        let mut rng = generator(175, u64::from(number));
        let mut samples = Vec::new();
        while samples.len() < 25 {
            // However near to a singularity.
            let joints = [(); 3].map(|()| (15.0 + 75.0 * uniform(&mut rng)).to_radians());
            samples.extend(simulate_sample(nominal, &joints, Some(&noise()), &mut rng).ok());
        }
        let robot = Made {
            truth: nominal.clone(),
            nominal: nominal.clone(),
            samples,
        };
        let request = Request {
            limit: 1.0,
            frame: Frame::Base,
            stored: false,
        };
        let file = samples_file(&robot, Frame::Base);
        let found = validate(&robot_file(nominal), &file, request).unwrap();
        let doubts = |warning: &String| warning.contains("may be a wrong row");
        doubted += u32::from(found.warnings.iter().any(doubts));
        // Rounding of a sum.
        let rms = found.rms_error.error.value * (1.0 - 1e-9);
        assert!(
            found.largest_error.value >= rms,
            "{number}: {:?} {rms}",
            found.largest_error
        );
        assert!(
            found.largest_error.value >= found.largest_error.interval.0,
            "{number}: {:?}",
            found.largest_error
        );
    }
    let expected = f64::from(files) * 0.01;
    assert!(
        f64::from(doubted) <= expected + 4.0 * expected.sqrt(),
        "{doubted}"
    );
}

/// The interval of the rms error holds the true one in 93 to 97 % of the files, whatever is measured; a robot
/// exactly at the limit passes in 2.5 %, well below 5 %. Four standard deviations of the number of files are allowed
/// for.
#[test]
fn intervals_hold_the_true_error_as_often_as_they_say() {
    for (frame, name) in [
        ((Frame::Base, false), "base"),
        ((Frame::Sensor, false), "sensor"),
        ((Frame::Base, true), "base, steep edges included"),
    ] {
        // Few and many in the short campaign.
        for rows in size(&[10, 40][..], &ROWS).iter().copied() {
            let mut all = Counts::default();
            for factor in FACTORS {
                campaign(&mut all, frame, rows, factor, size(64, 96));
            }
            println!("{name}, {rows} rows: {all:?}");
            let sigma = 100.0 * (0.05 * 0.95 / f64::from(all.files)).sqrt();
            let within = all.percent(all.within);
            assert!(
                (93.0 - 4.0 * sigma..97.0 + 4.0 * sigma).contains(&within),
                "{all:?}"
            );
            // What either tail has nominally, and four standard deviations.
            let tail = 2.5 + 400.0 * (0.025 * 0.975 / f64::from(all.files)).sqrt();
            assert!(all.percent(all.passed) <= tail, "{all:?}");
            assert!(all.percent(all.failed) <= tail, "{all:?}");
            assert!(all.percent(all.largest) >= 95.0 - 4.0 * sigma, "{all:?}");
        }
    }
}

/// A robot, the one of its file, and what was measured.
struct Made {
    truth: Robot<f64>,
    nominal: Robot<f64>,
    samples: Vec<Sample<f64>>,
}

/// The edge of the cube on the axis where the robot works, in forearms.
const REGION: f64 = 0.5;

/// The middle of the region: the joints at 40° or, where the robot does not get there or is near to a singularity,
/// at others.
fn centre(robot: &Robot<f64>) -> Vector3<f64> {
    let angles = [40_f64, 50.0, 60.0, 70.0, 80.0, 30.0, 20.0];
    let found = angles.into_iter().find_map(|degrees| {
        let joints = [degrees.to_radians(); 3];
        let place = robot.forward(&joints).ok()?;
        (robot.singularity_distance(&place, &joints).parallel > 0.1).then_some(place)
    });
    found.unwrap()
}

/// Where the robot works: a cube of this centre and half an edge, in parts from −1 to 1.
struct Region<'a> {
    truth: &'a Robot<f64>,
    nominal: &'a Robot<f64>,
    centre: Vector3<f64>,
    half: f64,
}

impl<'a> Region<'a> {
    fn of(truth: &'a Robot<f64>, nominal: &'a Robot<f64>) -> Self {
        Self {
            truth,
            nominal,
            centre: centre(nominal),
            half: 0.5 * REGION * nominal.arms()[0].lb(),
        }
    }

    /// The joints at a place that both robots reach, within the joint limits.
    fn joints(&self, parts: Vector3<f64>) -> Option<[f64; 3]> {
        let place = self.centre + parts * self.half;
        let joints = self.truth.inverse(&place).ok()?;
        let limits = paper_limits();
        let within = joints
            .iter()
            .all(|q| *q > limits.minimum() && *q < limits.maximum());
        let clear = self.truth.singularity_distance(&place, &joints).is_clear();
        let there = (self.truth.forward(&joints).ok()? - place).norm() < 1e-6;
        (within && clear && there && self.nominal.forward(&joints).is_ok()).then_some(joints)
    }
}

/// With errors of that part of 0.5 mm and 0.2°.
fn robot(nominal: &Robot<f64>, factor: f64, rng: &mut Pcg32) -> Robot<f64> {
    let (length, angle) = (0.5 * factor, 0.2_f64.to_radians() * factor);
    perturbed(nominal, length, angle, Spread::Normal, rng)
}

/// Measured at random poses anywhere, or where the robot works.
fn made(nominal: &Robot<f64>, factor: f64, rows: usize, edges: bool, rng: &mut Pcg32) -> Made {
    let truth = robot(nominal, factor, rng);
    let region = Region::of(&truth, nominal);
    let mut samples = Vec::new();
    if edges {
        samples = measurements(&truth, rows, Some(&noise()), rng);
    }
    while samples.len() < rows {
        if let Some(joints) = region.joints(Vector3::from_fn(|_, _| uniform(rng))) {
            samples.push(simulate_sample(&truth, &joints, Some(&noise()), rng).unwrap());
        }
    }
    Made {
        truth,
        nominal: nominal.clone(),
        samples,
    }
}

/// Where the robot is, and where its file says it is.
fn pairs(
    robot: &Made,
    joints: impl Iterator<Item = [f64; 3]>,
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    joints
        .filter_map(|q| {
            Some((
                robot.truth.forward(&q).ok()?,
                robot.nominal.forward(&q).ok()?,
            ))
        })
        .collect()
}

/// At a sequence of low discrepancy, which gives the mean square better than thousands of places at random: multiples of the
/// powers of 1/g, g⁴ = g + 1, the parts behind the point.
fn held_out(robot: &Made) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    const POWERS: [f64; 3] = [0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9];
    let region = Region::of(&robot.truth, &robot.nominal);
    let part = |number: u32, power: f64| 2.0 * (f64::from(number) * power).fract() - 1.0;
    let places = (1..=200).map(|number| POWERS.map(|power| part(number, power)));
    pairs(
        robot,
        places.filter_map(|parts| region.joints(parts.into())),
    )
}

fn rms(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> f64 {
    let squares: f64 = pairs
        .iter()
        .map(|(is, said)| (is - said).norm_squared())
        .sum();
    (squares / pairs.len() as f64).sqrt()
}

/// Where the file's robot is after the rigid motion that fits the true one best.
fn moved(pairs: Vec<(Vector3<f64>, Vector3<f64>)>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let frame = RigidTransform::align(pairs.iter().map(|(is, said)| (*said, *is))).unwrap();
    let moved = pairs.into_iter().map(|(is, said)| (is, frame.apply(&said)));
    moved.collect()
}

/// Where the robot is, and where its file says it is, all over what the joints reach.
fn anywhere(robot: &Made, count: usize, rng: &mut Pcg32) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let pose = |_| random_pose(&robot.truth, &paper_limits(), rng).unwrap();
    pairs(robot, (0..count).map(pose).map(|pose| pose.joints))
}

/// The largest error at the measured poses.
fn largest(robot: &Made, frame: Frame) -> f64 {
    let at = pairs(robot, robot.samples.iter().map(|sample| sample.joints));
    let at = match frame {
        Frame::Base => at,
        Frame::Sensor => moved(at),
    };
    let lengths = at.iter().map(|(is, said)| (is - said).norm());
    lengths.fold(0.0, f64::max)
}

/// The robot file that states the noise.
fn robot_file(robot: &Robot<f64>) -> RobotFile {
    RobotFile {
        noise: Some(noise()),
        ..RobotFile::of("robot.toml", robot.clone(), paper_limits())
    }
}

/// The measurements, in the frame of a sensor somewhere if that is asked for.
fn samples_file(robot: &Made, frame: Frame) -> Readings {
    let at = match frame {
        Frame::Base => RigidTransform::identity(),
        Frame::Sensor => RigidTransform {
            rotation: Rotation3::from_euler_angles(0.3, -0.5, 2.0).into_inner(),
            translation: Vector3::new(1200.0, -700.0, 300.0),
        },
    };
    let samples = robot.samples.iter().map(|sample| Sample {
        joints: sample.joints,
        position: at.apply(&sample.position),
    });
    Readings::of_samples("samples.csv", &samples.collect::<Vec<_>>())
}
