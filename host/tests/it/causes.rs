//! Errors that the model cannot represent: how often they are found and named, and how often where there are none.

use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, standard_normal};
use delta_cal::{Noise, Robot, Sample, SymmetricRobot, Tolerance};
use delta_cal_host::{Frame, Options, Report, calibrate};
use delta_cal_host::{Readings, RobotFile};
use delta_cal_tests::{Spread, generator, perturbed};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;

/// Base radius, platform radius, upper arm and forearm, mm.
const GEOMETRIES: [[f64; 4]; 6] = [
    [194.0, 30.0, 260.0, 480.0],
    [200.0, 45.0, 235.0, 800.0],
    [60.0, 40.0, 400.0, 900.0],
    [60.0, 110.0, 250.0, 520.0],
    [150.0, 60.0, 250.0, 275.0],
    [60.0, 25.0, 80.0, 180.0],
];

/// One σ of each coordinate, mm, and of each joint angle, degrees.
const NOISE: (f64, f64) = (0.02, 0.002);

/// What is wrong with a robot; of a joint's error also which joint.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    Nothing,
    /// Degrees.
    Eccentricity(f64),
    Gear(f64),
    /// Degrees.
    TwiceATurn(f64),
    /// Degrees, to either side.
    Backlash(f64),
    /// At 300 mm for an upper arm of 260 mm, in proportion for others; mm.
    Sag(f64),
    /// From the first row to the last, along x; mm.
    Drift(f64),
}

/// A robot, and what it does with the joint angles that it reports.
struct Faulty {
    truth: Robot<f64>,
    fault: Fault,
    joint: usize,
    phase: f64,
    size: f64,
}

impl Faulty {
    /// The positions of reported joint angles; `None` out of reach.
    fn position(&self, reported: &[f64; 3], directions: &[f64; 3]) -> Option<Vector3<f64>> {
        let mut joints = *reported;
        let q = joints[self.joint];
        joints[self.joint] += match self.fault {
            Fault::Eccentricity(amplitude) => amplitude.to_radians() * (q + self.phase).cos(),
            Fault::TwiceATurn(amplitude) => amplitude.to_radians() * (2.0 * q + self.phase).cos(),
            Fault::Gear(ratio) => ratio * q,
            Fault::Backlash(half) => half.to_radians() * directions[self.joint],
            Fault::Nothing | Fault::Sag(_) | Fault::Drift(_) => 0.0,
        };
        let mut position = self.truth.forward(&joints).ok()?;
        if let Fault::Sag(sag) = self.fault {
            let radius = position.xy().norm() / (300.0 / 260.0 * self.size);
            position.z -= sag * radius * radius;
        }
        Some(position)
    }
}

/// What a simulated calibration begins with.
#[derive(Debug, Clone, Copy)]
struct Setting {
    geometry: [f64; 4],
    rows: u32,
    noise_stated: bool,
    tolerance_stated: bool,
    in_sensor_frame: bool,
}

struct Simulated {
    robot: RobotFile,
    readings: Readings,
    faulty: Faulty,
}

/// A robot made to a tolerance of 0.5 mm and 0.2°, with lengths in proportion to the upper arm where
/// that is small, measured at random poses in random order.
fn simulate(setting: &Setting, fault: Fault, campaign: u64, seed: u64) -> Simulated {
    let mut rng = generator(campaign, seed);
    let [base_radius, platform_radius, upper_arm, forearm] = setting.geometry;
    let nominal = SymmetricRobot {
        base_radius,
        platform_radius,
        upper_arm,
        forearm,
    };
    let nominal = nominal.robot().unwrap();
    let (length, angle) = (0.5, 0.2_f64.to_radians());
    let truth = perturbed(&nominal, length, angle, Spread::Normal, &mut rng);
    let limits = JointLimits::new((-60_f64).to_radians(), 90_f64.to_radians()).unwrap();
    let faulty = Faulty {
        truth,
        fault,
        joint: usize::try_from(seed % 3).unwrap(),
        phase: std::f64::consts::PI * standard_normal::<f64, _>(&mut rng),
        size: upper_arm,
    };
    let frame = sensor_frame(setting.in_sensor_frame, &mut rng);
    let mut before: Option<[f64; 3]> = None;
    let mut rows = Vec::new();
    while rows.len() < usize::try_from(setting.rows).unwrap() {
        let joints = random_pose(&truth, &limits, &mut rng).unwrap().joints;
        let from = before.unwrap_or(joints);
        let directions = std::array::from_fn(|arm| (joints[arm] - from[arm]).signum());
        let Some(mut position) = faulty.position(&joints, &directions) else {
            continue;
        };
        let part = f64::from(u32::try_from(rows.len()).unwrap()) / f64::from(setting.rows - 1);
        if let Fault::Drift(drift) = fault {
            position.x += drift * part;
        }
        let measured = position.map(|c| c + NOISE.0 * standard_normal::<f64, _>(&mut rng));
        let noise = NOISE.1.to_radians();
        rows.push(Sample {
            joints: joints.map(|q| q + noise * standard_normal::<f64, _>(&mut rng)),
            position: frame.apply(&measured),
        });
        before = Some(joints);
    }
    Simulated {
        robot: RobotFile {
            tolerance: setting
                .tolerance_stated
                .then(|| Tolerance::new(length, angle).unwrap()),
            noise: setting
                .noise_stated
                .then(|| Noise::new(NOISE.0, NOISE.1.to_radians()).unwrap()),
            ..RobotFile::of("robot.toml", nominal, limits)
        },
        readings: Readings::of_samples("samples.csv", &rows),
        faulty,
    }
}

fn sensor_frame(asked: bool, rng: &mut Pcg32) -> RigidTransform<f64> {
    if !asked {
        return RigidTransform::identity();
    }
    let mut vector = || Vector3::from_fn(|_, _| standard_normal::<f64, _>(rng));
    RigidTransform {
        rotation: *Rotation3::from_scaled_axis(vector()).matrix(),
        translation: 500.0 * vector(),
    }
}

fn calibrated(simulated: &Simulated, setting: &Setting) -> Option<Report> {
    let frame = if setting.in_sensor_frame {
        Frame::Sensor
    } else {
        Frame::Base
    };
    let options = Options {
        frame,
        ..Options::default()
    };
    calibrate(&simulated.robot, &simulated.readings, &options).ok()
}

/// The name that a fault is to be given, and the arm if it is a joint's.
fn name_of(fault: Fault) -> Option<(&'static str, bool)> {
    Some(match fault {
        Fault::Nothing => return None,
        Fault::Eccentricity(_) => ("eccentricity", true),
        Fault::Gear(_) => ("gear_ratio", true),
        Fault::TwiceATurn(_) => ("second_harmonic", true),
        Fault::Backlash(_) => ("backlash", true),
        Fault::Sag(_) => ("sag", false),
        Fault::Drift(_) => ("drift", false),
    })
}

/// 0.3 % of the files is what the tests allow; of 192 files three are exceeded less than once in 300 runs of other seeds.
#[test]
fn files_without_a_cause_have_none_found() {
    let (mut tested, mut alarms) = (0, 0);
    for (place, geometry) in GEOMETRIES.into_iter().enumerate() {
        for cell in 0..32_u32 {
            let bit = |place: u32| cell >> place & 1 == 1;
            let setting = Setting {
                geometry,
                rows: 14 + 7 * cell % 47,
                noise_stated: bit(0),
                tolerance_stated: bit(1),
                in_sensor_frame: bit(2),
            };
            let seed = u64::from(cell) + 100 * place as u64;
            let simulated = simulate(&setting, Fault::Nothing, 300, seed);
            let Some(report) = calibrated(&simulated, &setting) else {
                continue;
            };
            tested += usize::from(report.causes_not_tested.is_none());
            alarms += usize::from(!report.causes.is_empty());
        }
    }
    assert!(tested > 120, "{tested}");
    assert!(alarms <= 3, "{alarms} of {tested}");
}

/// Faults of some five times the noise, in both frames: named, or said to be as likely as what is named.
#[test]
fn faults_are_named_with_their_arm() {
    let faults = [
        Fault::Eccentricity(0.05),
        Fault::Gear(0.002),
        Fault::TwiceATurn(0.03),
        Fault::Backlash(0.03),
        Fault::Sag(0.4),
        Fault::Drift(0.2),
    ];
    for fault in faults {
        let mut named = 0;
        let mut robots = 0;
        for seed in 0..8_u64 {
            let setting = Setting {
                geometry: GEOMETRIES[usize::try_from(seed).unwrap() % 2],
                rows: 40,
                noise_stated: true,
                tolerance_stated: true,
                in_sensor_frame: seed % 4 == 3,
            };
            let simulated = simulate(&setting, fault, 301, seed);
            robots += 1;
            // A refusal because the residuals contradict the noise is right as well.
            let Some(report) = calibrated(&simulated, &setting) else {
                named += 1;
                continue;
            };
            let (name, of_joint) = name_of(fault).unwrap();
            let arm = of_joint.then_some(simulated.faulty.joint + 1);
            let own = |cause: &&delta_cal_host::calibration::causes::Cause| {
                let alternative = arm.map_or_else(String::new, |arm| format!("arm {arm}"));
                (cause.kind.name() == name && cause.arm == arm)
                    || cause
                        .alternatives
                        .iter()
                        .any(|other| other.ends_with(&alternative))
            };
            named += usize::from(report.causes.iter().any(|cause| own(&cause)));
        }
        assert!(named + 1 >= robots, "{fault:?}: {named} of {robots}");
    }
}

/// Forearms of the file that are 1.2 % too long: the robot can be so, and a scale of the instrument is not named in its place.
#[test]
fn a_wrong_length_of_the_file_is_no_cause() {
    let mut accepted = 0;
    for (seed, geometry) in (0..).zip(GEOMETRIES) {
        let setting = Setting {
            geometry,
            rows: 40,
            noise_stated: true,
            tolerance_stated: true,
            in_sensor_frame: false,
        };
        let mut simulated = simulate(&setting, Fault::Nothing, 302, seed);
        let mut parameters = simulated.robot.robot.parameters();
        for arm in &mut parameters {
            arm[7] *= 1.012;
        }
        simulated.robot.robot = simulated.robot.robot.with_parameters(parameters).unwrap();
        let Some(report) = calibrated(&simulated, &setting) else {
            continue;
        };
        accepted += 1;
        assert!(
            report.causes.is_empty(),
            "{geometry:?}: {:?}",
            report.causes
        );
    }
    assert!(accepted > 2, "{accepted}");
}
