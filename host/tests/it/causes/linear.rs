//! The same of carriages on towers.

use delta_cal::kinematics::JointLimits;
use delta_cal::simulate::{random_pose, standard_normal};
use delta_cal::{ArmIndex, Noise, Robot, Sample, Tolerance};
use delta_cal_host::accuracy::position_uncertainty::PositionUncertainty;
use delta_cal_host::{
    CalibrationReport, CauseKind, InputText, Options, PositionUnit, RobotFile, Row, SamplesFile,
    calibrate,
};
use delta_cal_tests::documents::print_campaign;
use delta_cal_tests::geometries::linear_geometries;
use delta_cal_tests::{generator, size};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

const PAGE: &str = "docs/linear.md";
const ROWS: u32 = 40;
/// Of a coordinate and of a carriage, mm.
const NOISE: (f64, f64) = (0.02, 0.005);

/// What is wrong with a robot, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    Nothing,
    /// The carriage is so much farther along at the ends of its travel than in the middle: a parabola.
    Bent(f64),
    /// To either side.
    Backlash(f64),
    /// At half a forearm from the robot's axis.
    Sag(f64),
    /// From the first row to the last, along x.
    Drift(f64),
}

struct Faulty {
    truth: Robot<f64>,
    fault: Fault,
    tower: usize,
    travel: [f64; 2],
}

impl Faulty {
    fn position(&self, reported: &[f64; 3], directions: &[f64; 3]) -> Option<Vector3<f64>> {
        let mut joints = *reported;
        let s = &mut joints[self.tower];
        let [low, high] = self.travel;
        match self.fault {
            Fault::Bent(ends) => {
                *s += ends * ((*s - 0.5 * (low + high)) / (0.5 * (high - low))).powi(2);
            }
            Fault::Backlash(half) => *s += half * directions[self.tower],
            _ => {}
        }
        let mut position = self.truth.forward(&joints).ok()?;
        if let Fault::Sag(sag) = self.fault {
            let half = 0.5 * self.truth.arms()[0].lb();
            position.z -= sag * position.xy().norm_squared() / (half * half);
        }
        Some(position)
    }

    /// What a refusal says of it.
    fn words(&self) -> String {
        let arm = self.tower + 1;
        match self.fault {
            Fault::Nothing => "no fault".to_owned(),
            Fault::Bent(_) => {
                format!("arm {arm}: at the ends of its measured range the carriage is farther")
            }
            Fault::Backlash(_) => {
                format!("arm {arm}: the carriage's error changes with the direction")
            }
            Fault::Sag(_) => "the platform is lower".to_owned(),
            Fault::Drift(_) => "the measured positions drift".to_owned(),
        }
    }

    /// As it is to be named.
    fn kind(&self) -> Option<(CauseKind, Option<ArmIndex>)> {
        let arm = Some(ArmIndex::ALL[self.tower]);
        match self.fault {
            Fault::Nothing => None,
            Fault::Bent(_) => Some((CauseKind::UnevenTravel, arm)),
            Fault::Backlash(_) => Some((CauseKind::Backlash, arm)),
            Fault::Sag(_) => Some((CauseKind::Sag, None)),
            Fault::Drift(_) => Some((CauseKind::Drift, None)),
        }
    }
}

/// The robot file, the measurements of a robot made to its tolerance at random poses, and what is wrong with it.
fn simulate(
    nominal: &Robot<f64>,
    travel: [f64; 2],
    fault: Fault,
    seed: u64,
    rng: &mut Pcg32,
) -> (RobotFile, SamplesFile, Faulty) {
    let text = "[nominal]\nkind = \"linear\"\ntower_radius_mm = 140\nforearm_mm = 330\n\
                [joints]\nmin_mm = 100\nmax_mm = 600\n";
    let mut file = RobotFile::read(&InputText::new("robot.toml", text)).unwrap();
    let tolerance = Tolerance::new(0.5, 3e-3).unwrap();
    let tolerance = tolerance.with_linear(5.0, 1e-3).unwrap();
    file.robot = *nominal;
    file.limits = JointLimits::travel(travel[0], travel[1]).unwrap();
    file.tolerance = Some(tolerance);
    file.noise = Noise::new(NOISE.0, NOISE.1).ok();
    let sigmas = tolerance.of_places(&nominal.arms()[0]);
    let parameters = nominal.parameters().map(|mut arm| {
        for (value, sigma) in arm.iter_mut().zip(sigmas) {
            *value += sigma * standard_normal::<f64, _>(rng);
        }
        arm
    });
    let faulty = Faulty {
        truth: nominal.with_parameters(parameters).unwrap(),
        fault,
        tower: usize::try_from(seed % 3).unwrap(),
        travel,
    };
    let mut before: Option<[f64; 3]> = None;
    let mut rows = Vec::new();
    while rows.len() < usize::try_from(ROWS).unwrap() {
        let joints = random_pose(&faulty.truth, &file.limits, rng)
            .unwrap()
            .joints;
        let from = before.unwrap_or(joints);
        let directions = std::array::from_fn(|arm| (joints[arm] - from[arm]).signum());
        let Some(mut position) = faulty.position(&joints, &directions) else {
            continue;
        };
        let line = u64::try_from(rows.len()).unwrap() + 2;
        if let Fault::Drift(drift) = fault {
            position.x +=
                drift * f64::from(u32::try_from(rows.len()).unwrap()) / f64::from(ROWS - 1);
        }
        let value = Sample {
            joints: joints.map(|s| s + NOISE.1 * standard_normal::<f64, _>(rng)),
            position: position.map(|c| c + NOISE.0 * standard_normal::<f64, _>(rng)),
        };
        rows.push(Row { line, value });
        before = Some(joints);
    }
    let samples = SamplesFile {
        name: "samples.csv".to_owned(),
        rows,
        all: None,
        in_degrees: false,
        positions_in: PositionUnit::Millimetre,
    };
    (file, samples, faulty)
}

/// Achieved over reported error of the positions, squared.
fn achieved_over_reported(
    file: &RobotFile,
    faulty: &Faulty,
    report: &CalibrationReport,
    rng: &mut Pcg32,
) -> f64 {
    let uncertainty = PositionUncertainty {
        robot: &report.after.robot,
        covariance: report.outcome.covariance.as_ref().unwrap(),
    };
    let (mut squares, mut variances) = (0.0, 0.0);
    for _ in 0..100 {
        let joints = random_pose(&faulty.truth, &file.limits, rng)
            .unwrap()
            .joints;
        let is = faulty.position(&joints, &[1.0; 3]);
        if let (Some(is), Ok(said)) = (is, report.after.robot.forward(&joints)) {
            squares += (is - said).norm_squared();
            variances += uncertainty.sigma(&said, &joints).unwrap().powi(2);
        }
    }
    squares / variances
}

/// How often a fault is found in the files of four geometries, how often it is named, and what the reported σ is
/// worth.
#[test]
fn faults_of_towers_are_found_and_named() {
    let files = size(10, 100);
    for (fault, words, least) in [
        (Fault::Nothing, "no fault", 0.0),
        (Fault::Bent(0.05), "bent tower 0.05 mm", 0.0),
        (Fault::Bent(0.1), "bent tower 0.1 mm", 0.8),
        (Fault::Backlash(0.03), "backlash ±0.03 mm", 0.8),
        (Fault::Sag(0.05), "sag 0.05 mm", 0.0),
        (Fault::Sag(0.1), "sag 0.1 mm", 0.8),
        (Fault::Drift(0.1), "drift 0.1 mm", 0.8),
    ] {
        let [mut found, mut named, mut all, mut squares, mut reported] = [0.0; 5];
        for (index, (_, nominal, travel)) in (0..).zip(linear_geometries()) {
            for seed in 0..files {
                let mut rng = generator(9700 + index, seed);
                let (file, samples, faulty) = simulate(&nominal, travel, fault, seed, &mut rng);
                all += 1.0;
                match calibrate(&file, &samples, Options::default()) {
                    Ok(report) => {
                        let causes = &report.causes.found;
                        found += f64::from(u8::from(!causes.is_empty()));
                        let is = |kind, arm| faulty.kind() == Some((kind, arm));
                        let by_name = causes.first().is_some_and(|cause| {
                            let others = &cause.alternatives;
                            is(cause.kind, cause.arm)
                                || others.iter().any(|other| is(other.kind, other.arm))
                        });
                        named += f64::from(u8::from(by_name));
                        squares += achieved_over_reported(&file, &faulty, &report, &mut rng);
                        reported += 1.0;
                    }
                    Err(refusal) => {
                        let refusal = refusal.to_string();
                        found += f64::from(u8::from(refusal.contains("a cause that the model")));
                        named += f64::from(u8::from(refusal.contains(&faulty.words())));
                    }
                }
            }
        }
        let ratio = f64::sqrt(squares / reported);
        let shown = match fault {
            Fault::Drift(_) => "–".to_owned(),
            _ => format!("{ratio:.2}"),
        };
        print_campaign(
            PAGE,
            &format!(
                "| {words} | {:.0} | {:.0} | {shown} |",
                100.0 * found / all,
                100.0 * named / all
            ),
        );
        assert!(named >= least * all, "{words}: {named} of {all}");
        // 40 files in the short run, one or none of which may have something found by chance.
        assert!(
            fault != Fault::Nothing || found <= 1.0 + 0.01 * all,
            "{found} of {all}"
        );
        // Where a sensor that moves stood before, nobody knows.
        if let Fault::Drift(_) = fault {
            continue;
        }
        // What the model does not hold makes the error several times what the noise alone makes it.
        assert!(ratio < 1.6, "{words}: {ratio}");
    }
}
