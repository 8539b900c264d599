//! Every kind of reading in every frame, weighted or not, with no target, one or two, through every command that takes
//! samples: the robot that made them is known, and what one command says of a file the others say too.

use crate::support::simulated::{judged, mount, position_errors, push, rotary};
use delta_cal::frame::RigidTransform;
use delta_cal::simulate::{made_robot, random_pose, standard_normal};
use delta_cal::{ArmIndex, Noise, Parameter, Robot};
use delta_cal_host::files::robot_file::{DatumPoint, KnownPlane, NamedPoint};
use delta_cal_host::planning::{Determined, Kind, PlanRequest, Wishes};
use delta_cal_host::validation::{Request, Verdict, validate};
use delta_cal_host::{Frame, Options, Reading, ReadingFrom, Readings, RobotFile, calibrate};
use delta_cal_tests::size;
use nalgebra::{Rotation3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Read {
    Positions,
    /// Every third without z.
    Partly,
    Heights,
    /// From three points.
    Wires,
    /// Between two poses.
    Bars,
    /// Positions and heights in turn.
    Both,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum In {
    Base,
    Sensor,
    /// For a validation the frame in the robot file.
    Stored,
    Datum,
}

#[derive(Debug, Clone, Copy)]
struct Case {
    read: Read,
    frame: In,
    weighted: bool,
    targets: usize,
}

/// One σ of a reading, mm; of a weighted row in turn.
const SIGMA: f64 = 0.02;
const SIGMAS: [f64; 2] = [0.01, 0.2];
/// Of a joint, radians.
const JOINT: f64 = 6e-5;
const TARGETS: [[f64; 3]; 2] = [[12.0, -5.0, -50.0], [-40.0, 20.0, -65.0]];
/// Where the plane really is, and the σ of what is stated of instruments, mm.
const PLANE: f64 = -700.03;
const STATED: f64 = 0.05;
const ROWS: usize = 60;
/// A robot that is right passes this limit, and one whose forearm is 3 mm longer fails it.
const LIMIT: f64 = 0.3;

fn all() -> Vec<Case> {
    let mut cases = Vec::new();
    for read in [
        Read::Positions,
        Read::Partly,
        Read::Heights,
        Read::Wires,
        Read::Bars,
        Read::Both,
    ] {
        let coordinates = matches!(read, Read::Positions | Read::Partly | Read::Both);
        let frames = [In::Base, In::Sensor, In::Stored, In::Datum];
        for frame in &frames[..if coordinates { 4 } else { 1 }] {
            // Every pair of these occurs; in the long campaign all of them.
            let pairs = [
                (false, 0),
                (true, 2),
                (true, 1),
                (false, 2),
                (true, 0),
                (false, 1),
            ];
            let turn = 2 * ((read as usize + *frame as usize) % 3);
            for (weighted, targets) in size(&pairs[turn..turn + 2], &pairs[..]).iter().copied() {
                let frame = *frame;
                cases.push(Case {
                    read,
                    frame,
                    weighted,
                    targets,
                });
            }
        }
    }
    cases
}

/// The sensor's frame.
fn sensor() -> RigidTransform<f64> {
    RigidTransform {
        rotation: *Rotation3::from_scaled_axis(Vector3::new(0.3, -0.5, 0.8)).matrix(),
        translation: Vector3::new(700.0, -200.0, 300.0),
    }
}

fn points() -> [Vector3<f64>; 4] {
    let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    [
        at(500.0, 0.0, -750.0),
        at(-300.0, 400.0, -800.0),
        at(-200.0, -450.0, -700.0),
        at(0.0, 300.0, 100.0),
    ]
}

impl Case {
    fn options(self) -> Options {
        Options::in_frame(match self.frame {
            In::Base => Frame::Base,
            _ => Frame::Sensor,
        })
    }

    /// The robot file before a calibration, and readings that name its instruments.
    fn file(self, rng: &mut Pcg32) -> (RobotFile, Readings) {
        let mut mounting = Pcg32::seed_from_u64(rng.clone().next_u64());
        let mut normal = |sigma: f64| sigma * standard_normal::<f64, _>(rng);
        let mut file = rotary(true).remove(0);
        let mut readings = Readings::of_name("samples.csv");
        let mut off = |own: f64| own + SIGMA * standard_normal::<f64, _>(&mut mounting);
        let targets = TARGETS.map(|own| Vector3::from(own.map(&mut off)));
        mount(&mut file, &mut readings, &targets[..self.targets], SIGMA);
        file.noise = (!self.weighted).then(|| Noise::new(SIGMA, JOINT).unwrap());
        let facts = &mut file.instruments;
        facts.joint_noise = Some(JOINT);
        facts.height_noise = (!self.weighted).then_some(SIGMA);
        facts.distance_noise = facts.height_noise;
        if matches!(self.read, Read::Heights | Read::Both) {
            readings.planes.push("table".to_owned());
            facts.planes.push(KnownPlane {
                name: "table".to_owned(),
                line: 0,
                height: PLANE + normal(STATED),
                sigma: STATED,
                tilt: Some(1e-4),
                blocks: Vec::new(),
            });
        }
        if self.read == Read::Wires {
            for (index, place) in points().into_iter().take(3).enumerate() {
                let name = format!("P{index}");
                readings.points.push(name.clone());
                facts.points.push(NamedPoint {
                    name,
                    line: 0,
                    place: Some((place.map(|own| own + normal(STATED)), STATED)),
                    offset_unknown: false,
                    lengths: None,
                });
            }
        }
        if self.frame == In::Datum {
            let datum = |(index, place): (usize, Vector3<f64>)| DatumPoint {
                name: format!("D{index}"),
                place,
                seen: sensor().apply(&place).map(|own| own + normal(SIGMA)),
                sigma: Some(SIGMA),
            };
            facts.datum = points().into_iter().enumerate().map(datum).collect();
        }
        (file, readings)
    }

    fn measure(
        self,
        file: &RobotFile,
        truth: &Robot<f64>,
        readings: &mut Readings,
        rng: &mut Pcg32,
    ) {
        let frame = match self.frame {
            In::Base => RigidTransform::identity(),
            _ => sensor(),
        };
        for index in 0..ROWS {
            let [pose, other] = [(); 2].map(|()| random_pose(truth, &file.limits, rng).unwrap());
            let sigma = if self.weighted {
                SIGMAS[index % 2]
            } else {
                SIGMA
            };
            // Each is read as often with either σ.
            let target = index / 2 % self.targets.max(1);
            let place = TARGETS[..self.targets].get(target).copied();
            let touched = pose.position + place.map_or_else(Vector3::zeros, Vector3::from);
            let mut row = Reading::at(
                pose.joints
                    .map(|q| q + JOINT * standard_normal::<f64, _>(rng)),
            );
            let mut normal = || sigma * standard_normal::<f64, _>(rng);
            row.sigma = self.weighted.then_some(sigma);
            row.target = target;
            match self.read {
                Read::Heights => row.height = Some((0, touched.z - PLANE + normal())),
                // Both σ occur in both kinds.
                Read::Both if index % 4 < 2 => row.height = Some((0, touched.z - PLANE + normal())),
                Read::Wires => {
                    let away = (touched - points()[index % 3]).norm();
                    row.distance = Some((ReadingFrom::Point(index % 3), away + normal()));
                }
                Read::Bars => {
                    let away = (pose.position - other.position).norm();
                    row.distance = Some((ReadingFrom::Pose(other.joints), away + normal()));
                }
                Read::Positions | Read::Partly | Read::Both => {
                    let seen = frame.apply(&touched).map(|own| own + normal());
                    row.position = seen.data.0[0].map(Some);
                    if self.read == Read::Partly && index % 3 == 0 {
                        row.position[2] = None;
                    }
                }
            }
            push(readings, &row);
        }
    }
}

/// A calibration's errors are as large as it says, `plan --samples` expects the same of the rows, and a validation passes
/// the robot that was measured and fails another one, with a noise as large as what the rows were made with.
#[test]
fn all_commands_say_the_same_of_the_same_readings() {
    let cases = (1..).zip(all());
    // In the short campaign every other one, so that every pair still occurs.
    let cases: Vec<_> = cases.filter(|own| own.0 % 4 < size(2, 4)).collect();
    let sums = std::thread::scope(|threads| {
        let each = cases.chunks(cases.len().div_ceil(8));
        let each: Vec<_> = each.map(|own| threads.spawn(|| agreed(own))).collect();
        let sums = each.into_iter().map(|own| own.join().unwrap());
        sums.collect::<Vec<_>>()
    });
    let sum = |of: usize, part: usize| sums.iter().map(|own| own[of][part]).sum::<f64>();
    let ratio = [0, 1].map(|of| (sum(of, 0) / sum(of, 1)).sqrt());
    assert!(
        ratio.iter().all(|own| (0.75..1.3).contains(own)),
        "{ratio:?}"
    );
}

/// Sums of the squared absolute and relative errors in stated ones, and their numbers.
fn agreed(cases: &[(u64, Case)]) -> [[f64; 2]; 2] {
    let mut sums = [[0.0; 2]; 2];
    for &(seed, case) in cases {
        let mut rng = Pcg32::seed_from_u64(seed);
        let (file, mut readings) = case.file(&mut rng);
        let tolerance = file.tolerance.as_ref().unwrap();
        let truth = made_robot(&file.robot, tolerance, &mut rng).unwrap();
        case.measure(&file, &truth, &mut readings, &mut rng);
        let options = case.options();
        let partly = case.read == Read::Partly && case.frame == In::Datum;
        match calibrate(&file, &readings, &options) {
            Err(error) => assert!(
                partly && error.to_string().contains("all of x, y and z"),
                "{case:?}: {error}"
            ),
            Ok(report) => {
                let expected = report.expected_error.unwrap();
                let expected = [expected.absolute_rms_mm, expected.relative_rms_mm];
                let reach = file.reach();
                let found = &report.solution.robot;
                let errors = position_errors(&reach, &judged(&reach, &truth, seed), found, &truth);
                let errors = errors.map(f64::sqrt);
                let absolute =
                    matches!(case.frame, In::Base | In::Datum) && case.read != Read::Bars;
                for of in usize::from(!absolute)..2 {
                    let ratio = errors[of] / expected[of];
                    assert!(ratio < 2.5, "{case:?}: {of} {errors:?} {expected:?}");
                    sums[of][0] += ratio * ratio;
                    sums[of][1] += 1.0;
                }
                let request = PlanRequest {
                    frame: options.frame,
                    ..PlanRequest::new(&file, Wishes::only(Kind::XYZ), 0)
                };
                let planned = Determined::by(&request, &readings, &[]).unwrap();
                assert!(planned.worthwhile, "{case:?}: {}", planned.verdict);
                let planned = planned.expected_error.unwrap();
                let planned = [planned.absolute_rms_mm, planned.relative_rms_mm];
                for of in usize::from(!absolute)..2 {
                    let ratio = planned[of] / expected[of];
                    assert!(
                        (0.85..1.18).contains(&ratio),
                        "{case:?}: {of} {planned:?} {expected:?} {} {:?}",
                        report.sigma_widened_by,
                        report.causes.found
                    );
                }
                for plane in &report.planes {
                    assert!(
                        (plane.z_mm - PLANE).abs() < 4.0 * STATED,
                        "{case:?}: {plane:?}"
                    );
                }
            }
        }
        let request = Request {
            limit: LIMIT,
            frame: options.frame,
            stored: case.frame == In::Stored,
        };
        let mut right = RobotFile {
            robot: truth.clone(),
            sensor_frame: Some(sensor()),
            ..file
        };
        for (own, place) in right.instruments.targets.iter_mut().zip(TARGETS) {
            own.place = place.into();
        }
        let found = validate(&right, &readings, request);
        let found = found.unwrap_or_else(|why| panic!("{case:?}: {why}"));
        assert_eq!(found.verdict, Verdict::Pass, "{case:?}: {found:?}");
        let ratio = found.deviation_mm.rms / found.noise_mm.expect("all σ are stated");
        assert!((0.7..1.4).contains(&ratio), "{case:?}: {ratio}");
        let unused = case.frame == In::Base;
        assert_eq!(
            found.warnings.len(),
            usize::from(unused),
            "{case:?}: {:?}",
            found.warnings
        );
        let mut parameters = truth.parameters();
        parameters[ArmIndex::First.index()][Parameter::Lb.index()] += 6.0;
        right.robot = truth.with_parameters(parameters).unwrap();
        let found = validate(&right, &readings, request).unwrap();
        assert_eq!(found.verdict, Verdict::Fail, "{case:?}: {found:?}");
        if case.read == Read::Wires {
            // Points of which nothing is stated are found.
            right.robot = truth;
            right.instruments.points.clear();
            let found = validate(&right, &readings, request).unwrap();
            assert_eq!(found.verdict, Verdict::Pass, "{case:?}: {found:?}");
        }
    }
    sums
}
